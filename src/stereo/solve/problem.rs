//! A calibration as a least-squares problem: views, values to start from, and which numbers are free.
//!
//! In: views that agree and values near their minimum. Out: the values at the minimum, the corners that are outliers, and how the others
//! scatter. Method: a robust search, then least squares over the corners that are no outliers, with the scatter fitted to what is left.

use crate::imaging::Board;
use crate::stereo::Error;
use crate::stereo::data::corner_noise::Noise;
use crate::stereo::data::neighbour_correlation::NeighbourCorrelation;
use crate::stereo::data::residuals;
use crate::stereo::data::view::View;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::parameters::{Layout, Shared, Values};
use crate::stereo::solve::levenberg_marquardt::{self, Search, Stop};
use crate::stereo::solve::robust_loss::{CAUCHY_WIDTH, Loss};
use crate::stereo::solve::uncertainty::{self, Uncertainty, WORST_FOCAL_SIGMA, worst_focal_sigma};

/// Whitened residuals beyond this are outliers: of Gaussian corners one in a million lies there.
const OUTLIER: f64 = 5.3;

/// Rounds of marking corners and solving again: corners at the border of a wide lens come back a few in each.
const MOST_ROUNDS: usize = 12;

/// Views that agree, with values to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The pairs.
    pub views: Vec<View>,
    /// Values of all unknowns.
    pub values: Values,
}

/// A problem at its minimum.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Views with whitened corners, and the values reached.
    pub problem: Problem,
    /// How corners scatter.
    pub noise: Noise,
    /// Root mean square of the length of the 2-D residuals, px.
    pub rms_px: f64,
}

impl Problem {
    /// A start for this layout: both cameras with its lens, the shape zero unless free.
    pub fn with_layout(&self, layout: &Layout) -> Problem {
        let mut problem = self.clone();
        let rig = &mut problem.values.shared.rig;
        for (camera, lens) in [(&mut rig.left, layout.left), (&mut rig.right, layout.right)] {
            if let Some(lens) = lens {
                camera.lens = lens;
                camera.distortion[lens.free_count()..].fill(0.0);
            }
        }
        if !layout.shape {
            problem.values.shared.shape_mm = FLAT;
        }
        problem
    }

    /// Solves robustly, then by least squares over the corners that are no outliers, with the scatter fitted to what is left.
    pub fn solve(&self, layout: &Layout) -> Result<Solved, Error> {
        let Problem { mut views, mut values } = self.with_layout(layout);
        let unknowns = layout.count() + 6 * views.len();
        for o in views.iter_mut().flat_map(|v| &mut v.observations) {
            o.active = true;
        }
        let mut noise = Noise::UNIT;
        // Twice: the scatter is known only after the first solution.
        for _ in 0..2 {
            noise = Noise::from_median(&residuals::active(&views, &values).ok_or(Error::NotConverged { steps: 0 })?);
            noise.apply(&mut views);
            let loss = Loss::Cauchy(CAUCHY_WIDTH);
            values = levenberg_marquardt::solve(&views, layout, values, loss, Search::ROUGH).values;
        }
        for _ in 0..MOST_ROUNDS {
            let marked = mark_outliers(&mut views, &values);
            let left = residuals::active(&views, &values).ok_or(Error::NotConverged { steps: 0 })?;
            if 2 * left.len() <= unknowns {
                return Err(Error::TooFewCorners { corners: left.len(), unknowns });
            }
            let before = noise;
            noise = Noise::from_mean(&left, unknowns);
            noise.apply(&mut views);
            let solution = levenberg_marquardt::solve(&views, layout, values, Loss::Squared, Search::NEAR);
            // A lens that was asked for may have numbers that these views do not tell apart; the covariance says which.
            if !matches!(solution.stop, Stop::Minimum | Stop::Valley) {
                return Err(Error::NotConverged { steps: solution.steps });
            }
            values = solution.values;
            if !marked && (noise.added_px - before.added_px).abs() <= 1e-3 * noise.added_px {
                break;
            }
        }
        let left = residuals::active(&views, &values).ok_or(Error::NotConverged { steps: 0 })?;
        noise = Noise::from_mean(&left, unknowns);
        let squares: Vec<f64> = left.iter().map(|(_, r)| r.norm_squared()).collect();
        let rms_px = residuals::root_mean_square(&squares).unwrap_or(0.0);
        Ok(Solved { problem: Problem { views, values }, noise, rms_px })
    }

    /// The same without some pairs: `keep` says which stay.
    pub fn subset(&self, keep: impl Fn(usize) -> bool) -> Problem {
        let kept = |i: &usize| keep(*i);
        let all = 0..self.views.len();
        Problem {
            views: all.clone().filter(kept).map(|i| self.views[i].clone()).collect(),
            values: Values {
                shared: self.values.shared.clone(),
                poses: all.filter(kept).map(|i| self.values.poses[i]).collect(),
            },
        }
    }

    /// Solves again by least squares with the weights and outliers as they are: for folds. `None` where the search does not
    /// end at a minimum: these pairs do not determine this lens.
    pub fn refit(&self, layout: &Layout) -> Option<Values> {
        let start = self.with_layout(layout);
        let solution = levenberg_marquardt::solve(&start.views, layout, start.values, Loss::Squared, Search::TRIAL);
        (solution.stop == Stop::Minimum).then_some(solution.values)
    }
}

impl Solved {
    /// How the residuals of neighbouring corners hang together.
    pub fn neighbours(&self, board: &Board) -> NeighbourCorrelation {
        let Problem { views, values } = &self.problem;
        let of_view = |(view, pose)| residuals::of_view(&values.shared, view, pose);
        NeighbourCorrelation::of(board, views.iter().zip(&values.poses).map(of_view))
    }

    /// Covariance of everything; an error where the views do not tell.
    pub fn uncertainty(&self, layout: &Layout) -> Result<Uncertainty, Error> {
        let Problem { views, values } = &self.problem;
        let uncertainty = uncertainty::of_solution(views, layout, values).ok_or_else(Error::undetermined)?;
        let worst = worst_focal_sigma(&uncertainty.shared, layout, &values.shared.rig);
        let known = worst <= WORST_FOCAL_SIGMA;
        if known { Ok(uncertainty) } else { Err(Error::Undetermined { focal_sigma: Some(worst), skipped: Vec::new() }) }
    }

    /// The shared values.
    pub fn shared(&self) -> &Shared {
        &self.problem.values.shared
    }
}

/// Marks corners beyond the limit. True where a mark changed.
fn mark_outliers(views: &mut [View], values: &Values) -> bool {
    let mut changed = false;
    for (view, pose) in views.iter_mut().zip(&values.poses) {
        for o in &mut view.observations {
            let far = residuals::residual_px(&values.shared, pose, o).is_none_or(|r| o.whiten(r).norm() > OUTLIER);
            changed |= far == o.active;
            o.active = !far;
        }
    }
    changed
}
