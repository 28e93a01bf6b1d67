//! The pose of a board on a rig that is known.
//!
//! In: a rig and the corners of a pair. Out: `left_from_board`. Method: start from each picture's homography of undistorted rays,
//! then a bundle of the pose alone over both pictures; the better end wins. Goes wrong: too few corners, corners on a line.

use nalgebra::Point2;

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::stereo::Camera;
use crate::stereo::data::observation::Observation;
use crate::stereo::data::view::View;
use crate::stereo::init::homography::{homography, pose};
use crate::stereo::model::parameters::{Layout, Shared, Values};
use crate::stereo::solve::levenberg_marquardt::{self, Search};
use crate::stereo::solve::robust_loss::Loss;

/// A board's pose and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseFit {
    pub left_from_board: Transform,
    /// Half the robust sum of squares of the whitened residuals.
    pub cost: f64,
}

/// Fits the pose to the view's active corners, to about a tenth of a standard deviation. `None` where they do not determine it.
pub fn fit(shared: &Shared, view: &View, loss: Loss) -> Option<PoseFit> {
    Side::BOTH
        .into_iter()
        .filter_map(|side| of_picture(shared, view, side))
        .filter_map(|start| search(shared, view, start, loss, Search::ROUGH))
        .min_by(|a, b| a.cost.total_cmp(&b.cost))
}

/// Fits a pose that is known with other weights, to about a tenth of a standard deviation.
pub fn refit(shared: &Shared, view: &View, known: Transform, loss: Loss) -> Option<PoseFit> {
    search(shared, view, known, loss, Search::ROUGH)
}

/// The pose of a pair on a rig that hardly differs from one on which the pose is known.
pub fn follow(shared: &Shared, view: &View, known: Transform) -> Option<PoseFit> {
    search(shared, view, known, Loss::Squared, Search::TRIAL)
}

fn search(shared: &Shared, view: &View, start: Transform, loss: Loss, search: Search) -> Option<PoseFit> {
    let values = Values { shared: shared.clone(), poses: vec![start] };
    let solution = levenberg_marquardt::solve(std::slice::from_ref(view), &Layout::POSES_ONLY, values, loss, search);
    let left_from_board = *solution.values.poses.first()?;
    solution.cost.is_finite().then_some(PoseFit { left_from_board, cost: solution.cost })
}

/// `left_from_board` as one picture alone shows it, from the homography of its undistorted rays. `None` where its corners give none.
pub fn of_picture(shared: &Shared, view: &View, side: Side) -> Option<Transform> {
    let camera = shared.rig.camera(side);
    let points: Vec<_> = view.active(side).filter_map(|o| Some((o.board_mm, ray(camera, o)?))).collect();
    let camera_from_board = pose(&homography(&points)?.0)?;
    Some(match side {
        Side::Left => camera_from_board,
        Side::Right => shared.rig.right_from_left.inverse() * camera_from_board,
    })
}

fn ray(camera: &Camera, o: &Observation) -> Option<Point2<f64>> {
    camera.undistort(&o.px)
}
