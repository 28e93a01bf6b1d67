//! The whole identification: models, terms and methods, each judged on samples that did not choose it.
//!
//! 1. Folds of the samples choose the residual model, and, rung by rung, the terms beyond MDH: more terms only where
//!    the held-out errors fall by more than their paired standard error.
//! 2. Rows that fit far worse than the rest are left out and named.
//! 3. Every method solves the same problem; the one that predicts a held-out fifth best is kept, the cheapest of equals.
//!
//! Verify rows take no part in any choice.

use nalgebra::DVector;
use rayon::prelude::*;

use super::Error;
use super::blocks::Scatter;
use super::dataset::{Dataset, Kind, shuffle};
use super::prepare::Prepared;
use super::problem::{Problem, Solution};
use super::settings::{Extensions, Method, Model, Settings};
use super::swarm;
use super::terms::Terms;
use super::trust_region;
use super::verify::{RowError, errors};
use crate::measurements::Role;
use crate::robot::Robot;

/// Mixed into the seed that draws the folds, so that they differ from the swarm's draws.
const FOLD_SEED: u64 = 0x5f01d;

/// One method on one model, fitted to all rows that may be fitted.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// How it was found.
    pub method: Method,
    /// What was minimised.
    pub model: Model,
    /// What the problem looked like.
    pub prepared: Prepared,
    /// What came out.
    pub solution: Solution,
    /// The identified robot.
    pub robot: Robot,
    /// Root mean square held-out error, mm; `None` where it was not judged.
    pub held_out_mm: Option<f64>,
    /// Squared held-out errors by row, mm^2.
    held_out: Vec<(usize, f64)>,
}

/// A rung of the ladder of terms, or a model, and how it did.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Judged {
    /// The model's name.
    pub model: &'static str,
    /// The terms in words.
    pub terms: String,
    /// Root mean square held-out error, mm; `None` where a fold could not be fitted.
    pub held_out_mm: Option<f64>,
}

/// Everything that was found.
#[derive(Debug, Clone)]
pub struct Identification {
    /// Methods and models, fitted.
    pub candidates: Vec<Candidate>,
    /// Index of the one to use.
    pub chosen: usize,
    /// Terms beyond MDH that were taken.
    pub terms: Terms,
    /// Models and terms on the folds.
    pub judged: Vec<Judged>,
    /// Rows that were left out because they fit far worse than the rest.
    pub outliers: Vec<usize>,
    /// Rows that were fitted.
    pub fitted: Vec<usize>,
    /// The scatter that errors are judged with.
    pub scatter: Scatter,
}

/// One choice of what to minimise.
#[derive(Debug, Clone, Copy)]
struct Choice {
    model: Model,
    terms: Terms,
}

/// What all steps share.
struct Session<'a> {
    set: &'a Dataset,
    robot: &'a Robot,
    settings: &'a Settings,
    seed: u64,
    rows: Vec<usize>,
    scatter: Scatter,
    step: &'a (dyn Fn(&str) + Sync),
}

/// Identifies the robot. `step` hears what is being done.
pub fn identify(
    set: &Dataset,
    robot: &Robot,
    settings: &Settings,
    seed: u64,
    step: &(dyn Fn(&str) + Sync),
) -> Result<Identification, Error> {
    let models = models(set, settings)?;
    let scatter = Scatter { point_mm: 1.0, rotation_rad: 1e-3 };
    let mut session = Session { set, robot, settings, seed, rows: set.fit_rows(), scatter, step };
    let plain = Choice { model: models.first().copied().unwrap_or(Model::CenterDistance), terms: Terms::default() };
    let reference = Choice { model: if set.kind == Kind::Positions { Model::Position } else { plain.model }, ..plain };
    let outliers = session.drop_outliers(reference)?;
    session.scatter = session.prepare(reference, &session.rows)?.estimate.scatter;
    let mut judged = Vec::new();
    let (model, plain) = session.choose_model(&models, &mut judged);
    let terms = match settings.extensions {
        Extensions::None => Terms::default(),
        Extensions::Auto => session.choose_terms(model, plain, &mut judged),
    };
    let choice = Choice { model, terms };
    let methods = settings.method.map_or(Method::ALL.to_vec(), |m| vec![m]);
    let mut candidates = session.run_methods(choice, &methods)?;
    let chosen = best(&candidates);
    for &other in models.iter().filter(|&&m| m != model) {
        if settings.method.is_none()
            && let Ok(candidate) = session.run(Choice { model: other, terms }, Method::TrustRegion, &session.rows)
        {
            candidates.push(candidate);
        }
    }
    Ok(Identification { candidates, chosen, terms, judged, outliers, fitted: session.rows, scatter: session.scatter })
}

/// The models that the data allow, or the one that was asked for.
fn models(set: &Dataset, settings: &Settings) -> Result<Vec<Model>, Error> {
    let all = match set.kind {
        Kind::Distances => vec![Model::CenterDistance],
        Kind::Positions => vec![Model::Position, Model::CenterDistance, Model::PairwiseDistance],
    };
    match settings.model {
        Some(Model::Pose) if !set.has_rotations() => {
            Err(Error::ModelNeeds { model: "pose", needed: "orientations (rx_rad, ry_rad, rz_rad)" })
        }
        Some(Model::Pose) => Ok(vec![Model::Pose]),
        Some(model) if !all.contains(&model) => {
            Err(Error::ModelNeeds { model: model.name(), needed: "positions (x_mm, y_mm, z_mm)" })
        }
        Some(model) => Ok(vec![model]),
        None if set.has_rotations() => Ok([all, vec![Model::Pose]].concat()),
        None => Ok(all),
    }
}

impl Session<'_> {
    fn prepare(&self, choice: Choice, rows: &[usize]) -> Result<Prepared, Error> {
        let parameters = choice.terms.parameters(self.robot);
        Prepared::new(self.set, self.robot, &parameters, rows, choice.model, self.settings)
    }

    fn run(&self, choice: Choice, method: Method, rows: &[usize]) -> Result<Candidate, Error> {
        let prepared = self.prepare(choice, rows)?;
        let solution = solve(&prepared, method, self.settings, self.seed);
        if !solution.cost.is_finite() {
            return Err(Error::NotFinite);
        }
        let offsets = prepared.fit().offsets(&solution.x);
        let robot = self.robot.shifted(prepared.parameters(), &offsets);
        Ok(Candidate {
            method,
            model: choice.model,
            prepared,
            solution,
            robot,
            held_out_mm: None,
            held_out: Vec::new(),
        })
    }

    /// Fits without the rows that fit far worse than the rest, until none does. At most a tenth of the rows go.
    fn drop_outliers(&mut self, choice: Choice) -> Result<Vec<usize>, Error> {
        let mut outliers = Vec::new();
        let most = self.rows.len() / 10;
        let sigmas = self.settings.outlier_sigmas;
        while sigmas > 0.0 && outliers.len() < most {
            let prepared = self.prepare(choice, &self.rows)?;
            let robot = self.robot.shifted(prepared.parameters(), &prepared.fit().offsets(&prepared.free_fit.x));
            let scatter = prepared.estimate.scatter;
            let mut sizes: Vec<(usize, f64)> = self
                .errors(&robot, &self.rows, &self.rows, scatter)
                .iter()
                .filter_map(|e| Some((e.row, e.score_mm2(&scatter)?.sqrt())))
                .collect();
            let largest = sizes.iter().copied().filter(|&(row, _)| self.set.poses[row].role == Role::Sample);
            let Some(worst) = largest.max_by(|a, b| a.1.total_cmp(&b.1)) else { break };
            sizes.sort_by(|a, b| a.1.total_cmp(&b.1));
            // The median of absolute values, as a standard deviation of normal errors.
            let robust = sizes[sizes.len() / 2].1 / 0.6745;
            if worst.1 <= sigmas * robust {
                break;
            }
            self.rows.retain(|&r| r != worst.0);
            outliers.push(worst.0);
        }
        outliers.sort_unstable();
        Ok(outliers)
    }

    fn errors(&self, robot: &Robot, fitted: &[usize], rows: &[usize], scatter: Scatter) -> Vec<RowError> {
        errors(self.set, robot, fitted, rows, scatter, self.settings.wire_offset)
    }

    /// Rows to fit and rows to judge, fold by fold; centres are always fitted.
    fn folds(&self) -> Vec<(Vec<usize>, Vec<usize>)> {
        let mut samples: Vec<usize> =
            self.rows.iter().copied().filter(|&i| self.set.poses[i].role == Role::Sample).collect();
        shuffle(&mut samples, self.seed ^ FOLD_SEED);
        let count = self.settings.folds;
        (0..count)
            .map(|fold| {
                let mut held: Vec<usize> = samples.iter().copied().skip(fold).step_by(count).collect();
                held.sort_unstable();
                (self.rows.iter().copied().filter(|r| held.binary_search(r).is_err()).collect(), held)
            })
            .collect()
    }

    /// Held-out squared errors by row, mm^2; `None` where a fold cannot be fitted.
    fn held_out(&self, choice: Choice) -> Option<Vec<(usize, f64)>> {
        let of_fold = |(fitted, held): &(Vec<usize>, Vec<usize>)| {
            let candidate = self.run(choice, Method::TrustRegion, fitted).ok()?;
            Some(self.scores(&candidate.robot, fitted, held))
        };
        let parts: Option<Vec<Vec<(usize, f64)>>> = self.folds().par_iter().map(of_fold).collect();
        let mut all = parts?.concat();
        all.sort_by_key(|&(row, _)| row);
        Some(all)
    }

    fn scores(&self, robot: &Robot, fitted: &[usize], rows: &[usize]) -> Vec<(usize, f64)> {
        let errors = self.errors(robot, fitted, rows, self.scatter);
        errors.iter().filter_map(|e| Some((e.row, e.score_mm2(&self.scatter)?))).collect()
    }

    fn judge(&self, choice: Choice, judged: &mut Vec<Judged>) -> Option<Vec<(usize, f64)>> {
        (self.step)(&format!("folds: {} with {}", choice.model.name(), choice.terms.name()));
        let held_out = self.held_out(choice);
        judged.push(Judged {
            model: choice.model.name(),
            terms: choice.terms.name(),
            held_out_mm: held_out.as_ref().and_then(|h| root_mean(h)),
        });
        held_out
    }

    /// The first model, which uses most of the data, unless another's held-out errors are clearly less.
    fn choose_model(&self, models: &[Model], judged: &mut Vec<Judged>) -> (Model, Option<Vec<(usize, f64)>>) {
        let mut best: (Model, Option<Vec<(usize, f64)>>) =
            (models.first().copied().unwrap_or(Model::CenterDistance), None);
        if models.len() < 2 {
            return best;
        }
        // Pairwise distances say what positions say (see `pairwise`), at many times the work: compared at the end, not chosen.
        for &model in models.iter().filter(|&&m| m != Model::PairwiseDistance) {
            let held_out = self.judge(Choice { model, terms: Terms::default() }, judged);
            let better = match (&held_out, &best.1) {
                (Some(new), Some(old)) => clearly_less(new, old),
                (new, old) => new.is_some() && old.is_none(),
            };
            if better {
                best = (model, held_out);
            }
        }
        best
    }

    /// `plain` are the held-out errors without terms, where they are known.
    fn choose_terms(&self, model: Model, plain: Option<Vec<(usize, f64)>>, judged: &mut Vec<Judged>) -> Terms {
        let mut best = Terms::default();
        let Some(mut reference) = plain.or_else(|| self.judge(Choice { model, terms: best }, judged)) else {
            return best;
        };
        for rung in Terms::rungs(self.robot) {
            let terms = rung(best);
            if let Some(held_out) = self.judge(Choice { model, terms }, judged)
                && clearly_less(&held_out, &reference)
            {
                (best, reference) = (terms, held_out);
            }
        }
        best
    }

    /// All methods on one problem, each also judged on the first fold where there is a choice.
    fn run_methods(&self, choice: Choice, methods: &[Method]) -> Result<Vec<Candidate>, Error> {
        let fold = self.folds().into_iter().next().filter(|_| methods.len() > 1);
        let mut candidates = Vec::with_capacity(methods.len());
        for &method in methods {
            (self.step)(&format!("{} on {}", method.name(), choice.model.name()));
            let mut candidate = self.run(choice, method, &self.rows)?;
            if let Some((fitted, held)) = &fold
                && let Ok(partial) = self.run(choice, method, fitted)
            {
                candidate.held_out = self.scores(&partial.robot, fitted, held);
                candidate.held_out_mm = root_mean(&candidate.held_out);
            }
            candidates.push(candidate);
        }
        Ok(candidates)
    }
}

fn solve(prepared: &Prepared, method: Method, settings: &Settings, seed: u64) -> Solution {
    let fit = prepared.fit();
    match method {
        Method::TrustRegion => trust_region::solve(&fit, &vec![0.0; fit.dimension()], &settings.trust_region),
        _ => swarm::solve(&fit, method, &settings.swarm(), seed),
    }
}

fn root_mean(scores: &[(usize, f64)]) -> Option<f64> {
    let mean = scores.iter().map(|(_, s)| s).sum::<f64>() / scores.len() as f64;
    (!scores.is_empty()).then_some(mean.sqrt())
}

/// Standard errors by which held-out errors must fall: chance does that in one case of forty.
const CLEARLY: f64 = 2.0;

/// Ratio of held-out errors up to which two methods are alike.
const ALIKE: f64 = 1.02;

/// Whether the mean of `new` is clearly below that of `old`, by the standard error of the paired differences.
fn clearly_less(new: &[(usize, f64)], old: &[(usize, f64)]) -> bool {
    if new.len() != old.len() || new.len() < 2 {
        return false;
    }
    let gains = DVector::from_iterator(new.len(), new.iter().zip(old).map(|((_, n), (_, o))| o - n));
    let standard_error = (gains.variance() / (gains.len() - 1) as f64).sqrt();
    gains.mean() > CLEARLY * standard_error
}

/// The first candidate that none beats by more than chance: the one of least held-out error, or a cheaper one whose
/// errors differ from it by less than their paired standard error or by next to nothing. Solvers of one problem mostly agree to
/// rounding, and what one leaves of the way can be alike at every pose without being worth anything.
fn best(candidates: &[Candidate]) -> usize {
    let judged = |c: &&Candidate| c.held_out_mm.is_some();
    let least = candidates.iter().filter(judged).min_by(|a, b| {
        let error = |c: &Candidate| c.held_out_mm.unwrap_or(f64::INFINITY);
        error(a).total_cmp(&error(b))
    });
    let Some(least) = least else { return 0 };
    let alike = |c: &Candidate| c.held_out_mm <= least.held_out_mm.map(|mm| mm * ALIKE);
    let equal = |c: &Candidate| alike(c) || !clearly_less(&least.held_out, &c.held_out);
    candidates.iter().position(|c| c.held_out_mm.is_some() && equal(c)).unwrap_or(0)
}
