//! A fit that gross errors cannot get past: iteratively reweighted least squares with Tukey's biweight, its scale from
//! the median of the residuals, after a start by least absolute residuals (Holland and Welsch, 1977).
//!
//! In: a [`Task`]. Out: weights, sizes of residuals in robust standard deviations, the robot and the scatter of the
//! rest.

use nalgebra::DMatrix;

use super::fit::Fit;
use super::linearised::Linearised;
use super::scatter::{Residual, robust_scale, robust_scatter, sizes};
use super::task::{FIRST_SCATTER_MM, Task};
use super::trust_region;
use crate::identify::Error;
use crate::identify::model::base::Base;
use crate::identify::model::prior::Tolerance;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::Scatter;
use crate::identify::settings::DescentSettings;
use crate::robot::Robot;

/// Rounds of reweighting, and how many of them only bound the influence of large residuals.
const ROBUST_ROUNDS: usize = 14;
const BOUNDED_ROUNDS: usize = 8;

/// Rounds in which the placement of a robot that is not fitted settles.
const PLACING_ROUNDS: usize = 4;

/// Steps of the trust region between two estimates of weights.
const STEPS_A_ROUND: usize = 2;

/// Steps after residuals were capped.
const STEPS_A_CAP: usize = 4;

/// The factor of the stated covariances is looked for every so many rounds.
const ROUNDS_A_FACTOR: usize = 4;

/// Tukey's constant, in standard deviations: 95 % efficient for one normal number.
const BIWEIGHT: f64 = 4.685;

/// At least one number in so many counts as a degree of freedom, however many parameters there are: the prior holds
/// them.
pub const LEAST_FREEDOM: usize = 4;

impl<'a> Task<'a> {
    /// A fit that gross errors cannot get past, from the nominal robot. The scale that a residual is held against
    /// follows the median while influence is only bounded, and stays as it is while large residuals lose all weight
    /// (Yohai, "High breakdown-point and high efficiency robust estimates for regression", 1987): a scale that followed
    /// would shrink around the rows that happen to fit.
    pub fn robust(&self, loss: Loss) -> Result<Robust<'a>, Error> {
        let (scatter, count) = (Scatter::of_point(FIRST_SCATTER_MM), self.set.poses.len());
        let rows = self.rows_at(scatter, self.robot);
        let base = self.base(&rows)?;
        self.check_count(&rows, &base)?;
        let mut robust = Robust {
            task: *self,
            x: vec![0.0; base.rank() + self.extras.len()],
            offsets: vec![0.0; rows.offset_count()],
            robot: self.robot.clone(),
            weights: vec![1.0; count],
            scores: Vec::new(),
            scatter,
            base,
            unweighted: rows,
        };
        let bounded = if loss == Loss::Biweight { BOUNDED_ROUNDS } else { ROBUST_ROUNDS };
        let mut scale = 1.0;
        for round in 0..ROBUST_ROUNDS {
            let residuals = robust.residuals();
            if round <= bounded {
                let freedom = robust.freedom(&residuals);
                let both = round > 0 && round % ROUNDS_A_FACTOR == 0;
                robust.scatter = robust_scatter(&residuals, self.rows, count, freedom, robust.scatter, both);
                scale = robust_scale(&residuals, self.rows, count, freedom, &robust.scatter);
            }
            robust.scores = sizes(&residuals, &robust.scatter, scale, count);
            for &row in self.rows {
                let u = robust.scores[row];
                robust.weights[row] = if round >= bounded { biweight(u) } else { (1.0 / u.max(1.0)).sqrt() };
            }
            robust.step(STEPS_A_ROUND);
            if round == 0 {
                self.look_again(&robust.unweighted, &robust.offsets, &mut robust.base, &mut robust.x);
            }
        }
        Ok(robust)
    }

    /// What is left of the robot as it is, with nothing but the sensor placed: mean size a coordinate, mm, after a few
    /// rounds of bounded influence, or the first figure that is beyond `hopeless_mm`.
    pub fn unfitted_mm(&self, hopeless_mm: f64) -> f64 {
        typical_mm(&self.unfitted(hopeless_mm))
    }

    fn unfitted(&self, hopeless_mm: f64) -> Vec<Residual> {
        let mut weights = vec![1.0; self.set.poses.len()];
        let mut residuals = Vec::new();
        let scatter = Scatter::of_point(FIRST_SCATTER_MM);
        let mut rows = self.rows_at(scatter, self.robot);
        for _ in 0..PLACING_ROUNDS {
            rows = rows.weighed_anew(self, scatter, &weights, self.robot);
            residuals = Residual::all(&rows.raw(&vec![0.0; rows.offset_count()]));
            let typical = typical_mm(&residuals);
            if typical > hopeless_mm {
                break;
            }
            for residual in &residuals {
                weights[residual.row] = (typical / residual.size_mm().max(typical).max(f64::MIN_POSITIVE)).sqrt();
            }
        }
        residuals
    }

    /// Sizes of what is left of the robot as it is, in standard deviations of `least` or, where these rows scatter by
    /// more, of theirs; one a row of the data set.
    pub fn unfitted_sizes(&self, least: Scatter) -> Vec<f64> {
        let (residuals, count) = (self.unfitted(f64::INFINITY), self.set.poses.len());
        let own = robust_scatter(&residuals, self.rows, count, 1.0, least, false);
        sizes(&residuals, &Scatter { point_mm: own.point_mm.max(least.point_mm), ..least }, 1.0, count)
    }
}

/// Mean size of residuals a coordinate, mm, without the largest tenth.
fn typical_mm(residuals: &[Residual]) -> f64 {
    let mut sizes: Vec<f64> = residuals.iter().map(Residual::size_mm).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.truncate(sizes.len() - sizes.len() / 10);
    sizes.iter().sum::<f64>() / sizes.len().max(1) as f64
}

/// How large residuals are held down.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loss {
    /// Their influence is bounded: absolute values beyond one robust standard deviation (Huber).
    Absolute,
    /// Those beyond some standard deviations have none.
    Biweight,
}

/// A robust fit.
#[derive(Debug, Clone)]
pub struct Robust<'a> {
    pub(super) task: Task<'a>,
    pub(super) base: Base,
    pub(super) x: Vec<f64>,
    /// Roots of the rows' weights, one a row of the data set.
    pub weights: Vec<f64>,
    /// Sizes of the fitted rows' residuals in robust standard deviations, one a row of the data set.
    pub scores: Vec<f64>,
    /// Offsets of parameters and extras.
    pub offsets: Vec<f64>,
    pub robot: Robot,
    pub scatter: Scatter,
    /// The task's rows before any weights.
    pub(super) unweighted: Rows,
}

/// The prior of robust fits, where its size is not yet known from the data.
const LOOSE: Tolerance = Tolerance { lengths_mm: 3.0, target_mm: 100.0, gravity_mrad_per_m: 10.0, ..Tolerance::START };

impl Robust<'_> {
    /// The rows with their weights.
    fn rows(&self) -> Rows {
        self.unweighted.weighed_anew(&self.task, self.scatter, &self.weights, &self.robot)
    }

    fn residuals(&self) -> Vec<Residual> {
        Residual::all(&self.rows().raw(&self.offsets))
    }

    /// Some steps of the trust region with the weights as they are.
    pub(super) fn step(&mut self, iterations: usize) {
        let (task, rows) = (self.task, self.rows());
        let prior = task.prior_rows(&LOOSE, &self.base, true);
        let fit = Fit::free(&rows, &self.base, LOOSE.spread(&self.base, task.parameters), prior);
        let settings = DescentSettings { iterations, ..task.settings.trust_region };
        self.x = trust_region::solve(&fit, &self.x, &settings).x;
        self.offsets = fit.offsets(&self.x);
        self.robot = task.robot.shifted(task.parameters, &self.offsets);
    }

    /// The same fit with no residual counting for more than one of `cap` robust standard deviations: with bounded
    /// influence alone a row that is off by a thousand still holds more of the sum of squares than all the others.
    pub fn capped(mut self, cap: f64) -> Self {
        let beyond: Vec<usize> = self.task.rows.iter().copied().filter(|&row| self.scores[row] > cap).collect();
        for &row in &beyond {
            self.weights[row] = cap.sqrt() / self.scores[row];
        }
        if !beyond.is_empty() {
            self.step(STEPS_A_CAP);
        }
        self
    }

    /// Mean size of the fitted rows' residuals a coordinate, mm, without the largest tenth of them.
    pub fn typical_mm(&self) -> f64 {
        typical_mm(&self.residuals())
    }

    /// Numbers measured, less the unknowns.
    pub fn free_numbers(&self) -> usize {
        self.rows().count().saturating_sub(self.x.len())
    }

    /// What residuals that were fitted have lost: root of numbers over degrees of freedom.
    fn freedom(&self, residuals: &[Residual]) -> f64 {
        let numbers: usize = residuals.iter().map(|r| r.count).sum();
        let left = self.unweighted.count().saturating_sub(self.x.len()).max(numbers.div_ceil(LEAST_FREEDOM));
        (numbers as f64 / left.max(1) as f64).sqrt()
    }

    /// The rows with their weights, linearised where the fit ended, and the normal matrix of a loose prior on all
    /// parameters.
    pub fn linearised(&self) -> (Rows, Linearised, DMatrix<f64>) {
        let rows = self.rows();
        let count = self.offsets.len();
        let mut prior = DMatrix::identity(count, count);
        for (i, &parameter) in self.task.parameters.iter().enumerate() {
            prior[(i, i)] = LOOSE.of(parameter).powi(-2);
        }
        let linearised = Linearised::new(&rows, &self.offsets);
        (rows, linearised, prior)
    }
}

/// Root of Tukey's weight for a residual of `u` robust standard deviations.
fn biweight(u: f64) -> f64 {
    let inside = 1.0 - (u / BIWEIGHT).powi(2);
    inside.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::settings::Settings;
    use crate::identify::synthetic;

    /// What is left of a fit is the noise, whatever a few rows are off by.
    #[test]
    fn the_typical_residual_is_that_of_the_rows_that_fit() {
        let mut world = synthetic::planned(80, 0, 25.0, 0.05, 6, &|_| {});
        world.rows.iter_mut().skip(10).step_by(16).for_each(|row| synthetic::point(row).x += 10.0);
        let (set, settings) = (Dataset::new(&world.rows).unwrap(), Settings::default());
        let (rows, parameters) = (set.fit_rows(), world.nominal.mdh_parameters());
        let task = Task::plain(&set, &world.nominal, &parameters, &rows, &settings);
        let left_mm = task.robust(Loss::Absolute).unwrap().typical_mm();
        assert!((0.02..0.06).contains(&left_mm), "{left_mm}");
    }
}
