//! How far the pairs of a calibration scatter about its rig: what pictures of this rig do.
//!
//! In: a calibration. Out: how many times more than its corners' scatter allows the usual pair disagrees with the common rig, as a variance; what
//! [`crate::stereo::board_pose::series`] finds of a run is compared with it. Pictures that were triggered have one, those of a board that is held by
//! hand more. Method: Rao's score of a change of `right_from_left` at each pair, as for the poses of a run.

use nalgebra::{DMatrix, Vector3};

use crate::stereo::board_pose::rig_change::consistency::{of_outsider, usual_excess};
use crate::stereo::board_pose::solve::pose_block::{PoseBlock, SeenFrom, crossings};
use crate::stereo::calibrate::Calibration;
use crate::stereo::model::board_shape::lift;
use crate::stereo::solve::robust_loss::Loss;
use crate::stereo::triangulate::RIG_NUMBERS;

/// Two standard deviations of the excess of one pair that chance alone makes, as the median of many has it.
const CHANCE: f64 = 1.5;

/// Finds it; one where it is not beyond chance.
pub fn pair_excess(calibration: &Calibration) -> f64 {
    let (board, shared) = (&calibration.board, &calibration.values.shared);
    let height = |l: &[f64]| Vector3::new(0.0, 0.0, l.iter().zip(&shared.shape_mm).map(|(l, s)| l * s).sum());
    let heights: Vec<Vector3<f64>> = board.corners_mm().map(|at| height(&lift(board, &at))).collect();
    let places = crossings(board, &heights);
    // What pairs share is held.
    let (basis, none) = (DMatrix::zeros(RIG_NUMBERS, 0), DMatrix::zeros(3 * places.len(), 3 * places.len()));
    let pairs = calibration.views.iter().zip(&calibration.values.poses);
    let each = pairs.map(|(view, pose)| {
        let seen = SeenFrom { rig: &shared.rig, crossings: &places, board, pose, view };
        of_outsider(&PoseBlock::of(&seen, Loss::Squared)?.eliminate(&basis)?, &none)
    });
    let each: Vec<_> = each.collect();
    let chance = 1.0 + CHANCE / (each.iter().flatten().count().max(1) as f64).sqrt();
    Some(usual_excess(&each)).filter(|excess| *excess > chance).unwrap_or(1.0)
}
