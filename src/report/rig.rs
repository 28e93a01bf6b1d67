//! The cameras and what they saw, in space.

use nalgebra::{Point2, Point3};

use super::drawing::scene::{Ink, Scene};
use crate::geometry::Transform;
use crate::imaging::Board;
use crate::stereo::volume::Volume;
use crate::stereo::{Camera, Rig};

/// Both cameras as pyramids of this depth, mm, in the left camera's frame.
pub fn cameras(scene: &mut Scene, rig: &Rig, depth_mm: f64) {
    let left_from_right = rig.right_from_left.inverse();
    for (name, camera, left_from_camera) in
        [("left", &rig.left, Transform::identity()), ("right", &rig.right, left_from_right)]
    {
        let tip = left_from_camera * Point3::origin();
        let (right, bottom) = (f64::from(camera.width) - 0.5, f64::from(camera.height) - 0.5);
        let corners = [[-0.5, -0.5], [right, -0.5], [right, bottom], [-0.5, bottom]];
        let rays = rays(camera, &corners).into_iter();
        let corners: Vec<Point3<f64>> = rays.map(|ray| left_from_camera * (ray * depth_mm)).collect();
        let ring: Vec<Point3<f64>> = corners.iter().copied().chain(corners.first().copied()).collect();
        scene.line(Ink::Frame, ring);
        for corner in corners {
            scene.line(Ink::Frame, vec![tip, corner]);
        }
        scene.word(tip, name);
    }
}

/// Rays through places of a picture, at depth one.
fn rays(camera: &Camera, px: &[[f64; 2]]) -> Vec<Point3<f64>> {
    let rays = px.iter().filter_map(|[x, y]| camera.undistort(&Point2::new(*x, *y)));
    rays.map(|ray| Point3::new(ray.x, ray.y, 1.0)).collect()
}

/// Where a verdict holds: the outline of the corners in the left picture at the nearest and at the farthest depth.
pub fn volume(scene: &mut Scene, left: &Camera, volume: &Volume) {
    /// Lines that join the two outlines.
    const JOINING: usize = 8;
    let outline: Vec<[f64; 2]> = volume.left_px.clone().into();
    let rays = rays(left, &outline);
    let [near, far] = volume.depth_mm;
    for depth in [near, far] {
        scene.line(Ink::Frame, rays.iter().chain(rays.first()).map(|ray| ray * depth).collect());
    }
    for ray in rays.iter().step_by(rays.len().div_ceil(JOINING).max(1)) {
        scene.line(Ink::Frame, vec![ray * near, ray * far]);
    }
}

/// A board's outermost corners as a rectangle.
pub fn board(scene: &mut Scene, ink: Ink, board: &Board, left_from_board: &Transform) {
    let (last_col, last_row) = (board.columns() - 1, board.rows() - 1);
    let ring = [(0, 0), (last_col, 0), (last_col, last_row), (0, last_row), (0, 0)];
    scene.line(ink, ring.map(|(col, row)| left_from_board * board.corner_mm(col, row)).to_vec());
}
