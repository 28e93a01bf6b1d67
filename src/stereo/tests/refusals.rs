//! What must be left out or refused, by name.

use nalgebra::Vector3;

use super::*;
use crate::geometry::{Transform, rotation_vector, transform};
use crate::imaging::{Corner, Side, Skipped};
use crate::stereo::Error;
use crate::stereo::error::OneSide;
use crate::stereo::findings::standing::{Asked, calibrate_standing};
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::volume::Extent;

/// The right pictures moved to the front by so many pairs, the first ones to the back.
fn shifted(mut corners: Corners, by: usize) -> Corners {
    let mut rights: Vec<_> = corners.pairs.iter().map(|p| p.right.clone()).collect();
    rights.rotate_left(by);
    corners.pairs.iter_mut().zip(rights).for_each(|(pair, right)| pair.right = right);
    corners
}

#[test]
fn a_pair_that_was_not_taken_at_once_is_named_and_left_out() {
    let world = World::new(9, 11);
    let mut corners = world.corners(12);
    let mut moved = world.clone();
    moved.poses[4] = transform(Vector3::new(0.05, 0.1, 0.0), Vector3::new(4.0, -6.0, 10.0)) * moved.poses[4];
    corners.pairs[4].right = moved.corners(12).pairs[4].right.clone();
    let found = calibrate(&corners, &Options::default()).unwrap();
    assert_eq!(found.skipped.len(), 1);
    assert!(
        found.skipped[0].pair == "04" && found.skipped[0].reason.contains("not taken at one moment"),
        "{:?}",
        found.skipped
    );
    assert!((found.rig().baseline_mm() - world.rig.baseline_mm()).abs() < 0.1);
}

#[test]
fn a_gross_corner_is_an_outlier_and_changes_nothing() {
    let world = World::new(9, 11);
    let mut corners = world.corners(12);
    let clean = calibrate(&corners, &BROWN4).unwrap();
    corners.pairs[2].left[17].px.x += 40.0;
    let found = calibrate(&corners, &BROWN4).unwrap();
    let view = found.views.iter().find(|view| view.pair == "02").unwrap();
    let moved = view.observations.iter().find(|o| o.px == corners.pairs[2].left[17].px).unwrap();
    // It stays, and weighs a thousandth of what the others do.
    let sigmas: Vec<f64> = view.observations.iter().map(|o| o.sigma_px()).collect();
    let usual = crate::statistics::median(sigmas).unwrap();
    assert!(moved.active && moved.sigma_px() > 30.0 * usual, "{} {usual}", moved.sigma_px());
    assert!((found.rig().baseline_mm() - clean.rig().baseline_mm()).abs() < 0.02);
}

#[test]
fn pairs_of_nothing_in_common_are_refused_by_name() {
    // Every right picture belongs to another left one.
    match calibrate(&shifted(World::new(8, 13).corners(14), 3), &Options::default()) {
        Err(Error::Contradiction { agreeing, total, bad, .. }) => {
            assert!(agreeing <= 4 && total == 8 && bad.len() >= 4, "{agreeing} {bad:?}");
            // No rig tells what happened to a pair.
            let is_told = |pair: &Skipped| ["exchanged", "turned", "mirrored"].iter().any(|w| pair.reason.contains(w));
            assert!(!bad.iter().any(is_told), "{bad:?}");
        }
        other => panic!("{:?}", other.map(|c| c.rms_px())),
    }
}

fn asked() -> Asked {
    Asked { options: Options::default(), tolerance_mm: 0.05, extent: Extent::default() }
}

#[test]
fn a_series_that_is_shifted_against_the_other_side_is_named() {
    let world = World::new(10, 13);
    for by in [1, 8] {
        let corners = shifted(world.corners(14), by);
        match calibrate_standing(&corners, &asked()) {
            Err(Error::Shifted { fit, of, left, right, .. }) => {
                let (left, right): (usize, usize) = (left.parse().unwrap(), right.parse().unwrap());
                // The rights were moved to the front by so many, or to the back by what is left of the ten.
                assert!(
                    (right + by) % 10 == left && fit >= 8 && of == 10 - right.abs_diff(left),
                    "{by}: {left} {right}"
                );
            }
            other => panic!("{by}: {:?}", other.map(|(c, _)| c.rms_px())),
        }
    }
}

/// Boards without a board in some of the pairs: those count for which picture is whose neighbour.
#[test]
fn a_shifted_series_with_gaps_is_named_all_the_same() {
    let mut corners = shifted(World::new(12, 13).corners(14), 1);
    for name in ["03", "06", "09"] {
        corners.pairs.retain(|pair| pair.pair != name);
        corners.skipped.push(Skipped { pair: name.to_owned(), reason: "no board".to_owned() });
    }
    match calibrate_standing(&corners, &asked()) {
        Err(Error::Shifted { fit, of, left, right, .. }) => {
            assert!(fit >= 4 && of <= 8 && left != right, "{fit} {of} {left} {right}")
        }
        other => panic!("{:?}", other.map(|(c, _)| c.rms_px())),
    }
}

#[test]
fn a_side_whose_pictures_are_all_mirrored_or_inverted_is_named() {
    // Boards that are hardly tilted, raised or lowered fit a rig in a mirror as well, and miss it by a few pixels.
    for share in [1.0, 0.3, 0.1, 0.05, 0.03] {
        let mut world = World::new(9, 13);
        for pose in &mut world.poses {
            let at = pose.translation.vector;
            *pose = transform(rotation_vector(pose) * share, Vector3::new(at.x, share * at.y, at.z));
        }
        are_named(&world, share);
    }
}

/// The left camera stands to the left with that undone in the pictures of the side that it happened to.
#[test]
fn the_side_that_is_mirrored_is_told_by_where_the_cameras_stand() {
    let world = World::new(9, 13);
    for side in Side::BOTH {
        let mut corners = world.corners(14);
        for pair in &mut corners.pairs {
            let picture = if side == Side::Left { &mut pair.left } else { &mut pair.right };
            for corner in picture.iter_mut() {
                corner.px.x = f64::from(world.rig.camera(side).width) - 1.0 - corner.px.x;
                corner.row = world.board.rows() - 1 - corner.row;
            }
            picture.sort_by_key(|corner| (corner.row, corner.col));
        }
        let said = calibrate_standing(&corners, &asked()).map(|(found, _)| found.rms_px());
        let is_told = matches!(&said, Err(Error::ChangedSide { side: told, .. }) if *told == Some(side));
        assert!(is_told && said.unwrap_err().to_string().contains(side.name()), "{side:?}");
    }
}

fn are_named(world: &World, share: f64) {
    let clean = world.corners(14);
    assert!(calibrate_standing(&clean, &asked()).is_ok(), "{share}");
    let (columns, rows) = (world.board.columns(), world.board.rows());
    let width = f64::from(world.rig.right.width);
    let changed = |change: &dyn Fn(&mut Corner)| {
        let mut corners = clean.clone();
        for pair in &mut corners.pairs {
            pair.right.iter_mut().for_each(change);
            pair.right.sort_by_key(|corner| (corner.row, corner.col));
        }
        calibrate_standing(&corners, &asked()).map(|(found, _)| found.rms_px())
    };
    let is_named = |said: Result<f64, Error>, expected: OneSide| {
        let is_named = matches!(said, Err(Error::ChangedSide { what, fit: 8.., .. }) if what == expected);
        assert!(is_named, "{share} {expected:?}: {said:?}");
    };
    let mirrored = changed(&|corner| {
        corner.px.x = width - 1.0 - corner.px.x;
        corner.row = rows - 1 - corner.row;
    });
    is_named(mirrored, OneSide::Mirrored);
    // Of a board that looks the same after half a turn the numbers are open anyway.
    assert_eq!(world.board.turns_left_open(), [0]);
    let inverted = changed(&|corner| (corner.col, corner.row) = (columns - 1 - corner.col, rows - 1 - corner.row));
    is_named(inverted, OneSide::Inverted);
}

#[test]
fn three_pairs_are_too_few() {
    let corners = World::new(3, 1).corners(1);
    assert!(matches!(calibrate(&corners, &Options::default()), Err(Error::TooFewPairs { found: 3, total: 3, .. })));
}

#[test]
fn boards_that_are_never_tilted_do_not_tell_the_cameras() {
    // Side by side and square to the board, so that neither camera sees it from the side.
    let refused = calibrate(&World::facing(8, |i| Vector3::z() * 0.1 * i).corners(1), &Options::default());
    let told = |c: Calibration| (c.rig().left.fx, c.covariance[(0, 0)].sqrt(), c.layout);
    assert!(matches!(refused, Err(Error::Undetermined { one_pose: None, .. })), "{:?}", refused.map(told));
}

#[test]
fn boards_in_one_pose_are_said_to_be() {
    let mut world = World::facing(8, |_| Vector3::zeros());
    world.poses.iter_mut().for_each(|pose| pose.translation.vector = Vector3::new(0.0, 0.0, 550.0));
    let refused = calibrate(&world.corners(1), &Options::default()).map(|found| found.layout);
    let said = refused.as_ref().map_err(Error::to_string);
    assert!(matches!(said, Err(said) if said.contains("all 8 pairs show the board in one pose")), "{refused:?}");
}

#[test]
fn pictures_of_one_camera_are_no_rig() {
    let mut world = World::new(9, 3);
    world.rig.right = world.rig.left;
    world.rig.right_from_left = Transform::identity();
    // Taken twice from one place; and from 30 mm beside it, which is a rig.
    let refused = held_out::hold_out(&calibrate(&world.corners(4), &BROWN4).unwrap(), None);
    let told = |accuracy: held_out::Accuracy| accuracy.extremes.max_abs_error_mm;
    assert!(
        matches!(refused, Err(Error::NoBaseline { baseline_mm, .. }) if baseline_mm < 2.0),
        "{:?}",
        refused.map(told)
    );
    world.rig.right_from_left = transform(Vector3::zeros(), Vector3::new(-30.0, 0.0, 0.0));
    assert!(held_out::hold_out(&calibrate(&world.corners(4), &BROWN4).unwrap(), None).is_ok());
}

#[test]
fn boards_that_are_hardly_tilted_are_not_called_pictures_of_one_camera() {
    // The distance of these cameras is open because the focal lengths are; that of one camera's pictures is none.
    let mut lenses = 0;
    for tilt in [0.01, 0.03, 0.08] {
        let world = World {
            sigma_px: 0.3,
            ..World::facing(8, |i| Vector3::new((1.7 * i).sin(), (2.9 * i).cos(), 0.1 * i) * tilt)
        };
        let refused = calibrate(&world.corners(5), &BROWN4).and_then(|found| held_out::hold_out(&found, None));
        assert!(!matches!(refused, Err(Error::NoBaseline { .. })), "{tilt}");
        lenses += usize::from(matches!(refused, Err(Error::Undetermined { focal_sigma: Some(_), .. })));
    }
    assert!(lenses > 0);
}

#[test]
fn a_pair_that_alone_tells_the_cameras_leaves_the_verdict_open() {
    let mut world = World::facing(9, |i| Vector3::z() * 0.1 * i);
    world.poses[0] = World::new(1, 1).poses[0];
    let tilted = judged(&world.corners(1), &BROWN4, 0.5);
    assert_eq!(tilted.facts.accuracy.unchecked, ["00"]);
    assert_eq!(tilted.verdict, Verdict::Undecided);
    let line = tilted.evidence.iter().find(|line| line.what == "rigs without some pairs").unwrap();
    assert!(line.value.is_none() && line.detail.contains("Without 00 the others do not"), "{}", line.detail);
    // With tilts enough nothing hangs on one pair.
    assert!(judged(&World::new(9, 1).corners(1), &BROWN4, 0.5).facts.accuracy.unchecked.is_empty());
}

/// Five boards that all lie nearly alike: where no four of them tell the focal lengths, what these usually are still
/// holds all five.
#[test]
fn few_boards_that_lie_alike_are_calibrated_and_nothing_is_promised() {
    let all = ["00", "01", "02", "03", "04"];
    let mut unchecked = 0;
    for sigma_px in [0.25, 0.5, 1.0, 2.0] {
        let world = World { sigma_px, ..World::facing(5, |i| Vector3::new(0.02 * (i - 2.0), 0.03, 0.1 * i)) };
        let Ok(found) = calibrate(&world.corners(1), &BROWN4) else { continue };
        let Ok(accuracy) = held_out::hold_out(&found, None) else { continue };
        if accuracy.unchecked == all {
            unchecked += 1;
            assert!(accuracy.pairs.iter().all(|pair| pair.max_abs_error_mm.is_some()), "{sigma_px}");
            assert_eq!(judged(&world.corners(1), &BROWN4, 50.0).verdict, Verdict::Undecided, "{sigma_px}");
        }
    }
    assert!(unchecked > 0);
}
