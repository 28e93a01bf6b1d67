//! From a data set to the problem that the solvers get: base parameters, row weights, scatter, prior and box.
//!
//! In: a [`Task`]. Out: [`Rows`] whose scatter makes the white residuals as large as they should be, base parameters,
//! the prior of greatest evidence, and a box. The chain on which weights have their levers follows the fit, so that fit
//! and written robot are one.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::fit::Fit;
use super::problem::Solution;
use super::scatter::estimate_scatter;
use super::task::{FIRST_SCATTER_MM, Task, prior_rows};
use super::trust_region;
use crate::identify::Error;
use crate::identify::model::base::{Base, NEGLIGIBLE};
use crate::identify::model::prior::{Likelihood, Tolerance};
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::{Model, Prior, Settings};
use crate::linear_algebra::{product, pseudo_inverse};
use crate::robot::tool_fit::TYPED_MM;
use crate::robot::{Parameter, Robot, Unit};

/// Rounds of fitting and of estimating scatter and prior from the residuals.
const ROUNDS: usize = 4;

/// Rounds in which the fit may have come to where the poses determine more.
const BASES: usize = 2;

/// Rounds of estimating scatter and prior from the residuals at the most, and the change of the scatter's logarithm
/// that ends them.
const ESTIMATES: usize = 10;
const SAME_SCATTER: f64 = 0.01;

/// A fit may end so far into the box before the box is widened.
const NEAR_WALL: f64 = 0.95;

/// Share (mrad a mm, where the others are angles) of a tool's place in a sum from which on the sum is as much the
/// tool's.
const ALIKE: f64 = 0.5;

/// The written robot is the fitted one when moving the levers' chain moves no parameter by more, mm or mrad.
const SAME_CHAIN: f64 = 1e-11;

/// Standard deviation of a zero about which nothing is known, mm: far above any instrument's.
const NO_ZERO_MM: f64 = 10.0;

/// Everything the solvers share.
#[derive(Debug, Clone)]
pub struct Formulation {
    pub model: Model,
    /// Residuals with their final weights.
    pub rows: Rows,
    pub base: Base,
    /// Half-widths of the box, one a base parameter, mm and mrad.
    pub bounds: Vec<f64>,
    /// Base parameters that are farther off than their box was asked to be, with the amount.
    pub widened: Vec<String>,
    /// The prior's standard deviations.
    pub tolerance: Tolerance,
    /// The largest that the data allow: what the data leave open is as uncertain as these say.
    pub most: Tolerance,
    /// Whether they hold the parameters, or only share out what is determined together.
    pub held: bool,
    /// The fit without a box, extras included.
    pub free_fit: Solution,
    /// Whether the data see the robot's size.
    pub scale_seen: bool,
    /// How many times larger errors that rows share make the variances than independent ones would; one until it was
    /// looked for.
    pub common: f64,
}

impl Formulation {
    /// Base parameters, weights, prior and box.
    pub fn new(task: &Task) -> Result<Formulation, Error> {
        let held = task.settings.prior == Prior::Evidence;
        let mut estimate = Estimate::new(task)?;
        for round in 0..ESTIMATES {
            let before = estimate.scatter;
            estimate.round(round, held);
            let after = estimate.scatter;
            let change = (after.point_mm / before.point_mm).ln().abs() + (after.stated / before.stated).ln().abs();
            if round + 1 >= ROUNDS && change < SAME_SCATTER {
                break;
            }
        }
        let tolerance = estimate.tolerance;
        let (rows, base, free_fit) = estimate.settled(held)?;
        let (bounds, widened) = bounds(&base, task.parameters, &free_fit.x, task.settings);
        let mut formulation = Formulation {
            model: task.model,
            rows,
            base,
            bounds,
            widened,
            tolerance,
            most: tolerance,
            held,
            free_fit,
            scale_seen: task.scale_is_seen(),
            common: 1.0,
        };
        if held {
            formulation.most = formulation.with_likelihood(|data| data.at_most(&tolerance));
        }
        Ok(formulation)
    }

    /// The parameters that the vector of all offsets stands for.
    pub fn parameters(&self) -> &[Parameter] {
        &self.rows.kinematics.parameters
    }

    /// Offsets of all parameters and extras where the free fit ended.
    pub fn offsets_of(&self) -> Vec<f64> {
        self.offsets_at(&self.free_fit.x[..self.base.rank()])
    }

    /// Offsets of all parameters with these base parameters, and of the extras where the free fit ended.
    pub fn offsets_at(&self, of_base: &[f64]) -> Vec<f64> {
        let of_robot = self.spread() * nalgebra::DVector::from_column_slice(of_base);
        of_robot.iter().chain(self.extras()).copied().collect()
    }

    /// All parameters of the robot from the base parameters.
    pub fn spread(&self) -> DMatrix<f64> {
        self.tolerance.spread(&self.base, self.parameters())
    }

    /// Values of the extra unknowns.
    pub fn extras(&self) -> &[f64] {
        &self.free_fit.x[self.base.rank()..]
    }

    /// Rows of the prior of these standard deviations; none without one.
    fn prior(&self, tolerance: &Tolerance, extras: &[Extra]) -> DMatrix<f64> {
        self.prior_held(tolerance, extras, self.held)
    }

    /// The same where the tolerances hold the parameters or not; a scale that nothing sees is held all the same.
    fn prior_held(&self, tolerance: &Tolerance, extras: &[Extra], held: bool) -> DMatrix<f64> {
        let unscaled = (!self.scale_seen).then_some(&self.rows.kinematics.nominal);
        prior_rows(tolerance, &self.base, self.parameters(), extras, held, unscaled)
    }

    /// The problem in its box, the sensor's errors fixed where the free fit found them.
    pub fn fit(&self) -> Fit<'_> {
        let rows = match self.rows.extras.is_empty() && self.rows.scatter.smooth.is_none() {
            true => Cow::Borrowed(&self.rows),
            false => Cow::Owned(self.rows.with_sensor_fixed(&self.offsets_of())),
        };
        Fit::new(rows, &self.base, self.spread(), &self.bounds, self.prior(&self.tolerance, &[]))
    }

    /// Covariance of the unknowns (base parameters, extras), mm and mrad: data and prior together, the data's part as
    /// much larger as errors that rows share make it.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.covariance_with(&self.most)
    }

    /// What the data alone know the zero of distances to a centre to, mm; `None` where it is no unknown.
    pub fn zero_sigma_mm(&self) -> Option<f64> {
        let k = self.base.rank() + self.rows.extras.iter().position(|e| *e == Extra::Zero)?;
        let untold = Tolerance { zero_mm: NO_ZERO_MM, ..self.most };
        Some(self.covariance_with(&untold)[(k, k)].max(0.0).sqrt())
    }

    fn covariance_with(&self, tolerance: &Tolerance) -> DMatrix<f64> {
        let (prior, (data, _)) = (self.prior(tolerance, &self.rows.extras), self.normal());
        self.with_common(pseudo_inverse(&data + prior.tr_mul(&prior)), data)
    }

    /// A covariance that follows from independent errors, the part of the data as much larger as errors that rows share
    /// make it.
    fn with_common(&self, covariance: DMatrix<f64>, data: DMatrix<f64>) -> DMatrix<f64> {
        let more = &covariance * data * &covariance * (self.common - 1.0);
        covariance + more
    }

    /// The data, linear in the unknowns (base parameters, extras), without a prior: the product of the white Jacobian
    /// with itself, and with the white residuals at offset zero.
    pub fn normal(&self) -> (DMatrix<f64>, DVector<f64>) {
        let none = DMatrix::zeros(0, self.free_fit.x.len());
        Fit::free(&self.rows, &self.base, self.spread(), none).normal(&self.free_fit.x)
    }

    /// Logarithm of how much more probable the rows are with links that are off by what was found than with links that
    /// are off by at most so much, mm; zero where nothing was found of how they are made.
    pub fn odds_of_lengths_beyond(&self, most_mm: f64) -> f64 {
        if !self.held || self.tolerance.lengths_mm <= most_mm {
            return 0.0;
        }
        self.with_likelihood(|data| data.odds_of_lengths_beyond(most_mm, &self.tolerance))
    }

    /// What the rows say of tolerances.
    fn with_likelihood<T>(&self, ask: impl FnOnce(&Likelihood) -> T) -> T {
        let (mut normal, gradient) = self.normal();
        let (base, parameters, extras) = (&self.base, self.parameters(), self.rows.extras.as_slice());
        // Touches fit the better the shorter all links are, which is no evidence of how well they are made.
        let held = self.prior_held(&self.tolerance, extras, false);
        normal += held.tr_mul(&held);
        ask(&Likelihood { base, parameters, extras, normal: &normal, gradient: &gradient })
    }

    /// Covariance of all parameters of the robot as far as the poses determine them.
    pub fn robot_covariance(&self) -> DMatrix<f64> {
        let rank = self.base.rank();
        let spread = self.spread();
        let of_base = self.covariance().view((0, 0), (rank, rank)).into_owned();
        &spread * of_base * spread.transpose()
    }

    /// The same with what the poses tell next to nothing of: parameters that only act together, or that nothing saw, as
    /// uncertain as they were before. At the poses that were fitted it makes no difference, at others it may.
    pub fn whole_covariance(&self) -> DMatrix<f64> {
        let count = self.parameters().len();
        self.offsets_covariance(&|_| false).view((0, 0), (count, count)).into_owned()
    }

    /// That of all parameters and extras, parameters that are `held` taken as they are.
    pub fn offsets_covariance(&self, held: &dyn Fn(Parameter) -> bool) -> DMatrix<f64> {
        if !self.held {
            let (spread, extras) = (self.spread(), self.rows.extras.len());
            let (rows, columns) = spread.shape();
            let mut spread = spread.resize(rows + extras, columns + extras, 0.0);
            spread.view_mut((rows, columns), (extras, extras)).fill_with_identity();
            return &spread * self.covariance() * spread.transpose();
        }
        let (_, jacobian) = self.rows.evaluate(&self.offsets_of(), true);
        let mut sds = self.most.standard_deviations(self.parameters(), &self.rows.extras);
        for (sd, &parameter) in sds.iter_mut().zip(self.parameters()) {
            if held(parameter) {
                *sd = 0.0;
            }
        }
        let data = product(&jacobian, &jacobian);
        let sds = DMatrix::from_diagonal(&DVector::from_vec(sds));
        let before = DMatrix::identity(sds.nrows(), sds.nrows());
        self.with_common(&sds * pseudo_inverse(before + &sds * &data * &sds) * &sds, data)
    }

    /// Base parameters about which the data say next to nothing: as uncertain as before.
    pub fn unmoved(&self) -> Vec<usize> {
        if !self.held {
            return Vec::new();
        }
        let before = self.most.covariance(&self.base, self.parameters(), &[]);
        let after = self.covariance();
        let weak = |&k: &usize| after[(k, k)].sqrt() > 0.9 * before[(k, k)].sqrt();
        (0..self.base.rank()).filter(weak).map(|k| self.base.free[k]).collect()
    }
}

/// A fit whose scatter and prior are estimated from its residuals, round by round.
struct Estimate<'a> {
    task: &'a Task<'a>,
    base: Base,
    scatter: Scatter,
    tolerance: Tolerance,
    /// Base parameters and extras.
    x: Vec<f64>,
    /// The robot on whose chain weights have their levers.
    load_chain: Robot,
}

impl<'a> Estimate<'a> {
    /// From the side of noise: what the parameters have not explained yet counts as scatter, so that a few rows are not
    /// followed to the last digit by a prior that makes room for it.
    fn new(task: &'a Task<'a>) -> Result<Estimate<'a>, Error> {
        let load_chain = task.robot.clone();
        let scatter = Scatter { smooth: task.smooth, ..Scatter::of_point(FIRST_SCATTER_MM) };
        let rows = task.rows_at(scatter, &load_chain);
        let base = task.base(&rows)?;
        task.check_count(&rows, &base)?;
        let x = vec![0.0; base.rank() + task.extras.len()];
        let scatter = estimate_scatter(&rows, &vec![0.0; rows.offset_count()], 0.0, None, scatter);
        Ok(Estimate { task, base, scatter, tolerance: Tolerance::START, x, load_chain })
    }

    fn rows(&self) -> Rows {
        self.task.rows_at(self.scatter, &self.load_chain)
    }

    fn fit<'b>(&'b self, rows: &'b Rows, prior: DMatrix<f64>) -> Fit<'b> {
        Fit::free(rows, &self.base, self.tolerance.spread(&self.base, self.task.parameters), prior)
    }

    fn round(&mut self, round: usize, held: bool) {
        let (task, rows) = (self.task, self.rows());
        if held {
            let (mut normal, gradient) = self.fit(&rows, DMatrix::zeros(0, self.x.len())).normal(&self.x);
            let held = task.prior_rows(&self.tolerance, &self.base, false);
            normal += held.tr_mul(&held);
            let (base, Task { parameters, extras, .. }) = (&self.base, *task);
            let data = Likelihood { base, parameters, extras, normal: &normal, gradient: &gradient };
            self.tolerance = data.most_probable();
        }
        let fit = self.fit(&rows, task.prior_rows(&self.tolerance, &self.base, held || round == 0));
        let x = trust_region::solve(&fit, &self.x, &task.settings.trust_region).x;
        let offsets = fit.offsets(&x);
        let lost = (task.model == Model::Pose).then(|| fit.lost(&x)).flatten();
        self.scatter = estimate_scatter(&rows, &offsets, fit.determined(&x), lost, self.scatter);
        self.load_chain = task.robot.shifted(task.parameters, &offsets);
        self.x = x;
        if round < BASES {
            task.look_again(&rows, &offsets, &mut self.base, &mut self.x);
        }
    }

    /// The fit with scatter and prior as they are, on rows whose levers are on the robot that it ends at.
    fn settled(mut self, held: bool) -> Result<(Rows, Base, Solution), Error> {
        let (task, mut rows) = (self.task, self.rows());
        let prior = task.prior_rows(&self.tolerance, &self.base, held);
        let bends = task.parameters.iter().any(|p| matches!(p, Parameter::Gravity(..) | Parameter::Bending(..)));
        let mut free_fit = None;
        for _ in 0..ROUNDS {
            let fit = self.fit(&rows, prior.clone());
            let solved = trust_region::solve(&fit, &self.x, &task.settings.trust_region);
            let moved = solved.x.iter().zip(&self.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            self.load_chain = task.robot.shifted(task.parameters, &fit.offsets(&solved.x));
            rows = self.rows();
            self.x.clone_from(&solved.x);
            free_fit = Some(solved);
            if moved < SAME_CHAIN || !bends {
                break;
            }
        }
        Ok((rows, self.base, free_fit.ok_or(Error::NotFinite)?))
    }
}

fn bounds(base: &Base, parameters: &[Parameter], x: &[f64], settings: &Settings) -> (Vec<f64>, Vec<String>) {
    let mut widened = Vec::new();
    let bound = |(row, &value): (usize, &f64)| {
        let mut bound = match parameters[base.free[row]].unit() {
            Unit::Mm => settings.bound_mm,
            Unit::Mrad => 1000.0 * settings.bound_deg.to_radians(),
        };
        if settings.widen_bounds && value.abs() > NEAR_WALL * bound {
            // A tool is typed off a drawing, and what acts like it is not told from it.
            let of_tool = |&(i, c): &(usize, f64)| matches!(parameters[i], Parameter::V(_)).then_some(c.abs());
            let of_tool = base.sum(row, ALIKE).iter().find_map(of_tool);
            if of_tool.is_none_or(|c| value.abs() > c * TYPED_MM) {
                let whose = if of_tool.is_some() { " (the tool, `v_x` to `v_z`, or the last link)" } else { "" };
                widened.push(base.said(row, NEGLIGIBLE, parameters, value) + whose);
            }
            while value.abs() > NEAR_WALL * bound {
                bound *= 2.0;
            }
        }
        bound
    };
    let bounds = x[..base.rank()].iter().enumerate().map(bound).collect();
    (bounds, widened)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::synthetic;
    use crate::robot::corrections::LoadPoint;

    /// Levers on a chain that is not the fitted one would bend the written robot otherwise than the one that was
    /// fitted.
    #[test]
    fn the_levers_of_a_robot_that_sags_are_on_the_robot_that_was_fitted() {
        let sag = |robot: &mut Robot| {
            robot.add(Parameter::Gravity(1, LoadPoint::Tool), 20.0);
            robot.add(Parameter::Gravity(2, LoadPoint::Tool), 30.0);
            robot.add(Parameter::A(2), 5.0);
        };
        let world = synthetic::planned(60, 0, 25.0, 0.02, 4, &sag);
        let set = Dataset::new(&world.rows).unwrap();
        let mut parameters = world.nominal.mdh_parameters();
        parameters.extend([1, 2].map(|joint| Parameter::Gravity(joint, LoadPoint::Tool)));
        let (fitted, settings) = (set.fit_rows(), synthetic::settings());
        let task = Task::plain(&set, &world.nominal, &parameters, &fitted, &settings);
        let found = Formulation::new(&task).unwrap();
        let robot = world.nominal.shifted(&parameters, &found.offsets_of());
        let rows = task.rows_at(found.rows.scatter, &robot);
        let fit = Fit::free(&rows, &found.base, found.spread(), found.prior(&found.tolerance, &rows.extras));
        let again = trust_region::solve(&fit, &found.free_fit.x, &settings.trust_region);
        let moved = again.x.iter().zip(&found.free_fit.x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(moved < 100.0 * SAME_CHAIN, "{moved}");
    }
}
