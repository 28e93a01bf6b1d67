//! The looks at what the new pairs say of a rig against what it was: whether it changed, and what explains that.

use nalgebra::DVector;
use serde::Serialize;

use crate::difference::{Difference, SEEN, TOLD_APART};
use crate::stereo::Side;
use crate::stereo::findings::hypothesis::{self, Hypothesis};
use crate::stereo::model::Layout;
use crate::stereo::pairs::Cause;

/// Chance that a rig that did not change is said to have changed.
const FALSE_ALARM: f64 = 0.01;

/// What the pairs say of one cause.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CauseSeen {
    pub cause: Cause,
    /// For a person: what would have changed.
    #[serde(rename = "what")]
    pub words: String,
    /// By how much it changed, if it alone did, with its standard deviation.
    pub amount: f64,
    /// In the unit of both.
    pub sigma: f64,
    pub unit: &'static str,
    /// By how much that moves a length, mm.
    pub effect_mm: f64,
    /// The smallest change that nineteen of twenty such tests see.
    pub seen: f64,
    /// By how much that one moves a length, mm.
    pub seen_mm: f64,
}

/// What explains a change.
#[derive(Debug, Clone, PartialEq)]
pub enum Explained {
    /// Causes of one number each that are not told apart, the likeliest first, as places in the list of all.
    Causes(Vec<usize>),
    /// The right camera stands and looks otherwise, in more than one way.
    Moved,
    /// One camera's pictures show everything beside where they had it, by so many px across and down.
    Cut { side: Side, by_px: [f64; 2] },
    /// None of them; the place of the one that explains nearly all of it, where one does.
    Nothing { nearest: Option<usize> },
}

/// All looks at a difference: whether something changed, and what.
pub(super) struct Looks<'a> {
    /// To the rig that the pairs give by themselves.
    pub own: &'a Difference,
    /// The same from the old rig on; see `step_from_old`.
    pub from_old: Option<&'a Difference>,
    pub layout: &'a Layout,
    pub hypotheses: &'a [Hypothesis],
    pub corners: usize,
}

impl Looks<'_> {
    /// Chance of a false alarm in one of all looks: every cause, and all numbers together.
    fn chance(&self) -> f64 {
        FALSE_ALARM / (self.hypotheses.len() + 1) as f64
    }

    /// The difference that tells sizes and causes: that to the pairs' own rig, unless a few pairs that contradict each
    /// other have led it away.
    pub fn nearer(&self) -> &Difference {
        const SEVERAL: f64 = 4.0;
        let led_away = |old: &&Difference| self.own.chi_square() > SEVERAL * old.chi_square();
        self.from_old.filter(led_away).unwrap_or(self.own)
    }

    pub fn of_cause(&self, h: &Hypothesis, moves: &impl Fn(&DVector<f64>) -> f64) -> Option<CauseSeen> {
        let difference = self.nearer();
        let (amount, sigma) = difference.along(&h.direction)?;
        let unit_mm = moves(&h.direction);
        let seen = (difference.level(self.chance()) + SEEN) * sigma;
        Some(CauseSeen {
            cause: h.cause,
            words: h.words.to_owned(),
            amount,
            sigma,
            unit: h.unit,
            effect_mm: unit_mm * amount.abs(),
            seen,
            seen_mm: unit_mm * seen,
        })
    }

    /// A change is one from either rig on.
    pub fn is_change(&self) -> bool {
        std::iter::once(self.own).chain(self.from_old).all(|difference| self.differs(difference))
    }

    fn differs(&self, difference: &Difference) -> bool {
        let chance = self.chance();
        let level = difference.level(chance);
        let alone = |h: &Hypothesis| difference.along(&h.direction).is_some_and(|(a, sigma)| a.abs() > level * sigma);
        difference.chi_square() > difference.limit(difference.off.len(), chance) || self.hypotheses.iter().any(alone)
    }

    /// What explains the change: causes that leave no more than chance and are not told apart, the likeliest first; or
    /// another place of the right camera in all six numbers, where that alone leaves no more than chance or does better
    /// by more than its numbers cost.
    pub fn explained(&self) -> Explained {
        let (difference, hypotheses) = (self.nearer(), self.hypotheses);
        let count = difference.off.len();
        let within = |left: f64, freed: usize| left <= difference.limit(count - freed, self.chance());
        let left = |i: usize| Some((difference.left_by(std::slice::from_ref(&hypotheses[i].direction))?, i));
        let mut explain: Vec<(f64, usize)> = (0..hypotheses.len()).filter_map(left).collect();
        explain.retain(|(left, _)| within(*left, 1));
        explain.sort_by(|a, b| a.0.total_cmp(&b.0));
        let place = hypothesis::any_place(self.layout);
        let by_place = difference.left_by(&place).filter(|left| within(*left, place.len()));
        let Some(best) = explain.first().map(|(left, _)| *left) else {
            return by_place.map_or_else(|| self.without_cause(), |_| Explained::Moved);
        };
        let cost = 0.5 * (place.len() - 1) as f64 * (self.corners.max(2) as f64).ln();
        if by_place
            .is_some_and(|left| difference.log_likelihood(left) - difference.log_likelihood(best) - cost > TOLD_APART)
        {
            return Explained::Moved;
        }
        let less_likely = |left: f64| difference.log_likelihood(best) - difference.log_likelihood(left);
        let near = explain.into_iter().filter(|(left, _)| less_likely(*left) < TOLD_APART);
        Explained::Causes(near.map(|(_, i)| i).collect())
    }

    /// What is said of a change that neither a cause of one number nor another place of the right camera explains:
    /// pictures of one side that were cut otherwise, where that leaves no more than chance, else the cause that comes
    /// nearest.
    fn without_cause(&self) -> Explained {
        /// Share of the squared difference that a cause leaves at the most that nearly explains it.
        const NEARLY: f64 = 0.1;
        let difference = self.nearer();
        let limit = difference.limit(difference.off.len() - 2, self.chance());
        let centre = |side: Side| hypothesis::centred(self.layout, side);
        let cut = |side: Side| Some((difference.left_by(&centre(side))?, side));
        let least = Side::BOTH.into_iter().filter_map(cut).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, side)) = least.filter(|(left, _)| *left <= limit)
            && let Some(by_px) = difference.amounts(&centre(side))
        {
            return Explained::Cut { side, by_px: [by_px[0], by_px[1]] };
        }
        let left = |i: usize| Some((difference.left_by(std::slice::from_ref(&self.hypotheses[i].direction))?, i));
        let nearest = (0..self.hypotheses.len()).filter_map(left).min_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = nearest.filter(|(left, _)| *left < NEARLY * difference.chi_square()).map(|(_, i)| i);
        Explained::Nothing { nearest }
    }
}
