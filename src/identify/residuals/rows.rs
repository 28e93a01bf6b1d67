//! The rows of a data set under a residual model: the robot at their poses, and a block of residuals for each
//! placement.
//!
//! In: the data set, the rows to use with their weights, the model, the parameters that may move, the sensor's extra
//! unknowns. Out: white residuals and derivatives with respect to all parameters and extras, the placements' unknowns
//! eliminated.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Point3, Rotation3, RowDVector};
use rayon::prelude::*;

use super::distances::{Distances, Origin};
use super::eliminate::{Block, Unknowns};
use super::pairwise::{CHUNK, Pairs};
use super::points::{Points, weigh_alike};
use super::smooth::Field;
use super::starts::{first_anchor, turn_on_flange};
use super::state::State;
use super::touch::{Contact, Touch};
use crate::identify::data::dataset::{Dataset, Kind, KnownDistance, Reading};
use crate::identify::data::targets::middle;
use crate::identify::model::kinematics::{Kinematics, Place};
use crate::identify::sensor::{Extra, Length, Raw, Scatter, SmoothError, Spot};
use crate::identify::settings::{Model, Settings};
use crate::robot::{Parameter, Robot};

/// Of what a formulation is made.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    pub set: &'a Dataset,
    /// The nominal robot.
    pub robot: &'a Robot,
    /// The parameters that may move.
    pub parameters: &'a [Parameter],
    /// Unknowns of the sensor that may move.
    pub extras: &'a [Extra],
    /// Rows to fit, ascending.
    pub rows: &'a [usize],
    pub model: Model,
    /// A smooth error that the points of a placement share.
    pub smooth: Option<SmoothError>,
    pub settings: &'a Settings,
}

/// The rows of a data set under a residual model, before it is known what they determine.
#[derive(Debug, Clone)]
pub struct Rows {
    /// The robot at the rows' poses.
    pub kinematics: Arc<Kinematics>,
    /// Which row of the data set each place is.
    pub rows: Vec<usize>,
    pub blocks: Vec<Block>,
    /// Scatter beyond the measurement's covariance.
    pub scatter: Scatter,
    /// Unknowns of the sensor, after the robot's parameters in every vector of offsets.
    pub extras: Vec<Extra>,
}

impl Rows {
    /// Builds the blocks. Rows whose group has nothing to measure from are left out. Gravity has its levers on
    /// `load_chain`; `weights` are roots of the rows' weights, one a row of the data set, or none where all count
    /// fully.
    pub fn new(task: &Task, scatter: Scatter, weights: &[f64], load_chain: &Robot) -> Rows {
        let mut used: Vec<usize> = task.rows.to_vec();
        // A centre is a place that distances need, wherever its row went.
        used.extend(task.set.groups.iter().filter_map(|g| g.center).filter(|c| !task.rows.contains(c)));
        used.sort_unstable();
        let joints: Vec<&[f64]> = used.iter().map(|&i| task.set.poses[i].joints_rad.as_slice()).collect();
        let kinematics = Kinematics::new(task.robot, load_chain, task.parameters, &joints);
        Rows::of_poses(task, scatter, weights, (Arc::new(kinematics), used))
    }

    /// The same rows of the same task with another scatter and other weights, and levers on another chain.
    pub fn weighed_anew(&self, task: &Task, scatter: Scatter, weights: &[f64], load_chain: &Robot) -> Rows {
        match self.kinematics.has_levers() {
            true => Rows::new(task, scatter, weights, load_chain),
            false => Rows::of_poses(task, scatter, weights, (self.kinematics.clone(), self.rows.clone())),
        }
    }

    fn of_poses(
        task: &Task,
        scatter: Scatter,
        weights: &[f64],
        (kinematics, used): (Arc<Kinematics>, Vec<usize>),
    ) -> Rows {
        let places = kinematics.places(&vec![0.0; task.parameters.len()], false);
        let by_group = (0..task.set.groups.len()).map(|group| task.set.of_group(task.rows, group)).collect();
        let blocks = Inputs { task, scatter, weights, used: &used, places: &places, by_group }.blocks();
        Rows { kinematics, rows: used, blocks, scatter, extras: task.extras.to_vec() }
    }

    /// Number of offsets: the robot's parameters, then the extra unknowns.
    pub fn offset_count(&self) -> usize {
        self.kinematics.parameters.len() + self.extras.len()
    }

    /// Numbers measured, less the unknowns of the placements.
    pub fn count(&self) -> usize {
        self.blocks.iter().map(Block::count).sum()
    }

    /// The robot's offsets and the extras' values in one vector of offsets.
    pub fn split<'a>(&self, offsets: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        offsets.split_at(self.kinematics.parameters.len())
    }

    /// What residuals at these offsets are taken at.
    pub fn state<'a>(&'a self, offsets: &'a [f64], derivatives: bool) -> State<'a> {
        let (of_robot, extras) = self.split(offsets);
        State { places: self.kinematics.places(of_robot, derivatives), extras, scatter: &self.scatter }
    }

    /// White residuals and derivatives with respect to all offsets.
    pub fn evaluate(&self, offsets: &[f64], derivatives: bool) -> (DVector<f64>, DMatrix<f64>) {
        let state = self.state(offsets, derivatives);
        let part = |b: &Block| b.evaluate(&state, derivatives);
        // Residuals alone are asked for by swarms, whose particles share the threads.
        let parts: Vec<(DVector<f64>, DMatrix<f64>)> = match derivatives {
            true => self.blocks.par_iter().map(part).collect(),
            false => self.blocks.iter().map(part).collect(),
        };
        let rows = parts.iter().map(|(residuals, _)| residuals.len()).sum();
        let columns = if derivatives { offsets.len() } else { 0 };
        let (mut residuals, mut jacobian) = (DVector::zeros(rows), DMatrix::zeros(rows, columns));
        let mut row = 0;
        for (of_block, columns) in parts {
            residuals.rows_mut(row, of_block.len()).copy_from(&of_block);
            jacobian.rows_mut(row, of_block.len()).copy_from(&columns);
            row += of_block.len();
        }
        (residuals, jacobian)
    }

    /// The sum of the squares of the white residuals.
    pub fn cost(&self, offsets: &[f64]) -> f64 {
        let state = self.state(offsets, false);
        self.blocks.iter().map(|block| block.cost(&state)).sum()
    }

    /// Residuals before whitening, by row of the data set, with the root of the row's weight.
    pub fn raw(&self, offsets: &[f64]) -> Vec<(usize, f64, Raw)> {
        let state = self.state(offsets, false);
        self.blocks.iter().flat_map(|b| b.raw(&state)).map(|(place, w, raw)| (self.rows[place], w, raw)).collect()
    }

    /// The unknowns of every placement at these offsets.
    pub fn unknowns(&self, offsets: &[f64]) -> Vec<Unknowns> {
        let state = self.state(offsets, false);
        self.blocks.iter().map(|b| b.best(&state)).collect()
    }

    /// The variance that stands for one, mm^2: costs are multiplied by it.
    pub fn unit_variance_mm2(&self) -> f64 {
        let mut precision = Vec::new();
        let scatter = &self.scatter;
        for block in &self.blocks {
            match block {
                Block::Distances(d) => precision.extend(d.lengths.iter().map(|l| scatter.sd(l, d.times()).powi(-2))),
                Block::Points(p) => {
                    precision.extend(p.spots.iter().map(|s| 3.0 / scatter.total(&s.covariance_mm2).trace()));
                }
                Block::Touch(t) => precision.extend(
                    t.contacts.iter().map(|c| 1.0 / (c.variance_mm2 * scatter.stated + scatter.point_mm.powi(2))),
                ),
                Block::Pairwise(_) => precision.push(1.0 / scatter.point_mm.powi(2).max(f64::MIN_POSITIVE)),
            }
        }
        precision.len().max(1) as f64 / precision.iter().sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Degrees of freedom that residuals lose to smooth errors that placements share.
    pub fn lost_to_smooth(&self) -> f64 {
        let lost = |b: &Block| if let Block::Points(Points { field: Some(f), .. }) = b { f.lost } else { 0.0 };
        self.blocks.iter().map(lost).sum()
    }

    /// Mean square of a coordinate that smooth errors leave after a rigid fit to each placement, mm^2.
    pub fn left_by_smooth_mm2(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for block in &self.blocks {
            if let Block::Points(Points { field: Some(field), spots, .. }) = block {
                sum += field.left_mm2 * spots.len() as f64;
                count += spots.len();
            }
        }
        sum / count.max(1) as f64
    }

    /// The same rows with the sensor's errors, the extra unknowns and what is smooth, fixed as they are at these
    /// offsets and taken off the readings.
    pub fn with_sensor_fixed(&self, offsets: &[f64]) -> Rows {
        let state = self.state(offsets, false);
        let unknowns = self.unknowns(offsets);
        let mut fixed = self.clone();
        fixed.scatter.smooth = None;
        let off = |length: &mut Length| {
            length.length_mm -= length.gained(state.extras);
            length.extra = RowDVector::zeros(0);
        };
        for (block, unknowns) in fixed.blocks.iter_mut().zip(&unknowns) {
            match block {
                Block::Distances(distances) => distances.lengths.iter_mut().for_each(off),
                Block::Points(p) => {
                    let Unknowns::Frame(frame) = unknowns else { continue };
                    let smooth = p.smooth_mm(&state, frame);
                    (p.field, p.flange_from_target) = (None, p.turned_target(state.extras));
                    p.target.clear();
                    for (spot, error) in p.spots.iter_mut().zip(smooth) {
                        // Residuals are predicted less measured.
                        spot.point_mm += error;
                        for (column, e) in spot.extra.column_iter().zip(state.extras) {
                            spot.point_mm -= column * *e;
                        }
                        spot.extra = Matrix3xX::zeros(0);
                    }
                }
                Block::Touch(_) | Block::Pairwise(_) => {}
            }
        }
        fixed.extras.clear();
        fixed
    }
}

/// What a point of a placement gains with each extra unknown, mm (see [`Extra`]).
fn point_extra(set: &Dataset, row: usize, point_mm: &Point3<f64>, extras: &[Extra]) -> Matrix3xX<f64> {
    let column = |extra: &Extra| extra.of_point(point_mm, set.shared.get(row));
    if extras.is_empty() {
        return Matrix3xX::zeros(0);
    }
    Matrix3xX::from_columns(&extras.iter().map(column).collect::<Vec<_>>())
}

struct Inputs<'a> {
    task: &'a Task<'a>,
    scatter: Scatter,
    weights: &'a [f64],
    used: &'a [usize],
    places: &'a [Place],
    by_group: Vec<Vec<usize>>,
}

impl Inputs<'_> {
    /// The place of a row that is used.
    fn place_of(&self, row: usize) -> usize {
        self.used.partition_point(|&used| used < row)
    }

    fn weight(&self, row: usize) -> f64 {
        self.weights.get(row).copied().unwrap_or(1.0)
    }

    fn blocks(&self) -> Vec<Block> {
        let groups = 0..self.task.set.groups.len();
        match (self.task.set.kind, self.task.model) {
            (Kind::Distances, _) => groups.filter_map(|g| self.measured_distances(g)).chain(self.touches()).collect(),
            (Kind::Positions, Model::CenterDistance) => groups.filter_map(|g| self.center_distances(g)).collect(),
            (Kind::Positions, Model::PairwiseDistance) => groups.flat_map(|g| self.pairs(g)).collect(),
            (Kind::Positions, Model::Position | Model::Pose) => self.points(self.task.model == Model::Pose),
        }
    }

    fn measured_distances(&self, group: usize) -> Option<Block> {
        let extras = self.task.extras;
        let zero = |e: &Extra| if *e == Extra::Zero { 1.0 } else { 0.0 };
        let length = |&i: &usize| match self.task.set.poses[i].reading {
            Reading::Distance { distance_mm, sigma_mm } if distance_mm > 0.0 => Some(Length {
                pose: self.place_of(i),
                length_mm: distance_mm,
                variance_mm2: sigma_mm.map_or(0.0, |s| s * s),
                weight: self.weight(i),
                extra: RowDVector::from_iterator(extras.len(), extras.iter().map(zero)),
            }),
            _ => None,
        };
        let lengths: Vec<Length> = self.by_group[group].iter().filter_map(length).collect();
        if lengths.is_empty() {
            return None;
        }
        let from = match self.task.set.groups[group].center.map(|c| self.place_of(c)) {
            Some(center) => Origin::Center(center),
            None => Origin::Anchor(first_anchor(self.places, &lengths), self.task.settings.wire_offset),
        };
        Some(Block::Distances(Distances { lengths, from }))
    }

    /// One block for all sockets that known distances tie together.
    fn touches(&self) -> Vec<Block> {
        let set = self.task.set;
        let touches = |group: usize| self.by_group[group].iter().copied().filter(|&i| set.touches(i));
        let touched = || (0..set.groups.len()).filter(|&group| touches(group).next().is_some());
        // The lowest group that a group is tied to, by repeated lowering: there are few.
        let mut tied: Vec<usize> = (0..set.groups.len()).collect();
        for _ in 0..set.known.len() {
            for known in &set.known {
                let low = tied[known.a].min(tied[known.b]);
                (tied[known.a], tied[known.b]) = (low, low);
            }
        }
        let block = |root: usize| {
            let members: Vec<usize> = touched().filter(|&group| tied[group] == root).collect();
            let point = |i: usize| self.places[self.place_of(i)].point_mm.coords;
            let sockets = members.iter().map(|&group| middle(&touches(group).map(point).collect::<Vec<_>>())).collect();
            let contact = |socket: usize, i: usize| Contact {
                pose: self.place_of(i),
                socket,
                variance_mm2: set.poses[i].reading.variance_mm2().unwrap_or(0.0),
                weight: self.weight(i),
            };
            let of_socket = |(socket, &group): (usize, &usize)| touches(group).map(move |i| contact(socket, i));
            let contacts = members.iter().enumerate().flat_map(of_socket).collect();
            let at = |group: usize| members.iter().position(|g| *g == group);
            let known =
                |(index, k): (usize, &KnownDistance)| Some((index, KnownDistance { a: at(k.a)?, b: at(k.b)?, ..*k }));
            let known = set.known.iter().enumerate().filter_map(known).collect();
            Block::Touch(Touch { sockets, contacts, known })
        };
        touched().map(|group| tied[group]).collect::<BTreeSet<usize>>().into_iter().map(block).collect()
    }

    fn spot(&self, row: usize) -> Option<Spot> {
        let (pose, weight) = (&self.task.set.poses[row], self.weight(row));
        let point_mm = pose.reading.point_mm()?;
        let covariance_mm2 = pose.reading.covariance_mm2().unwrap_or_else(Matrix3::zeros);
        Some(Spot {
            pose: self.place_of(row),
            point_mm,
            on_body_mm: pose.on_body_mm,
            covariance_mm2,
            whitener: self.scatter.whitener(&covariance_mm2) * weight,
            rotation: pose.reading.rotation_rad().map(|r| Rotation3::new(r).into_inner()),
            weight,
            extra: point_extra(self.task.set, row, &point_mm, self.task.extras),
        })
    }

    fn center_distances(&self, group: usize) -> Option<Block> {
        let reference = self.task.set.reference(group, self.task.rows)?;
        let center = self.spot(reference)?;
        let length = |&i: &usize| {
            let spot = self.spot(i).filter(|spot| spot.on_body_mm.is_none())?;
            let apart = spot.point_mm - center.point_mm;
            let length_mm = apart.norm();
            if i == reference || length_mm <= 0.0 {
                return None;
            }
            let u = apart / length_mm;
            let variance_mm2 = (u.transpose() * (spot.covariance_mm2 + center.covariance_mm2) * u)[0];
            let extra = u.transpose() * (&spot.extra - &center.extra);
            Some(Length { pose: spot.pose, length_mm, variance_mm2, weight: spot.weight, extra })
        };
        let lengths: Vec<Length> = self.by_group[group].iter().filter_map(length).collect();
        let from = Origin::Center(center.pose);
        (!lengths.is_empty()).then_some(Block::Distances(Distances { lengths, from }))
    }

    fn pairs(&self, group: usize) -> Vec<Block> {
        let spots: Vec<Spot> = self.by_group[group]
            .iter()
            .filter_map(|&i| self.spot(i).filter(|spot| spot.on_body_mm.is_none()))
            .collect();
        let chunks = spots.len().div_ceil(CHUNK).max(1);
        // Every chunk takes every so-manieth pose, so that each spans the group.
        let chunk = |k: usize| spots.iter().skip(k).step_by(chunks).cloned().collect::<Vec<_>>();
        (0..chunks)
            .map(chunk)
            .filter(|c| c.len() > 2)
            .filter_map(|c| Pairs::new(c, &self.scatter))
            .map(Block::Pairwise)
            .collect()
    }

    fn points(&self, oriented: bool) -> Vec<Block> {
        let lists: Vec<Vec<Spot>> = self
            .by_group
            .iter()
            .map(|rows| rows.iter().filter_map(|&i| self.spot(i)).collect::<Vec<_>>())
            .filter(|spots| spots.len() >= 3)
            .collect();
        let of_body = |spot: &Spot| spot.on_body_mm.is_some() && !self.task.set.are_on_flange();
        let turned = oriented || lists.iter().flatten().any(of_body);
        let flange_from_target = if turned { turn_on_flange(&lists, self.places) } else { Matrix3::identity() };
        let axis = |(k, e): (usize, &Extra)| if let Extra::Target(axis) = e { Some((k, *axis)) } else { None };
        let target: Vec<_> = self.task.extras.iter().enumerate().filter_map(axis).filter(|_| turned).collect();
        let block = |spots: Vec<Spot>| {
            let (alike, target) = (weigh_alike(&spots), target.clone());
            let mut points = Points { spots, alike, flange_from_target, oriented, target, field: None };
            points.field = self.scatter.smooth.map(|error| {
                let spots: Vec<_> = points.spots.iter().map(|s| (s.point_mm, s.whitener)).collect();
                Box::new(Field::new(&spots, points.rows_a_spot(), error))
            });
            Block::Points(points)
        };
        lists.into_iter().map(block).collect()
    }
}
