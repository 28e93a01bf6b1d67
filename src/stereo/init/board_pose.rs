//! The pose of a board on a rig that is known, and how far its pair misses that rig.
//!
//! In: a rig and the corners of a pair. Out: `left_from_board`. Method: start from each picture's homography of
//! undistorted rays, then a bundle of the pose alone over both pictures; the better end wins. Goes wrong: too few
//! corners, corners on a line.

use nalgebra::{DVector, Matrix2};

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::data::View;
use crate::stereo::data::residuals::median_px;
use crate::stereo::init::homography::{homography, pose};
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::solve::levenberg_marquardt::{self, Search};
use crate::stereo::solve::{Loss, Priors};

/// What misses by less is exact: simulated corners without noise.
const LEAST_PX: f64 = 1e-4;

/// Fits the pose to the view's active corners, of which those far off hardly count, to about a tenth of a standard
/// deviation. `None` where they do not determine it.
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

/// The larger of both pictures' median residuals of a pair on a rig, px, with the pose that makes it least; of the one
/// picture's that shows the board where only one does. `None` where the pair has no pose on it.
pub fn misfit_px(shared: &Shared, view: &View) -> Option<(f64, Transform)> {
    let left_from_board = fit(shared, view)?;
    Some((worse_px(shared, view, &[left_from_board; 2], [1.0; 2])?, left_from_board))
}

/// How many times what each camera leaves of its own pictures, `alone_px`, a pair misses a rig by: the larger of both
/// pictures'. Cameras of unlike size leave unlike px, so that each counts in its own. `poses` are those of
/// [`as_one_board`] or [`as_two_boards`]. `None` where it has none.
pub fn times_alone(
    shared: &Shared,
    view: &View,
    alone_px: [f64; 2],
    poses: impl Fn(&Shared, &View) -> Option<[Transform; 2]>,
) -> Option<f64> {
    let unit_px = alone_px.map(|px| px.max(LEAST_PX));
    let largest_px = unit_px[0].max(unit_px[1]);
    let mut view = view.clone();
    for o in &mut view.observations {
        o.whitener = Matrix2::identity() * (largest_px / unit_px[o.side as usize]);
    }
    worse_px(shared, &view, &poses(shared, &view)?, unit_px)
}

/// The pose of the board for the left and the right picture of a pair of which both show one board.
pub fn as_one_board(shared: &Shared, view: &View) -> Option<[Transform; 2]> {
    Some([fit(shared, view)?; 2])
}

/// The same where something moved between the two pictures, so that each has its own.
pub fn as_two_boards(shared: &Shared, view: &View) -> Option<[Transform; 2]> {
    let [left, right] = of_each_alone(shared, view);
    Some([left.or(right)?, right.or(left)?])
}

/// The larger of both pictures' median residuals in these units, px, with a pose of the board for each.
fn worse_px(shared: &Shared, view: &View, poses: &[Transform; 2], unit_px: [f64; 2]) -> Option<f64> {
    let sides = Side::BOTH.into_iter().filter(|side| view.active(*side).next().is_some());
    let of = |side: Side| Some(median_px(shared, &poses[side as usize], view, side)? / unit_px[side as usize]);
    sides.map(of).collect::<Option<Vec<f64>>>()?.into_iter().reduce(f64::max)
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

/// Moves the shared numbers by a step, and the boards with them.
pub fn move_shared(values: &mut Values, views: &[View], layout: &Layout, step: &DVector<f64>) {
    values.shared = layout.step(&values.shared, step.as_slice());
    for (pose, view) in values.poses.iter_mut().zip(views) {
        *pose = follow(&values.shared, view, *pose).unwrap_or(*pose);
    }
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

/// `left_from_board` as one picture alone shows it, from the homography of its undistorted rays. `None` where its
/// corners give none.
pub fn of_picture(shared: &Shared, view: &View, side: Side) -> Option<Transform> {
    let camera = shared.rig.camera(side);
    let points = view.active(side).filter_map(|o| Some((o.board_mm, camera.undistort(&o.px)?)));
    let camera_from_board = pose(&homography(points)?.0)?;
    Some(match side {
        Side::Left => camera_from_board,
        Side::Right => shared.rig.right_from_left.inverse() * camera_from_board,
    })
}
