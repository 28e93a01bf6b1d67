//! What a rig and its poses leave of the corners.

use nalgebra::{Point3, Vector2};

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::statistics::median;
use crate::stereo::Rig;
use crate::stereo::data::{Observation, View};
use crate::stereo::model::{Shared, Values};

/// Predicted minus seen, px. `None` for a corner behind its camera.
pub fn residual_px(shared: &Shared, left_from_board: &Transform, o: &Observation) -> Option<Vector2<f64>> {
    of_point(&shared.rig, left_from_board * o.board_point(&shared.shape_mm), o)
}

/// The same of a corner at a point in the left camera's frame, mm.
pub fn of_point(rig: &Rig, in_left: Point3<f64>, o: &Observation) -> Option<Vector2<f64>> {
    let (camera, point) = match o.side {
        Side::Left => (&rig.left, in_left),
        Side::Right => (&rig.right, rig.right_from_left * in_left),
    };
    let in_front = point.z > 0.0;
    in_front.then(|| camera.project(&point) - o.px).filter(|r| r.x.is_finite() && r.y.is_finite())
}

/// Residuals of all active corners, in the order of the views. `None` where one lies behind its camera.
pub fn active(views: &[View], values: &Values) -> Option<Vec<(Observation, Vector2<f64>)>> {
    views
        .iter()
        .zip(&values.poses)
        .flat_map(|(view, pose)| view.observations.iter().filter(|o| o.active).map(move |o| (pose, o)))
        .map(|(pose, o)| residual_px(&values.shared, pose, o).map(|r| (*o, r)))
        .collect()
}

/// Residuals (px) of one pair's active corners, where they can be predicted.
pub fn of_view(shared: &Shared, view: &View, pose: &Transform) -> Vec<(Observation, Vector2<f64>)> {
    view.observations.iter().filter(|o| o.active).filter_map(|o| Some((*o, residual_px(shared, pose, o)?))).collect()
}

/// Root mean square of the length of the 2-D residuals of one picture's active corners, px, as OpenCV defines it.
pub fn rms_px(shared: &Shared, left_from_board: &Transform, view: &View, side: Side) -> Option<f64> {
    root_mean_square(of_picture(shared, left_from_board, view, side)?.iter().map(|r| r.norm_squared()))
}

/// Median length of one picture's residuals, px.
pub fn median_px(shared: &Shared, left_from_board: &Transform, view: &View, side: Side) -> Option<f64> {
    median(of_picture(shared, left_from_board, view, side)?.iter().map(|r| r.norm()))
}

fn of_picture(shared: &Shared, left_from_board: &Transform, view: &View, side: Side) -> Option<Vec<Vector2<f64>>> {
    view.active(side).map(|o| residual_px(shared, left_from_board, o)).collect()
}

/// The mean; `None` of nothing.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let values: Vec<f64> = values.into_iter().collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Root of the mean of squares; `None` of nothing.
pub fn root_mean_square(squares: impl IntoIterator<Item = f64>) -> Option<f64> {
    mean(squares).map(f64::sqrt)
}
