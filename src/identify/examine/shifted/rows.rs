//! Rows and readings as they may belong together, and how far the readings are then from the nominal robot.
//!
//! In: a set of points, the nominal robot, and from which row on each reading is of the joint angles so many rows
//! further down. Out: the distance of each reading from where the robot is, with the placement of each group and the
//! target's place at the least sum of distances, by reweighting. A pair of a row and a reading is of the group of one
//! of the two, which matters where a group ends. Goes wrong: fewer than three pairs of a group are not placed.

use nalgebra::{Matrix3, Point3, Vector3};

use crate::geometry::{Transform, fitted_frame, rotation_matrix};
use crate::identify::data::dataset::{Dataset, Kind};
use crate::robot::Robot;
use crate::statistics::median;

/// Fewest rows of a set.
const FEWEST_ROWS: usize = 8;

/// Rounds of reweighting.
const ROUNDS: usize = 8;

/// A reading is its own row's where it is off by less than this share of the way to any row that it may be of instead:
/// at the other one it would be off by ten times as much.
const OWN: f64 = 0.1;

/// With which column name, group and role of a row belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// With the joint angles: a picture failed, or was taken twice.
    Joints,
    /// With the points: joint angles were lost, or are there twice.
    Points,
}

/// Readings from a row on, each of the joint angles so many rows further down.
#[derive(Debug, Clone, Copy)]
pub(in crate::identify::examine) struct Hypothesis {
    pub from: usize,
    pub by: isize,
    pub side: Side,
}

/// A row of joint angles, the reading that belongs to it, and the group of both.
pub(super) struct Pair {
    pub row: usize,
    pub reading: usize,
    group: usize,
}

/// What a hypothesis leaves.
pub(super) struct Left {
    /// Distance of each reading from where the robot is, mm; `None` where it belongs to no row.
    pub errors: Vec<Option<f64>>,
    pub mean: f64,
    pub tool_mm: Vector3<f64>,
}

/// The robot and the readings, row by row.
pub(in crate::identify::examine) struct Rows {
    origins: Vec<Vector3<f64>>,
    rotations: Vec<Matrix3<f64>>,
    groups: Vec<usize>,
    points: Vec<Point3<f64>>,
    tool_mm: Vector3<f64>,
}

impl Hypothesis {
    /// The readings as they stand.
    const NONE: Hypothesis = Hypothesis { from: 0, by: 0, side: Side::Joints };

    /// The row of a reading, of so many in all.
    pub fn row(&self, reading: usize, count: usize) -> Option<usize> {
        let row = if reading < self.from { Some(reading) } else { reading.checked_add_signed(self.by) };
        row.filter(|row| *row < count)
    }
}

impl Rows {
    /// `None` of sets of anything but whole points, and of too few.
    pub(in crate::identify::examine) fn new(set: &Dataset, robot: &Robot) -> Option<Rows> {
        let whole = set.poses.iter().all(|pose| pose.on_body_mm.is_none());
        if set.kind != Kind::Positions || set.poses.len() < FEWEST_ROWS || !whole {
            return None;
        }
        let flanges: Vec<Transform> = set.poses.iter().map(|pose| robot.base_from_flange(&pose.joints_rad)).collect();
        Some(Rows {
            origins: flanges.iter().map(|f| f.translation.vector).collect(),
            rotations: flanges.iter().map(rotation_matrix).collect(),
            groups: set.poses.iter().map(|pose| pose.group).collect(),
            points: set.poses.iter().map(|pose| pose.reading.point_mm()).collect::<Option<Vec<_>>>()?,
            tool_mm: robot.tool_mm,
        })
    }

    /// The distance of each reading with the target's place free; infinite where too few rows place it.
    pub(in crate::identify::examine) fn errors_mm(&self, rounds: usize) -> Vec<f64> {
        let (distances, _) = self.distances(&self.pairs(&Hypothesis::NONE), self.tool_mm, true, rounds);
        distances.into_iter().map(|distance| distance.unwrap_or(f64::INFINITY)).collect()
    }

    /// The target's place with which they are least.
    pub(in crate::identify::examine) fn tool_mm(&self, rounds: usize) -> Vector3<f64> {
        self.distances(&self.pairs(&Hypothesis::NONE), self.tool_mm, true, rounds).1
    }

    pub(super) fn count(&self) -> usize {
        self.points.len()
    }

    /// Whether the rows are of several groups.
    pub(super) fn has_groups(&self) -> bool {
        self.groups.iter().any(|group| *group != self.groups[0])
    }

    /// The readings as they stand.
    pub(super) fn as_written(&self) -> Left {
        self.left(&Hypothesis::NONE)
    }

    /// Whether readings are all but one so near to where their own rows have the robot that none can be of a row next
    /// to it: a look that saves the search.
    pub(super) fn stand(&self, left: &Left, most: usize) -> bool {
        let target = |row: usize| self.target(row, &left.tool_mm);
        let stands = |row: usize| {
            let next = (1..=most).flat_map(|by| [row.checked_sub(by), Some(row + by)]).flatten();
            let ways = next.filter(|next| *next < self.count()).map(|next| (target(next) - target(row)).norm());
            left.errors[row].is_some_and(|error| error < OWN * ways.fold(f64::INFINITY, f64::min))
        };
        (0..self.count()).filter(|row| !stands(*row)).count() <= 1
    }

    /// Whether joint angles of one group get readings of another.
    pub(super) fn crosses(&self, of: &Hypothesis) -> bool {
        self.pairs(of).iter().any(|pair| self.groups[pair.row] != self.groups[pair.reading])
    }

    /// Pairs of a row and the reading that belongs to it.
    fn pairs(&self, of: &Hypothesis) -> Vec<Pair> {
        let pair = |reading: usize| {
            let row = of.row(reading, self.count())?;
            let group = self.groups[if of.side == Side::Joints { row } else { reading }];
            Some(Pair { row, reading, group })
        };
        (0..self.count()).filter_map(pair).collect()
    }

    fn target(&self, row: usize, tool_mm: &Vector3<f64>) -> Point3<f64> {
        (self.origins[row] + self.rotations[row] * tool_mm).into()
    }

    /// Places among these pairs of those of each group.
    fn by_group(&self, pairs: &[Pair]) -> Vec<Vec<usize>> {
        let mut groups = vec![Vec::new(); self.groups.iter().max().map_or(0, |most| most + 1)];
        pairs.iter().enumerate().for_each(|(k, pair)| groups[pair.group].push(k));
        groups
    }

    /// The frame of a group of these pairs.
    fn frame(&self, group: &[usize], pairs: &[Pair], weights: &[f64], tool_mm: &Vector3<f64>) -> Option<Transform> {
        let weighed = |&k: &usize| (self.target(pairs[k].row, tool_mm), self.points[pairs[k].reading], weights[k]);
        (group.len() >= 3).then(|| fitted_frame(group.iter().map(weighed)))
    }

    /// The distances of these pairs with frames and tool at the least sum of them.
    fn distances(
        &self,
        pairs: &[Pair],
        mut tool_mm: Vector3<f64>,
        tool_free: bool,
        rounds: usize,
    ) -> (Vec<Option<f64>>, Vector3<f64>) {
        let (mut weights, groups) = (vec![1.0; pairs.len()], self.by_group(pairs));
        let mut errors = Vec::new();
        for _ in 0..rounds {
            let frame = |group: &Vec<usize>| self.frame(group, pairs, &weights, &tool_mm);
            let frames: Vec<Option<Transform>> = groups.iter().map(frame).collect();
            if tool_free {
                tool_mm = self.tool(pairs, &weights, &frames).unwrap_or(tool_mm);
            }
            let error = |pair: &Pair| {
                let frame = frames[pair.group].as_ref()?;
                Some((frame * self.target(pair.row, &tool_mm) - self.points[pair.reading]).norm())
            };
            errors = pairs.iter().map(error).collect();
            let floor = (0.1 * median(errors.iter().flatten().copied()).unwrap_or(0.0)).max(1e-9);
            weights = errors.iter().map(|e| e.map_or(0.0, |e: f64| 1.0 / e.max(floor))).collect();
        }
        (errors, tool_mm)
    }

    /// The target's place that brings the pairs together best in these frames.
    fn tool(&self, pairs: &[Pair], weights: &[f64], frames: &[Option<Transform>]) -> Option<Vector3<f64>> {
        let (mut normal, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for (pair, weight) in pairs.iter().zip(weights) {
            let Some(frame) = &frames[pair.group] else { continue };
            let turn = rotation_matrix(frame) * self.rotations[pair.row];
            normal += *weight * turn.transpose() * turn;
            let from_origin = self.points[pair.reading] - frame * Point3::from(self.origins[pair.row]);
            pull += *weight * turn.transpose() * from_origin;
        }
        normal.cholesky().map(|c| c.solve(&pull))
    }

    /// What a hypothesis leaves.
    pub(super) fn left(&self, of: &Hypothesis) -> Left {
        let pairs = self.pairs(of);
        let (distances, tool_mm) = self.distances(&pairs, self.tool_mm, true, ROUNDS);
        let mut errors = vec![None; self.count()];
        for (pair, distance) in pairs.iter().zip(distances) {
            errors[pair.reading] = distance;
        }
        let known: Vec<f64> = errors.iter().flatten().copied().collect();
        Left { mean: known.iter().sum::<f64>() / known.len().max(1) as f64, errors, tool_mm }
    }

    /// Median distance of the readings from a row on where they stand as they are and only the sensor was moved.
    pub(super) fn placed_anew(&self, from: usize, tool_mm: &Vector3<f64>) -> Option<f64> {
        let pairs: Vec<Pair> = self.pairs(&Hypothesis::NONE).into_iter().skip(from).collect();
        let (distances, _) = self.distances(&pairs, *tool_mm, false, ROUNDS);
        // A group of so few that a placement takes up everything tells nothing for another placement.
        Some(median(distances.into_iter().flatten()).unwrap_or(f64::INFINITY))
    }
}
