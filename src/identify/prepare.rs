//! From a data set to the problem that the solvers get: base parameters, scatter, prior and box.
//!
//! In: rows, model, parameters. Out: an [`Estimate`] whose scatter makes the whitened residuals as large as they should be
//! (the sum of squares equals its degrees of freedom), base parameters, the prior of greatest evidence, and a box.
//! What goes wrong: fewer numbers than base parameters, or poses that determine none; both are errors with the counts.

use nalgebra::{Cholesky, DMatrix, DVector, Matrix3};

use super::Error;
use super::base::Base;
use super::blocks::{Raw, Scatter, product};
use super::dataset::Dataset;
use super::estimate::{Estimate, Fit};
use super::prior::Tolerance;
use super::problem::{Problem, Solution};
use super::settings::{Model, Prior, Redundancy, Settings};
use super::trust_region;
use crate::robot::{Parameter, Robot, Unit};

/// Rounds of fitting and of estimating scatter and prior from the residuals.
const ROUNDS: usize = 3;

/// Scatter before anything is known: about a good robot's after calibration.
const FIRST_SCATTER: Scatter = Scatter { point_mm: 0.1, rotation_rad: 1e-4 };

/// Least scatter, mm and rad: far below any instrument; keeps weights finite for exact data.
const LEAST_SCATTER: Scatter = Scatter { point_mm: 1e-7, rotation_rad: 1e-10 };

/// A fit may end so far into the box before the box is widened.
const NEAR_WALL: f64 = 0.95;

/// Everything the solvers share.
#[derive(Debug, Clone)]
pub struct Prepared {
    /// Residuals with their final weights.
    pub estimate: Estimate,
    /// What the poses determine.
    pub base: Base,
    /// Half-widths of the box, one a base parameter, mm and mrad.
    pub bounds: Vec<f64>,
    /// Names of base parameters whose box is wider than asked for.
    pub widened: Vec<String>,
    /// The prior, where there is one.
    pub tolerance: Option<Tolerance>,
    /// The fit without a box.
    pub free_fit: Solution,
}

impl Prepared {
    /// Base parameters, weights, prior and box for `rows` under `model`.
    pub fn new(
        set: &Dataset,
        robot: &Robot,
        parameters: &[Parameter],
        rows: &[usize],
        model: Model,
        settings: &Settings,
    ) -> Result<Prepared, Error> {
        let mut estimate = Estimate::new(set, robot, parameters, rows, model, FIRST_SCATTER, settings.wire_offset);
        let (_, jacobian) = estimate.evaluate(&vec![0.0; parameters.len()], true);
        let base = match settings.redundancy {
            Redundancy::Qr => Base::new(&jacobian, settings.rank_tolerance),
            Redundancy::Correlation => Base::by_correlation(&jacobian, settings.rank_tolerance),
        };
        // Identical poses leave columns of rounding errors, whose rank means nothing: judge their size in mm a mm or mrad.
        let largest = jacobian.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
        let strength = largest * estimate.unit_variance_mm2().sqrt() / (jacobian.nrows().max(1) as f64).sqrt();
        if base.rank() == 0 || strength <= settings.rank_tolerance {
            return Err(Error::NothingDetermined { poses: rows.len() });
        }
        if estimate.count() <= base.rank() {
            return Err(Error::TooFew { numbers: estimate.count(), parameters: base.rank(), poses: rows.len() });
        }
        let mut tolerance = Tolerance::default();
        let mut x = vec![0.0; base.rank()];
        for round in 0..ROUNDS {
            let prior = prior_rows(&tolerance, &base, parameters, settings, round == 0);
            let fit = Fit::new(&estimate, &base, &vec![f64::INFINITY; x.len()], prior.clone());
            x = trust_region::solve(&fit, &x, &settings.trust_region).x;
            let scatter = scatter(&estimate, &fit.offsets(&x), effective(&estimate, &fit, &x, &prior));
            estimate = Estimate::new(set, robot, parameters, rows, model, scatter, settings.wire_offset);
            if settings.prior == Prior::Evidence {
                let (residuals, jacobian) = white(&estimate, &base, &x);
                let at_zero = residuals - &jacobian * DVector::from_column_slice(&x);
                tolerance = Tolerance::from_evidence(&base, parameters, &at_zero, &jacobian);
            }
        }
        let prior = prior_rows(&tolerance, &base, parameters, settings, false);
        let fit = Fit::new(&estimate, &base, &vec![f64::INFINITY; x.len()], prior);
        let free_fit = trust_region::solve(&fit, &x, &settings.trust_region);
        let (bounds, widened) = bounds(&base, parameters, &free_fit.x, settings);
        let tolerance = (settings.prior == Prior::Evidence).then_some(tolerance);
        Ok(Prepared { estimate, base, bounds, widened, tolerance, free_fit })
    }

    /// The parameters that the vector of all offsets stands for.
    pub fn parameters(&self) -> &[Parameter] {
        self.estimate.kinematics.parameters()
    }

    /// Rows of the prior; none without one.
    pub fn prior(&self) -> DMatrix<f64> {
        match &self.tolerance {
            Some(tolerance) => tolerance.rows(&self.base, self.parameters()),
            None => DMatrix::zeros(0, self.base.rank()),
        }
    }

    /// The problem in its box.
    pub fn fit(&self) -> Fit<'_> {
        Fit::new(&self.estimate, &self.base, &self.bounds, self.prior())
    }

    /// Standard deviation of every base parameter at `x`, mm and mrad.
    pub fn sigmas(&self, x: &[f64]) -> Vec<f64> {
        let (_, jacobian) = white(&self.estimate, &self.base, x);
        let prior = self.prior();
        let normal = product(&jacobian, &jacobian) + prior.tr_mul(&prior);
        let inverse = super::blocks::pseudo_inverse(normal);
        (0..x.len()).map(|i| inverse[(i, i)].max(0.0).sqrt()).collect()
    }

    /// Base parameters about which the data say next to nothing: as uncertain as before.
    pub fn unmoved(&self, x: &[f64]) -> Vec<usize> {
        let Some(tolerance) = &self.tolerance else { return Vec::new() };
        let covariance = tolerance.covariance(&self.base, self.parameters());
        let sigmas = self.sigmas(x);
        (0..x.len()).filter(|&i| sigmas[i] > 0.9 * covariance[(i, i)].sqrt()).map(|i| self.base.free[i]).collect()
    }
}

fn prior_rows(
    tolerance: &Tolerance,
    base: &Base,
    parameters: &[Parameter],
    settings: &Settings,
    first: bool,
) -> DMatrix<f64> {
    if settings.prior == Prior::Off && !first {
        return DMatrix::zeros(0, base.rank());
    }
    tolerance.rows(base, parameters)
}

/// White residuals and Jacobian of the base parameters at `x`.
fn white(estimate: &Estimate, base: &Base, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let mut offsets = vec![0.0; estimate.kinematics.parameters().len()];
    for (&i, &value) in base.free.iter().zip(x) {
        offsets[i] = value;
    }
    let (residuals, jacobian) = estimate.evaluate(&offsets, true);
    let columns = DMatrix::from_fn(jacobian.nrows(), base.rank(), |r, c| jacobian[(r, base.free[c])]);
    (residuals, columns)
}

/// Number of parameters that the data, and not the prior, have determined.
fn effective(estimate: &Estimate, fit: &Fit, x: &[f64], prior: &DMatrix<f64>) -> f64 {
    let (_, jacobian) = white(estimate, fit.base, x);
    let normal = product(&jacobian, &jacobian);
    let total = &normal + prior.tr_mul(prior);
    match Cholesky::new(total) {
        Some(total) => total.solve(&normal).trace(),
        None => fit.dimension() as f64,
    }
}

/// The scatter at which the whitened sum of squares equals the degrees of freedom (Pearson's equation); for points
/// and orientations apart.
fn scatter(estimate: &Estimate, offsets: &[f64], effective: f64) -> Scatter {
    let raw = estimate.raw(offsets);
    let turns: Vec<f64> =
        raw.iter().filter_map(|(_, r)| if let Raw::Turn(t) = r { Some(t.norm_squared()) } else { None }).collect();
    let lost = estimate.count() as f64;
    let total: f64 = raw.iter().map(|(_, r)| if matches!(r, Raw::Length(..)) { 1.0 } else { 3.0 }).sum();
    // Each number loses the same share to parameters and placements.
    let share = ((lost - effective) / total.max(1.0)).max(1.0 / total.max(1.0));
    let sum = |s: f64| raw.iter().map(|(_, r)| whitened_square(r, s)).sum::<f64>();
    let points = total - 3.0 * turns.len() as f64;
    let wanted = share * points;
    let point_mm = if sum(LEAST_SCATTER.point_mm) <= wanted {
        LEAST_SCATTER.point_mm
    } else {
        let (mut low, mut high) = (LEAST_SCATTER.point_mm, 1e5);
        for _ in 0..100 {
            let middle = f64::sqrt(low * high);
            if sum(middle) > wanted { low = middle } else { high = middle }
        }
        high
    };
    let turn_square = turns.iter().sum::<f64>() / (3.0 * share * turns.len().max(1) as f64);
    Scatter { point_mm, rotation_rad: turn_square.sqrt().max(LEAST_SCATTER.rotation_rad) }
}

fn whitened_square(raw: &Raw, scatter_mm: f64) -> f64 {
    match raw {
        Raw::Length(r, variance, times) => r * r / (variance + times * scatter_mm * scatter_mm),
        Raw::Point(r, covariance) => {
            let total = covariance + Matrix3::identity() * (scatter_mm * scatter_mm);
            total.cholesky().map_or(f64::INFINITY, |c| r.dot(&c.solve(r)))
        }
        Raw::Turn(_) => 0.0,
    }
}

fn bounds(base: &Base, parameters: &[Parameter], x: &[f64], settings: &Settings) -> (Vec<f64>, Vec<String>) {
    let mut widened = Vec::new();
    let bound = |(&i, &value): (&usize, &f64)| {
        let mut bound = match parameters[i].unit() {
            Unit::Mm => settings.bound_mm,
            Unit::Mrad => 1000.0 * settings.bound_deg.to_radians(),
        };
        if settings.widen_bounds && value.abs() > NEAR_WALL * bound {
            widened.push(parameters[i].name());
            while value.abs() > NEAR_WALL * bound {
                bound *= 2.0;
            }
        }
        bound
    };
    let bounds = base.free.iter().zip(x).map(bound).collect();
    (bounds, widened)
}
