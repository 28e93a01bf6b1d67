//! The pairs before a step, and why each is left out.
//!
//! In: the rig of the pairs since, and the corners of all. Out: the others with their cause. Method: pictures that were
//! exchanged, turned or mirrored up to some pair make two rigs as well as a camera that moved does; each pair before is
//! tried as single pairs of a series are ([`crate::stereo::pairs::mixups`]), and where most miss the rig as they are and
//! fit it the other way round, that is why. Which part is named as it should be only the place of the cameras tells.
//! Goes wrong: cameras that changed places in between.

use super::one_side::MOST;
use crate::imaging::{Corners, PairCorners, Side};
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::View;
use crate::stereo::findings::Finding;
use crate::stereo::init::board_pose::misfit_px;
use crate::stereo::pairs::mixups::{self, Series};
use crate::stereo::pairs::numbering::seen_on_rig;
use crate::stereo::pairs::series::SEVERAL;
use crate::stereo::pairs::{Cause, DiscardedPair};

/// The pairs before those of the rig, and whether they are of another one.
pub(super) fn left_out(
    found: &Calibration,
    corners: &Corners,
    kept: &Corners,
    change: &Finding,
) -> (Vec<DiscardedPair>, bool) {
    let is_kept = |pair: &str| kept.pairs.iter().any(|p| p.pair == pair);
    let cause = of_rig(change);
    let reason = format!("the rig changed after it: {}", change.action);
    let before = corners.pairs.iter().filter(|p| !is_kept(&p.pair));
    let before: Vec<DiscardedPair> = before.map(|p| DiscardedPair::new(&p.pair, cause, reason.clone())).collect();
    match the_other_way_round(found, corners, &before) {
        Some(other) => (other, false),
        None => (before, true),
    }
}

/// The cause of pairs that a step left behind.
pub(super) fn of_rig(change: &Finding) -> Cause {
    if change.cause == Cause::Focus.word() { Cause::Focus } else { Cause::CameraMoved }
}

/// The same pairs, where most of them fit the rig the other way round.
fn the_other_way_round(found: &Calibration, corners: &Corners, before: &[DiscardedPair]) -> Option<Vec<DiscardedPair>> {
    let shared = &found.values.shared;
    let of = |pair: &PairCorners| seen_on_rig(shared, &found.board, pair, Some(&found.noise));
    let views: Vec<View> = corners.pairs.iter().map(of).collect();
    let is_before = |view: &View| before.iter().any(|pair| pair.pair == view.pair);
    let strays: Vec<usize> = (0..views.len()).filter(|&i| is_before(&views[i])).collect();
    let limit_px = SEVERAL * found.usual_misfit_px()?;
    let is_off = |i: &usize| misfit_px(shared, &views[*i]).is_none_or(|(px, _)| px > limit_px);
    let alone_px = Side::BOTH.map(|side| vec![Some(found.alone_px[side as usize]); views.len()]);
    let alone_px = [alone_px[0].as_slice(), alone_px[1].as_slice()];
    let series = Series { shared, board: &found.board, views: &views, alone_px, limit_px };
    let is_way_round =
        |(cause, _): &(Cause, String)| matches!(cause, Cause::Exchanged | Cause::Turned | Cause::Mirrored);
    let why = mixups::explain(&series, &strays).into_iter().zip(&strays);
    let why = why.map(|(why, i)| why.filter(|why| is_off(i) && is_way_round(why)));
    let why: Vec<(&DiscardedPair, Option<(Cause, String)>)> = before.iter().zip(why).collect();
    let told = why.iter().filter(|(_, why)| why.is_some()).count();
    let is_exchanged = found.rig().is_left_to_the_left() == Some(false);
    let discarded = |(pair, why): (&DiscardedPair, Option<(Cause, String)>)| {
        let (cause, reason) = match why {
            Some((Cause::Exchanged, _)) if is_exchanged => {
                let reason = "left and right are named the other way round than in the pairs of the rig, in which the left camera stands to the \
                              right: exchange the names of one part, probably of those";
                (Cause::Exchanged, reason.to_owned())
            }
            Some(why) => why,
            None => (Cause::Unknown, "it fits the rig neither as it is nor the other way round".to_owned()),
        };
        DiscardedPair::new(&pair.pair, cause, reason)
    };
    (told as f64 >= MOST * before.len() as f64).then(|| why.into_iter().map(discarded).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::findings::standing::{Asked, calibrate_standing};
    use crate::stereo::synthetic::{BROWN4, World};
    use crate::stereo::volume::Extent;
    use nalgebra::Vector3;

    const PAIRS: usize = 14;

    /// The rig's causes of what is left out, and whether it is said to have changed, where so many first pairs were
    /// changed.
    fn said(first: usize, change: impl Fn(&mut PairCorners)) -> (Vec<Cause>, bool) {
        let mut corners = World { sigma_px: 0.01, ..World::new(PAIRS, 21) }.corners(22);
        corners.pairs[..first].iter_mut().for_each(change);
        let asked = Asked { options: BROWN4, tolerance_mm: 0.05, extent: Extent::Boards };
        let (found, told) = calibrate_standing(&corners, &asked).unwrap();
        let causes = found.discarded.pairs.iter().map(|pair| pair.cause).collect();
        (causes, found.standing.since.is_some() || !told.is_empty())
    }

    #[test]
    fn names_that_were_exchanged_up_to_some_pair_are_no_rig_that_moved() {
        for first in [5, 7, 9] {
            let (causes, changed) = said(first, |pair| std::mem::swap(&mut pair.left, &mut pair.right));
            // The fewer are wrong.
            assert_eq!(causes, vec![Cause::Exchanged; first.min(PAIRS - first)], "{first}");
            assert!(!changed, "{first}");
        }
    }

    #[test]
    fn a_rig_that_moved_is_one() {
        let world = World { sigma_px: 0.01, ..World::new(PAIRS, 21) };
        for turn in [2e-4, 2e-3, 2e-2] {
            let moved = world.with_camera_moved(Vector3::new(0.0, turn, 0.0), Vector3::zeros()).corners(22);
            let (causes, changed) = said(7, |pair| {
                *pair = moved.pairs.iter().find(|moved| moved.pair == pair.pair).unwrap().clone();
            });
            let is_other = |cause: &Cause| matches!(cause, Cause::Exchanged | Cause::Turned | Cause::Mirrored);
            assert!(changed && !causes.iter().any(is_other), "{turn}: {causes:?}");
        }
    }
}
