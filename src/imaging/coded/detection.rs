//! Boards whose markers number their corners: found in any part of them.
//!
//! In: a picture and the board. Out: a reduced copy and the board's corners on it as far as they are seen, each at its
//! place on the board. Method: grids of corners grow as on a plain board (`super::detect::growth`), on copies from
//! coarse to fine until the markers are large enough to leave the corners alone; the markers in a grid's squares say
//! which part of the board it is (`numbering`). Which squares hold the markers (old and new layout), and whether they
//! are printed white on black, is what is seen. Goes wrong: no marker that can be read; another board, which is named
//! where the markers tell (`explain`).

use nalgebra::Point2;

use super::claim::{self, Claim};
use super::in_grid::{faint_in, markers_in};
use super::marker::{Fields, fields};
use super::numbering::{Placement, Said};
use super::{explain, faint, local_map, measures, numbering, separate};
use crate::imaging::Board;
use crate::imaging::board::{Kind, Pitch, Print};
use crate::imaging::detect::{Detected, Refusal, grids, on_a_copy, right_handed};
use crate::imaging::image::pyramid::{Level, to_full_size};
use crate::imaging::image::{Grey8, Picture};
use crate::imaging::lattice::{Lattice, Places};

/// Squares of so many px of a copy have a margin of so many px round their markers at least: on finer copies nothing
/// more is seen.
pub const ENOUGH_MARGIN_PX: f64 = 5.0;
/// Copies with so many pixels may be enlarged.
const MOST_DOUBLED_PX: usize = 4_000_000;
/// How far from where its neighbours have it a corner may lie, in sides of a square.
const STRAY: f64 = 0.2;
/// Grids that are looked at on a copy, the largest first.
const MOST_GRIDS: usize = 12;

/// Why a part of a board has no number where the layout alone would give it one.
pub const BY_LAYOUT: &str = "shows markers, but none at the board's sides: which corners they are depends on the layout, OpenCV's before or since 4.6";

/// What a picture shows that has a board with markers where one of another kind was looked for.
pub const HAS_MARKERS: &str = "shows a board with markers of ";

/// The same for a grid of tags, with black squares between them or without.
pub const HAS_TAGS: &str = "shows a grid of tags of ";

/// Whether a picture in which nothing of a board was read shows one of another kind with markers or tags.
pub fn of_other_kind(picture: &Picture, asked: &Board) -> Option<String> {
    /// Copies and grids that are looked at: markers that number a board are on the largest of them.
    const COPIES: usize = 2;
    const GRIDS: usize = 3;
    /// Most markers leave at least as much of a square free on each side, and borders of tags are wider.
    const MARGIN: f64 = 0.1;
    /// What Kalibr prints; grids of other gaps are found as long as they are not far from it.
    const GAP: f64 = 0.3;
    let markers = (Pitch::Even, matches!(asked.kind, Kind::Charuco { .. }));
    let tags = (Pitch::Tags { gap: GAP }, matches!(asked.kind, Kind::Tags { .. }));
    let others = [markers, tags].into_iter().filter(|(_, is_asked)| !is_asked);
    let in_grids = others.map(|(pitch, _)| pitch).find_map(|pitch| {
        let dictionary = levels(picture).take(COPIES).find_map(|level| {
            let mut found = grids_on((level, &level.copy(picture)), pitch, MARGIN, false).take(GRIDS);
            found.find_map(|grid| explain::dictionary_in(picture, &grid, pitch))
        })?;
        Some(match pitch {
            Pitch::Even => format!("{HAS_MARKERS}{} in its squares", dictionary.name()),
            Pitch::Tags { .. } => format!("{HAS_TAGS}{}", dictionary.said()),
        })
    });
    in_grids.or_else(|| {
        let family = if tags.1 { None } else { separate::family_seen(picture) };
        family.map(|family| format!("{HAS_TAGS}{}", family.said()))
    })
}

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

/// Copies in their order: from coarse to fine.
pub fn levels(picture: &Picture) -> impl Iterator<Item = Level> + use<> {
    let doubled = (picture.width() * picture.height() <= MOST_DOUBLED_PX).then_some(Level::Doubled);
    to_full_size(picture).chain(doubled)
}

/// The grids of corners on a copy as they lie in the picture, the largest first.
fn grids_on(
    (level, copy): (Level, &Grey8),
    pitch: Pitch,
    margin: f64,
    foreshortened: bool,
) -> impl Iterator<Item = Places> + use<> {
    let in_picture = move |grid: Places| without_strays(right_handed(grid.map(|p| level.to_picture(p))), pitch);
    grids(copy, pitch, margin, foreshortened).into_iter().map(in_picture)
}

/// The grid without corners that lie elsewhere than their neighbours say, the worst first.
pub fn without_strays(mut grid: Places, pitch: Pitch) -> Places {
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
