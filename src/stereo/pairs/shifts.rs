//! Which right picture belongs to which left one where a camera lost pictures of a series.
//!
//! In: the board's pose in every picture of both cameras, each from that picture alone, in the order of the series.
//! Out: the pictures in pairs, of which as many as can be are of one rig. Method: the poses of two pictures of one
//! moment give the place of the right camera to the left one, which is the same for all such pairs. The place that each
//! two neighbours give is tried; dynamic programming finds the pairs, none crossing another, that are nearest to it,
//! where each loss of pictures costs a part of what a pair that agrees is worth. The place whose pairs are nearest in
//! all is taken. Goes wrong: boards that hardly move from one picture to the next, or by the same motion each time,
//! agree with a shift as well.

use rayon::prelude::*;

use crate::geometry::Transform;
use crate::statistics::median;
use crate::stereo::pairs::numbering::{deviation, renumbered};

/// Pictures that one camera may have lost more than the other.
const FARTHEST: usize = 3;
/// How many places ahead of the left picture the right one may be, or behind it; the index of a shift is this more.
const SHIFTS: usize = 2 * FARTHEST + 1;
/// Left pictures of a long series whose neighbours are tried, spread over it.
const TRIED: usize = 60;
/// How far two places of the right camera from single pictures of one moment are apart where they tell it well: rad,
/// plus the share of the boards' distance.
const USUAL: f64 = 0.01;
/// From here on two places do not agree.
const FAR: f64 = 0.15;
/// What a loss costs, in pairs that agree to the last digit. One pair at the end of a series speaks for a loss where it
/// agrees well; two losses that undo each other, as two pictures with exchanged names show them, need two between them.
const COST: f64 = 0.75;

/// Two pictures that are taken for one pair, by their places in the series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Partners {
    pub left: usize,
    pub right: usize,
    /// Whether their poses agree with the rig of the others.
    pub agree: bool,
}

/// The pictures in the pairs that are nearest to one rig, by their left pictures. `poses` are `left_from_board` and
/// `right_from_board` of every place in the series; `turns` of the numbering are those that pictures leave open.
pub fn partners(turns: &[usize], poses: [&[Option<Transform>]; 2]) -> Vec<Partners> {
    let [left, right] = poses;
    let count = left.len().min(right.len());
    let distance_mm = median(left.iter().flatten().map(|pose| pose.translation.vector.norm())).unwrap_or(1.0);
    let of = |at: usize, shift: usize| -> Vec<Transform> {
        let pair = left[at].zip(partner(at, shift, count).and_then(|at| right[at]));
        let place = |(l, r): (Transform, Transform)| turns.iter().map(move |&q| r * renumbered(q) * l.inverse());
        pair.into_iter().flat_map(place).collect()
    };
    let places: Vec<[Vec<Transform>; SHIFTS]> =
        (0..count).map(|at| std::array::from_fn(|shift| of(at, shift))).collect();
    let earned = |rig: &Transform| -> Vec<[f64; SHIFTS]> {
        let nearest = |near: &[Transform]| -> f64 {
            near.iter().map(|place| gain(deviation(place, rig, distance_mm))).fold(0.0, f64::max)
        };
        places.iter().map(|near| std::array::from_fn(|shift| nearest(&near[shift]))).collect()
    };
    let rigs: Vec<&Transform> = places.iter().step_by(count.div_ceil(TRIED).max(1)).flatten().flatten().collect();
    let paths: Vec<Path> = rigs.par_iter().map(|rig| best(&earned(rig))).collect();
    let path = paths.into_iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap_or_default();
    let pair = |&(left, shift, agree): &(usize, usize, bool)| {
        partner(left, shift, count).map(|right| Partners { left, right, agree })
    };
    path.steps.iter().filter_map(pair).collect()
}

/// The place in the series of the right picture that is so far ahead.
fn partner(left: usize, shift: usize, count: usize) -> Option<usize> {
    (left + shift).checked_sub(FARTHEST).filter(|right| *right < count)
}

/// What a pair is worth whose place is so far from the rig's: 1 where it is the same, 0 where it does not agree.
fn gain(off: f64) -> f64 {
    let worth = |off: f64| (off / USUAL).powi(2).ln_1p();
    (1.0 - worth(off) / worth(FAR)).max(0.0)
}

/// A way through the series.
#[derive(Debug, Clone, Default)]
struct Path {
    gain: f64,
    /// Left picture, its shift, and whether the pair agrees, from first to last.
    steps: Vec<(usize, usize, bool)>,
}

/// The way that gains most; `earned` has what each left picture's pair gains in every shift.
fn best(earned: &[[f64; SHIFTS]]) -> Path {
    let mut totals: Vec<[f64; SHIFTS]> = Vec::new();
    let mut before: Vec<[Option<(usize, usize)>; SHIFTS]> = Vec::new();
    for (at, earned) in earned.iter().enumerate() {
        let (mut total, mut from) = (*earned, [None; SHIFTS]);
        for shift in 0..SHIFTS {
            let mut most = if at == 0 { 0.0 } else { f64::NEG_INFINITY };
            // The same shift first, so that nothing is lost where nothing speaks for it.
            for other in std::iter::once(shift).chain((0..SHIFTS).filter(|other| *other != shift)) {
                // Left pictures whose right ones were lost are passed over.
                let Some(last) = at.checked_sub(1 + other.saturating_sub(shift)) else { continue };
                let gained = totals[last][other] - if other == shift { 0.0 } else { COST };
                if gained > most {
                    (most, from[shift]) = (gained, Some((last, other)));
                }
            }
            total[shift] += most;
        }
        totals.push(total);
        before.push(from);
    }
    let last = totals.len().checked_sub(1).map(|at| (at, &totals[at]));
    let end = last.and_then(|(at, totals)| {
        let shift = (0..SHIFTS).max_by(|a, b| totals[*a].total_cmp(&totals[*b]))?;
        Some((totals[shift], (at, shift)))
    });
    let Some((gain, end)) = end else { return Path::default() };
    let mut steps: Vec<(usize, usize, bool)> = std::iter::successors(Some(end), |&(at, shift)| before[at][shift])
        .map(|(at, shift)| (at, shift, earned[at][shift] > 0.0))
        .collect();
    steps.reverse();
    Path { gain, steps }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;
    use crate::simulate::draws::{Draws, Purpose};
    use crate::stereo::synthetic::World;
    use nalgebra::Vector3;

    /// Pairs of a series, and how far a picture's pose is off: rad, and as a share of the distance.
    const PAIRS: usize = 16;
    const OFF: f64 = 0.002;

    /// What a single picture of each camera shows, in a series of so many pairs.
    fn poses(seed: u64, off: f64) -> [Vec<Transform>; 2] {
        let world = World::new(PAIRS, seed);
        let mut draws = Draws::new(seed, Purpose::Points, 3);
        let mut shown = |pose: Transform| {
            let turn = Vector3::from_fn(|_, _| draws.normal()) * off;
            let mut shown = pose * transform(turn, Vector3::zeros());
            shown.translation.vector *= 1.0 + off * draws.normal();
            shown
        };
        let left = world.poses.iter().map(|pose| shown(*pose)).collect();
        [left, world.poses.iter().map(|pose| shown(world.rig.right_from_left * pose)).collect()]
    }

    /// The pairs of the pictures that are left, in both lists as many as in the shorter.
    fn found(poses: &[Vec<Transform>; 2]) -> Vec<Partners> {
        let count = poses[0].len().min(poses[1].len());
        let [left, right] = poses.each_ref().map(|of| of[..count].iter().copied().map(Some).collect::<Vec<_>>());
        partners(&[0], [&left, &right])
    }

    /// Places in the series as they were before pictures were lost, from these of the pictures that are left.
    fn before(lost: &[usize]) -> Vec<usize> {
        (0..PAIRS).filter(|at| !lost.contains(at)).collect()
    }

    fn without(poses: &mut Vec<Transform>, lost: &[usize]) {
        *poses = before(lost).into_iter().map(|at| poses[at]).collect();
    }

    #[test]
    fn every_picture_after_a_loss_has_its_own_partner() {
        for off in [0.0, OFF] {
            for side in [0, 1] {
                for first in [0, 1, 2, 4, 7, 8, 11, 13] {
                    for lost in [&[first][..], &[first, first + 1]] {
                        let mut poses = poses(5 + first as u64, off);
                        without(&mut poses[side], lost);
                        let pairs = found(&poses);
                        let mut places = [before(&[]), before(&[])];
                        places[side] = before(lost);
                        let moment = |pair: &Partners| [places[0][pair.left], places[1][pair.right]];
                        let right = pairs.iter().filter(|pair| pair.agree).map(moment);
                        let right: Vec<[usize; 2]> = right.collect();
                        // A single pair before or after the loss may agree too badly to speak for it.
                        let all = PAIRS - 2 * lost.len();
                        let single = first == 1 || first + 1 == all;
                        let all = all.max(first) - usize::from(single && off > 0.0);
                        let said = format!("{off} {side} {lost:?}: {right:?}");
                        assert!(right.len() >= all && right.iter().all(|[l, r]| l == r), "{said}");
                    }
                }
            }
        }
    }

    #[test]
    fn losses_at_two_places_and_in_both_cameras_are_found() {
        let mut twice = poses(3, OFF);
        without(&mut twice[1], &[3, 10]);
        let shifts = |pairs: Vec<Partners>| -> Vec<(usize, usize)> {
            pairs.iter().filter(|pair| pair.agree).map(|pair| (pair.left, pair.right)).collect()
        };
        let expected: Vec<_> =
            (0..3).map(|i| (i, i)).chain((4..10).map(|i| (i, i - 1))).chain((11..14).map(|i| (i, i - 2))).collect();
        assert_eq!(shifts(found(&twice)), expected);
        let mut both = poses(4, OFF);
        without(&mut both[1], &[3]);
        without(&mut both[0], &[9]);
        let expected: Vec<_> =
            (0..3).map(|i| (i, i)).chain((4..9).map(|i| (i, i - 1))).chain((9..15).map(|i| (i, i))).collect();
        assert_eq!(shifts(found(&both)), expected);
    }

    #[test]
    fn pairs_that_belong_together_stay_so() {
        for seed in 0..10 {
            let mut poses = poses(seed, 2.0 * OFF);
            // Some pictures without a board, two exchanged, one that moved.
            poses[1].swap(4, 9);
            poses[0][12] = transform(Vector3::new(0.1, 0.2, 0.0), Vector3::new(8.0, -9.0, 20.0)) * poses[0][12];
            let [left, right] = poses.map(|of| of.into_iter().map(Some).collect::<Vec<_>>());
            let blind = |poses: &[Option<Transform>], at: usize| {
                let mut poses = poses.to_vec();
                poses[at] = None;
                poses
            };
            let pairs = partners(&[0], [&blind(&left, 6), &blind(&right, 1)]);
            let agree = pairs.iter().filter(|pair| pair.agree).count();
            assert!(pairs.iter().all(|pair| pair.left == pair.right) && agree >= PAIRS - 5, "{seed}: {pairs:?}");
        }
    }

    #[test]
    fn pictures_of_no_common_moment_agree_in_no_pairing() {
        for seed in 0..20 {
            let ([left, _], [_, right]) = (poses(seed, OFF), poses(seed + 100, OFF));
            let agree = found(&[left, right]).iter().filter(|pair| pair.agree).count();
            assert!(2 * agree < PAIRS, "{seed}: {agree}");
        }
    }
}
