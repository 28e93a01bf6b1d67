//! Pairs of which none fits: did something happen to all pictures of one side?
//!
//! A picture that failed on one side, in series that are paired by their order or their numbers, gives every later
//! picture the partner of another moment; a program mirrors or inverts what it saves of one camera. In: corners of
//! pairs that contradict each other. Out: what, undone in the right pictures, makes most of the pairs fit one rig.
//! Method: calibration of each way. Goes wrong: a picture that failed in the middle, which is a shift of a part.

use crate::imaging::input::pairs::natural_order;
use crate::imaging::{Corner, Corners, PairCorners};
use crate::stereo::Error;
use crate::stereo::error::OneSide;
use crate::stereo::pairs::mixups::mirror;

/// Shifts that are tried, in pairs.
const TRIED: [isize; 4] = [1, -1, 2, -2];
/// Share of the pairs that must fit one rig then.
const MOST: f64 = 0.8;

/// The error of pairs that contradict each other, or that of what happened to one side where that explains it.
/// `fitting` counts the pairs that fit one rig.
pub fn explain(error: Error, corners: &Corners, fitting: impl Fn(&Corners) -> Option<usize>) -> Error {
    if !matches!(error, Error::Contradiction { .. }) {
        return error;
    }
    let enough = |changed: &Corners| {
        let of = changed.pairs.len();
        fitting(changed).filter(|fit| *fit as f64 >= MOST * of as f64).map(|fit| (fit, of))
    };
    let shift = |by: isize| {
        let partners = partners(corners, by);
        let (left, right) = partners.first().map(|(left, right)| (left.pair.clone(), right.pair.clone()))?;
        let pair = |(left, right): &(&PairCorners, &PairCorners)| PairCorners {
            pair: left.pair.clone(),
            left: left.left.clone(),
            right: right.right.clone(),
        };
        let (fit, of) = enough(&Corners { pairs: partners.iter().map(pair).collect(), ..corners.clone() })?;
        Some(Error::Shifted { fit, of, left, right })
    };
    let turns = || corners.board.turns_of_outline().into_iter();
    let changed = |what: OneSide, quarters: usize| {
        let (fit, of) = enough(&with_right(corners, what, quarters))?;
        Some(Error::ChangedSide { what, fit, of })
    };
    let open = corners.board.turns_left_open();
    let shifted = TRIED.into_iter().find_map(shift);
    shifted
        .or_else(|| turns().find_map(|quarters| changed(OneSide::Mirrored, quarters)))
        .or_else(|| turns().filter(|q| !open.contains(q)).find_map(|quarters| changed(OneSide::Inverted, quarters)))
        .unwrap_or(error)
}

/// Each pair whose left picture is taken, with that whose right one is, so many pairs later; pairs in which no board
/// was found count.
fn partners(corners: &Corners, by: isize) -> Vec<(&PairCorners, &PairCorners)> {
    let mut names: Vec<&str> = corners.skipped.iter().map(|pair| pair.pair.as_str()).collect();
    names.extend(corners.pairs.iter().map(|pair| pair.pair.as_str()));
    names.sort_by(|a, b| natural_order(a, b));
    names.dedup();
    let named = |at: usize| corners.pairs.iter().find(|pair| Some(&pair.pair.as_str()) == names.get(at));
    (0..names.len()).filter_map(|at| Some((named(at)?, named(at.checked_add_signed(by)?)?))).collect()
}

/// The corners with what was done to the right pictures undone, and numbered after so many quarter turns.
fn with_right(corners: &Corners, what: OneSide, quarters: usize) -> Corners {
    let (board, (width, height)) = (&corners.board, corners.right_size);
    let undone = |corner: &Corner| {
        let (px, place) = match what {
            // Numbered so that the board faces the viewer, its rows run the other way.
            OneSide::Mirrored => {
                (mirror(corner.px, f64::from(width), f64::from(height)), (corner.col, board.rows() - 1 - corner.row))
            }
            OneSide::Inverted => (corner.px, (corner.col, corner.row)),
        };
        let ((col, row), mut reach) = (board.turned(place, quarters), corner.reach);
        if !quarters.is_multiple_of(2) {
            reach.iter_mut().for_each(|reach| reach.reverse());
        }
        Corner { col, row, px, reach, ..*corner }
    };
    let mut changed = corners.clone();
    for pair in &mut changed.pairs {
        pair.right = pair.right.iter().map(undone).collect();
        pair.right.sort_by_key(|corner| (corner.row, corner.col));
    }
    changed
}
