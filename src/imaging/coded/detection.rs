//! Boards whose markers number their corners: found in any part of them.
//!
//! In: a picture and the board. Out: a reduced copy and the board's corners on it as far as they are seen, each at its
//! place on the board. Method: grids of corners grow as on a plain board (`super::detect::growth`), on copies from
//! coarse to fine until the markers are large enough to leave the corners alone; the markers in a grid's squares say
//! which part of the board it is (`numbering`). Which squares hold the markers (old and new layout), and whether they
//! are printed white on black, is what is seen. Goes wrong: no marker that can be read; another board, which is named
//! where the markers tell (`explain`).

use self::claim::Claim;
use super::copies::{ENOUGH_MARGIN_PX, grids_on, levels, without_strays};
use super::in_grid::{faint_in, markers_in};
use super::marker::{Fields, fields};
use super::numbering::{Placement, Said};
use super::other_kind::of_other_kind;
use super::{explain, faint, measures, numbering};
use crate::imaging::Board;
use crate::imaging::board::Print;
use crate::imaging::detect::{Detected, Refusal, on_a_copy};
use crate::imaging::image::pyramid::Level;
use crate::imaging::image::{Grey8, Picture};
use crate::imaging::lattice::{Lattice, Places};

mod claim;

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
    let count = |parts: &[Part]| merged(&board, parts).count();
    let mut best: Option<(Vec<Part>, Level, Grey8)> = None;
    let mut missed = Missed::default();
    for level in levels(picture) {
        let copy = level.copy(picture);
        let parts = parts_on(picture, &board, (&fields, margin), (level, &copy), &mut missed)?;
        // Of a part of a board: the rest may be farther away.
        let is_whole = count(&parts) == board.corner_count();
        let side_px = |part: &Part| if is_whole { part.corners.side_px(pitch) } else { part.corners.least_step_px() };
        let step_px = parts.first().and_then(side_px).map_or(0.0, |px| px / level.scale());
        if !parts.is_empty() && best.as_ref().is_none_or(|(known, ..)| count(&parts) > count(known)) {
            best = Some((parts, level, copy));
        }
        if step_px * margin.min(pitch.least()) >= ENOUGH_MARGIN_PX {
            break;
        }
    }
    let Some((parts, level, copy)) = best else {
        if missed.by_layout {
            return Err(BY_LAYOUT.to_owned().into());
        }
        let grids = &missed.unnumbered;
        let other = || of_other_kind(picture, &board).map(Refusal::from);
        return Err(explain::unnumbered(picture, &board, grids)
            .or_else(other)
            .unwrap_or_else(|| explain::unread(grids)));
    };
    let Part { placement, fields, .. } = parts[0];
    let merged = merged(&board, &parts);
    let as_printed = (placement.layout, placement.inverted);
    if let Some(refusal) = measures::other_markers(picture, &board, &merged, as_printed, fields) {
        return Err(refusal);
    }
    let print = Print { share: fields.marked(), pitch, layout: placement.layout, inverted: placement.inverted };
    let on_copy = merged.map(|p| level.to_copy(p));
    Ok(Detected { print: Some(print), ..on_a_copy(picture, level, &copy, on_copy) })
}

/// What was seen of a board and has no number.
#[derive(Default)]
struct Missed {
    unnumbered: Vec<Places>,
    /// Whether the layout would number some.
    by_layout: bool,
}

/// The parts of the board on one copy. Where they are not all of it, the grids of foreshortened squares are parts too.
fn parts_on(
    picture: &Picture,
    board: &Board,
    (fields, margin): (&[Fields], f64),
    copy: (Level, &Grey8),
    missed: &mut Missed,
) -> Result<Vec<Part>, Refusal> {
    let mut parts: Vec<Part> = Vec::new();
    for foreshortened in [false, true] {
        if merged(board, &parts).count() == board.corner_count() {
            break;
        }
        for grid in grids_on(copy, board.pitch(), margin, foreshortened).take(MOST_GRIDS) {
            match number(picture, board, fields, &grid) {
                Ok(part) => add(board, &mut parts, part)?,
                Err(Said::ByLayout) => missed.by_layout = true,
                Err(_) if missed.unnumbered.len() < MOST_GRIDS => missed.unnumbered.push(grid),
                Err(_) => {}
            }
        }
    }
    Ok(parts)
}

/// A grid as a part of the board; else what its markers say.
fn number(picture: &Picture, board: &Board, fields: &[Fields], grid: &Places) -> Result<Part, Said> {
    let size = (grid.columns, grid.rows);
    let one_by_one = fields.iter().map(|fields| {
        let reads = markers_in(picture, grid, board.pitch(), *fields);
        (*fields, numbering::place(board, size, &reads))
    });
    let together =
        fields.iter().map(|fields| (*fields, faint::place(board, size, &faint_in(picture, grid, board, *fields))));
    let (fields, placement) = match one_by_one.chain(together).find(|(_, said)| *said != Said::Nothing) {
        Some((fields, Said::Place(placement))) => (fields, placement),
        Some((_, said)) => return Err(said),
        None => return Err(Said::Nothing),
    };
    let turned = grid.turned(placement.quarters);
    if goes_beyond(board, &turned, &placement) {
        return Err(Said::Nothing);
    }
    let corners = Lattice::from_fn(board.columns(), board.rows(), |col, row| {
        turned.around(col as isize - placement.col, row as isize - placement.row).copied()
    });
    if corners.count() > 0 { Ok(Part { corners, placement, fields }) } else { Err(Said::Nothing) }
}

/// True where corners of a grid go on beyond the board on some side, a line of them: it is another board, or its
/// markers are in the other squares.
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
fn add(board: &Board, parts: &mut Vec<Part>, mut part: Part) -> Result<(), Refusal> {
    let is_elsewhere = |known: &Part, part: &Part| {
        let step = known.corners.step_px().unwrap_or(0.0);
        let apart = part.corners.iter().filter_map(|(c, r, p)| Some((p - known.corners.get(c, r)?).norm()));
        let (mut same, mut other) = (0, 0);
        apart.for_each(|px| if px < 0.5 * step { same += 1 } else { other += 1 });
        other > same
    };
    while let Some(at) = parts.iter().position(|known| is_elsewhere(known, &part)) {
        let known = &mut parts[at];
        match claim::claim(board, &known.corners, &part.corners) {
            Claim::TwoBoards if part.placement.agreeing >= 2 && known.placement.agreeing >= 2 => {
                return Err("shows two boards with the same markers: cover one of them".to_owned().into());
            }
            Claim::TwoBoards => return Ok(()),
            Claim::First(corners) => {
                known.corners = corners;
                return Ok(());
            }
            Claim::Second(corners) => {
                part.corners = corners;
                parts.remove(at);
            }
        }
    }
    if parts.iter().all(|known| known.placement.layout == part.placement.layout) {
        parts.push(part);
    }
    Ok(())
}

/// The corners of all parts; those of the first where several have one. A small grid has too few corners to tell by
/// itself that one of them strays.
fn merged(board: &Board, parts: &[Part]) -> Places {
    let corners = Lattice::from_fn(board.columns(), board.rows(), |col, row| {
        parts.iter().find_map(|part| part.corners.get(col, row).copied())
    });
    if parts.len() > 1 { without_strays(corners, board.pitch()) } else { corners }
}
