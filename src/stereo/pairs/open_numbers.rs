//! Pairs in which a picture leaves open which of a plain board's corners it shows, numbered by how the cameras stand.
//!
//! In: corners, some pairs with several ways to number them, and a rig: one that is known, or that of the pairs that
//! leave nothing open. Out: the corners with those pairs that are numbered. Method: in a wrong number the board lies at
//! least a square away from where the other picture has it, so every way but the right one misses the rig by many px.
//! Goes wrong: both pictures are cut alike, so that the same wrong number in both fits as well; or the rig misses the
//! pair by as much as a square. Such a pair stays left out.

use rayon::prelude::*;

use crate::imaging::corners::OpenPair;
use crate::imaging::{Board, Corners, PairCorners};
use crate::stereo::Rig;
use crate::stereo::data::View;
use crate::stereo::init::board_pose::misfit_px;
use crate::stereo::model::Shared;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::series;
use crate::stereo::select::options::Options;

/// How many times farther than the right numbering the next one misses the rig.
const SEVERAL: f64 = 6.0;
/// Corners of a picture that are enough to try a numbering on.
const ENOUGH_CORNERS: usize = 40;

/// The corners with the pairs that the rig of the other pairs numbers; as they are where there is no such rig.
pub fn by_other_pairs(corners: Corners, options: &Options) -> Corners {
    if corners.open.is_empty() {
        return corners;
    }
    let found =
        Candidates::new(&corners, options.known.as_ref()).and_then(|candidates| series::find(&candidates, true));
    match found {
        Ok(series) => numbered(corners, &series.problem.values.shared),
        Err(_) => corners,
    }
}

/// The corners with the pairs that a known rig numbers.
pub fn by_rig(corners: Corners, rig: &Rig) -> Corners {
    numbered(corners, &Shared { rig: rig.clone(), shape_mm: FLAT })
}

fn numbered(mut corners: Corners, shared: &Shared) -> Corners {
    let board = corners.board;
    let open = std::mem::take(&mut corners.open);
    let found: Vec<Option<PairCorners>> = open.par_iter().map(|pair| one(pair, &board, shared)).collect();
    let mut names = Vec::new();
    for (open, found) in open.into_iter().zip(found) {
        match found {
            Some(pair) => {
                corners.skipped.retain(|skipped| skipped.pair != pair.pair);
                corners.pairs.insert((open.before + names.len()).min(corners.pairs.len()), pair);
                names.push(open.pair);
            }
            None => corners.open.push(open),
        }
    }
    if !names.is_empty() {
        corners.notes.push(format!(
            "of {} only a part of the board is seen; how the cameras stand tells which corners it shows",
            names.join(", ")
        ));
    }
    corners
}

/// The pair with the only numbers that fit the rig.
fn one(open: &OpenPair, board: &Board, shared: &Shared) -> Option<PairCorners> {
    let [left, right] = &open.sides;
    let ways = left.iter().flat_map(|left| right.iter().map(move |right| (left, right)));
    let all = ways.flat_map(|way| board.turns_left_open().into_iter().map(move |turn| (way, turn)));
    let mut misfits: Vec<(f64, PairCorners)> = all
        .filter_map(|((left, right), turn)| {
            let pair = PairCorners { pair: open.pair.clone(), left: left.clone(), right: right.clone() };
            let mut view = View::new(board, &pair, 0).thinned(ENOUGH_CORNERS);
            view.turn_right(board, turn);
            Some((misfit_px(shared, &view)?.0, pair))
        })
        .collect();
    misfits.sort_by(|a, b| a.0.total_cmp(&b.0));
    let next = misfits.get(1).map_or(f64::INFINITY, |(px, _)| *px);
    misfits.into_iter().next().filter(|(px, _)| SEVERAL * px < next).map(|(_, pair)| pair)
}
