//! Two parts of a picture that claim the same corners of the board at different places: two boards, or one of them was
//! put together wrongly.
//!
//! In: both as places on the board. Out: that there are two boards, or the part to keep. Method: a part's own
//! homography says where the board's lines are in the whole picture. Corners of the same board lie where these cross,
//! whatever their numbers are; those of another board lie beyond its sides, or anywhere on it. Squares that are seen so
//! obliquely that their long sides are several times the short ones are put together wrongly now and then: corners of
//! every other line in one place, those of a diagonal in another. Corners that their own part's homography has
//! elsewhere are left out. Goes wrong: two boards of which one lies on the other, in line with it.

use nalgebra::{Matrix3, Point2};

use super::super::local_map::least_squares;
use super::super::marker::mapped;
use crate::imaging::Board;
use crate::imaging::board::Pitch;
use crate::imaging::lattice::Places;

/// How far from where its lines cross a corner may be seen, in sides of the least square: lenses bend a board's lines
/// by less.
const NEAR: f64 = 0.3;
/// Share of a part's corners that its own homography has where they are, at least, for it to be a board of its own.
const SOUND: f64 = 0.75;
/// Share of its corners that lie where the other's lines cross, at most.
const MOST_SHARED: f64 = 0.5;

/// What two parts are.
pub enum Claim {
    /// Parts of two boards.
    TwoBoards,
    /// Of one, of which this part is kept: the first.
    First(Places),
    /// The second.
    Second(Places),
}

/// Whose the corners are.
pub fn claim(board: &Board, first: &Places, second: &Places) -> Claim {
    let [a, b] = [first, second].map(|part| Plane::of(board.pitch(), part));
    let is_sound = |plane: &Plane, part: &Places| plane.kept.count() as f64 >= SOUND * part.count() as f64;
    let is_other = |plane: &Plane, part: &Places| {
        let shared = part.iter().filter(|(_, _, p)| plane.has_corner(board, p)).count();
        shared as f64 <= MOST_SHARED * part.count() as f64
    };
    if is_sound(&a, first) && is_sound(&b, second) && is_other(&a, second) && is_other(&b, first) {
        Claim::TwoBoards
    } else if b.kept.count() > a.kept.count() {
        Claim::Second(b.kept)
    } else {
        Claim::First(a.kept)
    }
}

/// A part's own plane.
struct Plane {
    /// From the picture to the board, in sides of a square; `None` where the part has too few corners.
    board_from_picture: Option<Matrix3<f64>>,
    /// The corners that lie where it has them.
    kept: Places,
}

impl Plane {
    fn of(pitch: Pitch, part: &Places) -> Plane {
        let mut kept = part.clone();
        loop {
            let at = |col: usize, row: usize| (pitch.at(col as isize), pitch.at(row as isize));
            let points: Vec<_> = kept.iter().map(|(col, row, p)| (at(col, row).0, at(col, row).1, *p)).collect();
            let Some(back) = least_squares(&points).and_then(|map| map.try_inverse()) else {
                return Plane { board_from_picture: None, kept };
            };
            let off = |(col, row, p): (usize, usize, &Point2<f64>)| {
                let (q, (x, y)) = (mapped(&back, p.x, p.y), at(col, row));
                ((q.x - x).abs().max((q.y - y).abs()), row * part.columns + col)
            };
            match kept.iter().map(off).max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((off, index)) if off > NEAR * pitch.least() => kept.cells[index] = None,
                _ => return Plane { board_from_picture: Some(back), kept },
            }
        }
    }

    /// Whether two of the board's lines cross at a place of the picture.
    fn has_corner(&self, board: &Board, at: &Point2<f64>) -> bool {
        let pitch = board.pitch();
        let Some(map) = &self.board_from_picture else { return false };
        let q = mapped(map, at.x, at.y);
        let is_line =
            |x: f64, lines: usize| (0..lines).any(|line| (x - pitch.at(line as isize)).abs() <= NEAR * pitch.least());
        is_line(q.x, board.columns()) && is_line(q.y, board.rows())
    }
}
