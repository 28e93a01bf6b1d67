//! A calibration as a least-squares problem: views, values to start from, and which numbers are free.
//!
//! In: views that agree and values near their minimum. Out: the values at the minimum, how corners scatter, and what
//! each weighs. Method: a robust search, then the likeliest scatter of the corners, whose tails follow from the data,
//! together with weak expectations of what lenses and boards are like ([`crate::stereo::solve::priors`]).

use nalgebra::{DMatrix, Matrix2, Vector2};

use crate::stereo::Error;
use crate::stereo::data::residuals;
use crate::stereo::data::{NeighbourCorrelation, Noise, Observation, View};
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::solve::levenberg_marquardt::{self, Search, Solution, Stop};
use crate::stereo::solve::uncertainty::{self, UNTOLD_FOCAL_SIGMA, worst_focal_sigma};
use crate::stereo::solve::{Equations, Loss, Priors};

/// Rounds of fitting the scatter and solving again.
const MOST_ROUNDS: usize = 12;

/// Views that agree, with values to start from.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    pub views: Vec<View>,
    pub values: Values,
    /// What is expected of cameras and board before any picture.
    pub priors: Priors,
}

/// A problem at its minimum.
#[derive(Debug, Clone, PartialEq)]
pub struct Solved {
    /// Views with whitened corners, and the values reached.
    pub problem: Problem,
    pub noise: Noise,
    /// Gaussian, or with heavy tails; the whiteners hold the weights that it gives.
    pub loss: Loss,
    /// Variance of the unknowns over what the weighted normal equations say, as the loss makes it.
    pub loss_factor: f64,
    /// Logarithm of the corners' likelihood with this scatter, but for a constant.
    pub log_likelihood: f64,
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

    /// Solves robustly, then with the likeliest scatter of the corners, Gaussian or with heavy tails. No corner is
    /// thrown away: what lies far off counts little, and its whitener says so afterwards.
    pub fn solve(&self, layout: &Layout) -> Result<Solved, Error> {
        let mut problem = self.with_layout(layout);
        let unknowns = layout.count() + 6 * problem.views.len();
        let corners = problem.views.iter().map(|view| view.observations.len()).sum::<usize>();
        if 2 * corners <= unknowns {
            return Err(Error::TooFewCorners { corners, unknowns });
        }
        problem.search_roughly(layout).ok_or_else(unseen)?;
        problem.solve_near(layout)
    }

    /// The same with the board's shape free or not, as it is forced, or else free where the pairs tell it; with the
    /// layout that was solved.
    pub fn solve_bent_or_flat(
        &self,
        forced: Option<bool>,
        layout: impl Fn(bool) -> Layout,
    ) -> Result<(Solved, Layout), Error> {
        let solve = |shape: bool| self.solve(&layout(shape)).map(|solved| (solved, layout(shape)));
        solve(forced.unwrap_or(true)).or_else(|_| solve(forced.unwrap_or(false)))
    }

    /// Moves the values by a robust search with corners that weigh by what is left of them: before it, and once more
    /// where that was much more than after it. `None` where a corner lies behind its camera.
    pub fn search_roughly(&mut self, layout: &Layout) -> Option<()> {
        /// What corners scatter by changes their weights by no more than their own scatter does.
        const MUCH: f64 = 1.5;
        let scatter =
            |problem: &Problem| Some(Noise::from_median(&residuals::active(&problem.views, &problem.values)?));
        let mut noise = scatter(self)?;
        for _ in 0..2 {
            noise.apply(&mut self.views);
            self.values = self.search(layout, Loss::Cauchy, Search::ROUGH).values;
            let before = std::mem::replace(&mut noise, scatter(self)?);
            if before.typical_px(&self.views) < MUCH * noise.typical_px(&self.views) {
                break;
            }
        }
        Some(())
    }

    /// A search with the weights as they are.
    pub fn search(&self, layout: &Layout, loss: Loss, search: Search) -> Solution {
        levenberg_marquardt::solve(&self.views, layout, &self.priors, self.values.clone(), loss, search)
    }

    /// Residuals of the active corners; an error where one lies behind its camera.
    fn left(&self) -> Result<Vec<(Observation, Vector2<f64>)>, Error> {
        residuals::active(&self.views, &self.values).ok_or_else(unseen)
    }

    /// How the residuals of neighbouring corners hang together.
    pub fn neighbours(&self) -> NeighbourCorrelation {
        let of_view = |(view, pose)| residuals::of_view(&self.values.shared, view, pose);
        NeighbourCorrelation::of(self.views.iter().zip(&self.values.poses).map(of_view))
    }

    /// Solves from values near the minimum: without the robust search.
    pub fn solve_near(&self, layout: &Layout) -> Result<Solved, Error> {
        self.solve_to(layout, [Search::ROBUST, Search::NEAR])
    }

    /// The same of a model on trial.
    pub fn solve_on_trial(&self, layout: &Layout) -> Result<Solved, Error> {
        self.solve_to(layout, [Search::WEIGHTS, Search::TRIAL])
    }

    /// The same with these last searches: with the loss, and by its weights.
    fn solve_to(&self, layout: &Layout, [by_loss, by_weights]: [Search; 2]) -> Result<Solved, Error> {
        let mut problem = self.with_layout(layout);
        let unknowns = layout.count() + 6 * problem.views.len();
        let (mut noise, mut loss) = Noise::likeliest(&problem.left()?, unknowns);
        for _ in 0..MOST_ROUNDS {
            noise.apply(&mut problem.views);
            // What is left of the way changes the scatter by its square.
            problem.values = problem.search(layout, loss, Search::WEIGHTS).values;
            let before = (noise, loss);
            (noise, loss) = Noise::likeliest(&problem.left()?, unknowns);
            let moved = |a: f64, b: f64| (a - b).abs() > 1e-4 * b;
            if loss == before.1 && !moved(before.0.added_px, noise.added_px) && !moved(before.0.factor, noise.factor) {
                break;
            }
        }
        noise.apply(&mut problem.views);
        if loss != Loss::Squared {
            problem.values = problem.search(layout, loss, by_loss).values;
        }
        let left = problem.left()?;
        let log_likelihood = noise.log_likelihood(&left, loss);
        let loss_factor = loss.variance_factor(left.iter().map(|(o, r)| o.whiten(*r).norm_squared()));
        if loss != Loss::Squared {
            put_weights_in(&mut problem.views, &problem.values, loss);
        }
        problem.values = converged(problem.search(layout, Loss::Squared, by_weights))?;
        let rms_px = residuals::root_mean_square(left.iter().map(|(_, r)| r.norm_squared())).unwrap_or(0.0);
        Ok(Solved { problem, noise, loss, loss_factor, log_likelihood, rms_px })
    }

    /// Solves again by least squares with the weights and outliers as they are: for folds. `None` where the search does
    /// not end at a minimum: these pairs do not determine this lens.
    pub fn refit(&self, layout: &Layout) -> Option<Values> {
        let solution = self.with_layout(layout).search(layout, Loss::Squared, Search::TRIAL);
        (solution.stop == Stop::Minimum).then_some(solution.values)
    }

    /// The normal equations with the weights as they are. `None` where a corner would lie behind its camera.
    pub fn equations(&self, layout: &Layout) -> Option<Equations> {
        levenberg_marquardt::equations(&self.views, layout, &self.priors, &self.values, Loss::Squared)
    }
}

impl Solved {
    /// Variance of the unknowns over what the weighted normal equations say: what neighbouring corners share, and the
    /// loss.
    pub fn inflation(&self) -> f64 {
        self.problem.neighbours().inflation() * self.loss_factor
    }

    /// Covariance of the shared numbers; an error where the views do not tell.
    pub fn covariance(&self, layout: &Layout) -> Result<DMatrix<f64>, Error> {
        let equations = self.problem.equations(layout).ok_or_else(Error::undetermined)?;
        let covariance = uncertainty::covariance(&equations).ok_or_else(Error::undetermined)?;
        let worst = worst_focal_sigma(&covariance, layout, &self.shared().rig);
        let known = worst <= UNTOLD_FOCAL_SIGMA;
        if known {
            Ok(covariance)
        } else {
            Err(Error::Undetermined { one_pose: None, focal_sigma: Some(worst), skipped: Vec::new() })
        }
    }

    /// The normal equations with the loss's own curvature: along its residual a corner's gradient changes by less than
    /// its weight.
    pub fn curvature(&self, layout: &Layout) -> Option<Equations> {
        let mut curved = self.problem.clone();
        for (view, pose) in curved.views.iter_mut().zip(&curved.values.poses) {
            for o in view.observations.iter_mut().filter(|o| o.active) {
                // The whitener has the weight in it.
                let residual = o.whiten(residuals::residual_px(&curved.values.shared, pose, o)?);
                let slope = self.loss.slope_along(residual.norm_squared());
                if slope < 1.0 {
                    let along = residual * residual.transpose() / residual.norm_squared();
                    o.whitener = (Matrix2::identity() + along * (slope.sqrt() - 1.0)) * o.whitener;
                }
            }
        }
        curved.equations(layout)
    }

    /// Variance of the corners about an earlier calibration over that of these pairs; at least one. A few pairs of a
    /// board that is held by hand take up much of what pictures of the rig miss it by, and seem to scatter less than
    /// they do.
    pub fn noise_of(&self, earlier: Option<&Noise>) -> f64 {
        let px = |noise: &Noise| noise.typical_px(&self.problem.views);
        earlier.map_or(1.0, |earlier| (px(earlier) / px(&self.noise)).powi(2).max(1.0))
    }

    pub fn shared(&self) -> &Shared {
        &self.problem.values.shared
    }
}

/// Where values put a board behind a camera.
fn unseen() -> Error {
    Error::NotConverged { steps: 0 }
}

/// The values where a search ended at a minimum. A lens that was asked for may have numbers that these views do not
/// tell apart; the covariance says which.
fn converged(solution: Solution) -> Result<Values, Error> {
    match solution.stop {
        Stop::Minimum | Stop::Valley => Ok(solution.values),
        _ => Err(Error::NotConverged { steps: solution.steps }),
    }
}

/// Puts the weights of a loss into the whiteners, so that the minimum is that of the weighted squares.
fn put_weights_in(views: &mut [View], values: &Values, loss: Loss) {
    for (view, pose) in views.iter_mut().zip(&values.poses) {
        for o in &mut view.observations {
            let squared = residuals::residual_px(&values.shared, pose, o).map_or(0.0, |r| o.whiten(r).norm_squared());
            o.whitener *= loss.weight(squared).sqrt();
        }
    }
}
