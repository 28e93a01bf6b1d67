//! Whether the first or the last pairs of a series, which contradict the others, are of another rig.
//!
//! In: the rig of the others, and those pairs. Out: whether one other place of the right camera explains them. Method:
//! each pair by itself tells that place, as well as its corners do and as far as the others scatter about theirs. That
//! all have one in common is compared with one for each, the likelihood of either being that of places drawn as widely
//! as makes it largest: two pairs that each were moved on their own are seldom met by the same six numbers where both
//! tell them, and where they do not tell them that counts for nothing. Goes wrong: a board that moved alike in all of
//! them.

#[cfg(test)]
mod tests;

use nalgebra::{DMatrix, DVector};

use crate::difference::TOLD_APART;
use crate::geometry::rotation_vector;
use crate::imaging::PairCorners;
use crate::stereo::Rig;
use crate::stereo::calibrate::Calibration;
use crate::stereo::init::board_pose::as_two_boards;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::pairs::numbering::seen_on_rig;
use crate::stereo::solve::uncertainty::invert;
use crate::stereo::solve::{Priors, Problem};

/// How widely places are drawn, in doublings of what usual pairs are apart by.
const DOUBLINGS: i32 = 20;

/// Whether pairs that contradict a rig fit one of their own with these lenses.
pub fn is_one(found: &Calibration, lenses: &Rig, pairs: &[&PairCorners]) -> bool {
    evidence(found, lenses, pairs).is_some_and(|evidence| evidence > TOLD_APART)
}

/// Logarithm of the likelihood of one place of the right camera in all pairs over that of one in each.
fn evidence(found: &Calibration, lenses: &Rig, pairs: &[&PairCorners]) -> Option<f64> {
    let [scatter, noise] = found.pair_motion()?;
    let unit = (scatter + noise).map(f64::sqrt);
    let size = pairs.len() * 6;
    let (mut places, mut known) = (DVector::<f64>::zeros(size), DMatrix::<f64>::zeros(size, size));
    for (i, pair) in pairs.iter().enumerate() {
        let (place, covariance) = place(found, lenses, pair)?;
        for a in 0..6 {
            places[6 * i + a] = place[a] / unit[a];
            known[(6 * i + a, 6 * i + a)] += scatter[a] / unit[a].powi(2);
            (0..6).for_each(|b| known[(6 * i + a, 6 * i + b)] += covariance[(a, b)] / (unit[a] * unit[b]));
        }
    }
    let likelihood = |in_common: bool, width: f64| {
        let drawn = |i: usize, j: usize| i % 6 == j % 6 && (in_common || i == j);
        let covariance =
            DMatrix::from_fn(size, size, |i, j| known[(i, j)] + if drawn(i, j) { width * width } else { 0.0 });
        let root = covariance.cholesky()?;
        Some(-0.5 * places.dot(&root.solve(&places)) - root.l().diagonal().map(f64::ln).sum())
    };
    let largest = |in_common: bool| {
        let all = (0..=DOUBLINGS).filter_map(|k| likelihood(in_common, 2f64.powi(k)));
        all.reduce(f64::max)
    };
    Some(largest(true)? - largest(false)?)
}

/// From where the right camera is in the rig to where one pair by itself has it, with its covariance.
fn place(found: &Calibration, lenses: &Rig, pair: &PairCorners) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let view = seen_on_rig(&found.values.shared, &found.board, pair, Some(&found.noise));
    let there = found.rig().right_from_left;
    let mut shared = Shared { rig: Rig { right_from_left: there, ..lenses.clone() }, ..found.values.shared.clone() };
    let [left, right] = as_two_boards(&shared, &view)?;
    let own = there * right * left.inverse();
    shared.rig.right_from_left = own;
    let values = Values { shared, poses: vec![left] };
    let layout = Layout { transform: true, ..Layout::POSES_ONLY };
    let equations = Problem { views: vec![view], values, priors: Priors::NONE }.equations(&layout)?;
    let (matrix, gradient) = equations.blocks.first()?.reduced(0.0)?;
    let inverse = invert(&matrix)?;
    let mut place = -&inverse * gradient;
    let mut turn = place.rows_mut(0, 3);
    turn += rotation_vector(&(own * there.inverse()));
    let mut shift = place.rows_mut(3, 3);
    shift += own.translation.vector - there.translation.vector;
    Some((place, inverse * found.inflation))
}
