//! What a board in rectified pictures says of them: whether their rows agree, and whether it comes out as large as it
//! is.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use rayon::prelude::*;

use super::super::Result;
use crate::cli::Rectify;
use crate::config::Config;
use crate::formats::rectified::{RectifiedFile, RectifiedPair};
use crate::imaging::find::find_pair;
use crate::imaging::input::pairs::PairFiles;
use crate::imaging::{Board, PairCorners, Wanted};
use crate::progress;
use crate::stereo::model::rectification::{Matrices, SizeResidual, row_differences, row_residual};

/// Pairs on which each board is looked for before it is taken as not there: on pictures of something else the search
/// takes seconds.
const FIRST_LOOKED_AT: usize = 4;

/// The board that the pictures show, and its corners in the rectified pictures.
pub(super) struct Found {
    pub board: Board,
    pub pairs: Vec<PairCorners>,
}

/// The boards that may be in the pictures: where no other is named the one that calibrated first.
pub(super) fn boards(args: &Rectify, config: &Config, calibrated: Option<Board>) -> Result<Vec<Board>> {
    let check = config.check_board.board(args.board, args.squares, None)?;
    let target = config.target_board.board(args.board, args.squares, None)?;
    // Named by its squares alone it is still the one whose size is known.
    let is_meant = |board: &Board| args.board.is_none() && args.squares.is_none_or(|squares| squares == board.squares);
    let mut boards = Vec::new();
    for board in calibrated.filter(is_meant).into_iter().chain([check, target]) {
        if boards.iter().all(|other: &Board| other.key() != board.key()) {
            boards.push(board);
        }
    }
    Ok(boards)
}

/// The first of the boards that the pictures show, or another that most of them show instead: rows are those of any
/// board.
pub(super) fn look_for(pairs: &[PairFiles], boards: &[Board]) -> Option<Found> {
    let look = |board: Board, pairs: &[PairFiles]| -> Vec<_> {
        let bar = progress::bar("looking for the board", pairs.len() as u64);
        let wanted = Wanted { board, needed: 1, mosaic: None, cache: None, overlays: None };
        let look = |files: &PairFiles| {
            bar.inc(1);
            find_pair(files, &wanted)
        };
        pairs.par_iter().map(look).collect()
    };
    let (first, others) = pairs.split_at(pairs.len().min(FIRST_LOOKED_AT));
    let mut next: VecDeque<Board> = boards.iter().copied().collect();
    let mut tried = BTreeSet::new();
    while let Some(board) = next.pop_front() {
        if !tried.insert(board.key()) {
            continue;
        }
        let looks = look(board, first);
        let is_asked = boards.iter().any(|asked| asked.key() == board.key());
        if looks.iter().all(Result::is_err) {
            let instead = looks.iter().filter_map(|look| look.as_ref().err()?.seen);
            shown_by_half(instead, first.len())
                .filter(|_| is_asked)
                .into_iter()
                .for_each(|other| next.push_front(other));
            continue;
        }
        if !is_asked {
            let (asked, seen) = (named(boards), board.squares);
            progress::note(format!("no board of {asked} is seen: the corners are those of one of {seen} squares"));
        }
        let found: Vec<PairCorners> = looks.into_iter().chain(look(board, others)).filter_map(Result::ok).collect();
        // Of a plain board that a rectified picture cuts, one picture alone does not tell which columns are missing.
        let is_whole = |pair: &PairCorners| {
            board.is_coded() || [&pair.left, &pair.right].iter().all(|corners| corners.len() == board.corner_count())
        };
        let whole: Vec<PairCorners> = found.iter().filter(|pair| is_whole(pair)).cloned().collect();
        return Some(Found { board, pairs: if whole.is_empty() { found } else { whole } });
    }
    None
}

/// The board that at least half of so many pairs show.
fn shown_by_half(boards: impl Iterator<Item = Board>, of: usize) -> Option<Board> {
    let mut counts: BTreeMap<String, (usize, Board)> = BTreeMap::new();
    boards.for_each(|board| counts.entry(board.key()).or_insert((0, board)).0 += 1);
    let (count, board) = counts.into_values().max_by_key(|(count, _)| *count)?;
    (2 * count >= of).then_some(board)
}

/// Boards for a person.
fn named(boards: &[Board]) -> String {
    let one = |board: &Board| if board.is_coded() { board.to_string() } else { board.squares.to_string() };
    boards.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// The pairs with how well their rows agree, and the one that agrees worst; what the boards' size says of the
/// disparities, where it is known.
pub(super) fn judge(
    mut file: RectifiedFile,
    kept: Vec<(String, [String; 2])>,
    found: Option<Found>,
    asked: &[Board],
) -> (RectifiedFile, Option<PairCorners>) {
    let (board, found) = found.map_or((None, Vec::new()), |found| (Some(found.board), found.pairs));
    let in_columns = file.common == Some("columns");
    let differences = |pair: &PairCorners| -> Vec<f64> {
        row_differences(pair, in_columns).into_iter().map(|(_, difference)| difference).collect()
    };
    let residual = |name: &str| row_residual(&differences(found.iter().find(|p| p.pair == name)?));
    let pairs: Vec<RectifiedPair> = kept
        .into_iter()
        .map(|(pair, [left, right])| RectifiedPair { residual: residual(&pair), pair, left, right })
        .collect();
    let all: Vec<f64> = found.iter().flat_map(&differences).collect();
    let worst = pairs
        .iter()
        .filter_map(|p| Some((p.residual?.rms_px, &p.pair)))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .and_then(|(_, name)| found.iter().find(|p| p.pair == *name).cloned());
    (file.pairs, file.looked_for) = (pairs, named(asked));
    match board {
        Some(board) => (file.with_residual(board, row_residual(&all)), worst),
        None => (file, None),
    }
}

/// How large the board comes out that calibrated the rig, where it is the one that was found, beside what lengths can
/// be trusted to, mm.
pub(super) fn size(
    found: Option<&Found>,
    calibrated: Option<Board>,
    matrices: Option<&Matrices>,
    trusted_mm: Option<f64>,
) -> Option<SizeResidual> {
    let found = found.filter(|found| Some(found.board) == calibrated)?;
    SizeResidual::of(&found.pairs, &found.board, matrices?, trusted_mm)
}
