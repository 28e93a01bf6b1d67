//! All looks at the residuals of an old robot: whether something changed, what explains it, and what would have been
//! seen.
//!
//! In: the residuals with their covariance, and the columns of what may have changed. Out: each cause by itself, and
//! those that explain a change. Goes wrong: causes with the same columns are not told apart, and named together.

use nalgebra::DVector;

use super::compared::Look;
use super::found::{CauseSeen, FALSE_ALARM};
use super::moves::{Moves, Off};
use super::suspects::Suspect;
use crate::difference::{Difference, SEEN, TOLD_APART};
use crate::tables::names::Unit;

/// White size of a cause, a mrad or mm, below which the poses see nothing of it.
const UNSEEN: f64 = 1e-4;

/// A turn that must be larger than this to be seen, rad, is not seen either: up to here a turn moves points along its
/// column to half a hundredth.
const LINEAR_RAD: f64 = 0.1;

/// Chance that a cause is larger than it is said to be at the most.
const MISSED: f64 = 0.05;

/// Rounds of looking anew where a suspect says that the robot is: a large turn is not linear.
const ROUNDS: usize = 3;

/// What so many numbers that are free cost of the logarithm of a likelihood of `count` residuals (Schwarz).
pub(super) fn price(count: usize, numbers: usize) -> f64 {
    0.5 * (count.max(2) as f64).ln() * numbers as f64
}

/// All looks at the residuals.
pub(super) struct Looks<'a> {
    /// At the old robot.
    pub(super) look: Look,
    /// At a robot that is off by these.
    pub(super) again: &'a dyn Fn(&[f64]) -> Option<Look>,
    pub(super) suspects: &'a [Suspect],
}

impl<'a> Looks<'a> {
    /// Chance of a false alarm in one of all looks: every cause, and all numbers together.
    fn chance(&self) -> f64 {
        FALSE_ALARM / (self.suspects.len() + 1) as f64
    }

    pub(super) fn is_seen(&self, suspect: &Suspect) -> bool {
        let is_large = suspect.columns.iter().all(|&(at, _)| self.look.columns.column(at).norm() > UNSEEN);
        let seen_rad = |direction: &DVector<f64>| {
            let along = self.look.difference.along(direction);
            along.map_or(f64::INFINITY, |(_, sigma)| self.seen(sigma * suspect.variance.sqrt()).to_radians())
        };
        let turns = suspect.unit == Unit::Deg.flag();
        is_large && (!turns || self.look.directions(suspect).iter().all(|direction| seen_rad(direction) < LINEAR_RAD))
    }

    /// What nineteen of twenty checks see of something that is known to so much.
    fn seen(&self, sigma: f64) -> f64 {
        (self.look.difference.level(self.chance()) + SEEN) * sigma
    }

    pub(super) fn of(&self, suspect: &Suspect, moves: &Moves) -> CauseSeen {
        let difference = &self.look.difference;
        let along = self.look.directions(suspect).first().and_then(|d| difference.along(d));
        let along = along.map(|(amount, sigma)| (amount, sigma * suspect.variance.sqrt()));
        let amount = along.filter(|_| self.is_seen(suspect));
        let unit_mm = moves.most_mm(&suspect.columns, &[1.0]);
        let seen = amount.map(|(_, sigma)| self.seen(sigma));
        CauseSeen {
            cause: suspect.word.clone(),
            what: suspect.words.clone(),
            unit: suspect.unit,
            amount: amount.map(|(amount, _)| amount),
            sigma: amount.map(|(_, sigma)| sigma),
            effect_mm: amount.map_or(0.0, |(amount, _)| unit_mm * amount.abs()),
            seen,
            seen_mm: seen.map(|seen| unit_mm * seen),
            at_most_mm: amount.map(|(amount, sigma)| unit_mm * (amount.abs() + difference.level(2.0 * MISSED) * sigma)),
        }
    }

    /// By how much a cause may move the target over these poses, if it alone changed: with a chance of nineteen in
    /// twenty, mm. Of a turn the poses leave no more than what would show.
    pub(super) fn room_mm(&self, suspect: &Suspect, over: &Moves) -> f64 {
        let difference = &self.look.difference;
        let [direction] = &self.look.directions(suspect)[..] else { return 0.0 };
        let most = difference.along(direction).map_or(f64::INFINITY, |(amount, sigma)| {
            amount.abs() + difference.level(2.0 * MISSED) * sigma * suspect.variance.sqrt()
        });
        let is_turn = suspect.unit == Unit::Deg.flag();
        over.most_mm(&suspect.columns, &[if is_turn { most.min(LINEAR_RAD.to_degrees()) } else { most }])
    }

    pub(super) fn is_change(&self) -> bool {
        let (difference, chance) = (&self.look.difference, self.chance());
        let over = |suspect: &Suspect| {
            let directions = self.look.directions(suspect);
            let gained = difference.left_by(&directions).map(|left| difference.chi_square() - left);
            self.is_seen(suspect)
                && gained.is_some_and(|g| g > suspect.variance * difference.limit(directions.len(), chance))
        };
        difference.chi_square() > difference.limit(difference.off.len(), chance) || self.suspects.iter().any(over)
    }

    /// Suspects that leave no more than chance and are not told apart, the likeliest first, with the logarithm of their
    /// likelihood and their numbers.
    pub(super) fn explained(&self) -> Vec<(f64, &'a Suspect, Off)> {
        let count = self.look.difference.off.len();
        let mut explain: Vec<(f64, &'a Suspect, Off)> = Vec::new();
        for suspect in self.suspects.iter().filter(|s| self.is_seen(s)) {
            let numbers = suspect.columns.len();
            let Some((left, difference, off)) = self.left_by(suspect) else { continue };
            if left <= difference.limit(count - numbers, self.chance()) {
                explain.push((difference.log_likelihood(left) - price(count, numbers), suspect, off));
            }
        }
        explain.sort_by(|a, b| b.0.total_cmp(&a.0));
        let best = explain.first().map_or(0.0, |(likely, ..)| *likely);
        explain.into_iter().filter(|(likely, ..)| best - likely < TOLD_APART).collect()
    }

    /// What is left of the residuals where a suspect may take what it likes, and what it takes.
    fn left_by(&self, suspect: &Suspect) -> Option<(f64, Difference, Off)> {
        let mut offsets = vec![0.0; self.look.columns.ncols()];
        let mut total = DVector::zeros(suspect.columns.len());
        let mut again = None;
        for _ in 0..ROUNDS {
            let look = again.as_ref().unwrap_or(&self.look);
            total += look.amounts(&look.directions(suspect));
            suspect.columns.iter().zip(total.iter()).for_each(|(&(at, unit), amount)| offsets[at] = unit * amount);
            again = Some((self.again)(&offsets)?);
        }
        let look = again?;
        let directions = look.directions(suspect);
        let left = look.difference.left_by(&directions)?;
        let (information, _) = look.products(&directions);
        let covariance = information.try_inverse()? * suspect.variance;
        let off = Off { columns: suspect.columns.clone(), amounts: total.iter().copied().collect(), covariance };
        Some((left, look.difference, off))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// Whether twelve residuals that are known to `sigma` show anything of a cause that adds its amount to each.
    fn is_seen(unit: &'static str, sigma: f64) -> bool {
        let joint = DMatrix::identity(12, 12) * sigma * sigma;
        let difference = Difference::new(DVector::zeros(12), &joint, 60, 1.0).unwrap();
        let look = Look { difference, columns: DMatrix::from_element(12, 1, 1.0) };
        let suspects =
            [Suspect { word: String::new(), words: String::new(), unit, columns: vec![(0, 1.0)], variance: 1.0 }];
        Looks { look, again: &|_| None, suspects: &suspects }.is_seen(&suspects[0])
    }

    /// Columns hold for small turns only; a shift is linear however large it must be to be seen.
    #[test]
    fn a_turn_that_only_shows_when_it_is_large_is_not_seen_and_such_a_shift_is() {
        let [deg, mm] = [Unit::Deg.flag(), Unit::Mm.flag()];
        assert_eq!([0.1, 1.0, 10.0, 100.0].map(|sigma| is_seen(deg, sigma)), [true, true, false, false]);
        assert_eq!([0.1, 1.0, 10.0, 100.0].map(|sigma| is_seen(mm, sigma)), [true; 4]);
    }
}
