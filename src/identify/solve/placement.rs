//! The cost of a placement whose own unknowns are solved for, without building matrices: for the swarms.
//!
//! In: points and rotations of the robot's poses. Out: the sum of the squared whitened residuals with the
//! unknowns (rigid transforms, the wire's anchor and zero) at their best. The unknowns start where they follow the parameters to
//! first order and go on by Newton's method; rigid transforms with the normal matrix of the nominal robot, which hardly changes
//! within the box, so that two or three gradients are enough.
//! What goes wrong: far outside the box that matrix may not converge; the least cost that was seen is then an upper bound.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Vector3, Vector4};

use crate::geometry::direction;
use crate::geometry::{Transform, rotation_matrix};
use crate::identify::model::kinematics::Place;
use crate::identify::model::kinematics::points::Points as Computed;
use crate::identify::residuals::eliminate::{Block, Unknowns};
use crate::identify::residuals::points::turn;
use crate::identify::sensor::{Length, Scatter, Spot};
use crate::linear_algebra::{product, pseudo_inverse};

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
    /// Lengths with their weights, and whether the wire's zero is unknown.
    Wire(Vec<(Length, f64)>, bool),
    /// Spots with their weights of point and of turn, and `flange_from_target` where orientations are used.
    Points(Vec<(Spot, Matrix3<f64>, f64)>, Option<Matrix3<f64>>),
}

impl Placement {
    /// `places` are those of the nominal robot, with derivatives. `None` for blocks without such unknowns.
    pub fn new(block: &Block, places: &[Place], scatter: &Scatter) -> Option<Placement> {
        let sightings = match block {
            Block::Wire(wire) => {
                let weight = |l: &Length| (l.weight / scatter.sd(l, 1.0)).powi(2);
                Sightings::Wire(wire.lengths.iter().map(|l| (l.clone(), weight(l))).collect(), wire.offset)
            }
            Block::Points(points) => {
                let weighted = |spot: &Spot| {
                    let whiten = scatter.whitener(&spot.covariance_mm2) * spot.weight;
                    (spot.clone(), whiten.tr_mul(&whiten), (spot.weight / scatter.rotation_rad).powi(2))
                };
                let target = points.oriented.then_some(points.flange_from_target);
                Sightings::Points(points.spots.iter().map(weighted).collect(), target)
            }
            _ => return None,
        };
        let start = block.solved(places, &[], scatter);
        let linear = block.linear(places, &[], scatter);
        let inverse = pseudo_inverse(product(&linear.design, &linear.design));
        let follows = -(&inverse * product(&linear.design, &linear.jacobian));
        Some(Placement { sightings, start, inverse, follows })
    }

    /// Whether rotations are needed.
    pub fn is_oriented(&self) -> bool {
        matches!(self.sightings, Sightings::Points(_, Some(_)))
    }

    /// The sum of the squared white residuals. `rotations` may be empty unless the block is oriented.
    pub fn sum_of_squares(&self, offsets: &[f64], points: &Computed, rotations: &[Matrix3<f64>]) -> f64 {
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
        points: &Computed,
        rotations: &[Matrix3<f64>],
    ) -> (f64, DVector<f64>, Option<DMatrix<f64>>) {
        match (&self.sightings, unknowns) {
            (Sightings::Wire(lengths, offset), Unknowns::Anchor(anchor, zero)) => {
                wire_gradient(lengths, *offset, anchor, *zero, points)
            }
            (Sightings::Points(spots, target), Unknowns::Frame(frame)) => {
                let (cost, gradient) = points_gradient(spots, target.as_ref(), frame, points, rotations);
                (cost, gradient, None)
            }
            _ => (0.0, DVector::zeros(self.inverse.nrows()), None),
        }
    }
}

fn wire_gradient(
    lengths: &[(Length, f64)],
    offset: bool,
    anchor_mm: &Vector3<f64>,
    zero_mm: f64,
    points: &Computed,
) -> (f64, DVector<f64>, Option<DMatrix<f64>>) {
    let (mut cost, mut gradient, mut normal) = (0.0, Vector4::zeros(), Matrix4::zeros());
    for (length, weight) in lengths {
        let (u, distance) = direction(&(points.at(length.pose) - anchor_mm));
        let residual = distance + zero_mm - length.length_mm;
        let row = Vector4::new(-u.x, -u.y, -u.z, 1.0);
        cost += weight * residual * residual;
        gradient += *weight * residual * row;
        normal += *weight * row * row.transpose();
    }
    let count = if offset { 4 } else { 3 };
    let part = normal.view((0, 0), (count, count)).into_owned();
    (cost, DVector::from_column_slice(&gradient.as_slice()[..count]), Some(part))
}

fn points_gradient(
    spots: &[(Spot, Matrix3<f64>, f64)],
    flange_from_target: Option<&Matrix3<f64>>,
    frame: &Transform,
    points: &Computed,
    rotations: &[Matrix3<f64>],
) -> (f64, DVector<f64>) {
    let rotation = rotation_matrix(frame);
    let (mut cost, mut torque, mut force) = (0.0, Vector3::zeros(), Vector3::zeros());
    for (spot, weight, turn_weight) in spots {
        let turned = rotation * points.at(spot.pose);
        let residual = turned + frame.translation.vector - spot.point_mm.coords;
        let pull = weight * residual;
        cost += residual.dot(&pull);
        torque += turned.cross(&pull);
        force += pull;
        if let (Some(target), Some(measured)) = (flange_from_target, &spot.rotation) {
            let turn = turn(&(rotation * rotations[spot.pose]), target, measured);
            cost += turn_weight * turn.norm_squared();
            torque += *turn_weight * turn;
        }
    }
    (cost, DVector::from_iterator(6, torque.iter().chain(force.iter()).copied()))
}
