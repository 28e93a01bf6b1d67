//! How far a change of the robot moves the target, in the base and once the placements were found anew; and each
//! placement against where it stood.

use nalgebra::{DMatrix, DVector, Vector3};

use super::compared::{self, Compared};
use super::found::{Before, FALSE_ALARM, Moved, Stood};
use crate::difference::{Difference, SEEN};
use crate::geometry::rigid_columns;
use crate::identify::data::dataset::Dataset;
use crate::identify::model::kinematics::{Kinematics, Place};
use crate::identify::residuals::eliminate::{Block, Linear, Unknowns};
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::identify::solve::swarm::halton;
use crate::linear_algebra::{product, pseudo_inverse, without};
use crate::robot::{Parameter, Robot};

/// Poses that stand for the ranges of the joints.
const POSES: usize = 64;

/// How far offsets move the target at each pose of each placement, mm.
pub(super) struct Moves {
    /// After the placement was found anew.
    anew: Vec<DMatrix<f64>>,
    /// In the base. A scale is the sensor's: no more than is left of it by the placement.
    in_base: Vec<DMatrix<f64>>,
}

impl Moves {
    pub(super) fn new(linear: &Linearised, count: usize) -> Moves {
        let of_placement = |placement: &Placement| {
            let mut of_group: Vec<usize> = placement.poses.iter().flatten().copied().collect();
            of_group.dedup();
            of_places(&of_group.iter().map(|&pose| &linear.places[pose]).collect::<Vec<_>>(), count - 1)
        };
        let (anew, in_base) = linear.placements.iter().map(of_placement).unzip();
        Moves { anew, in_base }
    }

    /// Over the ranges of the joints; nothing moves where none are known.
    pub(super) fn over(robot: &Robot, parameters: &[Parameter], ranges: &[(f64, f64)]) -> Moves {
        let unit = halton::points(POSES, ranges.len(), 0);
        let within = |pose: &[f64]| pose.iter().zip(ranges).map(|(u, (low, high))| low + u * (high - low)).collect();
        let joints: Vec<Vec<f64>> = unit.chunks(ranges.len().max(1)).map(within).collect();
        let joints: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
        let places = Kinematics::new(robot, robot, parameters, &joints).places(&vec![0.0; parameters.len()], true);
        let (anew, in_base) = of_places(&places.iter().collect::<Vec<_>>(), parameters.len());
        Moves { anew: vec![anew], in_base: vec![in_base] }
    }

    /// The largest of all poses after the placements were found anew, mm.
    pub(super) fn most_mm(&self, columns: &[(usize, f64)], amounts: &[f64]) -> f64 {
        most_mm(&self.anew, columns, amounts)
    }

    /// The largest of all poses in the base, where programs move the target, mm.
    pub(super) fn in_base_mm(&self, columns: &[(usize, f64)], amounts: &[f64]) -> f64 {
        most_mm(&self.in_base, columns, amounts)
    }
}

/// How far the offsets of a robot, and behind them a thousandth of scale, move the target at these places, mm: once
/// placed anew, and in the base.
fn of_places(places: &[&Place], robot: usize) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut columns = DMatrix::zeros(3 * places.len(), robot + 1);
    let mut rigid = DMatrix::zeros(3 * places.len(), 6);
    for (k, place) in places.iter().enumerate() {
        columns.view_mut((3 * k, 0), (3, robot)).copy_from(&place.point_columns);
        columns.view_mut((3 * k, robot), (3, 1)).copy_from(&(1e-3 * place.point_mm.coords));
        rigid.view_mut((3 * k, 0), (3, 6)).copy_from(&rigid_columns(&place.point_mm.coords));
    }
    let anew = without(&columns, &rigid);
    columns.set_column(robot, &anew.column(robot));
    (anew, columns)
}

fn most_mm(moves: &[DMatrix<f64>], columns: &[(usize, f64)], amounts: &[f64]) -> f64 {
    let of_placement = |moves: &DMatrix<f64>| {
        let mut moved = DVector::zeros(moves.nrows());
        for ((at, unit), amount) in columns.iter().zip(amounts) {
            moved += moves.column(*at) * (unit * amount);
        }
        (0..moved.len() / 3).map(|k| moved.rows(3 * k, 3).norm()).fold(0.0, f64::max)
    };
    moves.iter().map(of_placement).fold(0.0, f64::max)
}

/// A robot that is off by some offsets, each known to so much together, in units of the file.
pub(super) struct Off {
    /// Index of the column, and what one unit of the file is in it.
    pub(super) columns: Vec<(usize, f64)>,
    pub(super) amounts: Vec<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl Off {
    /// As it was.
    pub(super) fn nothing() -> Off {
        Off { columns: Vec::new(), amounts: Vec::new(), covariance: DMatrix::zeros(0, 0) }
    }

    fn offsets(&self, count: usize) -> Vec<f64> {
        let mut offsets = vec![0.0; count];
        self.columns.iter().zip(&self.amounts).for_each(|(&(at, unit), amount)| offsets[at] = unit * amount);
        offsets
    }
}

/// Each placement against where it stood, with a robot that is off by so much.
pub(super) fn placements(set: &Dataset, compared: &Compared, off: &Off, stood: Stood) -> Vec<Moved> {
    let Compared { rows, before, count } = *compared;
    let offsets = compared.offsets(&off.offsets(count));
    let linear = Linearised::new(rows, &offsets);
    let mut list = Vec::new();
    for ((block, unknowns), placement) in rows.blocks.iter().zip(rows.unknowns(&offsets)).zip(&linear.placements) {
        let (Block::Points(points), Unknowns::Frame(frame)) = (block, unknowns) else { continue };
        let Some(spot) = points.spots.first() else { continue };
        let name = &set.groups[set.poses[rows.rows[spot.pose]].group].name;
        let Some(old) = stood(name) else { continue };
        let covariance =
            of_frame(placement, count, before, off) + DMatrix::from_iterator(6, 6, old.covariance.iter().copied());
        let off = DVector::from_column_slice(compared::off(&frame, &old).as_slice());
        let turn_rad = off.rows(0, 3).norm();
        let Some(difference) = Difference::new(off, &covariance, before.poses, 1.0) else { continue };
        // What the move does to the points in the middle of them.
        let middle = points.spots.iter().map(|s| s.point_mm.coords).sum::<Vector3<f64>>() / points.spots.len() as f64;
        let at_middle = rigid_columns(&(middle - old.transform.translation.vector));
        let spread = at_middle * &covariance * at_middle.transpose();
        let level = difference.limit(6, FALSE_ALARM).sqrt();
        list.push(Moved {
            group: name.clone(),
            shift_mm: (at_middle * &difference.off).norm(),
            seen_mm: (level + SEEN) * spread.diagonal().max().sqrt(),
            turn_rad,
            moved: difference.chi_square() > difference.limit(6, FALSE_ALARM),
        });
    }
    list
}

/// Covariance of a frame, the target's turn found with it, and what is uncertain of the old robot and of its change in
/// it.
fn of_frame(placement: &Placement, count: usize, before: &Before, off: &Off) -> DMatrix<f64> {
    let Linear { jacobian, design, .. } = &*placement.linear;
    let turns = jacobian.ncols() - count;
    let mut own = design.clone().resize_horizontally(6 + turns, 0.0);
    own.columns_mut(6, turns).copy_from(&jacobian.columns(count, turns));
    let inverse = pseudo_inverse(product(&own, &own));
    let known = jacobian.columns(0, before.parameters.len()).into_owned();
    let follow = -(&inverse * product(&own, &known));
    let changed = DMatrix::from_fn(jacobian.nrows(), off.columns.len(), |row, k| {
        let (at, unit) = off.columns[k];
        jacobian[(row, at)] * unit
    });
    let with_change = -(&inverse * product(&own, &changed));
    let covariance = inverse
        + &follow * &before.covariance * follow.transpose()
        + &with_change * &off.covariance * with_change.transpose();
    covariance.view((0, 0), (6, 6)).into_owned()
}
