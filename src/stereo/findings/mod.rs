//! What happened to a rig while it was photographed: steps and drifts over the pairs, and what they do to a length.
//!
//! In: a calibration from all pairs, and lengths through the volume that it is for. Out: the changes that are more than the pairs' own scatter
//! makes of nothing, each with its cause, or the causes that are not told apart, and its effect. Method: every cause at every place of
//! the series in one linear problem ([`series`]), an F test against the scatter that the pairs have with the change taken out, every look
//! counted. The largest finding is taken out and the rest is looked at again. What is done about a finding follows from its effect and
//! not from how surely it is seen ([`standing`]). Goes wrong: fewer than six pairs; more than one change at one place.

pub mod hypothesis;
pub mod series;
pub mod standing;
#[cfg(test)]
mod tests;

use nalgebra::DVector;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::hypothesis::{Hypothesis, any_place};
use crate::stereo::findings::series::{Change, Linear};
use crate::stereo::pairs::{Cause, DiscardedPair};
use crate::stereo::volume::lengths::VolumeLengths;

/// Chance that a series in which nothing happened has a finding, all looks together.
const FALSE_ALARM: f64 = 1e-3;

/// Causes are told apart where the logarithm of one's likelihood is larger by this: 150 to 1.
const TOLD_APART: f64 = 5.0;

/// Fewest pairs on either side of a step: one pair or two that differ are no change of the rig.
const FEWEST_EACH: usize = 3;

/// Fewest pairs in which a change is looked for.
const FEWEST: usize = 2 * FEWEST_EACH;

/// Over which pairs something happened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// From one pair on.
    Step,
    /// Evenly from the first pair to the last.
    Drift,
    /// In single pairs.
    Pair,
}

/// Something that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The cause, or the causes that these pairs do not tell apart, with `|` between them.
    pub cause: String,
    /// Over which pairs.
    pub kind: Kind,
    /// The pairs: those from the step on, all that drift, or those that something happened to.
    pub pairs: Vec<String>,
    /// By how much, from before the step to after it or from the first pair to the last.
    pub size: Option<f64>,
    /// Unit of the size.
    pub unit: &'static str,
    /// By how much it moves a length in the volume, mm.
    pub effect_mm: Option<f64>,
    /// What happened and what to do, for a person.
    pub action: String,
    /// From the common rig to the one at the last pair, in the layout's order.
    #[serde(skip)]
    pub step: Option<DVector<f64>>,
    /// Place of the first pair of a step.
    #[serde(skip)]
    pub first: usize,
}

/// What happened to single pairs that are not used, a finding a cause; pairs without a board or shown twice are none.
pub fn of_pairs(discarded: &[DiscardedPair]) -> Vec<Finding> {
    let mut found: Vec<Finding> = Vec::new();
    for pair in discarded.iter().filter(|pair| pair.cause.contradicts()) {
        match found.iter_mut().find(|finding| finding.cause == pair.cause.word()) {
            Some(finding) => finding.pairs.push(pair.pair.clone()),
            None => found.push(Finding {
                cause: pair.cause.word().to_owned(),
                kind: Kind::Pair,
                pairs: vec![pair.pair.clone()],
                size: None,
                unit: "",
                effect_mm: None,
                action: pair.reason.clone(),
                step: None,
                first: 0,
            }),
        }
    }
    found
}

/// A hypothesis with a pattern, and what it explains.
struct Candidate<'a> {
    kind: Kind,
    first: usize,
    pattern: Vec<f64>,
    hypothesis: Option<&'a Hypothesis>,
    change: Change,
    chance: f64,
}

/// The change of the rig over the series that explains most, where there is one.
pub fn look(calibration: &Calibration, lengths: &VolumeLengths) -> Vec<Finding> {
    let problem = calibration.problem();
    let count = problem.views.len();
    let Some(linear) = Linear::new(&problem, &calibration.layout).filter(|_| count >= FEWEST) else {
        return Vec::new();
    };
    let hypotheses = hypothesis::all(&calibration.layout, calibration.rig());
    let any = any_place(&calibration.layout);
    let candidates = candidates(&linear, &hypotheses, &any);
    let Some(best) = likeliest(&candidates) else { return Vec::new() };
    vec![finding(calibration, lengths, &candidates, best, &any)]
}

/// Every cause as a step at every pair and as a drift, and any other place of the right camera.
fn candidates<'a>(linear: &Linear, hypotheses: &'a [Hypothesis], any: &[DVector<f64>]) -> Vec<Candidate<'a>> {
    let count = linear.len();
    let step = |first: usize| (Kind::Step, first, (0..count).map(|i| f64::from(i >= first)).collect::<Vec<f64>>());
    let drift = (Kind::Drift, 0, (0..count).map(|i| i as f64 / (count - 1) as f64).collect());
    let patterns: Vec<_> = (FEWEST_EACH..=count - FEWEST_EACH).map(step).chain([drift]).collect();
    let looks = (patterns.len() * (hypotheses.len() + 1)) as f64;
    let mut all = Vec::new();
    for (kind, first, pattern) in patterns {
        let mut add = |hypothesis: Option<&'a Hypothesis>, directions: &[DVector<f64>]| {
            let Some(change) = linear.change(directions, &pattern) else { return };
            let numbers = directions.len() as f64;
            let f = change.gain / numbers / change.scatter;
            let chance = looks * FisherSnedecor::new(numbers, change.freedom).map_or(1.0, |d| d.sf(f.max(0.0)));
            all.push(Candidate { kind, first, pattern: pattern.clone(), hypothesis, change, chance });
        };
        hypotheses.iter().for_each(|h| add(Some(h), std::slice::from_ref(&h.direction)));
        // Six numbers need more pairs than they are.
        if count > 2 * any.len() {
            add(None, any);
        }
    }
    all
}

/// The candidate that is least a matter of chance, where one is not.
fn likeliest<'a, 'b>(candidates: &'b [Candidate<'a>]) -> Option<&'b Candidate<'a>> {
    let significant = candidates.iter().filter(|c| c.chance < FALSE_ALARM);
    significant.min_by(|a, b| a.chance.total_cmp(&b.chance).then(b.change.gain.total_cmp(&a.change.gain)))
}

impl Candidate<'_> {
    /// Logarithm of its likelihood but for a constant, less what its numbers cost.
    fn evidence(&self, scatter: f64, pairs: usize) -> f64 {
        0.5 * self.change.gain / scatter - 0.5 * self.change.amounts.len() as f64 * (pairs as f64).ln()
    }
}

fn finding(
    calibration: &Calibration,
    lengths: &VolumeLengths,
    candidates: &[Candidate],
    best: &Candidate,
    any: &[DVector<f64>],
) -> Finding {
    let count = calibration.views.len();
    // Of all, the one that explains most; its scatter is what the others are judged by.
    let scatter = candidates.iter().map(|c| c.change.scatter).fold(f64::INFINITY, f64::min).max(1.0);
    let evidence = |c: &Candidate| c.evidence(scatter, count);
    let same = |c: &&Candidate| c.kind == best.kind && c.first == best.first;
    let top = candidates.iter().filter(same).map(&evidence).fold(f64::NEG_INFINITY, f64::max);
    let mut equals: Vec<&Candidate> =
        candidates.iter().filter(same).filter(|c| top - evidence(c) < TOLD_APART).collect();
    equals.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)));
    let shown = equals.first().copied().unwrap_or(best);
    let mut causes: Vec<Cause> = Vec::new();
    for candidate in &equals {
        let cause = candidate.hypothesis.map_or(Cause::CameraMoved, |h| h.cause);
        if !causes.contains(&cause) {
            causes.push(cause);
        }
    }
    // A single number that does as well as all six of another place is what happened.
    if causes.len() > 1 {
        causes.retain(|cause| *cause != Cause::CameraMoved);
    }
    let whole = match shown.hypothesis {
        Some(h) => &h.direction * shown.change.amounts[0],
        None => {
            any.iter().zip(shown.change.amounts.iter()).fold(DVector::zeros(any[0].len()), |sum, (d, a)| sum + d * *a)
        }
    };
    let mean = shown.pattern.iter().sum::<f64>() / count as f64;
    let changes = lengths.changes_by_step_mm(&calibration.layout, &whole);
    let effect_mm = changes.into_iter().fold(0.0, |most: f64, mm| most.max(mm.abs()));
    let at = calibration.layout.transform_start();
    let (size, unit) = match shown.hypothesis {
        Some(h) => (shown.change.amounts[0], h.unit),
        None => (whole.rows(at, 3).norm().to_degrees(), "deg"),
    };
    let name = |i: usize| calibration.views[i].pair.clone();
    let which = match best.kind {
        Kind::Step => format!("from pair {} on", name(best.first)),
        _ => format!("from pair {} to pair {}", name(0), name(count - 1)),
    };
    let words: Vec<String> = equals.iter().filter_map(|c| Some(c.hypothesis?.words.clone())).collect();
    let what = match words.split_first() {
        None => "the right camera stands and looks otherwise".to_owned(),
        Some((first, [])) => first.clone(),
        Some((first, others)) => format!("{first} (or {})", others.join(", or ")),
    };
    let action = format!("{what} by {size:.3} {unit} {which}, which moves a length by up to {effect_mm:.4} mm");
    Finding {
        cause: causes.iter().map(|cause| cause.word()).collect::<Vec<_>>().join("|"),
        kind: best.kind,
        pairs: (best.first..count).map(name).collect(),
        size: Some(size),
        unit,
        effect_mm: Some(effect_mm),
        action,
        step: Some(whole * (1.0 - mean)),
        first: best.first,
    }
}
