//! The stages of imaging in their order: folder, pairs, pictures, boards, corners, agreement.
//!
//! Pictures are worked on in parallel, each worker holds one. What can't be used is kept with its reason; the run fails
//! when fewer pairs remain than the caller needs.

use std::collections::BTreeMap;

use camino::Utf8Path;
use rayon::prelude::*;

use super::cache::{Cache, Look};
use super::detect::Refusal;
use super::folder::{self, PairFiles};
use super::grid::{Grid, Places};
use super::{
    Board, Corner, Corners, Error, PairCorners, Side, Skipped, Squares, beyond, detect, order, overlay, picture, refine,
};
use crate::error::Result;
use crate::files::OutDir;
use crate::progress;

/// What is looked for.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// The board.
    pub board: Board,
    /// The least number of pairs that is of use.
    pub needed: usize,
    /// Where corners of pictures that were measured before are kept.
    pub cache: Option<Cache<'a>>,
    /// Where an overlay picture of each pair goes.
    pub overlays: Option<&'a OutDir>,
}

/// Finds the board's corners in all pairs of a folder, numbered alike in left and right.
///
/// An error where the folder holds no pairs, or fewer than needed show the board.
pub fn find_corners(folder: &Utf8Path, wanted: &Wanted<'_>) -> Result<Corners> {
    let pairing = folder::pair_files(folder)?;
    let mut notes: Vec<String> = pairing.left_out().into_iter().collect();
    let sizes = majority_sizes(&pairing.pairs);
    let bar = progress::bar("looking for the board", 2 * pairing.pairs.len() as u64);
    let seen: Vec<[Look; 2]> = pairing
        .pairs
        .par_iter()
        .map(|files| {
            let (left, right) = rayon::join(
                || look(&files.left, wanted, sizes, &bar),
                || look(&files.right, wanted, [sizes[1], sizes[0]], &bar),
            );
            [left, right]
        })
        .collect();
    bar.finish_and_clear();
    let other = other_size(&seen);
    let (found, skipped) = sort_out(&pairing.pairs, seen);
    let total = pairing.pairs.len();
    if found.len() < wanted.needed {
        return Err(Error::TooFewPairs {
            found: found.len(),
            total,
            needed: wanted.needed,
            board: wanted.board,
            path: folder.to_owned(),
            skipped,
            other,
        }
        .into());
    }
    let pairs = number_alike(found, wanted.board);
    if let Some(out) = wanted.overlays {
        draw(&pairs, &pairing.pairs, out)?;
    }
    if !skipped.is_empty() {
        notes.push(format!("the board was found in {} of {total} pairs", pairs.len()));
    }
    Ok(Corners { board: wanted.board, left_size: sizes[0], right_size: sizes[1], pairs, skipped, notes })
}

/// One picture from file to corners; the reason where that fails. `sizes` are those of this side's pictures and of the other's.
fn look(path: &Utf8Path, wanted: &Wanted<'_>, sizes: [(u32, u32); 2], bar: &indicatif::ProgressBar) -> Look {
    bar.inc(1);
    let [size, other] = sizes;
    // Depends on the other pictures, so it is not a matter for the cache.
    if let Some(found) = picture::size(path).filter(|found| *found != size) {
        let why = match found {
            _ if found == other => ", and those of the other side have its size: are left and right exchanged?",
            _ if found == (size.1, size.0) => ": is it turned by 90 degrees?",
            _ => "",
        };
        return Err(format!("{}x{} px, most others are {}x{}{why}", found.0, found.1, size.0, size.1).into());
    }
    std::fs::read(path).map_err(|e| format!("cannot be read: {e}").into()).and_then(|bytes| {
        let Some(cache) = wanted.cache else { return look_at(bytes, path, wanted.board) };
        let entry = cache.entry(&bytes, wanted.board);
        cache.read(&entry, wanted.board).unwrap_or_else(|| {
            let look = look_at(bytes, path, wanted.board);
            cache.write(&entry, &look);
            look
        })
    })
}

fn look_at(bytes: Vec<u8>, path: &Utf8Path, board: Board) -> Look {
    let picture = picture::decode(&bytes, path)?;
    drop(bytes);
    let detected = detect::detect(&picture, board)?;
    let (columns, rows) = beyond::lines_beyond(&detected);
    if columns + rows > 0 {
        let squares = board.squares;
        return Err(Refusal {
            reason: format!(
                "shows a board larger than {squares} squares: its corners go on beyond those (at least {}x{} squares)",
                squares.columns + columns,
                squares.rows + rows
            ),
            seen: detect::size_seen(&detected).filter(|seen| *seen != squares),
        });
    }
    Ok(refine::refine(&picture, &detected))
}

fn draw(pairs: &[PairCorners], files: &[PairFiles], out: &OutDir) -> Result<()> {
    let bar = progress::bar("drawing overlays", pairs.len() as u64);
    pairs.par_iter().try_for_each(|pair| {
        bar.inc(1);
        let drawn = files.iter().find(|f| f.pair == pair.pair).and_then(|f| overlay::png(f, pair));
        drawn.map_or(Ok(()), |bytes| out.write(&format!("overlays/{}.png", pair.pair), &bytes))
    })?;
    bar.finish_and_clear();
    Ok(())
}

/// The size that most left and most right pictures have; the larger one where two are equally frequent.
fn majority_sizes(pairs: &[PairFiles]) -> [(u32, u32); 2] {
    [Side::Left, Side::Right].map(|side| {
        let mut counts: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        for files in pairs {
            let path = if side == Side::Left { &files.left } else { &files.right };
            // A file that can't be read is met again, and named, when it is decoded.
            if let Some(size) = picture::size(path) {
                *counts.entry(size).or_default() += 1;
            }
        }
        counts.into_iter().max_by_key(|&(size, count)| (count, size)).map_or((0, 0), |(size, _)| size)
    })
}

type Found = (String, Grid<Corner>, Grid<Corner>);

/// The size of board that most of the refused pictures show instead.
fn other_size(seen: &[[Look; 2]]) -> Option<Squares> {
    let refused: Vec<&Refusal> = seen.iter().flatten().filter_map(|look| look.as_ref().err()).collect();
    let mut counts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for squares in refused.iter().filter_map(|refusal| refusal.seen) {
        *counts.entry((squares.columns, squares.rows)).or_default() += 1;
    }
    let ((columns, rows), count) = counts.into_iter().max_by_key(|&(size, count)| (count, size))?;
    (2 * count > refused.len()).then_some(Squares { columns, rows })
}

fn sort_out(files: &[PairFiles], seen: Vec<[Look; 2]>) -> (Vec<Found>, Vec<Skipped>) {
    let (mut found, mut skipped) = (Vec::new(), Vec::new());
    for (files, sides) in files.iter().zip(seen) {
        let pair = files.pair.clone();
        let reason = match sides.map(|look| look.map_err(|refusal| refusal.reason)) {
            [Ok(left), Ok(right)] => {
                found.push((pair, left, right));
                continue;
            }
            [Err(left), Err(right)] if left == right => format!("both pictures: {left}"),
            [Err(left), Err(right)] => format!("left picture: {left}; right picture: {right}"),
            [Err(left), Ok(_)] => format!("left picture: {left}"),
            [Ok(_), Err(right)] => format!("right picture: {right}"),
        };
        skipped.push(Skipped { pair, reason });
    }
    (found, skipped)
}

fn number_alike(found: Vec<Found>, board: Board) -> Vec<PairCorners> {
    let places = |grid: &Grid<Corner>| -> Places { grid.map(|c| c.px) };
    let pairs: Vec<_> = found.iter().map(|(_, left, right)| (places(left), places(right))).collect();
    let turns = order::agreed_turns(&pairs, board);
    found
        .into_iter()
        .zip(turns)
        .map(|((pair, left, right), (turn_left, turn_right))| PairCorners {
            pair,
            left: list(&left.turned(turn_left)),
            right: list(&right.turned(turn_right)),
        })
        .collect()
}

fn list(grid: &Grid<Corner>) -> Vec<Corner> {
    grid.iter().map(|(col, row, corner)| Corner { col, row, ..*corner }).collect()
}
