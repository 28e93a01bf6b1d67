//! Where the check board is held: tilted every way, near and far, wholly inside both pictures.

use nalgebra::{UnitQuaternion, Vector3};

use super::Error;
use super::draws::{Draws, Purpose};
use super::physical_board::PhysicalBoard;
use crate::geometry::{Transform, transform};
use crate::imaging::Board;
use crate::stereo::Rig;

/// How boards are held before the cameras.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Holding {
    /// Tilts out of the field's plane, deg.
    pub tilt_deg: (f64, f64),
    /// Turn in the plane, deg, either way.
    pub turn_deg: f64,
    /// A turn that all boards have, deg.
    pub upright_deg: f64,
    /// Range of places round the middle of the field: sideways, mm.
    pub sideways_mm: f64,
    /// In depth, mm.
    pub depth_mm: (f64, f64),
}

impl Holding {
    /// As in the presets. Below 10 degrees perspective says little about the focal length; above 30, squares get too
    /// thin. A square board looks the same after a quarter turn, so it stays clear of one.
    pub const USUAL: Holding = Holding {
        tilt_deg: (10.0, 30.0),
        turn_deg: 12.0,
        upright_deg: 0.0,
        sideways_mm: 35.0,
        depth_mm: (-30.0, 60.0),
    };
}

/// Draws before a pose is given up.
const ATTEMPTS: usize = 2000;

/// Clear border that a board keeps to the picture's edge, as a share of its width.
const BORDER: f64 = 0.004;

/// True where the whole plate is inside both pictures.
pub fn seen_by_both(rig: &Rig, board: &PhysicalBoard, left_from_board: &Transform) -> bool {
    rig.sees_plate(left_from_board, board.plate_half_mm(), BORDER)
}

/// `left_from_board` of each pair, the boards held in a field before a rig; each wholly inside both pictures.
pub fn held(
    rig: &Rig,
    left_from_field: &Transform,
    board: &PhysicalBoard,
    holding: &Holding,
    count: usize,
    seed: u64,
) -> Result<Vec<Transform>, Error> {
    let accept = |left_from_board: &Transform| seen_by_both(rig, board, left_from_board);
    let Board { squares, square_mm, .. } = board.drawing;
    let too_large = || Error::BoardTooLarge { squares: squares.to_string(), square_mm };
    (0..count).map(|k| pose(left_from_field, holding, k, seed, &accept).ok_or_else(too_large)).collect()
}

/// One pose out of the draws, the first that is accepted.
pub fn pose(
    left_from_field: &Transform,
    holding: &Holding,
    k: usize,
    seed: u64,
    accept: &dyn Fn(&Transform) -> bool,
) -> Option<Transform> {
    let mut draws = Draws::new(seed, Purpose::CheckPoses, k as u64);
    // Directions of tilt a golden angle apart leave no side out, however many pairs there are.
    let about = k as f64 * 2.399_963 + draws.uniform(-0.3, 0.3);
    let drawn = |attempt: usize| {
        // A board that fills the picture has little room: later attempts stay nearer to the middle.
        let room = 1.0 - attempt as f64 / ATTEMPTS as f64;
        let tilt = draws.uniform(holding.tilt_deg.0, holding.tilt_deg.1).to_radians();
        let turn = draws.uniform(-holding.turn_deg, holding.turn_deg).to_radians();
        let mut sideways = || room * draws.uniform(-holding.sideways_mm, holding.sideways_mm);
        let (x, y) = (sideways(), sideways());
        let place = Vector3::new(x, y, draws.uniform(holding.depth_mm.0, holding.depth_mm.1));
        let tilted = UnitQuaternion::from_scaled_axis(Vector3::new(about.cos(), about.sin(), 0.0) * tilt);
        let turned = UnitQuaternion::from_scaled_axis(Vector3::z() * (turn + holding.upright_deg.to_radians()));
        left_from_field * transform((tilted * turned).scaled_axis(), place)
    };
    (0..ATTEMPTS).map(drawn).find(|left_from_board| accept(left_from_board))
}
