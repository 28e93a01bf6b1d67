//! The pairs that one rig is calibrated from, and what happened to the others.
//!
//! In: candidates. Out: the views with values to start from, and the pairs that are left out with their causes. Method:
//! the numbering that most pairs agree on, the relative pose that lies in their middle, one robust bundle over all of
//! them. A pair is left out only where it misses the rig of all by several times what pairs usually do: then its
//! pictures do not belong together, or something else happened to it. How much pairs usually miss their rig is
//! estimated from the pairs at hand; hand-held boards before cameras that nobody triggered miss it by much more than
//! their corners scatter, and belong to it all the same. Goes wrong: half of the pairs or more contradict the others.

use rayon::prelude::*;

use crate::geometry::Transform;
use crate::imaging::{Side, Skipped};
use crate::statistics::median;
use crate::stereo::data::View;
use crate::stereo::init::board_pose::{as_one_board, misfit_px, times_alone};
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::model::{Layout, Shared, Values};
use crate::stereo::pairs::candidates::Candidates;
use crate::stereo::pairs::discarded::too_few_pairs;
use crate::stereo::pairs::{Cause, DiscardedPair, Missed, mixups, moved, numbering};
use crate::stereo::solve::{Priors, Problem};
use crate::stereo::{Error, Lens, Rig};

/// A pair that misses the rig by so many times what pairs usually do is not one of them.
pub const SEVERAL: f64 = 6.0;

/// Rounds of calibrating and of looking which pairs belong.
const MOST_ROUNDS: usize = 5;

/// The lens with which pairs are looked at before there is another: what nearly all cameras need.
const FIRST_LENS: Lens = Lens::Brown5;

/// A rig that misses half of its pairs by more than this share of the picture's width, and by several times what each
/// camera leaves of its own pictures, is the rig of none of them.
const LARGEST_SHARE: f64 = 2e-3;

/// The pairs of a rig, near their common minimum.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Its pairs, with right corners turned where that was needed, and a first rig with each pair's pose on it.
    pub problem: Problem,
    pub discarded: Vec<DiscardedPair>,
    /// How many pairs of runs that contradict the others stayed.
    pub runs: usize,
    /// What the left and the right camera usually leave of their own pictures, px.
    pub alone_px: [f64; 2],
    /// How far the pairs miss the rig beside that.
    pub missed: Missed,
}

/// What a pair leaves on a rig: px, and its pose. `None` where it has none.
type Misfit = Option<(f64, Transform)>;

/// Finds the pairs of the rig. With `runs`, the first or the last pairs of the series stay where they contradict the
/// others and nothing was mixed up in them: a rig that changed is a step to be found over the series, and not a few bad
/// pairs.
pub fn find(candidates: &Candidates, runs: bool) -> Result<Series, Error> {
    let (views, first) = numbered(candidates)?;
    let mut shared = first;
    let diagonal_mm = candidates.board.diagonal_mm();
    let priors = Priors::of_rig(&shared.rig, diagonal_mm);
    let mut misfits = misfits(&shared, &views);
    let mut members = belonging(&misfits);
    for _ in 0..MOST_ROUNDS {
        shared = bundle(&views, &misfits, &members, &shared, &priors)?;
        misfits = self::misfits(&shared, &views);
        let now = belonging(&misfits);
        if now == members {
            break;
        }
        members = now;
    }
    let usual_px = median(misfits.iter().flatten().map(|(px, _)| *px)).unwrap_or(f64::INFINITY);
    let strays: Vec<usize> = (0..views.len()).filter(|i| !members.contains(i)).collect();
    let alone_px = candidates.cameras.each_ref().map(|camera| camera.median_px.as_slice());
    let limit_px = SEVERAL * usual_px;
    let series = mixups::Series { shared: &shared, board: &candidates.board, views: &views, alone_px, limit_px };
    let mixed_up = mixups::explain(&series, &strays);
    let mut runs_kept = Vec::new();
    if runs {
        let open: Vec<usize> = strays.iter().zip(&mixed_up).filter(|(_, why)| why.is_none()).map(|(i, _)| *i).collect();
        runs_kept = ends(&open, views.len(), &misfits);
        members.extend(&runs_kept);
        members.sort_unstable();
    }
    let out: Vec<_> = strays.into_iter().zip(mixed_up).filter(|(i, _)| !runs_kept.contains(i)).collect();
    let open = out.iter().filter(|(_, why)| why.is_none()).map(|(i, _)| (*i, misfits[*i].map(|(px, _)| px)));
    let alone_px = alone_px_of(candidates);
    let times = |view: &View| times_alone(&shared, view, alone_px, as_one_board);
    let times = median(views.par_iter().filter_map(times).collect::<Vec<f64>>());
    let missed = Missed { times: times.unwrap_or(f64::INFINITY) };
    let mut moved = moved::explain(&series, &open.collect::<Vec<_>>(), usual_px, missed).into_iter();
    let discard = |(i, why): (usize, Option<(Cause, String)>)| {
        let of = |(cause, reason)| DiscardedPair::new(&views[i].pair, cause, reason);
        why.map(of).or_else(|| moved.next())
    };
    let discarded: Vec<DiscardedPair> = out.into_iter().filter_map(discard).collect();
    check(candidates, &misfits, usual_px, &members, &discarded)?;
    let values = Values { shared, poses: members.iter().filter_map(|&i| Some(misfits[i]?.1)).collect() };
    let views = members.iter().map(|&i| views[i].clone()).collect();
    let mut discarded: Vec<DiscardedPair> = discarded.into_iter().chain(candidates.discarded.iter().cloned()).collect();
    discarded.sort_by(|a, b| a.pair.cmp(&b.pair));
    let (problem, runs) = (Problem { views, values, priors }, runs_kept.len());
    Ok(Series { problem, discarded, runs, alone_px, missed })
}

/// The pairs with the numbering that they agree on, and the rig in the middle of their own.
fn numbered(candidates: &Candidates) -> Result<(Vec<View>, Shared), Error> {
    let [left, right] = &candidates.cameras;
    let both: Vec<Option<(Transform, Transform)>> =
        left.poses.iter().zip(&right.poses).map(|(l, r)| l.zip(*r)).collect();
    let distances = both.iter().flatten().map(|(l, _)| l.translation.vector.norm());
    let distance_mm = median(distances).ok_or(Error::NothingInCommon { pairs: both.len() })?;
    let open = candidates.board.turns_left_open();
    let (right_from_left, turns) =
        numbering::agreed(&open, &both, distance_mm).ok_or(Error::NoCamera { side: Side::Right })?;
    let mut views = candidates.views.clone();
    for (view, turn) in views.iter_mut().zip(turns) {
        view.turn_right(&candidates.board, turn);
    }
    let rig = Rig { left: left.camera, right: right.camera, right_from_left, covariance: None };
    Ok((views, Shared { rig, shape_mm: FLAT }))
}

fn misfits(shared: &Shared, views: &[View]) -> Vec<Misfit> {
    views.par_iter().map(|view| misfit_px(shared, view)).collect()
}

/// The pairs that miss the rig by no more than several times what pairs usually do.
fn belonging(misfits: &[Misfit]) -> Vec<usize> {
    let usual = median(misfits.iter().map(|misfit| misfit.map_or(f64::INFINITY, |(px, _)| px))).unwrap_or(0.0);
    (0..misfits.len()).filter(|&i| misfits[i].is_some_and(|(px, _)| px <= SEVERAL * usual)).collect()
}

/// The rig of these pairs by a robust bundle.
fn bundle(
    views: &[View],
    misfits: &[Misfit],
    members: &[usize],
    start: &Shared,
    priors: &Priors,
) -> Result<Shared, Error> {
    let poses = members.iter().filter_map(|&i| Some(misfits[i]?.1)).collect();
    let values = Values { shared: start.clone(), poses };
    let views = members.iter().map(|&i| views[i].clone()).collect();
    let mut problem = Problem { views, values, priors: priors.clone() };
    let rig = &mut problem.values.shared.rig;
    (rig.left.lens, rig.right.lens) = (FIRST_LENS, FIRST_LENS);
    problem.search_roughly(&Layout::rig(FIRST_LENS, false)).ok_or_else(Error::undetermined)?;
    Ok(problem.values.shared)
}

/// Which of these pairs are a run of two or more at the beginning or at the end of the series, with poses on the rig.
fn ends(open: &[usize], count: usize, misfits: &[Misfit]) -> Vec<usize> {
    let is_open = |i: &usize| open.contains(i) && misfits[*i].is_some();
    let first: Vec<usize> = (0..count).take_while(is_open).collect();
    let last: Vec<usize> = (0..count).rev().take_while(is_open).collect();
    [first, last].into_iter().filter(|run| run.len() >= 2).flatten().collect()
}

/// What each camera usually leaves of its own pictures, px.
fn alone_px_of(candidates: &Candidates) -> [f64; 2] {
    candidates.cameras.each_ref().map(|camera| median(camera.median_px.iter().flatten().copied()).unwrap_or(0.0))
}

/// Refuses where there is no telling which pairs are right, or too few are left.
fn check(
    candidates: &Candidates,
    misfits: &[Misfit],
    usual_px: f64,
    members: &[usize],
    discarded: &[DiscardedPair],
) -> Result<(), Error> {
    let total = candidates.views.len();
    let alone_px = alone_px_of(candidates).into_iter().fold(0.0, f64::max);
    let width_px = f64::from(candidates.width_px);
    let none = usual_px > SEVERAL * alone_px && usual_px > LARGEST_SHARE * width_px;
    if none || 2 * members.len() <= total {
        let missed_px = |i: usize| misfits[i].map_or(f64::NAN, |(px, _)| px);
        let fits = |i: usize| missed_px(i) <= SEVERAL * alone_px;
        // What undoes a pair's misfit does so by chance where hardly a pair fits the rig.
        let is_rig = !none || members.iter().filter(|&&i| fits(i)).count() >= candidates.fewest_pairs;
        let is_told = |pair: &&DiscardedPair| is_rig || matches!(pair.cause, Cause::Duplicate | Cause::Misread);
        let mut bad: Vec<Skipped> = discarded.iter().filter(is_told).map(DiscardedPair::skipped).collect();
        let mut agreeing = members.len();
        if none {
            let missed = |i: usize| {
                let reason = match fits(i) {
                    true => "on that rig".to_owned(),
                    false => format!("{:.1} px off the rig of all", missed_px(i)),
                };
                Skipped { pair: candidates.views[i].pair.clone(), reason }
            };
            let is_open = |i: &usize| bad.iter().all(|told| told.pair != candidates.views[*i].pair);
            let open: Vec<usize> = (0..total).filter(is_open).collect();
            agreeing = open.iter().filter(|i| fits(**i)).count();
            bad.extend(open.into_iter().map(missed));
            bad.sort_by(|a, b| a.pair.cmp(&b.pair));
        }
        return Err(Error::Contradiction { agreeing, total, usual_px, alone_px, bad });
    }
    if members.len() < candidates.fewest_pairs {
        let all: Vec<DiscardedPair> = discarded.iter().chain(&candidates.discarded).cloned().collect();
        return Err(too_few_pairs(members.len(), candidates.fewest_pairs, &all));
    }
    Ok(())
}
