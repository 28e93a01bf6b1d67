//! The pairs with the lenses that they give themselves, where they contradict those that were known.
//!
//! In: a calibration with known lenses. Out: the same with lenses of its own. Wrong lenses make pairs miss their rig as
//! pictures of two moments, rows that were read out late or another board do: what else is the matter is asked of the
//! pairs without them. Goes wrong: so few pairs that other lenses take up what has another cause; it shows as soon as
//! the lenses are right.

use crate::statistics::median;
use crate::stereo::calibrate::Calibration;
use crate::stereo::init::{board_pose, single_camera};
use crate::stereo::solve::Priors;
use crate::stereo::{Rig, Side};

/// `None` where no lenses were known, or the pictures agree with them.
pub fn instead_of_contradicted(found: &Calibration) -> Option<Calibration> {
    let check = found.lens_check.as_ref().filter(|check| check.contradicts())?;
    let mut own = found.clone();
    own.priors = Priors::of_rig(&check.rig_without, found.board.diagonal_mm());
    own.known_sides = [false; 2];
    own.values.shared.rig = Rig { covariance: found.rig().covariance.clone(), ..check.rig_without.clone() };
    for (pose, view) in own.values.poses.iter_mut().zip(&own.views) {
        *pose = board_pose::follow(&own.values.shared, view, *pose).unwrap_or(*pose);
    }
    if let Some(values) = own.problem().refit(&own.layout) {
        own.values = values;
    }
    let alone_px = |side| {
        let alone = single_camera::known_camera(&own.views, side, *own.rig().camera(side));
        median(alone.median_px.into_iter().flatten()).unwrap_or(0.0)
    };
    own.alone_px = Side::BOTH.map(alone_px);
    Some(own)
}
