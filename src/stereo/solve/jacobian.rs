//! The Jacobian of a picture's corners: by the camera, the rig, the board's shape and its pose.

use nalgebra::{Matrix2x3, Matrix3, Point3, RowVector3, Vector2, Vector3};

use crate::geometry::{Transform, rotation_matrix};
use crate::imaging::Side;
use crate::stereo::data::Observation;
use crate::stereo::model::Layout;
use crate::stereo::model::board_shape;
use crate::stereo::model::projection::{CAMERA_NUMBERS, Tilt};
use crate::stereo::solve::Loss;
use crate::stereo::solve::gram_matrix::WIDEST;
use crate::stereo::{Camera, Rig};

/// Where the packed columns of a picture go among the shared numbers; the pose's six and the residual follow them.
pub(super) struct Packing {
    camera: usize,
    transform: bool,
    shape: bool,
    pub shared: Vec<usize>,
}

impl Packing {
    pub fn new(layout: &Layout, side: Side) -> Packing {
        let camera = layout.camera_count(side);
        let transform = layout.transform && side == Side::Right;
        let mut shared: Vec<usize> = (0..camera).map(|i| layout.camera_start(side) + i).collect();
        if transform {
            shared.extend((0..6).map(|i| layout.transform_start() + i));
        }
        if layout.shape {
            shared.extend((0..board_shape::NUMBERS).map(|i| layout.shape_start() + i));
        }
        Packing { camera, transform, shape: layout.shape, shared }
    }

    /// Columns with the pose and the residual.
    pub fn width(&self) -> usize {
        self.shared.len() + 7
    }
}

/// A picture's camera and the ways there from the board, as matrices.
pub struct Way<'a> {
    camera: &'a Camera,
    tilt: Option<Tilt>,
    left_turn: Matrix3<f64>,
    left_shift: Vector3<f64>,
    /// `right_from_left` for the right picture.
    on: Option<(Matrix3<f64>, Vector3<f64>)>,
}

/// A corner as predicted: the whitened residual `predicted - seen`, and its derivatives.
pub struct Predicted {
    pub residual: Vector2<f64>,
    /// By the camera's numbers, not whitened.
    pub by_camera: [Vector2<f64>; CAMERA_NUMBERS],
    /// By the point in the camera's frame, and by the same in the left camera's.
    pub by_point: Matrix2x3<f64>,
    pub by_left: Matrix2x3<f64>,
    /// The point turned as the board is, and turned into the camera's frame, before each shift.
    pub turned: Vector3<f64>,
    pub turned_on: Vector3<f64>,
}

impl<'a> Way<'a> {
    pub fn new(rig: &'a Rig, left_from_board: &Transform, side: Side) -> Way<'a> {
        let right = &rig.right_from_left;
        let (camera, on) = match side {
            Side::Left => (&rig.left, None),
            Side::Right => (&rig.right, Some((rotation_matrix(right), right.translation.vector))),
        };
        let (left_turn, left_shift) = (rotation_matrix(left_from_board), left_from_board.translation.vector);
        Way { camera, tilt: camera.tilt(), left_turn, left_shift, on }
    }

    /// Derivatives by the point on the board.
    pub fn by_board(&self, predicted: &Predicted) -> Matrix2x3<f64> {
        predicted.by_left * self.left_turn
    }

    /// A corner from its place on the board. `None` where it would lie behind its camera.
    // Its result is four hundred bytes, which are not to be copied for each corner.
    #[inline(always)]
    pub fn predict(&self, board_mm: &Point3<f64>, o: &Observation) -> Option<Predicted> {
        let turned = self.left_turn * board_mm.coords;
        let in_left = turned + self.left_shift;
        let (turned_on, in_camera) = match &self.on {
            None => (in_left, in_left),
            Some((turn, shift)) => {
                let turned_on = turn * in_left;
                (turned_on, turned_on + shift)
            }
        };
        let projection = self.camera.project_through(self.tilt.as_ref(), &in_camera.into())?;
        let residual = o.whiten(projection.px - o.px);
        // A lens model can overflow far outside the picture.
        if !(residual.x.is_finite() && residual.y.is_finite()) {
            return None;
        }
        let by_point = o.whitener * projection.by_point;
        let by_left = self.on.as_ref().map_or(by_point, |(turn, _)| by_point * turn);
        Some(Predicted { residual, by_camera: projection.by_camera, by_point, by_left, turned, turned_on })
    }

    /// Writes two rows of the Jacobian and gives the residual. `None` where the corner would lie behind its camera.
    pub(super) fn rows(
        &self,
        packing: &Packing,
        shape_mm: &[f64; board_shape::NUMBERS],
        o: &Observation,
        rows: &mut [[f64; WIDEST]],
    ) -> Option<Vector2<f64>> {
        let predicted = self.predict(&o.board_point(shape_mm), o)?;
        let Predicted { residual, by_camera, by_point, by_left, turned, turned_on } = &predicted;
        let by_height = packing.shape.then(|| self.by_board(&predicted).column(2).into_owned());
        for (k, row) in rows.iter_mut().enumerate() {
            let (w0, w1) = (o.whitener[(k, 0)], o.whitener[(k, 1)]);
            let (camera, rest) = row.split_at_mut(packing.camera);
            for (column, by) in camera.iter_mut().zip(by_camera) {
                *column = w0 * by.x + w1 * by.y;
            }
            let mut rest = rest;
            if packing.transform {
                rest = write_turn_and_shift(rest, turned_on, &by_point.row(k).into());
            }
            if let Some(by_height) = by_height {
                for (column, lift) in rest.iter_mut().zip(&o.lift) {
                    *column = by_height[k] * lift;
                }
                rest = &mut rest[board_shape::NUMBERS..];
            }
            let end = write_turn_and_shift(rest, turned, &by_left.row(k).into());
            end[0] = residual[k];
        }
        Some(*residual)
    }
}

/// Derivatives by a small turn of `turned` and by a shift, from the derivative by the point; what is left of the row.
/// A turn moves the point by `turn x turned`, so that its slope is `turned x by_point`.
pub fn write_turn_and_shift<'a>(
    row: &'a mut [f64],
    turned: &Vector3<f64>,
    by_point: &RowVector3<f64>,
) -> &'a mut [f64] {
    let by = by_point.transpose();
    let by_turn = turned.cross(&by);
    let (here, rest) = row.split_at_mut(6);
    here[..3].copy_from_slice(by_turn.as_slice());
    here[3..].copy_from_slice(by.as_slice());
    rest
}

/// Weighs a corner's two rows of the Jacobian, whose residual stands in column `at`, by its loss: across the residual by
/// the weight, along it by how the loss bends there. Their gradient is that of the loss.
pub(super) fn weigh(rows: &mut [[f64; WIDEST]], at: usize, residual: &Vector2<f64>, weight: f64, loss: Loss) {
    let root = weight.sqrt();
    rows.iter_mut().flatten().for_each(|v| *v *= root);
    let squared = residual.norm_squared();
    let along = loss.bend_along(weight * squared).sqrt();
    if along < 1.0
        && let [first, second] = rows
    {
        let [x, y] = (residual / squared.sqrt()).into();
        for (a, b) in first[..at].iter_mut().zip(&mut second[..at]) {
            let less = (1.0 - along) * (x * *a + y * *b);
            *a -= x * less;
            *b -= y * less;
        }
        first[at] /= along;
        second[at] /= along;
    }
}
