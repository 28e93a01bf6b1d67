//! How far the pairs of a calibration scatter about its rig: what pictures of this rig do.
//!
//! In: a calibration. Out: how many times more than its corners' scatter allows the usual pair disagrees with the common rig, as a variance; what
//! [`crate::stereo::board_pose::series`] finds of a run is compared with it. Pictures that were triggered have one, those of a board that is held by
//! hand more. Method: Rao's score of a change of `right_from_left` at each pair, as for the poses of a run.

use nalgebra::DMatrix;

use crate::stereo::board_pose::print_share::{rig_basis, totals_of_pairs};
use crate::stereo::board_pose::rig_change::consistency::{Change, of_member, of_usual};
use crate::stereo::calibrate::Calibration;
use crate::stereo::solve::uncertainty::invert;

/// Two standard deviations of the excess of one pair that chance alone makes, as the median of many has it.
const CHANCE: f64 = 1.5;

/// Finds it; one where it is not beyond chance.
pub fn pair_excess(calibration: &Calibration) -> f64 {
    beyond_chance(&changes(calibration).unwrap_or_default())
}

/// How far the pair disagrees that does most, of those that made the rig: the fall of chi-square by a change at it alone, over the usual excess.
pub fn farthest_pair(calibration: &Calibration) -> Option<f64> {
    let each = changes(calibration)?;
    each.iter().flatten().map(|change| change.fall).max_by(f64::total_cmp).map(|fall| fall / beyond_chance(&each))
}

fn beyond_chance(each: &[Option<Change>]) -> f64 {
    let chance = 1.0 + CHANCE / (each.iter().flatten().count().max(1) as f64).sqrt();
    Some(of_usual(each)).filter(|excess| *excess > chance).unwrap_or(1.0)
}

/// What a change at each pair alone would gain. The rig was fitted to the same pairs, of which few determine it no better than their own
/// change, so that it is free beside the change; the board's shape is held.
fn changes(calibration: &Calibration) -> Option<Vec<Option<Change>>> {
    let Calibration { board, layout, views, values, priors, .. } = calibration;
    let basis = rig_basis(layout);
    let n = basis.ncols();
    let mut parts = Vec::new();
    let totals = totals_of_pairs(views, values, board, &basis, |_, part| parts.push(part))?;
    let known = priors.information(layout, &values.shared).matrix;
    let rig = invert(&(totals.matrix.view((0, 0), (n, n)) + known.view((0, 0), (n, n))))?;
    let size = totals.matrix.nrows();
    let mut covariance = DMatrix::zeros(size, size);
    covariance.view_mut((0, 0), (n, n)).copy_from(&rig);
    Some(parts.iter().map(|part| of_member(part, &covariance)).collect())
}
