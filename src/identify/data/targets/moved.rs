//! Targets that were moved between two poses: from there on their distances to the others are other ones.
//!
//! In: what the poses showed, in their order. Out: the same with a target that moved as another one from there on. Each
//! distance between two targets is looked through for a step, held against what it changes from one pose to the next;
//! large deviations are bounded, so that gross errors make none. The target in most of the distances that step is the
//! one that moved. Steps of less than about three times the scatter, and within the first or last few poses, are not
//! seen.

use super::body::{LEAST_SCATTER, Sighting, distances};
use crate::statistics::median;

/// Fewest poses before and after.
const FEWEST: usize = 5;

/// Deviations beyond so many times the scatter count as that.
const BOUNDED: f64 = 4.0;

/// Standard deviations that a difference of two means must have.
const CLEAR: f64 = 8.0;

/// The same at a pose that is known: no place is looked for, and one in ten thousand has as much.
const TOLD: f64 = 4.0;

/// Median change from one normal number to the next, in standard deviations of one.
const MEDIAN_CHANGE: f64 = 0.954;

/// A target and the pose from which on it stands elsewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moved {
    pub target: usize,
    /// Another one that is in as many of the distances that step: which of the two it was, nobody knows.
    pub or: Option<usize>,
    /// Index of the pose.
    pub from: usize,
}

/// By how much a target's distances to the others change there at the most, mm.
pub fn size_mm(poses: &[Vec<Sighting>], targets: usize, moved: Moved) -> f64 {
    let of_pair = |other: usize| {
        let (before, after): (Vec<_>, Vec<_>) =
            distances(poses, moved.target, other).into_iter().partition(|(pose, _)| *pose < moved.from);
        let [before, after] = [before, after].map(|part| median(part.into_iter().map(|(_, apart)| apart)));
        Some((after? - before?).abs())
    };
    (0..targets).filter(|other| *other != moved.target).filter_map(of_pair).fold(0.0, f64::max)
}

/// The step that is looked at next, if there is any.
pub fn next(poses: &[Vec<Sighting>], targets: usize) -> Option<Moved> {
    let mut of_target = vec![(0, 0.0, 0); targets];
    for a in 0..targets {
        for b in 0..a {
            let Some((clear, from)) = step(&distances(poses, a, b), None) else { continue };
            for target in [a, b] {
                let (steps, clearest, at) = of_target[target];
                of_target[target] = (steps + 1, f64::max(clearest, clear), if clear > clearest { from } else { at });
            }
        }
    }
    let order = |a: &(i32, f64, usize), b: &(i32, f64, usize)| {
        (a.0, a.1).partial_cmp(&(b.0, b.1)).unwrap_or(std::cmp::Ordering::Equal)
    };
    let steps = |target: &usize| of_target[*target].0;
    let (target, &(most_steps, _, from)) = of_target.iter().enumerate().max_by(|a, b| order(a.1, b.1))?;
    let rival = (0..targets).find(|other| *other != target && steps(other) == most_steps);
    // Which of two it was, their distances to the others tell at the pose that is known now.
    let clear = |of: usize, rival: usize| {
        let others = (0..targets).filter(|other| ![of, rival].contains(other));
        let steps = others.filter_map(|other| step(&distances(poses, of, other), Some(from)));
        steps.map(|(clear, _)| clear).fold(0.0, f64::max)
    };
    let is_told = |of: usize, rival: usize| clear(of, rival) > TOLD.max(2.0 * clear(rival, of));
    let (target, or) = match rival {
        Some(rival) if is_told(rival, target) => (rival, None),
        rival => (target, rival.filter(|rival| !is_told(target, *rival))),
    };
    (most_steps > 0).then_some(Moved { target, or, from })
}

/// How clear the clearest step is, and the pose after it; of those before this pose alone, however clear, where one is
/// given.
fn step(distances: &[(usize, f64)], only: Option<usize>) -> Option<(f64, usize)> {
    let count = distances.len();
    let middle = median(distances.iter().map(|d| d.1))?;
    let change = median(distances.windows(2).map(|two| (two[1].1 - two[0].1).abs()))?;
    let scatter = (change / MEDIAN_CHANGE).max(LEAST_SCATTER * middle);
    let bounded = |d: f64| ((d - middle) / scatter).clamp(-BOUNDED, BOUNDED);
    let total: f64 = distances.iter().map(|d| bounded(d.1)).sum();
    let mut before = 0.0;
    let mut best = (if only.is_some() { 0.0 } else { CLEAR }, None);
    for k in 1..count {
        before += bounded(distances[k - 1].1);
        if k < FEWEST || count - k < FEWEST || only.is_some_and(|from| distances[k].0 != from) {
            continue;
        }
        let (first, second) = (before / k as f64, (total - before) / (count - k) as f64);
        let clear = (first - second).abs() * (k as f64 * (count - k) as f64 / count as f64).sqrt();
        if clear > best.0 {
            best = (clear, Some(distances[k].0));
        }
    }
    best.1.map(|from| (best.0, from))
}
