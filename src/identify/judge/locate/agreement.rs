//! Whether points contradict the robot that they are placed with, or the one row that contradicts the others: a point
//! that was misread, the joints of another row.
//!
//! In: the task of a placement, how far a coordinate of the robot is known to scatter (mm), the offsets that were
//! found. Out: how far the points miss the robot, and what that means. Where readings state their covariance, a
//! chi-squared that is too large is the robot's. Where they do not, how well the instrument measures is what no change
//! of the robot's geometry explains, and only what exceeds that and the robot's known scatter is its fault (an F test:
//! the fit with that geometry is nested in the other, so that it errs to the side of no alarm). Where it explains
//! nothing beyond chance, the misfit is noise. Goes wrong: what few poses cannot tell apart is a doubt. Of a row, in:
//! the task and how far the robot is known to scatter. Out: the row without which the others agree with the robot, and
//! how far its point lies from where they have it. Method: each row is left out in turn; the fall of chi-squared is
//! held against what the others scatter (an F test at one level over all rows), and against the fall by the next row.
//! Goes wrong: of four rows any three agree.

use nalgebra::Point3;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use crate::difference::TOLD_APART;
use crate::geometry::fitted_frame;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{Raw, Scatter};
use crate::identify::settings::Model;
use crate::identify::solve::task::Task;
use crate::linear_algebra::{product, pseudo_inverse, rank};

/// Chance that a robot that agrees is said to contradict the points.
const FALSE_ALARM: f64 = 0.01;

/// Chance beyond which what the geometry explains of a misfit is not called noise.
const EXPLAINED: f64 = 0.05;

/// How far points miss a robot.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Misfit {
    /// Root mean square of a point's residual, mm.
    pub rms_mm: f64,
    /// Squared residuals over what is stated of the points and known of the robot.
    pub chi_square: f64,
    pub freedom: usize,
}

/// What that means of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Agreement {
    Agrees,
    /// They miss it by more than is known of it, and nothing tells whether robot or instrument is off.
    Doubted,
    Contradicted,
}

impl Misfit {
    /// Whether it is no more than what is stated and known lets expect.
    pub fn is_known(&self) -> bool {
        let law = ChiSquared::new(self.freedom as f64);
        !law.is_ok_and(|law| law.cdf(self.chi_square) > 1.0 - FALSE_ALARM)
    }
}

/// With the target's place and the frames fitted to the points alone.
pub fn misfit(task: &Task, robot_mm: f64, offsets: &[f64]) -> Misfit {
    fitted(&of_points(task, robot_mm), offsets.to_vec(), |_, _| task.parameters.len()).0
}

/// The same from the target's place in the robot's file on, with the offsets there and the rows.
fn at_best(task: &Task, robot_mm: f64) -> (Misfit, Vec<f64>, Rows) {
    let rows = of_points(task, robot_mm);
    let (misfit, at) = fitted(&rows, vec![0.0; rows.offset_count()], |_, _| task.parameters.len());
    (misfit, at, rows)
}

fn of_points(task: &Task, robot_mm: f64) -> Rows {
    // Orientations weigh nothing.
    let scatter = Scatter { rotation_rad: 1e3, ..Scatter::of_point(robot_mm) };
    task.rows_at(scatter, task.robot)
}

/// What a misfit says of the robot.
pub fn agreement(task: &Task, robot_mm: f64, found: Misfit) -> Agreement {
    let freedom = found.freedom as f64;
    if found.is_known() {
        return Agreement::Agrees;
    }
    if task.rows.iter().all(|&row| task.set.poses[row].reading.covariance_mm2().is_some()) {
        return Agreement::Contradicted;
    }
    let geometry = task.robot.mdh_parameters();
    let task = Task { parameters: &geometry, extras: &[], model: Model::Position, ..*task };
    let rows = task.rows_at(Scatter::of_point(robot_mm), task.robot);
    let (explained, _) = fitted(&rows, vec![0.0; geometry.len()], determined);
    let (left, of_geometry) = (explained.freedom as f64, freedom - explained.freedom as f64);
    let gain = (found.chi_square - explained.chi_square) / of_geometry / (explained.chi_square / left);
    let noise = FisherSnedecor::new(of_geometry, left).is_ok_and(|law| law.cdf(gain) < 1.0 - EXPLAINED);
    // With fewer numbers left than the geometry takes, little would be noticed.
    if noise && left >= of_geometry {
        return Agreement::Agrees;
    }
    // What the instrument's noise adds to a variance of one, the robot's own.
    let expected = 1.0 + explained.chi_square / left;
    let larger = FisherSnedecor::new(freedom, left)
        .is_ok_and(|law| law.cdf(found.chi_square / freedom / expected) > 1.0 - FALSE_ALARM);
    if larger { Agreement::Contradicted } else { Agreement::Doubted }
}

/// How many directions of the unknowns the residuals determine.
fn determined(rows: &Rows, at: &[f64]) -> usize {
    let (_, jacobian) = rows.evaluate(at, true);
    rank(&product(&jacobian, &jacobian))
}

/// The residuals that are left at the best offsets, from these on, and those offsets.
fn fitted(rows: &Rows, mut at: Vec<f64>, unknowns: impl Fn(&Rows, &[f64]) -> usize) -> (Misfit, Vec<f64>) {
    let mut chi_square = f64::INFINITY;
    for _ in 0..20 {
        let (residuals, jacobian) = rows.evaluate(&at, true);
        let cost = residuals.norm_squared();
        if cost > chi_square * (1.0 - 1e-9) {
            break;
        }
        chi_square = cost;
        let step = pseudo_inverse(product(&jacobian, &jacobian)) * jacobian.tr_mul(&residuals);
        at.iter_mut().zip(step.iter()).for_each(|(x, s)| *x -= s);
    }
    let square =
        |(_, _, raw): (usize, f64, Raw)| if let Raw::Point(off, _) = raw { Some(off.norm_squared()) } else { None };
    let squares: Vec<f64> = rows.raw(&at).into_iter().filter_map(square).collect();
    let rms_mm = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
    let fitted = unknowns(rows, &at) + 6 * rows.blocks.len();
    (Misfit { chi_square, freedom: (3 * squares.len()).saturating_sub(fitted), rms_mm }, at)
}

/// Rows of which each is left out in turn, the farthest: more than a placement of some poses has.
const LOOKED_AT: usize = 16;

/// A row that contradicts the others.
#[derive(Debug, Clone, Serialize)]
pub struct Stray {
    #[serde(skip)]
    pub row: usize,
    pub pose: String,
    /// How far its point lies from where the others have it, mm.
    pub off_mm: f64,
}

/// Finds it; `fewest`: so many rows every group keeps.
pub fn alone(task: &Task, robot_mm: f64, fewest: usize) -> Option<Stray> {
    let (whole, at, rows) = at_best(task, robot_mm);
    if whole.is_known() {
        return None;
    }
    let group = |row: usize| task.set.poses[row].group;
    let is_spare = |row: &usize| task.rows.iter().filter(|&&other| group(other) == group(*row)).count() > fewest;
    let others = |row: usize| task.rows.iter().copied().filter(|&other| other != row).collect::<Vec<usize>>();
    let left = |row: usize| (at_best(&Task { rows: &others(row), ..*task }, robot_mm).0, row);
    let mut each: Vec<(Misfit, usize)> =
        farthest(&rows, &at).into_iter().filter(is_spare).take(LOOKED_AT).map(left).collect();
    each.sort_by(|a, b| a.0.chi_square.total_cmp(&b.0.chi_square));
    let (rest, row) = *each.first()?;
    let others = others(row);
    let without = Task { rows: &others, ..*task };
    // How far the others scatter, at least as far as they are known to.
    let variance = (rest.chi_square / rest.freedom as f64).max(1.0);
    let fall = (whole.chi_square - rest.chi_square) / 3.0 / variance;
    let law = FisherSnedecor::new(3.0, rest.freedom as f64);
    let is_chance = law.is_ok_and(|law| 1.0 - law.cdf(fall) > FALSE_ALARM / task.rows.len() as f64);
    let is_alone = each.get(1).is_none_or(|(next, _)| next.chi_square - rest.chi_square > 2.0 * TOLD_APART * variance);
    if rest.freedom == 0 || is_chance || !is_alone || agreement(&without, robot_mm, rest) != Agreement::Agrees {
        return None;
    }
    Some(Stray { row, pose: task.set.poses[row].name.clone(), off_mm: off_mm(&without, robot_mm, row)? })
}

/// The rows, those first whose points lie farthest from the robot's.
fn farthest(rows: &Rows, at: &[f64]) -> Vec<usize> {
    let point =
        |(row, _, raw): (usize, f64, Raw)| if let Raw::Point(off, _) = raw { Some((row, off.norm())) } else { None };
    let mut off: Vec<(usize, f64)> = rows.raw(at).into_iter().filter_map(point).collect();
    off.sort_by(|a, b| b.1.total_cmp(&a.1));
    off.into_iter().map(|(row, _)| row).collect()
}

/// How far the point of a row lies from where others have it, mm.
fn off_mm(others: &Task, robot_mm: f64, row: usize) -> Option<f64> {
    let (_, at, _) = at_best(others, robot_mm);
    let robot = others.robot.shifted(others.parameters, &at);
    let pair = |row: usize| {
        let pose = &others.set.poses[row];
        let target = robot.tool_mm + pose.on_body_mm.unwrap_or_default();
        Some((robot.base_from_flange(&pose.joints_rad) * Point3::from(target), pose.reading.point_mm()?, 1.0))
    };
    let group = others.set.poses[row].group;
    let of_group = others.rows.iter().copied().filter(|&other| others.set.poses[other].group == group);
    let sensor_from_base = fitted_frame(of_group.filter_map(pair));
    let (point, seen, _) = pair(row)?;
    Some((sensor_from_base * point - seen).norm())
}
