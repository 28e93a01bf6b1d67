//! One order of corners for both cameras and all pairs.
//!
//! In: grids of corners, right-handed and turned as far as the colours tell. Out: the same grids, turned so that left
//! and right number the same corner alike. Where a board looks the same after a half turn (a square one with an odd
//! number of squares: after a quarter turn), each picture alone leaves 2 (or 4) numberings. Pictures of one camera then
//! get the numbering nearest to their common direction, and right pictures the one nearest to the direction that most
//! of them have relative to their left pictures: cameras of a rig keep their roll against each other.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::Vector2;

use super::Board;
use super::lattice::Places;

/// For each pair the quarter turns that its left and its right grid need.
pub fn agreed_turns(pairs: &[(Places, Places)], board: Board) -> Vec<(usize, usize)> {
    let Some(step) = board.symmetry() else { return vec![(0, 0); pairs.len()] };
    let period = step as f64 * FRAC_PI_2;
    let angles: Vec<(f64, f64)> = pairs.iter().map(|(l, r)| (direction(l), direction(r))).collect();
    let left_reference = common_angle(angles.iter().map(|a| a.0), period);
    let roll = common_angle(angles.iter().map(|a| a.1 - a.0), period);
    angles
        .iter()
        .map(|&(left, right)| {
            let turn_left = turns_to(left, left_reference, step);
            let turned_left = left - turn_left as f64 * FRAC_PI_2;
            (turn_left, turns_to(right - turned_left, roll, step))
        })
        .collect()
}

/// Direction of the columns in the picture, rad.
pub fn direction(grid: &Places) -> f64 {
    let mut sum = Vector2::zeros();
    for (col, row, p) in grid.iter() {
        if let Some(next) = grid.get(col + 1, row) {
            sum += next - p;
        }
    }
    sum.y.atan2(sum.x)
}

/// The angle that most of the angles are near to when multiples of `period` do not count, in (-period/2, period/2].
fn common_angle(angles: impl Iterator<Item = f64>, period: f64) -> f64 {
    let scale = TAU / period;
    let (sin, cos) = angles.fold((0.0, 0.0), |(s, c), a| (s + (a * scale).sin(), c + (a * scale).cos()));
    sin.atan2(cos) / scale
}

/// The number of quarter turns, a multiple of `step`, that brings a grid's direction nearest to a reference.
/// A quarter turn of a grid takes 90 degrees off its direction.
fn turns_to(angle: f64, reference: f64, step: usize) -> usize {
    let period = step as f64 * FRAC_PI_2;
    let steps = ((angle - reference) / period).round().rem_euclid(TAU / period);
    steps as usize * step % 4
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Point2;

    use super::super::lattice::Lattice;
    use super::*;

    /// The difference of two angles, in (-pi, pi].
    fn angle_between(a: f64, b: f64) -> f64 {
        let d = (a - b).rem_euclid(TAU);
        if d > PI { d - TAU } else { d }
    }

    fn board(squares: &str) -> Board {
        Board::checker(squares.parse().unwrap(), 10.0)
    }

    fn grid(board: Board, angle: f64) -> Places {
        let (sin, cos) = angle.sin_cos();
        Lattice::from_fn(board.columns(), board.rows(), |col, row| {
            let p = board.corner_mm(col, row);
            Some(Point2::new(cos * p.x - sin * p.y, sin * p.x + cos * p.y))
        })
    }

    #[test]
    fn a_turned_grid_is_turned_back() {
        for (squares, step) in [("7x5", 2), ("20x20", 2), ("7x7", 1)] {
            let board = board(squares);
            // Boards roll by up to 0.3 rad, the right camera by 0.1 against the left.
            let rolls = [0.0, 0.3, -0.2, 0.1, 0.25, -0.3];
            let pairs: Vec<_> = rolls
                .iter()
                .enumerate()
                .map(|(i, &roll)| (grid(board, roll).turned(i * step), grid(board, roll + 0.1).turned(i / 2 * step)))
                .collect();
            for ((left, right), (i, &roll)) in agreed_turns(&pairs, board).into_iter().zip(rolls.iter().enumerate()) {
                let deviation = angle_between(direction(&pairs[i].0.turned(left)), roll);
                assert!(deviation.abs() < 1e-9, "{squares} left {i}: {deviation}");
                let deviation = angle_between(direction(&pairs[i].1.turned(right)), roll + 0.1);
                assert!(deviation.abs() < 1e-9, "{squares} right {i}: {deviation}");
            }
        }
    }
}
