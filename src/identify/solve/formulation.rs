//! From a data set to the problem that the solvers get: base parameters, row weights, scatter, prior and box.
//!
//! In: rows, model, parameters. Out: [`Rows`] whose scatter makes the white residuals as large as they should be, base
//! parameters, the prior of greatest evidence, and a box. Gross errors are held down by iteratively reweighted least squares with
//! Tukey's biweight, its scale from the median of the residuals, after a start by least absolute residuals (Holland and Welsch,
//! 1977); the chain on which weights have their levers follows the fit, so that fit and written robot are one.
//! What goes wrong: fewer numbers than needed, or poses that determine nothing; both are errors with the counts.

use std::borrow::Cow;

use nalgebra::{Cholesky, DMatrix};

use super::fit::Fit;
use super::problem::Solution;
use super::trust_region;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::model::base::Base;
use crate::identify::model::prior::Tolerance;
use crate::identify::residuals::eliminate::{Raw, product, pseudo_inverse};
use crate::identify::residuals::rows::{Recipe, Rows};
use crate::identify::residuals::weights::{Extra, Scatter};
use crate::identify::settings::{Model, Prior, Redundancy, Settings};
use crate::robot::{Parameter, Robot, Unit};

/// Rounds of fitting and of estimating scatter and prior from the residuals.
const ROUNDS: usize = 4;

/// Rounds of reweighting from the start by least absolute residuals.
const ROBUST_ROUNDS: usize = 12;

/// Steps of the trust region between two estimates of weights.
const STEPS_A_ROUND: usize = 2;

/// Scatter before anything is known, mm: about a good robot's after calibration.
const FIRST_SCATTER_MM: f64 = 0.1;

/// Least scatter, mm and rad: far below any instrument; keeps weights finite for exact data.
const LEAST_MM: f64 = 1e-7;
const LEAST_RAD: f64 = 1e-10;

/// Stated covariances count as too large where the residuals ask for less than this share of them.
const OVERSTATED: f64 = 0.7;

/// A fit may end so far into the box before the box is widened.
const NEAR_WALL: f64 = 0.95;

/// Tukey's constant, in standard deviations: 95 % efficient for one normal number.
const BIWEIGHT: f64 = 4.685;

/// The written robot is the fitted one when moving the levers' chain moves no parameter by more, mm or mrad.
const SAME_CHAIN: f64 = 1e-11;

/// Everything the solvers share.
#[derive(Debug, Clone)]
pub struct Formulation {
    /// What counts as a residual.
    pub model: Model,
    /// Residuals with their final weights.
    pub rows: Rows,
    /// What the poses determine.
    pub base: Base,
    /// Half-widths of the box, one a base parameter, mm and mrad.
    pub bounds: Vec<f64>,
    /// Names of base parameters whose box is wider than asked for.
    pub widened: Vec<String>,
    /// The prior's standard deviations.
    pub tolerance: Tolerance,
    /// Whether they hold the parameters, or only share out what is determined together.
    pub held: bool,
    /// The fit without a box, extras included.
    pub free_fit: Solution,
    /// Number of unknowns that the data and not the prior have determined.
    pub effective: f64,
    /// Whether the data see the robot's size.
    pub scale_seen: bool,
}

/// Of what a formulation is made.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// The measurements.
    pub set: &'a Dataset,
    /// The nominal robot.
    pub robot: &'a Robot,
    /// The parameters that may move.
    pub parameters: &'a [Parameter],
    /// Unknowns of the sensor that may move.
    pub extras: &'a [Extra],
    /// Rows to fit.
    pub rows: &'a [usize],
    /// What counts as a residual.
    pub model: Model,
    /// Settings.
    pub settings: &'a Settings,
}

impl<'a> Task<'a> {
    fn recipe(&self, scatter: Scatter, weights: &'a [f64], levers: &'a Robot) -> Recipe<'a> {
        Recipe {
            set: self.set,
            robot: self.robot,
            levers,
            parameters: self.parameters,
            extras: self.extras,
            rows: self.rows,
            weights,
            model: self.model,
            scatter,
            wire_offset: self.settings.wire_offset,
        }
    }

    /// Whether anything that was measured sees the robot's size.
    fn scale_is_seen(&self) -> bool {
        let set = self.set;
        let touched = |group: usize| self.rows.iter().any(|&r| set.poses[r].group == group);
        !self.rows.iter().all(|&r| set.touches(r)) || set.known.iter().any(|k| touched(k.a) && touched(k.b))
    }

    /// The rows with a scatter that is known.
    pub fn rows_at(&self, scatter: Scatter, levers: &Robot) -> Rows {
        Rows::new(&self.recipe(scatter, &[], levers))
    }

    fn base(&self, rows: &Rows) -> Result<Base, Error> {
        if self.parameters.is_empty() {
            return Ok(Base::new(&DMatrix::zeros(1, 0), self.settings.rank_tolerance));
        }
        let (_, jacobian) = rows.evaluate(&vec![0.0; rows.offset_count()], true);
        let jacobian = jacobian.columns(0, self.parameters.len()).into_owned();
        let base = match self.settings.redundancy {
            Redundancy::Qr => Base::new(&jacobian, self.settings.rank_tolerance),
            Redundancy::Correlation => Base::by_correlation(&jacobian, self.settings.rank_tolerance),
        };
        // Identical poses leave columns of rounding errors, whose rank means nothing: judge their size in mm a mm or mrad.
        let largest = jacobian.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
        let strength = largest * rows.unit_variance_mm2().sqrt() / (jacobian.nrows().max(1) as f64).sqrt();
        if base.rank() == 0 || strength <= self.settings.rank_tolerance {
            return Err(Error::NothingDetermined { poses: self.rows.len() });
        }
        Ok(base)
    }

    /// Too few numbers to calibrate anything: not more than offsets of all joints, a tool and three more to judge by; without
    /// a prior, not more than base parameters.
    fn check_count(&self, rows: &Rows, base: &Base) -> Result<(), Error> {
        let numbers = rows.count();
        let least = match self.settings.prior {
            Prior::Off => base.rank(),
            Prior::Evidence => base.rank().min(self.robot.joints.len() + 6),
        };
        if numbers <= least {
            return Err(Error::TooFew { numbers, parameters: base.rank(), poses: self.rows.len() });
        }
        Ok(())
    }

    /// A fit that gross errors cannot get past. `start` is where it begins; nominal by default.
    pub fn robust(&self, loss: Loss) -> Result<Robust<'a>, Error> {
        let unit = Scatter::of_point(FIRST_SCATTER_MM);
        let mut weights = vec![1.0; self.set.poses.len()];
        let rows = Rows::new(&self.recipe(unit, &[], self.robot));
        let base = self.base(&rows)?;
        self.check_count(&rows, &base)?;
        let tolerance = Tolerance { lengths_mm: 3.0, angles_mrad: 10.0, target_mm: 100.0, ..Tolerance::default() };
        let prior = prior_rows(&tolerance, &base, self, true);
        let spread = tolerance.spread(&base, self.parameters);
        let mut x = vec![0.0; base.rank() + self.extras.len()];
        let mut offsets = vec![0.0; rows.offset_count()];
        let mut robot = self.robot.clone();
        let mut scatter = unit;
        let mut scores = Vec::new();
        for round in 0..ROBUST_ROUNDS {
            let probe = Rows::new(&Recipe { weights: &weights, ..self.recipe(scatter, &[], &robot) });
            let raw = probe.raw(&offsets);
            scores = sizes(&raw, &scatter, self.set.poses.len());
            let median = median_size(&scores, self.rows).max(1e-12);
            let late = round >= ROBUST_ROUNDS / 2 && loss == Loss::Biweight;
            for &row in self.rows {
                let u = scores[row] / median;
                weights[row] = if late { biweight(u) } else { (1.0 / u.max(1.0)).sqrt() };
                scores[row] = u;
            }
            scatter = rescaled(&raw, self.rows, self.set.poses.len(), scatter);
            let rows = Rows::new(&Recipe { weights: &weights, ..self.recipe(scatter, &[], &robot) });
            let free = vec![f64::INFINITY; x.len()];
            let fit = Fit::new(Cow::Borrowed(&rows), &base, spread.clone(), &free, prior.clone());
            let settings = trust_region::Settings { iterations: STEPS_A_ROUND, ..self.settings.trust_region };
            x = trust_region::solve(&fit, &x, &settings).x;
            offsets = fit.offsets(&x);
            robot = self.robot.shifted(self.parameters, &offsets[..self.parameters.len()]);
        }
        Ok(Robust { task: *self, weights, scores, offsets, robot, scatter })
    }
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
    task: Task<'a>,
    /// Roots of the rows' weights, one a row of the data set.
    pub weights: Vec<f64>,
    /// Sizes of the fitted rows' residuals in robust standard deviations, one a row of the data set.
    pub scores: Vec<f64>,
    /// Offsets of parameters and extras.
    pub offsets: Vec<f64>,
    /// The robot found.
    pub robot: Robot,
    /// Robust scatter.
    pub scatter: Scatter,
}

impl Robust<'_> {
    /// The rows with their weights, the offsets, and the normal matrix of a loose prior on all parameters.
    pub fn linearised(&self) -> (Rows, Vec<f64>, DMatrix<f64>) {
        let recipe = self.task.recipe(self.scatter, &[], &self.robot);
        let rows = Rows::new(&Recipe { weights: &self.weights, ..recipe });
        let tolerance = Tolerance { lengths_mm: 3.0, angles_mrad: 10.0, target_mm: 100.0, ..Tolerance::default() };
        let count = self.offsets.len();
        let mut prior = DMatrix::zeros(count, count);
        for (i, &parameter) in self.task.parameters.iter().enumerate() {
            prior[(i, i)] = tolerance.of(parameter).powi(-2);
        }
        for i in self.task.parameters.len()..count {
            prior[(i, i)] = 1.0;
        }
        (rows, self.offsets.clone(), prior)
    }
}

/// The scatter at which the median residual of these rows has the size that it should have.
fn rescaled(raw: &[(usize, f64, Raw)], rows: &[usize], count: usize, before: Scatter) -> Scatter {
    let mut scatter = Scatter { stated: 1.0, ..before };
    let (mut low, mut high) = (LEAST_MM, 1e5);
    for _ in 0..40 {
        scatter.point_mm = f64::sqrt(low * high);
        if median_size(&sizes(raw, &scatter, count), rows) > 1.0 {
            low = scatter.point_mm
        } else {
            high = scatter.point_mm
        }
    }
    scatter
}

impl Formulation {
    /// Base parameters, weights, prior and box.
    pub fn new(task: &Task) -> Result<Formulation, Error> {
        let settings = task.settings;
        let mut levers = task.robot.clone();
        let mut scatter = Scatter::of_point(FIRST_SCATTER_MM);
        let mut rows = Rows::new(&task.recipe(scatter, &[], &levers));
        let base = task.base(&rows)?;
        task.check_count(&rows, &base)?;
        let count = base.rank() + task.extras.len();
        let free = vec![f64::INFINITY; count];
        let held = settings.prior == Prior::Evidence;
        let mut tolerance = Tolerance::default();
        let mut x = vec![0.0; count];
        let mut effective = 0.0;
        for round in 0..ROUNDS {
            let prior = prior_rows(&tolerance, &base, task, held || round == 0);
            let spread = tolerance.spread(&base, task.parameters);
            let fit = Fit::new(Cow::Borrowed(&rows), &base, spread, &free, prior.clone());
            x = trust_region::solve(&fit, &x, &settings.trust_region).x;
            let offsets = fit.offsets(&x);
            effective = determined(&fit, &x, &prior);
            scatter = estimate_scatter(&rows, &offsets, effective, scatter);
            levers = task.robot.shifted(task.parameters, &offsets[..task.parameters.len()]);
            rows = Rows::new(&task.recipe(scatter, &[], &levers));
            if held && round + 1 < ROUNDS {
                let spread = tolerance.spread(&base, task.parameters);
                let (normal, gradient) =
                    Fit::new(Cow::Borrowed(&rows), &base, spread, &free, DMatrix::zeros(0, count)).normal(&x);
                tolerance = Tolerance::from_evidence(&base, task.parameters, task.extras, &normal, &gradient);
            }
        }
        let prior = prior_rows(&tolerance, &base, task, held);
        let spread = tolerance.spread(&base, task.parameters);
        let mut free_fit = None;
        for _ in 0..ROUNDS {
            let fit = Fit::new(Cow::Borrowed(&rows), &base, spread.clone(), &free, prior.clone());
            let solved = trust_region::solve(&fit, &x, &settings.trust_region);
            let moved = solved.x.iter().zip(&x).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            x.clone_from(&solved.x);
            let offsets = fit.offsets(&x);
            levers = task.robot.shifted(task.parameters, &offsets[..task.parameters.len()]);
            free_fit = Some(solved);
            let settled = moved < SAME_CHAIN || !task.parameters.iter().any(|p| matches!(p, Parameter::Gravity(..)));
            rows = Rows::new(&task.recipe(scatter, &[], &levers));
            if settled {
                break;
            }
        }
        let free_fit = free_fit.ok_or(Error::NotFinite)?;
        let (bounds, widened) = bounds(&base, task.parameters, &free_fit.x, settings);
        Ok(Formulation {
            model: task.model,
            rows,
            base,
            bounds,
            widened,
            tolerance,
            held,
            free_fit,
            effective,
            scale_seen: task.scale_is_seen(),
        })
    }

    /// The parameters that the vector of all offsets stands for.
    pub fn parameters(&self) -> &[Parameter] {
        self.rows.kinematics.parameters()
    }

    /// Offsets of all parameters and extras where the free fit ended.
    pub fn offsets_of(&self) -> Vec<f64> {
        let (of_base, extras) = self.free_fit.x.split_at(self.base.rank());
        let of_robot = self.spread() * nalgebra::DVector::from_column_slice(of_base);
        of_robot.iter().chain(extras).copied().collect()
    }

    /// All parameters of the robot from the base parameters.
    pub fn spread(&self) -> DMatrix<f64> {
        self.tolerance.spread(&self.base, self.parameters())
    }

    /// Values of the extra unknowns.
    pub fn extras(&self) -> &[f64] {
        &self.free_fit.x[self.base.rank()..]
    }

    /// Rows of the prior; none without one.
    fn prior(&self, extras: &[Extra]) -> DMatrix<f64> {
        let rows = match self.held {
            true => self.tolerance.rows(&self.base, self.parameters(), extras),
            false => DMatrix::zeros(0, self.base.rank() + extras.len()),
        };
        let nominal = self.rows.kinematics.nominal();
        match self.scale_seen {
            true => rows,
            false => with_scale_held(rows, &self.tolerance, &self.base, self.parameters(), nominal),
        }
    }

    /// The problem in its box, the sensor's extra unknowns fixed where the free fit found them.
    pub fn fit(&self) -> Fit<'_> {
        let rows = match self.rows.extras.is_empty() {
            true => Cow::Borrowed(&self.rows),
            false => Cow::Owned(self.rows.with_extras_fixed(self.extras())),
        };
        Fit::new(rows, &self.base, self.spread(), &self.bounds, self.prior(&[]))
    }

    /// Covariance of the unknowns (base parameters, extras), mm and mrad: data and prior together.
    pub fn covariance(&self) -> DMatrix<f64> {
        let free = vec![f64::INFINITY; self.free_fit.x.len()];
        let prior = self.prior(&self.rows.extras);
        let fit = Fit::new(Cow::Borrowed(&self.rows), &self.base, self.spread(), &free, prior.clone());
        let (_, jacobian) = fit.white(&self.free_fit.x);
        pseudo_inverse(product(&jacobian, &jacobian) + prior.tr_mul(&prior))
    }

    /// Covariance of all parameters of the robot: what is determined, and what the tolerance leaves open where it holds them.
    pub fn robot_covariance(&self) -> DMatrix<f64> {
        let rank = self.base.rank();
        let spread = self.spread();
        let of_base = self.covariance().view((0, 0), (rank, rank)).into_owned();
        &spread * of_base * spread.transpose()
    }

    /// Base parameters about which the data say next to nothing: as uncertain as before.
    pub fn unmoved(&self) -> Vec<usize> {
        if !self.held {
            return Vec::new();
        }
        let before = self.tolerance.covariance(&self.base, self.parameters(), &[]);
        let after = self.covariance();
        let weak = |&k: &usize| after[(k, k)].sqrt() > 0.9 * before[(k, k)].sqrt();
        (0..self.base.rank()).filter(weak).map(|k| self.base.free[k]).collect()
    }
}

fn prior_rows(tolerance: &Tolerance, base: &Base, task: &Task, held: bool) -> DMatrix<f64> {
    let rows = match held {
        true => tolerance.rows(base, task.parameters, task.extras),
        false => DMatrix::zeros(0, base.rank() + task.extras.len()),
    };
    if task.scale_is_seen() { rows } else { with_scale_held(rows, tolerance, base, task.parameters, task.robot) }
}

/// Standard deviation of the mean relative change of all lengths where nothing measured sees it.
const HELD_SCALE: f64 = 1e-7;

/// One more row below the prior's: the robot as a whole neither grows nor shrinks. Touches of unknown points fit the better the smaller
/// all lengths are, and a weak prior would let them collapse.
fn with_scale_held(
    rows: DMatrix<f64>,
    tolerance: &Tolerance,
    base: &Base,
    parameters: &[Parameter],
    robot: &Robot,
) -> DMatrix<f64> {
    let spread = tolerance.spread(base, parameters);
    let length = |p: &Parameter| if p.unit() == Unit::Mm { robot.value(*p) } else { 0.0 };
    let lengths = nalgebra::RowDVector::from_iterator(parameters.len(), parameters.iter().map(length));
    let square = lengths.norm_squared().max(f64::MIN_POSITIVE);
    let of_base = &lengths * spread / (square * HELD_SCALE);
    let (count, columns) = rows.shape();
    let mut held = rows.resize_vertically(count + 1, 0.0);
    held.view_mut((count, 0), (1, of_base.ncols().min(columns))).copy_from(&of_base);
    held
}

/// Root of Tukey's weight for a residual of `u` robust standard deviations.
fn biweight(u: f64) -> f64 {
    let inside = 1.0 - (u / BIWEIGHT).powi(2);
    inside.max(0.0)
}

/// White size of each row's residual, brought to the size of one normal number; zero for rows without one.
pub fn sizes(raw: &[(usize, f64, Raw)], scatter: &Scatter, count: usize) -> Vec<f64> {
    let mut squares = vec![0.0; count];
    for (row, _, raw) in raw {
        let square = match raw {
            Raw::Length(r, variance, times) => {
                r * r / (variance * scatter.stated + times * scatter.point_mm * scatter.point_mm)
            }
            Raw::Point(r, covariance) => as_one_number(whitened(r, covariance, scatter)),
            Raw::Turn(_) => continue,
        };
        squares[*row] = f64::max(squares[*row], square);
    }
    squares.into_iter().map(f64::sqrt).collect()
}

fn whitened(r: &nalgebra::Vector3<f64>, covariance: &nalgebra::Matrix3<f64>, scatter: &Scatter) -> f64 {
    scatter.total(covariance).cholesky().map_or(f64::INFINITY, |c| r.dot(&c.solve(r)))
}

/// A chi-squared of three degrees of freedom as one of a single degree that is exceeded as often (Wilson and Hilferty, 1931).
fn as_one_number(square: f64) -> f64 {
    let (three, one) = (2.0 / 27.0, 2.0 / 9.0);
    let z = ((square / 3.0).cbrt() - (1.0 - three)) / f64::sqrt(three);
    // Not zero: a residual that is very small is still one.
    (1.0 - one + z * f64::sqrt(one)).max(1e-3).powi(3)
}

/// Robust standard deviation of the sizes of these rows: their median over that of a normal number's absolute value.
pub fn median_size(sizes: &[f64], rows: &[usize]) -> f64 {
    let mut sorted: Vec<f64> = rows.iter().map(|&r| sizes[r]).filter(|s| *s > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0) / 0.6745
}

/// Number of unknowns that the data, and not the prior, have determined.
fn determined(fit: &Fit, x: &[f64], prior: &DMatrix<f64>) -> f64 {
    let (_, jacobian) = fit.white(x);
    let normal = product(&jacobian, &jacobian);
    match Cholesky::new(&normal + prior.tr_mul(prior)) {
        Some(total) => total.solve(&normal).trace(),
        None => x.len() as f64,
    }
}

/// The scatter at which the white sum of squares equals the degrees of freedom (Pearson's equation); for points and orientations
/// apart. Covariances that are larger than what was seen are taken down.
fn estimate_scatter(rows: &Rows, offsets: &[f64], effective: f64, before: Scatter) -> Scatter {
    let raw = rows.raw(offsets);
    let turns: Vec<f64> =
        raw.iter().filter_map(|(_, _, r)| if let Raw::Turn(t) = r { Some(t.norm_squared()) } else { None }).collect();
    let total: f64 = raw.iter().map(|(_, _, r)| if matches!(r, Raw::Length(..)) { 1.0 } else { 3.0 }).sum();
    // Each number loses the same share to parameters and placements.
    let share = ((rows.count() as f64 - effective) / total.max(1.0)).max(1.0 / total.max(1.0));
    let sum = |scatter: &Scatter| -> f64 {
        raw.iter()
            .map(|(_, w, raw)| match raw {
                Raw::Length(r, variance, times) => {
                    w * w * r * r / (variance * scatter.stated + times * scatter.point_mm * scatter.point_mm)
                }
                Raw::Point(r, covariance) => w * w * whitened(r, covariance, scatter),
                Raw::Turn(_) => 0.0,
            })
            .sum()
    };
    let wanted = share * (total - 3.0 * turns.len() as f64);
    let turn_square = turns.iter().sum::<f64>() / (3.0 * share * turns.len().max(1) as f64);
    let mut scatter = Scatter {
        point_mm: LEAST_MM,
        rotation_rad: if turns.is_empty() { before.rotation_rad } else { turn_square.sqrt().max(LEAST_RAD) },
        stated: 1.0,
    };
    let least = sum(&scatter);
    if least <= wanted {
        if least < OVERSTATED * wanted {
            scatter.stated = (least / wanted).max(1e-12);
        }
        return scatter;
    }
    let (mut low, mut high) = (LEAST_MM, 1e5);
    for _ in 0..80 {
        scatter.point_mm = f64::sqrt(low * high);
        if sum(&scatter) > wanted { low = scatter.point_mm } else { high = scatter.point_mm }
    }
    scatter
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
