//! Lenses from another calibration: three pairs are enough for the rig, and lenses that are not those of the pictures
//! are found and named.

use super::*;
use crate::stereo::board_pose::pair_excess::pair_excess;
use crate::stereo::model::KnownLenses;
use crate::stereo::pairs::Cause;
use crate::stereo::select::known_lenses::LensCheck;
use crate::stereo::{Camera, Error, Side};

/// Another day's pictures of the same rig.
fn known(seed: u64) -> KnownLenses {
    known_sides(seed, &Side::BOTH)
}

fn known_sides(seed: u64, sides: &[Side]) -> KnownLenses {
    let calibration = calibrate(&World::new(12, seed).corners(seed), &BROWN4).unwrap();
    let mut known = KnownLenses::of_rig(calibration.rig(), sides);
    known.pairs = Some(calibration.pair_scatter.groups);
    known
}

fn knowing(known: KnownLenses) -> Options {
    Options { known: Some(known), ..Options::default() }
}

fn check(world: &World, known: KnownLenses) -> LensCheck {
    calibrate(&world.corners(71), &knowing(known)).unwrap().lens_check.unwrap()
}

#[test]
fn three_pairs_find_the_rig_where_the_lenses_are_known() {
    for seed in 80..84 {
        let world = World::new(3, seed);
        let found = calibrate(&world.corners(seed), &knowing(known(seed + 100))).unwrap();
        let check = found.lens_check.as_ref().unwrap();
        assert!(!check.contradicts() && check.causes.is_empty(), "{seed}: {check:?}");
        let off = (found.rig().right_from_left.translation.x - world.rig.right_from_left.translation.x).abs();
        let sigma = covariance_of(&found, &["right_from_left.tx_mm"])[(0, 0)].sqrt();
        assert!(off < 4.0 * sigma && sigma < 1.0, "{seed}: {off} +- {sigma} mm");
    }
}

#[test]
fn a_focus_that_changed_is_named_with_its_size() {
    for (seed, share) in [(85, 1.004), (86, 0.99), (87, 1.05)] {
        let mut world = World::new(5, seed);
        world.rig.right.fx *= share;
        world.rig.right.fy *= share;
        let check = check(&world, known(seed + 100));
        assert_eq!(check.causes, [Cause::Focus], "{share}: {}", check.statement);
        let percent = check.focus_change.unwrap();
        assert!((percent - 100.0 * (share - 1.0)).abs() < 0.25, "{share}: {percent} %");
        assert!(check.statement.contains("the right lens was focused otherwise"), "{}", check.statement);
    }
}

#[test]
fn exchanged_lenses_and_another_camera_are_told_from_a_focus() {
    let mut world = World::new(5, 88);
    assert_eq!(check(&world, known(188).exchanged()).causes, [Cause::Exchanged]);
    world.rig.left.cx += 12.0;
    world.rig.left.distortion[0] += 0.04;
    let other = check(&world, known(188));
    assert_eq!(other.causes, [Cause::OtherCamera], "{}", other.statement);
    assert!(other.statement.contains("the left camera"), "{}", other.statement);
}

#[test]
fn a_lens_without_covariance_is_known_to_a_tolerance_and_one_side_may_be_open() {
    let world = World::new(8, 89);
    let camera = world.rig.left;
    let one_side = KnownLenses::of_cameras([Some(camera), None]);
    let found = calibrate(&world.corners(72), &knowing(one_side)).unwrap();
    assert!(!found.lens_check.as_ref().unwrap().contradicts());
    assert_eq!(found.layout.left, Some(camera.lens));
    assert!((found.rig().left.fx / camera.fx - 1.0).abs() < 1e-3);
    // The size of the pictures belongs to the lens.
    let mut corners = world.corners(72);
    corners.left_size.0 += 1;
    let known = KnownLenses::of_cameras([Some(camera), None]);
    assert!(matches!(known.of_pictures(&corners), Err(Error::PictureSize { side: Side::Left, .. })));
    // Where its file says none, it is that of the pictures.
    let of_none = KnownLenses::of_cameras([Some(Camera { width: 0, height: 0, ..camera }), None]);
    let known = of_none.of_pictures(&world.corners(72)).unwrap();
    let (as_said, taken) = (KnownLenses::of_cameras([Some(camera), None]), known.camera(Side::Left));
    assert!(taken == Some(&camera) && known.covariance() == as_said.covariance());
}

#[test]
fn of_two_calibrations_each_gives_its_side() {
    let (first, second) = (known(91), known(92));
    let both = first.clone().and(known_sides(92, &[Side::Right]));
    assert_eq!(both.camera(Side::Left), first.camera(Side::Left));
    assert_eq!(both.camera(Side::Right), second.camera(Side::Right));
    let left = first.numbers().iter().filter(|(side, _)| *side == Side::Left).count();
    assert_eq!(both.covariance()[(0, 1)], first.covariance()[(0, 1)]);
    assert_eq!(both.covariance()[(left, left + 1)], second.covariance()[(left, left + 1)]);
    assert_eq!(both.covariance()[(0, left)], 0.0);
}

/// What an earlier calibration whose right camera turned by so much from pair to pair knows, with how pairs move.
fn known_by_hand(seed: u64, turn_deg: f64) -> KnownLenses {
    let earlier = calibrate(&World::new(12, seed).corners_by_hand(seed, turn_deg), &BROWN4).unwrap();
    let mut known = KnownLenses::of_rig(earlier.rig(), &Side::BOTH);
    known.pair_excess = pair_excess(&earlier);
    (known.pairs, known.noise) = (Some(earlier.pair_scatter.groups), Some(earlier.own_noise));
    known.pair_motion = earlier.pair_motion().map(|[variances, _]| variances);
    known
}

fn without_motion(known: &KnownLenses) -> KnownLenses {
    let mut known = known.clone();
    known.pair_motion = None;
    known
}

/// Deviations of three pairs' focal lengths from the known ones in their standard deviations, mean square; and of the
/// baseline from the truth in its own. With the scatter of the earlier pairs told, and without.
fn by_hand(turn_deg: f64) -> [[f64; 2]; 2] {
    const WORLDS: u64 = 4;
    let mut squares = [[0.0; 2]; 2];
    for seed in 300..300 + WORLDS {
        let told = known_by_hand(seed, turn_deg);
        let mut alone = without_motion(&told);
        (alone.pair_excess, alone.pairs, alone.noise) = (1.0, None, None);
        let focal_px = told.camera(Side::Left).unwrap().fx;
        let world = World::new(3, seed + 500);
        let corners = world.corners_by_hand(seed + 500, turn_deg);
        for (known, squares) in [told, alone].into_iter().zip(&mut squares) {
            let sigma = known.covariance()[(0, 0)].sqrt();
            let found = calibrate(&corners, &knowing(known)).unwrap();
            squares[0] += ((found.rig().left.fx - focal_px) / sigma).powi(2) / WORLDS as f64;
            let off = found.rig().right_from_left.translation.x - world.rig.right_from_left.translation.x;
            squares[1] += off * off / covariance_of(&found, &["right_from_left.tx_mm"])[(0, 0)] / WORLDS as f64;
        }
    }
    squares
}

#[test]
fn three_pairs_that_scatter_do_not_pull_the_lenses_from_what_is_known_of_them() {
    let [[told, of_baseline], [alone, _]] = by_hand(0.03);
    // What is known is known to one standard deviation; pairs that weigh by their corners' noise alone pull by many.
    assert!(told < 1.0 && told < 0.5 * alone, "{told} where the scatter is told, {alone} where not");
    assert!(of_baseline < 3.0, "{of_baseline}");
    let [[clean, of_baseline], _] = by_hand(0.0);
    assert!(clean < 1.0 && of_baseline < 3.0, "{clean} {of_baseline}");
}

/// How far the six numbers of `right_from_left` are off, squared, in units of a covariance of the shared numbers.
fn off(found: &Calibration, world: &World, stated: &DMatrix<f64>) -> f64 {
    let at = found.layout.transform_start();
    let mut shared = found.values.shared.clone();
    shared.rig.right_from_left = world.rig.right_from_left;
    let step = found.layout.between(&found.values.shared, &shared).rows(at, 6).into_owned();
    let stated = stated.view((at, at), (6, 6)).into_owned();
    step.dot(&stated.cholesky().unwrap().solve(&step)) / 6.0
}

#[test]
fn three_pairs_are_weighed_by_how_pairs_are_known_to_move() {
    const WORLDS: u64 = 8;
    // Mean squares of how far the rig is off: not weighed and weighed in one unit, and weighed in its own.
    let mean = |turn_deg: f64| {
        let mut sums = [0.0; 3];
        for seed in 400..400 + WORLDS {
            let known = known_by_hand(seed, turn_deg);
            let world = World::new(3, seed + 500);
            let corners = world.corners_by_hand(seed + 500, turn_deg);
            let weighed = calibrate(&corners, &knowing(known.clone())).unwrap();
            let alone = calibrate(&corners, &knowing(without_motion(&known))).unwrap();
            let each = [
                off(&alone, &world, &alone.covariance),
                off(&weighed, &world, &alone.covariance),
                off(&weighed, &world, &weighed.covariance),
            ];
            sums.iter_mut().zip(each).for_each(|(sum, off)| *sum += off / WORLDS as f64);
        }
        sums
    };
    let [alone, weighed, own] = mean(0.03);
    assert!(weighed < 0.75 * alone && own < 1.5, "{weighed} and not weighed {alone}; {own} of what is stated");
    let [alone, weighed, own] = mean(0.0);
    assert!((weighed / alone - 1.0).abs() < 0.1 && own < 1.5, "{weighed} {alone} {own}");
}

#[test]
fn pairs_that_move_otherwise_than_is_known_are_not_weighed_by_it() {
    let (known, world) = (known_by_hand(420, 0.002), World::new(3, 920));
    let of = |turn_deg: f64, known: &KnownLenses| {
        calibrate(&world.corners_by_hand(920, turn_deg), &knowing(known.clone())).unwrap()
    };
    let unknown = without_motion(&known);
    assert_eq!(of(0.1, &known).values, of(0.1, &unknown).values);
    assert_ne!(of(0.002, &known).values, of(0.002, &unknown).values);
    // Nor by fewer pairs than there are.
    let mut fewer = known.clone();
    fewer.pairs = Some(3);
    assert_eq!(of(0.002, &fewer).values, of(0.002, &unknown).values);
}
