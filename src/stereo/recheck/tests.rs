//! Rigs that stand and rigs that changed, with the changes planted at the size that the pairs are said to see.

use super::*;
use crate::geometry::transform;
use crate::stereo::Side;
use crate::stereo::board_pose::pair_excess::{farthest_pair, pair_excess};
use crate::stereo::calibrate::{Calibration, calibrate};
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::World;
use crate::stereo::volume::Extent;
use nalgebra::Vector3;

/// A calibration as its file has it.
fn calibrated(seed: u64) -> Before {
    let found = calibrate(&World::new(12, seed).corners(seed), &Options::default()).unwrap();
    before(&found, 1.0, 12)
}

fn before(found: &Calibration, pair_excess: f64, pairs: usize) -> Before {
    Before {
        rig: found.rig().clone(),
        noise: Some(found.own_noise),
        pair_excess,
        farthest_pair: farthest_pair(found),
        pairs: Some(pairs),
        volume: Some(Volume::of(found, Extent::Boards)),
    }
}

/// The same of pairs by hand, with what its file says of their scatter; the boards lean by so much at most.
fn by_hand(seed: u64, pairs: usize, leaning: f64, turn_deg: f64) -> Before {
    let mut world = World::new(pairs, seed);
    leaning_by(&mut world, leaning);
    let found = calibrate(&world.corners_by_hand(seed, turn_deg), &Options::default()).unwrap();
    before(&found, pair_excess(&found), found.pair_scatter.groups)
}

/// Boards that lean less than those of the world.
fn leaning_by(world: &mut World, share: f64) {
    for pose in &mut world.poses {
        let turn = pose.rotation.scaled_axis();
        pose.rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn * share);
    }
}

/// Other pairs of the same rig after a change.
fn after(seed: u64, change: impl Fn(&mut Rig)) -> Corners {
    let mut world = World::new(3, seed + 1000);
    change(&mut world.rig);
    world.corners(seed + 1000)
}

fn turned(rig: &mut Rig, deg: f64) {
    rig.right_from_left = transform(Vector3::y() * deg.to_radians(), Vector3::zeros()) * rig.right_from_left;
}

#[test]
fn a_rig_that_stands_is_said_to_stand() {
    assert!((0..6).all(|seed| recheck(&calibrated(seed), &after(seed, |_| {})).unwrap().change.is_none()));
}

/// One pair of a rig that moved just before it is lost among the others, whose corners a robust fit believes.
#[test]
fn a_pair_that_contradicts_the_others_is_named() {
    let before = calibrated(41);
    for turn_deg in [0.02, 0.2] {
        let mut corners = after(41, |_| {});
        assert!(recheck(&before, &corners).unwrap().strays.is_empty());
        corners.pairs[2] = after(41, |rig| turned(rig, turn_deg)).pairs.swap_remove(2);
        let found = recheck(&before, &corners).unwrap();
        let strays: Vec<&String> = found.strays.iter().map(|stray| &stray.pair).collect();
        assert_eq!(strays, [&corners.pairs[2].pair], "{turn_deg} deg: {}", found.statement());
        // By as much as a rig that is so turned measures lengths otherwise; one pair alone tells that to some
        // hundredths of a mm.
        let (effect_mm, mut now) = (found.strays[0].effect_mm, before.rig.clone());
        turned(&mut now, turn_deg);
        let volume = before.volume.as_ref().unwrap();
        let measured = VolumeLengths::of_volume(&before.rig, volume, found.length_mm).measured_by(&now);
        let true_mm = measured.into_iter().flatten().map(|mm| (mm - found.length_mm).abs()).fold(0.0, f64::max);
        let within_mm = 0.06 + 0.05 * true_mm;
        assert!((effect_mm - true_mm).abs() < within_mm, "{turn_deg} deg: {effect_mm} mm, the truth is {true_mm}");
        let (said, off_mm) = found.contradiction().unwrap();
        assert!(said.contains("contradicts the calibration") && off_mm == effect_mm, "{said}: {off_mm} mm");
    }
}

#[test]
fn pairs_by_hand_that_hardly_know_their_lenses_raise_no_alarm() {
    // Boards that hardly lean leave lens and place of the cameras in a bent valley.
    const WORLDS: u64 = 2;
    for (leaning, turn_deg) in [(0.3, 0.03), (1.0, 0.03)] {
        let (mut alarms, mut seen) = (Vec::new(), 0);
        for seed in 60..60 + WORLDS {
            let before = by_hand(seed, 8, leaning, turn_deg);
            let mut world = World::new(4, seed + 1000);
            leaning_by(&mut world, leaning);
            let stands = recheck(&before, &world.corners_by_hand(seed + 1000, turn_deg)).unwrap();
            if stands.change.is_some() {
                alarms.push(format!("{seed}: {}", stands.statement()));
            }
            let yaw = stands.causes.iter().find(|c| c.cause == Cause::Yaw).unwrap();
            turned(&mut world.rig, 2.0 * yaw.seen);
            seen +=
                u64::from(recheck(&before, &world.corners_by_hand(seed + 1000, turn_deg)).unwrap().change.is_some());
        }
        assert!(alarms.is_empty(), "{leaning} {turn_deg} deg: {alarms:?}");
        assert!(seen == WORLDS, "{leaning} {turn_deg} deg: {seen} of {WORLDS} turns of twice what is seen");
    }
}

#[test]
fn pairs_that_contradict_each_other_tell_no_absurd_change() {
    // Boards that hardly lean, and one pair in three whose pictures were taken farther apart in time than the others':
    // in one of these worlds the pairs' own rig has a focal length that is 4 % off.
    for seed in 87..90 {
        let before = by_hand(seed, 20, 1.0, 0.05);
        let apart_deg = [0.1, 0.2][seed as usize % 2];
        let mut world = World::new(3, seed + 1000);
        leaning_by(&mut world, 0.3);
        let mut corners = world.corners_by_hand(seed + 1000, 0.05);
        corners.pairs[0] = world.corners_by_hand(seed + 2000, apart_deg).pairs.swap_remove(0);
        let found = recheck(&before, &corners).unwrap();
        let yaw = found.causes.iter().find(|c| c.cause == Cause::Yaw).unwrap();
        assert!(yaw.amount.abs() < 3.0 * apart_deg, "{seed}, {apart_deg} deg apart: {}", found.statement());
    }
}

#[test]
fn a_yaw_is_seen_as_often_as_is_stated_and_never_under_another_name() {
    let (mut seen, mut half) = (0, 0);
    for seed in 0..6 {
        let before = calibrated(seed);
        let stands = recheck(&before, &after(seed, |_| {})).unwrap();
        let yaw = stands.causes.iter().find(|c| c.cause == Cause::Yaw).unwrap();
        for (share, count) in [(1.0, &mut seen), (0.25, &mut half)] {
            let found = recheck(&before, &after(seed, |rig| turned(rig, share * yaw.seen))).unwrap();
            *count += usize::from(found.change.is_some());
            let causes: Vec<Cause> = found.likeliest().iter().map(|seen| seen.cause).collect();
            assert!(causes.is_empty() || causes.contains(&Cause::Yaw), "{seed}: {}", found.statement());
        }
    }
    // Of six 5.7 are expected, and of those a quarter as large 0.1.
    assert!(seen >= 5 && half <= 1, "{seen} of 6 at the stated size, {half} at a quarter of it");
}

#[test]
fn a_focus_and_a_baseline_are_named_with_their_sizes() {
    let before = calibrated(40);
    let focused = recheck(
        &before,
        &after(40, |rig| {
            rig.left.fx *= 1.004;
            rig.left.fy *= 1.004;
        }),
    )
    .unwrap();
    assert!(focused.cause().contains("focus"), "{}", focused.statement());
    let left = focused.causes.iter().find(|c| c.words.starts_with("the left camera's focal")).unwrap();
    assert!((left.amount - 0.4).abs() < 4.0 * left.sigma, "{left:?}");
    let longer = recheck(&before, &after(40, |rig| rig.right_from_left.translation.vector *= 1.002)).unwrap();
    // One number moves both: the pairs do not tell a longer baseline from smaller squares.
    assert!(
        ["baseline|other-board", "other-board|baseline"].contains(&longer.cause().as_str()),
        "{}",
        longer.statement()
    );
    let off = 0.002 * before.rig.baseline_mm();
    let baseline = longer.causes.iter().find(|c| c.cause == Cause::Baseline).unwrap();
    assert!((baseline.amount - off).abs() < 4.0 * baseline.sigma, "{baseline:?} for {off}");
}

#[test]
fn a_knock_in_all_six_numbers_has_no_name_of_one() {
    let before = calibrated(41);
    let knocked = recheck(
        &before,
        &after(41, |rig| {
            rig.right_from_left =
                transform(Vector3::new(0.002, -0.003, 0.002), Vector3::new(0.3, -0.4, 0.5)) * rig.right_from_left;
        }),
    )
    .unwrap();
    assert!(knocked.effect_mm > 0.05, "{knocked:?}");
    assert_eq!(knocked.cause(), "camera-moved", "{}", knocked.statement());
}

#[test]
fn pictures_that_are_cut_otherwise_are_no_camera_that_turned() {
    let before = calibrated(43);
    let cut = |side: Side| {
        let mut corners = after(43, |_| {});
        for pair in &mut corners.pairs {
            let list = if side == Side::Left { &mut pair.left } else { &mut pair.right };
            list.iter_mut().for_each(|corner| (corner.px.x, corner.px.y) = (corner.px.x + 60.0, corner.px.y - 35.0));
        }
        recheck(&before, &corners).unwrap()
    };
    for side in Side::BOTH {
        let found = cut(side);
        let Some(Explained::Cut { side: of, by_px: [x, y] }) = found.change else { panic!("{}", found.statement()) };
        assert!(of == side && (x - 60.0).abs() < 6.0 && (y + 35.0).abs() < 6.0, "{}", found.statement());
        assert!(found.effect_mm > 0.05 && found.cause() == "unknown", "{}", found.statement());
    }
    let found = recheck(&before, &after(43, |rig| turned(rig, 1.0))).unwrap();
    assert!(found.cause().contains("yaw"), "{}", found.statement());
}

/// A pair whose two files were given each other's name.
#[test]
fn a_pair_with_its_pictures_exchanged_is_left_out_and_named() {
    let before = calibrated(43);
    let mut corners = after(43, |_| {});
    assert!(recheck(&before, &corners).unwrap().skipped.is_empty());
    let exchange = |corners: &mut Corners, at: usize| {
        let pair = &mut corners.pairs[at];
        std::mem::swap(&mut pair.left, &mut pair.right);
    };
    exchange(&mut corners, 1);
    let found = recheck(&before, &corners).unwrap();
    let [skipped] = &found.skipped[..] else { panic!("{:?}", found.skipped) };
    assert!(skipped.pair == corners.pairs[1].pair && skipped.reason.contains("exchanged"), "{skipped:?}");
    assert!(found.change.is_none() && found.pairs.len() == 2);
    [0, 2].into_iter().for_each(|at| exchange(&mut corners, at));
    let said = recheck(&before, &corners);
    assert!(matches!(said, Err(Error::OtherWayRound { how, .. }) if how == Flip::Exchanged.describe()), "{said:?}");
}

/// A driver that turns or mirrors what both cameras see, for one pair or for all.
#[test]
fn pictures_that_are_turned_or_mirrored_are_named() {
    let before = calibrated(43);
    let clean = after(43, |_| {});
    for flip in [Flip::Mirrored, Flip::UpsideDown, Flip::HalfTurn] {
        let turned = |at: &[usize]| {
            let mut corners = clean.clone();
            at.iter().for_each(|&at| {
                corners.pairs[at] = flip.of_pair(&clean.board, &before.rig, &clean.pairs[at]);
            });
            recheck(&before, &corners)
        };
        let said = turned(&[0, 1, 2]);
        let is_named = matches!(said, Err(Error::OtherWayRound { how, .. }) if how == flip.describe());
        assert!(is_named, "{said:?}");
        let found = turned(&[1]).unwrap();
        let [skipped] = &found.skipped[..] else { panic!("{:?}", found.skipped) };
        assert!(skipped.reason.contains(flip.describe()) && found.change.is_none(), "{skipped:?}");
    }
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let mut before = calibrated(42);
    let one = after(42, |_| {});
    let one = Corners { pairs: one.pairs[..1].to_vec(), ..one };
    assert!(matches!(recheck(&before, &one), Err(Error::TooFewPairs { found: 1, needed: 2, .. })));
    before.rig.covariance = None;
    assert!(matches!(recheck(&before, &after(42, |_| {})), Err(Error::NoCovariance)));
}
