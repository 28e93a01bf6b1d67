//! The board as its certificate describes it: a plain checkerboard, or one whose light squares hold markers that number its corners.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use nalgebra::Point3;
use serde::{Deserialize, Serialize};

use super::Error;
use super::coded::Layout;
use super::coded::dictionary::Dictionary;

/// Number of squares of a board; of a plain one the larger number first, of one with markers as printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Squares {
    /// Squares along x, the longer side of a plain board.
    pub columns: usize,
    /// Squares along y.
    pub rows: usize,
}

impl FromStr for Squares {
    type Err = Error;

    /// Reads `20x20`. `6x7` and `7x6` are the same board.
    fn from_str(text: &str) -> Result<Squares, Error> {
        let Squares { columns, rows } = Squares::as_printed(text)?;
        Ok(Squares { columns: columns.max(rows), rows: columns.min(rows) })
    }
}

impl Squares {
    /// Reads `8x11` as eight columns of eleven squares.
    pub fn as_printed(text: &str) -> Result<Squares, Error> {
        let refuse = || Error::BoardSize { found: text.to_owned() };
        let (a, b) = text.split_once(['x', 'X']).ok_or_else(refuse)?;
        let a: usize = a.trim().parse().map_err(|_| refuse())?;
        let b: usize = b.trim().parse().map_err(|_| refuse())?;
        // Two inner corners each way are the least that has a direction; 200 is far beyond any picture.
        if a.min(b) < 3 || a.max(b) > 200 {
            return Err(refuse());
        }
        Ok(Squares { columns: a, rows: b })
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

/// Sides of squares, mm: from a wafer's to a car park's.
pub const SQUARES_MM: RangeInclusive<f64> = 1e-3..=1e5;

/// How much higher or lower than wide a square may be, as a share: printers stretch by less, and what is off by more is another board.
pub const MOST_STRETCH: f64 = 0.03;

/// What tells a board's corners apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Its outline and colours alone: it has to be seen whole, but for what the picture's border cuts off.
    Checker,
    /// Markers in every other square, numbered row by row: any part with a marker will do.
    Charuco {
        /// Side of a marker, its border included, mm.
        marker_mm: f64,
        /// The markers' codes.
        dictionary: Dictionary,
        /// Which squares hold the markers, where that is said; else it is what is seen.
        layout: Option<Layout>,
    },
}

/// A board of squares: so many, of such a size.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct Board {
    /// Number of squares.
    pub squares: Squares,
    /// Width of a square, mm.
    pub square_mm: f64,
    /// Height of a square over its width: one as drawn, hardly another as printed.
    pub stretch: f64,
    /// What tells its corners apart.
    pub kind: Kind,
}

impl Board {
    /// A plain checkerboard.
    pub fn checker(squares: Squares, square_mm: f64) -> Board {
        Board { squares, square_mm, stretch: 1.0, kind: Kind::Checker }
    }

    /// True for a board whose markers number its corners: any of them may be seen, in both pictures of a pair or in one.
    pub fn is_coded(&self) -> bool {
        self.kind != Kind::Checker
    }

    /// The board with all its lengths so many times as large.
    pub fn scaled(self, factor: f64) -> Board {
        let kind = match self.kind {
            Kind::Checker => Kind::Checker,
            Kind::Charuco { marker_mm, dictionary, layout } => {
                Kind::Charuco { marker_mm: marker_mm * factor, dictionary, layout }
            }
        };
        Board { square_mm: self.square_mm * factor, kind, ..self }
    }

    /// The board with markers in these squares.
    pub fn with_layout(self, layout: Layout) -> Board {
        match self.kind {
            Kind::Checker => self,
            Kind::Charuco { marker_mm, dictionary, .. } => {
                Board { kind: Kind::Charuco { marker_mm, dictionary, layout: Some(layout) }, ..self }
            }
        }
    }

    /// Says all that pictures of the board depend on; lengths only as ratios.
    pub fn key(&self) -> String {
        match self.kind {
            Kind::Checker => self.squares.to_string(),
            Kind::Charuco { marker_mm, dictionary, layout } => {
                let (share, name) = (marker_mm / self.square_mm, dictionary.name());
                format!("charuco {} {share} {name}{}", self.squares, of_layout(layout))
            }
        }
    }

    /// Width and height of a square, mm.
    pub fn sides_mm(&self) -> [f64; 2] {
        [self.square_mm, self.square_mm * self.stretch]
    }

    /// The side of a square for a person, mm: a width and a height where they differ.
    pub fn side_said(&self) -> String {
        match self.sides_mm() {
            [width, _] if self.stretch == 1.0 => width.to_string(),
            [width, height] => format!("{width}x{}", (height * 1e9).round() / 1e9),
        }
    }

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
        let [width, height] = self.sides_mm();
        ((self.columns() - 1) as f64 * width).hypot((self.rows() - 1) as f64 * height)
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
            (row as f64 - (self.rows() - 1) as f64 / 2.0) * self.square_mm * self.stretch,
            0.0,
        )
    }

    /// True where turning the board by 180 degrees in its plane leaves the same picture: both counts of squares odd, or both even.
    /// (An odd number of squares one way only swaps black and white.) Markers tell it from its turned self.
    pub fn looks_the_same_after_half_turn(&self) -> bool {
        !self.is_coded() && self.squares.columns % 2 == self.squares.rows % 2
    }

    /// The smallest turn, in quarter turns, after which the board looks the same; `None` where only a whole turn does.
    pub fn symmetry(&self) -> Option<usize> {
        let square = self.squares.columns == self.squares.rows;
        match (self.looks_the_same_after_half_turn(), square && self.squares.columns % 2 == 1) {
            (false, _) => None,
            (true, false) => Some(2),
            (true, true) => Some(1),
        }
    }

    /// Quarter turns after which the board looks the same: what a picture leaves open.
    pub fn turns_left_open(&self) -> Vec<usize> {
        self.symmetry().map_or(vec![0], |step| (0..4).step_by(step).collect())
    }

    /// Quarter turns after which the board's outline is the same, whatever its colours: all four of a square board, none and two of another;
    /// none but the first where every corner has a number of its own.
    pub fn turns_of_outline(&self) -> Vec<usize> {
        let step = match (self.is_coded(), self.columns() == self.rows()) {
            (true, _) => 4,
            (false, true) => 1,
            (false, false) => 2,
        };
        (0..4).step_by(step).collect()
    }
}

/// The end of a board's name that says its layout.
pub(super) fn of_layout(layout: Option<Layout>) -> &'static str {
    match layout {
        None => "",
        Some(Layout::New) => ":new",
        Some(Layout::Old) => ":old",
    }
}

impl TryFrom<String> for Board {
    type Error = Error;
    fn try_from(text: String) -> Result<Board, Error> {
        text.parse()
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
    fn only_boards_that_look_the_same_are_ambiguous() {
        let of = |squares: &str| Board::checker(squares.parse().unwrap(), 10.0).symmetry();
        assert_eq!(["10x7", "7x5", "8x6", "20x20", "7x7"].map(of), [None, Some(2), Some(2), Some(2), Some(1)]);
        assert_eq!("charuco:7x7:20:14:DICT_4X4_50".parse::<Board>().unwrap().turns_left_open(), [0]);
    }

    #[test]
    fn corners_are_centred() {
        let board = Board::checker("7x6".parse().unwrap(), 10.0);
        assert_eq!(board.corner_count(), 30);
        let sum: nalgebra::Vector3<f64> = (0..board.rows())
            .flat_map(|row| (0..board.columns()).map(move |col| (col, row)))
            .map(|(col, row)| board.corner_mm(col, row).coords)
            .sum();
        assert_eq!(sum.norm(), 0.0);
        assert_eq!(board.corner_mm(1, 0).x - board.corner_mm(0, 0).x, 10.0);
    }
}
