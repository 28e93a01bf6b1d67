//! The pose of a board on a rig that is known, and how far its pair misses that rig.
//!
//! In: a rig and the corners of a pair. Out: `left_from_board`. Method: start from each picture's homography of undistorted rays,
//! then a bundle of the pose alone over both pictures; the better end wins. Goes wrong: too few corners, corners on a line.

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::data::View;
use crate::stereo::data::residuals::median_px;
use crate::stereo::init::homography::{homography, pose};
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::solve::levenberg_marquardt::{self, Search};
use crate::stereo::solve::{Loss, Priors};

/// Fits the pose to the view's active corners, of which those far off hardly count, to about a tenth of a standard deviation. `None` where they do
/// not determine it.
pub fn fit(shared: &Shared, view: &View) -> Option<Transform> {
    Some(best(shared, view, Loss::Cauchy)?.0)
}

/// Half the sum of squares of the whitened residuals at the pose that makes it least.
pub fn least_cost(shared: &Shared, view: &View) -> Option<f64> {
    Some(best(shared, view, Loss::Squared)?.1)
}

/// The poses that each of a pair's pictures gives the board alone, as `left_from_board`.
pub fn of_each_alone(shared: &Shared, view: &View) -> [Option<Transform>; 2] {
    Side::BOTH.map(|side| fit(shared, &view.only(side)))
}

/// The larger of both pictures' median residuals of a pair on a rig, px, with the pose that makes it least; of the one picture's that shows the
/// board where only one does. `None` where the pair has no pose on it.
pub fn misfit_px(shared: &Shared, view: &View) -> Option<(f64, Transform)> {
    let left_from_board = fit(shared, view)?;
    let sides = Side::BOTH.into_iter().filter(|side| view.active(*side).next().is_some());
    let px = sides.map(|side| median_px(shared, &left_from_board, view, side)).collect::<Option<Vec<f64>>>()?;
    Some((px.into_iter().reduce(f64::max)?, left_from_board))
}

/// Whether a pair misses a rig by no more than a limit.
pub fn fits_within(shared: &Shared, view: &View, limit_px: f64) -> bool {
    misfit_px(shared, view).is_some_and(|(px, _)| px <= limit_px)
}

/// Fits a pose that is known with other weights, to about a tenth of a standard deviation.
pub fn refit(shared: &Shared, view: &View, known: Transform) -> Option<Transform> {
    Some(search(shared, view, known, Loss::Cauchy, Search::ROUGH)?.0)
}

/// The pose of a pair on a rig that hardly differs from one on which the pose is known.
pub fn follow(shared: &Shared, view: &View, known: Transform) -> Option<Transform> {
    Some(search(shared, view, known, Loss::Squared, Search::TRIAL)?.0)
}

fn best(shared: &Shared, view: &View, loss: Loss) -> Option<(Transform, f64)> {
    Side::BOTH
        .into_iter()
        .filter_map(|side| of_picture(shared, view, side))
        .filter_map(|start| search(shared, view, start, loss, Search::ROUGH))
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The pose at the minimum, and half the robust sum of squares there.
fn search(shared: &Shared, view: &View, start: Transform, loss: Loss, search: Search) -> Option<(Transform, f64)> {
    let (views, values) = (std::slice::from_ref(view), Values { shared: shared.clone(), poses: vec![start] });
    let found = levenberg_marquardt::solve(views, &Layout::POSES_ONLY, &Priors::NONE, values, loss, search);
    Some((*found.values.poses.first()?, found.cost)).filter(|(_, cost)| cost.is_finite())
}

/// `left_from_board` as one picture alone shows it, from the homography of its undistorted rays. `None` where its corners give none.
pub fn of_picture(shared: &Shared, view: &View, side: Side) -> Option<Transform> {
    let camera = shared.rig.camera(side);
    let points = view.active(side).filter_map(|o| Some((o.board_mm, camera.undistort(&o.px)?)));
    let camera_from_board = pose(&homography(points)?.0)?;
    Some(match side {
        Side::Left => camera_from_board,
        Side::Right => shared.rig.right_from_left.inverse() * camera_from_board,
    })
}
