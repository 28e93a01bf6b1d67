//! The whole identification: gross errors named, models judged on samples that did not choose them, methods run and
//! compared.
//!
//! 1. A robust fit names the rows that have no weight; they are left out, until the model that is chosen says whether they are far off
//!    from it too. Verify rows are looked at too, named and kept.
//! 2. Models are compared by forward selection (see [`super::forward_selection`]): more terms only where the held-out errors fall and the
//!    evidence asks for them, against a model that is contained only for what the further terms bring.
//! 3. What of the residuals is smooth over a placement of the sensor counts as one error, not as many.
//! 4. Every method solves the same problem, so the least cost is the best; the cheapest of equals is kept.
//! 5. Verify rows take no part in any choice but one: where the robot found is worse on them than the nominal one by more than another draw
//!    of rows would let expect, nominal is kept. Without verify rows every row is fitted, and judged by fits that it was left out of.

use super::forward_selection::Judged;
use super::found::{Against, Candidate, Deletion, Identification};
use super::session::{Gross, Session};
use crate::identify::Error;
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::data::shared;
use crate::identify::judge::cross_validation::CrossValidation;
use crate::identify::judge::{folds, smooth};
use crate::identify::model::ladder::{Chain, Terms};
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::{Extensions, Method, Model, Settings};
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::problem::Problem;
use crate::identify::solve::{swarm, trust_region};
use crate::robot::Robot;

/// Numbers a parameter that a model needs to tell gross errors by: with fewer, a fit follows them.
const ROWS_TELL: f64 = 2.0;

/// Verify rows with fewer of which a robot is judged by fits without some of the rows: one or two say nothing.
const FEWEST_TO_VERIFY: usize = 3;

/// Costs within this of each other are one: they come from different sums of the same squares.
const SAME_COST: f64 = 1e-6;

/// Evaluations of a pose that each swarm may spend in a comparison of all methods.
const COMPARED_POSES: usize = 4_000_000;

/// Iterations of a swarm in a comparison at the least.
const LEAST_ITERATIONS: usize = 10;

/// How many steps [`identify`] tells of.
pub fn step_count(settings: &Settings) -> u64 {
    // Gross errors and the ladder come before the methods.
    2 + if settings.method.is_none() { Method::ALL.len() as u64 } else { 1 }
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
    let model = models.first().copied().unwrap_or(Model::CenterDistance);
    let extras = if model == Model::PairwiseDistance { Vec::new() } else { shared::unknowns(set, settings) };
    let mut session = Session { set, robot, settings, seed, rows: set.fit_rows(), extras, smooth: None, step };
    let by_points = if set.kind == Kind::Positions { Model::Position } else { model };
    let (terms, judged, gross) = session.model(model, by_points)?;
    let fitted_terms = if terms == Terms::NOMINAL { Terms::default() } else { terms };
    let gross = session.take_back_near(gross, by_points, &fitted_terms)?;
    if matches!(model, Model::Position | Model::Pose) {
        session.smooth = session.smooth_error(by_points, &fitted_terms)?;
    }
    let (mut candidates, deletions) = session.run_methods(model, fitted_terms)?;
    let held_out = |t: &Terms| judged.iter().find(|j| j.terms == t.name()).and_then(|j| j.held_out_mm);
    let nominal_held_out_mm = held_out(&Terms::NOMINAL);
    let chosen = best(&candidates);
    let least = candidates[chosen].cost();
    candidates
        .iter_mut()
        .filter(|c| c.cost() <= least * (1.0 + SAME_COST))
        .for_each(|c| c.held_out_mm = held_out(&fitted_terms));
    if settings.method.is_none() {
        let others = models.iter().filter(|&&m| m != model);
        candidates.extend(others.filter_map(|&m| session.run(m, fitted_terms, Method::TrustRegion).ok()));
    }
    let (scatter, extras) = session.sensor(&candidates[chosen]);
    let mut found = Identification {
        candidates,
        chosen,
        terms,
        judged,
        outliers: gross.outliers,
        doubtful: gross.doubtful,
        verify_outliers: gross.of_verify,
        fitted: session.rows.clone(),
        scatter,
        smooth: session.smooth,
        extras,
        vetoed: false,
        deletions,
        deleted_parameters: fitted_terms.parameters(robot),
    };
    found.vetoed = terms != Terms::NOMINAL
        && settings.extensions == Extensions::Auto
        && settings.method.is_none()
        && found.against_nominal(set, robot, settings) == Against::Worse;
    if terms == Terms::NOMINAL || found.vetoed {
        found.keep_nominal(robot, model, nominal_held_out_mm);
    }
    Ok(found)
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
        // An orientation is worth what its own residuals say.
        None if set.has_rotations() => Ok([vec![Model::Pose], all].concat()),
        None => Ok(all),
    }
}

impl Session<'_> {
    /// The scatter that a fit left, and the values of the sensor's unknowns.
    fn sensor(&self, of: &Candidate) -> (Scatter, Vec<(Extra, f64)>) {
        match &of.found {
            Some((formulation, _)) => {
                let values = formulation.extras().iter().copied();
                (formulation.rows.scatter, self.extras.iter().copied().zip(values).collect())
            }
            None => (Scatter::of_point(1.0), Vec::new()),
        }
    }

    /// Gross errors, and the terms that are worth taking; rows that fit far worse than the rest are then left out.
    fn model(&mut self, model: Model, by_points: Model) -> Result<(Terms, Vec<Judged>, Gross), Error> {
        (self.step)("gross errors");
        let first = self.reference(ROWS_TELL);
        let mut gross = self.drop_outliers(by_points, &first)?;
        if model == Model::Pose && self.set.target_unknowns(false).is_empty() {
            self.extras.extend((0..3).map(Extra::Target));
        }
        (self.step)("models of the robot");
        let (terms, judged) = match self.settings.extensions {
            Extensions::None => (Terms::default(), Vec::new()),
            Extensions::Auto => self.select_terms(by_points)?,
        };
        if terms.chain == Chain::Mdh && terms != first && self.tells(&terms, ROWS_TELL) {
            // A row that a poorer model could not follow is no gross error, and a richer one follows too much.
            self.rows = self.set.fit_rows();
            gross = self.drop_outliers(by_points, &terms)?;
        } else if terms.chain > first.chain {
            // Too few rows to look for them anew: a row that alone tells of a parameter is none where that parameter is
            // fitted.
            gross = self.take_back(gross, by_points, &terms)?;
        }
        Ok((terms, judged, gross))
    }

    /// A smooth error that the points of each placement share, where they tell of one. It comes after the terms: what
    /// the robot does wrong is as smooth, and a robot that is corrected is worth more than one about which less is
    /// certain.
    fn smooth_error(&self, model: Model, terms: &Terms) -> Result<Option<smooth::Detected>, Error> {
        let parameters = terms.parameters(self.robot);
        let at = Formulation::new(&self.task(&parameters, model))?;
        let sds = at.tolerance.standard_deviations(&parameters, &self.extras);
        Ok(smooth::most_probable(&at.rows, &at.offsets_of(), &sds))
    }

    fn run(&self, model: Model, terms: Terms, method: Method) -> Result<Candidate, Error> {
        let parameters = terms.parameters(self.robot);
        let formulation = Formulation::new(&self.task(&parameters, model))?;
        self.solved(&formulation, method)
    }

    fn solved(&self, formulation: &Formulation, method: Method) -> Result<Candidate, Error> {
        let fit = formulation.fit();
        let solution = match method {
            Method::TrustRegion => {
                let start = &formulation.free_fit.x[..fit.dimension()];
                trust_region::solve(&fit, start, &self.settings.trust_region)
            }
            _ => {
                let mut swarm = self.settings.swarm();
                if self.settings.method.is_none() {
                    let evaluations = COMPARED_POSES / formulation.rows.rows.len().max(1);
                    swarm.iterations = swarm.iterations.min((evaluations / swarm.particles).max(LEAST_ITERATIONS));
                }
                swarm::solve(&fit, method, &swarm, self.seed)
            }
        };
        if !solution.cost.is_finite() {
            return Err(Error::NotFinite);
        }
        let offsets = fit.offsets(&solution.x);
        let robot = self.robot.shifted(formulation.parameters(), &offsets);
        let model = formulation.model;
        let found = Some((formulation.clone(), solution));
        Ok(Candidate { name: method.name(), model, found, robot, held_out_mm: None })
    }

    /// All methods on one problem, and the fits without some of the rows where no row is there to verify.
    fn run_methods(&self, model: Model, terms: Terms) -> Result<(Vec<Candidate>, Vec<Deletion>), Error> {
        let parameters = terms.parameters(self.robot);
        let mut formulation = Formulation::new(&self.task(&parameters, model))?;
        if model != Model::PairwiseDistance {
            let validations = self.validations(&parameters, &formulation, formulation.rows.scatter);
            formulation.common = validations[0].common_factor(&parameters);
        }
        let deletions =
            if self.set.verify_rows().len() < FEWEST_TO_VERIFY { self.deletions(&formulation) } else { Vec::new() };
        let run = |method: &Method| {
            (self.step)(&format!("{} on {}", method.name(), model.name()));
            self.solved(&formulation, *method)
        };
        let methods = self.settings.method.map_or(Method::ALL.to_vec(), |method| vec![method]);
        Ok((methods.iter().map(run).collect::<Result<_, Error>>()?, deletions))
    }

    /// What the fit becomes without each fold of the rows, each time that they are cut into folds.
    fn deletions(&self, at: &Formulation) -> Vec<Deletion> {
        // What is smooth over a placement makes one of all its rows; without it rows can be left out.
        let scatter = Scatter { smooth: None, ..at.rows.scatter };
        let parameters = at.parameters();
        let (rows, linearised) = self.linearised(parameters, at, scatter);
        let of_repeat = |of_row: &Vec<Option<usize>>| -> Vec<Deletion> {
            let changes = CrossValidation::by_folds(&linearised, &rows, of_row).deletions(parameters, &at.tolerance);
            let of_fold = |(fold, change): (usize, Option<Vec<f64>>)| {
                let of_fold: Vec<usize> = (0..of_row.len()).filter(|&r| of_row[r] == Some(fold)).collect();
                Some(Deletion { rows: of_fold, change: change? }).filter(|d| !d.rows.is_empty())
            };
            changes.into_iter().enumerate().filter_map(of_fold).collect()
        };
        folds::folds(self.set, &self.rows).iter().flat_map(of_repeat).collect()
    }
}

/// The first candidate of least cost: the cheapest of equals.
fn best(candidates: &[Candidate]) -> usize {
    let least = candidates.iter().map(Candidate::cost).fold(f64::INFINITY, f64::min);
    candidates.iter().position(|c| c.cost() <= least * (1.0 + SAME_COST)).unwrap_or(0)
}
