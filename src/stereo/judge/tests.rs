//! Faults planted in corners of known worlds: each must be noticed and named by a line of the ledger, and clean corners
//! by none.

use nalgebra::{Matrix2, Point3, Vector2, Vector3};

use crate::geometry::transform;
use crate::imaging::{Corner, Corners};
use crate::simulate::draws::{Draws, Purpose};
use crate::stereo::calibrate::calibrate;
use crate::stereo::findings::standing::{Asked, calibrate_standing};
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::ledger::{Case, Standards, ledger};
use crate::stereo::judge::lengths::second_board::second_board;
use crate::stereo::judge::verdict::{LengthError, Verdict};
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::{self, World};
use crate::stereo::volume::Extent;
use crate::stereo::{Camera, Lens, Rig};

/// Corners of 0.004 px on this rig: lengths to some 0.03 mm.
const SIGMA_PX: f64 = 0.004;
const TOLERANCE_MM: f64 = 0.05;

fn world(pairs: usize, seed: u64) -> World {
    World { sigma_px: SIGMA_PX, ..World::new(pairs, seed) }
}

fn judge_with(corners: &Corners, second: Option<&Corners>) -> Judged {
    calibrated_and_judged(corners, second).1
}

fn calibrated_and_judged(corners: &Corners, second: Option<&Corners>) -> (Rig, Judged) {
    let asked = Asked { options: Options::default(), tolerance_mm: TOLERANCE_MM, extent: Extent::Boards };
    let (found, findings) = calibrate_standing(corners, &asked).unwrap();
    let second = second.map(|corners| second_board(&found, corners, None));
    let standards = Standards { second, ..Standards::default() };
    (found.rig().clone(), synthetic::judged(&found, findings, standards, TOLERANCE_MM))
}

/// The largest error with which a rig measures lengths between the corners of the world's boards, mm, from places
/// without noise.
fn largest_true_error_mm(world: &World, rig: &Rig) -> f64 {
    let of_pair = |points: &Vec<[Point3<f64>; 2]>| {
        let error = |[a, a1]: &[Point3<f64>; 2], [b, b1]: &[Point3<f64>; 2]| ((b1 - a1).norm() - (b - a).norm()).abs();
        let all = points.iter().enumerate().flat_map(|(i, a)| points[i..].iter().map(move |b| error(a, b)));
        all.fold(0.0, f64::max)
    };
    world.measured_exactly(rig).iter().map(of_pair).fold(0.0, f64::max)
}

fn judge(corners: &Corners) -> Judged {
    judge_with(corners, None)
}

fn line<'a>(judged: &'a Judged, what: &str) -> &'a super::evidence::Evidence {
    judged.evidence.iter().find(|line| line.what == what).unwrap()
}

/// Moves every corner by what `change` says, given the pair, whether it is left, and the corner.
fn changed(mut corners: Corners, change: impl Fn(usize, bool, &mut Corner)) -> Corners {
    for (i, pair) in corners.pairs.iter_mut().enumerate() {
        pair.left.iter_mut().for_each(|corner| change(i, true, corner));
        pair.right.iter_mut().for_each(|corner| change(i, false, corner));
    }
    corners
}

/// Two prints of one board in a series: of which the size was said, no pictures tell.
#[test]
fn a_rig_since_another_board_may_be_scaled() {
    const LINE: &str = "changes over the pairs";
    let world = world(14, 5);
    let changed_to = |other: &World| {
        let mut corners = world.corners(6);
        corners.pairs[7..].clone_from_slice(&other.corners(6).pairs[7..]);
        judge(&corners)
    };
    for percent in [-3.0, -0.5, 1.0] {
        let board = world.board.scaled(1.0 + percent / 100.0);
        let judged = changed_to(&World { board, ..world.clone() });
        assert!(judged.verdict != Verdict::Pass, "{percent} %");
        assert_ne!(line(&judged, LINE).allows, Verdict::Pass, "{percent} %");
    }
    let turned = changed_to(&world.with_camera_moved(Vector3::new(0.0, 2e-3, 0.0), Vector3::zeros()));
    assert!(line(&turned, LINE).allows == Verdict::Pass && turned.verdict == Verdict::Pass);
}

#[test]
fn a_tolerance_of_half_a_square_is_no_check() {
    let world = world(12, 1);
    let asked = Asked { options: Options::default(), tolerance_mm: TOLERANCE_MM, extent: Extent::Boards };
    let (found, findings) = calibrate_standing(&world.corners(1), &asked).unwrap();
    let side_mm = world.board.square_mm;
    for (share, passes) in [(0.1, true), (0.49, true), (0.5, false), (1.0, false), (200.0, false)] {
        let judged = synthetic::judged(&found, findings.clone(), Standards::default(), share * side_mm);
        assert_eq!(judged.verdict == Verdict::Pass, passes, "{share}");
        let named = judged.evidence.iter().any(|line| line.what == "tolerance" && line.allows == Verdict::Undecided);
        assert_eq!(named, !passes, "{share}");
        // What lengths can be trusted to does not depend on what was asked.
        assert!(judged.trusted_mm().is_some_and(|mm| mm < 0.2), "{share}: {:?}", judged.trusted_mm());
    }
}

#[test]
fn clean_corners_pass_without_a_warning() {
    for (pairs, seed) in [(12, 51), (20, 52), (7, 53)] {
        let judged = judge(&world(pairs, seed).corners(seed));
        assert_eq!(judged.verdict, Verdict::Pass, "{pairs} pairs: {:#?}", judged.evidence);
        assert!(judged.warnings.is_empty(), "{:?}", judged.warnings);
        assert!(judged.trusted_mm().is_some_and(|mm| mm <= TOLERANCE_MM));
    }
}

#[test]
fn an_s_shaped_board_does_not_pass_unless_lengths_are_good() {
    let world = world(14, 54);
    let edge = world.board.corner_mm(world.board.columns() - 1, 0).x;
    for height_mm in [0.05, 0.1, 0.2, 0.5] {
        let corners = changed(world.corners(55), |i, left, corner| {
            let flat = world.board.corner_mm(corner.col, corner.row);
            let u = flat.x / edge;
            let bent = flat + Vector3::new(0.0, 0.0, 2.6 * height_mm * (u.powi(3) - u));
            let seen = |p| world.rig.project(&(world.poses[i] * p));
            let (a, b) = (seen(flat), seen(bent));
            corner.px += if left { b.0 - a.0 } else { b.1 - a.1 };
        });
        let (rig, judged) = calibrated_and_judged(&corners, None);
        let off_mm = largest_true_error_mm(&world, &rig);
        let trusted_mm = judged.trusted_mm().unwrap_or(f64::INFINITY);
        assert!(trusted_mm > off_mm, "{height_mm} mm: {off_mm} {:#?}", judged.evidence);
        assert!(
            judged.verdict != Verdict::Pass || off_mm < TOLERANCE_MM,
            "{height_mm} mm: {off_mm} {:#?}",
            judged.evidence
        );
        assert!(height_mm < 0.2 || judged.verdict != Verdict::Pass, "{height_mm} mm: {:#?}", judged.evidence);
        assert!(line(&judged, "residual correlation").value.is_some_and(|mm| mm > 0.02), "{:#?}", judged.evidence);
    }
}

#[test]
fn boards_that_are_hardly_tilted_do_not_pass() {
    let mut world = world(12, 56);
    for (i, pose) in world.poses.iter_mut().enumerate() {
        let turn = Vector3::new(0.004 * (i % 3) as f64, 0.17 + 0.003 * (i % 4) as f64, 0.05 * i as f64 - 0.3);
        *pose = transform(turn, pose.translation.vector);
    }
    let judged = judge(&world.corners(57));
    assert_eq!(line(&judged, "tilts of the boards").allows, Verdict::Undecided);
    assert_eq!(judged.verdict, Verdict::Undecided, "{:#?}", judged.evidence);
}

#[test]
fn a_board_in_other_units_does_not_pass() {
    let corners = world(12, 60).corners(61);
    // A rig of 190 mm: in metres, in feet, and as it is; the smaller the board is said to be, the smaller are all
    // errors.
    for (factor, is_told) in [(1e-3, true), (1.0 / 304.8, true), (1.0, false)] {
        let said = Corners { board: corners.board.scaled(factor), ..corners.clone() };
        let judged = judge(&said);
        let told = judged.evidence.iter().find(|line| line.what == "distance of the cameras");
        assert_eq!(told.map(|line| line.allows), is_told.then_some(Verdict::Undecided), "{factor}");
        assert_eq!(judged.verdict == Verdict::Pass, !is_told, "{factor}: {:#?}", judged.evidence);
        assert_eq!(judged.trusted().is_some(), !is_told, "{factor}");
    }
}

#[test]
fn few_pairs_are_said_to_be_few() {
    let judged = judge(&world(4, 58).corners(59));
    assert_eq!(line(&judged, "pairs with poses of their own").allows, Verdict::Undecided);
    assert_eq!(judged.verdict, Verdict::Undecided);
}

#[test]
fn a_hand_in_two_pictures_is_named_and_no_error_of_the_rig() {
    let world = world(12, 60);
    // Imaging may know how bad these corners are, or not.
    for said_px in [0.3, SIGMA_PX] {
        let corners = changed(world.corners(61), |i, left, corner| {
            if !left && (i == 2 || i == 5) && corner.row < 2 && corner.col < 4 {
                let place = (corner.row * 7 + corner.col) as f64;
                corner.px += 0.4 * Vector2::new((3.0 * place).sin(), (5.0 * place + 1.0).sin());
                corner.covariance_px2 = Some(Matrix2::identity() * said_px * said_px);
            }
        });
        let judged = judge(&corners);
        assert_eq!(judged.verdict, Verdict::Pass, "{said_px}: {:#?}", judged.evidence);
        let said = judged.evidence.iter().map(|line| line.detail.as_str()).collect::<Vec<_>>().join("\n");
        assert!(said.contains("02 (") && said.contains("05 ("), "{said}");
    }
}

#[test]
fn a_second_board_of_another_pitch_fails_and_one_that_cannot_be_measured_does_not_pass() {
    let world = world(12, 62);
    let corners = world.corners(63);
    let fresh = World { poses: World::new(5, 64).poses, ..world.clone() };
    let of_pitch = |factor: f64| {
        let mut second = fresh.corners(65);
        second.board.square_mm *= factor;
        second
    };
    assert_eq!(judge_with(&corners, Some(&of_pitch(1.0))).verdict, Verdict::Pass);
    // 0.2 % of the board's width of 150 mm is 0.3 mm.
    for factor in [1.002, 1.005, 1.01] {
        let judged = judge_with(&corners, Some(&of_pitch(factor)));
        assert_eq!(line(&judged, "second board").allows, Verdict::Fail, "{factor}: {:#?}", judged.evidence);
    }
    // A camera that was turned by 0.2 degrees since.
    let moved = fresh.with_camera_moved(Vector3::new(0.0, 0.0035, 0.0), Vector3::zeros());
    let judged = judge_with(&corners, Some(&moved.corners(66)));
    assert_eq!(line(&judged, "second board").allows, Verdict::Fail, "{:#?}", judged.evidence);
    let mut nothing = of_pitch(1.0);
    nothing.pairs.iter_mut().for_each(|pair| pair.right.clear());
    let judged = judge_with(&corners, Some(&nothing));
    assert_eq!(line(&judged, "second board").allows, Verdict::Undecided);
    assert_eq!(judged.verdict, Verdict::Undecided);
}

#[test]
fn last_pairs_that_contradict_the_rig_leave_open_whether_it_stands() {
    let world = world(10, 67);
    let mut corners = world.corners(68);
    let moved = world.with_camera_moved(Vector3::new(0.0, 0.01, 0.0), Vector3::zeros());
    corners.pairs[9].right = moved.corners(68).pairs[9].right.clone();
    let judged = judge(&corners);
    assert_eq!(
        line(&judged, "last pairs that contradict the rig").allows,
        Verdict::Undecided,
        "{:#?}",
        judged.evidence
    );
    assert_ne!(judged.verdict, Verdict::Pass);
}

#[test]
fn a_focal_length_that_no_lens_has_is_no_basis_of_a_pass() {
    // The same pictures but for their perspective: shorter lenses, boards that much nearer.
    for (focal_px, pass) in [(2000.0, true), (600.0, true), (150.0, false)] {
        let mut world = world(12, 69);
        let shorter = focal_px / 2000.0;
        for camera in [&mut world.rig.left, &mut world.rig.right] {
            *camera = Camera { lens: Lens::Brown4, ..Camera::pinhole(1280, 1024, focal_px) };
        }
        world.rig.right_from_left = transform(Vector3::zeros(), Vector3::new(-190.0 * shorter, 0.0, 0.0));
        world.board.square_mm *= shorter.max(0.3);
        for pose in &mut world.poses {
            pose.translation.vector *= shorter;
        }
        let judged = judge(&world.corners(70));
        let wide = judged.evidence.iter().find(|line| line.what == "focal lengths");
        assert_eq!(wide.is_none(), pass, "{focal_px}: {wide:?}");
        assert!(wide.is_none_or(|line| line.allows == Verdict::Undecided && line.detail.contains("no lens")));
    }
}

#[test]
fn boards_that_hardly_tilt_do_not_vouch_for_depths() {
    let of_tilt = |tilt: f64, seed: u64| {
        let mut world = World { sigma_px: 0.02, ..World::new(12, seed) };
        let mut draws = Draws::new(seed, Purpose::CheckPoses, 3);
        for pose in &mut world.poses {
            let turn =
                Vector3::new(draws.uniform(-tilt, tilt), 0.17 + draws.uniform(-tilt, tilt), draws.uniform(-0.4, 0.4));
            *pose = transform(turn, pose.translation.vector);
        }
        let judged = judge(&world.corners(seed));
        let of = |what| line(&judged, what).value.unwrap();
        (of("calibration along the line of sight"), of("any length in the volume"))
    };
    for seed in [1, 2, 3] {
        let [(tilted, _), (flat, across)] = [0.6, 0.05].map(|tilt| of_tilt(tilt, seed));
        assert!(flat > 3.0 * tilted, "{flat} {tilted}");
        // A tolerance that the lengths across would meet is not met.
        assert!(flat > 1.5 * across, "{flat} {across}");
    }
}

#[test]
fn where_one_pair_alone_reaches_the_border_more_are_asked_for_there() {
    let border = 12;
    // Boards near the middle; one reaches the right border of both pictures, above all others.
    let mut world = world(border, 71);
    for pose in &mut world.poses {
        pose.translation.vector.x *= 0.3;
        pose.translation.vector.y *= 0.3;
    }
    world.poses.push(transform(Vector3::new(0.0, 0.17, 0.0), Vector3::new(100.0, -40.0, 560.0)));
    let asked = Asked { options: Options::default(), tolerance_mm: TOLERANCE_MM, extent: Extent::Boards };
    let (found, findings) = calibrate_standing(&world.corners(72), &asked).unwrap();
    assert_eq!(found.views.len(), border + 1);
    let Judged { facts, .. } = synthetic::judged(&found, findings, Standards::default(), TOLERANCE_MM);
    let remedy = |pair: usize, error_mm: f64, lenses_known: bool| {
        let mut facts = facts.clone();
        let largest = &mut facts.accuracy.extremes.largest;
        *largest = LengthError { pair, error_mm, calibration_mm: 5.0, ..*largest };
        facts.coverage.lenses_known = lenses_known;
        let lines = ledger(&Case { calibration: &found, facts: &facts });
        lines.iter().find(|line| line.what == "held-out lengths").unwrap().remedy.clone()
    };
    let asks = "add pairs with the board at the right border";
    assert!(remedy(border, 1.0, false).starts_with(asks), "{}", remedy(border, 1.0, false));
    // A length that is wrong; one that lies in another pair; lenses that were known before.
    for (pair, error_mm, lenses_known) in [(border, 30.0, false), (3, 1.0, false), (border, 1.0, true)] {
        let remedy = remedy(pair, error_mm, lenses_known);
        assert!(remedy.starts_with("look at the worst pair"), "{pair} {error_mm} {lenses_known}: {remedy}");
    }
}

#[test]
fn more_pairs_are_asked_for_where_the_board_is_least_certain_and_only_where_they_help() {
    let found = calibrate(&World::new(8, 73).corners(73), &Options::default()).unwrap();
    let Judged { facts, .. } = synthetic::judged(&found, Vec::new(), Standards::default(), TOLERANCE_MM);
    let remedy = |corners_mm: f64, calibration_mm: f64| {
        let mut facts = facts.clone();
        for length in &mut facts.volume.lengths {
            (length.corners_mm, length.calibration_mm) = (corners_mm, calibration_mm);
        }
        let lines = ledger(&Case { calibration: &found, facts: &facts });
        lines.iter().find(|line| line.what == "any length in the volume").unwrap().remedy.to_string()
    };
    let of_calibration = remedy(0.01 * TOLERANCE_MM, 10.0 * TOLERANCE_MM);
    assert!(
        of_calibration.contains("add pairs") && of_calibration.contains("px of the left picture"),
        "{of_calibration}"
    );
    let of_corners = remedy(TOLERANCE_MM, 10.0 * TOLERANCE_MM);
    assert!(of_corners.contains("no more pairs change that"), "{of_corners}");
}

#[test]
fn a_board_that_is_far_from_flat_is_asked_for_another_where_the_rig_does_not_pass() {
    let asked = |bow_mm: f64, tolerance_mm: f64| {
        let world = World { bow_mm: [bow_mm, 0.5 * bow_mm], ..World::new(14, 74) };
        let bowed = Options { shape: Some(true), ..Options::default() };
        let found = calibrate(&world.corners(74), &bowed).unwrap();
        let judged = synthetic::judged(&found, Vec::new(), Standards::default(), tolerance_mm);
        let asks = judged.advice.iter().any(|what| what.starts_with("the board is bowed by"));
        (judged.verdict == Verdict::Pass, asks)
    };
    assert_eq!(asked(2.0, 1e-3), (false, true));
    assert_eq!(asked(0.1, 1e-3), (false, false));
    let (passes, asks) = asked(2.0, 5.0);
    assert_eq!(passes, !asks);
}
