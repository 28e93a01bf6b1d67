//! Where the sensor stands in each placement and where the target sits on the flange, with the covariance of all of it
//! together.
//!
//! In: the rows of a fit with positions, the offsets of the robot that was found, and their covariance. Out:
//! `sensor_from_base` of each group, the target's place, and for any joints the point that the robot shows there in the
//! sensor's frame, with its covariance. Method: the placements' own unknowns follow the shared ones (robot, sensor,
//! target) as the linearised problem says, so that what is uncertain of the robot is uncertain of the placement with
//! it. What only moves the whole robot, or only the target on the flange, is what a placement is: it is held as the
//! robot's file has it ([`is_held`]). Readings are taken as they are read: the sensor's own errors (its scale, a
//! calibration's) were found beside the robot, and the placements are fitted to readings that still have them. Goes
//! wrong: errors that the rows share and nobody stated are in none of it.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Matrix6, Point3, Vector3};

use crate::geometry::{Transform, rigid_columns, rotation_matrix, transform_from_matrix};
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::lengths::Lengths;
use crate::identify::model::kinematics::{Kinematics, Place};
use crate::identify::residuals::eliminate::{Block, Unknowns};
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{Extra, Scatter};
use crate::identify::solve::linearised::Linearised;
use crate::linear_algebra::{product, pseudo_inverse};
use crate::robot::jacobian::RAD_PER_MRAD;
use crate::robot::{Parameter, Robot};

/// Whether a parameter of a robot with so many joints does nothing but move the whole robot, or the target on its
/// flange.
pub fn is_held(parameter: Parameter, joints: usize) -> bool {
    use Parameter::{A, Alpha, D, Theta};
    match parameter {
        Alpha(0) | A(0) | Theta(0) | D(0) => true,
        Theta(joint) | D(joint) => joint + 1 == joints,
        _ => false,
    }
}

/// A rigid transform and the covariance of `exp(w)` on the left of its rotation and of its translation, rad and mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertain {
    pub transform: Transform,
    /// Turn first, then shift.
    pub covariance: Matrix6<f64>,
}

impl Uncertain {
    /// The transform back.
    pub fn inverse(&self) -> Uncertain {
        let transform = self.transform.inverse();
        let turn = -rotation_matrix(&transform);
        self.moved(transform, &turn, turn * self.transform.translation.vector.cross_matrix())
    }

    /// Behind a transform that is certain.
    pub fn after(&self, first: &Transform) -> Uncertain {
        self.moved(first * self.transform, &rotation_matrix(first), Matrix3::zeros())
    }

    /// Another transform, whose turn and shift change by `turn` times those of this one, the shift by `swing` times the
    /// turn beside.
    fn moved(&self, transform: Transform, turn: &Matrix3<f64>, swing: Matrix3<f64>) -> Uncertain {
        let mut moves = Matrix6::zeros();
        moves.fixed_view_mut::<3, 3>(0, 0).copy_from(turn);
        moves.fixed_view_mut::<3, 3>(3, 3).copy_from(turn);
        moves.fixed_view_mut::<3, 3>(3, 0).copy_from(&swing);
        Uncertain { transform, covariance: moves * self.covariance * moves.transpose() }
    }
}

/// All placements of a set.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Index of the group and `sensor_from_base`, group by group; base and sensor frames as the readings and the chain
    /// have them.
    pub groups: Vec<(usize, Transform)>,
    /// `last_frame_from_target`; without a turn that was found its rotation is the identity.
    pub flange_from_target: Transform,
    /// Whether the target's turn was found.
    pub oriented: bool,
    /// Whether the target's point was found, and not taken from the robot's file.
    pub target_found: bool,
    /// Mean square of what a fresh pose is off by beside all this, mm^2: its scatter, and what placements share of
    /// smooth errors.
    pub fresh_mm2: f64,
    /// How large readings are off.
    scatter: Scatter,
    kinematics: Arc<Kinematics>,
    /// The robot that was found.
    pub robot: Robot,
    offsets: Vec<f64>,
    extras: Vec<Extra>,
    /// Of the shared offsets, then six numbers a group.
    covariance: DMatrix<f64>,
    /// What the readings have of the sensor's errors and the placements' frames do not take up, in the same unknowns.
    of_sensor: DVector<f64>,
}

impl Placed {
    /// `rows` have points, `offsets` are zero where `sensor` says what was found of the sensor's errors, `shared` is
    /// the covariance of both, and `common` how many times larger than of independent errors variances are. `None`
    /// where no group has a frame.
    pub fn new(
        set: &Dataset,
        rows: &Rows,
        offsets: &[f64],
        sensor: &[f64],
        shared: &DMatrix<f64>,
        common: f64,
    ) -> Option<Placed> {
        let linear = Linearised::new(rows, offsets);
        let (of_robot, of_extras) = rows.split(offsets);
        let parameters = &rows.kinematics.parameters;
        let robot = rows.kinematics.nominal.shifted(parameters, of_robot);
        let (mut groups, mut follows, mut own) = (Vec::new(), Vec::new(), Vec::new());
        let mut turn = None;
        for ((block, unknowns), placement) in rows.blocks.iter().zip(rows.unknowns(offsets)).zip(&linear.placements) {
            let (Block::Points(points), Unknowns::Frame(frame)) = (block, unknowns) else { continue };
            let group = set.poses[rows.rows[points.spots.first()?.pose]].group;
            groups.push((group, frame));
            let inverse = pseudo_inverse(product(&placement.linear.design, &placement.linear.design));
            follows.push(-(&inverse * product(&placement.linear.design, &placement.linear.jacobian)));
            own.push(inverse * common);
            if !points.target.is_empty() {
                turn = Some(points.turned_target(of_extras));
            }
        }
        if groups.is_empty() {
            return None;
        }
        let follow = following(shared.ncols(), &follows);
        Some(Placed {
            flange_from_target: transform_from_matrix(turn.unwrap_or_else(Matrix3::identity), robot.tool_mm),
            oriented: turn.is_some(),
            target_found: parameters.iter().any(|p| matches!(p, Parameter::V(_))),
            covariance: together(shared, &follow, &own),
            of_sensor: &follow * DVector::from_column_slice(sensor),
            scatter: rows.scatter,
            fresh_mm2: 3.0 * (rows.scatter.fresh_mm2() + rows.left_by_smooth_mm2()),
            kinematics: rows.kinematics.clone(),
            robot,
            offsets: of_robot.to_vec(),
            extras: rows.extras.clone(),
            groups,
        })
    }

    /// `sensor_from_base` of one of the groups, in their order here.
    pub fn sensor_from_base(&self, index: usize) -> Uncertain {
        let at = self.column(index);
        let covariance = self.covariance.fixed_view::<6, 6>(at, at).into_owned();
        Uncertain { transform: self.groups[index].1, covariance }
    }

    /// Where the six numbers of a group begin in the covariance.
    fn column(&self, index: usize) -> usize {
        self.offsets.len() + self.extras.len() + 6 * index
    }

    /// `last_frame_from_target`; numbers that were not found have no variance.
    pub fn target(&self) -> Uncertain {
        let count = self.offsets.len();
        let parameter = |p| self.kinematics.parameters.iter().position(|q| *q == p);
        let extra = |e| self.extras.iter().position(|q| *q == e).map(|k| k + count);
        let place = |k: usize| if k < 3 { extra(Extra::Target(k)) } else { parameter(Parameter::V(k - 3)) };
        let unit = |k: usize| if k < 3 { RAD_PER_MRAD } else { 1.0 };
        let covariance = Matrix6::from_fn(|r, c| match (place(r), place(c)) {
            (Some(i), Some(j)) => self.covariance[(i, j)] * unit(r) * unit(c),
            _ => 0.0,
        });
        Uncertain { transform: self.flange_from_target, covariance }
    }

    /// The target's point in the frame of a group's sensor at each of these joints (rad), and its covariance, mm^2:
    /// what the next reading there is without its own noise and scatter, of a sensor without errors of its own.
    pub fn points(&self, index: usize, joints: &[&[f64]]) -> Vec<(Vector3<f64>, Matrix3<f64>)> {
        let poses: Vec<(&[f64], Option<&Matrix3xX<f64>>)> = joints.iter().map(|&joints| (joints, None)).collect();
        let of_columns = |(point, columns): (Point3<f64>, DMatrix<f64>)| {
            let covariance = &columns * &self.covariance * columns.transpose();
            (point.coords, covariance.fixed_view::<3, 3>(0, 0).into_owned())
        };
        self.columns(index, &poses).into_iter().map(of_columns).collect()
    }

    /// The point, and what it moves by with each unknown of the covariance, at each of these poses: joints (rad), and
    /// columns of what the sensor's readings there have in common.
    fn columns(&self, index: usize, poses: &[(&[f64], Option<&Matrix3xX<f64>>)]) -> Vec<(Point3<f64>, DMatrix<f64>)> {
        let nominal = &self.kinematics.nominal;
        let joints: Vec<&[f64]> = poses.iter().map(|(joints, _)| *joints).collect();
        let kinematics = Kinematics::new(nominal, &self.robot, &self.kinematics.parameters, &joints);
        let frame = &self.groups[index].1;
        let of_place = |(place, (_, shared)): (Place, &(&[f64], Option<&Matrix3xX<f64>>))| {
            let turned = frame.rotation * place.point_mm.coords;
            let point = Point3::from(turned + frame.translation.vector);
            let mut columns = DMatrix::zeros(3, self.covariance.ncols());
            let robot = place.point_columns.ncols();
            columns.view_mut((0, 0), (3, robot)).copy_from(&(rotation_matrix(frame) * place.point_columns));
            for (k, extra) in self.extras.iter().enumerate() {
                columns.fixed_view_mut::<3, 1>(0, robot + k).copy_from(&extra.of_point(&point, *shared));
            }
            columns.fixed_view_mut::<3, 6>(0, self.column(index)).copy_from(&rigid_columns(&turned));
            (point, columns)
        };
        kinematics.places(&self.offsets, true).into_iter().zip(poses).map(of_place).collect()
    }

    /// How far off the target is to be expected at the poses of one of the groups: against where the same sensor reads
    /// it at such a pose, beside the noise of a reading that its covariance states.
    pub fn expected(&self, set: &Dataset, index: usize) -> Lengths {
        let poses = set.poses.iter().enumerate().filter(|(_, pose)| pose.group == self.groups[index].0);
        let poses = poses.map(|(row, pose)| (pose.joints_rad.as_slice(), set.shared.get(row))).collect::<Vec<_>>();
        let covariance = |(_, columns): (Point3<f64>, DMatrix<f64>)| {
            let of_sensor = &columns * &self.of_sensor;
            let total = &columns * &self.covariance * columns.transpose() + &of_sensor * of_sensor.transpose();
            Matrix3::from_fn(|r, c| total[(r, c)]) + Matrix3::identity() * (self.fresh_mm2 / 3.0)
        };
        let covariances: Vec<Matrix3<f64>> = self.columns(index, &poses).into_iter().map(covariance).collect();
        Lengths::new(&covariances, self.scatter.freedom_of(&covariances))
    }
}

/// What shared offsets move all unknowns by: themselves, and all placements' own, which follow them.
fn following(count: usize, follows: &[DMatrix<f64>]) -> DMatrix<f64> {
    let mut follow = DMatrix::zeros(count + 6 * follows.len(), count);
    follow.view_mut((0, 0), (count, count)).fill_with_identity();
    for (k, of_group) in follows.iter().enumerate() {
        follow.view_mut((count + 6 * k, 0), (6, count)).copy_from(of_group);
    }
    follow
}

/// The covariance of shared offsets and of all placements' own unknowns, which follow them and have errors of their
/// own.
fn together(shared: &DMatrix<f64>, follow: &DMatrix<f64>, own: &[DMatrix<f64>]) -> DMatrix<f64> {
    let count = shared.ncols();
    let mut covariance = follow * shared * follow.transpose();
    for (k, own) in own.iter().enumerate() {
        let mut part = covariance.view_mut((count + 6 * k, count + 6 * k), (6, 6));
        part += own;
    }
    covariance
}
