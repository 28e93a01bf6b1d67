//! Boards whose corners have numbers of their own: each picture shows another part, some pairs are seen by one camera
//! alone.

use super::*;
use crate::imaging::{Board, Corner, PairCorners, Side, Skipped};
use crate::stereo::Error;
use crate::stereo::judge::verdict::Verdict;

/// A rig whose pairs show a board with markers, each picture the corners that `shows` says: pair, right side, column,
/// row.
fn seen(world: &World, seed: u64, shows: impl Fn(usize, bool, usize, usize) -> bool) -> Corners {
    let mut corners = world.corners(seed);
    for (i, pair) in corners.pairs.iter_mut().enumerate() {
        let keep = |right: bool| {
            let shows = &shows;
            move |c: &Corner| shows(i, right, c.col, c.row)
        };
        pair.left.retain(keep(false));
        pair.right.retain(keep(true));
    }
    corners
}

fn world(pairs: usize) -> World {
    let mut world = World::new(pairs, 7);
    world.board = "charuco:12x9:15:11:DICT_5X5_100".parse::<Board>().unwrap();
    world
}

/// Half of the corners a picture, another half in each, a third common.
fn half(i: usize, right: bool, col: usize, row: usize) -> bool {
    let from = |first: usize, width: usize, at: usize, count: usize| (at + count - first) % count < width;
    if i.is_multiple_of(2) {
        from(i % 5 + if right { 2 } else { 0 }, 6, col, 11)
    } else {
        from(i % 3 + usize::from(right), 4, row, 8)
    }
}

#[test]
fn parts_of_a_board_calibrate_as_well_as_they_say() {
    for seed in 0..4 {
        let world = world(14);
        let found = calibrate(&seen(&world, seed, half), &BROWN4).unwrap();
        assert_eq!(found.views.len(), 14);
        let covariance = &found.rig().covariance.as_ref().unwrap().matrix;
        let off = deviations(&found, &world);
        let squares: f64 = (0..off.len()).map(|i| off[i] * off[i] / covariance[(i, i)]).sum::<f64>() / off.len() as f64;
        // The mean of two dozen squares that hang together: chance takes it to three.
        assert!((0.05..3.0).contains(&squares), "{seed}: {squares}");
        let judged = judged(&seen(&world, seed, half), &BROWN4, 0.5);
        assert_eq!(judged.verdict, Verdict::Pass, "{seed}: {:?}", judged.deciding());
    }
}

#[test]
fn a_picture_of_a_pair_counts_alone() {
    let world = world(12);
    let alone = |i: usize, right: bool, _: usize, _: usize| i >= 9 || right == i.is_multiple_of(3) || i % 3 == 2;
    let some = calibrate(&seen(&world, 3, alone), &BROWN4).unwrap();
    assert_eq!(some.views.len(), 12);
    let without =
        calibrate(&seen(&world, 3, |i, right, col, row| (i >= 9 || i % 3 == 2) && alone(i, right, col, row)), &BROWN4);
    let sigma = |found: &Calibration| covariance_of(found, &["left.fx"])[(0, 0)].sqrt();
    assert!(sigma(&some) < sigma(&without.unwrap()), "more pictures tell more of a camera");
    let accuracy = held_out::hold_out(&some, None).unwrap();
    assert!(accuracy.pairs.iter().any(|pair| pair.max_abs_error_mm.is_none() && pair.gap_rms_mm.is_none()));
}

#[test]
fn cameras_that_have_no_corner_in_common_are_told() {
    let world = world(10);
    let apart = seen(&world, 1, |_, right, col, _| (col >= 6) == right);
    let found = calibrate(&apart, &BROWN4).unwrap();
    assert!(matches!(held_out::hold_out(&found, None), Err(Error::NothingInCommon { pairs: 10 })));
    let never = seen(&world, 1, |i, right, _, _| i.is_multiple_of(2) == right);
    assert!(matches!(calibrate(&never, &BROWN4), Err(Error::NothingInCommon { pairs: 10 })));
}

#[test]
fn a_camera_that_shows_the_board_in_no_pair_is_named_with_the_reason() {
    let world = world(11);
    for blind in Side::BOTH {
        let mut corners = seen(&world, 1, |_, right, _, _| (blind == Side::Right) != right);
        let why =
            |reason: &str, pair: &PairCorners| (blind, Skipped { pair: pair.pair.clone(), reason: reason.to_owned() });
        corners.blind = corners.pairs.iter().map(|pair| why("shows the board mirrored", pair)).collect();
        let Err(error) = calibrate(&corners, &BROWN4) else { panic!("{blind:?}") };
        let (said, side) = (error.to_string(), blind.name());
        assert!(said.starts_with(&format!("none of 11 {side} pictures show the board")), "{said}");
        assert!(said.contains("and 3 more: shows the board mirrored"), "{said}");
        // Corners that were not found but read come without a reason.
        corners.blind.clear();
        assert!(matches!(calibrate(&corners, &BROWN4), Err(Error::OneSideBlind { found: 0, total: 11, .. })));
    }
    // Each camera shows the board, in a third of the pairs and in the others: neither is the one to look at.
    let mut corners = seen(&world, 1, |i, right, _, _| i.is_multiple_of(3) == right);
    let reason = "no board found".to_owned();
    corners.blind.push((Side::Right, Skipped { pair: corners.pairs[1].pair.clone(), reason }));
    assert!(matches!(calibrate(&corners, &BROWN4), Err(Error::NothingInCommon { pairs: 11 })));
}

#[test]
fn six_corners_are_enough_and_five_are_not() {
    let world = world(10);
    let few =
        |count: usize| seen(&world, 2, move |i, _, col, row| i > 0 || (col < 3 && row < 2 && row * 3 + col < count));
    assert_eq!(calibrate(&few(6), &BROWN4).unwrap().views.len(), 10);
    let found = calibrate(&few(5), &BROWN4).unwrap();
    assert_eq!((found.views.len(), found.skipped.len()), (9, 1));
}
