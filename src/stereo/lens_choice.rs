//! Which lens model: the one that predicts pairs it has not seen.
//!
//! In: views that agree. Out: the layout to solve, and how each lens of the ladder predicts held-out pairs. Method: k folds over the
//! pairs; the rig of a fold measures the pose of each pair it has not seen, and what is left counts. The simplest lens whose
//! loss is within one standard error of the best wins (Breiman et al. 1984), since a richer one extrapolates worse.

use rayon::prelude::*;

use super::calibrate::{Options, Problem};
use super::folds::{self, FOLDS};
use super::layout::{Layout, Shared};
use super::observations::View;
use super::pose;
use super::residuals::residual_px;
use super::robust::Loss;
use super::{Error, Lens};

/// How a lens predicts pairs it has not seen.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LensScore {
    /// The lens.
    pub model: &'static str,
    /// Root mean square of the held-out 2-D residuals, px; `None` where the pairs do not determine the lens.
    pub held_out_rms_px: Option<f64>,
    /// Mean over the pairs of the squared whitened residual a corner.
    pub loss: Option<f64>,
    #[serde(skip)]
    lens: Option<Lens>,
    /// The loss of each pair.
    #[serde(skip)]
    by_pair: Vec<f64>,
}

/// Chooses what is free, where it is not forced.
pub fn choose(start: &Problem, options: &Options) -> Result<(Layout, Vec<LensScore>), Error> {
    let shape = options.shape.unwrap_or(false);
    if let Some(lens) = options.lens {
        return Ok((Layout::rig(lens, shape), Vec::new()));
    }
    // Weights and outliers from a lens that is at least as rich as most need; the comparison uses the same for all.
    let solved =
        start.solve(&Layout::rig(Lens::Brown5, shape)).or_else(|_| start.solve(&Layout::rig(Lens::Brown4, shape)))?;
    let scores: Vec<LensScore> = Lens::LADDER.par_iter().map(|&lens| score(&solved.problem, lens, shape)).collect();
    let best = scores.iter().filter(|s| s.loss.is_some()).min_by(|a, b| a.total().total_cmp(&b.total()));
    let Some(best) = best else { return Err(Error::Undetermined { focal_sigma: None }) };
    let chosen = scores
        .iter()
        .filter(|s| s.loss.is_some())
        .find(|s| s.excess_over(best) <= 0.0)
        .and_then(|s| s.lens)
        .unwrap_or(Lens::Brown4);
    Ok((Layout::rig(chosen, shape), scores))
}

impl LensScore {
    fn total(&self) -> f64 {
        self.loss.unwrap_or(f64::INFINITY)
    }

    /// How much worse than `best` beyond one standard error of the pairs' differences.
    fn excess_over(&self, best: &LensScore) -> f64 {
        let differences: Vec<f64> = self.by_pair.iter().zip(&best.by_pair).map(|(a, b)| a - b).collect();
        let n = differences.len() as f64;
        let mean = differences.iter().sum::<f64>() / n;
        let variance = differences.iter().map(|d| (d - mean) * (d - mean)).sum::<f64>() / (n - 1.0).max(1.0);
        mean - (variance / n).sqrt()
    }
}

fn score(problem: &Problem, lens: Lens, shape: bool) -> LensScore {
    let layout = Layout::rig(lens, shape);
    let count = problem.views.len();
    let folds = folds::assign(count, FOLDS);
    let mut by_pair = vec![None; count];
    let none = LensScore { model: lens.name(), held_out_rms_px: None, loss: None, lens: None, by_pair: Vec::new() };
    // A lens that all pairs together do not determine is none; one that they do is a start for every fold.
    let Some(values) = problem.refit(&layout) else { return none };
    let problem = Problem { views: problem.views.clone(), values };
    if !problem.determines(&layout) {
        return none;
    }
    let (mut squares, mut corners) = (0.0, 0);
    for fold in 0..FOLDS.min(count) {
        let kept = problem.subset(|i| folds[i] != fold);
        let Some(values) = kept.refit(&layout) else { return none };
        if !kept.determines(&layout) {
            return none;
        }
        for i in (0..count).filter(|&i| folds[i] == fold) {
            let Some(left) = held_out(&values.shared, &problem.views[i]) else { return none };
            squares += left.squares_px2;
            corners += left.corners;
            by_pair[i] = Some(left.loss);
        }
    }
    let Some(by_pair) = by_pair.into_iter().collect::<Option<Vec<f64>>>() else { return none };
    let loss = by_pair.iter().sum::<f64>() / count as f64;
    let held_out_rms_px = (corners > 0).then(|| (squares / corners as f64).sqrt());
    LensScore { model: lens.name(), held_out_rms_px, loss: Some(loss), lens: Some(lens), by_pair }
}

struct HeldOut {
    squares_px2: f64,
    corners: usize,
    loss: f64,
}

/// What a rig leaves of a pair that it has not seen.
fn held_out(shared: &Shared, view: &View) -> Option<HeldOut> {
    let fit = pose::fit(shared, view, Loss::Squared)?;
    let mut sum = HeldOut { squares_px2: 0.0, corners: 0, loss: 0.0 };
    for o in view.observations.iter().filter(|o| o.active) {
        let r = residual_px(shared, &fit.left_from_board, o)?;
        sum.squares_px2 += r.norm_squared();
        sum.loss += o.whiten(r).norm_squared();
        sum.corners += 1;
    }
    sum.loss /= sum.corners.max(1) as f64;
    sum.loss.is_finite().then_some(sum)
}
