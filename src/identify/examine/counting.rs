//! Several joints that are counted otherwise at once: a file with the signs of a textbook's table beside the angles of
//! a controller that turns its joints the other way, or counts one from the horizontal.
//!
//! In: a set and a robot whose errors no single fault explains. Out: few hypotheses, the likeliest first. Method: every
//! choice of signs of the joints that move, with one joint counted together with the one before it or with none, by
//! what the links of the file leave of the placement with most points, the sensor and the target anywhere. Goes wrong:
//! zeros that are off by quarter turns as well; points of so few poses that several choices fit.

use rayon::prelude::*;

use super::hypothesis::{Counting, Hypothesis, still};
use super::in_hand::most_points;
use super::misfit::{EXPLAINS, Misfit};
use crate::identify::data::dataset::Dataset;
use crate::robot::Robot;
use crate::robot::tool_fit::Start;

/// Fewest poses: nine unknowns and as many joints as arms have are held against 36 numbers.
const FEWEST: usize = 12;
/// Joints of which all choices of signs are tried.
const MOST_JOINTS: usize = 8;
/// Choices that are fitted with all links, and as many that say less: those that the file's robot does not tell apart.
const FITTED: usize = 6;
/// By what factor the file's robot must come nearer: among the thousand choices that there are, points of another arm
/// find one that is nearer by some times.
const NEARER: f64 = 20.0;

/// The choices of signs and couplings with which the file's robot is near the points; none where it is not.
pub fn likeliest(set: &Dataset, robot: &Robot) -> Vec<Hypothesis> {
    let (joints, points) = most_points(set);
    let still = still(set);
    let moving: Vec<usize> = (0..set.joint_count()).filter(|joint| !still.contains(joint)).collect();
    if points.len() < FEWEST || moving.len() > MOST_JOINTS {
        return Vec::new();
    }
    let left = |counting: Counting| {
        let (rows, robot) = counting.applied(&joints, robot);
        Some(robot.fit_tool(&rows, &points, Start::File)?.left_mm)
    };
    let turns = |joint: &usize| moving.contains(joint) && !set.is_sliding(*joint);
    let coupled = moving.iter().filter(|joint| **joint > 0 && turns(joint) && turns(&(**joint - 1)));
    let couplings: Vec<Option<(usize, f64)>> =
        std::iter::once(None).chain(coupled.flat_map(|joint| [1.0, -1.0].map(|times| Some((*joint, times))))).collect();
    let all: Vec<Counting> = (0..1_u32 << moving.len())
        .flat_map(|choice| {
            let signs = moving.iter().enumerate().filter(|(k, _)| choice >> k & 1 == 1);
            let negated = signs.fold(0, |mask, (_, joint)| mask | 1 << joint);
            couplings.iter().map(move |coupled| Counting { negated, coupled: *coupled })
        })
        .collect();
    let Some(now) = left(Counting { negated: 0, coupled: None }) else { return Vec::new() };
    let mut tried: Vec<(f64, Counting)> =
        all.par_iter().filter(|counting| counting.is_of_several()).filter_map(|of| Some((left(*of)?, *of))).collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(least) = tried.first().map(|(mm, _)| *mm).filter(|mm| NEARER * mm < now) else { return Vec::new() };
    let near = tried.into_iter().take_while(|(mm, _)| *mm < EXPLAINS * least).map(|(_, counting)| counting);
    let near: Vec<Counting> = near.collect();
    let (nearest, others) = near.split_at(near.len().min(FITTED));
    // With fewer changes another placement may tell as much.
    let parts = others.iter().filter(|other| nearest.iter().any(|own| other.is_part_of(own)));
    nearest.iter().chain(parts.take(FITTED)).map(|counting| Hypothesis::Counted(*counting)).collect()
}

/// Those that do not say more than others of them with which fits leave as much.
pub fn without_untold(tried: &[(Misfit, Hypothesis)]) -> Vec<(Misfit, Hypothesis)> {
    let says_less = |other: &Hypothesis, own: &Hypothesis| match (other, own) {
        (Hypothesis::Counted(other), Hypothesis::Counted(own)) => other.is_part_of(own),
        _ => false,
    };
    let is_told = |(there, own): &&(Misfit, Hypothesis)| {
        !tried.iter().any(|(other, hypothesis)| says_less(hypothesis, own) && other.fits_like(there))
    };
    tried.iter().filter(is_told).copied().collect()
}
