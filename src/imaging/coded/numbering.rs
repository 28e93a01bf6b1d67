//! Which corner of the board is which, by the markers between them.
//!
//! In: a grid of corners and the markers that were read in its squares. Out: how the grid lies on the board. Method:
//! every marker that is one of the board's proposes a turn and a shift of the whole grid; the proposal that most of the
//! markers agree with wins, where it has no rival and hardly a marker contradicts it. A single marker numbers a grid
//! only where all of its bits are right. Goes wrong: a board that is not the one named; the markers then say which it
//! could be ([`super::explain`]).

use super::marker::Marker;
use crate::imaging::board::dictionary::turned as quarter_turned;
use crate::imaging::board::{Board, Kind, Layout};
use crate::imaging::lattice::turned_place;

/// A marker in a square of a grid: the square is the one after corner `(col, row)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Read {
    /// Column of the corner before it.
    pub col: isize,
    /// Row of the corner before it.
    pub row: isize,
    pub marker: Marker,
}

/// How a grid lies on the board: turned by so many quarter turns, its corner (0, 0) is then the board's `(col, row)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Placement {
    /// Quarter turns of the grid.
    pub quarters: usize,
    /// Column of the turned grid's first corner.
    pub col: isize,
    /// Row of the turned grid's first corner.
    pub row: isize,
    /// Which squares hold markers.
    pub layout: Layout,
    /// Markers that agree with it.
    pub agreeing: usize,
    /// Whether the markers are printed white on black.
    pub inverted: bool,
}

/// How many markers agree for each that contradicts.
pub const AGREEING: usize = 3;

/// The number of bits that a marker may be misread in where others agree with it. By the binomial sum, bits without any
/// order then pass for a given marker once in 480 times for 4x4 bits, in 13 000 for 5x5, in a million for 6x6; a
/// placement needs two that do, or one without a wrong bit.
pub fn tolerated(bits: usize) -> usize {
    bits * bits / 8
}

/// A square, as it would be in a grid of `columns` x `rows` corners that is turned by so many quarter turns.
pub fn turned_square(square: (isize, isize), (columns, rows): (usize, usize), quarters: usize) -> (isize, isize) {
    turned_place(square, (columns as isize - 2, rows as isize - 2), quarters)
}

/// What was read, as it would be in such a grid.
fn turned(read: &Read, size: (usize, usize), quarters: usize) -> Read {
    let (col, row) = turned_square((read.col, read.row), size, quarters);
    Read { col, row, marker: read.marker.turned(quarters) }
}

/// The number of the marker in a square of the board; `None` where there is none or no such square.
fn marker_in(board: &Board, layout: Layout, (x, y): (isize, isize)) -> Option<usize> {
    let holds = is_inside(board, (x, y)) && layout.holds_marker(x, y);
    holds.then(|| layout.number(board.squares, x as usize, y as usize))
}

/// The bits of the marker in a square of the board, row by row as they are printed; `None` where there is none.
pub fn code_in(board: &Board, layout: Layout, square: (isize, isize)) -> Option<u64> {
    let id = marker_in(board, layout, square)?;
    match board.kind {
        Kind::Checker => None,
        Kind::Charuco { dictionary, .. } => dictionary.code(id),
        // Kalibr prints tags as their makers do, OpenCV upside down.
        Kind::Tags { family, .. } if layout == Layout::Grid => family.code(id),
        Kind::Tags { family, .. } => Some(quarter_turned(family.code(id)?, family.bits(), 2)),
    }
}

/// What the markers of a grid say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Said {
    /// How it lies on the board.
    Place(Placement),
    /// One of two places, by which squares of the board hold markers: that of the new layout or that of the old.
    ByLayout,
    Nothing,
}

/// How a grid of `size` corners lies on the board by what was read in it.
pub fn place(board: &Board, size: (usize, usize), reads: &[Read]) -> Said {
    let inverted = 2 * reads.iter().filter(|read| read.marker.inverted).count() > reads.len();
    let reads: Vec<Read> = reads.iter().filter(|read| read.marker.inverted == inverted).copied().collect();
    let found: Vec<(Placement, usize)> =
        board.layouts().into_iter().filter_map(|layout| by_layout(board, layout, size, &reads)).collect();
    match found[..] {
        [] => Said::Nothing,
        [(only, _)] => Said::Place(only),
        // A layout is the other one moved by a column, but for the board's ends: only markers there tell them apart.
        [(a, whole_a), (b, whole_b), ..] if a.agreeing > b.agreeing && whole_a > whole_b => Said::Place(a),
        [(a, whole_a), (b, whole_b), ..] if b.agreeing > a.agreeing && whole_b > whole_a => Said::Place(b),
        [_, _, ..] => Said::ByLayout,
    }
}

/// The same for one layout and markers of one colour, with the number of markers all of whose bits are right.
fn by_layout(board: &Board, layout: Layout, size: (usize, usize), reads: &[Read]) -> Option<(Placement, usize)> {
    let inverted = reads.first()?.marker.inverted;
    let mut best: Option<(Placement, usize)> = None;
    let mut rival = 0;
    for quarters in 0..4 {
        let seen: Vec<Read> = reads.iter().map(|read| turned(read, size, quarters)).collect();
        for (col, row) in proposals(board, layout, &seen) {
            let (mut agreeing, mut contradicting, mut whole) = (0, 0, 0);
            for read in &seen {
                let square = (read.col + 1 + col, read.row + 1 + row);
                match code_in(board, layout, square).map(|code| read.marker.differs_from(code)) {
                    Some(wrong) if wrong <= tolerated(read.marker.bits) => {
                        agreeing += 1;
                        whole += usize::from(wrong == 0);
                    }
                    // Beyond the board's border there may be anything.
                    None if !is_inside(board, square) => {}
                    _ => contradicting += 1,
                }
            }
            let is_chance = agreeing <= AGREEING * contradicting || agreeing < 2 && whole < 1;
            if is_chance {
                continue;
            }
            let known = best.map_or(0, |(known, _)| known.agreeing);
            rival = rival.max(known.min(agreeing));
            if agreeing > known {
                best = Some((Placement { quarters, col, row, layout, agreeing, inverted }, whole));
            }
        }
    }
    // One marker in the right place and one by chance in the wrong one are not told apart.
    best.filter(|(found, _)| 2 * rival < found.agreeing.max(2))
}

fn is_inside(board: &Board, (x, y): (isize, isize)) -> bool {
    (0..board.squares.columns as isize).contains(&x) && (0..board.squares.rows as isize).contains(&y)
}

/// Shifts that bring some marker to where the board has it, each once.
fn proposals(board: &Board, layout: Layout, seen: &[Read]) -> Vec<(isize, isize)> {
    let mut shifts = Vec::new();
    for y in 0..board.squares.rows {
        for x in 0..board.squares.columns {
            let Some(code) = code_in(board, layout, (x as isize, y as isize)) else { continue };
            let near = |read: &&Read| read.marker.differs_from(code) <= tolerated(read.marker.bits) / 2;
            for read in seen.iter().filter(near) {
                let shift = (x as isize - 1 - read.col, y as isize - 1 - read.row);
                if !shifts.contains(&shift) {
                    shifts.push(shift);
                }
            }
        }
    }
    shifts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is read on a board in the squares of a part of it, seen in a grid that is turned.
    fn part(
        board: &Board,
        layout: Layout,
        cols: std::ops::Range<isize>,
        rows: std::ops::Range<isize>,
        quarters: usize,
    ) -> ((usize, usize), Vec<Read>) {
        let Kind::Charuco { dictionary, .. } = board.kind else { panic!("a board with markers") };
        let size = (cols.len(), rows.len());
        let squares = (rows.start - 1..rows.end).flat_map(|row| (cols.start - 1..cols.end).map(move |col| (col, row)));
        let read = |(col, row)| {
            let code = dictionary.code(marker_in(board, layout, (col + 1, row + 1))?).unwrap();
            let marker = Marker { code, bits: dictionary.bits(), inverted: false, contrast: 100.0 };
            Some(turned(&Read { col: col - cols.start, row: row - rows.start, marker }, size, quarters))
        };
        (if quarters % 2 == 1 { (size.1, size.0) } else { size }, squares.filter_map(read).collect())
    }

    #[test]
    fn every_part_of_a_board_is_known_from_every_side() {
        for (name, layouts) in [("charuco:11x8:15:11:DICT_5X5_100", 2), ("charuco:4x5:54:40.5:DICT_4X4_1000", 1)] {
            let board: Board = name.parse().unwrap();
            assert_eq!(board.layouts().len(), layouts);
            for layout in board.layouts() {
                for quarters in 0..4 {
                    for (col, row) in [(0, 0), (1, 0), (0, 2), (1, 1)] {
                        let (size, reads) = part(&board, layout, col..col + 2, row..row + 2, quarters);
                        let expected = ((4 - quarters) % 4, col, row, layout, reads.len());
                        let told =
                            |found: Placement| (found.quarters, found.col, found.row, found.layout, found.agreeing);
                        match place(&board.with_layout(layout), size, &reads) {
                            Said::Place(found) => assert_eq!(told(found), expected),
                            other => panic!("{board} {layout:?} {quarters} {col} {row}: {other:?}"),
                        }
                        // On a board of odd columns only the markers at its sides tell the layouts apart.
                        match place(&board, size, &reads) {
                            Said::Place(found) => assert_eq!(told(found), expected),
                            other => assert!(layouts == 2 && other == Said::ByLayout, "{board}: {other:?}"),
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn markers_of_another_board_number_nothing() {
        let board: Board = "charuco:11x8:15:11:DICT_5X5_100".parse().unwrap();
        for other in
            ["charuco:8x11:15:11:DICT_5X5_100", "charuco:11x8:15:11:DICT_5X5_1000", "charuco:12x8:15:11:DICT_5X5_100"]
        {
            let other: Board = other.parse().unwrap();
            let (size, reads) = part(&other, Layout::New, 1..7, 1..7, 0);
            let found = place(&board, size, &reads) != Said::Nothing;
            // DICT_5X5_1000 begins as DICT_5X5_100 does: the same markers.
            let same = matches!(other.kind, Kind::Charuco { dictionary, .. } if dictionary.name() == "DICT_5X5_1000");
            assert_eq!(found, same, "{other}");
        }
    }

    #[test]
    fn one_marker_numbers_only_where_all_its_bits_are_right() {
        let board: Board = "charuco:11x8:15:11:DICT_5X5_100".parse().unwrap();
        let (size, mut reads) = part(&board, Layout::New, 3..5, 3..5, 0);
        reads.truncate(1);
        // Which of the two layouts it is one marker does not tell.
        assert_eq!(place(&board, size, &reads), Said::ByLayout);
        reads[0].marker.code ^= 1 << 7;
        assert_eq!(place(&board, size, &reads), Said::Nothing);
        assert_eq!(place(&board, size, &[]), Said::Nothing);
    }
}
