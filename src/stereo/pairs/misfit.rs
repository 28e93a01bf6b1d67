//! How far a pair misses a rig.

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::data::residuals::median_px;
use crate::stereo::data::view::View;
use crate::stereo::init::board_pose;
use crate::stereo::model::parameters::Shared;
use crate::stereo::solve::robust_loss::{CAUCHY_WIDTH, Loss};

/// The larger of both pictures' median residuals of a pair on a rig, px, with the pose that makes it least; of the one picture's that shows the
/// board where only one does. `None` where the pair has no pose on it.
pub fn misfit_px(shared: &Shared, view: &View) -> Option<(f64, Transform)> {
    let fit = board_pose::fit(shared, view, Loss::Cauchy(CAUCHY_WIDTH))?;
    let mut largest_px = None;
    for side in Side::BOTH.into_iter().filter(|side| view.active(*side).next().is_some()) {
        let px = median_px(shared, &fit.left_from_board, view, side)?;
        largest_px = Some(largest_px.map_or(px, |largest: f64| largest.max(px)));
    }
    Some((largest_px?, fit.left_from_board))
}
