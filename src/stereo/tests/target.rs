//! The target in a run of poses.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::*;
use crate::imaging::{Board, Side};
use crate::stereo::board_pose::pair_excess::{farthest_pair, pair_excess};
use crate::stereo::board_pose::rig_change::cause::{Cause, Explanation};
use crate::stereo::board_pose::rig_change::judgement::Judgement;
use crate::stereo::board_pose::series;
use crate::stereo::board_pose::{Knowledge, Seen};
use crate::stereo::{Lens, Rig};

/// A rig and a target of which nothing else is known.
fn known(rig: &Rig, board: Board) -> Knowledge {
    Knowledge {
        rig: rig.clone(),
        noise: None,
        pair_excess: None,
        farthest_pair: None,
        volume: None,
        board,
        crossing_mm: 0.01,
        tolerance_mm: 0.05,
    }
}

/// The same with what a calibration says.
fn known_by(found: &Calibration, board: Board) -> Knowledge {
    Knowledge {
        noise: Some(found.own_noise),
        pair_excess: Some(pair_excess(found)),
        farthest_pair: farthest_pair(found),
        ..known(found.rig(), board)
    }
}

/// All poses of a world as a robot's run.
fn run_of(corners: Corners) -> Vec<Seen> {
    let at = |pose: &str| crate::measurements::RobotPose {
        pose: pose.to_owned(),
        group: "1".to_owned(),
        role: crate::measurements::Role::Sample,
        joints_deg: vec![0.0],
        slides: Vec::new(),
    };
    corners.pairs.into_iter().map(|pair| Seen { at: at(&pair.pair), corners: Ok(pair) }).collect()
}

#[test]
fn the_targets_scatter_is_the_predicted_one() {
    let mut world = World::new(60, 23);
    world.board = Board::checker("7x6".parse().unwrap(), 10.0);
    let mut sums = Vector6::<f64>::zeros();
    let measured = series::measure(&known(&world.rig, world.board), run_of(world.corners(24)));
    for (pose, truth) in measured.poses.iter().zip(&world.poses) {
        let pose = pose.target.as_ref().unwrap();
        let turn = (pose.cam_from_board.rotation * truth.rotation.inverse()).scaled_axis();
        let shift = pose.cam_from_board.translation.vector - truth.translation.vector;
        for i in 0..3 {
            sums[i] += turn[i] * turn[i] / pose.covariance[(i, i)];
            sums[3 + i] += shift[i] * shift[i] / pose.covariance[(3 + i, 3 + i)];
        }
    }
    for sum in sums.iter() {
        // 60 poses: chi-square over its freedom is 1 +- 0.18; the target's shape is found as well and shared by all.
        // Where nothing is known of the corners' usual scatter the poses' own is counted, along the line of sight
        // generously.
        assert!((0.35..1.7).contains(&(sum / 60.0)), "{sums}");
    }
    assert_eq!(measured.judgement, Judgement::Agrees);
}

#[test]
fn a_target_of_another_size_and_a_rig_that_turned_are_named() {
    let mut world = World::new(30, 29);
    world.board = Board::checker("7x6".parse().unwrap(), 10.0);
    let corners = world.corners(30);
    let judged = |rig: &Rig, square_mm: f64| {
        let board = Board { square_mm, ..world.board };
        let judgement = series::measure(&known(rig, board), run_of(corners.clone())).judgement;
        judgement.describe(rig, &board).unwrap_or_default()
    };
    assert_eq!(judged(&world.rig, 10.0), "");
    let pitch = judged(&world.rig, 12.0);
    assert!(pitch.contains("squares are 10.0") || pitch.contains("squares are 9.99"), "{pitch}");
    // Or it is the rig that is too large, by a fifth, and so are the points, some 560 mm away.
    let (_, scaled) = pitch.split_once("with it, or by ").unwrap();
    let off_mm: f64 = scaled.split(' ').next().unwrap().parse().unwrap();
    assert!((90.0..140.0).contains(&off_mm) && scaled.contains("if the target is as was said"), "{pitch}");
    let turned = world.with_camera_moved(Vector3::new(0.0, 0.1_f64.to_radians(), 0.0), Vector3::zeros()).rig;
    let yaw = judged(&turned, 10.0);
    assert!((yaw.contains("-0.10") || yaw.contains("-0.09")) && yaw.contains("yaw"), "{yaw}");
    let exchanged = Rig {
        left: turned.right,
        right: turned.left,
        right_from_left: world.rig.right_from_left.inverse(),
        covariance: None,
    };
    assert!(judged(&exchanged, 10.0).contains("exchanged"));
}

#[test]
fn a_rig_that_is_scaled_is_not_taken_for_a_larger_target() {
    // The target's print is a little higher than wide, which a free size of its squares takes up better than a rig
    // does.
    let mut world = World { sigma_px: 0.004, ..World::new(14, 37) };
    world.board = Board { stretch: 1.0003, ..Board::checker("7x6".parse().unwrap(), 10.0) };
    let corners = world.corners(38);
    let said = Board { stretch: 1.0, ..world.board };
    for share in [0.0, 0.003, 0.01] {
        let mut rig = world.rig.clone();
        rig.right_from_left.translation.vector *= 1.0 + share;
        let Knowledge { tolerance_mm, .. } = known(&rig, said);
        let judgement = series::measure(&known(&rig, said), run_of(corners.clone())).judgement;
        let is_told = judgement.ends_the_run() || judgement.leaves_open(tolerance_mm);
        assert_eq!(is_told, share > 0.0, "{share}: {judgement:?}");
    }
}

/// Cameras side by side, boards from near to far: a right camera that turned makes all boards seem larger, the far ones
/// more so.
#[test]
fn a_camera_that_turned_is_not_told_as_a_target_of_another_size() {
    let mut world = World::facing(12, |i| Vector3::new(0.3 * (2.0 * i).sin(), 0.3 * (1.3 * i).cos(), 0.1 * i.sin()));
    for (i, pose) in world.poses.iter_mut().enumerate() {
        pose.translation.vector.z = 480.0 + 20.0 * i as f64;
    }
    let sizes = |world: &World, board: Board| {
        let measured =
            series::measure(&known(&World::facing(1, |_| Vector3::zeros()).rig, board), run_of(world.corners(3)));
        let (Judgement::Allowed(changed) | Judgement::Contradicts(changed)) = measured.judgement else { return false };
        changed.explanations.iter().any(|e| e.cause == Cause::Pitch)
    };
    let turned = world.with_camera_moved(Vector3::y() * 0.5_f64.to_radians(), Vector3::zeros());
    assert!(!sizes(&turned, world.board));
    let mut larger = world.board;
    larger.square_mm *= 1.13;
    assert!(sizes(&world, larger));
}

/// Boards held by hand before cameras that nobody triggers: what the pairs of the calibration did, poses may do; one
/// that does much more is named.
#[test]
fn the_pairs_of_a_calibration_are_measured_by_it() {
    for turn_deg in [0.01, 0.05] {
        let world = World::new(12, 41);
        let mut corners = world.corners_by_hand(41, turn_deg);
        let found = calibrate(&corners, &BROWN4).unwrap();
        let known = Knowledge { tolerance_mm: 5.0, ..known_by(&found, world.board) };
        // No pose keeps to a part of its corners that happens to agree.
        for pose in series::measure(&known, run_of(corners.clone())).poses {
            let (target, seen) = (pose.target.unwrap(), corners.pairs.iter().find(|pair| pair.pair == pose.at.pose));
            let seen = seen.map_or(0, |pair| pair.left.len() + pair.right.len());
            assert!(10 * target.corners > 9 * seen && target.fit_rms_mm.is_some(), "{turn_deg}: {}", pose.at.pose);
        }
        let refused = |corners: &Corners| -> Vec<String> {
            let poses = series::measure(&known, run_of(corners.clone())).poses.into_iter();
            poses.filter(|pose| pose.target.is_err()).map(|pose| pose.at.pose).collect()
        };
        assert_eq!(refused(&corners), Vec::<String>::new(), "{turn_deg}");
        corners.pairs[7] = world.corners_by_hand(43, 30.0 * turn_deg).pairs[7].clone();
        assert_eq!(refused(&corners), [corners.pairs[7].pair.clone()], "{turn_deg}");
    }
}

/// A lens with a free tilt and no distortion leaves open where its axis points: what turns all points about the camera
/// together is no error.
#[test]
fn points_are_not_off_by_what_turns_them_all_together() {
    let mut world = World::new(12, 37).with_lens(Lens::Tilted14, |d| d.fill(0.0));
    world.sigma_px = 0.02;
    let tilted = Options { lens: Some(Lens::Tilted14), ..BROWN4 };
    let found = calibrate(&world.corners(38), &tilted).unwrap();
    world.board = Board::checker("7x6".parse().unwrap(), 10.0);
    let known = Knowledge { noise: Some(found.own_noise), ..known(found.rig(), world.board) };
    for turn_deg in [0.02_f64, 0.2] {
        let turned = world.with_camera_moved(Vector3::new(0.0, turn_deg.to_radians(), 0.0), Vector3::zeros());
        let measured = series::measure(&known, run_of(turned.corners(39)));
        let (Judgement::Allowed(changed) | Judgement::Contradicts(changed)) = measured.judgement else {
            panic!("{turn_deg}: {:?}", measured.judgement)
        };
        // A depth of 560 mm is off by 560^2 / 192 times the turn.
        let depth_mm = 560.0 * 560.0 / 192.0 * turn_deg.to_radians();
        assert_eq!(changed.explanations[0].cause, Cause::Turn(1), "{turn_deg}: {changed:?}");
        assert!((0.5 * depth_mm..1.5 * depth_mm).contains(&changed.moves_mm), "{turn_deg}: {changed:?}, {depth_mm}");
    }
}

/// What one pair of the calibration did, a pose may do: it is measured, and known as well as it agrees with the others.
#[test]
fn a_pose_that_strays_as_far_as_a_pair_that_was_used_is_measured_and_says_how_well() {
    let world = World::new(12, 47);
    let clean = world.corners_by_hand(47, 0.01);
    let found = calibrate(&clean, &BROWN4).unwrap();
    let mut kept = 0;
    let of_pairs = Knowledge { farthest_pair: None, tolerance_mm: 5.0, ..known_by(&found, world.board) };
    let usual = series::measure(&of_pairs, run_of(clean.clone())).poses.swap_remove(3).target.unwrap();
    for times in [9.0, 12.0] {
        let mut corners = clean.clone();
        corners.pairs[3] = world.corners_by_hand(48, 0.01 * times).pairs[3].clone();
        let farthest = farthest_pair(&calibrate(&corners, &BROWN4).unwrap());
        assert!(farthest.unwrap() > farthest_pair(&found).unwrap(), "{times}");
        let third = |known: &Knowledge| series::measure(known, run_of(corners.clone())).poses.swap_remove(3).target;
        // Nobody said that a pair strayed so far; then somebody does.
        let refused = third(&of_pairs).is_err();
        let Ok(target) = third(&Knowledge { farthest_pair: Some(1e4), ..of_pairs.clone() }) else { continue };
        let variance = |covariance: &Matrix6<f64>| covariance.fixed_view::<3, 3>(3, 3).trace();
        let grown = variance(&target.own_covariance) / variance(&usual.own_covariance);
        let off = target.cam_from_board.translation.vector - world.poses[3].translation.vector;
        let own = target.covariance.fixed_view::<3, 3>(3, 3).into_owned();
        let chi_square = off.dot(&(own.try_inverse().unwrap() * off));
        if refused {
            kept += 1;
            assert!(grown > 4.0 && chi_square < 25.0, "{times}: {grown}, {chi_square}");
        }
    }
    assert!(kept > 0);
}

/// A lens that warms up during the run: what its poses have in common looks like another change as well, and is named
/// as what it is.
#[test]
fn a_focus_that_creeps_is_not_named_as_something_that_all_poses_have() {
    for (seed, sizes_ppm) in [(50, &[20.0, 500.0][..]), (51, &[100.0])] {
        let mut world = World { sigma_px: 0.002, ..World::new(14, seed) };
        let found = calibrate(&world.corners(seed + 10), &BROWN4).unwrap();
        world.board = Board::checker("7x6".parse().unwrap(), 10.0);
        for ppm in sizes_ppm {
            let mut corners = world.corners(seed + 20);
            for i in 0..14 {
                let by = 1.0 + 1e-6 * ppm * i as f64 / 13.0;
                let mut warmer = world.clone();
                (warmer.rig.right.fx, warmer.rig.right.fy) = (world.rig.right.fx * by, world.rig.right.fy * by);
                corners.pairs[i] = warmer.corners(seed + 20).pairs[i].clone();
            }
            match series::measure(&known_by(&found, world.board), run_of(corners)).judgement {
                Judgement::Allowed(changed) | Judgement::Contradicts(changed) => {
                    let is = |e: &Explanation| e.cause == Cause::Focal(Side::Right);
                    assert!(changed.explanations.iter().any(is), "{ppm}, {seed}: {changed:?}");
                }
                Judgement::Agrees | Judgement::Moved { creeps: true, .. } => {}
                other => panic!("{ppm}, {seed}: {other:?}"),
            }
        }
    }
}
