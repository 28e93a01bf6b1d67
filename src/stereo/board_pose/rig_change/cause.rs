//! What may have happened to the rig or to the target's description, one number each, and how well each explains the
//! poses.
//!
//! In: the common minimum. Out: for every cause its amount and the fall of chi-square it would bring. The rig's causes
//! are physical: the right camera turns about its own centre or is pushed, a lens is refocused. A longer baseline and
//! smaller squares explain the same: pictures have no scale of their own, so both are named.

use std::ops::AddAssign;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::geometry::nearest_rotation;
use crate::imaging::Board;
use crate::stereo::Rig;
use crate::stereo::board_pose::rig_change::consistency::shares_that_grow;
use crate::stereo::board_pose::solve::bundle::Bundle;
use crate::stereo::board_pose::solve::estimate::Estimate;
use crate::stereo::board_pose::solve::pose_block::PoseBlock;
use crate::stereo::board_pose::solve::prior::{stretch_length_mm, stretch_mode};
use crate::stereo::data::observation::Side;
use crate::stereo::findings::hypothesis::{moved, refocused, turned};
use crate::stereo::model::Layout;
use crate::stereo::solve::Loss;

/// One thing that may have changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// The right camera turned about its own axis x (pitch), y (yaw) or z (roll); the amount is in rad.
    Turn(usize),
    /// The right camera was pushed along its own x, y or z; mm.
    Shift(usize),
    /// A focal length; relative.
    Focal(Side),
    /// Both focal lengths by the same share; relative.
    BothFocal,
    /// The target's squares are not as long as said; relative.
    Pitch,
}

impl Cause {
    pub const ALL: [Cause; 10] = [
        Cause::Turn(0),
        Cause::Turn(1),
        Cause::Turn(2),
        Cause::Shift(0),
        Cause::Shift(1),
        Cause::Shift(2),
        Cause::Focal(Side::Left),
        Cause::Focal(Side::Right),
        Cause::BothFocal,
        Cause::Pitch,
    ];

    /// The change of the rig's numbers by one unit; `None` for the target's pitch.
    pub(in crate::stereo::board_pose) fn direction(self, rig: &Rig) -> Option<DVector<f64>> {
        let layout = &Layout::WHOLE_RIG;
        let along = |axis: usize| Vector3::ith(axis, 1.0);
        match self {
            Cause::Pitch => None,
            Cause::Focal(side) => Some(refocused(layout, rig, &[side], 1.0)),
            Cause::BothFocal => Some(refocused(layout, rig, &Side::BOTH, 1.0)),
            Cause::Shift(axis) => Some(moved(layout, along(axis))),
            Cause::Turn(axis) => Some(turned(layout, rig, along(axis))),
        }
    }

    /// Unit of its amount; a share has none.
    pub fn unit(self) -> &'static str {
        match self {
            Cause::Turn(_) => "rad",
            Cause::Shift(_) => "mm",
            Cause::Focal(_) | Cause::BothFocal | Cause::Pitch => "1",
        }
    }

    /// In words, with its amount.
    pub fn describe(self, amount: f64, rig: &Rig, board: &Board) -> String {
        const AXES: [&str; 3] = ["x", "y", "z"];
        let percent = 100.0 * amount;
        match self {
            Cause::Turn(axis) => {
                let kind = ["pitch", "yaw", "roll"][axis];
                format!(
                    "the right camera turned by {:.4} deg about its {} axis ({kind}) against the left",
                    amount.to_degrees(),
                    AXES[axis]
                )
            }
            Cause::Shift(axis) => {
                let t = rig.right_from_left.translation.vector;
                let mut moved = t;
                moved[axis] += amount;
                format!(
                    "the right camera moved by {amount:.4} mm along its {} axis (baseline {:.3} mm instead of {:.3})",
                    AXES[axis],
                    moved.norm(),
                    t.norm()
                )
            }
            Cause::Focal(side) => format!("the {} camera's focal length changed by {percent:.3} %", side.name()),
            Cause::BothFocal => format!("both focal lengths changed by {percent:.3} %"),
            Cause::Pitch => {
                let [width, height] = board.scaled(1.0 + amount).sides_mm();
                let seen = if width == height { format!("{width:.4}") } else { format!("{width:.4}x{height:.4}") };
                format!("the target's {} are {seen} mm, not {} mm, on this rig", board.unit(), board.side_said())
            }
        }
    }
}

/// How a cause would explain what is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Explanation {
    pub cause: Cause,
    /// By how much: rad, mm, or a share.
    pub amount: f64,
    pub sigma: f64,
    /// By how much chi-square falls with it.
    pub fall: f64,
    /// True where it grows from the first pose to the last, up to this amount, false where all poses have it.
    pub grows: bool,
}

impl Explanation {
    pub fn describe(&self, rig: &Rig, board: &Board) -> String {
        let words = self.cause.describe(self.amount, rig, board);
        if self.grows { format!("{words}, little by little from the first pose to the last") } else { words }
    }
}

/// Every cause at the common minimum, by its score.
pub(in crate::stereo::board_pose) fn explanations(found: &Estimate<'_>) -> Vec<Explanation> {
    let rig = found.bundle.rig.rig_at(&found.values.rig);
    let explanation = |cause: Cause| match cause.direction(&rig) {
        Some(direction) => of_rig(found, cause, &direction),
        None => of_pitch(found),
    };
    Cause::ALL.into_iter().filter_map(explanation).collect()
}

fn of_rig(found: &Estimate<'_>, cause: Cause, direction: &DVector<f64>) -> Option<Explanation> {
    let normal = &found.normal;
    let shared = normal.told.rig_shared.tr_mul(direction);
    let own = direction.dot(&(&normal.told.rig * direction));
    let curvature = own - shared.dot(&(&found.covariance * &shared));
    let gradient = direction.dot(&normal.told.rig_gradient);
    of_sums(cause, own, curvature, gradient, false)
}

fn of_sums(cause: Cause, own: f64, curvature: f64, gradient: f64, grows: bool) -> Option<Explanation> {
    // What nothing tells apart from the poses or from what was unknown before leaves only rounding.
    (curvature > 1e-9 * own).then(|| Explanation {
        cause,
        amount: -gradient / curvature,
        sigma: 1.0 / curvature.sqrt(),
        fall: gradient * gradient / curvature,
        grows,
    })
}

/// The rig's causes as changes that grow evenly from the first pose to the last.
pub(in crate::stereo::board_pose) fn growing(found: &Estimate<'_>) -> Option<Vec<Explanation>> {
    let scene = found.bundle.scene(&found.values);
    let (causes, directions): (Vec<Cause>, Vec<DVector<f64>>) =
        Cause::ALL.into_iter().filter_map(|cause| Some((cause, cause.direction(&scene.rig)?))).unzip();
    let directions = DMatrix::from_columns(&directions).transpose();
    let (all, n) = (causes.len(), found.values.rig.len());
    let (mut own, mut gradient) = (DMatrix::zeros(all, all), DVector::zeros(all));
    let mut shared = DMatrix::zeros(all, found.covariance.nrows());
    for (i, share) in shares_that_grow(&found.normal)?.into_iter().enumerate() {
        let (Some(part), Some(pose)) = (&found.normal.poses[i], &found.values.poses[i]) else { continue };
        let sums = PoseBlock::of(&scene, pose, &found.bundle.views[i], Loss::Squared)?.shared;
        let (by_rig, by_pose) = (&directions * sums.rig(), &directions * part.rig_mixed);
        let through = &by_pose * part.pose_inverse;
        own += (&by_rig * directions.transpose() - &through * by_pose.transpose()) * (share * share);
        gradient += (&directions * sums.rig_gradient - &through * part.pose_gradient) * share;
        let mut by_shared = -(&through * part.mixed.transpose());
        by_shared.columns_mut(0, n).add_assign(&(&by_rig * &found.bundle.rig.basis));
        for (k, crossing) in sums.crossings.iter().enumerate() {
            by_shared.columns_mut(n + 3 * k, 3).add_assign(&(&directions * crossing.rig));
        }
        shared += by_shared * share;
    }
    let curvature = &own - &shared * &found.covariance * shared.transpose();
    let of = |(k, cause)| of_sums(cause, own[(k, k)], curvature[(k, k)], gradient[k], true);
    Some(causes.into_iter().enumerate().filter_map(of).collect())
}

fn of_pitch(found: &Estimate<'_>) -> Option<Explanation> {
    let [amount, sigma] = stretch(found);
    let before = (found.bundle.shape.stretch_mm / stretch_length_mm(found.bundle.board)).powi(2);
    let told = before - sigma * sigma;
    // With the certificate's word taken away, the amount is what the pictures alone say.
    (told.is_finite() && told > 1e-9 * before).then(|| Explanation {
        cause: Cause::Pitch,
        amount: amount * before / told,
        sigma: sigma * (before / told).sqrt(),
        fall: amount * amount / told,
        grows: false,
    })
}

/// The target's size against the drawing, minus one, and its standard deviation.
pub(in crate::stereo::board_pose) fn stretch(found: &Estimate<'_>) -> [f64; 2] {
    let n = found.values.rig.len();
    let mode = stretch_mode(found.bundle.board);
    let m = mode.len();
    let deviations = Bundle::shared(&found.values).rows(n, m).into_owned();
    let length = stretch_length_mm(found.bundle.board);
    let variance = mode.dot(&(found.covariance.view((n, n), (m, m)) * &mode));
    [mode.dot(&deviations) / length, variance.max(0.0).sqrt() / length]
}

/// By how much the mark point of each pose moves from one minimum to another, mm, but for a turn of all points about
/// the left camera. Where the left camera's axis points is a word of its lens: with an open tilt of the sensor or an
/// open picture centre, all points turn together, and nothing that is measured between them does.
pub(in crate::stereo::board_pose) fn shifts_mm(a: &Estimate<'_>, b: &Estimate<'_>) -> Vec<Option<Vector3<f64>>> {
    let both = a.values.poses.iter().zip(&b.values.poses);
    let points: Vec<_> =
        both.map(|(a, b)| Some((a.as_ref()?.translation.vector, b.as_ref()?.translation.vector))).collect();
    let together = points.iter().flatten().map(|(a, b)| a * b.transpose()).sum();
    let a_from_b = nearest_rotation(&together);
    points.iter().map(|both| both.map(|(a, b)| a_from_b * b - a)).collect()
}

/// The matrix that takes the shared unknowns to the rig's named numbers and the crossings' deviations.
pub(in crate::stereo::board_pose) fn named(found: &Estimate<'_>) -> DMatrix<f64> {
    let rig = &found.bundle.rig;
    let (n, m) = (found.values.rig.len(), 3 * found.values.deviations_mm.len());
    let mut matrix = DMatrix::zeros(rig.places.len() + m, n + m);
    for (row, &place) in rig.places.iter().enumerate() {
        matrix.view_mut((row, 0), (1, n)).copy_from(&rig.basis.row(place));
    }
    for i in 0..m {
        matrix[(rig.places.len() + i, n + i)] = 1.0;
    }
    matrix
}
