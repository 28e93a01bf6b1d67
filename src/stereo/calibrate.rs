//! From corners to a calibrated rig: start, screening, bundle, covariance.
//!
//! In: the corners of all pairs. Out: the rig with its covariance, the pairs that were used with their residuals, the pairs that were
//! not and why. Goes wrong: too few pairs, pairs that contradict each other, views too similar to tell the cameras.

use nalgebra::DMatrix;

use super::bundle::{self, Search, Stop, Uncertainty, Values};
use super::consensus;
use super::layout::{Layout, Shared};
use super::lens_choice::{self, LensScore};
use super::neighbours::NeighbourCorrelation;
use super::noise::Noise;
use super::observations::{Side, View};
use super::residuals;
use super::rig::Covariance;
use super::robust::Loss;
use super::{Error, Lens, Rig};
use crate::imaging::{Board, Corners, Skipped};

/// Fewest pairs for a calibration whose accuracy can be held out: three calibrate, the fourth judges.
pub const FEWEST_PAIRS: usize = 4;

/// Whitened residuals beyond this are outliers: of Gaussian corners one in a million lies there.
const OUTLIER: f64 = 5.3;

/// A focal length that is known no better than this share is not known.
const WORST_FOCAL_SIGMA: f64 = 0.02;

/// What may be forced.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Options {
    /// The lens; chosen by held-out pairs where `None`.
    pub lens: Option<Lens>,
    /// Whether the board's shape is free; decided by held-out pairs where `None`.
    pub shape: Option<bool>,
}

/// A calibrated rig with all that it was made from.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The board that was seen.
    pub board: Board,
    /// What was free.
    pub layout: Layout,
    /// The pairs that were used, with whitened corners; outliers are inactive.
    pub views: Vec<View>,
    /// Rig, shape, a pose a pair; the rig carries its covariance.
    pub values: Values,
    /// Covariance of the shared numbers and of each pose.
    pub uncertainty: Uncertainty,
    /// How corners scatter.
    pub noise: Noise,
    /// How neighbouring corners' residuals hang together; the covariance allows for the information that they share.
    pub neighbours: NeighbourCorrelation,
    /// Root mean square of the length of the 2-D residuals of both pictures, px.
    pub rms_px: f64,
    /// Pairs that were not used.
    pub skipped: Vec<Skipped>,
    /// How the lenses that were tried predict held-out pairs; empty where the lens was forced.
    pub lens_scores: Vec<LensScore>,
}

impl Calibration {
    /// The rig with its covariance.
    pub fn rig(&self) -> &Rig {
        &self.values.shared.rig
    }

    /// The pairs with the values reached, to solve again in part or with another model.
    pub fn problem(&self) -> Problem {
        Problem { views: self.views.clone(), values: self.values.clone() }
    }

    /// The corners as they were used: outliers and the corners of pairs that are out are marked, turned boards turned.
    pub fn mark(&self, corners: &Corners) -> Corners {
        let mut marked = corners.clone();
        for pair in &mut marked.pairs {
            let view = self.views.iter().find(|view| view.pair == pair.pair);
            for (side, list) in [(Side::Left, &mut pair.left), (Side::Right, &mut pair.right)] {
                for corner in list.iter_mut() {
                    let seen = view.and_then(|v| v.observations.iter().find(|o| o.side == side && o.px == corner.px));
                    corner.used = corner.used && seen.is_some_and(|o| o.active);
                    if let Some(o) = seen {
                        (corner.col, corner.row) = (o.col, o.row);
                    }
                }
                list.sort_by_key(|c| (c.row, c.col));
            }
        }
        marked
    }
}

/// Calibrates both cameras and the rig.
pub fn calibrate(corners: &Corners, options: &Options) -> Result<Calibration, Error> {
    let consensus = consensus::find(corners)?;
    let start = Problem { views: consensus.views, values: consensus.values };
    let lens_choice::Choice { layout, near, scores: lens_scores } = lens_choice::choose(&start, options)?;
    let solved = Problem { values: near.unwrap_or(start.values), ..start }.solve(&layout)?;
    let neighbours = solved.neighbours(&corners.board);
    let uncertainty = solved.uncertainty(&layout)?.scaled(neighbours.inflation());
    let Problem { views, mut values } = solved.problem;
    values.shared.rig.covariance = Some(Covariance { order: layout.names(), matrix: uncertainty.shared.clone() });
    Ok(Calibration {
        board: corners.board,
        layout,
        rms_px: solved.rms_px,
        views,
        values,
        uncertainty,
        noise: solved.noise,
        neighbours,
        skipped: consensus.skipped,
        lens_scores,
    })
}

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
            problem.values.shared.shape_mm = [0.0; 2];
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
            let loss = Loss::Cauchy(super::start::CAUCHY_WIDTH);
            values = bundle::solve(&views, layout, values, loss, Search::ROUGH).values;
        }
        for _ in 0..4 {
            let marked = mark_outliers(&mut views, &values);
            let left = residuals::active(&views, &values).ok_or(Error::NotConverged { steps: 0 })?;
            if 2 * left.len() <= unknowns {
                return Err(Error::TooFewCorners { corners: left.len(), unknowns });
            }
            let before = noise;
            noise = Noise::from_mean(&left, unknowns);
            noise.apply(&mut views);
            let solution = bundle::solve(&views, layout, values, Loss::Squared, Search::NEAR);
            if solution.stop != Stop::Minimum {
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
        let solution = bundle::solve(&start.views, layout, start.values, Loss::Squared, Search::TRIAL);
        (solution.stop == Stop::Minimum).then_some(solution.values)
    }
}

impl Solved {
    fn neighbours(&self, board: &Board) -> NeighbourCorrelation {
        let Problem { views, values } = &self.problem;
        let of_view = |(view, pose)| residuals::of_view(&values.shared, view, pose);
        NeighbourCorrelation::of(board, views.iter().zip(&values.poses).map(of_view))
    }

    /// Covariance of everything; an error where the views do not tell.
    pub fn uncertainty(&self, layout: &Layout) -> Result<Uncertainty, Error> {
        let Problem { views, values } = &self.problem;
        let uncertainty =
            bundle::uncertainty(views, layout, values).ok_or(Error::Undetermined { focal_sigma: None })?;
        let worst = worst_focal_sigma(&uncertainty.shared, layout, &values.shared.rig);
        let known = worst <= WORST_FOCAL_SIGMA;
        if known { Ok(uncertainty) } else { Err(Error::Undetermined { focal_sigma: Some(worst) }) }
    }

    /// The shared values.
    pub fn shared(&self) -> &Shared {
        &self.problem.values.shared
    }
}

/// Whether this covariance of the shared numbers tells the cameras.
pub fn tells(shared: &DMatrix<f64>, layout: &Layout, rig: &Rig) -> bool {
    worst_focal_sigma(shared, layout, rig) <= WORST_FOCAL_SIGMA
}

/// Largest relative standard deviation of a focal length.
fn worst_focal_sigma(shared: &DMatrix<f64>, layout: &Layout, rig: &Rig) -> f64 {
    let mut worst: f64 = 0.0;
    for (side, camera) in Side::BOTH.into_iter().zip([&rig.left, &rig.right]) {
        let at = layout.camera_start(side);
        for (i, focal) in [camera.fx, camera.fy].into_iter().enumerate() {
            worst = worst.max(shared[(at + i, at + i)].sqrt() / focal.abs());
        }
    }
    worst
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
