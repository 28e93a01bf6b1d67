//! Why all pairs of a series miss their rig by more than their corners let expect.
//!
//! In: a calibration from all pairs, and what changed over them. Out: the cause that they share: a board whose squares are not as wide and high as
//! was said, or else, where they miss their rig by several times what each camera leaves of its own pictures, pictures that were
//! not taken at one moment. Method: one camera alone takes up much of a board that is too wide in the place that it gives it, two cameras
//! cannot; the ratio of width and height that the pairs ask for is looked for, all poses and the rig solved again, and it is the cause where the
//! misfit goes with it. The size of the squares itself no pictures tell. Goes wrong: both at once are told as the one that explains more.

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{Along, Finding, Kind};
use crate::imaging::Side;
use crate::statistics::median;
use crate::stereo::Lens;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::{View, in_use};
use crate::stereo::init::board_pose::misfit_px;
use crate::stereo::model::{Layout, Shared};
use crate::stereo::pairs::{Cause, Missed, TIMES};
use crate::stereo::solve::uncertainty;
use crate::stereo::solve::{Priors, Problem};

/// Pairs that are named as the worst.
const WORST: usize = 5;

/// Change of the board's ratio of width and height by which the equations are asked what it would gain: far below what moves a corner by a pixel.
const SMALL: f64 = 1e-4;

/// Rounds after which the ratio stands still to [`STILL`], from a tenth of the board.
const MOST_ROUNDS: usize = 6;
const STILL: f64 = 1e-7;

/// Most of the misfit that a board may leave where pictures that were not taken at one moment would explain all of it. One number of sixteen that a
/// rig has takes up little of what has another cause.
const BESIDE_LATE: f64 = 0.5;

/// Chance with which what pairs miss their rig by for another reason may look like a board's sides.
const CHANCE: f64 = 1e-3;

/// No printer stretches a board by more.
const MOST_STRETCH: f64 = 0.1;

/// The cause that all pairs share, where there is one.
pub fn look(calibration: &Calibration, changes: &[Finding]) -> Option<Finding> {
    let told = |finding: &Finding| finding.along.clone().filter(|along| along.by_pair.len() == calibration.views.len());
    let misfit = misfit_without(calibration, changes.iter().find_map(told));
    // As the refinement states it; zero where it gave none.
    let corner_sigma_px = median(in_use(&calibration.views).map(|o| (0.5 * o.covariance_px2.trace()).sqrt()));
    let corner_sigma_px = corner_sigma_px.unwrap_or(0.0);
    let missed = Missed { alone_px: calibration.alone_px, paired_px: misfit.usual_px };
    let is_late = misfit.usual_px >= TIMES * corner_sigma_px && missed.is_of_two_moments();
    other_sides(calibration, &misfit, corner_sigma_px, if is_late { BESIDE_LATE } else { 1.0 })
        .or_else(|| is_late.then(|| not_simultaneous(calibration.alone_px, misfit)))
}

/// How far pairs miss their common rig.
struct Misfit {
    /// Median over the pairs, px.
    usual_px: f64,
    /// The pairs, the worst first.
    worst_first: Vec<String>,
}

/// Pictures that were not taken at one moment: neither the corners nor a lens explain so much.
fn not_simultaneous(alone_px: f64, misfit: Misfit) -> Finding {
    Finding {
        cause: Cause::NotSimultaneous.word().to_owned(),
        kind: Kind::Pair,
        size: Some(misfit.usual_px),
        unit: "px",
        action: format!(
            "the pictures of the pairs were not taken at one moment: half of the pairs miss the rig by {:.2} px and more, each camera alone \
             by {alone_px:.2} px; the worst are {}. Trigger both cameras at once, or hold the board still",
            misfit.usual_px,
            misfit.worst_first.iter().take(WORST).cloned().collect::<Vec<_>>().join(", ")
        ),
        pairs: misfit.worst_first,
        ..Finding::default()
    }
}

/// How far the pairs miss the rig, each its own along a change where there is one.
fn misfit_without(calibration: &Calibration, change: Option<Along>) -> Misfit {
    let (layout, views, shared) = (&calibration.layout, &calibration.views, &calibration.values.shared);
    let of = |i: usize| match &change {
        Some(along) => left_px(&layout.step(shared, along.to(along.by_pair[i]).as_slice()), &views[i]),
        None => left_px(shared, &views[i]),
    };
    let px: Vec<f64> = (0..views.len()).into_par_iter().map(of).collect();
    let mut worst: Vec<usize> = (0..px.len()).collect();
    worst.sort_by(|a, b| px[*b].total_cmp(&px[*a]).then(a.cmp(b)));
    Misfit {
        usual_px: median(px.iter().copied()).unwrap_or(0.0),
        worst_first: worst.into_iter().map(|i| views[i].pair.clone()).collect(),
    }
}

fn left_px(shared: &Shared, view: &View) -> f64 {
    misfit_px(shared, view).map_or(f64::INFINITY, |(px, _)| px)
}

/// A board whose squares are not as wide and high as was said, where the pairs fit one rig with other squares, and those move the corners by more
/// than these scatter; `most` is the share of the misfit that may be left.
fn other_sides(calibration: &Calibration, misfit: &Misfit, corner_sigma_px: f64, most: f64) -> Option<Finding> {
    // What corners scatter by leaves nothing to explain.
    if misfit.usual_px < std::f64::consts::SQRT_2 * corner_sigma_px {
        return None;
    }
    // With at least the terms that nearly all lenses need: misfit that the board made may have left fewer.
    let [left, right] = Side::BOTH.map(|side| calibration.layout.lens(side).map(|lens| lens.max(Lens::Brown5)));
    let layout = Layout { left, right, ..calibration.layout };
    // What a richer lens takes up is not the board's.
    let mut problem = calibration.problem();
    if calibration.known_sides == [false; 2] && problem.priors.know_lenses() {
        // What each camera alone says of its lens has the board's error in it.
        problem.priors = Priors::of_rig(calibration.rig(), calibration.board.diagonal_mm());
    }
    let problem = refitted(&problem, &layout)?;
    let before_px = median_px(&problem)?.min(misfit.usual_px);
    let (stretch, fitted) = likeliest_stretch(&problem, &layout)?;
    let left_px = median_px(&fitted)?;
    let of_board_px = (before_px.powi(2) - left_px.powi(2)).max(0.0).sqrt();
    if left_px > most * before_px || of_board_px < corner_sigma_px {
        return None;
    }
    let [width_mm, height_mm] = calibration.board.sides_mm();
    let said = width_mm / height_mm;
    let digits = if stretch.abs() < 1e-3 { 6 } else { 4 };
    Some(Finding {
        cause: Cause::OtherBoard.word().to_owned(),
        kind: Kind::Step,
        pairs: calibration.pair_names(),
        size: Some(100.0 * stretch),
        unit: "%",
        action: format!(
            "the board's {} are {:.digits$} times as wide as high, not {said:.digits$} times as was said: with that half of the pairs miss \
             the rig by {left_px:.3} px and more, instead of {before_px:.3} px. Measure the board along and across, and give \
             `--measured-mm WxH`",
            calibration.board.unit(),
            said * (1.0 + stretch),
        ),
        ..Finding::default()
    })
}

/// By how much wider the board is than was said, for its height, and the pairs with that board. `None` where the pairs do not tell, or where it
/// explains too little of what they miss the rig by to be the cause. Method: Gauss-Newton with the rig and the poses eliminated.
fn likeliest_stretch(problem: &Problem, layout: &Layout) -> Option<(f64, Problem)> {
    /// Share of chi-squared that a cause takes away at least.
    const LEAST: f64 = 0.25;
    // What pairs miss a rig by is six numbers of each, of which the rig takes up its own.
    let freedom = (6 * problem.views.len()) as f64 - layout.count() as f64;
    let is_chance = |share: f64| {
        let law = FisherSnedecor::new(1.0, freedom);
        law.map_or(true, |law| law.sf(freedom * share / (1.0 - share).max(f64::EPSILON)) > CHANCE)
    };
    let (mut stretch, mut fitted) = (0.0, problem.clone());
    for round in 0..MOST_ROUNDS {
        let at = |by: f64| {
            let equations = stretched(&fitted, by).equations(layout)?;
            Some(equations.cost() - 0.5 * uncertainty::expected_decrease(&equations)?)
        };
        let [below, here, above] = [at(-SMALL)?, at(0.0)?, at(SMALL)?];
        let (slope, curvature) = (0.5 * (above - below), above - 2.0 * here + below);
        let change = -slope / curvature * SMALL;
        let share = 0.5 * slope * slope / curvature / here;
        let enough = round > 0 || share > LEAST && !is_chance(share);
        stretch = (1.0 + stretch) * (1.0 + change) - 1.0;
        if !(curvature > 0.0 && enough && f64::abs(stretch) < MOST_STRETCH) {
            return None;
        }
        fitted = refitted(&stretched(&fitted, change), layout)?;
        if change.abs() < STILL {
            break;
        }
    }
    Some((stretch, fitted))
}

/// The pairs with the rig that fits them best.
fn refitted(problem: &Problem, layout: &Layout) -> Option<Problem> {
    Some(Problem { values: problem.refit(layout)?, ..problem.with_layout(layout) })
}

/// How far half of the pairs miss their rig.
fn median_px(problem: &Problem) -> Option<f64> {
    let shared = &problem.values.shared;
    median(problem.views.par_iter().map(|view| left_px(shared, view)).collect::<Vec<f64>>())
}

/// The pairs of a board that is wider by this share for its height.
fn stretched(problem: &Problem, by: f64) -> Problem {
    let mut problem = problem.clone();
    for o in problem.views.iter_mut().flat_map(|view| &mut view.observations) {
        o.board_mm.x *= (1.0 + by).sqrt();
        o.board_mm.y /= (1.0 + by).sqrt();
    }
    problem
}
