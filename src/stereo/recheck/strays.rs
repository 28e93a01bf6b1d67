//! Pairs that contradict an old rig by themselves: what few of them say is lost among the others.
//!
//! In: pairs at the old rig with their poses there. Out: those that no scatter of this rig explains, and how far a
//! length is another one on the rig that each gives by itself, and in words what they say. Method: Rao's score tells
//! which; the place of the right camera is then fitted to the pair alone, with the lenses of the old rig, until it
//! settles. Goes wrong: pictures that are no pair give a rig that is none, and a size that is none.

use nalgebra::DMatrix;
use serde::Serialize;

use crate::diagnostic::two_digits;
use crate::imaging::Board;
use crate::imaging::corners::named;
use crate::stereo::board_pose::pair_excess::{self, Usual};
use crate::stereo::model::rig::Rig;
use crate::stereo::model::{Layout, Values};
use crate::stereo::solve::levenberg_marquardt::Search;
use crate::stereo::solve::{Loss, Priors, Problem};
use crate::stereo::volume::lengths::VolumeLengths;

/// A pair that contradicts the old rig by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stray {
    pub pair: String,
    /// By how much a rig that agrees with it has another length, mm.
    pub effect_mm: f64,
}

/// Finds them at the values of the problem. `rig`: the old rig's covariance; `usual`: how its own pairs scatter.
pub fn find(
    problem: &Problem,
    (board, layout): (&Board, &Layout),
    rig: &DMatrix<f64>,
    usual: Usual,
    lengths: &VolumeLengths,
) -> Vec<Stray> {
    let off_mm = |own: &Rig| {
        let measured = lengths.measured_by(own).into_iter().flatten();
        measured.map(|mm| (mm - lengths.length_mm).abs()).fold(0.0, f64::max)
    };
    let stray =
        |pair: usize| Stray { pair: problem.views[pair].pair.clone(), effect_mm: off_mm(&rig_of(problem, pair)) };
    pair_excess::strays(problem, board, layout, rig, usual).into_iter().map(stray).collect()
}

/// The rig on which the right camera stands as a pair alone has it.
fn rig_of(problem: &Problem, pair: usize) -> Rig {
    const PLACE: Layout = Layout { left: None, right: None, transform: true, shape: false };
    let values = Values { shared: problem.values.shared.clone(), poses: vec![problem.values.poses[pair]] };
    let alone = Problem { views: vec![problem.views[pair].clone()], values, priors: Priors::NONE };
    alone.search(&PLACE, Loss::Squared, Search::TRIAL).values.shared.rig
}

fn names(strays: &[Stray]) -> Vec<String> {
    strays.iter().map(|stray| stray.pair.clone()).collect()
}

/// Which strays there are, and by how much.
fn contradicting(strays: &[Stray], length_mm: f64) -> String {
    let names = names(strays);
    let (noun, verb) = if names.len() == 1 { ("pair", "contradicts") } else { ("pairs", "contradict") };
    let effect_mm = two_digits(largest_mm(strays));
    format!("{noun} {} {verb} the calibration (a length of {length_mm} mm by up to {effect_mm} mm)", named(&names))
}

/// What strays among the pairs mean, for a person, where no common change says it.
pub fn statement(strays: &[Stray], pairs: &[String], length_mm: f64) -> String {
    let (names, said) = (names(strays), contradicting(strays, length_mm));
    match (names.len() == pairs.len(), pairs.ends_with(&names)) {
        (true, _) => {
            "every pair contradicts the calibration, and no common change explains how: pictures that are turned, exchanged or not taken at one \
             moment, another board, or a camera that is loose"
                .to_owned()
        }
        (false, true) => format!(
            "{said}, and the pairs before agree with it: the rig moved, or the two pictures were not taken at one moment"
        ),
        (false, false) => format!(
            "{said}, and the others agree with it: the two pictures were not taken at one moment, or the rig does not stand still"
        ),
    }
}

/// What they are off by at the most, mm.
pub fn largest_mm(strays: &[Stray]) -> f64 {
    strays.iter().map(|stray| stray.effect_mm).fold(0.0, f64::max)
}
