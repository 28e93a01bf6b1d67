//! Which lens model, and whether the board is flat: what predicts pairs that it has not seen.
//!
//! In: views that agree. Out: the layout to solve, and how each lens of the ladder predicts held-out pairs. Method: k folds over the
//! pairs ([`leave_out`]); the rig of a fold measures the pose of each pair it has not seen, and what is left counts. The simplest model whose
//! loss is within two standard errors of the best wins (after Breiman et al. 1984), since a richer one extrapolates worse.
//! Goes wrong: pairs too few or too alike to tell models apart; then the simplest that fits wins, and
//! [`super::disagreement`] says what is at stake.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::bundle::{self, Values};
use super::calibrate::{Options, Problem, tells};
use super::folds::{self, FOLDS};
use super::layout::{Layout, Shared};
use super::leave_out;
use super::observations::View;
use super::pose;
use super::residuals::residual_px;
use super::robust::Loss;
use super::schur::Block;
use super::{Error, Lens};
use crate::geometry::Transform;

/// Standard errors by which a richer model must predict better: one is what half of the useless terms reach by chance when the
/// best of several is taken.
const STANDARD_ERRORS: f64 = 2.0;

/// How a model predicts pairs it has not seen.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LensScore {
    /// The lens.
    pub model: &'static str,
    /// Root mean square of the held-out 2-D residuals, px; `None` where the pairs do not determine the lens, or it promised nothing.
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
    /// Covariance of rig and shape.
    pub covariance: DMatrix<f64>,
    /// Mean squared whitened residual of the pairs it was fitted to.
    pub mean_square: f64,
    /// The held-out loss of each pair.
    by_pair: Vec<f64>,
}

/// What was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// What is free.
    pub layout: Layout,
    /// Values near the minimum of that model, where it was tried.
    pub near: Option<Values>,
    /// Every lens of the ladder; empty where the lens was forced.
    pub scores: Vec<LensScore>,
}

/// Chooses what is free, where it is not forced.
pub fn choose(start: &Problem, options: &Options) -> Result<Choice, Error> {
    let forced_shape = options.shape.or(options.lens.map(|_| false));
    if let (Some(lens), Some(shape)) = (options.lens, forced_shape) {
        return Ok(Choice { layout: Layout::rig(lens, shape), near: None, scores: Vec::new() });
    }
    // Weights and outliers from a model that is at least as rich as most need; the comparison uses the same for all.
    let rich = |shape| start.solve(&Layout::rig(Lens::Brown5, shape));
    let solved = rich(forced_shape.unwrap_or(true))
        .or_else(|_| rich(forced_shape.unwrap_or(false)))
        .or_else(|_| start.solve(&Layout::rig(Lens::Brown4, false)))
        .map_err(|e| match e {
            // Not even the simplest search ends: the pairs leave a valley, not a minimum.
            Error::NotConverged { .. } => Error::Undetermined { focal_sigma: None },
            other => other,
        })?;
    // The lens is compared with the board bent, if it may be: a bow that is left out would look like a lens.
    let bent = forced_shape.unwrap_or(true);
    let mut scores = ladder(&solved.problem, bent);
    if forced_shape.is_none() && scores.iter().all(|s| s.trial.is_none()) {
        scores = ladder(&solved.problem, false);
    }
    let chosen = simplest(&scores).ok_or(Error::Undetermined { focal_sigma: None })?;
    if forced_shape.is_none() && chosen.layout.shape {
        let flat = chosen.layout.left.and_then(|lens| score(&solved.problem, lens, false).trial);
        let bends = flat.is_none_or(|flat| flat.excess_over(chosen) > 0.0);
        if !bends {
            scores = ladder(&solved.problem, false);
        }
    }
    let chosen = simplest(&scores).ok_or(Error::Undetermined { focal_sigma: None })?;
    Ok(Choice { layout: chosen.layout, near: Some(chosen.values.clone()), scores })
}

/// Every lens from the simplest, each from where the one before it ended: a richer lens begins as the simpler one. Above a lens that
/// the pairs do not determine there is none that they do, and one that promises no more than chance cannot predict better.
fn ladder(problem: &Problem, shape: bool) -> Vec<LensScore> {
    let mut problem = problem.clone();
    let (mut determined, mut simpler) = (true, None);
    let mut scores = Vec::new();
    for lens in Lens::LADDER {
        let layout = Layout::rig(lens, shape);
        let dear = lens > Lens::Brown5;
        let tried = determined && !(dear && simpler.is_some_and(|simpler| !promises(&problem, &layout, &simpler)));
        let score = if tried { score(&problem, lens, shape) } else { LensScore::untried(lens) };
        match &score.trial {
            Some(trial) => {
                problem.values = trial.values.clone();
                simpler = Some(layout);
            }
            None => determined = determined && !tried,
        }
        scores.push(score);
    }
    scores
}

/// Whether a richer lens promises to explain more than noise would let it: more than two standard deviations above the mean of
/// a chi-square with as many degrees of freedom as it adds. What cannot be determined promises nothing.
fn promises(problem: &Problem, layout: &Layout, simpler: &Layout) -> bool {
    let start = problem.with_layout(layout);
    let promised = bundle::blocks(&start.views, layout, &start.values, Loss::Squared)
        .and_then(|blocks| bundle::promised_chi_square(&blocks, layout));
    let added = (layout.count() - simpler.count()) as f64;
    promised.is_some_and(|promised| promised > added + 2.0 * (2.0 * added).sqrt())
}

impl LensScore {
    fn untried(lens: Lens) -> LensScore {
        LensScore { model: lens.name(), held_out_rms_px: None, loss: None, trial: None }
    }
}

/// The simplest model within two standard errors of the best.
fn simplest(scores: &[LensScore]) -> Option<&Trial> {
    let trials = || scores.iter().filter_map(|s| s.trial.as_ref());
    let best = trials().min_by(|a, b| a.loss().total_cmp(&b.loss()))?;
    trials().find(|trial| trial.excess_over(best) <= 0.0)
}

impl Trial {
    /// A model calibrated with all pairs and held against none. `None` where the pairs do not determine it.
    pub fn new(problem: &Problem, layout: Layout) -> Option<Trial> {
        Some(Trial::with_blocks(problem, layout)?.0)
    }

    /// The model at its minimum, with the normal equations there.
    fn with_blocks(problem: &Problem, layout: Layout) -> Option<(Trial, Vec<Block>)> {
        let values = problem.refit(&layout)?;
        let views = &problem.views;
        let blocks = bundle::blocks(views, &layout, &values, Loss::Squared)?;
        let covariance = bundle::uncertainty_of(&blocks, &layout)?.shared;
        if !tells(&covariance, &layout, &values.shared.rig) {
            return None;
        }
        let corners = views.iter().flat_map(|view| &view.observations).filter(|o| o.active).count();
        let mean_square = 2.0 * blocks.iter().map(|block| block.cost).sum::<f64>() / corners.max(1) as f64;
        Some((Trial { layout, values, covariance, mean_square, by_pair: Vec::new() }, blocks))
    }

    fn loss(&self) -> f64 {
        self.by_pair.iter().sum::<f64>() / self.by_pair.len() as f64
    }

    /// How much worse than `best` beyond what chance makes of the pairs' differences.
    fn excess_over(&self, best: &Trial) -> f64 {
        let differences: Vec<f64> = self.by_pair.iter().zip(&best.by_pair).map(|(a, b)| a - b).collect();
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        mean - STANDARD_ERRORS * (variance / n).sqrt()
    }
}

fn score(problem: &Problem, lens: Lens, shape: bool) -> LensScore {
    hold_out(problem, Layout::rig(lens, shape)).map_or(LensScore::untried(lens), |(trial, rms_px)| LensScore {
        held_out_rms_px: Some(rms_px),
        loss: Some(trial.loss()),
        trial: Some(trial),
        ..LensScore::untried(lens)
    })
}

/// The model with all pairs and, fold by fold, on those it has not seen. `None` where the pairs do not determine it.
fn hold_out(problem: &Problem, layout: Layout) -> Option<(Trial, f64)> {
    // A lens that all pairs together do not determine is none.
    let (trial, blocks) = Trial::with_blocks(problem, layout)?;
    let views = &problem.views;
    let folds = FOLDS.min(views.len());
    let fold_of = folds::assign(views.len(), folds);
    let rigs = leave_out::rigs(&blocks, &layout, &trial.values.shared, &fold_of, folds)?;
    let misses: Vec<Option<Miss>> =
        views.par_iter().enumerate().map(|(i, view)| miss(&rigs[fold_of[i]], view, trial.values.poses[i])).collect();
    let misses = misses.into_iter().collect::<Option<Vec<Miss>>>()?;
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

/// What a rig leaves of a pair that it has not seen; `near` is a pose close to the pair's.
fn miss(shared: &Shared, view: &View, near: Transform) -> Option<Miss> {
    let fit = pose::follow(shared, view, near)?;
    let mut sum = Miss { squares_px2: 0.0, corners: 0, loss: 0.0 };
    for o in view.observations.iter().filter(|o| o.active) {
        let r = residual_px(shared, &fit.left_from_board, o)?;
        sum.squares_px2 += r.norm_squared();
        sum.loss += o.whiten(r).norm_squared();
        sum.corners += 1;
    }
    sum.loss /= f64::from(sum.corners.max(1));
    sum.loss.is_finite().then_some(sum)
}
