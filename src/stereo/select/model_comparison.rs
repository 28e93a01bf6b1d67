//! Models calibrated with all pairs, and compared by how they predict pairs that they have not seen.

use nalgebra::DMatrix;

use crate::geometry::{Transform, perturb};
use crate::statistics::chi_square_quantile;
use crate::stereo::Lens;
use crate::stereo::data::residuals::residual_px;
use crate::stereo::data::{View, in_use};
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::select::cross_validation::{self, Without};
use crate::stereo::solve::levenberg_marquardt;
use crate::stereo::solve::uncertainty::{self, WORST_FOCAL_SIGMA, worst_focal_sigma};
use crate::stereo::solve::{Equations, Loss, Priors, Problem};

/// Standard errors by which a richer model must predict better: one is what half of the useless terms reach by chance
/// when the best of several is taken.
const STANDARD_ERRORS: f64 = 2.0;

/// Quantile of the normal distribution (one draw in four thousand) at whose level of chi-squared a simpler model is
/// refuted: there are several rungs.
const REFUTED: f64 = 3.5;

/// By how much more than the corners' noise chance moves chi-squared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chance {
    /// Variance of what the pairs leave over what their corners' noise lets expect, as neighbouring corners and whole
    /// pairs tell; at least one.
    pub scatter: f64,
    /// Variance of the shared numbers with the board's print in it over that without; at least one. The print is the
    /// same in all pairs, so that a term that takes it up predicts unseen pairs better, too.
    pub print: f64,
}

/// Numbers that a pair tells of a rig beyond those that its own board takes: where its right camera seems to stand.
pub const OF_PAIR: usize = 6;

impl Chance {
    /// With what so many numbers took up of the scatter of so few pairs. At most all of them go into where the pairs
    /// seem to see the right camera.
    pub fn with_taken_up(self, numbers: usize, pairs: usize) -> Chance {
        let all = (OF_PAIR * pairs) as f64;
        Chance { scatter: self.scatter * all / (all - numbers as f64), ..self }
    }

    /// By how much chi-squared may fall for so many terms of no worth.
    fn fall(&self, added: usize) -> f64 {
        self.scatter * self.print * chi_square_quantile(added as f64, REFUTED)
    }

    /// How much of that is the print's, and the same in held-out pairs.
    fn print_fall(&self, added: usize) -> f64 {
        self.fall(added) * (1.0 - 1.0 / self.print)
    }
}

/// How a model predicts pairs it has not seen.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LensScore {
    pub model: &'static str,
    /// Root mean square of the held-out 2-D residuals, px; `None` where the pairs do not determine the lens, or it
    /// promised nothing.
    pub held_out_rms_px: Option<f64>,
    /// Mean over the pairs of the squared whitened residual a corner.
    pub loss: Option<f64>,
    /// Calibrated with all pairs, where they determine it.
    #[serde(skip)]
    pub trial: Option<Trial>,
}

/// A model calibrated with all pairs.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// What was free.
    pub layout: Layout,
    /// Rig, shape and poses.
    pub values: Values,
    /// What was expected of them.
    pub priors: Priors,
    /// Covariance of rig and shape.
    pub covariance: DMatrix<f64>,
    /// Sum of the squared whitened residuals of the pairs it was fitted to, and of what the lens misses of what is
    /// expected of lenses.
    pub chi_square: f64,
    /// How many corners they are.
    corners: usize,
    /// The held-out loss of each pair.
    by_pair: Vec<f64>,
}

impl LensScore {
    /// A lens that was not tried, or that the pairs do not determine.
    pub fn untried(lens: Lens) -> LensScore {
        LensScore { model: lens.name(), held_out_rms_px: None, loss: None, trial: None }
    }
}

/// The simplest model within two standard errors, and what print may feign, of the best that no richer one refutes.
pub fn simplest<'a>(scores: &'a [LensScore], chance: &Chance) -> Option<&'a Trial> {
    let trials = || scores.iter().filter_map(|s| s.trial.as_ref());
    let best = trials().min_by(|a, b| a.loss().total_cmp(&b.loss()))?;
    trials()
        .find(|trial| !trial.is_worse_than(best, chance) && !trials().any(|richer| trial.is_refuted_by(richer, chance)))
}

impl Trial {
    /// A model calibrated with all pairs and held against none. `None` where the pairs do not determine it.
    pub fn new(problem: &Problem, layout: Layout) -> Option<Trial> {
        Some(Trial::with_equations(problem, layout)?.0)
    }

    /// The model at its minimum, with the normal equations there.
    fn with_equations(problem: &Problem, layout: Layout) -> Option<(Trial, Equations)> {
        let values = problem.refit(&layout)?;
        let views = &problem.views;
        let equations = levenberg_marquardt::equations(views, &layout, &problem.priors, &values, Loss::Squared)?;
        let covariance = uncertainty::covariance(&equations)?;
        let is_told = worst_focal_sigma(&covariance, &layout, &values.shared.rig) <= WORST_FOCAL_SIGMA;
        let trial = Trial {
            layout,
            values,
            priors: problem.priors.clone(),
            covariance,
            chi_square: 2.0 * equations.cost(),
            corners: in_use(views).count(),
            by_pair: Vec::new(),
        };
        is_told.then_some((trial, equations))
    }

    /// Logarithm of the determinant of the covariance. `None` where it has none.
    pub fn log_volume(&self) -> Option<f64> {
        let scale = self.covariance.diagonal().map(f64::sqrt);
        let unit = DMatrix::from_fn(scale.len(), scale.len(), |i, j| self.covariance[(i, j)] / (scale[i] * scale[j]));
        let root = unit.cholesky()?;
        let logs = root.l_dirty().diagonal().map(f64::ln) + scale.map(f64::ln);
        Some(2.0 * logs.sum())
    }

    fn loss(&self) -> f64 {
        self.by_pair.iter().sum::<f64>() / self.by_pair.len() as f64
    }

    /// Whether a richer model predicts unseen pairs no worse and lowers chi-squared by more than chance does
    /// (`REFUTED`): a few pairs that miss terms only at their edges differ too much among themselves for their mean
    /// loss to tell.
    pub fn is_refuted_by(&self, richer: &Trial, chance: &Chance) -> bool {
        let Some(added) = richer.layout.count().checked_sub(self.layout.count()).filter(|added| *added > 0) else {
            return false;
        };
        richer.loss() < self.loss() && self.chi_square - richer.chi_square > chance.fall(added)
    }

    /// Whether it predicts unseen pairs worse than another model by more than chance and, where the other has more
    /// terms, print account for.
    pub fn is_worse_than(&self, other: &Trial, chance: &Chance) -> bool {
        let added = other.layout.count().saturating_sub(self.layout.count());
        let by_print = if added > 0 { chance.print_fall(added) / self.corners.max(1) as f64 } else { 0.0 };
        self.excess_over(other) > by_print
    }

    /// How much worse than `best` beyond what chance makes of the pairs' differences; no number where pairs were not
    /// held out.
    pub fn excess_over(&self, best: &Trial) -> f64 {
        let differences: Vec<f64> = self.by_pair.iter().zip(&best.by_pair).map(|(a, b)| a - b).collect();
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        mean - STANDARD_ERRORS * (variance / n).sqrt()
    }
}

/// Logarithm of the evidence for a richer model over a simpler one that it contains (Laplace's approximation; what is
/// expected of the added terms is part of it). `scatter`: see [`Chance`]. `None` where a covariance has no volume.
pub fn gain_of_terms(priors: &Priors, richer: &Trial, simpler: &Trial, scatter: f64) -> Option<f64> {
    let added = (richer.layout.count() - simpler.layout.count()) as f64;
    let wider = 0.5 * (richer.log_volume()? - simpler.log_volume()? + added * scatter.ln());
    let fall = 0.5 * (simpler.chi_square - richer.chi_square) / scatter;
    Some(fall + wider - priors.log_width(&richer.layout, &simpler.layout))
}

/// A lens calibrated with all pairs, and how it predicts pairs that it has not seen.
pub fn score(problem: &Problem, lens: Lens, shape: bool) -> LensScore {
    let (trial, held_out_rms_px) = hold_out(problem, Layout::rig(lens, shape)).unzip();
    LensScore { model: lens.name(), held_out_rms_px, loss: trial.as_ref().map(Trial::loss), trial }
}

/// The model with all pairs and, fold by fold, on those it has not seen. `None` where the pairs do not determine it.
fn hold_out(problem: &Problem, layout: Layout) -> Option<(Trial, f64)> {
    // A lens that all pairs together do not determine is none.
    let (trial, equations) = Trial::with_equations(problem, layout)?;
    let views = &problem.views;
    let fold_of = cross_validation::folds(views, &trial.values.poses);
    let shared = &trial.values.shared;
    let rigs = cross_validation::leave_out(&equations, &equations, &layout, shared, &fold_of, WORST_FOCAL_SIGMA);
    let rigs = rigs.into_iter().collect::<Option<Vec<Without>>>()?;
    let of_pair = |(i, view): (usize, &View)| {
        let rig = &rigs[fold_of[i]];
        let pose_step = equations.blocks[i].pose_step(&rig.step)?;
        miss(&rig.shared, view, &perturb(&trial.values.poses[i], pose_step.as_slice()))
    };
    let misses = views.iter().enumerate().map(of_pair).collect::<Option<Vec<Miss>>>()?;
    let squares: f64 = misses.iter().map(|miss| miss.squares_px2).sum();
    let corners: u32 = misses.iter().map(|miss| miss.corners).sum();
    let by_pair = misses.iter().map(|miss| miss.loss).collect();
    Some((Trial { by_pair, ..trial }, (squares / f64::from(corners.max(1))).sqrt()))
}

struct Miss {
    squares_px2: f64,
    corners: u32,
    loss: f64,
}

/// What a rig leaves of a pair that it has not seen.
fn miss(shared: &Shared, view: &View, left_from_board: &Transform) -> Option<Miss> {
    let mut sum = Miss { squares_px2: 0.0, corners: 0, loss: 0.0 };
    for o in view.observations.iter().filter(|o| o.active) {
        let r = residual_px(shared, left_from_board, o)?;
        sum.squares_px2 += r.norm_squared();
        sum.loss += o.whiten(r).norm_squared();
        sum.corners += 1;
    }
    sum.loss /= f64::from(sum.corners.max(1));
    sum.loss.is_finite().then_some(sum)
}
