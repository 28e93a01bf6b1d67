//! Grids of separate tags, rendered: every corner has its own number and lies where it should as surely as it says;
//! other grids are named.

use nalgebra::Point2;

use crate::imaging::Board;
use crate::imaging::board::Layout;
use crate::imaging::find::{corners_in, seen_in};
use crate::imaging::image::Picture;
use crate::imaging::shot::{Shot, eight_bits, with_pixels};

const GRID: &str = "apriltag:5x4:tag36h11:24:7.2:opencv";
const UNSAID: &str = "apriltag:5x4:tag36h11:24:7.2";
const KALIBR: &str = "apriltag:5x4:tag36h11:24:7.2:kalibr";

/// How many corners are measured, and their mean square deviation in their own sigmas.
fn measured(said: &str, picture: &Picture, truth: &[Point2<f64>]) -> (usize, f64) {
    let board: Board = said.parse().unwrap();
    let corners = corners_in(picture, board).unwrap();
    let (mut count, mut sum) = (0, 0.0);
    for (col, row, corner) in corners.iter() {
        let off = corner.px - truth[board.index(col, row)];
        assert!(off.norm() < if corner.used { 1.0 } else { 5.0 }, "{said}: corner {col},{row} is off by {off}");
        if let Some(covariance) = corner.covariance_px2 {
            (count, sum) = (count + 1, sum + off.dot(&(covariance.try_inverse().unwrap() * off)) / 2.0);
        }
    }
    (count, sum / count.max(1) as f64)
}

/// Grids of ArUco markers, from few bits to many.
const ARUCO: [&str; 4] = [
    "aruco:5x4:DICT_4X4_50:24:7.2",
    "aruco:5x4:DICT_5X5_1000:24:6",
    "aruco:5x4:DICT_6X6_250:24:7.2",
    "aruco:5x4:DICT_ARUCO_ORIGINAL:24:4.8",
];

fn refusal(picture: &Picture, said: &str) -> String {
    corners_in(picture, said.parse().unwrap()).map(|corners| corners.count()).expect_err(said).reason
}

#[test]
fn a_grid_is_measured_from_every_side_whether_or_not_its_layout_is_said() {
    let mut sum = 0.0;
    for quarter in 0..4 {
        let turn = [0.3, -0.25, 0.2 + f64::from(quarter) * 1.6];
        let (picture, truth) = Shot::of(GRID, turn, [3.0, -2.0, 380.0]).taken();
        let (count, chi2) = measured(GRID, &picture, &truth);
        // From one of the sides a tag is missed; none is measured wrongly.
        assert!(count >= 76 && chi2 < 1.5, "{quarter}: {count} of 80 corners, {chi2}");
        sum += chi2 / 4.0;
        let seen = seen_in(&picture, UNSAID.parse().unwrap()).unwrap();
        let (layout, found) = (seen.print.unwrap().layout, seen.corners.count());
        assert!(layout == Layout::Grid && found >= 76, "{quarter}: {layout:?}, {found} of 80 corners");
    }
    assert!((0.75..1.25).contains(&sum), "{sum}");
}

#[test]
fn grids_of_aruco_markers_are_measured_and_other_dictionaries_named() {
    for (k, said) in ARUCO.into_iter().enumerate() {
        let turn = [0.3, -0.25, 0.2 + k as f64 * 1.6];
        let (picture, truth) = Shot::of(said, turn, [3.0, -2.0, 380.0]).taken();
        let (count, chi2) = measured(said, &picture, &truth);
        assert!(count >= 76 && chi2 < 1.5, "{said}: {count} of 80 corners, {chi2}");
        let dictionary = said.split(':').nth(2).unwrap();
        // The smallest one that has these markers.
        let seen = dictionary.replace("1000", "50").replace("250", "50");
        for other in [ARUCO[(k + 1) % ARUCO.len()], UNSAID, GRID] {
            let reason = refusal(&picture, other);
            assert!(reason.contains(&format!("shows markers of {seen}")), "{said}, asked for {other}: {reason}");
        }
    }
}

#[test]
fn parts_of_a_grid_have_their_own_numbers() {
    for (x, y) in [(-100.0, 0.0), (80.0, 45.0), (-65.0, -60.0), (45.0, 65.0)] {
        let (picture, truth) = Shot::of(GRID, [0.4, 0.3, 0.5], [x, y, 300.0]).taken();
        let (count, _) = measured(GRID, &picture, &truth);
        assert!((8..80).contains(&count), "{x} {y}: {count} corners");
    }
}

#[test]
fn kalibrs_grid_and_opencvs_are_told_apart_whichever_was_said() {
    for pose in [[0.3, -0.25, 0.2], [0.0, 0.5, 1.8]] {
        let [grid, kalibr] = [GRID, UNSAID].map(|name| Shot::of(name, pose, [3.0, -2.0, 380.0]).taken().0);
        let said = refusal(&grid, KALIBR);
        assert!(said.contains("in OpenCV's layout"), "{said}");
        let said = refusal(&kalibr, GRID);
        assert!(said.contains("in Kalibr's layout"), "{said}");
        let layout = |picture: &Picture| seen_in(picture, UNSAID.parse().unwrap()).unwrap().print.unwrap().layout;
        assert_eq!([layout(&grid), layout(&kalibr)], [Layout::Grid, Layout::Tags]);
    }
}

#[test]
fn other_counts_and_gaps_are_named() {
    let (picture, _) = Shot::of(GRID, [0.3, -0.25, 0.2], [3.0, -2.0, 380.0]).taken();
    for (said, why) in [
        ("apriltag:6x4:tag36h11:24:7.2:opencv", "a board of 5 columns of tags"),
        ("apriltag:5x3:tag36h11:24:7.2:opencv", "larger than"),
        ("apriltag:5x4:tag36h11:24:9:opencv", "gaps of about 7.2"),
    ] {
        let reason = refusal(&picture, said);
        assert!(reason.contains(why), "{said}: {reason}");
    }
}

/// A picture in which each of some tags takes the place of the next, or is shifted.
fn moved(picture: &Picture, truth: &[Point2<f64>], tags: &[(usize, usize)], shift_px: f64) -> Picture {
    let board: Board = GRID.parse().unwrap();
    let at = |(x, y): (usize, usize)| {
        nalgebra::center(&truth[board.index(2 * x, 2 * y)], &truth[board.index(2 * x + 1, 2 * y + 1)])
    };
    let half = 0.6 * (truth[1] - truth[0]).norm();
    with_pixels(picture, |image, x, y| {
        let p = Point2::new(x as f64, y as f64);
        let from = tags
            .iter()
            .position(|tag| (p - at(*tag)).amax() < half)
            .map_or(p, |k| p + (at(tags[(k + 1) % tags.len()]) - at(tags[k])) - nalgebra::Vector2::new(shift_px, 0.0));
        image.pixels[from.y.round() as usize * image.width + from.x.round() as usize]
    })
}

#[test]
fn tags_that_were_moved_give_no_corner_another_number() {
    let (picture, truth) = Shot::of(GRID, [0.0; 3], [3.0, -2.0, 380.0]).taken();
    let all = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 0), (0, 2), (1, 3), (2, 0), (3, 1), (4, 2), (0, 1), (1, 2)];
    for count in [2, 3, 6, 12] {
        let other = moved(&picture, &truth, &all[..count], 0.0);
        match corners_in(&other, GRID.parse().unwrap()) {
            Ok(_) => assert!(measured(GRID, &other, &truth).0 >= 20, "{count}"),
            Err(refusal) => assert!(refusal.reason.contains("another order"), "{count}: {}", refusal.reason),
        }
    }
    // One that lies beside its place by a quarter of itself.
    let other = moved(&picture, &truth, &all[..1], 0.25 * (truth[1] - truth[0]).norm());
    assert!(measured(GRID, &other, &truth).0 >= 70);
}

#[test]
fn two_grids_with_the_same_tags_are_named() {
    let [left, right] = [-80.0, 80.0].map(|x| Shot::of(GRID, [0.1, 0.1, 0.1], [x, 0.0, 700.0]).taken().0);
    let both = with_pixels(&left, |image, x, y| {
        let side = if x < image.width / 2 { image } else { eight_bits(&right) };
        side.pixels[y * image.width + x]
    });
    let reason = refusal(&both, GRID);
    assert!(reason.contains("two boards"), "{reason}");
}
