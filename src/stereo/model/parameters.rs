//! Which numbers of a rig are free, where each stands in the vector of unknowns, and how a step changes them.

use nalgebra::DVector;

use crate::geometry::{Transform, perturb};
use crate::imaging::Side;
use crate::stereo::model::board_shape;
use crate::stereo::{Lens, Rig};

/// Names of a camera's numbers in the order of [`crate::stereo::model::projection::Projection::by_camera`].
pub const CAMERA_NAMES: [&str; 18] =
    ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY"];

/// Names of the transform's numbers.
pub const TRANSFORM_NAMES: [&str; 6] = ["rx_rad", "ry_rad", "rz_rad", "tx_mm", "ty_mm", "tz_mm"];

/// What all pairs share: the rig and the board's shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared {
    /// The two cameras; its covariance is not used here.
    pub rig: Rig,
    /// The board's shape, see [`board_shape`]; zero for a flat board.
    pub shape_mm: [f64; board_shape::NUMBERS],
}

/// Values of all unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    pub shared: Shared,
    /// `left_from_board` of every view.
    pub poses: Vec<Transform>,
}

/// Which of the shared numbers are free. They stand in the order left camera, right camera, `right_from_left`, shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// The left camera's lens, where its numbers are free.
    pub left: Option<Lens>,
    /// The right camera's lens, where its numbers are free.
    pub right: Option<Lens>,
    /// `right_from_left`.
    pub transform: bool,
    /// The board's shape.
    pub shape: bool,
}

impl Layout {
    /// Nothing shared is free: only the boards' poses are looked for.
    pub const POSES_ONLY: Layout = Layout { left: None, right: None, transform: false, shape: false };

    /// All numbers of a rig, in their order.
    pub const WHOLE_RIG: Layout =
        Layout { left: Some(Lens::Tilted14), right: Some(Lens::Tilted14), transform: true, shape: false };

    /// The left camera alone.
    pub fn one_camera(lens: Lens) -> Layout {
        Layout { left: Some(lens), ..Layout::POSES_ONLY }
    }

    /// Both cameras and the rig.
    pub fn rig(lens: Lens, shape: bool) -> Layout {
        Layout { left: Some(lens), right: Some(lens), transform: true, shape }
    }

    /// The lens of a camera whose numbers are free.
    pub fn lens(&self, side: Side) -> Option<Lens> {
        [self.left, self.right][side as usize]
    }

    /// Free numbers of one camera.
    pub fn camera_count(&self, side: Side) -> usize {
        self.lens(side).map_or(0, |lens| 4 + lens.free_count())
    }

    /// Where a camera's numbers begin.
    pub fn camera_start(&self, side: Side) -> usize {
        if side == Side::Left { 0 } else { self.camera_count(Side::Left) }
    }

    /// Where `right_from_left` begins.
    pub fn transform_start(&self) -> usize {
        self.camera_count(Side::Left) + self.camera_count(Side::Right)
    }

    pub fn shape_start(&self) -> usize {
        self.transform_start() + if self.transform { 6 } else { 0 }
    }

    /// Number of free shared numbers.
    pub fn count(&self) -> usize {
        self.shape_start() + if self.shape { board_shape::NUMBERS } else { 0 }
    }

    /// Their names, as `calibration.json` has them.
    pub fn names(&self) -> Vec<String> {
        let mut names = Vec::with_capacity(self.count());
        for side in Side::BOTH {
            names.extend(CAMERA_NAMES[..self.camera_count(side)].iter().map(|n| format!("{}.{n}", side.name())));
        }
        if self.transform {
            names.extend(TRANSFORM_NAMES.map(|n| format!("right_from_left.{n}")));
        }
        if self.shape {
            names.extend(board_shape::NAMES.map(str::to_owned));
        }
        names
    }

    /// Their values, in the same order; `right_from_left` as rotation vector and translation.
    pub fn numbers(&self, shared: &Shared) -> Vec<f64> {
        let mut numbers = Vec::with_capacity(self.count());
        for side in Side::BOTH {
            numbers.extend(shared.rig.camera(side).numbers().take(self.camera_count(side)));
        }
        if self.transform {
            numbers.extend(crate::geometry::rotation_vector(&shared.rig.right_from_left).iter());
            numbers.extend(shared.rig.right_from_left.translation.vector.iter());
        }
        if self.shape {
            numbers.extend(shared.shape_mm);
        }
        numbers
    }

    /// The step from one to the other, in the coordinates of the covariance.
    pub fn between(&self, from: &Shared, to: &Shared) -> DVector<f64> {
        let (from_numbers, to_numbers) = (self.numbers(from), self.numbers(to));
        let mut step =
            DVector::from_iterator(self.count(), to_numbers.iter().zip(&from_numbers).map(|(to, from)| to - from));
        if self.transform {
            // A rotation's covariance is that of the small turn on its left.
            let turn = to.rig.right_from_left.rotation * from.rig.right_from_left.rotation.inverse();
            step.rows_mut(self.transform_start(), 3).copy_from(&turn.scaled_axis());
        }
        step
    }

    /// Applies a step; `step` is as long as [`Layout::count`].
    pub fn step(&self, shared: &Shared, step: &[f64]) -> Shared {
        let mut next = shared.clone();
        for side in Side::BOTH {
            let start = self.camera_start(side);
            next.rig.camera_mut(side).add(&step[start..start + self.camera_count(side)]);
        }
        if self.transform {
            next.rig.right_from_left = perturb(&next.rig.right_from_left, &step[self.transform_start()..]);
        }
        if self.shape {
            let s = &step[self.shape_start()..];
            next.shape_mm.iter_mut().zip(s).for_each(|(height, change)| *height += change);
        }
        next
    }
}
