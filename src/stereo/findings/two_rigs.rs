//! A series in which one rig was followed by another: where, and what changed.
//!
//! In: pairs that contradict each other, or both rigs, each from its own pairs and with the same lens. Out: from which
//! pair on the later rig stands; the cause of the step, or the causes that are not told apart. Method: the last half or
//! quarter of the pairs is calibrated alone and goes back as far as the pairs fit it; those before must fit a rig as
//! well. The difference of both rigs' numbers is held against both covariances ([`crate::difference`]): a step of some
//! per cent leaves no common rig that is near to either, and what the equations there foretell of a cause
//! ([`super::series`]) may be that of another. Goes wrong: more than one step; rigs from pairs so few or so alike that
//! their numbers are only known along a bent valley.

use nalgebra::DVector;

use super::candidates::{Candidate, briefly, described, likeliest};
use super::common_misfit;
use super::hypothesis;
use super::one_side::MOST;
use super::series::Change;
use super::{Finding, Kind, hold};
use crate::difference::{Difference, TOLD_APART};
use crate::imaging::{Corners, PairCorners};
use crate::stereo::Rig;
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::init::board_pose::misfit_px;
use crate::stereo::model::Layout;
use crate::stereo::pairs::numbering::seen_on_rig;
use crate::stereo::pairs::series::SEVERAL;
use crate::stereo::pairs::{Cause, Missed, fewest_pairs};
use crate::stereo::select::model_comparison::OF_PAIR;
use crate::stereo::select::options::Options;
use crate::stereo::solve::uncertainty::worst_focal_sigma;
use crate::stereo::volume::lengths::VolumeLengths;

/// Chance that a cause that is the right one leaves more than it may.
const CHANCE: f64 = 0.01;

/// The later rig with its pairs, where pairs that miss a common one by so much fit two, one after the other, that they
/// miss by less than half of that, beyond what two rigs take up of the pairs' own scatter.
pub(super) fn later(corners: &Corners, missed: Missed, options: &Options) -> Option<(Corners, Calibration)> {
    let pairs = &corners.pairs;
    let fits = |pairs: &[PairCorners]| {
        let found = calibrate(&part(corners, pairs), options).ok()?;
        (found.views.len() as f64 >= MOST * pairs.len() as f64).then_some(found)
    };
    let fewest = fewest_pairs(options.known.as_ref());
    let tails = [2, 4].into_iter().map(|share| pairs.len() / share).filter(|tail| *tail >= fewest);
    let found = tails.into_iter().find_map(|tail| fits(&pairs[pairs.len() - tail..]))?;
    let first = first_that_fits(&found, pairs)?;
    if first < fewest || pairs.len() - first < fewest {
        return None;
    }
    let two @ [before, after] = &[fits(&pairs[..first])?, fits(&pairs[first..])?];
    // Share of what the pairs tell of where they see the right camera that is left to scatter beside so many numbers.
    let left = |numbers: usize| (1.0 - numbers as f64 / (OF_PAIR * pairs.len()) as f64).max(0.0);
    let [numbers_before, numbers_after] = [before, after].map(|rig| rig.layout.count());
    let times = two.iter().map(|rig| common_misfit::missed(rig).times).fold(0.0, f64::max);
    let [one, both] = [numbers_after, numbers_before + numbers_after].map(left);
    let explain = (2.0 * times).powi(2) * one < missed.times.powi(2) * both;
    explain.then(|| (part(corners, &pairs[first..]), after.clone()))
}

/// The same corners of these pairs alone.
fn part(corners: &Corners, pairs: &[PairCorners]) -> Corners {
    Corners { pairs: pairs.to_vec(), ..corners.clone() }
}

/// The earliest pair that fits a rig of the last ones and from which on most pairs do.
fn first_that_fits(found: &Calibration, pairs: &[PairCorners]) -> Option<usize> {
    let shared = &found.values.shared;
    let usual_px = found.usual_misfit_px()?;
    let fits = |pair: &PairCorners| {
        let view = seen_on_rig(shared, &found.board, pair, Some(&found.noise));
        misfit_px(shared, &view).is_some_and(|(px, _)| px <= SEVERAL * usual_px)
    };
    let fit: Vec<bool> = pairs.iter().map(fits).collect();
    let share = |first: usize| fit[first..].iter().filter(|fits| **fits).count() as f64 / (fit.len() - first) as f64;
    (0..fit.len()).find(|&first| fit[first] && share(first) >= MOST)
}

/// Tells a step to a rig anew by the rig before it, where the pairs before it make one, from which what was told does
/// not lead to the later one, and where a cause does. `told` is the change of the shared numbers that was told.
pub(super) fn retell(
    change: &mut Finding,
    corners: &Corners,
    after: &Calibration,
    told: Option<DVector<f64>>,
    lengths: &VolumeLengths,
    options: &Options,
) {
    let Some(first) = change.pairs.first() else { return };
    let pairs = &corners.pairs;
    let before = &pairs[..pairs.iter().position(|pair| pair.pair == *first).unwrap_or(0)];
    let layout = &after.layout;
    let options = Options { lens: layout.left, shape: Some(layout.shape), ..options.clone() };
    let before = calibrate(&part(corners, before), &options).ok();
    let before = before.filter(|before| before.layout == *layout);
    let Some(told) = before.and_then(|before| step(&before, after, told, lengths)) else { return };
    let effect_mm = told.effect_mm.unwrap_or(0.0);
    let moves = format!(" from pair {first} on, which moves a length by up to {effect_mm:.4} mm");
    let [action, brief] = [&told.action, told.briefly()].map(|what| format!("{what}{moves}"));
    let remedy = hold(&told.cause, None);
    *change = Finding { action, brief: Some(brief), remedy, pairs: std::mem::take(&mut change.pairs), ..told };
}

/// Whether the numbers of a rig are known along a straight line.
fn tells_its_lenses(found: &Calibration) -> bool {
    /// Largest standard deviation of a focal length as a share of it: over such a step the numbers leave the tangent of
    /// the valley along which they are known by as large a share of it.
    const STRAIGHT: f64 = 0.1;
    worst_focal_sigma(&found.covariance, &found.layout, found.rig()) <= STRAIGHT
}

/// The rig about which a finite step is taken for its directions: with the lenses before it, so that a focal length
/// changes by a share of those; a turn takes the translation along an arc, whose chord is square to its middle.
fn half_way(before: &Rig, after: &Rig) -> Rig {
    let mut rig = before.clone();
    let translation = &mut rig.right_from_left.translation.vector;
    *translation = translation.lerp(&after.right_from_left.translation.vector, 0.5);
    rig
}

/// The step from one rig to the other, told by its likeliest cause. `None` where what was told explains it, nothing
/// does, or one of the rigs hardly tells its focal lengths.
fn step(
    before: &Calibration,
    after: &Calibration,
    told: Option<DVector<f64>>,
    lengths: &VolumeLengths,
) -> Option<Finding> {
    let rigs = [before, after];
    if !rigs.into_iter().all(tells_its_lenses) {
        return None;
    }
    let numbers = after.layout.shape_start();
    let layout = Layout { shape: false, ..after.layout };
    let joint = before.covariance.view((0, 0), (numbers, numbers)) + after.covariance.view((0, 0), (numbers, numbers));
    let off = after.layout.between(&before.values.shared, &after.values.shared).rows(0, numbers).into_owned();
    let pairs = rigs.iter().map(|rig| rig.views.len()).sum();
    let scatter = rigs.iter().map(|rig| rig.inflation).fold(1.0, f64::max);
    let difference = Difference::new(off, &joint, pairs, scatter)?;
    let change = |directions: &[DVector<f64>]| {
        let left = difference.left_by(directions)?;
        let gain = difference.log_likelihood(left) - difference.log_likelihood(difference.chi_square());
        let common = DVector::zeros(numbers);
        let sigma = difference.along(directions.first()?)?.1;
        Some(Change { amounts: difference.amounts(directions)?, sigma, common, gain: 2.0 * gain, scatter: 1.0 })
    };
    let rig = half_way(before.rig(), after.rig());
    let hypotheses = hypothesis::all(&layout, &rig);
    let candidates = Candidate::all(&change, pairs, &hypotheses, (&layout, &rig), true);
    let mut equals = likeliest(&candidates, pairs);
    let best = *equals.first()?;
    if let Some(told) = told.map(|told| told.rows(0, numbers).into_owned()) {
        // By as much as was told, and by as much as the rigs say.
        let beside = Difference::new(&difference.off - &told, &joint, pairs, scatter)?;
        let gain = change(std::slice::from_ref(&told))?.gain;
        let cost = (best.change.amounts.len() - 1) as f64 * (pairs as f64).ln();
        let is_less_likely = 0.5 * (best.change.gain - gain - cost) > TOLD_APART;
        if beside.chi_square() <= beside.limit(numbers, CHANCE) && !is_less_likely {
            return None;
        }
    }
    let explains = |candidate: &&Candidate| {
        let limit = difference.limit(numbers - candidate.change.amounts.len(), CHANCE);
        candidate.left(&difference).is_some_and(|left| left <= limit)
    };
    equals.retain(explains);
    let first = *equals.first()?;
    let (size, unit) = first.size();
    Some(Finding {
        kind: Kind::Step,
        cause: Cause::words(equals.iter().map(|candidate| candidate.cause())),
        size: Some(size),
        unit,
        effect_mm: Some(lengths.most_changed_mm(&layout, &first.whole())),
        action: described(&equals),
        brief: Some(briefly(&equals, false)),
        ..Finding::default()
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use crate::imaging::Corners;
    use crate::stereo::Error;
    use crate::stereo::findings::standing::{Asked, calibrate_standing};
    use crate::stereo::findings::{Finding, Kind};
    use crate::stereo::select::options::Options;
    use crate::stereo::synthetic::World;
    use crate::stereo::volume::Extent;

    const PAIRS: usize = 16;

    /// What is said of a series whose pairs from one of them on are of another world.
    fn found(change: impl Fn(&World) -> World, first: usize, seed: u64) -> Result<Vec<Finding>, Error> {
        let world = World::new(PAIRS, seed);
        let mut corners = world.corners(14);
        let later = change(&world).corners(15);
        corners.pairs[first..].clone_from_slice(&later.pairs[first..]);
        let asked = Asked { options: Options::default(), tolerance_mm: 0.05, extent: Extent::default() };
        let (found, told) = calibrate_standing(&corners, &asked)?;
        assert_eq!(found.views.len(), PAIRS - first, "{told:?}");
        Ok(told)
    }

    fn is_step(change: impl Fn(&World) -> World, cause: &str, size: f64, within: f64) {
        for (first, seed) in [(5, 3), (8, 13), (10, 23)] {
            let told = found(&change, first, seed);
            let Ok([Finding { kind: Kind::Step, cause: told, size: Some(told_size), pairs, .. }]) = told.as_deref()
            else {
                panic!("{cause} {size} from {first}: {told:?}")
            };
            let is_told = told == cause && (told_size - size).abs() < within && pairs.len() == PAIRS - first;
            assert!(is_told, "{cause} {size} from {first}: {told} {told_size} {pairs:?}");
        }
    }

    /// A picture that is enlarged about its middle, as a zoom does.
    #[test]
    fn a_lens_that_was_zoomed_is_named_whatever_the_size() {
        for percent in [1.0, 2.0, 5.0, 12.0] {
            let zoomed = |world: &World| {
                let (mut world, by) = (world.clone(), 1.0 + 0.01 * percent);
                let right = &mut world.rig.right;
                let middle = [0.5 * f64::from(right.width - 1), 0.5 * f64::from(right.height - 1)];
                (right.fx, right.fy) = (by * right.fx, by * right.fy);
                (right.cx, right.cy) =
                    (middle[0] + by * (right.cx - middle[0]), middle[1] + by * (right.cy - middle[1]));
                world
            };
            // Of the focal length before, or of that after.
            is_step(zoomed, "focus", percent, 0.02 * percent + 0.011 * percent * percent);
        }
    }

    #[test]
    fn a_camera_that_was_turned_is_named_whatever_the_angle() {
        for deg in [0.3_f64, 1.0, 3.0, 6.0] {
            let turned = |world: &World| world.with_camera_moved(Vector3::y() * deg.to_radians(), Vector3::zeros());
            is_step(turned, "yaw", deg, 0.05 * deg);
        }
    }

    #[test]
    fn pairs_that_fit_no_two_rigs_contradict_each_other() {
        let world = World::new(PAIRS, 13);
        let mut shuffled: Corners = world.corners(14);
        let rights: Vec<_> = shuffled.pairs.iter().map(|pair| pair.right.clone()).collect();
        (0..PAIRS).for_each(|at| shuffled.pairs[at].right = rights[(5 * at + 3) % PAIRS].clone());
        let asked = Asked { options: Options::default(), tolerance_mm: 0.05, extent: Extent::default() };
        let by_hand = [8, 10, 12, 16].map(|pairs| World::new(pairs, 13).corners_by_hand(14, 4.0));
        for corners in by_hand.into_iter().chain([shuffled]) {
            let said = calibrate_standing(&corners, &asked).map(|(_, told)| told);
            assert!(matches!(said, Err(Error::Contradiction { .. })), "{} pairs: {said:?}", corners.pairs.len());
        }
    }
}
