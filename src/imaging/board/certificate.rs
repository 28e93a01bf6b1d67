//! The board as its certificate describes it: a plain checkerboard, one whose light squares hold markers that number
//! its corners, or a grid of tags.

use std::ops::RangeInclusive;

use nalgebra::Point3;
use serde::Deserialize;

use super::dictionary::Dictionary;
use super::layout::Layout;
use super::pitch::Pitch;
use super::squares::Squares;
use crate::diagnostic::short;
use crate::imaging::lattice::turned_place;

/// Sides of squares, mm: from a wafer's to a car park's.
pub const SQUARES_MM: RangeInclusive<f64> = 1e-3..=1e5;

/// How much higher or lower than wide a square may be, as a share: printers stretch by less, and what is off by more is
/// another board. Three per cent in decimal figures are within.
pub const MOST_STRETCH: f64 = 0.03 + 1e-9;

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
    /// Kalibr's AprilGrid: tags with black squares in the corners between them. Where dark and light meet it is a
    /// checkerboard whose squares are a tag and a gap wide in turn; the outermost are gaps. OpenCV's grid of tags is
    /// the same without the black squares.
    Tags {
        /// Width of a gap, mm.
        gap_mm: f64,
        /// The tags' codes.
        family: Dictionary,
        /// Whose grid it is, where that is said; else Kalibr's until OpenCV's is seen.
        layout: Option<Layout>,
        /// By how much each side of a tag of OpenCV's grid is printed farther out than it is drawn, mm: what black
        /// runs. Where two black squares meet it moves nothing.
        spread_mm: f32,
    },
}

impl Kind {
    /// The codes of its markers, where it has any.
    pub fn dictionary(self) -> Option<Dictionary> {
        match self {
            Kind::Checker => None,
            Kind::Charuco { dictionary, .. } | Kind::Tags { family: dictionary, .. } => Some(dictionary),
        }
    }
}

/// A board of squares: so many, of such a size.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(try_from = "String")]
pub struct Board {
    pub squares: Squares,
    /// Width of a square, of a grid of tags that of a tag, mm.
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

    /// True for a board whose markers number its corners: any of them may be seen, in both pictures of a pair or in
    /// one.
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
            Kind::Tags { gap_mm, family, layout, spread_mm } => {
                Kind::Tags { gap_mm: gap_mm * factor, family, layout, spread_mm: spread_mm * factor as f32 }
            }
        };
        Board { square_mm: self.square_mm * factor, kind, ..self }
    }

    /// The layouts that it may have; both of a ChArUco board are the same where the number of rows is odd.
    pub fn layouts(&self) -> Vec<Layout> {
        match self.kind {
            Kind::Charuco { layout: Some(layout), .. } => vec![layout],
            Kind::Tags { layout, .. } => vec![layout.unwrap_or(Layout::Tags)],
            _ if self.squares.rows.is_multiple_of(2) => vec![Layout::New, Layout::Old],
            _ => vec![Layout::New],
        }
    }

    /// The board with markers in these squares.
    pub fn with_layout(self, layout: Layout) -> Board {
        let layout = Some(layout);
        let kind = match self.kind {
            Kind::Checker => Kind::Checker,
            Kind::Charuco { marker_mm, dictionary, .. } => Kind::Charuco { marker_mm, dictionary, layout },
            Kind::Tags { gap_mm, family, spread_mm, .. } => Kind::Tags { gap_mm, family, layout, spread_mm },
        };
        Board { kind, ..self }
    }

    /// Whether it is OpenCV's grid of tags, whose corners move as black spreads.
    pub fn is_grid(&self) -> bool {
        matches!(self.kind, Kind::Tags { layout: Some(Layout::Grid), .. })
    }

    /// Whether nobody said whose grid of tags it is.
    pub fn may_be_grid(&self) -> bool {
        matches!(self.kind, Kind::Tags { layout: None, .. })
    }

    /// How far black has spread, mm; zero where it moves no corner.
    pub fn spread_mm(&self) -> f64 {
        match self.kind {
            Kind::Tags { spread_mm, .. } => f64::from(spread_mm),
            _ => 0.0,
        }
    }

    /// The grid of tags printed with another spread of black, in steps of a hundred-thousandth of a tag at the most:
    /// lengths that people read hold it.
    pub fn with_spread_mm(self, spread_mm: f64) -> Board {
        let Kind::Tags { gap_mm, family, layout, .. } = self.kind else { return self };
        let steps = 10f64.powi((1e-5 * self.square_mm).log10().floor() as i32).recip();
        let spread_mm = ((spread_mm * steps).round() / steps) as f32;
        Board { kind: Kind::Tags { gap_mm, family, layout, spread_mm }, ..self }
    }

    /// Which way a corner of a tag moves along x and along y as black spreads: outwards from its tag.
    pub fn outwards(col: usize, row: usize) -> [f64; 2] {
        [col, row].map(|line| if line.is_multiple_of(2) { -1.0 } else { 1.0 })
    }

    /// Says all that pictures of the board depend on; lengths only as ratios.
    pub fn key(&self) -> String {
        match self.kind {
            Kind::Checker => self.squares.to_string(),
            Kind::Charuco { marker_mm, dictionary, layout } => {
                let (share, name) = (marker_mm / self.square_mm, dictionary.name());
                format!("charuco {} {share} {name}{}", self.squares, layout.map_or("", Layout::of_name))
            }
            Kind::Tags { gap_mm, family, layout, .. } => {
                let (gap, name) = (gap_mm / self.square_mm, family.name());
                format!("grid of tags {} {gap} {name}{}", self.squares, layout.map_or("", Layout::of_name))
            }
        }
    }

    /// Width and height of a square, mm.
    pub fn sides_mm(&self) -> [f64; 2] {
        [self.square_mm, self.square_mm * self.stretch]
    }

    /// What it is made of and counted in, for a person.
    pub fn unit(&self) -> &'static str {
        match self.kind {
            Kind::Checker | Kind::Charuco { .. } => "squares",
            Kind::Tags { .. } => "tags",
        }
    }

    /// The side of a square as it is written, mm: a width and a height where they differ.
    pub fn side_written(&self) -> String {
        match self.sides_mm() {
            [width, _] if self.stretch == 1.0 => width.to_string(),
            [width, height] => format!("{width}x{}", (height * 1e9).round() / 1e9),
        }
    }

    /// The same for a person.
    pub fn side_said(&self) -> String {
        let [width, height] = self.sides_mm().map(short);
        if width == height { width } else { format!("{width}x{height}") }
    }

    /// Number of inner corners along x.
    pub fn columns(&self) -> usize {
        self.squares.columns - 1
    }

    /// Number of inner corners along y.
    pub fn rows(&self) -> usize {
        self.squares.rows - 1
    }

    /// How far apart the lines of its corners are, in sides of a square.
    pub fn pitch(&self) -> Pitch {
        match self.kind {
            Kind::Checker | Kind::Charuco { .. } => Pitch::Even,
            Kind::Tags { gap_mm, .. } => Pitch::Tags { gap: gap_mm / self.square_mm },
        }
    }

    /// How many columns and rows of tags a grid of tags has.
    pub fn tags(&self) -> [usize; 2] {
        [self.columns() / 2, self.rows() / 2]
    }

    /// Distance of two lines of corners that are so many lines apart, the first of them the first of the board, mm:
    /// along x, along y.
    pub fn spans_mm(&self, lines: usize) -> [f64; 2] {
        // Both are sides of tags: black spreads away from between them, or moves both alike.
        let spread_mm = if lines.is_multiple_of(2) { 0.0 } else { 2.0 * self.spread_mm() };
        self.sides_mm().map(|side| self.pitch().at(lines as isize) * side + spread_mm)
    }

    /// Width and height of all its squares together, mm; of all tags where nothing dark is beyond them.
    pub fn extent_mm(&self) -> [f64; 2] {
        if self.is_grid() {
            let [[width, _], [_, height]] = [self.columns() - 1, self.rows() - 1].map(|lines| self.spans_mm(lines));
            return [width, height];
        }
        let [width, height] = self.sides_mm();
        let pitch = self.pitch();
        let of = |corners: usize, side: f64| (pitch.at(corners as isize) - pitch.at(-1)) * side;
        [of(self.columns(), width), of(self.rows(), height)]
    }

    /// Distance between two opposite outermost inner corners, mm.
    pub fn diagonal_mm(&self) -> f64 {
        let [[width, _], [_, height]] = [self.columns() - 1, self.rows() - 1].map(|lines| self.spans_mm(lines));
        width.hypot(height)
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

    /// A corner's number as the programs count whose boards they are: ChArUco's row by row, Kalibr's four to a tag,
    /// counter-clockwise from its lower left.
    pub fn id(&self, col: usize, row: usize) -> usize {
        match self.kind {
            Kind::Checker | Kind::Charuco { .. } => self.index(col, row),
            Kind::Tags { layout, .. } => {
                let corner = [[3, 2], [0, 1]][row % 2][col % 2];
                4 * layout.unwrap_or(Layout::Tags).number(self.squares, col / 2 * 2 + 1, row / 2 * 2 + 1) + corner
            }
        }
    }

    /// Column and row of the corner of this number; a number that the board has not gives a place that it has not.
    pub fn by_id(&self, id: usize) -> (usize, usize) {
        match self.kind {
            Kind::Checker | Kind::Charuco { .. } => self.place(id),
            Kind::Tags { layout, .. } => {
                let ([columns, rows], (tag, corner)) = (self.tags(), (id / 4, id % 4));
                let (col, row) = (2 * (tag % columns), tag / columns);
                if row >= rows {
                    return (col, 2 * row);
                }
                let top = if layout == Some(Layout::Grid) { 2 * row } else { 2 * (rows - 1 - row) };
                [(col, top + 1), (col + 1, top + 1), (col + 1, top), (col, top)][corner]
            }
        }
    }

    /// Nominal places of all inner corners in the board's frame, mm, row by row.
    pub fn corners_mm(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        (0..self.corner_count()).map(|k| self.place(k)).map(|(col, row)| self.corner_mm(col, row))
    }

    /// Nominal place of inner corner `(col, row)` in the board's frame (origin in the centre), mm.
    pub fn corner_mm(&self, col: usize, row: usize) -> Point3<f64> {
        let pitch = self.pitch();
        // Half of the width of a plain board is exact in steps of half a square; so is where its corners lie.
        let of = |line: usize, lines: usize| pitch.at(line as isize) - pitch.at(lines as isize - 1) / 2.0;
        let (x, y) = (of(col, self.columns()) * self.square_mm, of(row, self.rows()) * self.square_mm * self.stretch);
        match self.spread_mm() {
            0.0 => Point3::new(x, y, 0.0),
            spread_mm => {
                let [right, down] = Board::outwards(col, row);
                Point3::new(x + spread_mm * right, y + spread_mm * down, 0.0)
            }
        }
    }

    /// The smallest turn, in quarter turns, after which the board looks the same; `None` where only a whole turn does.
    /// That is a half turn at the most where both counts of squares are odd, or both even: an odd number of squares one
    /// way only swaps black and white. Markers tell a board from its turned self.
    pub fn symmetry(&self) -> Option<usize> {
        let Squares { columns, rows } = self.squares;
        let is_alike = !self.is_coded() && columns % 2 == rows % 2;
        is_alike.then_some(if columns == rows && columns % 2 == 1 { 1 } else { 2 })
    }

    /// Quarter turns after which the board looks the same: what a picture leaves open.
    pub fn turns_left_open(&self) -> Vec<usize> {
        self.symmetry().map_or(vec![0], |step| (0..4).step_by(step).collect())
    }

    /// The place, column and row, that a corner has after the board was turned in its plane by so many quarter turns; a
    /// board with unequal sides takes half turns only.
    pub fn turned(&self, (col, row): (usize, usize), quarters: usize) -> (usize, usize) {
        let last = (self.columns() as isize - 1, self.rows() as isize - 1);
        let (col, row) = turned_place((col as isize, row as isize), last, quarters);
        (col as usize, row as usize)
    }

    /// Quarter turns after which the board's outline is the same, whatever its colours: all four of a square board,
    /// none and two of another; none but the first where every corner has a number of its own.
    pub fn turns_of_outline(&self) -> Vec<usize> {
        let own_step = if self.columns() == self.rows() { 1 } else { 2 };
        (0..4).step_by(if self.is_coded() { 4 } else { own_step }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let sum: nalgebra::Vector3<f64> = board.corners_mm().map(|at| at.coords).sum();
        assert_eq!(sum.norm(), 0.0);
        assert_eq!(board.corner_mm(1, 0).x - board.corner_mm(0, 0).x, 10.0);
    }

    #[test]
    fn tags_count_as_kalibr_counts() {
        let board: Board = "apriltag:3x2:tag36h11:40:10".parse().unwrap();
        assert_eq!((board.columns(), board.rows(), board.tags()), (6, 4, [3, 2]));
        // The lowest row's tags are 0, 1 and 2; each has its lower left corner first.
        for (place, id) in [((0, 3), 0), ((1, 3), 1), ((1, 2), 2), ((0, 2), 3), ((2, 3), 4), ((0, 1), 12), ((5, 0), 22)]
        {
            assert_eq!((board.id(place.0, place.1), board.by_id(id)), (id, place));
        }
        assert!(board.by_id(24).1 >= board.rows());
        // Two tags and the gap between them either way.
        let across = board.corner_mm(3, 0) - board.corner_mm(0, 0);
        assert_eq!((across.x, board.spans_mm(3), board.extent_mm()), (90.0, [90.0, 90.0], [160.0, 110.0]));
        assert!((board.corner_mm(0, 0) + board.corner_mm(5, 3).coords).coords.norm() < 1e-12);
    }

    #[test]
    fn opencvs_tags_count_from_the_upper_row_and_grow_with_the_ink() {
        let board: Board = "apriltag:3x2:tag36h11:40:10:opencv".parse().unwrap();
        for (place, id) in [((0, 1), 0), ((1, 1), 1), ((1, 0), 2), ((0, 0), 3), ((2, 1), 4), ((0, 3), 12), ((5, 2), 22)]
        {
            assert_eq!((board.id(place.0, place.1), board.by_id(id)), (id, place));
        }
        assert!(board.by_id(24).1 >= board.rows());
        assert_eq!(board.extent_mm(), [140.0, 90.0]);
        let inked = board.with_spread_mm(0.25);
        let between = |a: (usize, usize), b: (usize, usize)| inked.corner_mm(b.0, b.1) - inked.corner_mm(a.0, a.1);
        // A tag is wider, a gap narrower, and like corners of two tags are as far apart as they are drawn.
        assert_eq!(
            [between((0, 0), (1, 0)).x, between((1, 0), (2, 0)).x, between((0, 1), (0, 3)).y],
            [40.5, 9.5, 50.0]
        );
        assert_eq!([inked.spans_mm(1), inked.spans_mm(2), inked.extent_mm()], [[40.5; 2], [50.0; 2], [140.5, 90.5]]);
        assert_eq!((inked.to_string(), inked.key()), (board.to_string(), board.key()));
    }
}
