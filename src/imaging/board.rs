//! The checkerboard as its certificate describes it.

use std::fmt;
use std::str::FromStr;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::Error;

/// Number of squares of a board, the larger number first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Squares {
    /// Squares along x, the longer side.
    pub columns: usize,
    /// Squares along y.
    pub rows: usize,
}

impl FromStr for Squares {
    type Err = Error;

    /// Reads `20x20`. `6x7` and `7x6` are the same board.
    fn from_str(text: &str) -> Result<Squares, Error> {
        let refuse = || Error::BoardSize { found: text.to_owned() };
        let (a, b) = text.split_once(['x', 'X']).ok_or_else(refuse)?;
        let a: usize = a.trim().parse().map_err(|_| refuse())?;
        let b: usize = b.trim().parse().map_err(|_| refuse())?;
        // Two inner corners each way are the least that has a direction; 200 is far beyond any picture.
        if a.min(b) < 3 || a.max(b) > 200 {
            return Err(refuse());
        }
        Ok(Squares { columns: a.max(b), rows: a.min(b) })
    }
}

impl TryFrom<String> for Squares {
    type Error = Error;
    fn try_from(text: String) -> Result<Squares, Error> {
        text.parse()
    }
}

impl From<Squares> for String {
    fn from(squares: Squares) -> String {
        squares.to_string()
    }
}

impl fmt::Display for Squares {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.columns, self.rows)
    }
}

/// A checkerboard: so many squares of such a size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Number of squares.
    pub squares: Squares,
    /// Side of a square, mm.
    pub square_mm: f64,
}

impl Board {
    /// Number of inner corners along x.
    pub fn columns(&self) -> usize {
        self.squares.columns - 1
    }

    /// Number of inner corners along y.
    pub fn rows(&self) -> usize {
        self.squares.rows - 1
    }

    /// Distance between two opposite outermost inner corners, mm.
    pub fn diagonal_mm(&self) -> f64 {
        let sides = [self.columns() - 1, self.rows() - 1].map(|squares| squares as f64 * self.square_mm);
        sides[0].hypot(sides[1])
    }

    /// Number of inner corners.
    pub fn corner_count(&self) -> usize {
        self.columns() * self.rows()
    }

    /// Place of a corner in lists of all corners: row by row.
    pub fn index(&self, col: usize, row: usize) -> usize {
        row * self.columns() + col
    }

    /// Column and row of the corner at this place in such a list.
    pub fn place(&self, index: usize) -> (usize, usize) {
        (index % self.columns(), index / self.columns())
    }

    /// Nominal places of all inner corners in the board's frame, mm, row by row.
    pub fn corners_mm(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        (0..self.corner_count()).map(|k| self.place(k)).map(|(col, row)| self.corner_mm(col, row))
    }

    /// Nominal place of inner corner `(col, row)` in the board's frame (origin in the centre), mm.
    pub fn corner_mm(&self, col: usize, row: usize) -> Point3<f64> {
        Point3::new(
            (col as f64 - (self.columns() - 1) as f64 / 2.0) * self.square_mm,
            (row as f64 - (self.rows() - 1) as f64 / 2.0) * self.square_mm,
            0.0,
        )
    }

    /// True where turning the board by 180 degrees in its plane leaves the same picture: both counts of squares odd, or both even.
    /// (An odd number of squares one way only swaps black and white.)
    pub fn looks_the_same_after_half_turn(&self) -> bool {
        self.squares.columns % 2 == self.squares.rows % 2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_count_comes_first() {
        let squares: Squares = "6x7".parse().unwrap();
        assert_eq!(squares.to_string(), "7x6");
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "7", "7x", "x6", "7x2", "-7x6", "7.5x6", "7x6x5", "1000x6"] {
            assert!(text.parse::<Squares>().is_err(), "{text}");
        }
    }

    #[test]
    fn corners_are_centred() {
        let board = Board { squares: "7x6".parse().unwrap(), square_mm: 10.0 };
        assert_eq!(board.corner_count(), 30);
        let sum: nalgebra::Vector3<f64> = (0..board.rows())
            .flat_map(|row| (0..board.columns()).map(move |col| (col, row)))
            .map(|(col, row)| board.corner_mm(col, row).coords)
            .sum();
        assert_eq!(sum.norm(), 0.0);
        assert_eq!(board.corner_mm(1, 0).x - board.corner_mm(0, 0).x, 10.0);
    }
}
