//! Where the sensor stands and the target sits, with a robot that is taken as it is.
//!
//! In: points, orientations where there are any, a robot, and what is known of how it scatters. Out: the placements,
//! the chi-squared of the fit against what is stated of readings and robot, and covariances that hold for few poses: a
//! scatter that these poses themselves had to tell is made larger by Student's quantile over the normal one. What an
//! identification left open of the robot is part of them: all poses share it, and placements and target follow it.
//! Without orientations, and where the points leave the target's place open, it is held as the robot's file has it. One
//! row without which the others agree is named and left out. Goes wrong: poses that leave a direction open are refused
//! with that direction; a robot that is wrong in a way that a placement can take up is not seen.

mod agreement;

use nalgebra::{DMatrix, DVector, Vector3};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

use self::agreement::{Agreement, Misfit, Stray, agreement, alone, misfit};
use super::placement::{Placed, is_held};
use crate::diagnostic::two_digits;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::Scatter;
use crate::identify::settings::{Model, Settings};
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::Linearised;
use crate::identify::solve::task::Task;
use crate::linear_algebra::{Eliminated, product, without};
use crate::robot::{Parameter, Robot};

/// Fewest poses of a placement.
pub const FEWEST_POSES: usize = 3;

/// What is not known to this, mm or mrad, is not determined: a tenth of a small arm's reach.
const OPEN: f64 = 100.0;

/// Quantile of the normal distribution for intervals of 95 %.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// How a robot scatters, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trust {
    /// How far a coordinate of the robot's points is off, mm.
    pub point_mm: f64,
    /// How far a component of an orientation's turn is off, rad; `None` where nothing says so.
    pub rotation_rad: Option<f64>,
}

/// What an identification left open of a robot.
#[derive(Debug, Clone)]
pub struct LeftOpen {
    pub parameters: Vec<Parameter>,
    /// Their covariance, mm and mrad.
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom that tell how large it is.
    pub freedom: f64,
    /// How far a coordinate of its points is off beside what these parameters move it by, mm.
    pub point_mm: f64,
}

/// Where everything is.
#[derive(Debug, Clone)]
pub struct Located {
    pub placed: Placed,
    pub fit: Fit,
}

/// How the points agree with the robot.
#[derive(Debug, Clone, Serialize)]
pub struct Fit {
    /// Poses that were placed.
    pub poses: usize,
    /// The row that contradicts them, and is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stray: Option<Stray>,
    /// How far they miss the robot.
    #[serde(flatten)]
    pub misfit: Misfit,
    /// Whether the points contradict the robot.
    pub contradicted: bool,
    /// Whether they miss the robot by more than is known of it, and nothing tells whether robot or instrument is off.
    pub doubted: bool,
    /// Whether what an identification left open of the robot is in the covariances; else the robot is taken as exact
    /// but for its scatter.
    pub robot_uncertain: bool,
}

impl Fit {
    /// What points that contradict the robot mean.
    pub const CONTRADICTED: &str = "the points contradict this robot by more than is stated of both: identify the robot, or look whether cameras, \
                                    target and joint angles are those of these rows";

    /// What it means where the instrument's noise is not known.
    pub const DOUBTED: &str = "the points miss this robot by more than it is known to scatter, and these rows do not tell whether robot or \
                               instrument is off: state the points' covariances, or take more poses";

    /// What either means of rows of which all but any one agree.
    pub const TOO_FEW: &str = "these rows contradict each other as this robot takes them, and are too few to tell whether one of them, the robot or \
                               the instrument is off: take two poses more";

    /// What speaks against the placement, for a person; `None` where nothing does.
    pub fn objection(&self) -> Option<String> {
        // A row has three numbers.
        let is_told = self.misfit.freedom > 3;
        match (self.contradicted || self.doubted, &self.stray) {
            (true, _) if !is_told => Some(Fit::TOO_FEW.to_owned()),
            (true, _) => Some(if self.contradicted { Fit::CONTRADICTED } else { Fit::DOUBTED }.to_owned()),
            (false, Some(stray)) => Some(format!(
                "row {} contradicts the others by {} mm and is left out, without it they agree with the robot: look at its point and its joints, or \
                 take it again",
                stray.pose,
                two_digits(stray.off_mm)
            )),
            (false, None) => None,
        }
    }
}

/// Finds it; `open` where an identification says what it left open of this robot.
pub fn locate(
    set: &Dataset,
    robot: &Robot,
    trust: Trust,
    open: Option<&LeftOpen>,
    settings: &Settings,
) -> Result<Located, Error> {
    let rows = set.placing_rows(FEWEST_POSES)?;
    let oriented = set.has_rotations();
    let tool = [Parameter::V(0), Parameter::V(1), Parameter::V(2)];
    let extras = set.target_unknowns(oriented);
    let model = if oriented { Model::Pose } else { Model::Position };
    let with = |parameters| Task { extras, model, ..Task::plain(set, robot, parameters, &rows, settings) };
    match one_left_out(&with(&tool), trust, open) {
        // Points alone may leave open what the file says.
        Err(Error::Open { .. } | Error::TooFew { .. } | Error::NothingDetermined { .. }) if !oriented => {
            one_left_out(&with(&[]), trust, open)
        }
        located => located,
    }
}

/// Of the rows, without one that alone contradicts the others.
fn one_left_out(task: &Task, trust: Trust, open: Option<&LeftOpen>) -> Result<Located, Error> {
    let stray = alone(task, trust.point_mm, FEWEST_POSES);
    let is_left = |row: &usize| stray.as_ref().is_none_or(|stray| stray.row != *row);
    let rows: Vec<usize> = task.rows.iter().copied().filter(is_left).collect();
    let located = fitted(&Task { rows: &rows, ..*task }, trust, open)?;
    Ok(Located { fit: Fit { stray, ..located.fit }, ..located })
}

fn fitted(task: &Task, trust: Trust, open: Option<&LeftOpen>) -> Result<Located, Error> {
    let mut formulation = Formulation::new(task)?;
    let offsets = formulation.offsets_of();
    let found = formulation.rows.scatter;
    // What the rows themselves tell of the scatter is never taken for less than what is known of it.
    let told = found.point_mm > trust.point_mm;
    let known_mm = open.map_or(trust.point_mm, |open| open.point_mm);
    let scatter = Scatter {
        point_mm: if told { found.point_mm } else { known_mm },
        rotation_rad: trust.rotation_rad.map_or(found.rotation_rad, |known| found.rotation_rad.max(known)),
        stated: found.stated.max(1.0),
        ..Scatter::of_point(0.0)
    };
    let load_chain = task.robot.shifted(task.parameters, &offsets);
    formulation.rows = task.rows_at(scatter, &load_chain);
    if let Some(direction) = open_direction(&formulation.rows, &offsets, task.parameters.len()) {
        return Err(Error::Open { direction });
    }
    let unknowns = offsets.len() + 6 * formulation.rows.blocks.len();
    let numbers: usize = formulation.rows.blocks.iter().map(|b| b.row_count()).sum();
    let whole_freedom = numbers.saturating_sub(unknowns);
    let turns_told = task.model == Model::Pose && scatter.rotation_rad > trust.rotation_rad.unwrap_or(0.0);
    let student = if told || turns_told { student(whole_freedom as f64) } else { 1.0 };
    let shared = formulation.offsets_covariance(&|_| false) * student;
    let of_fit = (formulation.rows, offsets.clone(), shared);
    let (rows, of_all, shared) = match open {
        Some(open) => with_robot(task, of_fit, &load_chain, open),
        None => of_fit,
    };
    let placed = Placed::new(task.set, &rows, &of_all, &vec![0.0; of_all.len()], &shared, student);
    let mut placed = placed.ok_or(Error::NothingDetermined { poses: task.rows.len() })?;
    placed.target_found = !task.parameters.is_empty();
    let misfit = misfit(task, trust.point_mm, &offsets);
    let agreement = agreement(task, trust.point_mm, misfit);
    let fit = Fit {
        poses: task.rows.len(),
        stray: None,
        misfit,
        contradicted: agreement == Agreement::Contradicted,
        doubted: agreement == Agreement::Doubted,
        robot_uncertain: open.is_some(),
    };
    Ok(Located { placed, fit })
}

/// Rows, offsets and their covariance of a fit with a robot that was held, with what is open of the robot before the
/// unknowns that were fitted: these follow it. What only moves the whole robot is what a placement is, and what only
/// moves the target on the flange is the target's where that is fitted: neither is open.
fn with_robot(
    task: &Task,
    (rows, offsets, fitted): (Rows, Vec<f64>, DMatrix<f64>),
    load_chain: &Robot,
    open: &LeftOpen,
) -> (Rows, Vec<f64>, DMatrix<f64>) {
    let target_fitted = !task.parameters.is_empty();
    let joints = if target_fitted { task.robot.joints.len() } else { usize::MAX };
    let is_open = |p: Parameter| !(is_held(p, joints) || target_fitted && matches!(p, Parameter::V(_)));
    let at: Vec<usize> = (0..open.parameters.len()).filter(|&i| is_open(open.parameters[i])).collect();
    let of_robot = at.iter().map(|&i| open.parameters[i]);
    let parameters: Vec<Parameter> = of_robot.chain(task.parameters.iter().copied()).collect();
    let count = at.len();
    let rows = Task { parameters: &parameters, ..*task }.rows_at(rows.scatter, load_chain);
    let offsets = [vec![0.0; count], offsets].concat();
    let mut normal = DMatrix::zeros(offsets.len(), offsets.len());
    for placement in &Linearised::new(&rows, &offsets).placements {
        normal += placement.eliminated().normal;
    }
    let follow = -Eliminated::new(&normal, count).follow;
    let mut moves = DMatrix::identity(offsets.len(), count);
    moves.view_mut((count, 0), follow.shape()).copy_from(&follow);
    let of_open = open.covariance.select_rows(&at).select_columns(&at) * student(open.freedom);
    let mut covariance = &moves * of_open * moves.transpose();
    let mut own = covariance.view_mut((count, count), fitted.shape());
    own += fitted;
    (rows, offsets, covariance)
}

/// By how much variances that so many degrees of freedom told are to be larger, that intervals of 1.96 standard
/// deviations hold.
fn student(freedom: f64) -> f64 {
    let quantile = StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(NORMAL_95, |t| t.inverse_cdf(0.975));
    (quantile / NORMAL_95).powi(2)
}

/// The direction of all unknowns together that is known least, in words, where it is as good as not known at all.
fn open_direction(rows: &Rows, offsets: &[f64], parameters: usize) -> Option<String> {
    let linear = Linearised::new(rows, offsets);
    let shared = offsets.len();
    let count = shared + 6 * linear.placements.len();
    let mut normal = DMatrix::zeros(count, count);
    for (k, placement) in linear.placements.iter().enumerate() {
        let of_all = &placement.linear.jacobian;
        let mut columns = DMatrix::zeros(of_all.nrows(), count);
        columns.view_mut((0, 0), of_all.shape()).copy_from(of_all);
        // Turns in mrad about the middle of the points, as the other angles are.
        let [turns, shifts] = [0, 3].map(|first| placement.linear.design.columns(first, 3).into_owned());
        columns.columns_mut(shared + 6 * k, 3).copy_from(&(without(&turns, &shifts) * 1e-3));
        columns.columns_mut(shared + 6 * k + 3, 3).copy_from(&shifts);
        normal += product(&columns, &columns);
    }
    let eigen = normal.symmetric_eigen();
    let least = (0..count).min_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]))?;
    if eigen.eigenvalues[least] > OPEN.powi(-2) {
        return None;
    }
    Some(in_words(&eigen.eigenvectors.column(least).into_owned(), parameters, shared))
}

/// What moves along a direction of all unknowns; of the placements the one that moves most.
fn in_words(direction: &DVector<f64>, parameters: usize, shared: usize) -> String {
    let part = |at: usize| Vector3::new(direction[at], direction[at + 1], direction[at + 2]);
    let placements = (shared..direction.len()).step_by(6);
    let by_motion = |a: &usize, b: &usize| direction.rows(*a, 6).norm().total_cmp(&direction.rows(*b, 6).norm());
    let mut parts = Vec::new();
    if let Some(at) = placements.max_by(by_motion) {
        parts.extend([(part(at), "the cameras' turn about"), (part(at + 3), "the cameras' shift along")]);
    }
    if parameters >= 3 {
        parts.push((part(0), "the target's shift along"));
    }
    if shared >= parameters + 3 {
        parts.push((part(parameters), "the target's turn about"));
    }
    const SHARE: f64 = 0.3;
    let largest = parts.iter().map(|(v, _)| v.norm()).fold(0.0, f64::max);
    let words = parts.iter().filter(|(v, _)| v.norm() > SHARE * largest).map(|(v, what)| {
        let unit = v.normalize();
        format!("{what} ({:.2}, {:.2}, {:.2})", unit.x, unit.y, unit.z)
    });
    words.collect::<Vec<String>>().join(" together with ")
}

#[cfg(test)]
mod tests;
