//! The cost of a placement whose own unknowns are solved for, without building matrices: for the swarms.
//!
//! In: points and rotations from the [`Kernel`](super::kernel::Kernel). Out: the sum of the squared whitened residuals with the
//! unknowns (rigid transforms, the wire's anchor and zero) at their best. The unknowns start where they follow the parameters to
//! first order and go on by Newton's method; rigid transforms with the normal matrix of the nominal robot, which hardly changes
//! within the box, so that two or three gradients are enough.
//! What goes wrong: far outside the box that matrix may not converge; the least cost that was seen is then an upper bound.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Vector3, Vector4};

use super::blocks::{Anchor, Block, Length, Scatter, Spot, Unknowns, direction, pseudo_inverse, turn, whitener};
use super::kernel::Points;
use super::kinematics::Place;
use crate::geometry::{Transform, rotation_matrix};

/// Steps at the most.
const STEPS: usize = 50;

/// The unknowns are at their best when the step's gain is below this fraction of the cost.
const GAIN: f64 = 1e-14;

/// A block with unknowns.
#[derive(Debug, Clone)]
pub struct Placement {
    sightings: Sightings,
    start: Unknowns,
    /// Inverse normal matrix of the unknowns.
    inverse: DMatrix<f64>,
    /// How the unknowns follow the robot's parameters.
    follows: DMatrix<f64>,
}

#[derive(Debug, Clone)]
enum Sightings {
    /// Lengths with their inverse variances, and whether the wire's zero is unknown.
    Wire(Vec<(Length, f64)>, bool),
    /// Spots with their inverse covariances, a list a placement, and the inverse variance of a turn where orientations are used.
    Frames(Vec<Vec<(Spot, Matrix3<f64>)>>, Option<f64>),
}

impl Placement {
    /// `places` are those of the nominal robot, with derivatives. `None` for blocks without unknowns.
    pub fn new(block: &Block, places: &[Place], scatter: &Scatter) -> Option<Placement> {
        let sightings = match block {
            Block::Wire { lengths, offset, .. } => {
                let weight = |l: &Length| 1.0 / (l.variance_mm2 + scatter.point_mm.powi(2)).max(f64::MIN_POSITIVE);
                Sightings::Wire(lengths.iter().map(|l| (*l, weight(l))).collect(), *offset)
            }
            Block::Frames { placements, oriented, .. } => {
                let weighted = |spot: &Spot| {
                    let whiten = whitener(&spot.covariance_mm2, scatter);
                    (spot.clone(), whiten.tr_mul(&whiten))
                };
                let lists = placements.iter().map(|spots| spots.iter().map(weighted).collect());
                Sightings::Frames(lists.collect(), oriented.then(|| scatter.rotation_rad.powi(-2)))
            }
            Block::Center { .. } | Block::Pairwise(_) => return None,
        };
        let (start, inverse, follows) = block.response(places, scatter);
        Some(Placement { sightings, start, inverse, follows })
    }

    /// Whether rotations are needed.
    pub fn is_oriented(&self) -> bool {
        matches!(self.sightings, Sightings::Frames(_, Some(_)))
    }

    /// The sum of the squared whitened residuals. `rotations` may be empty unless the block is oriented.
    pub fn sum_of_squares(&self, offsets: &[f64], points: &Points, rotations: &[Matrix3<f64>]) -> f64 {
        let mut unknowns = self.start.moved(&(&self.follows * DVector::from_column_slice(offsets)));
        let mut step = DVector::zeros(self.inverse.nrows());
        let mut least = f64::INFINITY;
        for _ in 0..STEPS {
            let trial = unknowns.moved(&step);
            let (cost, gradient, normal) = self.gradient(&trial, points, rotations);
            if cost.is_nan() || cost >= least {
                if cost - least <= GAIN * least {
                    break;
                }
                step *= 0.5;
                continue;
            }
            (unknowns, least) = (trial, cost);
            step = match normal {
                Some(normal) => -(pseudo_inverse(normal) * &gradient),
                None => -(&self.inverse * &gradient),
            };
            let gain = -gradient.dot(&step);
            if gain.is_nan() || gain <= GAIN * cost {
                break;
            }
        }
        least
    }

    /// The sum of squares, half its gradient, and of a wire the normal matrix: its anchor and its zero are hard to tell apart, and the
    /// nominal robot's matrix would not do.
    fn gradient(
        &self,
        unknowns: &Unknowns,
        points: &Points,
        rotations: &[Matrix3<f64>],
    ) -> (f64, DVector<f64>, Option<DMatrix<f64>>) {
        match (&self.sightings, unknowns) {
            (Sightings::Wire(lengths, offset), Unknowns::Anchor(anchor)) => {
                wire_gradient(lengths, *offset, anchor, points)
            }
            (Sightings::Frames(placements, turn_weight), Unknowns::Frames(frames, flange_from_target)) => {
                let (cost, gradient) =
                    frames_gradient(placements, *turn_weight, frames, flange_from_target, points, rotations);
                (cost, gradient, None)
            }
            _ => (0.0, DVector::zeros(self.inverse.nrows()), None),
        }
    }
}

fn wire_gradient(
    lengths: &[(Length, f64)],
    offset: bool,
    anchor: &Anchor,
    points: &Points,
) -> (f64, DVector<f64>, Option<DMatrix<f64>>) {
    let (mut cost, mut gradient, mut normal) = (0.0, Vector4::zeros(), Matrix4::zeros());
    for (length, weight) in lengths {
        let (u, distance) = direction(&(points.at(length.pose) - anchor.point_mm.coords));
        let residual = distance + anchor.offset_mm - length.length_mm;
        let row = Vector4::new(-u.x, -u.y, -u.z, 1.0);
        cost += weight * residual * residual;
        gradient += *weight * residual * row;
        normal += *weight * row * row.transpose();
    }
    let count = if offset { 4 } else { 3 };
    let part = normal.view((0, 0), (count, count)).into_owned();
    (cost, DVector::from_column_slice(&gradient.as_slice()[..count]), Some(part))
}

fn frames_gradient(
    placements: &[Vec<(Spot, Matrix3<f64>)>],
    turn_weight: Option<f64>,
    frames: &[Transform],
    flange_from_target: &Matrix3<f64>,
    points: &Points,
    rotations: &[Matrix3<f64>],
) -> (f64, DVector<f64>) {
    let last = 6 * placements.len();
    let mut cost = 0.0;
    let mut gradient = DVector::zeros(last + if turn_weight.is_some() { 3 } else { 0 });
    for (g, (spots, frame)) in placements.iter().zip(frames).enumerate() {
        let rotation = rotation_matrix(frame);
        let (mut torque, mut force) = (Vector3::zeros(), Vector3::zeros());
        for (spot, weight) in spots {
            let turned = rotation * points.at(spot.pose);
            let residual = turned + frame.translation.vector - spot.point_mm.coords;
            let pull = weight * residual;
            cost += residual.dot(&pull);
            torque += turned.cross(&pull);
            force += pull;
            if let (Some(weight), Some(measured)) = (turn_weight, &spot.rotation) {
                let sensor_from_flange = rotation * rotations[spot.pose];
                let turn = turn(&sensor_from_flange, flange_from_target, measured);
                cost += weight * turn.norm_squared();
                torque += weight * turn;
                let mut of_target = gradient.fixed_rows_mut::<3>(last);
                of_target += weight * sensor_from_flange.tr_mul(&turn);
            }
        }
        gradient.fixed_rows_mut::<3>(6 * g).copy_from(&torque);
        gradient.fixed_rows_mut::<3>(6 * g + 3).copy_from(&force);
    }
    (cost, gradient)
}
