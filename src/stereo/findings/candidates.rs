//! What may explain a change over the series, and which of it does.
//!
//! In: the pairs as a linear problem, and which share of the change each has. Out: what is not told apart from what
//! explains most, that first. Method: each candidate frees its numbers; its likelihood, less what its numbers cost, is
//! compared. A cause of one number that does as well as more of them is what happened. A lens that is focused moves its
//! picture as well, which one number does not say; that looks much like a camera that turned, and is told where the
//! focal length itself is needed. Goes wrong: a camera that moved and was focused at once.

use nalgebra::DVector;

use crate::diagnostic::two_digits;
use crate::difference::{Difference, TOLD_APART};
use crate::stereo::findings::hypothesis::{Hypothesis, any_axis, any_place, centred, refocused};
use crate::stereo::findings::series::Change;
use crate::stereo::model::Layout;
use crate::stereo::pairs::Cause;
use crate::stereo::{Rig, Side};

enum What<'a> {
    One(&'a Hypothesis),
    /// The lens of a side was focused otherwise: its focal length and where its picture lies.
    Refocused(Side),
    /// The right camera turned about any axis: what holds it gives way along one that is none of its own.
    Turned,
    /// The right camera stands and looks otherwise, in all six numbers.
    Elsewhere,
}

/// A cause with its numbers, and what it explains.
pub(super) struct Candidate<'a> {
    what: What<'a>,
    directions: Vec<DVector<f64>>,
    pub change: Change,
}

impl<'a> Candidate<'a> {
    /// All of them for a change of which it is known what each cause takes of it; `pairs` tell that.
    pub fn all(
        change: &impl Fn(&[DVector<f64>]) -> Option<Change>,
        pairs: usize,
        hypotheses: &'a [Hypothesis],
        (layout, rig): (&Layout, &Rig),
        is_step: bool,
    ) -> Vec<Candidate<'a>> {
        let of = |what: What<'a>, directions: Vec<DVector<f64>>| {
            Some(Candidate { change: change(&directions)?, what, directions })
        };
        let one = |h: &'a Hypothesis| of(What::One(h), vec![h.direction.clone()]);
        let mut all: Vec<Candidate> = hypotheses.iter().filter_map(one).collect();
        // Several numbers need more pairs than they are; several that drift at once are no cause, but those of one turn.
        let are_enough = |numbers: usize| pairs > numbers + 2;
        let tells = |numbers: usize| is_step && are_enough(numbers);
        let axes = any_axis(layout, rig);
        if are_enough(axes.len()) {
            all.extend(of(What::Turned, axes.to_vec()));
        }
        let place = any_place(layout);
        if tells(place.len()) {
            all.extend(of(What::Elsewhere, place));
        }
        let scatter = least_scatter(&all);
        for side in Side::BOTH.into_iter().filter(|_| tells(3)) {
            let centre = centred(layout, side);
            let focus = refocused(layout, rig, &[side], 0.01);
            let refocused = of(What::Refocused(side), [&[focus][..], &centre].concat());
            let moved = change(&centre);
            // A picture that moved without a focus is no lens that was focused.
            let is_needed = |refocused: &Candidate| {
                let cost = 0.5 * (pairs as f64).ln();
                let gain = |moved: &Change| 0.5 * (refocused.change.gain - moved.gain) / scatter;
                moved.as_ref().is_some_and(|moved| gain(moved) - cost > TOLD_APART)
            };
            all.extend(refocused.filter(is_needed));
        }
        all
    }

    pub fn cause(&self) -> Cause {
        match self.what {
            What::One(h) => h.cause,
            What::Refocused(_) => Cause::Focus,
            What::Turned | What::Elsewhere => Cause::CameraMoved,
        }
    }

    /// What it leaves of a difference of two rigs.
    pub fn left(&self, difference: &Difference) -> Option<f64> {
        difference.left_by(&self.directions)
    }

    /// The change of the shared numbers, whole.
    pub fn whole(&self) -> DVector<f64> {
        let sum = DVector::zeros(self.directions[0].len());
        self.directions.iter().zip(self.change.amounts.iter()).fold(sum, |sum, (d, a)| sum + d * *a)
    }

    /// By how much, with its unit.
    pub fn size(&self) -> (f64, &'static str) {
        let amounts = &self.change.amounts;
        match self.what {
            What::One(h) => (amounts[0], h.unit),
            What::Refocused(_) => (amounts[0], "%"),
            What::Turned => (amounts.norm(), "deg"),
            What::Elsewhere => (amounts.rows(0, 3).norm().to_degrees(), "deg"),
        }
    }

    fn words(&self) -> String {
        let (size, unit) = self.size();
        let amounts = &self.change.amounts;
        match self.what {
            What::One(h) => format!("{} by {size:.3} {unit} (+- {})", h.words, two_digits(2.0 * self.change.sigma)),
            What::Refocused(side) => format!(
                "the {} lens was focused otherwise, its focal length by {size:.3} % (its picture moved by {:.2} px)",
                side.name(),
                amounts[1].hypot(amounts[2])
            ),
            What::Turned => format!(
                "the right camera turned by {size:.3} deg ({:.3} about its horizontal, {:.3} about its vertical axis, {:.3} about its line of sight)",
                amounts[0], amounts[1], amounts[2]
            ),
            What::Elsewhere => format!("the right camera stands and looks otherwise by {size:.3} deg"),
        }
    }
}

/// The scatter of the one that explains most: what the others are judged by.
fn least_scatter(candidates: &[Candidate]) -> f64 {
    candidates.iter().map(|c| c.change.scatter).fold(f64::INFINITY, f64::min).max(1.0)
}

/// The candidates that are not told apart from the one that explains most, that one first.
pub(super) fn likeliest<'a, 'b>(candidates: &'b [Candidate<'a>], pairs: usize) -> Vec<&'b Candidate<'a>> {
    let scatter = least_scatter(candidates);
    // Logarithm of the likelihood but for a constant, less what the numbers cost.
    let evidence =
        |c: &Candidate| 0.5 * c.change.gain / scatter - 0.5 * c.change.amounts.len() as f64 * (pairs as f64).ln();
    let top = candidates.iter().map(&evidence).fold(f64::NEG_INFINITY, f64::max);
    let mut equals: Vec<&Candidate> = candidates.iter().filter(|c| top - evidence(c) < TOLD_APART).collect();
    // Causes that no pairs tell apart keep their order, however their sums are rounded.
    let rounded = |c: &Candidate| (1e6 * evidence(c)).round();
    equals.sort_by(|a, b| rounded(b).total_cmp(&rounded(a)));
    // A single number that does as well as several is what happened.
    if equals.iter().any(|c| matches!(c.what, What::One(_))) {
        equals.retain(|c| matches!(c.what, What::One(_)));
    }
    equals
}

/// What happened and by how much, in words, for each cause that it may have been.
pub(super) fn described(equals: &[&Candidate]) -> String {
    equals.iter().map(|candidate| candidate.words()).collect::<Vec<String>>().join(", or ")
}

/// The same for a terminal: the first cause alone, without what stands in brackets where that is long or it may be
/// another cause.
pub(super) fn briefly(equals: &[&Candidate], may_be_another: bool) -> String {
    const LONG: usize = 100;
    let first = described(&equals[..1]);
    let without_brackets = first.split(" (").next().unwrap_or(&first);
    match may_be_another || equals.len() > 1 {
        true => format!("{without_brackets}, or another cause (see the report),"),
        false if first.len() > LONG => without_brackets.to_owned(),
        false => first,
    }
}
