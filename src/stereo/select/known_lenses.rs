//! Lenses that are known: what is free beside them, and whether the pictures agree with them.
//!
//! In: the pairs at their start, and lenses from another calibration. Out: the layout with what is expected, and the
//! test. Method: the lenses are expectations with their covariance, beside which the corners weigh as little as their
//! pairs scatter, by themselves or in the earlier calibration; the board is bent where the evidence for that is larger.
//! The test compares the known numbers with those that the pictures give by themselves: their difference against both
//! covariances, the pictures' one enlarged by what pairs scatter ([`crate::difference`]). A focus alone is asked for,
//! too: it is what changes, and a test of one number sees smaller changes of it. Causes are other lenses that might be
//! known instead: another focus, left and right exchanged, another camera. One is named where what it leaves is chance,
//! and beside it those that do nearly as well. Goes wrong: pictures that say little of a lens; then the test says how
//! large a change of focus it would have seen.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use crate::difference::{Difference, SEEN, TOLD_APART};
use crate::imaging::Side;
use crate::stereo::data::in_use;
use crate::stereo::model::{KnownLenses, Layout};
use crate::stereo::pairs::Cause;
use crate::stereo::select::model_comparison::{Trial, gain_of_terms};
use crate::stereo::select::options::{Choice, KnownScatter, Options, SIMPLEST};
use crate::stereo::select::pair_motion::KnownMotion;
use crate::stereo::select::stated_uncertainty;
use crate::stereo::solve::Problem;
use crate::stereo::{Error, Rig};

/// Chance that one of the four tests (all numbers, the focus of either side and of both) contradicts a lens that is
/// right: one set of pairs in a thousand is contradicted by one of them.
const CHANCE: f64 = 2.5e-4;

/// Whether the pictures agree with the lenses that were known.
#[derive(Debug, Clone, PartialEq)]
pub struct LensCheck {
    /// Squared difference of the known numbers from those that the pictures give, in units of its covariance: of all
    /// numbers, or the part that a focus explains, whichever is the larger share of its limit.
    pub chi_square: f64,
    /// Beyond it they contradict each other.
    pub limit: f64,
    /// How many numbers are known.
    pub numbers: usize,
    /// What explains the difference, the likeliest first; empty where there is none.
    pub causes: Vec<Cause>,
    /// The same for a person.
    pub statement: String,
    /// By how much the focal length changed, %, where that is the likeliest cause.
    pub focus_change: Option<f64>,
    /// The change of each known focal length that nineteen of twenty such tests see, as a share.
    pub focus_seen: [Option<f64>; 2],
    /// The rig as the pictures give it without the known lenses.
    pub rig_without: Rig,
}

impl LensCheck {
    /// True where the pictures contradict the lenses.
    pub fn contradicts(&self) -> bool {
        self.chi_square > self.limit
    }

    /// What to do where the pictures contradict the lenses.
    pub fn remedy(&self) -> &'static str {
        match self.causes.as_slice() {
            [Cause::Exchanged] => {
                "exchange the folders of left and right; or, where each lens has a file of its own, the sides of the files: `--intrinsics LEFT,right` and \
                 `--intrinsics RIGHT,left`"
            }
            _ => "give the lenses as they are now, or leave `--intrinsics` out and photograph more pairs",
        }
    }
}

/// What is free beside lenses that are known, and what is expected.
pub fn choose(start: &Problem, known: &KnownLenses, options: &Options) -> Result<Choice, Error> {
    let lens = options.lens.unwrap_or(SIMPLEST);
    let problem = start_of(start, known);
    let (mut solved, layout) = problem.solve_bent_or_flat(options.shape, |shape| known.layout(lens, shape))?;
    let [scatter, _] = stated_uncertainty::scatter_beside(&solved, &layout, known.pair_excess, known.noise.as_ref());
    // Corners weigh by their noise alone; beside them, what is known counts by as much more as the pairs scatter beyond
    // it.
    solved.problem.priors = start.priors.knowing(&known.weighing(scatter));
    let shape = options
        .shape
        .unwrap_or_else(|| is_bent(&solved.problem, &known.layout(lens, true), &known.layout(lens, false), scatter));
    Ok(Choice {
        layout: known.layout(lens, shape),
        near: Some(problem.values),
        priors: solved.problem.priors,
        scatter: Some(KnownScatter { lenses: scatter, pairs: scatter, motion: motion(start, known) }),
        scores: Vec::new(),
        solved: Arc::default(),
    })
}

/// The pairs with the known cameras to start from, and what is known of them.
fn start_of(start: &Problem, known: &KnownLenses) -> Problem {
    let mut problem = Problem { priors: start.priors.knowing(known), ..start.clone() };
    for side in Side::BOTH {
        if let Some(camera) = known.camera(side) {
            *problem.values.shared.rig.camera_mut(side) = *camera;
        }
    }
    problem
}

/// How the pairs move, where more of them told that before than there are now.
fn motion(start: &Problem, known: &KnownLenses) -> Option<KnownMotion> {
    let (variances, pairs) = known.pair_motion.zip(known.pairs)?;
    (pairs > start.views.len()).then_some(KnownMotion { variances, pairs })
}

/// Whether the evidence for a board that is bent is larger than for a flat one.
fn is_bent(problem: &Problem, bent: &Layout, flat: &Layout, scatter: f64) -> bool {
    let trials = Trial::new(problem, *bent).zip(Trial::new(problem, *flat));
    trials.and_then(|(bent, flat)| gain_of_terms(&problem.priors, &bent, &flat, scatter)).is_some_and(|gain| gain > 0.0)
}

/// Compares the known lenses with what the pictures say by themselves. `None` where they say nothing.
pub fn check(start: &Problem, known: &KnownLenses, layout: &Layout) -> Option<LensCheck> {
    let own = Problem { priors: start.priors.knowing(&known.loosened()), ..start_of(start, known) };
    let solved = own.solve(layout).ok()?;
    let [scatter, beyond] =
        stated_uncertainty::scatter_beside(&solved, layout, known.pair_excess, known.noise.as_ref());
    let trial = Trial::new(&solved.problem, *layout)?;
    let places: Vec<usize> = known.numbers().iter().map(|(side, at)| layout.camera_start(*side) + at).collect();
    let all = layout.numbers(&trial.values.shared);
    let n = places.len();
    let pictures = Pictures {
        values: DVector::from_iterator(n, places.iter().map(|at| all[*at])),
        covariance: DMatrix::from_fn(n, n, |i, j| scatter * trial.covariance[(places[i], places[j])]),
        pairs: known.pairs.unwrap_or(0).max(solved.problem.views.len()),
        scatter: beyond,
        corners: in_use(&solved.problem.views).count(),
    };
    let difference = pictures.difference(known)?;
    let (chi_square, limit) = contradiction(known, &difference);
    let causes = if chi_square > limit { causes(known, &pictures, &difference) } else { Vec::new() };
    let seen = |side| Some((difference.level(CHANCE) + SEEN) * difference.along(&known.focal_direction(side)?)?.1);
    let focused = causes.first().filter(|likeliest| likeliest.cause == Cause::Focus);
    let focus_change = focused.and_then(|likeliest| Some(pictures.focus_change(known, *likeliest.sides.first()?)));
    Some(LensCheck {
        chi_square,
        limit,
        numbers: n,
        statement: statement(known, &pictures, &causes),
        causes: causes.into_iter().map(|explanation| explanation.cause).collect(),
        focus_change,
        focus_seen: Side::BOTH.map(seen),
        rig_without: trial.values.shared.rig,
    })
}

/// What the pictures say of the numbers that are known.
struct Pictures {
    values: DVector<f64>,
    covariance: DMatrix<f64>,
    /// How many pairs say how the numbers scatter.
    pairs: usize,
    /// Variance over that by the corners' noise.
    scatter: f64,
    corners: usize,
}

impl Pictures {
    /// Their difference from lenses that might be known.
    fn difference(&self, known: &KnownLenses) -> Option<Difference> {
        let joint = &self.covariance + known.covariance();
        Difference::new(&self.values - known.values(), &joint, self.pairs, self.scatter)
    }

    /// By how much a side's focal length differs from the known one, %: the mean of fx and fy.
    fn focus_change(&self, known: &KnownLenses, side: Side) -> f64 {
        let (numbers, values) = (known.numbers(), known.values());
        let focal = (0..numbers.len()).filter(|i| numbers[*i].0 == side && numbers[*i].1 < 2);
        focal.map(|i| 50.0 * (self.values[i] / values[i] - 1.0)).sum()
    }
}

/// The test that comes nearest to its limit, or is farthest beyond: its chi-squared and that limit.
fn contradiction(known: &KnownLenses, difference: &Difference) -> (f64, f64) {
    let all = difference.chi_square();
    let focused = subsets(known).into_iter().filter_map(|sides| {
        let left = difference.left_by(&focal_directions(known, &sides))?;
        Some((all - left, difference.limit(sides.len(), CHANCE)))
    });
    let every = (all, difference.limit(difference.off.len(), CHANCE));
    focused.fold(every, |a, b| if b.0 / b.1 > a.0 / a.1 { b } else { a })
}

fn focal_directions(known: &KnownLenses, sides: &[Side]) -> Vec<DVector<f64>> {
    sides.iter().filter_map(|side| known.focal_direction(*side)).collect()
}

/// The known sides: each, and both together.
fn subsets(known: &KnownLenses) -> Vec<Vec<Side>> {
    let sides: Vec<Side> = Side::BOTH.into_iter().filter(|side| known.camera(*side).is_some()).collect();
    let each = sides.iter().map(|side| vec![*side]);
    each.chain((sides.len() == 2).then(|| sides.clone())).collect()
}

/// A cause that explains the difference.
struct Explanation {
    cause: Cause,
    sides: Vec<Side>,
    /// Logarithm of its likelihood but for a constant, less what its numbers cost.
    evidence: f64,
}

/// The causes that explain the difference and are not told apart, the likeliest first.
fn causes(known: &KnownLenses, pictures: &Pictures, difference: &Difference) -> Vec<Explanation> {
    let numbers = known.numbers();
    let penalty = 0.5 * (pictures.corners.max(2) as f64).ln();
    let explains = |cause, sides: &[Side], difference: &Difference, freed: &[DVector<f64>]| {
        let left = if freed.is_empty() { difference.chi_square() } else { difference.left_by(freed)? };
        let numbers_left = numbers.len() - freed.len();
        let chance = numbers_left == 0 || left <= difference.limit(numbers_left, CHANCE);
        let evidence = difference.log_likelihood(left) - penalty * freed.len() as f64;
        chance.then(|| Explanation { cause, sides: sides.to_vec(), evidence })
    };
    let own = |sides: &[Side]| -> Vec<DVector<f64>> {
        let of_sides = (0..numbers.len()).filter(|i| sides.contains(&numbers[*i].0));
        of_sides.map(|at| DVector::from_fn(numbers.len(), |i, _| f64::from(i == at))).collect()
    };
    let mut all = Vec::new();
    for sides in subsets(known) {
        all.extend(explains(Cause::Focus, &sides, difference, &focal_directions(known, &sides)));
        all.extend(explains(Cause::OtherCamera, &sides, difference, &own(&sides)));
    }
    let exchanged = Some(known.exchanged()).filter(|exchanged| exchanged.numbers() == numbers);
    let exchanged = exchanged.and_then(|exchanged| pictures.difference(&exchanged));
    all.extend(exchanged.and_then(|difference| explains(Cause::Exchanged, &Side::BOTH, &difference, &[])));
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let best = all.first().map_or(0.0, |likeliest| likeliest.evidence);
    let mut likeliest: Vec<Explanation> = Vec::new();
    for explanation in all.into_iter().filter(|explanation| best - explanation.evidence < TOLD_APART) {
        if likeliest.iter().all(|named| named.cause != explanation.cause) {
            likeliest.push(explanation);
        }
    }
    likeliest
}

/// What the difference is and what explains it, in words.
fn statement(known: &KnownLenses, pictures: &Pictures, causes: &[Explanation]) -> String {
    let told: Vec<String> = causes.iter().map(|explanation| cause_in_words(known, pictures, explanation)).collect();
    match told.is_empty() {
        true => "the pictures agree with the known lenses".to_owned(),
        false => format!("the pictures contradict the known lenses: {}", told.join(", or ")),
    }
}

fn cause_in_words(known: &KnownLenses, pictures: &Pictures, explanation: &Explanation) -> String {
    let names: Vec<&str> = explanation.sides.iter().map(|side| side.name()).collect();
    let names = names.join(" and the ");
    match explanation.cause {
        Cause::Focus => {
            let change = |side: &Side| format!("{:+.3} %", pictures.focus_change(known, *side));
            let changes: Vec<String> = explanation.sides.iter().map(change).collect();
            format!("the {names} lens was focused otherwise, its focal length changed by {}", changes.join(" and "))
        }
        Cause::Exchanged => "the lenses of left and right are exchanged".to_owned(),
        _ => format!("the {names} camera is another one, or its lens was changed"),
    }
}
