//! One pose's share of the normal equations of the bundle over all poses.
//!
//! In: a rig, the target's crossings, a pose and its corners. Out: the sums of products of derivatives by the rig's raw
//! numbers, by the crossings' deviations and by the pose, then the same with the pose eliminated. A corner touches the
//! rig, its own crossing and its own pose only, so that the crossings' part of a single pose is block diagonal; only
//! what the poses' freedom takes off is dense.

use nalgebra::{DMatrix, Matrix3, Matrix3x6, Matrix6, Matrix6xX, Point3, SMatrix, SVector, Vector2, Vector3, Vector6};

use crate::geometry::Transform;
use crate::imaging::Board;
use crate::stereo::Rig;
use crate::stereo::data::observation::{Observation, Side};
use crate::stereo::data::residuals::of_point;
use crate::stereo::data::view::View;
use crate::stereo::model::projection::CAMERA_NUMBERS;
use crate::stereo::solve::Loss;
use crate::stereo::solve::jacobian::{Way, write_turn_and_shift};
use crate::stereo::solve::normal_equations::inverse6;
use crate::stereo::triangulate::RIG_NUMBERS;

/// Whitened residuals beyond this are outliers.
pub const OUTLIER: f64 = 5.3;

/// Where the numbers of `right_from_left` begin among the rig's.
pub const TRANSFORM: usize = 2 * CAMERA_NUMBERS;

/// A square matrix over the rig's numbers.
pub type RigMatrix = SMatrix<f64, RIG_NUMBERS, RIG_NUMBERS>;

/// A target as it is found to be, and the rig that sees it.
pub struct Scene<'a> {
    pub rig: Rig,
    /// The target as drawn.
    pub board: &'a Board,
    /// Where each crossing is on the target, board's frame, mm, row by row.
    pub crossings: Vec<Point3<f64>>,
}

impl<'a> Scene<'a> {
    pub fn new(rig: Rig, board: &'a Board, deviations_mm: &[Vector3<f64>]) -> Scene<'a> {
        let crossings = board.corners_mm().zip(deviations_mm).map(|(at, deviation)| at + deviation).collect();
        Scene { rig, board, crossings }
    }

    pub fn crossing(&self, o: &Observation) -> Point3<f64> {
        self.crossings[self.board.index(o.col, o.row)]
    }

    /// Predicted minus seen, px; what is seen of a misprinted crossing is in [`Observation::seen_off_mm`]. `None` for a
    /// corner behind its camera.
    pub fn residual(&self, left_from_board: &Transform, o: &Observation) -> Option<Vector2<f64>> {
        of_point(&self.rig, left_from_board * (self.crossing(o) + o.seen_off_mm), o)
    }

    /// Hands over the rows of every active corner, with its side and its crossing's number. `None` where one would lie
    /// behind its camera.
    fn each_corner(
        &self,
        left_from_board: &Transform,
        view: &View,
        mut take: impl FnMut(Side, usize, &[Row; 2]),
    ) -> Option<()> {
        for side in Side::BOTH {
            let way = Way::new(&self.rig, left_from_board, side);
            for o in view.active(side) {
                let at = self.board.index(o.col, o.row);
                take(side, at, &rows(&way, &(self.crossings[at] + o.seen_off_mm), o)?);
            }
        }
        Some(())
    }
}

/// Sums over one pose's corners.
pub struct PoseBlock {
    pub shared: CornerSums,
    rig_pose: SMatrix<f64, RIG_NUMBERS, 6>,
    crossings_pose: Vec<Matrix3x6<f64>>,
    pose: PoseSums,
}

/// The part of the pose alone.
#[derive(Default)]
pub struct PoseSums {
    matrix: Matrix6<f64>,
    gradient: Vector6<f64>,
    /// Half the robust sum of squares.
    pub cost: f64,
}

/// The part of what all poses share: it is added up over the poses before anything is made of it.
pub struct CornerSums {
    /// Its upper triangle.
    rig: Box<RigMatrix>,
    pub rig_gradient: SVector<f64, RIG_NUMBERS>,
    pub crossings: Vec<CrossingSums>,
}

/// The part of one crossing.
#[derive(Clone)]
pub struct CrossingSums {
    pub own: Matrix3<f64>,
    pub rig: SMatrix<f64, RIG_NUMBERS, 3>,
    pub gradient: Vector3<f64>,
}

impl CornerSums {
    pub fn zeros(crossings: usize) -> CornerSums {
        let none = CrossingSums { own: Matrix3::zeros(), rig: SMatrix::zeros(), gradient: Vector3::zeros() };
        CornerSums {
            rig: Box::new(RigMatrix::zeros()),
            rig_gradient: SVector::zeros(),
            crossings: vec![none; crossings],
        }
    }

    pub fn add(&mut self, other: &CornerSums) {
        *self.rig += &*other.rig;
        self.rig_gradient += other.rig_gradient;
        for (all, one) in self.crossings.iter_mut().zip(&other.crossings) {
            all.own += one.own;
            all.rig += one.rig;
            all.gradient += one.gradient;
        }
    }

    /// The rig's numbers by themselves, whole.
    pub fn rig(&self) -> RigMatrix {
        RigMatrix::from_fn(|i, j| self.rig[(i.min(j), i.max(j))])
    }
}

/// A row of the whitened Jacobian. `rig` is zero but for the numbers of the camera that saw the corner.
struct Row {
    rig: [f64; RIG_NUMBERS],
    pose: [f64; 6],
    crossing: [f64; 3],
    residual: f64,
}

impl PoseSums {
    /// The sums at these values, without those of a [`PoseBlock`]. `None` where a corner would lie behind its camera.
    pub fn of(scene: &Scene<'_>, left_from_board: &Transform, view: &View, loss: Loss) -> Option<PoseSums> {
        let mut sums = PoseSums::default();
        scene.each_corner(left_from_board, view, |_, _, rows| {
            let weight = sums.weigh(rows, loss);
            rows.iter().for_each(|row| sums.add(row, weight));
        })?;
        Some(sums)
    }

    /// Adds a corner's cost and gives its weight.
    fn weigh(&mut self, rows: &[Row; 2], loss: Loss) -> f64 {
        let squared: f64 = rows.iter().map(|row| row.residual * row.residual).sum();
        let (cost, weight) = loss.cost_and_weight(squared);
        self.cost += cost;
        weight
    }

    fn add(&mut self, row: &Row, weight: f64) {
        for j in 0..6 {
            let by = weight * row.pose[j];
            self.gradient[j] += by * row.residual;
            (0..6).for_each(|i| self.matrix[(i, j)] += by * row.pose[i]);
        }
    }

    /// The step of the pose with everything else held, and by how much the cost would fall if the equations were
    /// straight.
    pub fn step(&self) -> Option<(Vector6<f64>, f64)> {
        let step = -(inverse6(&self.matrix)? * self.gradient);
        Some((step, -0.5 * step.dot(&self.gradient)))
    }
}

impl PoseBlock {
    /// The sums at these values. `None` where a corner would lie behind its camera.
    pub fn of(scene: &Scene<'_>, left_from_board: &Transform, view: &View, loss: Loss) -> Option<PoseBlock> {
        let mut block = PoseBlock {
            shared: CornerSums::zeros(scene.crossings.len()),
            rig_pose: SMatrix::zeros(),
            crossings_pose: vec![Matrix3x6::zeros(); scene.crossings.len()],
            pose: PoseSums::default(),
        };
        scene.each_corner(left_from_board, view, |side, at, rows| {
            let weight = block.pose.weigh(rows, loss);
            rows.iter().for_each(|row| block.add(row, side, at, weight));
        })?;
        Some(block)
    }

    fn add(&mut self, row: &Row, side: Side, at: usize, weight: f64) {
        self.pose.add(row, weight);
        let columns = match side {
            Side::Left => 0..CAMERA_NUMBERS,
            Side::Right => CAMERA_NUMBERS..RIG_NUMBERS,
        };
        let crossing = &mut self.shared.crossings[at];
        for j in columns.clone() {
            let by = weight * row.rig[j];
            if by == 0.0 {
                continue;
            }
            self.shared.rig_gradient[j] += by * row.residual;
            for i in columns.start..=j {
                self.shared.rig[(i, j)] += by * row.rig[i];
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
            (0..3).for_each(|i| self.crossings_pose[at][(i, j)] += by * row.crossing[i]);
        }
        for j in 0..3 {
            let by = weight * row.crossing[j];
            crossing.gradient[j] += by * row.residual;
            (0..3).for_each(|i| crossing.own[(i, j)] += by * row.crossing[i]);
        }
    }

    /// With the pose eliminated, in the coordinates of the shared unknowns: `basis` maps the first of them to the rig's
    /// numbers, the crossings' deviations follow. `None` where the corners do not determine the pose.
    pub fn eliminate(&self, basis: &DMatrix<f64>) -> Option<Eliminated> {
        let (n, m) = (basis.ncols(), 3 * self.crossings_pose.len());
        let pose_inverse = inverse6(&self.pose.matrix)?;
        let mut mixed = DMatrix::zeros(n + m, 6);
        mixed.rows_mut(0, n).copy_from(&basis.tr_mul(&self.rig_pose));
        // A change of `right_from_left` at this pose alone.
        let by_rig = self.shared.rig().fixed_rows::<6>(TRANSFORM).into_owned();
        let mut change_shared = DMatrix::zeros(6, n + m);
        change_shared.columns_mut(0, n).copy_from(&(by_rig * basis));
        for (k, (crossing, pose)) in self.shared.crossings.iter().zip(&self.crossings_pose).enumerate() {
            let at = n + 3 * k;
            change_shared.columns_mut(at, 3).copy_from(&crossing.rig.fixed_rows::<6>(TRANSFORM));
            mixed.rows_mut(at, 3).copy_from(pose);
        }
        let change_pose = self.rig_pose.fixed_rows::<6>(TRANSFORM).into_owned();
        let through = change_pose * pose_inverse;
        change_shared -= through * mixed.transpose();
        Some(Eliminated {
            mixed,
            rig_mixed: self.rig_pose,
            pose_inverse,
            pose_gradient: self.pose.gradient,
            change: by_rig.fixed_columns::<6>(TRANSFORM) - through * change_pose.transpose(),
            change_shared,
            change_gradient: self.shared.rig_gradient.fixed_rows::<6>(TRANSFORM) - through * self.pose.gradient,
        })
    }
}

/// A pose's share with the pose eliminated.
#[derive(Debug, Clone)]
pub struct Eliminated {
    /// Shared by pose, before the elimination.
    pub mixed: DMatrix<f64>,
    /// The rig's raw numbers by pose, before the elimination.
    pub rig_mixed: SMatrix<f64, RIG_NUMBERS, 6>,
    /// Covariance of the pose from its own corners.
    pub pose_inverse: Matrix6<f64>,
    pub pose_gradient: Vector6<f64>,
    /// A change of `right_from_left` at this pose alone, by itself.
    pub change: Matrix6<f64>,
    /// The same by the shared unknowns.
    pub change_shared: DMatrix<f64>,
    pub change_gradient: Vector6<f64>,
}

impl Eliminated {
    /// Derivative of the pose by the shared unknowns.
    pub fn by_shared(&self) -> Matrix6xX<f64> {
        -(self.pose_inverse * self.mixed.transpose())
    }

    /// The step of the pose, the shared unknowns held.
    pub fn step(&self) -> Vector6<f64> {
        -(self.pose_inverse * self.pose_gradient)
    }

    /// Covariance of the pose, which is `pose_inverse` from its corners, where `right_from_left` scatters from pose to
    /// pose so much that each tells it `excess` times as badly as its corners say; the whiteners hold that. What the
    /// target's size and the rays leave undetermined of the scatter is the pose's.
    pub fn own_covariance(&self, excess: f64) -> Matrix6<f64> {
        let (own, by_change) = (&self.pose_inverse, self.by_change());
        let Some(change) = inverse6(&self.change).filter(|_| excess > 1.0) else { return *own };
        let all = own / excess + by_change * change * by_change.transpose() * (1.0 - 1.0 / excess);
        0.5 * (all + all.transpose())
    }

    /// Derivative of the pose by a change of `right_from_left` that nobody knows of.
    pub fn by_change(&self) -> Matrix6<f64> {
        -(self.pose_inverse * self.rig_mixed.fixed_rows::<6>(TRANSFORM).transpose())
    }
}

/// The two rows of a corner. `None` where it would lie behind its camera.
fn rows(way: &Way, crossing: &Point3<f64>, o: &Observation) -> Option<[Row; 2]> {
    let predicted = way.predict(crossing, o)?;
    let by_crossing = way.by_board(&predicted);
    let camera = if o.side == Side::Left { 0 } else { CAMERA_NUMBERS };
    let row = |k: usize| {
        let (mut rig, mut pose) = ([0.0; RIG_NUMBERS], [0.0; 6]);
        let (w0, w1) = (o.whitener[(k, 0)], o.whitener[(k, 1)]);
        for (column, by) in rig[camera..].iter_mut().zip(&predicted.by_camera) {
            *column = w0 * by.x + w1 * by.y;
        }
        if o.side == Side::Right {
            write_turn_and_shift(&mut rig[TRANSFORM..], &predicted.turned_on, &predicted.by_point.row(k).into());
        }
        write_turn_and_shift(&mut pose, &predicted.turned, &predicted.by_left.row(k).into());
        let crossing = [by_crossing[(k, 0)], by_crossing[(k, 1)], by_crossing[(k, 2)]];
        Row { rig, pose, crossing, residual: predicted.residual[k] }
    };
    Some([row(0), row(1)])
}
