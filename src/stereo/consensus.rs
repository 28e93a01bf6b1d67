//! Pairs that agree on one rig.
//!
//! In: corners. Out: the views that belong together with a first rig and poses, and the others with the reason. Method: each camera
//! alone; the relative pose most pairs agree on (a half turn of a board that looks the same after one is undone); a robust
//! bundle; pairs that contradict it are taken out and asked again. Goes wrong: most pairs contradict each other.

use super::bundle::{self, Values};
use super::calibrate::FEWEST_PAIRS;
use super::homography::FEWEST_CORNERS;
use super::layout::{Layout, Shared};
use super::noise::Noise;
use super::observations::{Side, View};
use super::residuals;
use super::robust::Loss;
use super::screening::{self, Look, Usual};
use super::start::{self, CAUCHY_WIDTH, OneCamera};
use super::{Error, Lens, Rig};
use crate::geometry::Transform;
use crate::imaging::{Board, Corners, Skipped};

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
    for pair in &corners.pairs {
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
    let left = start::one_camera(&views, Side::Left, corners.left_size).ok_or(Error::NoCamera { side: Side::Left })?;
    let right =
        start::one_camera(&views, Side::Right, corners.right_size).ok_or(Error::NoCamera { side: Side::Right })?;
    let candidates: Vec<Candidate> = views
        .into_iter()
        .enumerate()
        .map(|(i, view)| Candidate { view, alone_px: [left.median_px[i], right.median_px[i]] })
        .collect();
    let (candidates, first) = first_rig(&corners.board, candidates, &left, &right)?;
    let usual = Usual { px: usual_px(&candidates), width_px: corners.left_size.0.max(corners.right_size.0) };
    let (shared, inside) = agree(&candidates, first, &usual)?;
    gather(&corners.board, candidates, &shared, &inside, skipped, &usual)
}

/// A quarter of the board tells its pose well enough.
fn fewest_corners(board: &Board) -> usize {
    board.corner_count().div_ceil(4).min(12)
}

/// The rig that most pairs agree on, with half turns undone.
fn first_rig(
    board: &Board,
    mut candidates: Vec<Candidate>,
    left: &OneCamera,
    right: &OneCamera,
) -> Result<(Vec<Candidate>, Shared), Error> {
    let both: Vec<Option<(Transform, Transform)>> =
        left.poses.iter().zip(&right.poses).map(|(l, r)| l.zip(*r)).collect();
    let half_turn =
        crate::geometry::transform(nalgebra::Vector3::z() * std::f64::consts::PI, nalgebra::Vector3::zeros());
    let choices: Vec<Vec<Transform>> = both
        .iter()
        .flatten()
        .map(|(l, r)| {
            let mut all = vec![r * l.inverse()];
            if board.looks_the_same_after_half_turn() {
                all.push(r * half_turn * l.inverse());
            }
            all
        })
        .collect();
    let mut distances: Vec<f64> = both.iter().flatten().map(|(l, _)| l.translation.vector.norm()).collect();
    distances.sort_by(f64::total_cmp);
    let distance_mm = distances.get(distances.len() / 2).copied().ok_or(Error::NoCamera { side: Side::Left })?;
    let right_from_left =
        start::agreed_transform(&choices, distance_mm).ok_or(Error::NoCamera { side: Side::Right })?;
    if board.looks_the_same_after_half_turn() {
        for (candidate, poses) in candidates.iter_mut().zip(&both) {
            let Some((l, r)) = poses else { continue };
            let [straight, turned] = [r * l.inverse(), r * half_turn * l.inverse()]
                .map(|rig| start::deviation(&rig, &right_from_left, distance_mm));
            if turned < straight {
                candidate.view.turn_right(board);
            }
        }
    }
    let rig = Rig { left: left.camera, right: right.camera, right_from_left, covariance: None };
    Ok((candidates, Shared { rig, shape_mm: [0.0; 2] }))
}

/// Improves the rig on the pairs that agree with it until they stay the same; says which do.
fn agree(candidates: &[Candidate], first: Shared, usual: &Usual) -> Result<(Shared, Vec<bool>), Error> {
    let mut shared = first;
    let readable: Vec<bool> = candidates.iter().map(|c| c.alone_px.iter().all(Option::is_some)).collect();
    let mut inside = readable.clone();
    for _ in 0..ROUNDS {
        let mut views: Vec<View> =
            candidates.iter().zip(&inside).filter(|(_, inside)| **inside).map(|(c, _)| c.view.clone()).collect();
        if views.len() < FEWEST_PAIRS {
            break;
        }
        // A new rig needs poses that suit it: the old ones of a pair that was out belong to nothing.
        let (poses, kept): (Vec<Transform>, Vec<View>) =
            views.drain(..).filter_map(|view| Some((screening::misfit_px(&shared, &view)?.1, view))).unzip();
        let mut views = kept;
        let mut values = Values { shared, poses };
        for _ in 0..2 {
            let residuals = residuals::active(&views, &values).ok_or(Error::NotConverged { steps: 0 })?;
            Noise::from_median(&residuals).apply(&mut views);
            let layout = Layout::rig(FIRST_LENS, false);
            values = bundle::solve(&views, &layout, values, Loss::Cauchy(CAUCHY_WIDTH)).values;
        }
        shared = values.shared;
        let next: Vec<bool> = candidates
            .iter()
            .zip(&readable)
            .map(|(c, readable)| *readable && misfit(&shared, c, usual) <= 1.0)
            .collect();
        if next == inside {
            break;
        }
        inside = next;
    }
    Ok((shared, inside))
}

/// Median of what pictures leave alone, px.
fn usual_px(candidates: &[Candidate]) -> f64 {
    let mut all: Vec<f64> = candidates.iter().flat_map(|c| c.alone_px).flatten().collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied().unwrap_or(0.0)
}

/// A pair's residual on the rig as a share of its limit; above one it does not belong.
fn misfit(shared: &Shared, candidate: &Candidate, usual: &Usual) -> f64 {
    let alone = candidate.alone_px[0].unwrap_or(f64::INFINITY).max(candidate.alone_px[1].unwrap_or(f64::INFINITY));
    let limit = usual.limit_px(alone);
    screening::misfit_px(shared, &candidate.view).map_or(f64::INFINITY, |(px, _)| px / limit)
}

/// Sorts the pairs into those that stay and those that are out, with reasons.
fn gather(
    board: &Board,
    candidates: Vec<Candidate>,
    shared: &Shared,
    inside: &[bool],
    mut skipped: Vec<Skipped>,
    usual: &Usual,
) -> Result<Consensus, Error> {
    let total = candidates.len() + skipped.len();
    let judged = candidates.len();
    let (mut views, mut poses, mut bad) = (Vec::new(), Vec::new(), Vec::new());
    for (candidate, inside) in candidates.into_iter().zip(inside) {
        match screening::misfit_px(shared, &candidate.view) {
            Some((_, pose)) if *inside => {
                views.push(candidate.view);
                poses.push(pose);
            }
            misfit => {
                let look = screening::look(shared, board, &candidate.view, candidate.alone_px, usual);
                bad.push(Skipped { pair: candidate.view.pair, reason: reason(look, misfit.map(|m| m.0), usual.px) });
            }
        }
    }
    // Where fewer than half agree there is no telling which of them are right.
    if 2 * views.len() <= judged && !bad.is_empty() {
        return Err(Error::Contradiction { agreeing: views.len(), total: judged, bad });
    }
    skipped.extend(bad);
    skipped.sort_by(|a, b| a.pair.cmp(&b.pair));
    if views.len() < FEWEST_PAIRS {
        return Err(Error::TooFewPairs { found: views.len(), total, skipped });
    }
    Ok(Consensus { views, values: Values { shared: shared.clone(), poses }, skipped })
}

fn reason(look: Look, misfit_px: Option<f64>, usual_px: f64) -> String {
    match misfit_px {
        Some(px) => format!(
            "{} (residual {px:.2} px on the common rig, {usual_px:.2} px in most single pictures)",
            look.describe()
        ),
        None => look.describe().to_owned(),
    }
}
