//! How far a robot's predictions are from what was measured, on rows that were not fitted.
//!
//! In: a robot, rows fitted (they place the sensor: rigid transforms, the wire's anchor, touched points), rows to
//! judge. Out: signed distance errors to the group's reference and, with positions, point errors in the sensor's frame;
//! for touches the distance of each predicted point to their mean. A group without fitted rows is placed by the rows
//! that are judged.

use nalgebra::{Matrix3, Point3, Vector3};
use serde::{Deserialize, Serialize};

use crate::identify::data::dataset::{Dataset, Kind, KnownDistance, Reading};
use crate::identify::residuals::eliminate::{Block, Unknowns};
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::settings::{Model, Settings};
use crate::identify::solve::task::Task;
use crate::robot::Robot;

/// Fewest rows that a group without fitted rows is placed by.
pub const PLACED_BY_ITSELF: usize = 4;

/// Figures of absolute errors, as in Table 3 of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub count: usize,
    /// Mean of their absolute values, mm.
    pub mean_abs_mm: Option<f64>,
    /// Standard deviation of their absolute values, mm.
    pub std_mm: Option<f64>,
    pub max_abs_mm: Option<f64>,
    pub min_abs_mm: Option<f64>,
}

impl Spread {
    /// Of a list of errors, mm; undefined figures are `None`.
    pub fn new(errors_mm: impl IntoIterator<Item = f64>) -> Spread {
        let errors: Vec<f64> = errors_mm.into_iter().map(f64::abs).collect();
        let count = errors.len();
        let mean = errors.iter().sum::<f64>() / count as f64;
        let squares: f64 = errors.iter().map(|e| (e - mean).powi(2)).sum();
        Spread {
            count,
            mean_abs_mm: (count > 0).then_some(mean),
            std_mm: (count > 1).then(|| (squares / (count - 1) as f64).sqrt()),
            max_abs_mm: errors.iter().copied().reduce(f64::max),
            min_abs_mm: errors.iter().copied().reduce(f64::min),
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct RowError {
    /// Row of the data set.
    pub row: usize,
    /// Predicted minus measured distance to the group's reference, mm; of a touch, to the mean of its group's predicted
    /// points. `None` for the reference itself, and for a point of a body that is not its mark point.
    pub distance_mm: Option<f64>,
    /// Predicted minus measured point, mm, in the sensor's frame; of a touch, from the mean.
    pub point_mm: Option<Vector3<f64>>,
    /// Covariance of the measured point, mm^2.
    pub covariance_mm2: Matrix3<f64>,
}

impl RowError {
    /// A point's error in standard deviations of covariance and scatter, as a coordinate's.
    pub fn score(&self, scatter: &Scatter) -> Option<f64> {
        let e = self.point_mm?;
        let total = scatter.total(&self.covariance_mm2);
        Some((e.dot(&total.cholesky()?.solve(&e)) / 3.0).sqrt())
    }
}

/// Errors as all robots are judged in one run.
#[derive(Debug, Clone)]
pub struct Judge<'a> {
    pub set: &'a Dataset,
    /// Rows that place the sensor.
    pub fitted: &'a [usize],
    /// Scatter that points and lengths are weighed with.
    pub scatter: Scatter,
    /// Whether a wire's zero is unknown.
    pub wire_offset: bool,
    /// Unknowns of the sensor, and their values.
    pub extras: &'a [(Extra, f64)],
}

/// Weight of the placement's points where no fit has said anything else: covariances matter where they are larger than
/// this, mm.
const PLACING_SCATTER_MM: f64 = 1.0;

impl<'a> Judge<'a> {
    /// Without any unknown of the sensor.
    pub fn plain(set: &'a Dataset, fitted: &'a [usize], wire_offset: bool) -> Judge<'a> {
        let scatter = Scatter::of_point(PLACING_SCATTER_MM);
        Judge { set, fitted, scatter, wire_offset, extras: &[] }
    }

    /// Errors of `rows`. Rows of groups that cannot be placed are left out.
    pub fn errors(&self, robot: &Robot, rows: &[usize]) -> Vec<RowError> {
        let mut list = Vec::with_capacity(rows.len());
        for group in 0..self.set.groups.len() {
            let judged = self.set.of_group(rows, group);
            if judged.is_empty() {
                continue;
            }
            let mut placing = self.set.of_group(self.fitted, group);
            if !placing.iter().any(|&i| !matches!(self.set.poses[i].reading, Reading::Reference)) {
                placing.extend(judged.iter().filter(|_| judged.len() >= PLACED_BY_ITSELF));
                placing.sort_unstable();
                placing.dedup();
            }
            match self.set.kind {
                Kind::Positions => self.of_points(robot, group, &placing, &judged, &mut list),
                Kind::Distances => self.of_distances(robot, group, &placing, &judged, &mut list),
            }
        }
        list.sort_by_key(|e| e.row);
        list
    }

    fn placed(&self, robot: &Robot, rows: &[usize], model: Model) -> (Rows, Vec<f64>) {
        // How a body is turned on this robot's flange its rows say anew.
        let of_sensor = |(extra, _): &(Extra, f64)| !matches!(extra, Extra::Target(_));
        let (extras, values): (Vec<Extra>, Vec<f64>) = self.extras.iter().copied().filter(of_sensor).unzip();
        let settings = Settings { wire_offset: self.wire_offset, ..Settings::default() };
        let task = Task { extras: &extras, model, ..Task::plain(self.set, robot, &[], rows, &settings) };
        (task.rows_at(self.scatter, robot), values)
    }

    /// A predicted and a measured point, the sensor's own errors taken off, and its covariance; `flange_from_body` is
    /// how a body of several targets is turned.
    fn point(
        &self,
        robot: &Robot,
        row: usize,
        flange_from_body: &Matrix3<f64>,
    ) -> Option<(Point3<f64>, Point3<f64>, Matrix3<f64>)> {
        let Reading::Position { point_mm, covariance_mm2, .. } = &self.set.poses[row].reading else { return None };
        let mut measured = *point_mm;
        for (extra, value) in self.extras {
            measured -= extra.of_point(point_mm, self.set.shared.get(row)) * *value;
        }
        let pose = &self.set.poses[row];
        let mut predicted = robot.target_mm(&pose.joints_rad);
        if let Some(part) = pose.on_body_mm {
            predicted += robot.base_from_flange(&pose.joints_rad).rotation * (flange_from_body * part);
        }
        Some((predicted, measured, covariance_mm2.unwrap_or_else(Matrix3::zeros)))
    }

    fn of_points(&self, robot: &Robot, group: usize, placing: &[usize], judged: &[usize], list: &mut Vec<RowError>) {
        let (rows, values) = self.placed(robot, placing, Model::Position);
        let placed = rows.blocks.iter().zip(rows.unknowns(&values)).find_map(|both| match both {
            (Block::Points(points), Unknowns::Frame(frame)) => Some((points.flange_from_target, frame)),
            _ => None,
        });
        let turn = placed.map_or_else(Matrix3::identity, |(turn, _)| turn);
        let reference = self.set.reference(group, placing).and_then(|r| self.point(robot, r, &turn));
        for &row in judged {
            let Some((predicted, measured, covariance_mm2)) = self.point(robot, row, &turn) else { continue };
            let from = reference.as_ref().filter(|_| self.set.poses[row].on_body_mm.is_none());
            let apart = from.map(|(p0, x0, _)| ((predicted - p0).norm(), (measured - x0).norm()));
            let distance_mm = apart.filter(|(_, read)| *read > 0.0).map(|(predicted, read)| predicted - read);
            let point_mm = placed.map(|(_, frame)| frame * predicted - measured);
            list.push(RowError { row, distance_mm, point_mm, covariance_mm2 });
        }
    }

    fn of_distances(&self, robot: &Robot, group: usize, placing: &[usize], judged: &[usize], list: &mut Vec<RowError>) {
        let predicted = |row: usize| robot.target_mm(&self.set.poses[row].joints_rad);
        let touches: Vec<usize> = judged.iter().copied().filter(|&r| self.set.touches(r)).collect();
        if !touches.is_empty() {
            self.of_touches(&touches, &predicted, list);
            return;
        }
        let zero_mm: f64 = self.extras.iter().filter(|(e, _)| *e == Extra::Zero).map(|(_, v)| *v).sum();
        let center = self.set.groups[group].center.map(|c| (predicted(c), zero_mm));
        let placed = center.or_else(|| {
            let (rows, values) = self.placed(robot, placing, Model::CenterDistance);
            rows.unknowns(&values).into_iter().find_map(|unknowns| match unknowns {
                Unknowns::Anchor(anchor, zero) => Some((Point3::from(anchor), zero)),
                _ => None,
            })
        });
        let Some((from, zero_mm)) = placed else { return };
        for &row in judged {
            if let Reading::Distance { distance_mm, .. } = self.set.poses[row].reading {
                list.push(RowError {
                    row,
                    distance_mm: Some((predicted(row) - from).norm() + zero_mm - distance_mm),
                    point_mm: None,
                    covariance_mm2: Matrix3::zeros(),
                });
            }
        }
    }

    /// Touches are judged by the mean of the judged rows themselves: the socket of a robot that is off is not where the
    /// fitted rows say.
    fn of_touches(&self, rows: &[usize], predicted: &dyn Fn(usize) -> Point3<f64>, list: &mut Vec<RowError>) {
        let mean = rows.iter().map(|&r| predicted(r).coords).sum::<Vector3<f64>>() / rows.len() as f64;
        for &row in rows {
            let off = predicted(row).coords - mean;
            let variance_mm2 = self.set.poses[row].reading.variance_mm2().unwrap_or(0.0);
            list.push(RowError {
                row,
                distance_mm: Some(off.norm()),
                point_mm: Some(off),
                covariance_mm2: Matrix3::identity() * variance_mm2,
            });
        }
    }

    /// Predicted less known distances between touched points, of groups of which `rows` hold some, mm.
    pub fn distortion_mm(&self, robot: &Robot, rows: &[usize]) -> Vec<f64> {
        let mean = |group: usize| {
            let touches = self.set.of_group(rows, group).into_iter().filter(|&r| self.set.touches(r));
            let points: Vec<Vector3<f64>> =
                touches.map(|r| robot.target_mm(&self.set.poses[r].joints_rad).coords).collect();
            (!points.is_empty()).then(|| points.iter().sum::<Vector3<f64>>() / points.len() as f64)
        };
        let off = |k: &KnownDistance| Some((mean(k.a)? - mean(k.b)?).norm() - k.distance_mm);
        self.set.known.iter().filter_map(off).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_of_three_errors_of_one_and_of_none() {
        let spread = Spread::new([-1.0, 2.0, -3.0]);
        assert_eq!((spread.count, spread.mean_abs_mm, spread.std_mm), (3, Some(2.0), Some(1.0)));
        assert_eq!((spread.max_abs_mm, spread.min_abs_mm), (Some(3.0), Some(1.0)));
        assert_eq!(Spread::new([]).mean_abs_mm, None);
        assert_eq!(Spread::new([1.0]).std_mm, None);
    }
}
