//! Which pairs belong to the same rig.
//!
//! In: a pair and a rig that most pairs agree on. Out: the pair's residual on the common rig, and the limit for it by what the
//! pictures leave one by one. What is wrong with a pair beyond the limit is a matter for [`crate::stereo::pairs::diagnosis`].

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::data::residuals::median_px;
use crate::stereo::data::view::View;
use crate::stereo::init::board_pose;
use crate::stereo::model::parameters::Shared;
use crate::stereo::solve::robust_loss::{CAUCHY_WIDTH, Loss};

/// A pair is out when its corners lie this many times farther off on the common rig than in each picture alone...
const FACTOR: f64 = 4.0;
/// ... and farther than this: smaller contradictions are an uncertainty to be reported, not a wrong pair.
const LEAST_PX: f64 = 0.3;

/// Whatever single pictures leave, a rig that misses the corners by more than this share of the picture's width measures nothing:
/// pictures in motion, out of focus, or of another board fit badly one by one, too.
const LARGEST_SHARE: f64 = 1e-3;

/// Small pictures with much noise leave more than that share; a rig that fits them leaves no more than single pictures do, or little.
const NOISE_FACTOR: f64 = 2.0;

/// The larger of both pictures' median residuals of a pair on a rig, px, with the pose that makes it least.
pub fn misfit_px(shared: &Shared, view: &View) -> Option<(f64, Transform)> {
    let fit = board_pose::fit(shared, view, Loss::Cauchy(CAUCHY_WIDTH))?;
    Some((worse_median_px(shared, &fit.left_from_board, view)?, fit.left_from_board))
}

/// The larger of both pictures' median residuals at a pose, px.
pub fn worse_median_px(shared: &Shared, left_from_board: &Transform, view: &View) -> Option<f64> {
    let both = Side::BOTH.map(|side| median_px(shared, left_from_board, view, side));
    Some(both[0]?.max(both[1]?))
}

/// What pictures of this rig usually leave one by one, and how wide they are: what a pair's residual is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Usual {
    /// Median over the pictures, px.
    pub px: f64,
    /// Width of the wider picture, px.
    pub width_px: u32,
}

impl Usual {
    /// The limit above which a pair does not belong; `alone_px` is what its pictures leave one by one.
    pub fn limit_px(&self, alone_px: f64) -> f64 {
        let usual = FACTOR * alone_px.min(2.0 * self.px).max(self.px);
        usual.max(LEAST_PX).min((LARGEST_SHARE * f64::from(self.width_px)).max(NOISE_FACTOR * self.px))
    }
}
