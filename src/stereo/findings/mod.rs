//! What happened to a rig while it was photographed: steps and drifts over the pairs, and what they do to a length.
//!
//! In: a calibration from all pairs, and lengths through the volume that it is for. Out: the changes that are more than
//! the pairs' own scatter makes of nothing, each with its cause, or the causes that are not told apart, and its effect.
//! Method: every cause at every place of the series in one linear problem ([`series`]), an F test against the scatter
//! that the pairs have with the change taken out, every look counted. The largest finding is taken out and the rest is
//! looked at again. What is done about a finding follows from its effect and not from how surely it is seen
//! ([`standing`]). Goes wrong: fewer than six poses; more than one change at one place; a step while the board stood
//! still.

mod before_step;
mod candidates;
pub mod common_misfit;
pub mod hypothesis;
mod one_side;
mod other_rig;
mod own_lenses;
mod rolling_shutter;
pub mod series;
pub mod standing;
#[cfg(test)]
mod tests;
mod two_rigs;
mod without_drift;

use nalgebra::DVector;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::candidates::{Candidate, briefly, described, likeliest};
use crate::stereo::findings::hypothesis::Hypothesis;
use crate::stereo::findings::series::{Change, Line, Linear};
use crate::stereo::model::Layout;
use crate::stereo::pairs::{Cause, DiscardedPair};
use crate::stereo::select::cross_validation;
use crate::stereo::solve::Problem;
use crate::stereo::volume::lengths::VolumeLengths;

/// Chance that a series in which nothing happened has a finding, all looks together.
const FALSE_ALARM: f64 = 1e-3;

/// Fewest pairs on either side of a step: one pair that differs is no change of the rig.
const FEWEST_EACH: usize = 2;

/// Fewest pairs whose order can be exchanged often enough, how often it is, and in how many of a hundred orders so
/// large a change may be found.
const PERMUTED_FROM: usize = 12;
const PERMUTATIONS: usize = 400;
const PERMUTED_AT_ONCE: usize = 20;

/// Fewest pairs in which a change is looked for.
const FEWEST: usize = 6;

/// Over which pairs something happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// From one pair on.
    Step,
    /// Evenly from the first pair to the last.
    Drift,
    /// In single pairs.
    #[default]
    Pair,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Finding {
    /// The cause, or the causes that these pairs do not tell apart, with `|` between them.
    pub cause: String,
    pub kind: Kind,
    /// The pairs: those from the step on, all that drift, or those that something happened to.
    pub pairs: Vec<String>,
    /// By how much, from before the step to after it or from the first pair to the last.
    pub size: Option<f64>,
    pub unit: &'static str,
    /// By how much it moves a length in the volume, mm.
    pub effect_mm: Option<f64>,
    /// What happened and what to do, for a person.
    pub action: String,
    /// The same in two lines of a terminal, where it is longer.
    #[serde(skip)]
    pub brief: Option<String>,
    /// The change of the shared numbers over the pairs that the common rig was made from.
    #[serde(skip)]
    pub along: Option<Along>,
    /// What to do about it, where what happened does not say so itself.
    #[serde(skip)]
    pub remedy: Option<String>,
}

impl Finding {
    /// Whether it is what the board is like in all pairs, and nothing that happened over them.
    pub fn is_of_board(&self) -> bool {
        self.cause == Cause::OtherBoard.word() && self.kind == Kind::Step && self.along.is_none()
    }

    /// What happened, as the terminal says it.
    pub fn briefly(&self) -> &str {
        self.brief.as_ref().unwrap_or(&self.action)
    }
}

/// How the shared numbers change over the pairs, in the layout's order.
#[derive(Debug, Clone, PartialEq)]
pub struct Along {
    /// From the rig without any of the change to the one with all of it.
    whole: DVector<f64>,
    /// From the rig without any of it to the one that is taken.
    common: DVector<f64>,
    /// Which share of it each pair has.
    by_pair: DVector<f64>,
    /// What it explains, and how the pairs scatter beside it.
    gain: f64,
    scatter: f64,
}

impl Along {
    /// The same for another layout: the numbers that it has.
    pub fn in_layout(&self, own: &Layout, other: &Layout) -> Along {
        let (from, to) = (own.names(), other.names());
        let at: Vec<Option<usize>> = to.iter().map(|name| from.iter().position(|own| own == name)).collect();
        let taken = |step: &DVector<f64>| DVector::from_fn(to.len(), |i, _| at[i].map_or(0.0, |k| step[k]));
        Along { whole: taken(&self.whole), common: taken(&self.common), ..self.clone() }
    }

    /// The same where the rig with a share of the change is the one that is taken.
    pub fn seen_from(&self, share: f64) -> Along {
        Along { common: &self.whole * share, ..self.clone() }
    }

    /// From the rig that is taken to the one with a share of the change.
    pub fn to(&self, share: f64) -> DVector<f64> {
        &self.whole * share - &self.common
    }

    /// Standard deviation of the step from the rig that is taken to the one with a share of the change, along that
    /// step; `noise` is the variance of the corners without the change over the one that they were weighed by, at which
    /// the pairs scatter at least.
    pub fn sigma_of(&self, share: f64, noise: f64) -> DVector<f64> {
        self.to(share) * (self.scatter.max(noise) / self.gain).sqrt()
    }
}

/// Lenses that were known and that the pictures contradict: all pairs are of other ones.
pub fn of_lenses(calibration: &Calibration, lengths: &VolumeLengths) -> Option<Finding> {
    let check = calibration.lens_check.as_ref().filter(|check| check.contradicts())?;
    let causes = Cause::words(check.causes.iter().copied());
    let otherwise = lengths.measured_by(&check.rig_without).into_iter().flatten();
    Some(Finding {
        cause: if causes.is_empty() { Cause::Unknown.word().to_owned() } else { causes },
        kind: Kind::Step,
        pairs: calibration.pair_names(),
        size: check.focus_change,
        unit: if check.focus_change.is_some() { "%" } else { "" },
        effect_mm: otherwise.map(|mm| (mm - lengths.length_mm).abs()).reduce(f64::max),
        action: check.statement.clone(),
        remedy: Some(check.remedy().to_owned()),
        ..Finding::default()
    })
}

/// What happened to single pairs that are not used, a finding for each cause or causes that are not told apart; pairs
/// without a board or shown twice are none.
pub fn of_pairs(discarded: &[DiscardedPair]) -> Vec<Finding> {
    let mut found: Vec<Finding> = Vec::new();
    for pair in discarded.iter().filter(|pair| pair.cause.contradicts()) {
        let cause = pair.causes();
        match found.iter_mut().find(|finding| finding.cause == cause) {
            Some(finding) => finding.pairs.push(pair.pair.clone()),
            None => found.push(Finding {
                cause,
                kind: Kind::Pair,
                pairs: vec![pair.pair.clone()],
                action: pair.reason.clone(),
                ..Finding::default()
            }),
        }
    }
    found
}

struct Pattern {
    kind: Kind,
    first: usize,
    by_pair: DVector<f64>,
}

impl Pattern {
    /// The same by pairs, of a pattern by runs of them, whose first ones these are.
    fn of_pairs(&self, first: &[usize], pairs: usize) -> Pattern {
        let run = |pair: usize| first.partition_point(|first| *first <= pair) - 1;
        let by_pair = DVector::from_fn(pairs, |pair, _| self.by_pair[run(pair)]);
        Pattern { kind: self.kind, first: first[self.first], by_pair }
    }
}

/// The change of the rig over the series that explains most, where there is one.
pub fn look(calibration: &Calibration, lengths: &VolumeLengths) -> Option<Finding> {
    let problem = calibration.problem();
    let first = first_of_runs(&problem);
    let count = first.len();
    if count < FEWEST {
        return None;
    }
    let linear = Linear::new(&problem, &calibration.layout)?.of_runs(&first);
    let hypotheses = hypothesis::all(&calibration.layout, calibration.rig());
    let pattern = significant(&linear, &hypotheses, &drift_of_runs(&first, problem.views.len()))?;
    let candidates = candidates(&linear, &hypotheses, calibration, &pattern, pattern.by_pair.as_slice());
    let equals = likeliest(&candidates, count);
    let other = without_one(&linear, &hypotheses, calibration, (&pattern, &first), &equals);
    finding(calibration, lengths, &equals, &pattern.of_pairs(&first, problem.views.len()), other)
}

/// The share that each run has of a drift that grows evenly over the pairs: that of its middle.
fn drift_of_runs(first: &[usize], pairs: usize) -> DVector<f64> {
    let end = |run: usize| first.get(run + 1).copied().unwrap_or(pairs);
    DVector::from_fn(first.len(), |run, _| 0.5 * (first[run] + end(run) - 1) as f64 / (pairs - 1) as f64)
}

/// The first pairs of runs of pairs that show the board in one pose. Frames of a video and bursts of a camera share
/// what moves a picture, and are no more evidence of a change than one of them.
fn first_of_runs(problem: &Problem) -> Vec<usize> {
    let groups = cross_validation::groups(&problem.views, &problem.values.poses);
    (0..groups.len()).filter(|&i| i == 0 || groups[i] != groups[i - 1]).collect()
}

/// What may explain a pattern of these pairs.
fn candidates<'a>(
    linear: &Linear,
    hypotheses: &'a [Hypothesis],
    calibration: &Calibration,
    pattern: &Pattern,
    by_pair: &[f64],
) -> Vec<Candidate<'a>> {
    let change = |directions: &[DVector<f64>]| linear.change(directions, by_pair);
    let of = (&calibration.layout, calibration.rig());
    Candidate::all(&change, linear.pairs(), hypotheses, of, pattern.kind == Kind::Step)
}

/// What a change would be without one of the pairs.
struct WithoutOne {
    pair: String,
    words: String,
    causes: Vec<Cause>,
}

/// The first pair that alone decides what a change is: without it the likeliest cause is none of these.
fn without_one(
    linear: &Linear,
    hypotheses: &[Hypothesis],
    calibration: &Calibration,
    (pattern, first): (&Pattern, &[usize]),
    equals: &[&Candidate],
) -> Option<WithoutOne> {
    let without = |pair: usize| {
        let others = linear.without(pair)?;
        let shares = pattern.by_pair.iter().enumerate().filter(|(i, _)| *i != pair);
        let by_pair: Vec<f64> = shares.map(|(_, share)| *share).collect();
        let candidates = candidates(&others, hypotheses, calibration, pattern, &by_pair);
        let now = likeliest(&candidates, others.pairs());
        let causes: Vec<Cause> = now.iter().map(|candidate| candidate.cause()).collect();
        let now_first = *causes.first()?;
        let is_other = equals.iter().all(|candidate| candidate.cause() != now_first);
        is_other.then(|| WithoutOne {
            pair: calibration.views[first[pair]].pair.clone(),
            words: described(&now),
            causes,
        })
    };
    (0..linear.pairs()).into_par_iter().filter_map(without).collect::<Vec<_>>().into_iter().next()
}

/// The pattern of one cause that is least a matter of chance, where one is not: every step and the drift of every cause
/// by the F test, and, where there are pairs enough, against the same pairs in another order.
fn significant(linear: &Linear, hypotheses: &[Hypothesis], drift: &DVector<f64>) -> Option<Pattern> {
    let count = linear.pairs();
    let step = |first: usize| Pattern {
        kind: Kind::Step,
        first,
        by_pair: DVector::from_fn(count, |i, _| f64::from(i >= first)),
    };
    let drift = Pattern { kind: Kind::Drift, first: 0, by_pair: drift.clone() };
    let patterns: Vec<Pattern> = (FEWEST_EACH..=count - FEWEST_EACH).map(step).chain([drift]).collect();
    let lines: Vec<Line> = hypotheses.iter().filter_map(|h| linear.line(&h.direction)).collect();
    let largest = |order: &[usize]| -> (f64, f64, usize) {
        let mut most = (0.0, 1.0, 0);
        for (p, pattern) in patterns.iter().enumerate() {
            let ordered = DVector::from_fn(count, |i, _| pattern.by_pair[order[i]]);
            for line in &lines {
                let f = line.f(&ordered);
                if f > most.0 {
                    most = (f, line.freedom(), p);
                }
            }
        }
        most
    };
    let (f, freedom, at) = largest(&(0..count).collect::<Vec<usize>>());
    let looks = (patterns.len() * lines.len()) as f64;
    if looks * FisherSnedecor::new(1.0, freedom).map_or(1.0, |d| d.sf(f)) >= FALSE_ALARM {
        return None;
    }
    if count >= PERMUTED_FROM {
        let is_larger = |k: usize| largest(&shuffled(count, k)).0 > 1.000_001 * f;
        let mut larger = 0;
        for block in (0..PERMUTATIONS).step_by(PERMUTED_AT_ONCE) {
            larger += (block..block + PERMUTED_AT_ONCE).into_par_iter().filter(|k| is_larger(*k)).count();
            if larger * 100 > PERMUTATIONS {
                return None;
            }
        }
    }
    patterns.into_iter().nth(at)
}

/// The pairs in an order that has nothing to do with when they were taken.
fn shuffled(count: usize, seed: usize) -> Vec<usize> {
    let mut random = Pcg64::seed_from_u64(seed as u64);
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, random.random_range(0..=i));
    }
    order
}

fn finding(
    calibration: &Calibration,
    lengths: &VolumeLengths,
    equals: &[&Candidate],
    best: &Pattern,
    other: Option<WithoutOne>,
) -> Option<Finding> {
    let count = calibration.views.len();
    let shown = *equals.first()?;
    let (whole, (size, unit)) = (shown.whole(), shown.size());
    let effect_mm = lengths.most_changed_mm(&calibration.layout, &whole);
    let name = |i: usize| calibration.views[i].pair.clone();
    let which = match best.kind {
        Kind::Step => format!("from pair {} on", name(best.first)),
        _ => format!("from pair {} to pair {}", name(0), name(count - 1)),
    };
    let mut moves = format!(" {which}, which moves a length by up to {effect_mm:.4} mm");
    if best.kind == Kind::Drift {
        let [before, after] = calibration.moment();
        let at = if before == after { format!("pair {before}") } else { format!("pairs {before} and {after}") };
        moves += &format!("; the rig is that of the middle of the series, at {at}");
    }
    let brief = briefly(equals, other.is_some()) + &moves;
    let mut action = described(equals) + &moves;
    if let Some(WithoutOne { pair, words, .. }) = &other {
        action += &format!("; but pair {pair} alone decides what changed: without it, {words}");
    }
    let causes = equals.iter().map(|candidate| candidate.cause());
    let cause = Cause::words(causes.chain(other.into_iter().flat_map(|other| other.causes)));
    let Change { common, gain, scatter, .. } = shown.change.clone();
    let along = Along { whole, common, by_pair: best.by_pair.clone(), gain, scatter };
    Some(Finding {
        remedy: hold(&cause, None),
        cause,
        kind: best.kind,
        pairs: (best.first..count).map(name).collect(),
        size: Some(size),
        unit,
        effect_mm: Some(effect_mm),
        action,
        brief: Some(brief),
        along: Some(along),
    })
}

/// What to do about a change of the rig, for a person who photographs again: hold what changed. `causes` are words with
/// `|` between them; `since` are the pairs after the last change of a rig that went on changing, where they are enough
/// for a rig. `None` where no hold helps.
pub(super) fn hold(causes: &str, since: Option<&[String]>) -> Option<String> {
    let is = |of: &[Cause]| causes.split('|').any(|word| of.iter().any(|cause| cause.word() == word));
    let unknown = is(&[Cause::Unknown]);
    let moved = unknown || is(&[Cause::Yaw, Cause::Pitch, Cause::Roll, Cause::Baseline, Cause::CameraMoved]);
    let hold = [
        (unknown || is(&[Cause::Focus])).then_some("lock the focus of both cameras"),
        moved.then_some("clamp both cameras"),
    ];
    let hold: Vec<&str> = hold.into_iter().flatten().collect();
    let again = (!hold.is_empty()).then(|| format!("{}, and take all pairs again", hold.join(" and ")))?;
    Some(match since {
        Some([first, others @ ..]) => {
            format!("{again}; or `--since {first}`: the rig of the last {} pairs", others.len() + 1)
        }
        _ => again,
    })
}
