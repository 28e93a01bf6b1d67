//! Pairs that agree on one rig.
//!
//! In: corners. Out: the views that belong together with a first rig and poses, and the others with the reason. Method: each camera
//! alone; the relative pose most pairs agree on (turns of a board that looks the same after them are undone); a robust
//! bundle; pairs that contradict it are taken out and asked again. Goes wrong: most pairs contradict each other.

use rayon::prelude::*;

use super::bundle::{self, Search, Values};
use super::calibrate::FEWEST_PAIRS;
use super::homography::FEWEST_CORNERS;
use super::layout::{Layout, Shared};
use super::mixups::{self, Member, Series, renumbered};
use super::noise::Noise;
use super::observations::{Side, View};
use super::residuals;
use super::robust::Loss;
use super::screening::{self, Usual};
use super::start::{self, CAUCHY_WIDTH, OneCamera};
use super::{Error, Lens, Rig};
use crate::geometry::Transform;
use crate::imaging::{Board, Corner, Corners, PairCorners, Skipped, order};
use crate::median::median;

/// Lens of the first rig.
const FIRST_LENS: Lens = Lens::Brown4;

/// Rounds of taking out and asking again.
const ROUNDS: usize = 4;

/// Views that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Consensus {
    /// The pairs, with right corners turned where that was needed.
    pub views: Vec<View>,
    /// A first rig, and each pair's pose on it.
    pub values: Values,
    /// The other pairs.
    pub skipped: Vec<Skipped>,
}

/// A pair with what each of its pictures says alone.
struct Candidate {
    view: View,
    alone_px: [Option<f64>; 2],
}

/// Finds the pairs that agree.
pub fn find(corners: &Corners) -> Result<Consensus, Error> {
    let mut skipped = corners.skipped.clone();
    let mut views = Vec::new();
    let fewest = FEWEST_CORNERS.max(fewest_corners(&corners.board));
    for (i, pair) in corners.pairs.iter().enumerate() {
        if let Some(first) = corners.pairs[..i].iter().find(|first| same_corners(first, pair)) {
            let reason = format!("the same pictures as pair {}", first.pair);
            skipped.push(Skipped { pair: pair.pair.clone(), reason });
            continue;
        }
        let view = View::new(&corners.board, pair, fewest);
        let [left, right] = Side::BOTH.map(|side| view.active(side).count());
        if left.min(right) < fewest {
            skipped.push(Skipped { pair: view.pair, reason: format!("too few corners: {left} left, {right} right") });
        } else {
            views.push(view);
        }
    }
    let total = views.len() + skipped.len();
    let too_few = |found: usize, skipped: &[Skipped]| Error::TooFewPairs { found, total, skipped: skipped.to_vec() };
    if views.len() < FEWEST_PAIRS {
        return Err(too_few(views.len(), &skipped));
    }
    let (left, right) = rayon::join(
        || start::one_camera(&views, Side::Left, corners.left_size),
        || start::one_camera(&views, Side::Right, corners.right_size),
    );
    let left = left.ok_or(Error::NoCamera { side: Side::Left })?;
    let right = right.ok_or(Error::NoCamera { side: Side::Right })?;
    let candidates: Vec<Candidate> = views
        .into_iter()
        .enumerate()
        .map(|(i, view)| Candidate { view, alone_px: [left.median_px[i], right.median_px[i]] })
        .collect();
    let (candidates, first) = first_rig(&corners.board, candidates, &left, &right)?;
    let usual = Usual { px: usual_px(&candidates), width_px: corners.left_size.0.max(corners.right_size.0) };
    let (shared, inside, on_rig) = agree(&candidates, first, &usual)?;
    gather(&corners.board, candidates, &shared, (&inside, &on_rig), skipped, &usual)
}

/// True for corners of the same pictures: no two pictures have the same noise.
fn same_corners(a: &PairCorners, b: &PairCorners) -> bool {
    let same = |a: &[Corner], b: &[Corner]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.px == b.px);
    same(&a.left, &b.left) && same(&a.right, &b.right)
}

/// A quarter of the board tells its pose well enough.
fn fewest_corners(board: &Board) -> usize {
    board.corner_count().div_ceil(4).min(12)
}

/// The rig that most pairs agree on, with turns of a board that looks the same after them undone.
fn first_rig(
    board: &Board,
    mut candidates: Vec<Candidate>,
    left: &OneCamera,
    right: &OneCamera,
) -> Result<(Vec<Candidate>, Shared), Error> {
    let both: Vec<Option<(Transform, Transform)>> =
        left.poses.iter().zip(&right.poses).map(|(l, r)| l.zip(*r)).collect();
    // Numberings that the colours leave open.
    let quarters: Vec<usize> = order::ambiguity(*board).map_or(vec![0], |step| (0..4).step_by(step).collect());
    let choices: Vec<Vec<Transform>> = both
        .iter()
        .flatten()
        .map(|(l, r)| quarters.iter().map(|&quarters| r * renumbered(quarters) * l.inverse()).collect())
        .collect();
    let distances = both.iter().flatten().map(|(l, _)| l.translation.vector.norm());
    let distance_mm = median(distances).ok_or(Error::NoCamera { side: Side::Left })?;
    let right_from_left =
        start::agreed_transform(&choices, distance_mm).ok_or(Error::NoCamera { side: Side::Right })?;
    for (candidate, poses) in candidates.iter_mut().zip(&both) {
        let Some((l, r)) = poses else { continue };
        let off = |quarters: &usize| {
            start::deviation(&(r * renumbered(*quarters) * l.inverse()), &right_from_left, distance_mm)
        };
        let nearest = quarters.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
        candidate.view.turn_right(board, nearest.unwrap_or(0));
    }
    let rig = Rig { left: left.camera, right: right.camera, right_from_left, covariance: None };
    Ok((candidates, Shared { rig, shape_mm: [0.0; 2] }))
}

/// A pair on the common rig: the larger of its pictures' median residuals, px, and its pose there. `None` where it has none.
type OnRig = Option<(f64, Transform)>;

/// Improves the rig on the pairs that agree with it until they stay the same; says which do.
fn agree(candidates: &[Candidate], first: Shared, usual: &Usual) -> Result<(Shared, Vec<bool>, Vec<OnRig>), Error> {
    let mut shared = first;
    let readable: Vec<bool> = candidates.iter().map(|c| c.alone_px.iter().all(Option::is_some)).collect();
    let mut inside = readable.clone();
    let mut on_rig = all_on_rig(candidates, &shared, &vec![None; candidates.len()]);
    for _ in 0..ROUNDS {
        let chosen: Vec<usize> = (0..candidates.len()).filter(|&i| inside[i] && on_rig[i].is_some()).collect();
        if chosen.len() < FEWEST_PAIRS {
            break;
        }
        let mut views: Vec<View> = chosen.iter().map(|&i| candidates[i].view.clone()).collect();
        let poses = chosen.iter().filter_map(|&i| on_rig[i].map(|(_, pose)| pose)).collect();
        let mut values = Values { shared, poses };
        for _ in 0..2 {
            let residuals = residuals::active(&views, &values).ok_or(Error::NotConverged { steps: 0 })?;
            Noise::from_median(&residuals).apply(&mut views);
            let layout = Layout::rig(FIRST_LENS, false);
            values = bundle::solve(&views, &layout, values, Loss::Cauchy(CAUCHY_WIDTH), Search::ROUGH).values;
        }
        shared = values.shared;
        on_rig.fill(None);
        for (&i, pose) in chosen.iter().zip(&values.poses) {
            let found = screening::worse_median_px(&shared, pose, &candidates[i].view).map(|px| (px, *pose));
            // What does not fit may only have been led astray by an earlier rig: it is asked afresh, like those that were out.
            on_rig[i] = found.filter(|_| misfit(&found, &candidates[i], usual) <= 1.0);
        }
        on_rig = all_on_rig(candidates, &shared, &on_rig);
        let next: Vec<bool> =
            (0..candidates.len()).map(|i| readable[i] && misfit(&on_rig[i], &candidates[i], usual) <= 1.0).collect();
        if next == inside {
            break;
        }
        inside = next;
    }
    Ok((shared, inside, on_rig))
}

/// Every pair on the rig: what is known is kept, the others are looked for.
fn all_on_rig(candidates: &[Candidate], shared: &Shared, known: &[OnRig]) -> Vec<OnRig> {
    let of = |(candidate, known): (&Candidate, &OnRig)| known.or_else(|| screening::misfit_px(shared, &candidate.view));
    candidates.par_iter().zip(known).map(of).collect()
}

/// Median of what pictures leave alone, px.
fn usual_px(candidates: &[Candidate]) -> f64 {
    median(candidates.iter().flat_map(|c| c.alone_px).flatten()).unwrap_or(0.0)
}

/// A pair's residual on the rig as a share of its limit; above one it does not belong.
fn misfit(on_rig: &OnRig, candidate: &Candidate, usual: &Usual) -> f64 {
    let alone = candidate.alone_px[0].unwrap_or(f64::INFINITY).max(candidate.alone_px[1].unwrap_or(f64::INFINITY));
    on_rig.map_or(f64::INFINITY, |(px, _)| px / usual.limit_px(alone))
}

/// Sorts the pairs into those that stay and those that are out, with reasons.
fn gather(
    board: &Board,
    candidates: Vec<Candidate>,
    shared: &Shared,
    agreed: (&[bool], &[OnRig]),
    mut skipped: Vec<Skipped>,
    usual: &Usual,
) -> Result<Consensus, Error> {
    let total = candidates.len() + skipped.len();
    let judged = candidates.len();
    let members = candidates.iter().zip(agreed.0);
    let members =
        members.map(|(c, &belongs)| Member { view: &c.view, alone_px: c.alone_px, belongs }).collect::<Vec<_>>();
    let reasons = mixups::explain(&Series { shared, board, usual: *usual, members });
    let (mut views, mut poses, mut bad) = (Vec::new(), Vec::new(), Vec::new());
    for ((candidate, on_rig), reason) in candidates.into_iter().zip(agreed.1).zip(reasons) {
        match (on_rig, reason) {
            (Some((_, pose)), None) => {
                views.push(candidate.view);
                poses.push(*pose);
            }
            (on_rig, reason) => {
                let reason = with_misfit(reason.unwrap_or_default(), on_rig.map(|m| m.0), usual.px);
                bad.push(Skipped { pair: candidate.view.pair, reason });
            }
        }
    }
    // Where fewer than half agree there is no telling which of them are right.
    if 2 * views.len() <= judged && !bad.is_empty() {
        let agreeing = views.len();
        let lonely =
            |view: View| Skipped { pair: view.pair, reason: "fits that rig, but too few do to trust it".into() };
        bad.extend(views.into_iter().map(lonely));
        bad.sort_by(|a, b| a.pair.cmp(&b.pair));
        return Err(Error::Contradiction { agreeing, total: judged, bad });
    }
    skipped.extend(bad);
    skipped.sort_by(|a, b| a.pair.cmp(&b.pair));
    if views.len() < FEWEST_PAIRS {
        return Err(Error::TooFewPairs { found: views.len(), total, skipped });
    }
    Ok(Consensus { views, values: Values { shared: shared.clone(), poses }, skipped })
}

fn with_misfit(reason: String, misfit_px: Option<f64>, usual_px: f64) -> String {
    misfit_px.map_or(reason.clone(), |px| {
        format!("{reason} (residual {px:.2} px on the common rig, {usual_px:.2} px in most single pictures)")
    })
}
