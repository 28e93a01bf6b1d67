//! Pairs whose pictures were not taken at one moment, and pairs of another rig: each is named where it is so, and
//! neither where it is not.

use nalgebra::Vector3;

use crate::imaging::Corners;
use crate::stereo::Lens;
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::findings::standing::{Asked, calibrate_standing};
use crate::stereo::findings::{Finding, Kind, other_rig};
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::{BROWN4, World};
use crate::stereo::volume::Extent;

fn standing(corners: &Corners, options: Options) -> (Calibration, Vec<Finding>) {
    let asked = Asked { options, tolerance_mm: 0.05, extent: Extent::Boards };
    calibrate_standing(corners, &asked).unwrap()
}

/// The corners with one pair as another world shows it.
fn shown_by(mut corners: Corners, other: &World, seed: u64, pair: usize) -> Corners {
    corners.pairs[pair] = other.corners(seed).pairs[pair].clone();
    corners
}

/// Turns of the right camera before two pairs, deg; those of the second list contradict each other as much as the
/// others.
const ALIKE_DEG: [[f64; 3]; 2] = [[0.7, 1.0, -0.6]; 2];
const UNLIKE_DEG: [[f64; 3]; 2] = [[0.7, 1.0, -0.6], [-0.6, -0.9, 0.7]];

/// The pairs of which those of this number and the next are seen with the right camera turned so.
fn turned(corners: &Corners, world: &World, at: usize, turns_deg: [[f64; 3]; 2]) -> Corners {
    let of = |corners: Corners, (i, turn): (usize, [f64; 3])| {
        let after = world.with_camera_moved(Vector3::from(turn).map(f64::to_radians), Vector3::zeros());
        shown_by(corners, &after, 4, at + i)
    };
    turns_deg.into_iter().enumerate().fold(corners.clone(), of)
}

#[test]
fn two_pairs_are_of_another_rig_where_they_fit_one_of_their_own() {
    for (case, hand_deg) in [0.0, 0.03].into_iter().enumerate() {
        let world = World::new(12, 3 + case as u64);
        let corners = world.corners_by_hand(4, hand_deg);
        for at in [0, 10] {
            for (turns, expected) in [(ALIKE_DEG, true), (UNLIKE_DEG, false)] {
                let corners = turned(&corners, &world, at, turns);
                let found = calibrate(&corners, &BROWN4).unwrap();
                assert_eq!(found.discarded.pairs.len(), 2, "{hand_deg} deg: {:?}", found.skipped);
                let pairs = [&corners.pairs[at], &corners.pairs[at + 1]];
                let is_one = other_rig::is_one(&found, found.rig(), &pairs);
                assert_eq!(is_one, expected, "{hand_deg} deg, {turns:?} from {at} on");
            }
        }
    }
}

#[test]
fn two_first_pairs_that_contradict_each_other_are_no_rig_that_stood_before() {
    for (case, hand_deg) in [0.0, 0.005].into_iter().enumerate() {
        let world = World::new(12, 3 + case as u64);
        let corners = turned(&world.corners_by_hand(4, hand_deg), &world, 0, UNLIKE_DEG);
        let (found, told) = standing(&corners, BROWN4);
        let pairs: Vec<&str> = found.discarded.pairs.iter().map(|pair| pair.pair.as_str()).collect();
        assert_eq!(pairs, ["00", "01"], "{:?}", found.skipped);
        assert!(found.discarded.pairs.iter().all(|pair| pair.cause.may_be_the_rig()), "{:?}", found.skipped);
        assert!(told.iter().all(|finding| finding.kind == Kind::Pair), "{told:?}");
        assert_eq!((found.standing.since, found.standing.pairs_before), (None, 0));
        // Those of one rig are.
        let (found, told) = standing(&turned(&world.corners_by_hand(4, hand_deg), &world, 0, ALIKE_DEG), BROWN4);
        assert_eq!(found.standing.since.as_deref(), Some("02"), "{:?}", found.skipped);
        assert!(found.standing.pairs_before == 2 && told[0].kind == Kind::Step, "{told:?}");
    }
}

/// The right camera with three times the pixels: whatever it leaves is three times as many px.
fn with_large_right_camera(mut corners: Corners) -> Corners {
    const TIMES: f64 = 3.0;
    for corner in corners.pairs.iter_mut().flat_map(|pair| &mut pair.right) {
        corner.px.iter_mut().for_each(|px| *px = TIMES * (*px + 0.5) - 0.5);
        corner.covariance_px2 = corner.covariance_px2.map(|covariance| covariance * (TIMES * TIMES));
    }
    corners.right_size = (3 * corners.right_size.0, 3 * corners.right_size.1);
    corners
}

fn of_two_moments(corners: &Corners) -> Vec<Finding> {
    let (_, told) = standing(corners, Options::default());
    told.into_iter().filter(|finding| finding.cause.contains("not-simultaneous")).collect()
}

/// From a motion on that leaves several times what the corners do.
#[test]
fn pictures_of_two_moments_are_named_with_the_size_of_it_and_clean_ones_are_not() {
    for (seed, hand_deg, is_alike) in
        [(3, 0.0, true), (4, 0.0, false), (3, 0.02, false), (4, 0.02, true), (3, 0.05, true)]
    {
        let alike = World::new(20, seed).corners_by_hand(seed, hand_deg);
        let told = of_two_moments(&if is_alike { alike } else { with_large_right_camera(alike) });
        assert_eq!(told.len(), usize::from(hand_deg > 0.0), "{seed}, {hand_deg} deg: {told:?}");
        for finding in told {
            assert!(finding.unit == "mm" && finding.size.is_some_and(f64::is_finite), "{finding:?}");
            assert!(finding.action.contains(" deg;"), "{finding:?}");
        }
    }
}

/// The same rig in which each pair misses as much, all by a lens that lacks a term, or by focal lengths that hunt.
#[test]
fn a_lens_or_a_focus_that_explains_the_misfit_is_no_matter_of_two_moments() {
    let world = World::new(20, 5);
    let bent = world.clone().with_lens(Lens::Brown5, |distortion| distortion[4] = 1.0);
    let (_, told) = standing(&bent.corners(5), BROWN4);
    assert!(told.iter().all(|finding| finding.cause != "not-simultaneous"), "{told:?}");
    let mut hunting = world.corners(5);
    for i in 0..20 {
        let mut focused = world.clone();
        // Numbers that go up and down without an order.
        let share = 1.0 + 1e-3 * (12.9 * i as f64).sin();
        focused.rig.right.fx *= share;
        focused.rig.right.fy *= share;
        hunting = shown_by(hunting, &focused, 5, i);
    }
    assert_eq!(of_two_moments(&hunting), []);
}
