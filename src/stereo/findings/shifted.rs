//! Pairs of which none fits: is the one side's series shifted against the other's?
//!
//! A picture that failed on one side, in series that are paired by their order or their numbers, gives every later picture the partner of
//! another moment. In: corners of pairs that contradict each other. Out: by how many pairs the right side must be moved for most of
//! them to fit one rig. Method: calibration of each way. Goes wrong: a picture that failed in the middle, which is a shift of a part.

use crate::imaging::{Corners, PairCorners};
use crate::stereo::Error;

/// Shifts that are tried, in pairs.
const TRIED: [isize; 4] = [1, -1, 2, -2];
/// Share of the pairs that must fit one rig then.
const MOST: f64 = 0.8;

/// The error of pairs that contradict each other, or that of a shift where one explains it. `fitting` counts the pairs that fit one rig.
pub fn explain(error: Error, corners: &Corners, fitting: impl Fn(&Corners) -> Option<usize>) -> Error {
    if !matches!(error, Error::Contradiction { .. }) {
        return error;
    }
    let shift = |by: isize| {
        let partners = partners(corners, by);
        let (left, right) = partners.first().map(|(left, right)| (left.pair.clone(), right.pair.clone()))?;
        let pair = |(left, right): &(&PairCorners, &PairCorners)| PairCorners {
            pair: left.pair.clone(),
            left: left.left.clone(),
            right: right.right.clone(),
        };
        let shifted = Corners { pairs: partners.iter().map(pair).collect(), ..corners.clone() };
        let of = shifted.pairs.len();
        let fit = fitting(&shifted).filter(|fit| *fit as f64 >= MOST * of as f64)?;
        Some(Error::Shifted { fit, of, left, right })
    };
    TRIED.into_iter().find_map(shift).unwrap_or(error)
}

/// Each pair whose left picture is taken, with that whose right one is, so many pairs later.
fn partners(corners: &Corners, by: isize) -> Vec<(&PairCorners, &PairCorners)> {
    let pairs = corners.pairs.iter().enumerate();
    pairs.filter_map(|(i, left)| Some((left, corners.pairs.get(i.checked_add_signed(by)?)?))).collect()
}
