//! Why all pairs of a series miss their rig by more than their corners let expect.
//!
//! In: a calibration from all pairs, and what changed over them. Out: the cause that they share: a board whose squares
//! are not as wide and high as was said, or else, where they miss their rig by several times what each camera leaves of
//! its own pictures, pictures that were not taken at one moment; where they miss it by less, only if another place of
//! the right camera for each pair takes away half of the misfit, and goes neither with where the board stood, as what a
//! lens or a board lacks does, nor with a focus. Method: one camera alone takes up much of a board that is too wide in
//! the place that it gives it, two cameras cannot; the ratio of width and height that the pairs ask for is looked for,
//! all poses and the rig solved again, and it is the cause where the misfit goes with it. The size of the squares
//! itself no pictures tell. Goes wrong: both at once are told as the one that explains more.

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::hypothesis::{any_place, refocused};
use super::series::{Linear, PLACES_FROM};
use super::{Along, Finding, Kind};
use crate::diagnostic::two_digits;
use crate::imaging::Side;
use crate::statistics::median;
use crate::stereo::Lens;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::{View, in_use};
use crate::stereo::init::board_pose::{as_one_board, as_two_boards, misfit_px, times_alone};
use crate::stereo::model::{Layout, Shared};
use crate::stereo::pairs::{Cause, Missed, TIMES};
use crate::stereo::solve::uncertainty;
use crate::stereo::solve::{Priors, Problem};

/// Pairs that are named as the worst.
const WORST: usize = 5;

/// How many times what corners scatter by pairs miss their rig by at least where something moved between their
/// pictures.
const BESIDE_CORNERS: f64 = 2.0;

/// Change of the board's ratio of width and height by which the equations are asked what it would gain: far below what
/// moves a corner by a pixel.
const SMALL: f64 = 1e-4;

/// Rounds after which the ratio stands still to [`STILL`], from a tenth of the board.
const MOST_ROUNDS: usize = 6;
const STILL: f64 = 1e-7;

/// Most of the misfit that a board may leave where pictures that were not taken at one moment would explain all of it.
/// One number of sixteen that a rig has takes up little of what has another cause.
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
    let is_of_two_moments = misfit.usual_px >= TIMES * corner_sigma_px && misfit.missed.is_of_two_moments();
    let is_late = is_of_two_moments
        || changes.is_empty()
            && misfit.usual_px >= BESIDE_CORNERS * corner_sigma_px
            && each_moved(calibration, &misfit);
    other_sides(calibration, &misfit, corner_sigma_px, if is_late { BESIDE_LATE } else { 1.0 })
        .or_else(|| is_late.then(|| not_simultaneous(calibration, misfit)))
}

/// Whether something that moved between the two pictures of each pair is why these miss their rig by more than each
/// camera misses its own pictures, and nothing else explains it. Too few pairs do not tell.
fn each_moved(calibration: &Calibration, misfit: &Misfit) -> bool {
    let (views, shared) = (&calibration.views, &calibration.values.shared);
    let apart = |view: &View| times_alone(shared, view, calibration.alone_px, as_two_boards);
    let with_own = || median(views.par_iter().filter_map(apart).collect::<Vec<f64>>());
    // With a place of the right camera for each pair it is missed by no more than each camera misses its own pictures.
    let explains = |own: f64| Missed { times: misfit.missed.times / own.max(1.0) }.is_better_alone();
    views.len() >= PLACES_FROM && with_own().is_some_and(explains) && is_of_each_pair(calibration).unwrap_or(false)
}

/// Whether what takes the right camera elsewhere is each pair's own.
fn is_of_each_pair(calibration: &Calibration) -> Option<bool> {
    /// Share of the pairs' own changes that another cause takes away where it may be the cause.
    const BY_PLACE: f64 = 0.25;
    const BY_FOCUS: f64 = 0.5;
    let (problem, layout, rig) = (calibration.problem(), &calibration.layout, calibration.rig());
    let linear = Linear::new(&problem, layout)?;
    let anywhere = any_place(layout);
    let gain = |places| linear.gain_of_each(&anywhere, places);
    let (all, beside_places) = (gain(false)?, gain(true)?);
    let focus = Side::BOTH.map(|side| refocused(layout, rig, &[side], 0.01));
    let by_focus = linear.gain_of_each(&focus, false)? * focus.len() as f64 / (all * anywhere.len() as f64);
    Some(beside_places > (1.0 - BY_PLACE) * all && by_focus < BY_FOCUS)
}

/// How far pairs miss their common rig.
struct Misfit {
    /// Median over the pairs, px.
    usual_px: f64,
    /// The same beside what each camera leaves.
    missed: Missed,
    /// The pairs, the worst first.
    worst_first: Vec<String>,
}

/// Pictures that were not taken at one moment: neither the corners nor a lens explain so much.
fn not_simultaneous(calibration: &Calibration, misfit: Misfit) -> Finding {
    let size = calibration
        .pair_motion()
        .map(|[v, _]| [v.fixed_rows::<3>(3).sum().sqrt(), v.fixed_rows::<3>(0).sum().sqrt().to_degrees()]);
    let otherwise = size.map_or(String::new(), |[mm, deg]| {
        format!(
            "the board (or a camera) moved between the two, so that from pair to pair the cameras seem to stand otherwise by {mm:.2} mm and \
             {deg:.2} deg; "
        )
    });
    let [left_px, right_px] = calibration.alone_px.map(two_digits);
    let told = |otherwise: &str| {
        format!(
            "the pictures of the pairs were not taken at one moment: {otherwise}half of the pairs miss the rig by {:.2} px and more, the left camera alone \
             its pictures by {left_px} px and the right one by {right_px} px",
            misfit.usual_px
        )
    };
    let worst = misfit.worst_first.iter().take(WORST).cloned().collect::<Vec<_>>().join(", ");
    Finding {
        cause: Cause::NotSimultaneous.word().to_owned(),
        kind: Kind::Pair,
        size: Some(size.map_or(misfit.usual_px, |[mm, _]| mm)),
        unit: if size.is_some() { "mm" } else { "px" },
        action: format!("{}; the worst are {worst}", told(&otherwise)),
        brief: Some(told("")),
        pairs: misfit.worst_first,
        remedy: Some("trigger both cameras at once, or put the board on a stand for each pair".to_owned()),
        ..Finding::default()
    }
}

/// How far the pairs miss their rig.
pub fn missed(calibration: &Calibration) -> Missed {
    misfit_without(calibration, None).missed
}

/// How far the pairs miss the rig, each its own along a change where there is one.
fn misfit_without(calibration: &Calibration, change: Option<Along>) -> Misfit {
    let (layout, views, shared) = (&calibration.layout, &calibration.views, &calibration.values.shared);
    let of = |i: usize| {
        let moved = change.as_ref().map(|along| layout.step(shared, along.to(along.by_pair[i]).as_slice()));
        let shared = moved.as_ref().unwrap_or(shared);
        let times = times_alone(shared, &views[i], calibration.alone_px, as_one_board);
        (left_px(shared, &views[i]), times.unwrap_or(f64::INFINITY))
    };
    let (px, times): (Vec<f64>, Vec<f64>) = (0..views.len()).into_par_iter().map(of).unzip();
    let mut worst: Vec<usize> = (0..px.len()).collect();
    worst.sort_by(|a, b| px[*b].total_cmp(&px[*a]).then(a.cmp(b)));
    Misfit {
        usual_px: median(px.iter().copied()).unwrap_or(0.0),
        missed: Missed { times: median(times).unwrap_or(0.0) },
        worst_first: worst.into_iter().map(|i| views[i].pair.clone()).collect(),
    }
}

fn left_px(shared: &Shared, view: &View) -> f64 {
    misfit_px(shared, view).map_or(f64::INFINITY, |(px, _)| px)
}

/// A board whose squares are not as wide and high as was said, where the pairs fit one rig with other squares, and
/// those move the corners by more than these scatter; `most` is the share of the misfit that may be left.
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
             the rig by {left_px:.3} px and more, instead of {before_px:.3} px",
            calibration.board.unit(),
            said * (1.0 + stretch),
        ),
        remedy: Some(match calibration.board.stretch == 1.0 {
            true => "measure the board along and across, and give `--measured-mm WxH`".to_owned(),
            // Both sides were said.
            false => format!(
                "the sides that were given, {} mm, contradict the pictures: measure the board along and across once more",
                calibration.board.side_said()
            ),
        }),
        ..Finding::default()
    })
}

/// By how much wider the board is than was said, for its height, and the pairs with that board. `None` where the pairs
/// do not tell, or where it explains too little of what they miss the rig by to be the cause. Method: Gauss-Newton with
/// the rig and the poses eliminated.
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
