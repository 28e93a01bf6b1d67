//! How far a pair misses a rig.

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::data::residuals::median_px;
use crate::stereo::data::view::View;
use crate::stereo::init::board_pose;
use crate::stereo::model::parameters::Shared;
use crate::stereo::solve::robust_loss::{CAUCHY_WIDTH, Loss};

/// The larger of both pictures' median residuals of a pair on a rig, px, with the pose that makes it least. `None` where the pair has no
/// pose on it.
pub fn misfit_px(shared: &Shared, view: &View) -> Option<(f64, Transform)> {
    let fit = board_pose::fit(shared, view, Loss::Cauchy(CAUCHY_WIDTH))?;
    let both = Side::BOTH.map(|side| median_px(shared, &fit.left_from_board, view, side));
    Some((both[0]?.max(both[1]?), fit.left_from_board))
}
