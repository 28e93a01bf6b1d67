//! Faults planted in the corners of a series: each must be named, and a clean series of any noise must lose nothing.

mod bursts;
mod lenses;
mod turns;

use nalgebra::Vector3;

use crate::geometry::transform;
use crate::imaging::{Board, Corner, Corners, PairCorners, Side};
use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::standing::{Asked, calibrate_since, calibrate_standing};
use crate::stereo::findings::{Finding, Kind, hold};
use crate::stereo::judge::ledger::Standards;
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::pairs::Cause;
use crate::stereo::select::options::Options;
use crate::stereo::synthetic::{BROWN4, World, judged};
use crate::stereo::volume::Extent;

/// The paper's rig, and the same at a fifth of its pixels.
fn worlds(pairs: usize, seed: u64) -> [World; 2] {
    let small = World { sigma_px: 0.01, ..World::new(pairs, seed) };
    [World::paper(pairs, seed), small]
}

/// One of them for the case of this number.
fn one_of(case: usize, pairs: usize, seed: u64) -> World {
    worlds(pairs, seed)[case % 2].clone()
}

/// The pairs of `range` as another world shows them.
fn planted(world: &World, seed: u64, range: impl Iterator<Item = usize>, change: impl Fn(&mut World)) -> Corners {
    let mut other = world.clone();
    change(&mut other);
    shown_by(world.corners(seed), &other, seed, range)
}

fn shown_by(mut corners: Corners, other: &World, seed: u64, range: impl Iterator<Item = usize>) -> Corners {
    let others = other.corners(seed);
    range.for_each(|i| corners.pairs[i] = others.pairs[i].clone());
    corners
}

fn causes(found: &Calibration) -> Vec<(&str, Cause)> {
    found.discarded.pairs.iter().map(|d| (d.pair.as_str(), d.cause)).collect()
}

fn asked(options: Options) -> Asked {
    Asked { options, tolerance_mm: 0.05, extent: Extent::Boards }
}

fn standing(corners: &Corners) -> (Calibration, Vec<Finding>) {
    calibrate_standing(corners, &asked(BROWN4)).unwrap()
}

#[test]
fn a_clean_series_of_any_noise_loses_nothing() {
    for (case, (sigma_px, seed)) in [(0.002, 1), (0.02, 2), (0.3, 1), (1.0, 2)].into_iter().enumerate() {
        let world = World { sigma_px, ..one_of(case, 8 + 4 * seed as usize, seed) };
        let (found, told) = calibrate_standing(&world.corners(seed), &asked(Options::default())).unwrap();
        assert!(found.skipped.is_empty() && told.is_empty(), "{sigma_px} px: {:?} {told:?}", found.skipped);
        assert_eq!((found.standing.since, found.standing.unconfirmed), (None, Vec::new()));
    }
}

#[test]
fn a_camera_that_moved_leaves_the_last_rig() {
    let shifts = [
        ("1 mm", Vector3::zeros(), Vector3::new(0.0, 0.0, 1.0)),
        ("0.2 mm", Vector3::zeros(), Vector3::new(0.2, 0.0, 0.0)),
        ("0.2 mm along z", Vector3::zeros(), Vector3::new(0.0, 0.0, 0.2)),
        ("0.05 deg", Vector3::new(0.0, 0.05_f64.to_radians(), 0.0), Vector3::zeros()),
    ];
    for (case, (what, turn, shift)) in shifts.into_iter().enumerate() {
        let world = one_of(case, 12, 3);
        let after = world.with_camera_moved(turn, shift);
        let first = [6, 8][case % 2];
        let corners = shown_by(world.corners(4), &after, 4, first..12);
        let (found, told) = standing(&corners);
        let before: Vec<&str> = found.discarded.pairs.iter().map(|d| d.pair.as_str()).collect();
        let expected: Vec<String> = (0..first).map(|i| format!("{i:02}")).collect();
        assert_eq!(before, expected, "{what} before pair {first}: {:?} {told:?}", found.skipped);
        let named = ["yaw", "baseline", "camera-moved"].iter().any(|cause| told[0].cause.contains(cause));
        assert!(named && told.len() == 1, "{what}: {told:?}");
        assert_eq!(found.standing.since, Some(format!("{first:02}")));
        let off = found.rig().right_from_left.translation.vector - after.rig.right_from_left.translation.vector;
        assert!(off.norm() < 0.15, "{what}: {off}");
        // Too few pairs of the rig that stands: said, and the rig of the others is no longer confirmed.
        let (found, told) = standing(&shown_by(world.corners(4), &after, 4, 10..12));
        assert_eq!(found.standing.unconfirmed, ["10", "11"], "{what}: {:?} {told:?}", found.skipped);
    }
}

#[test]
fn a_camera_that_zoomed() {
    for world in worlds(12, 5) {
        let corners = planted(&world, 6, 7..12, |after| {
            after.rig.right.fx *= 1.001;
            after.rig.right.fy *= 1.001;
        });
        let (found, told) = standing(&corners);
        // Five pairs may be too few for a rig that is surer than the one of all.
        let since = found.standing.since.as_deref() == Some("07");
        assert!(since || found.standing.unconfirmed.first().is_some_and(|pair| pair == "07"), "{told:?}");
        assert!(!since || told[0].cause.contains("focus"), "{told:?}");
    }
}

/// An autofocus moves the picture, too: that is no camera that turned, and a knock is no focus.
#[test]
fn a_lens_that_was_focused_and_moved_its_picture() {
    let world = World { sigma_px: 0.01, ..World::new(16, 7) };
    let corners = planted(&world, 8, 8..16, |after| {
        let right = &mut after.rig.right;
        (right.fx, right.fy) = (right.fx * 1.001, right.fy * 1.001);
        (right.cx, right.cy) = (right.cx + 0.3, right.cy - 0.2);
    });
    let (_, told) = standing(&corners);
    assert!(told[0].cause.contains("focus") && told[0].action.contains("lens was focused otherwise"), "{told:?}");
    let turn = Vector3::new(1e-3, -8e-4, 6e-4);
    let knocked = world.with_camera_moved(turn, Vector3::new(0.3, -0.2, 0.1));
    let (_, told) = standing(&shown_by(world.corners(8), &knocked, 8, 8..16));
    assert!(!told[0].action.contains("lens was focused otherwise"), "{told:?}");
}

#[test]
fn two_pairs_out_of_step() {
    for shift_mm in [2.0, 5.0] {
        for world in worlds(12, 9) {
            let mut corners = world.corners(10);
            for i in [3, 7] {
                let mut late = world.clone();
                let turn = Vector3::new(0.0, 2e-4 * shift_mm, 1e-4 * shift_mm);
                late.poses[i] =
                    transform(turn, Vector3::new(shift_mm, -0.3 * shift_mm, 0.2 * shift_mm)) * late.poses[i];
                corners.pairs[i].right = late.corners(10).pairs[i].right.clone();
            }
            let (found, told) = standing(&corners);
            assert_eq!(
                causes(&found),
                [("03", Cause::NotSimultaneous), ("07", Cause::NotSimultaneous)],
                "{shift_mm} mm: {:?}",
                found.skipped
            );
            assert!(told.is_empty(), "{told:?}");
        }
    }
}

#[test]
fn a_rig_that_drifts_is_that_of_the_middle_and_no_picture_was_late() {
    // The lenses take up some of it, and with that some of what is not known of its size.
    for (w, (size_deg, most_focal)) in [(0.01_f64, 2.5), (0.05, 10.0)].into_iter().enumerate() {
        let world = one_of(w, 12, 21);
        let turned =
            |share: f64| world.with_camera_moved(Vector3::y() * size_deg.to_radians() * share, Vector3::zeros());
        let mut corners = world.corners(22);
        for i in 0..12 {
            corners = shown_by(corners, &turned(i as f64 / 11.0), 22, i..=i);
        }
        let (found, told) = standing(&corners);
        let causes: Vec<&str> = told.iter().map(|finding| finding.cause.as_str()).collect();
        assert!(causes.len() == 1 && causes[0].contains("yaw"), "{size_deg} deg in world {w}: {causes:?}");
        assert!(found.skipped.is_empty() && found.since_moment.len() == 1, "{:?}", found.skipped);
        assert_eq!(found.moment(), ["05", "06"]);
        let off =
            (found.rig().right_from_left.rotation * turned(0.5).rig.right_from_left.rotation.inverse()).scaled_axis().y;
        let at = found.layout.transform_start() + 1;
        let sigma = found.covariance[(at, at)].sqrt();
        let limit = 4.0 * sigma;
        assert!(off.abs() < limit, "{size_deg} deg in world {w}: {off} against {limit}");
        let since = found.since_moment[0][at];
        assert!((since - 0.5 * size_deg.to_radians()).abs() < limit, "{since} against {limit}");
        // What drifted is known, and counts as no scatter of the pairs; of a board that may have grown it is not known
        // where it began.
        let still = standing(&world.corners(22)).0;
        for (at, most) in [(0, most_focal), (at, 1.6)] {
            let [sigma, still] = [&found, &still].map(|found| found.covariance[(at, at)].sqrt());
            let other_board = causes[0].contains("other-board");
            assert!(other_board || sigma < most * still, "{size_deg} deg in world {w}: {sigma} against {still}");
        }
    }
}

#[test]
fn a_focus_that_drifts_is_nothing_that_moved_between_two_pictures() {
    for (w, share) in [5e-4, 2e-3].into_iter().enumerate() {
        let world = one_of(w, 12, 31);
        let mut corners = world.corners(32);
        for i in 0..12 {
            let mut after = world.clone();
            let right = &mut after.rig.right;
            let focus = 1.0 + share * i as f64 / 11.0;
            (right.fx, right.fy) = (right.fx * focus, right.fy * focus);
            corners = shown_by(corners, &after, 32, i..=i);
        }
        let (found, told) = standing(&corners);
        let [drift] = told.as_slice() else { panic!("{share} in world {w}: {told:?}") };
        assert!(drift.cause.contains("focus") && drift.kind == Kind::Drift, "{share} in world {w}: {drift:?}");
        assert!((drift.size.unwrap() / (100.0 * share) - 1.0).abs() < 0.25, "{share} in world {w}: {drift:?}");
        assert!(!found.each_alone && found.skipped.is_empty(), "{share} in world {w}: {:?}", found.skipped);
    }
}

#[test]
fn another_board_in_two_pairs() {
    for (case, percent) in [0.1, 0.3, 1.0, 3.0].into_iter().enumerate() {
        let world = one_of(case, 12, 13);
        let corners = planted(&world, 14, [3, 7].into_iter(), |other| other.board.square_mm *= 1.0 + percent / 100.0);
        let (found, told) = standing(&corners);
        let expected = [("03", Cause::OtherBoard), ("07", Cause::OtherBoard)];
        assert_eq!(causes(&found), expected, "{percent} %: {:?}", found.skipped);
        assert!(told.is_empty(), "{told:?}");
    }
}

#[test]
fn a_last_pair_with_another_baseline_or_board_leaves_the_rig_unconfirmed() {
    for world in worlds(12, 13) {
        let corners = planted(&world, 14, std::iter::once(11), |after| {
            after.rig.right_from_left.translation.vector *= 1.001;
        });
        let (found, _) = standing(&corners);
        let [pair] = &found.discarded.pairs[..] else { panic!("{:?}", found.skipped) };
        let causes = pair.causes();
        assert_eq!((pair.pair.as_str(), causes.as_str()), ("11", "not-simultaneous|other-board|baseline"));
        assert!(found.skipped[0].reason.contains("or the baseline was"), "{:?}", found.skipped);
        assert_eq!(found.standing.unconfirmed, ["11"]);
    }
}

#[test]
fn interlaced_pictures() {
    for world in worlds(12, 11) {
        for shift_px in [0.2, 1.0] {
            let mut corners = world.corners(12);
            for i in [1, 8] {
                let PairCorners { left, .. } = &mut corners.pairs[i];
                // Every other line was taken later: corners move by what their lines show.
                for corner in left.iter_mut() {
                    corner.px.x += shift_px * if (corner.px.y as i64) % 2 == 0 { 0.5 } else { -0.5 };
                }
            }
            let (found, _) = standing(&corners);
            let pairs: Vec<&str> = causes(&found).into_iter().map(|(pair, _)| pair).collect();
            assert_eq!(pairs, ["01", "08"], "{shift_px} px: {:?}", found.skipped);
        }
    }
}

#[test]
fn small_noisy_pictures_fit_one_rig() {
    let mut world = World::new(16, 15);
    for camera in [&mut world.rig.left, &mut world.rig.right] {
        (camera.width, camera.height) = (320, 240);
        for number in [&mut camera.fx, &mut camera.fy, &mut camera.cx, &mut camera.cy] {
            *number /= 4.0;
        }
    }
    world.sigma_px = 0.3;
    let (found, told) = standing(&world.corners(16));
    assert!(told.is_empty(), "{told:?}");
    assert!(found.skipped.is_empty(), "{:?}", found.skipped);
}

#[test]
fn a_board_whose_squares_are_not_as_wide_as_high_as_was_said_is_named_by_its_ratio() {
    for (case, stretch) in [0.004, -0.03].into_iter().enumerate() {
        let mut corners = one_of(case, 12, 4).corners(4);
        corners.board.square_mm *= 1.0 + stretch;
        corners.board.stretch = 1.0 / (1.0 + stretch);
        let (_, told) = calibrate_standing(&corners, &asked(Options::default())).unwrap();
        let [finding] = told.as_slice() else { panic!("{stretch}: {told:?}") };
        assert_eq!(finding.cause, "other-board", "{stretch}: {finding:?}");
        let off = finding.size.unwrap() / 100.0 - (1.0 / (1.0 + stretch) - 1.0);
        assert!(off.abs() < 1e-4, "{stretch}: {finding:?}");
        // Both sides were given: giving them is no advice.
        let remedy = finding.remedy.as_ref().unwrap();
        assert!(remedy.contains("once more") && !remedy.contains("--measured-mm"), "{remedy}");
    }
}

#[test]
fn pairs_that_since_leaves_out_are_why_too_few_remain() {
    use crate::diagnostic::Explain;

    let corners = World::new(8, 1).corners(1);
    let hint = |corners: &Corners, pair: &str| {
        let error = calibrate_since(corners, pair, &asked(BROWN4)).unwrap_err();
        (error.to_string(), error.hint().unwrap())
    };
    let (said, told) = hint(&corners, &corners.pairs[7].pair);
    assert!(said.starts_with("only 1 of 8 pairs") && said.contains("--since"), "{said}");
    assert!(told.contains("`--since` an earlier pair"), "{told}");
    // Where there are no others it is no cause.
    let few = Corners { pairs: corners.pairs[..2].to_vec(), ..corners.clone() };
    let (_, told) = hint(&few, &few.pairs[0].pair);
    assert!(!told.contains("--since"), "{told}");
}

/// The pairs' first common rig is that of a flat board; what is said of all pairs is said of the rig that is stated.
#[test]
fn a_bowed_board_is_no_other_one() {
    for (case, bow_mm) in [0.03, 0.1, 0.4].into_iter().enumerate() {
        let world = World { bow_mm: [bow_mm, 0.5 * bow_mm], sigma_px: 0.002, ..one_of(case, 12, 5) };
        let (found, told) = calibrate_standing(&world.corners(5), &asked(Options::default())).unwrap();
        assert!(found.values.shared.shape_mm.iter().any(|mm| mm.abs() > 0.2 * bow_mm), "{bow_mm}");
        assert!(told.is_empty(), "{bow_mm}: {told:?}");
    }
}

#[test]
fn what_changed_is_held() {
    let said = |causes| hold(causes, None).unwrap_or_default();
    assert_eq!(said("focus"), "lock the focus of both cameras, and take all pairs again");
    assert_eq!(said("yaw|baseline"), "clamp both cameras, and take all pairs again");
    assert!(said("focus|yaw").starts_with("lock the focus of both cameras and clamp both cameras"));
    assert!(said("unknown") == said("focus|camera-moved") && said("other-board").is_empty());
    let pairs = ["0017".to_owned(), "0018".to_owned()];
    assert!(hold("unknown", Some(&pairs)).unwrap().ends_with("or `--since 0017`: the rig of the last 2 pairs"));
}

/// The corners where the board of each pair goes by `way_mm` while a picture is read out, row by row.
fn rolled(world: &World, seed: u64, way_mm: Vector3<f64>) -> Corners {
    let mut corners = world.corners(seed);
    for (pair, pose) in corners.pairs.iter_mut().zip(&world.poses) {
        for (side, list) in [(Side::Left, &mut pair.left), (Side::Right, &mut pair.right)] {
            let height = f64::from(world.rig.camera(side).height);
            for corner in list {
                let still = pose * world.board.corner_mm(corner.col, corner.row);
                let at = |late: f64| {
                    let (left, right) = world.rig.project(&(still + way_mm * late));
                    if side == Side::Left { left } else { right }
                };
                let late = (0..5).fold(0.0, |late, _| (at(late).y + 0.5) / height - 0.5);
                corner.px += at(late) - at(0.0);
            }
        }
    }
    corners
}

fn of_rows(told: &[Finding]) -> Option<&Finding> {
    told.iter().find(|finding| finding.action.contains("rolling shutter"))
}

#[test]
fn a_board_that_moves_while_rows_are_read_out_is_named() {
    for mm in [0.2, 1.0] {
        let world = World { sigma_px: 0.01, ..World::new(16, 3) };
        let (found, told) = standing(&rolled(&world, 4, Vector3::y() * mm));
        let named = of_rows(&told).unwrap_or_else(|| panic!("{mm}: {told:?}"));
        assert_eq!(named.cause, Cause::NotSimultaneous.word());
        let size = named.size.unwrap();
        assert!((size / mm - 1.0).abs() < 0.3, "{mm}: {named:?}");
        let judged = judged(&found, told.clone(), Standards::default(), 0.05);
        assert!(mm < 1.0 || judged.verdict != Verdict::Pass, "{mm}: {named:?}");
        let line = judged.evidence.iter().find(|line| line.what == "changes over the pairs").unwrap();
        assert!(line.remedy.starts_with("hold the board still"), "{line:?}");
    }
}

#[test]
fn what_looks_like_rows_at_two_moments_at_one_distance_is_not_taken_for_it() {
    let world = World { sigma_px: 0.01, ..World::new(16, 3) };
    let zoomed = |fy: f64| {
        let mut zoomed = world.clone();
        [&mut zoomed.rig.left, &mut zoomed.rig.right].into_iter().for_each(|camera| camera.fy *= fy);
        zoomed.corners(5)
    };
    let pictures = |change: fn(&mut Corner)| {
        let mut corners = world.corners(5);
        let both = corners.pairs.iter_mut().flat_map(|pair| pair.left.iter_mut().chain(&mut pair.right));
        both.for_each(change);
        corners
    };
    let skew = pictures(|corner| corner.px.x += 0.002 * corner.px.y);
    let wide = World { board: Board { stretch: 1.002, ..world.board }, ..world.clone() };
    let wide = Corners { board: world.board, ..wide.corners(5) };
    for (what, corners) in [("a zoom", zoomed(1.3)), ("skew sensors", skew), ("a board too wide", wide)] {
        let (_, told) = standing(&corners);
        assert_eq!(of_rows(&told), None, "{what}");
    }
}
