//! One pose's share of the normal equations of the bundle over all poses.
//!
//! In: a rig, the target's crossings, a pose and its corners. Out: the sums of products of derivatives by the rig's raw numbers, by the
//! crossings' deviations and by the pose, then the same with the pose eliminated. A corner touches the rig, its own crossing and its own
//! pose only, so that the crossings' part of a single pose is block diagonal.

use nalgebra::{
    DMatrix, DVector, Matrix2x3, Matrix3, Matrix3x6, Matrix6, Point3, SMatrix, SVector, Vector2, Vector3, Vector6,
};

use crate::geometry::{Transform, rotation_matrix};
use crate::imaging::Board;
use crate::stereo::Rig;
use crate::stereo::data::observation::{Observation, Side};
use crate::stereo::data::view::View;
use crate::stereo::model::projection::CAMERA_NUMBERS;
use crate::stereo::solve::normal_equations::inverse6;
use crate::stereo::solve::robust_loss::Loss;
use crate::stereo::triangulate::RIG_NUMBERS;

/// Where the numbers of `right_from_left` begin among the rig's.
pub(in crate::stereo::target) const TRANSFORM: usize = 2 * CAMERA_NUMBERS;

/// A square matrix over the rig's numbers.
pub(in crate::stereo::target) type RigMatrix = SMatrix<f64, RIG_NUMBERS, RIG_NUMBERS>;

/// Where each crossing is on the target, board's frame, mm, row by row.
pub(in crate::stereo::target) fn crossings(board: &Board, deviations_mm: &[Vector3<f64>]) -> Vec<Point3<f64>> {
    board.corners_mm().zip(deviations_mm).map(|(at, deviation)| at + deviation).collect()
}

/// Predicted minus seen, px; what is seen of a misprinted crossing is in [`Observation::seen_off_mm`]. `None` for a corner behind its camera.
pub(in crate::stereo::target) fn residual(
    rig: &Rig,
    crossings: &[Point3<f64>],
    board: &Board,
    pose: &Transform,
    o: &Observation,
) -> Option<Vector2<f64>> {
    let in_left = pose * (crossings[board.index(o.col, o.row)] + o.seen_off_mm);
    let (camera, point) = match o.side {
        Side::Left => (&rig.left, in_left),
        Side::Right => (&rig.right, rig.right_from_left * in_left),
    };
    let in_front = point.z > 0.0;
    in_front.then(|| camera.project(&point) - o.px).filter(|r| r.x.is_finite() && r.y.is_finite())
}

/// Sums over one pose's corners.
pub(in crate::stereo::target) struct PoseBlock {
    rig: Box<RigMatrix>,
    rig_pose: SMatrix<f64, RIG_NUMBERS, 6>,
    rig_gradient: SVector<f64, RIG_NUMBERS>,
    pose: Matrix6<f64>,
    pose_gradient: Vector6<f64>,
    crossings: Vec<CrossingBlock>,
    /// Half the robust sum of squares.
    pub cost: f64,
}

/// The part of one crossing.
#[derive(Clone)]
struct CrossingBlock {
    own: Matrix3<f64>,
    rig: SMatrix<f64, RIG_NUMBERS, 3>,
    pose: Matrix3x6<f64>,
    gradient: Vector3<f64>,
}

impl CrossingBlock {
    const ZERO: CrossingBlock = CrossingBlock {
        own: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 3])),
        rig: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; RIG_NUMBERS]; 3])),
        pose: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 6])),
        gradient: SMatrix::from_array_storage(nalgebra::ArrayStorage([[0.0; 3]; 1])),
    };
}

/// A row of the whitened Jacobian. `rig` is filled in `from..to` only.
struct Row {
    rig: [f64; RIG_NUMBERS],
    pose: [f64; 6],
    crossing: [f64; 3],
    residual: f64,
}

impl PoseBlock {
    /// The sums at these values. `None` where a corner would lie behind its camera.
    pub fn new(
        rig: &Rig,
        crossings: &[Point3<f64>],
        board: &Board,
        pose: &Transform,
        view: &View,
        loss: Loss,
    ) -> Option<PoseBlock> {
        let mut block = PoseBlock {
            rig: Box::new(RigMatrix::zeros()),
            rig_pose: SMatrix::zeros(),
            rig_gradient: SVector::zeros(),
            pose: Matrix6::zeros(),
            pose_gradient: Vector6::zeros(),
            crossings: vec![CrossingBlock::ZERO; crossings.len()],
            cost: 0.0,
        };
        let turns = [rotation_matrix(pose), rotation_matrix(&rig.right_from_left)];
        for side in Side::BOTH {
            for o in view.active(side) {
                let at = board.index(o.col, o.row);
                let mut rows = rows(rig, &turns, pose, &(crossings[at] + o.seen_off_mm), o)?;
                let squared: f64 = rows.iter().map(|row| row.residual * row.residual).sum();
                let (cost, weight) = loss.cost_and_weight(squared);
                block.cost += cost;
                for row in &mut rows {
                    block.add(row, side, at, weight);
                }
            }
        }
        Some(block)
    }

    fn add(&mut self, row: &Row, side: Side, at: usize, weight: f64) {
        let columns = match side {
            Side::Left => 0..CAMERA_NUMBERS,
            Side::Right => CAMERA_NUMBERS..RIG_NUMBERS,
        };
        let crossing = &mut self.crossings[at];
        for j in columns.clone() {
            let by = weight * row.rig[j];
            if by == 0.0 {
                continue;
            }
            self.rig_gradient[j] += by * row.residual;
            for i in columns.start..=j {
                self.rig[(i, j)] += by * row.rig[i];
            }
            for k in 0..6 {
                self.rig_pose[(j, k)] += by * row.pose[k];
            }
            for k in 0..3 {
                crossing.rig[(j, k)] += by * row.crossing[k];
            }
        }
        for j in 0..6 {
            let by = weight * row.pose[j];
            self.pose_gradient[j] += by * row.residual;
            (0..6).for_each(|i| self.pose[(i, j)] += by * row.pose[i]);
            (0..3).for_each(|i| crossing.pose[(i, j)] += by * row.crossing[i]);
        }
        for j in 0..3 {
            let by = weight * row.crossing[j];
            crossing.gradient[j] += by * row.residual;
            (0..3).for_each(|i| crossing.own[(i, j)] += by * row.crossing[i]);
        }
    }

    /// What the corners say of their crossings' places in the plane: the trace of the normal matrix there.
    pub fn told_in_plane(&self) -> f64 {
        self.crossings.iter().map(|c| c.own[(0, 0)] + c.own[(1, 1)]).sum()
    }

    /// The step of the pose with everything else held, and by how much the cost would fall if the equations were straight.
    pub fn pose_step(&self) -> Option<(Vector6<f64>, f64)> {
        let step = -(inverse6(&self.pose)? * self.pose_gradient);
        Some((step, -0.5 * step.dot(&self.pose_gradient)))
    }

    /// With the pose eliminated, in the coordinates of the shared unknowns: `basis` maps the first of them to the rig's numbers, the
    /// crossings' deviations follow. `None` where the corners do not determine the pose.
    pub fn eliminate(&self, basis: &DMatrix<f64>) -> Option<Eliminated> {
        let (n, m) = (basis.ncols(), 3 * self.crossings.len());
        let pose_inverse = inverse6(&self.pose)?;
        let mut rig = DMatrix::from_fn(RIG_NUMBERS, RIG_NUMBERS, |i, j| self.rig[(i.min(j), i.max(j))]);
        let mut rig_shared = DMatrix::zeros(RIG_NUMBERS, n + m);
        rig_shared.columns_mut(0, n).gemm(1.0, &rig, basis, 0.0);
        let mut matrix = DMatrix::zeros(n + m, n + m);
        let mut mixed = DMatrix::zeros(n + m, 6);
        let mut gradient = DVector::zeros(n + m);
        let rig_pose = DMatrix::from_fn(RIG_NUMBERS, 6, |i, j| self.rig_pose[(i, j)]);
        let rig_gradient = DVector::from_column_slice(self.rig_gradient.as_slice());
        matrix.view_mut((0, 0), (n, n)).copy_from(&basis.tr_mul(&rig_shared.columns(0, n)));
        mixed.rows_mut(0, n).copy_from(&basis.tr_mul(&rig_pose));
        gradient.rows_mut(0, n).copy_from(&basis.tr_mul(&rig_gradient));
        for (k, crossing) in self.crossings.iter().enumerate() {
            let at = n + 3 * k;
            rig_shared.view_mut((0, at), (RIG_NUMBERS, 3)).copy_from(&crossing.rig);
            let by_basis = basis.tr_mul(&rig_shared.columns(at, 3));
            matrix.view_mut((0, at), (n, 3)).copy_from(&by_basis);
            matrix.view_mut((at, 0), (3, n)).copy_from(&by_basis.transpose());
            matrix.view_mut((at, at), (3, 3)).copy_from(&crossing.own);
            mixed.view_mut((at, 0), (3, 6)).copy_from(&crossing.pose);
            gradient.rows_mut(at, 3).copy_from(&crossing.gradient);
        }
        let through = &mixed * pose_inverse;
        matrix.gemm(-1.0, &through, &mixed.transpose(), 1.0);
        gradient -= &through * self.pose_gradient;
        let rig_through = &rig_pose * pose_inverse;
        rig_shared.gemm(-1.0, &rig_through, &mixed.transpose(), 1.0);
        rig.gemm(-1.0, &rig_through, &rig_pose.transpose(), 1.0);
        let rig_gradient = rig_gradient - &rig_through * self.pose_gradient;
        let pose_gradient = self.pose_gradient;
        Some(Eliminated {
            matrix,
            gradient,
            mixed,
            rig_mixed: rig_pose,
            pose_inverse,
            pose_gradient,
            rig,
            rig_shared,
            rig_gradient,
        })
    }
}

/// A pose's share with the pose eliminated.
pub(in crate::stereo::target) struct Eliminated {
    /// Shared by shared.
    pub matrix: DMatrix<f64>,
    /// Of the shared unknowns.
    pub gradient: DVector<f64>,
    /// Shared by pose, before the elimination.
    pub mixed: DMatrix<f64>,
    /// The rig's raw numbers by pose, before the elimination.
    pub rig_mixed: DMatrix<f64>,
    /// Covariance of the pose from its own corners.
    pub pose_inverse: Matrix6<f64>,
    /// Gradient of the pose.
    pub pose_gradient: Vector6<f64>,
    /// The rig's raw numbers, whether or not anything of them is an unknown.
    pub rig: DMatrix<f64>,
    /// The rig's raw numbers by the shared unknowns.
    pub rig_shared: DMatrix<f64>,
    /// Gradient of the rig's raw numbers.
    pub rig_gradient: DVector<f64>,
}

/// The two rows of a corner. `None` where it would lie behind its camera.
fn rows(
    rig: &Rig,
    turns: &[Matrix3<f64>; 2],
    pose: &Transform,
    crossing: &Point3<f64>,
    o: &Observation,
) -> Option<[Row; 2]> {
    let turned = turns[0] * crossing.coords;
    let in_left = turned + pose.translation.vector;
    let turned_on = turns[1] * in_left;
    let projection = match o.side {
        Side::Left => rig.left.project_with_derivatives(&in_left.into())?,
        Side::Right => {
            rig.right.project_with_derivatives(&(turned_on + rig.right_from_left.translation.vector).into())?
        }
    };
    let residual = o.whiten(projection.px - o.px);
    if !(residual.x.is_finite() && residual.y.is_finite()) {
        return None;
    }
    let by_point: Matrix2x3<f64> = o.whitener * projection.by_point;
    let (by_left, camera) = match o.side {
        Side::Left => (by_point, 0),
        Side::Right => (by_point * turns[1], CAMERA_NUMBERS),
    };
    let by_crossing = by_left * turns[0];
    let row = |k: usize| {
        let mut rig_row = [0.0; RIG_NUMBERS];
        let (w0, w1) = (o.whitener[(k, 0)], o.whitener[(k, 1)]);
        for (column, by) in rig_row[camera..].iter_mut().zip(&projection.by_camera) {
            *column = w0 * by.x + w1 * by.y;
        }
        if o.side == Side::Right {
            let by: Vector3<f64> = by_point.row(k).transpose();
            rig_row[TRANSFORM..TRANSFORM + 3].copy_from_slice(turned_on.cross(&by).as_slice());
            rig_row[TRANSFORM + 3..].copy_from_slice(by.as_slice());
        }
        let by: Vector3<f64> = by_left.row(k).transpose();
        let turn = turned.cross(&by);
        Row {
            rig: rig_row,
            pose: [turn.x, turn.y, turn.z, by.x, by.y, by.z],
            crossing: [by_crossing[(k, 0)], by_crossing[(k, 1)], by_crossing[(k, 2)]],
            residual: residual[k],
        }
    };
    Some([row(0), row(1)])
}
