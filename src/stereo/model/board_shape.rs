//! A board that is not flat: paraboloids along both axes, zero at the outermost corners, and a twist.

use nalgebra::Point3;

use crate::imaging::Board;

/// Names of the shape's numbers as `calibration.json` has them: the heights of the paraboloids along x and y in the
/// board's middle, and the height to which the twist lifts the first and the last corner (and lowers the other two),
/// mm.
pub const NAMES: [&str; NUMBERS] = ["board.kx_mm", "board.ky_mm", "board.kxy_mm"];

/// How many numbers a shape has.
pub const NUMBERS: usize = 3;

pub const FLAT: [f64; NUMBERS] = [0.0; NUMBERS];

/// Height of a place of a bent board, mm, from how much one unit of each number lifts it.
pub fn height_mm(lift: &[f64; NUMBERS], shape_mm: &[f64; NUMBERS]) -> f64 {
    lift.iter().zip(shape_mm).map(|(lift, height)| lift * height).sum()
}

/// How much one unit of each number of the shape lifts a place of the board: `1 - x^2`, `1 - y^2` and `x y` over [-1,
/// 1]^2.
pub fn lift(board: &Board, at: &Point3<f64>) -> [f64; NUMBERS] {
    let edge = board.corner_mm(board.columns() - 1, board.rows() - 1);
    let (x, y) = (at.x / edge.x, at.y / edge.y);
    [1.0 - x.powi(2), 1.0 - y.powi(2), x * y]
}
