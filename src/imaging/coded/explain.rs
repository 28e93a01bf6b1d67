//! What else a board could be whose markers do not number it as the one that was named.
//!
//! In: grids of corners without a number. Out: the reason, for a person, and the board that it is, where that is told.
//! Method: the same markers are read once more as on other boards: of another dictionary, of other counts, with markers
//! of another size, mirrored; the first that they fit is named.

use super::in_grid::markers_in;
use super::marker::{Fields, TAG_BORDERS, fields};
use super::measures;
use super::numbering::{self, Placement, Read, Said};
use crate::imaging::board::dictionary::Dictionary;
use crate::imaging::board::{Board, Kind, Layout, Pitch, Squares};
use crate::imaging::detect::Refusal;
use crate::imaging::image::Picture;
use crate::imaging::lattice::Places;

/// Markers that are no chance find.
const FEWEST: usize = 2;
/// Sizes of markers that are tried, as shares of a square.
const SHARES: [f64; 8] = [0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85];
/// Most columns of a board.
const MOST_COLUMNS: usize = 40;

/// Why none of these grids is a part of the board, as far as markers of its kind are read in them; `None` where none
/// are.
pub fn unnumbered(picture: &Picture, board: &Board, grids: &[Places]) -> Option<Refusal> {
    let dictionary = board.kind.dictionary()?;
    let grid = largest(grids)?;
    let size = (grid.columns, grid.rows);
    let markers_in = |grid: &Places, fields: Fields| markers_in(picture, grid, board.pitch(), fields);
    let all: Vec<(Fields, Vec<Read>)> = fields(board).into_iter().map(|own| (own, markers_in(grid, own))).collect();
    let by_known = |(_, reads): &(Fields, Vec<Read>)| (known_in(dictionary, reads), reads.len());
    let (own, reads) = all.into_iter().max_by_key(by_known)?;
    if let Some(layout) = other_layout(board, size, &reads) {
        let reason = format!("shows the markers in {}; --board says the other", layout.said());
        return Some(Refusal { reason, seen: Some(board.with_layout(layout)) });
    }
    if let Some(squares) = other_counts(board, size, &reads) {
        let (columns, said) = match board.kind {
            Kind::Tags { .. } => {
                (format!("{} columns of tags", squares.columns / 2), format!("{}x{}", board.tags()[0], board.tags()[1]))
            }
            _ => (format!("{} columns", squares.columns), board.squares.to_string()),
        };
        let reason =
            format!("shows the markers of a board of {columns}; --board says {said} (columns first, as printed)");
        return Some(Refusal { reason, seen: Some(Board { squares, ..*board }) });
    }
    if let Said::Place(found) = numbering::place(board, size, &reads) {
        let reason = format!("shows a board larger than {}: its corners go on beyond those", board.said());
        let squares = Squares { rows: rows_seen(&found, size), ..board.squares };
        let is_taller = matches!(board.kind, Kind::Charuco { .. }) && squares.rows > board.squares.rows;
        return Some(Refusal { reason, seen: is_taller.then_some(Board { squares, ..*board }) });
    }
    let mirrored = grid.flip_rows();
    let is_mirrored = |own| numbering::place(board, size, &markers_in(&mirrored, own)) != Said::Nothing;
    if fields(board).into_iter().any(is_mirrored) {
        return Some("shows the board mirrored: the print or the picture is".to_owned().into());
    }
    other_markers(picture, board, (dictionary, own), grid)
}

/// How the reason ends where a grid of corners holds no marker, and the whole of it where there is no grid.
const UNREAD: &str = "and no marker among them that can be read";
const NO_GRID: &str = "no board found";

/// Whether that is why a picture was refused.
pub fn is_unread(refusal: &Refusal) -> bool {
    refusal.reason.ends_with(UNREAD) || refusal.reason == NO_GRID
}

/// What is said of grids in which nothing was read.
pub fn unread(grids: &[Places]) -> Refusal {
    let corners = |grid: &Places| format!("shows {} corners of squares, {UNREAD}", grid.count());
    largest(grids).map_or_else(|| NO_GRID.to_owned(), corners).into()
}

/// The largest of some grids; `None` where it is too small for a square.
fn largest(grids: &[Places]) -> Option<&Places> {
    grids.iter().max_by_key(|grid| grid.count()).filter(|grid| grid.count() >= 4)
}

/// The dictionary of the markers in the squares of a grid, or of the tags, whatever board was asked for: more of them
/// than chance finds.
pub fn dictionary_in(picture: &Picture, grid: &Places, pitch: Pitch) -> Option<Dictionary> {
    /// In the squares of a plain board nothing has a marker's outline; of what lies round it one or two may be read as
    /// one.
    const FEWEST_UNASKED: usize = 4;
    let known = all_fields(pitch, SHARES.into_iter()).into_iter().flat_map(|fields| {
        let reads = markers_in(picture, grid, pitch, fields);
        let all = if reads.len() < FEWEST_UNASKED { Vec::new() } else { Dictionary::all().collect() };
        let of = move |dictionary: Dictionary| (known_in(dictionary, &reads), dictionary, reads.len());
        let is_of = move |dictionary: &Dictionary| pitch == Pitch::Even || dictionary.is_of_tags();
        all.into_iter().filter(is_of).filter(move |dictionary| dictionary.bits() == fields.bits).map(of)
    });
    // Of two that begin alike the smaller.
    let better = |best: Option<(usize, Dictionary, usize)>, next: (usize, Dictionary, usize)| match best {
        Some(best) if best.0 >= next.0 => Some(best),
        _ => Some(next),
    };
    let (count, dictionary, of) = known.fold(None, better)?;
    (count >= FEWEST_UNASKED && 2 * count > of).then_some(dictionary)
}

/// What else the markers of a grid are: of another dictionary, of another size, in another order, or none.
fn other_markers(
    picture: &Picture,
    board: &Board,
    (dictionary, own): (Dictionary, Fields),
    grid: &Places,
) -> Option<Refusal> {
    let is_other = |share: f64| (share - own.share).abs() > 0.03;
    let mut best: Option<(usize, Dictionary, Fields, Vec<Read>)> = None;
    for fields in all_fields(board.pitch(), std::iter::once(own.share).chain(SHARES)) {
        let reads = markers_in(picture, grid, board.pitch(), fields);
        // The board's own first: others begin with the same markers.
        let all = std::iter::once(dictionary).chain(Dictionary::all());
        for other in all.filter(|other| other.bits() == fields.bits) {
            let known = known_in(other, &reads);
            if known >= FEWEST && 2 * known > reads.len() && best.as_ref().is_none_or(|(most, ..)| known > *most) {
                best = Some((known, other, fields, reads.clone()));
            }
        }
    }
    let (_, other, fields, reads) = best?;
    if other != dictionary {
        let reason = format!("shows markers of {}, the board has those of {}", other.said(), dictionary.said());
        return Some(Refusal { reason, seen: board.with_dictionary(other) });
    }
    if matches!(board.kind, Kind::Charuco { .. }) && is_other(fields.share) {
        // Markers are read in squares of several shares that are tried.
        let whole = |read: &Read| Some((read.col.try_into().ok()?, read.row.try_into().ok()?));
        let squares: Vec<(usize, usize)> = reads.iter().filter_map(whole).collect();
        let inverted = 2 * reads.iter().filter(|read| read.marker.inverted).count() > reads.len();
        let seen = measures::seen_share(picture, grid, (&squares, inverted), fields).unwrap_or(fields.share);
        if is_other(seen) {
            return Some(measures::refusal(board, seen * board.square_mm));
        }
    }
    Some(format!("shows markers of {} in another order than {board} has them", dictionary.said()).into())
}

/// How the markers of a board of such a pitch may be divided, those in squares of such shares of them.
fn all_fields(pitch: Pitch, shares: impl Iterator<Item = f64>) -> Vec<Fields> {
    match pitch {
        Pitch::Even => shares.flat_map(|share| (4..=7).map(move |bits| Fields::of_marker(share, bits))).collect(),
        Pitch::Tags { gap } => {
            let borders = TAG_BORDERS.into_iter();
            borders.flat_map(|border| (4..=7).map(move |bits| Fields::of_tag(gap, bits, border))).collect()
        }
    }
}

/// The layout in which a board whose layout was said has the markers that are seen, if that is the other one.
fn other_layout(board: &Board, size: (usize, usize), reads: &[Read]) -> Option<Layout> {
    let Kind::Charuco { layout: Some(said), .. } = board.kind else { return None };
    let other = if said == Layout::New { Layout::Old } else { Layout::New };
    matches!(numbering::place(&board.with_layout(other), size, reads), Said::Place(_)).then_some(other)
}

/// The board with other counts whose order of markers is the one that is seen.
fn other_counts(board: &Board, size: (usize, usize), reads: &[Read]) -> Option<Squares> {
    let mut counts = (3..=MOST_COLUMNS).filter_map(|columns| {
        let rows = match board.kind {
            Kind::Checker => return None,
            Kind::Charuco { dictionary, .. } => (2 * dictionary.count() / columns).min(200),
            Kind::Tags { .. } if columns % 2 == 0 => return None,
            // Tags count from the lowest row up: only the board's own number of rows has them where they are.
            Kind::Tags { .. } => board.squares.rows,
        };
        let squares = Squares { columns, rows };
        let Said::Place(found) = numbering::place(&Board { squares, ..*board }, size, reads) else { return None };
        (found.agreeing >= FEWEST).then_some((found.agreeing, columns, rows_seen(&found, size)))
    });
    let first = counts.next()?;
    let (agreeing, columns, rows_seen) = counts.fold(first, |best, next| if next.0 > best.0 { next } else { best });
    // Columns and rows are easily said in the wrong order.
    let exchanged = Squares { columns: board.squares.rows, rows: board.squares.columns };
    let is_exchanged = || match numbering::place(&Board { squares: exchanged, ..*board }, size, reads) {
        Said::Place(found) => found.agreeing >= agreeing,
        _ => false,
    };
    let rows = match board.kind {
        _ if columns == exchanged.columns && is_exchanged() => exchanged.rows,
        Kind::Tags { .. } => board.squares.rows,
        // Whoever miscounted the columns may have miscounted the rows: those that are seen are sure.
        _ => rows_seen,
    };
    (columns != board.squares.columns).then_some(Squares { columns, rows })
}

/// Rows of squares from the board's first one to the last of which a grid of `size` corners shows a corner.
fn rows_seen(found: &Placement, size: (usize, usize)) -> usize {
    let rows = if found.quarters.is_multiple_of(2) { size.1 } else { size.0 };
    (found.row + rows as isize + 1).max(2) as usize
}

/// How many of what was read are markers of a dictionary, in one of the four directions.
fn known_in(dictionary: Dictionary, reads: &[Read]) -> usize {
    let known = |quarters: usize| {
        let is_known = |read: &&Read| {
            let seen = read.marker.turned(quarters);
            (0..dictionary.count()).any(|id| dictionary.code(id).is_some_and(|code| seen.differs_from(code) == 0))
        };
        reads.iter().filter(is_known).count()
    };
    (0..4).map(known).max().unwrap_or(0)
}
