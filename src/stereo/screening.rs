//! Which pairs belong to the same rig, and what is wrong with the others.
//!
//! In: views with each picture's own fit, and a rig that most pairs agree on. Out: for each pair its residual on the common rig and,
//! where it does not belong, what it looks like. A pair whose pictures fit a board one by one and not together was not taken at
//! once (or the rig moved); one that fits after a half turn was ordered wrongly; one that fits no board at all was misread.

use super::layout::Shared;
use super::observations::{Side, View};
use super::pose;
use super::residuals::residual_px;
use super::robust::Loss;
use super::start::CAUCHY_WIDTH;
use crate::geometry::Transform;
use crate::imaging::Board;

/// A pair is out when its corners lie this many times farther off on the common rig than in each picture alone...
const FACTOR: f64 = 4.0;
/// ... and farther than this: smaller contradictions are an uncertainty to be reported, not a wrong pair.
const LEAST_PX: f64 = 0.3;

/// What a pair that does not belong looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Look {
    /// The corners of one picture are no flat board: misread, in a wrong order, or blurred.
    Misread(Side),
    /// Fits when the right board is turned by 180 degrees.
    Turned,
    /// Each picture fits a board, but not the same one: not taken at the same time, or a camera moved.
    NotSimultaneous,
}

impl Look {
    /// The words for a person.
    pub fn describe(self) -> &'static str {
        match self {
            Look::Misread(Side::Left) => "the left corners do not form a board: misread, wrong order, or blurred",
            Look::Misread(Side::Right) => "the right corners do not form a board: misread, wrong order, or blurred",
            Look::Turned => "the board is turned by 180 degrees between left and right",
            Look::NotSimultaneous => {
                "each picture fits a board, but not the same one: not taken at the same time, or a camera moved"
            }
        }
    }
}

/// Median length of one picture's residuals, px.
pub fn median_px(shared: &Shared, left_from_board: &Transform, view: &View, side: Side) -> Option<f64> {
    let mut all = view
        .active(side)
        .map(|o| residual_px(shared, left_from_board, o).map(|r| r.norm()))
        .collect::<Option<Vec<f64>>>()?;
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// The larger of both pictures' median residuals of a pair on a rig, px, with the pose that makes it least.
pub fn misfit_px(shared: &Shared, view: &View) -> Option<(f64, Transform)> {
    let fit = pose::fit(shared, view, Loss::Cauchy(CAUCHY_WIDTH))?;
    let both = Side::BOTH.map(|side| median_px(shared, &fit.left_from_board, view, side));
    Some((both[0]?.max(both[1]?), fit.left_from_board))
}

/// The limit above which a pair does not belong: `alone_px` is what its pictures leave one by one, `usual_px` what those of
/// most pairs leave.
pub fn limit_px(alone_px: f64, usual_px: f64) -> f64 {
    (FACTOR * alone_px.max(usual_px)).max(LEAST_PX)
}

/// What is wrong with a pair that does not belong. `alone_px` are its pictures' residuals one by one, left and right.
pub fn look(shared: &Shared, board: &Board, view: &View, alone_px: [Option<f64>; 2], usual_px: f64) -> Look {
    for (side, alone) in Side::BOTH.into_iter().zip(alone_px) {
        if alone.is_none_or(|px| px > limit_px(0.0, usual_px)) {
            return Look::Misread(side);
        }
    }
    let mut turned = view.clone();
    turned.turn_right(board);
    match misfit_px(shared, &turned) {
        Some((px, _)) if px <= limit_px(0.0, usual_px) => Look::Turned,
        _ => Look::NotSimultaneous,
    }
}
