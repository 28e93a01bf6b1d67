//! Boards whose markers number their corners: found in any part of them.
//!
//! In: a picture and the board. Out: a reduced copy and the board's corners on it as far as they are seen, each at its place on the board. Method:
//! grids of corners grow as on a plain board (`super::detect::growth`), on copies from coarse to fine until the markers are large enough to leave
//! the corners alone; the markers in a grid's squares say which part of the board it is (`numbering`). Which squares hold the markers (old and new
//! layout), and whether they are printed white on black, is what is seen. Goes wrong: no marker that can be read; another board, which is
//! named where the markers tell (`explain`).

pub mod dictionary;
mod explain;
pub mod faces;
mod faint;
pub mod local_map;
pub mod marker;
pub mod measures;
mod numbering;

use nalgebra::Point2;

use self::faint::Faint;
use self::marker::{Fields, read};
use self::numbering::{Placement, Read, Said};
use super::board::{Board, Kind, Squares};
use super::detect::{COARSE_PX, Detected, Refusal, grids, on_a_copy, right_handed};
use super::image::{Grey8, Picture};
use super::lattice::{Lattice, Places};
use super::pitch::Pitch;
use super::pyramid::{Level, factor_for};

/// Which squares of a ChArUco board hold markers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layout {
    /// The square in the upper left corner holds none: OpenCV's since 4.6.
    New,
    /// It holds one where the number of rows is even: OpenCV's before.
    Old,
    /// Every other one of every other row, the outermost are gaps: Kalibr's grid of tags.
    Tags,
}

impl Layout {
    /// Those that a board may have; both are the same where the number of rows is odd.
    pub fn of(board: &Board) -> Vec<Layout> {
        if let Kind::Charuco { layout: Some(layout), .. } = board.kind {
            return vec![layout];
        }
        if let Kind::Tags { .. } = board.kind {
            return vec![Layout::Tags];
        }
        if board.squares.rows.is_multiple_of(2) { vec![Layout::New, Layout::Old] } else { vec![Layout::New] }
    }

    /// Its name, for a person.
    pub fn said(self) -> &'static str {
        match self {
            Layout::New => "OpenCV's layout since 4.6",
            Layout::Old => "OpenCV's layout before 4.6",
            Layout::Tags => "Kalibr's layout",
        }
    }

    /// Whether the square in this column and row holds a marker.
    pub fn holds_marker(self, x: isize, y: isize) -> bool {
        match self {
            Layout::New => (x + y).rem_euclid(2) == 1,
            Layout::Old => (x + y).rem_euclid(2) == 0,
            Layout::Tags => x.rem_euclid(2) == 1 && y.rem_euclid(2) == 1,
        }
    }

    /// Whether the square in this column and row is dark: markers stand in light ones, and tags are dark themselves.
    pub fn is_dark(self, x: isize, y: isize) -> bool {
        match self {
            Layout::New | Layout::Old => !self.holds_marker(x, y),
            Layout::Tags => (x + y).rem_euclid(2) == 0,
        }
    }

    /// The number of the marker in a square that holds one, on a board of so many squares: they count row by row, Kalibr's tags from the lowest row up.
    pub fn number(self, Squares { columns, rows }: Squares, x: usize, y: usize) -> usize {
        // Of two rows one holds the larger half.
        let first = match self {
            Layout::New => columns / 2,
            Layout::Old => columns.div_ceil(2),
            Layout::Tags => return (rows - 2 - y) / 2 * (columns / 2) + x / 2,
        };
        y / 2 * columns + if y % 2 == 1 { first } else { 0 } + x / 2
    }
}

/// How a board's markers are printed: what a corner's window must leave out, and what is to be said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Print {
    /// Side of what a square holds beside its own colour, as a share of the square's: of a marker, of a tag's bits without its border.
    pub share: f64,
    /// How far apart the lines of corners are.
    pub pitch: Pitch,
    /// Which squares hold markers.
    pub layout: Layout,
    /// White on black.
    pub inverted: bool,
}

/// Squares of so many px of a copy have a margin of so many px round their markers at least: on finer copies nothing more is seen.
const ENOUGH_MARGIN_PX: f64 = 5.0;
/// Copies with so many pixels may be enlarged.
const MOST_DOUBLED_PX: usize = 4_000_000;
/// How far from where its neighbours have it a corner may lie, in sides of a square.
const STRAY: f64 = 0.2;
/// Widths of a tag's black border, in its bits: Kalibr's, and that of most others who print tags.
const TAG_BORDERS: [usize; 2] = [2, 1];
/// What of the usual contrast a marker has at least: light falls off over a board, but not so far.
const LEAST_CONTRAST: f64 = 0.35;
/// Grids that are looked at on a copy, the largest first.
const MOST_GRIDS: usize = 12;

/// Why a part of a board has no number where the layout alone would give it one.
pub const BY_LAYOUT: &str = "shows markers, but none at the board's sides: which corners they are depends on the layout, OpenCV's before or since 4.6";

/// A part of the board in a picture.
struct Part {
    corners: Places,
    placement: Placement,
    /// How its markers are divided.
    fields: Fields,
}

/// Looks for the board; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    let fields = fields(&board);
    let pitch = board.pitch();
    let Some(margin) = fields.iter().map(|fields| fields.margin()).min_by(f64::total_cmp) else {
        return Err("no board found".to_owned().into());
    };
    let mut best: Option<(Vec<Part>, Level, Grey8)> = None;
    let mut unnumbered: Vec<Places> = Vec::new();
    let mut by_layout = false;
    for level in levels(picture) {
        let copy = level.copy(picture);
        let mut parts: Vec<Part> = Vec::new();
        for grid in grids(&copy, pitch, margin).into_iter().take(MOST_GRIDS) {
            let grid = without_strays(right_handed(grid.map(|p| level.to_picture(p))), pitch);
            match number(picture, &board, &fields, &grid) {
                Numbered::Part(part) => add(&mut parts, part)?,
                Numbered::ByLayout => by_layout = true,
                Numbered::No if unnumbered.len() < MOST_GRIDS => unnumbered.push(grid),
                Numbered::No => {}
            }
        }
        let count = |parts: &[Part]| parts.iter().map(|part| part.corners.count()).sum::<usize>();
        let step_px = parts.first().and_then(|part| part.corners.side_px(pitch)).map_or(0.0, |px| px / level.scale());
        if !parts.is_empty() && best.as_ref().is_none_or(|(known, ..)| count(&parts) > count(known)) {
            best = Some((parts, level, copy));
        }
        if step_px * margin.min(pitch.least()) >= ENOUGH_MARGIN_PX {
            break;
        }
    }
    let Some((parts, level, copy)) = best else {
        if by_layout {
            return Err(BY_LAYOUT.to_owned().into());
        }
        return Err(explain::unnumbered(picture, &board, &unnumbered).into());
    };
    let Part { placement, fields, .. } = parts[0];
    let merged = merged(&board, &parts);
    if let Some(why) = measures::other_markers(picture, &board, &merged, placement.layout, fields) {
        return Err(why.into());
    }
    let print = Print { share: fields.marked(), pitch, layout: placement.layout, inverted: placement.inverted };
    let on_copy = merged.map(|p| level.to_copy(p));
    Ok(Detected { print: Some(print), ..on_a_copy(picture, level, &copy, on_copy) })
}

/// How a board's markers may be divided; none for a board without.
fn fields(board: &Board) -> Vec<Fields> {
    match board.kind {
        Kind::Checker => Vec::new(),
        Kind::Charuco { marker_mm, dictionary, .. } => {
            vec![Fields::of_marker(marker_mm / board.square_mm, dictionary.bits())]
        }
        Kind::Tags { gap_mm, family } => {
            TAG_BORDERS.iter().map(|border| Fields::of_tag(gap_mm / board.square_mm, family.bits(), *border)).collect()
        }
    }
}

/// Copies in their order: from coarse to fine.
fn levels(picture: &Picture) -> Vec<Level> {
    let mut factor = factor_for(picture, COARSE_PX);
    let mut levels = vec![Level::Reduced(factor)];
    while factor > 1 {
        factor = factor.div_ceil(2);
        levels.push(Level::Reduced(factor));
    }
    if picture.width() * picture.height() <= MOST_DOUBLED_PX {
        levels.push(Level::Doubled);
    }
    levels
}

/// The grid without corners that lie elsewhere than their neighbours say, the worst first.
fn without_strays(mut grid: Places, pitch: Pitch) -> Places {
    loop {
        let Some(step) = grid.side_px(pitch) else { return grid };
        let off = |(col, row, p): (usize, usize, &Point2<f64>)| {
            let at = local_map::predicted(&grid, pitch, (col as isize, row as isize))?;
            Some(((at - p).norm() / step, row * grid.columns + col))
        };
        let worst = grid.iter().filter_map(off).max_by(|a, b| a.0.total_cmp(&b.0));
        match worst {
            Some((off, at)) if off > STRAY => grid.cells[at] = None,
            _ => return grid,
        }
    }
}

/// The squares in and round a grid that may hold markers, by the corner before each.
fn squares_of(grid: &Places, pitch: Pitch) -> impl Iterator<Item = (isize, isize)> {
    let (columns, rows) = (grid.columns as isize, grid.rows as isize);
    let all = (-1..rows).flat_map(move |row| (-1..columns).map(move |col| (col, row)));
    // A lattice of tags begins with one.
    let may_hold = move |at: &(isize, isize)| pitch == Pitch::Even || Layout::Tags.holds_marker(at.0 + 1, at.1 + 1);
    let is_near = |&(col, row): &(isize, isize)| {
        [(0, 0), (1, 0), (1, 1), (0, 1)].iter().any(|(c, r)| grid.around(col + c, row + r).is_some())
    };
    all.filter(may_hold).filter(is_near)
}

/// What the markers in and round a grid are.
fn markers_in(picture: &Picture, grid: &Places, pitch: Pitch, fields: Fields) -> Vec<Read> {
    let one = |(col, row)| {
        let corners = local_map::square(grid, pitch, (col, row))?;
        Some(Read { col, row, marker: read(picture, &corners, fields)? })
    };
    let mut reads: Vec<Read> = squares_of(grid, pitch).filter_map(one).collect();
    // A plain square whose neighbours blur into it looks like a marker of hardly any contrast.
    let mut contrasts: Vec<f64> = reads.iter().map(|read| read.marker.contrast).collect();
    contrasts.sort_by(f64::total_cmp);
    let usual = contrasts.get(3 * contrasts.len() / 4).copied().unwrap_or(0.0);
    reads.retain(|read| read.marker.contrast > LEAST_CONTRAST * usual);
    reads
}

/// How dark the bits are in the squares in and round a grid.
fn faint_in(picture: &Picture, grid: &Places, board: &Board, fields: Fields) -> Vec<Faint> {
    let one = |square| {
        let corners = local_map::square(grid, board.pitch(), square)?;
        Some(Faint { square, darkness: marker::darkness(picture, &corners, fields)? })
    };
    squares_of(grid, board.pitch()).filter_map(one).collect()
}

/// A grid with what its markers say.
enum Numbered {
    Part(Part),
    ByLayout,
    No,
}

/// A grid as a part of the board.
fn number(picture: &Picture, board: &Board, fields: &[Fields], grid: &Places) -> Numbered {
    let size = (grid.columns, grid.rows);
    let one_by_one = fields.iter().map(|fields| {
        let reads = markers_in(picture, grid, board.pitch(), *fields);
        (*fields, numbering::place(board, size, &reads))
    });
    let together =
        fields.iter().map(|fields| (*fields, faint::place(board, size, &faint_in(picture, grid, board, *fields))));
    let (fields, placement) = match one_by_one.chain(together).find(|(_, said)| *said != Said::Nothing) {
        Some((fields, Said::Place(placement))) => (fields, placement),
        Some((_, Said::ByLayout)) => return Numbered::ByLayout,
        Some((_, Said::Nothing)) | None => return Numbered::No,
    };
    let turned = grid.turned(placement.quarters);
    if goes_beyond(board, &turned, &placement) {
        return Numbered::No;
    }
    let corners = Lattice::from_fn(board.columns(), board.rows(), |col, row| {
        turned.around(col as isize - placement.col, row as isize - placement.row).copied()
    });
    if corners.count() > 0 { Numbered::Part(Part { corners, placement, fields }) } else { Numbered::No }
}

/// True where corners of a grid go on beyond the board on some side, a line of them: it is another board, or its markers are in the other squares.
fn goes_beyond(board: &Board, turned: &Places, placement: &Placement) -> bool {
    let (columns, rows) = (board.columns() as isize, board.rows() as isize);
    let (mut beyond, mut lines) = ([0; 4], [0; 4]);
    for (col, row, _) in turned.iter() {
        let (x, y) = (col as isize + placement.col, row as isize + placement.row);
        let sides = [(-1 - x, y, rows), (x - columns, y, rows), (-1 - y, x, columns), (y - rows, x, columns)];
        for (k, (past, along, count)) in sides.into_iter().enumerate() {
            let is_along = (0..count).contains(&along);
            beyond[k] += usize::from(past == 0 && is_along);
            lines[k] += usize::from(past == -1 && is_along);
        }
    }
    (0..4).any(|k| beyond[k] >= 2 && 2 * beyond[k] > lines[k])
}

/// Adds a part of the board, the largest first; an error where it is a part of another board of the same kind.
fn add(parts: &mut Vec<Part>, part: Part) -> Result<(), Refusal> {
    let elsewhere = |known: &Part| {
        let step = known.corners.step_px().unwrap_or(0.0);
        let apart = part.corners.iter().filter_map(|(c, r, p)| Some((p - known.corners.get(c, r)?).norm()));
        let (mut same, mut other) = (0, 0);
        apart.for_each(|px| if px < 0.5 * step { same += 1 } else { other += 1 });
        (same, other)
    };
    for known in parts.iter() {
        let (same, other) = elsewhere(known);
        if other > same {
            return if part.placement.agreeing >= 2 && known.placement.agreeing >= 2 {
                Err("shows two boards with the same markers: cover one of them".to_owned().into())
            } else {
                Ok(())
            };
        }
    }
    if parts.iter().all(|known| known.placement.layout == part.placement.layout) {
        parts.push(part);
    }
    Ok(())
}

fn merged(board: &Board, parts: &[Part]) -> Places {
    Lattice::from_fn(board.columns(), board.rows(), |col, row| {
        parts.iter().find_map(|part| part.corners.get(col, row).copied())
    })
}

#[cfg(test)]
mod tests;

#[cfg(test)]
mod layouts {
    use super::*;

    #[test]
    fn markers_count_row_by_row() {
        for (columns, rows) in [(4, 5), (5, 4), (11, 8), (8, 11), (7, 7), (6, 6)] {
            for layout in [Layout::New, Layout::Old] {
                let mut next = 0;
                for y in 0..rows {
                    for x in 0..columns {
                        if layout.holds_marker(x as isize, y as isize) {
                            assert_eq!(
                                layout.number(Squares { columns, rows }, x, y),
                                next,
                                "{columns}x{rows} {layout:?} {x} {y}"
                            );
                            next += 1;
                        }
                    }
                }
            }
        }
    }
}
