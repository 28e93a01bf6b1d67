//! How far a robot's predictions are from what was measured, on rows that were not fitted.
//!
//! In: a robot, rows fitted (they place the sensor: rigid transforms, the wire's anchor), rows to judge.
//! Out: signed distance errors to the group's reference and, with positions, point errors in the sensor's frame.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use super::blocks::{Block, Scatter, Unknowns};
use super::dataset::{Dataset, Kind, Reading};
use super::estimate::Estimate;
use super::settings::Model;
use crate::geometry::Transform;
use crate::robot::Robot;

/// Figures of absolute errors, as in Table 3 of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Number of errors.
    pub count: usize,
    /// Mean of their absolute values, mm.
    pub mean_abs_mm: Option<f64>,
    /// Standard deviation of their absolute values, mm.
    pub std_mm: Option<f64>,
    /// Largest, mm.
    pub max_abs_mm: Option<f64>,
    /// Smallest, mm.
    pub min_abs_mm: Option<f64>,
}

impl Spread {
    /// Of a list of errors, mm; undefined figures are `None`.
    pub fn new(errors_mm: impl IntoIterator<Item = f64>) -> Spread {
        let errors: Vec<f64> = errors_mm.into_iter().map(f64::abs).collect();
        let count = errors.len();
        if count == 0 {
            return Spread { count, mean_abs_mm: None, std_mm: None, max_abs_mm: None, min_abs_mm: None };
        }
        let mean = errors.iter().sum::<f64>() / count as f64;
        let squares: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
        Spread {
            count,
            mean_abs_mm: Some(mean),
            std_mm: (count > 1).then(|| (squares / (count - 1) as f64).sqrt()),
            max_abs_mm: errors.iter().copied().reduce(f64::max),
            min_abs_mm: errors.iter().copied().reduce(f64::min),
        }
    }
}

/// The error of one row.
#[derive(Debug, Clone, PartialEq)]
pub struct RowError {
    /// Row of the data set.
    pub row: usize,
    /// Predicted minus measured distance to the group's reference, mm; `None` for the reference itself.
    pub distance_mm: Option<f64>,
    /// Predicted minus measured point, mm, in the sensor's frame.
    pub point_mm: Option<Vector3<f64>>,
    /// Variance of the measured distance, mm^2.
    pub variance_mm2: f64,
    /// Covariance of the measured point, mm^2.
    pub covariance_mm2: Matrix3<f64>,
}

impl RowError {
    /// Squared error in units of measurement covariance and scatter, times the scatter's variance: mm^2.
    /// A point counts as the mean of its coordinates.
    pub fn score_mm2(&self, scatter: &Scatter) -> Option<f64> {
        let s = scatter.point_mm * scatter.point_mm;
        if let Some(e) = self.point_mm {
            let total = self.covariance_mm2 + Matrix3::identity() * s;
            return Some(s * e.dot(&total.cholesky()?.solve(&e)) / 3.0);
        }
        self.distance_mm.map(|e| s * e * e / (self.variance_mm2 + s))
    }
}

/// Errors of `rows`, the sensor placed by `fitted`. Rows of groups that cannot be placed are left out.
pub fn errors(
    set: &Dataset,
    robot: &Robot,
    fitted: &[usize],
    rows: &[usize],
    scatter: Scatter,
    wire_offset: bool,
) -> Vec<RowError> {
    match set.kind {
        Kind::Positions => position_errors(set, robot, fitted, rows, scatter),
        Kind::Distances => distance_errors(set, robot, fitted, rows, scatter, wire_offset),
    }
}

fn position_errors(set: &Dataset, robot: &Robot, fitted: &[usize], rows: &[usize], scatter: Scatter) -> Vec<RowError> {
    let mut list = Vec::with_capacity(rows.len());
    for group in 0..set.groups.len() {
        let of_group: Vec<usize> = fitted.iter().copied().filter(|&i| set.poses[i].group == group).collect();
        let frame = sensor_from_base(set, robot, &of_group, scatter);
        let reference = set.reference(group, fitted).and_then(|r| point(set, robot, r));
        for &row in rows.iter().filter(|&&i| set.poses[i].group == group) {
            let Some((predicted, measured, covariance_mm2)) = point(set, robot, row) else { continue };
            let (mut distance_mm, mut variance_mm2) = (None, 0.0);
            if let Some((p0, x0, c0)) = &reference {
                let apart = measured - x0;
                if apart.norm() > 0.0 {
                    let u = apart.normalize();
                    distance_mm = Some((predicted - p0).norm() - apart.norm());
                    variance_mm2 = (u.transpose() * (covariance_mm2 + c0) * u)[0];
                }
            }
            let point_mm = frame.as_ref().map(|f| f * predicted - measured);
            list.push(RowError { row, distance_mm, point_mm, variance_mm2, covariance_mm2 });
        }
    }
    list.sort_by_key(|e| e.row);
    list
}

type Seen = (nalgebra::Point3<f64>, nalgebra::Point3<f64>, Matrix3<f64>);

fn point(set: &Dataset, robot: &Robot, row: usize) -> Option<Seen> {
    match &set.poses[row].reading {
        Reading::Position { point_mm, covariance_mm2, .. } => Some((
            robot.target_mm(&set.poses[row].joints_rad),
            *point_mm,
            covariance_mm2.unwrap_or_else(Matrix3::zeros),
        )),
        _ => None,
    }
}

fn sensor_from_base(set: &Dataset, robot: &Robot, rows: &[usize], scatter: Scatter) -> Option<Transform> {
    let estimate = Estimate::new(set, robot, &[], rows, Model::Position, scatter, false);
    let places = estimate.kinematics.places(&[], false);
    match estimate.blocks.first()?.evaluate(&places, &scatter, false).unknowns {
        Unknowns::Frames(frames, _) => frames.first().copied(),
        _ => None,
    }
}

fn distance_errors(
    set: &Dataset,
    robot: &Robot,
    fitted: &[usize],
    rows: &[usize],
    scatter: Scatter,
    wire_offset: bool,
) -> Vec<RowError> {
    let mut list = Vec::with_capacity(rows.len());
    for group in 0..set.groups.len() {
        let of_group: Vec<usize> = fitted.iter().copied().filter(|&i| set.poses[i].group == group).collect();
        let center = set.groups[group].center.map(|c| (robot.target_mm(&set.poses[c].joints_rad), 0.0));
        let placed = center.or_else(|| {
            let estimate = Estimate::new(set, robot, &[], &of_group, Model::CenterDistance, scatter, wire_offset);
            let places = estimate.kinematics.places(&[], false);
            let block = estimate.blocks.iter().find(|b| matches!(b, Block::Wire { .. }))?;
            match block.evaluate(&places, &scatter, false).unknowns {
                Unknowns::Anchor(anchor) => Some((anchor.point_mm, anchor.offset_mm)),
                _ => None,
            }
        });
        let Some((from, offset_mm)) = placed else { continue };
        for &row in rows.iter().filter(|&&i| set.poses[i].group == group) {
            if let Reading::Distance { distance_mm, sigma_mm } = set.poses[row].reading {
                let predicted = (robot.target_mm(&set.poses[row].joints_rad) - from).norm() + offset_mm;
                list.push(RowError {
                    row,
                    distance_mm: Some(predicted - distance_mm),
                    point_mm: None,
                    variance_mm2: sigma_mm.map_or(0.0, |s| s * s),
                    covariance_mm2: Matrix3::zeros(),
                });
            }
        }
    }
    list.sort_by_key(|e| e.row);
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_three_errors() {
        let spread = Spread::new([-1.0, 2.0, -3.0]);
        assert_eq!((spread.count, spread.mean_abs_mm, spread.std_mm), (3, Some(2.0), Some(1.0)));
        assert_eq!((spread.max_abs_mm, spread.min_abs_mm), (Some(3.0), Some(1.0)));
    }

    #[test]
    fn figures_of_nothing_are_none() {
        assert_eq!(Spread::new([]).mean_abs_mm, None);
        assert_eq!(Spread::new([1.0]).std_mm, None);
    }
}
