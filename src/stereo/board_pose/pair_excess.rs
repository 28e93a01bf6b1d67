//! How far the pairs of a calibration scatter about its rig: what pictures of this rig do.
//!
//! In: a calibration. Out: how many times more than its corners' scatter allows the usual pair disagrees with the
//! common rig, as a variance; what [`crate::stereo::board_pose::series`] finds of a run is compared with it. Pictures
//! that were triggered have one, those of a board that is held by hand more. Method: Rao's score of a change of
//! `right_from_left` at each pair, as for the poses of a run.

use nalgebra::DMatrix;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use crate::imaging::Board;
use crate::stereo::board_pose::answer::POSE_LIMIT;
use crate::stereo::board_pose::print_share::{rig_basis, totals_of_pairs};
use crate::stereo::board_pose::rig_change::consistency::{Change, of_member, of_outsider, of_usual};
use crate::stereo::board_pose::solve::pose_block::Eliminated;
use crate::stereo::calibrate::Calibration;
use crate::stereo::model::Layout;
use crate::stereo::solve::Problem;
use crate::stereo::solve::uncertainty::invert;

/// Two standard deviations of the excess of one pair that chance alone makes, as the median of many has it.
const CHANCE: f64 = 1.5;

/// Finds it; one where it is not beyond chance.
pub fn pair_excess(calibration: &Calibration) -> f64 {
    beyond_chance(&changes(calibration).unwrap_or_default())
}

/// How far the pair disagrees that does most, of those that made the rig: the fall of chi-square by a change at it
/// alone, over the usual excess.
pub fn farthest_pair(calibration: &Calibration) -> Option<f64> {
    let each = changes(calibration)?;
    each.iter().flatten().map(|change| change.fall).max_by(f64::total_cmp).map(|fall| fall / beyond_chance(&each))
}

fn beyond_chance(each: &[Option<Change>]) -> f64 {
    let chance = 1.0 + CHANCE / (each.iter().flatten().count().max(1) as f64).sqrt();
    Some(of_usual(each)).filter(|excess| *excess > chance).unwrap_or(1.0)
}

/// Beyond which a change at one pair or pose that lowers chi-square, over the usual excess, is no scatter of this rig:
/// twice what the farthest pair did that the calibration used (the farthest of some is not the farthest of all), at
/// least what chance does not.
pub fn stray_limit(farthest_pair: Option<f64>) -> f64 {
    const BEYOND: f64 = 2.0;
    POSE_LIMIT.max(BEYOND * farthest_pair.unwrap_or(0.0))
}

/// How the pairs of a calibration scatter about its rig.
#[derive(Debug, Clone, Copy)]
pub struct Usual {
    /// See [`pair_excess`].
    pub excess: f64,
    /// See [`farthest_pair`].
    pub farthest_pair: Option<f64>,
    /// How many pairs told both.
    pub pairs: Option<usize>,
}

impl Usual {
    /// Beyond which a change at a pair that took no part lowers chi-square by more than such pairs do: of few pairs the
    /// excess itself is uncertain, so that the ratio has an F distribution.
    fn limit(&self) -> f64 {
        const CHANGE: f64 = 6.0;
        let limit = stray_limit(self.farthest_pair);
        let Some(pairs) = self.pairs else { return limit };
        // A mean square of so many numbers is as uncertain as the median of the pairs.
        let freedom = 2.0 * pairs as f64 / (CHANCE / 2.0).powi(2);
        let law = FisherSnedecor::new(CHANGE, freedom);
        let chance = ChiSquared::new(CHANGE).map(|one| one.cdf(POSE_LIMIT));
        let of_few = law.ok().zip(chance.ok()).map(|(law, chance)| CHANGE * law.inverse_cdf(chance));
        of_few.map_or(limit, |of_few| limit.max(of_few))
    }
}

/// The pairs that contradict a rig that they did not help to find, at the values of the problem: a change of
/// `right_from_left` at the pair alone gains more than pairs of this rig are known to differ by. `rig` is the rig's
/// covariance in the layout's order.
pub fn strays(problem: &Problem, board: &Board, layout: &Layout, rig: &DMatrix<f64>, usual: Usual) -> Vec<usize> {
    let gains = gains(problem, board, layout, of_outsider, |_| Some(rig.clone())).unwrap_or_default();
    let limit = usual.limit() * usual.excess;
    let beyond = |change: &Change| change.fall > limit;
    let of_pair = |(pair, change): (usize, &Option<Change>)| change.as_ref().filter(|c| beyond(c)).map(|_| pair);
    gains.iter().enumerate().filter_map(of_pair).collect()
}

/// What a change at each pair alone would gain. The rig was fitted to the same pairs, of which few determine it no
/// better than their own change, so that it is free beside the change; the board's shape is held.
fn changes(calibration: &Calibration) -> Option<Vec<Option<Change>>> {
    let Calibration { board, layout, values, priors, .. } = calibration;
    let known = priors.information(layout, &values.shared).matrix;
    gains(&calibration.problem(), board, layout, of_member, |told| {
        let (n, _) = told.shape();
        invert(&(told + known.view((0, 0), (n, n))))
    })
}

/// What a change at each pair alone would gain, beside what the rig's covariance leaves; that may follow from what all
/// pairs say of the rig.
fn gains(
    problem: &Problem,
    board: &Board,
    layout: &Layout,
    gain: fn(&Eliminated, &DMatrix<f64>) -> Option<Change>,
    covariance: impl Fn(&DMatrix<f64>) -> Option<DMatrix<f64>>,
) -> Option<Vec<Option<Change>>> {
    let basis = rig_basis(layout);
    let n = basis.ncols();
    let mut parts = Vec::new();
    let totals = totals_of_pairs(&problem.views, &problem.values, board, &basis, |_, part| parts.push(part))?;
    let rig = covariance(&totals.matrix.view((0, 0), (n, n)).into_owned())?;
    // The board's shape is held.
    let size = totals.matrix.nrows();
    let mut whole = DMatrix::zeros(size, size);
    whole.view_mut((0, 0), (n, n)).copy_from(&rig);
    Some(parts.iter().map(|part| gain(part, &whole)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_of_a_stray_is_the_wider_the_fewer_pairs_told_the_excess() {
        let limit = |pairs, farthest_pair| Usual { excess: 1.0, farthest_pair, pairs }.limit();
        // Quantiles of F with 6 and 3.56 n degrees of freedom, from scipy 1.15, times 6.
        for (pairs, expected) in [(7, 110.40), (20, 60.60), (200, 46.32)] {
            let found = limit(Some(pairs), None);
            assert!((found / expected - 1.0).abs() < 2e-3, "{pairs}: {found}");
        }
        assert_eq!(limit(None, None), POSE_LIMIT);
        assert_eq!(limit(Some(200), Some(100.0)), 200.0);
    }
}
