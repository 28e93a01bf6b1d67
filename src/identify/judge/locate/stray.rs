//! The one row of a placement that contradicts the others: a point that was misread, the joints of another row.
//!
//! In: the task of a placement, and how far a coordinate of the robot is known to scatter (mm). Out: the row without which the others agree with the
//! robot, and how far its point lies from where they have it. Method: each row is left out in turn; the fall of chi-squared is held against what the
//! others scatter (an F test at one level over all rows), and against the fall by the next row. Goes wrong: of four rows any three agree.

use nalgebra::Point3;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::agreement::{self, Agreement, FALSE_ALARM, Misfit};
use crate::difference::TOLD_APART;
use crate::geometry::fitted_frame;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::Raw;
use crate::identify::solve::task::Task;

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
    let (whole, at, rows) = agreement::at_best(task, robot_mm);
    if whole.is_known() {
        return None;
    }
    let group = |row: usize| task.set.poses[row].group;
    let is_spare = |row: &usize| task.rows.iter().filter(|&&other| group(other) == group(*row)).count() > fewest;
    let others = |row: usize| task.rows.iter().copied().filter(|&other| other != row).collect::<Vec<usize>>();
    let left = |row: usize| (agreement::at_best(&Task { rows: &others(row), ..*task }, robot_mm).0, row);
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
    if rest.freedom == 0
        || is_chance
        || !is_alone
        || agreement::agreement(&without, robot_mm, rest) != Agreement::Agrees
    {
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
    let (_, at, _) = agreement::at_best(others, robot_mm);
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
