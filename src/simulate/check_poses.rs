//! Where the check board is held: tilted every way, near and far, wholly inside both pictures.

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::Error;
use super::draws::{Draws, Purpose};
use super::physical_board::PhysicalBoard;
use super::rig::left_from_field;
use crate::geometry::{Transform, transform};
use crate::stereo::Rig;

/// Tilts out of the plane, deg: below, perspective says little about the focal length; above, squares get too thin.
const TILT_DEG: (f64, f64) = (10.0, 30.0);

/// Turn in the plane, deg, either way. A square board looks the same after a quarter turn, so it stays clear of one.
const TURN_DEG: f64 = 12.0;

/// Range of places round the middle of the field: sideways and in depth, mm.
const SIDEWAYS_MM: f64 = 35.0;
const DEPTH_MM: (f64, f64) = (-30.0, 60.0);

/// Draws before a pose is given up.
const ATTEMPTS: usize = 2000;

/// Clear border that a board keeps to the picture's edge, as a share of its width.
const BORDER: f64 = 0.004;

/// True where the whole plate is inside both pictures.
pub fn seen_by_both(rig: &Rig, board: &PhysicalBoard, left_from_board: &Transform) -> bool {
    let (w, h) = board.plate_half_mm();
    [(-w, -h), (w, -h), (w, h), (-w, h)].iter().all(|&(x, y)| {
        let point = left_from_board * Point3::new(x, y, 0.0);
        let in_right = rig.right_from_left * point;
        if point.z <= 0.0 || in_right.z <= 0.0 {
            return false;
        }
        let (left, right) = rig.project(&point);
        [(left, &rig.left), (right, &rig.right)].iter().all(|(px, camera)| {
            let (width, height) = (f64::from(camera.width), f64::from(camera.height));
            let border = BORDER * width;
            px.x > border && px.x < width - 1.0 - border && px.y > border && px.y < height - 1.0 - border
        })
    })
}

/// `left_from_board` of each pair.
pub fn poses(rig: &Rig, board: &PhysicalBoard, count: usize, seed: u64) -> Result<Vec<Transform>, Error> {
    (0..count).map(|k| pose(rig, board, k, seed)).collect()
}

fn pose(rig: &Rig, board: &PhysicalBoard, k: usize, seed: u64) -> Result<Transform, Error> {
    let mut draws = Draws::new(seed, Purpose::CheckPoses, k as u64);
    // Directions of tilt a golden angle apart leave no side out, however many pairs there are.
    let about = k as f64 * 2.399_963 + draws.uniform(-0.3, 0.3);
    for attempt in 0..ATTEMPTS {
        // A board that fills the picture has little room: later attempts stay nearer to the middle.
        let room = 1.0 - attempt as f64 / ATTEMPTS as f64;
        let tilt = draws.uniform(TILT_DEG.0, TILT_DEG.1).to_radians();
        let turn = draws.uniform(-TURN_DEG, TURN_DEG).to_radians();
        let place = Vector3::new(
            room * draws.uniform(-SIDEWAYS_MM, SIDEWAYS_MM),
            room * draws.uniform(-SIDEWAYS_MM, SIDEWAYS_MM),
            draws.uniform(DEPTH_MM.0, DEPTH_MM.1),
        );
        let tilted = UnitQuaternion::from_scaled_axis(Vector3::new(about.cos(), about.sin(), 0.0) * tilt);
        let field_from_board =
            transform((tilted * UnitQuaternion::from_scaled_axis(Vector3::z() * turn)).scaled_axis(), place);
        let left_from_board = left_from_field() * field_from_board;
        if seen_by_both(rig, board, &left_from_board) {
            return Ok(left_from_board);
        }
    }
    Err(Error::BoardTooLarge { squares: board.drawing.squares.to_string(), square_mm: board.drawing.square_mm })
}
