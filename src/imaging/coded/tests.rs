//! Boards with markers, rendered: every corner that is found has its own number, lies where it should as surely as it
//! says, and another board is named.

use nalgebra::{Point2, Vector3};

use super::{HAS_TAGS, measures, of_other_kind};
use crate::imaging::Board;
use crate::imaging::detect::{Refusal, detect};
use crate::imaging::find::corners_in;
use crate::imaging::image::Picture;
use crate::imaging::refine::refine;
use crate::imaging::shot::{Shot, eight_bits, with_pixels};

/// How many corners are measured, and their mean square deviation in their own sigmas.
fn measured(name: &str, picture: &Picture, truth: &[Point2<f64>]) -> (usize, f64) {
    let board: Board = name.parse().unwrap();
    let corners = corners_in(picture, board).unwrap();
    let (mut count, mut sum) = (0, 0.0);
    for (col, row, corner) in corners.iter() {
        let off = corner.px - truth[board.index(col, row)];
        // What was seen roughly only is off by less than a tenth of a square, and says so; what was measured by far
        // less.
        let limit_px = if corner.covariance_px2.is_some() { 1.0 } else { 7.0 };
        assert!(off.norm() < limit_px, "{name}: corner {col},{row} is off by {off}");
        if let Some(covariance) = corner.covariance_px2 {
            (count, sum) = (count + 1, sum + off.dot(&(covariance.try_inverse().unwrap() * off)) / 2.0);
        }
    }
    (count, sum / f64::from(count.max(1) as u32))
}

const BOARD: &str = "charuco:9x7:20:14:DICT_5X5_100";
const TAGS: &str = "apriltag:5x4:tag36h11:24:7.2";

#[test]
fn boards_are_measured_whole_from_every_side_and_in_both_colours() {
    // The means of 384 and of 640 squares: chance takes them from 0.8 to 1.2.
    for (board, corners, last_inverted) in [(BOARD, 48, true), (TAGS, 80, false)] {
        let mut sum = 0.0;
        for (quarter, inverted) in [(0, false), (1, true), (2, false), (3, last_inverted)] {
            let turn = [0.3, -0.25, 0.2 + f64::from(quarter) * 1.6];
            let (picture, truth) = Shot { inverted, ..Shot::of(board, turn, [3.0, -2.0, 560.0]) }.taken();
            let (count, chi2) = measured(board, &picture, &truth);
            assert!(count == corners && chi2 < 1.4, "{board} {quarter}: {count} of {corners} corners, {chi2}");
            sum += chi2 / 4.0;
        }
        assert!((0.8..1.2).contains(&sum), "{board}: {sum}");
    }
}

#[test]
fn parts_of_a_board_have_their_own_numbers() {
    for (board, range) in [(BOARD, 4..48), (TAGS, 8..80)] {
        for (x, y) in [(-140.0, 0.0), (110.0, 60.0), (-90.0, -80.0), (60.0, 90.0)] {
            let (picture, truth) = Shot::of(board, [0.4, 0.3, 0.5], [x, y, 420.0]).taken();
            // Every corner that is found lies where its number says.
            let (count, _) = measured(board, &picture, &truth);
            assert!(range.contains(&count), "{board} {x} {y}: {count} corners");
        }
    }
}

/// The squared deviations of a picture's measured corners from the nearest true ones, in their own variances, an axis.
fn squares(shot: Shot) -> Vec<f64> {
    let (picture, truth) = shot.taken();
    // Whatever their numbers are: those of a plain board that is cut may be open.
    let Ok(detected) = detect(&picture, shot.board.parse().unwrap()) else { return Vec::new() };
    let corners = refine(&picture, &detected);
    let one = |corner: &crate::imaging::Corner| {
        let nearest = truth.iter().map(|at| corner.px - at).min_by(|a, b| a.norm().total_cmp(&b.norm()))?;
        Some(nearest.dot(&(corner.covariance_px2?.try_inverse()? * nearest)) / 2.0)
    };
    corners.iter().filter_map(|(_, _, corner)| one(corner)).collect()
}

#[test]
fn parts_cut_by_the_border_are_as_certain_as_they_say() {
    let turns = [[0.4, 0.3, 0.5], [0.7, -0.4, 1.1]];
    let coded = [(-140.0, 0.0), (110.0, 60.0), (-90.0, -80.0), (60.0, 90.0), (70.0, 0.0), (-40.0, 45.0)];
    // Of a plain board most has to be seen.
    let plain = [(70.0, 0.0), (-40.0, 45.0)];
    for (board, places) in [(BOARD, &coded[..]), ("checker:9x7:20", &plain[..])] {
        // Squares of 125, 74 and 52 px, and lenses that bend lines not at all, as the paper's do, and more than a row
        // of squares tells.
        for (z, bent) in [(250.0, 0.0), (420.0, 1.0), (600.0, -4.0)] {
            let mut all: Vec<f64> = Vec::new();
            for (k, (turn, (x, y))) in turns.iter().flat_map(|turn| places.iter().map(|at| (*turn, at))).enumerate() {
                let place = [x * z / 420.0, y * z / 420.0, z];
                all.extend(squares(Shot { bent, seed: 100 + k as u64, ..Shot::of(board, turn, place) }));
            }
            let count = all.len() as f64;
            let mean = all.iter().sum::<f64>() / count;
            // By chance one of a thousand.
            let far = all.iter().filter(|square| **square > 7.0).count() as f64;
            assert!(count > 30.0 && mean < 1.4 && far < 0.02 * count + 2.0, "{board} {z} {bent}: {count} {mean} {far}");
        }
    }
}

/// Why a picture holds no board that was `said`.
fn refusal(picture: &Picture, said: &str) -> String {
    refused(picture, said).reason
}

fn refused(picture: &Picture, said: &str) -> Refusal {
    corners_in(picture, said.parse().unwrap()).map(|corners| corners.count()).expect_err(said)
}

#[test]
fn the_board_that_it_is_comes_with_the_reason() {
    let (picture, _) = Shot::of(BOARD, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]).taken();
    let board = |name: &str| Some(name.parse::<Board>().unwrap());
    let shown = refused(&picture, "charuco:9x7:20:14:DICT_6X6_100").seen.unwrap();
    assert!(board(BOARD).unwrap().has_all_of(&shown) || shown.has_all_of(&board(BOARD).unwrap()), "{shown}");
    for said in ["7x9", "10x7", "9x6", "10x8", "8x6"] {
        assert_eq!(refused(&picture, &BOARD.replace("9x7", said)).seen, board(BOARD), "{said}");
    }
}

#[test]
fn the_size_that_is_printed_is_told_whatever_was_asked_for() {
    for inverted in [false, true] {
        let shot = Shot { inverted, ..Shot::of(BOARD, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]) };
        let (picture, _) = shot.taken();
        for said_mm in [10.0, 11.0, 12.4, 15.6, 16.5, 18.0] {
            let asked = BOARD.parse::<Board>().unwrap().with_marked_mm(said_mm).unwrap();
            let seen = refused(&picture, &asked.to_string()).seen.unwrap();
            let seen_mm = measures::other_size_mm(&asked, &seen).unwrap();
            assert!((seen_mm - 14.0).abs() < 0.4, "{inverted} {said_mm}: {seen_mm}");
        }
        // By so much markers bleed and printers stretch.
        assert!(corners_in(&picture, BOARD.replace(":14:", ":14.5:").parse().unwrap()).is_ok());
    }
    let (picture, _) = Shot::of(TAGS, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]).taken();
    for said in ["6", "8.4"] {
        let asked: Board = TAGS.replace(":7.2", &format!(":{said}")).parse().unwrap();
        let seen_mm = measures::other_size_mm(&asked, &refused(&picture, &asked.to_string()).seen.unwrap()).unwrap();
        assert!((seen_mm - 7.2).abs() < 0.15, "{said}: {seen_mm}");
    }
}

#[test]
fn a_grid_of_tags_is_told_whatever_its_gaps_are() {
    let plain: Board = "checker:20x20:10".parse().unwrap();
    let charuco: Board = "charuco:5x4:30:22:DICT_4X4_50".parse().unwrap();
    for (board, family) in [
        (TAGS, Some("tag36h11")),
        ("apriltag:4x3:tag25h9:30:7.5", Some("tag25h9")),
        ("apriltag:4x3:tag25h9:30:6:opencv", Some("tag25h9")),
        ("apriltag:4x3:tag25h9:30:15:opencv", Some("tag25h9")),
        ("aruco:4x3:DICT_6X6_250:30:7.5", Some("DICT_6X6_50")),
        ("aruco:4x3:DICT_4X4_50:30:6", Some("DICT_4X4_50")),
        ("checker:9x7:20", None),
    ] {
        let (picture, _) = Shot::of(board, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]).taken();
        for asked in [plain, charuco] {
            assert_eq!(of_other_kind(&picture, &asked), family.map(|family| format!("{HAS_TAGS}{family}")), "{board}");
        }
    }
    // Markers in squares are no grid, also where their board is not the one that is looked for.
    for board in [BOARD, "charuco:6x5:30:18:DICT_4X4_50", "charuco:6x5:30:24:DICT_4X4_50"] {
        let (picture, _) = Shot::of(board, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]).taken();
        assert_eq!(of_other_kind(&picture, &charuco), None, "{board}");
    }
}

#[test]
fn another_board_is_named() {
    let plain = "checker:9x7:20";
    let others = [
        (BOARD, "charuco:9x7:20:14:DICT_6X6_100", "DICT_5X5_"),
        (BOARD, "charuco:7x9:20:14:DICT_5X5_100", "board of 9 columns"),
        (BOARD, "charuco:10x7:20:14:DICT_5X5_100", "board of 9 columns"),
        (BOARD, "charuco:9x6:20:14:DICT_5X5_100", "larger than 9x6"),
        (BOARD, "charuco:9x7:20:11:DICT_5X5_100", "markers of"),
        (BOARD, "charuco:9x7:20:17:DICT_5X5_100", "markers of"),
        (BOARD, TAGS, "board with markers of DICT_5X5_"),
        (TAGS, "apriltag:5x4:tag25h9:24:7.2", "markers of tag36h11"),
        (TAGS, "apriltag:4x4:tag36h11:24:7.2", "board of 5 columns"),
        (TAGS, "apriltag:6x4:tag36h11:24:7.2", "board of 5 columns"),
        (TAGS, "apriltag:5x3:tag36h11:24:7.2", "larger than 5x3"),
        (TAGS, "apriltag:5x4:tag36h11:24:6", "gaps of about 7."),
        (TAGS, "apriltag:5x4:tag36h11:24:8.4", "gaps of about 7."),
        (TAGS, "apriltag:5x4:tag36h11:24:7.35", "gaps of about 7.2"),
        (TAGS, "apriltag:5x4:tag36h11:24:7.05", "gaps of about 7."),
        (TAGS, BOARD, "grid of tags of tag36h11"),
        (plain, BOARD, "no marker"),
        (plain, TAGS, "no "),
    ];
    for others in others.chunk_by(|a, b| a.0 == b.0) {
        let shown = others[0].0;
        let (picture, _) = Shot::of(shown, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]).taken();
        for (_, said, why) in others {
            let reason = refusal(&picture, said);
            assert!(reason.contains(why), "{shown} as {said}: {reason}");
        }
        if shown != plain {
            let mirrored = with_pixels(&picture, |image, x, y| image.pixels[(y + 1) * image.width - 1 - x]);
            let reason = refusal(&mirrored, shown);
            assert!(reason.contains("mirrored"), "{reason}");
        }
    }
}

#[test]
fn counts_that_were_said_in_the_wrong_order_are_named_as_they_are() {
    for (shown, said) in [
        (BOARD, "charuco:7x9:20:14:DICT_5X5_100"),
        (TAGS, "apriltag:4x5:tag36h11:24:7.2"),
        ("apriltag:5x4:tag36h11:24:7.2:opencv", "apriltag:4x5:tag36h11:24:7.2:opencv"),
    ] {
        let (picture, _) = Shot::of(shown, [0.3, -0.25, 0.2], [3.0, -2.0, 480.0]).taken();
        let refusal = refused(&picture, said);
        let seen = refusal.seen.unwrap_or_else(|| panic!("{said}: {}", refusal.reason));
        assert_eq!(seen.squares, shown.parse::<Board>().unwrap().squares, "{said}: {}", refusal.reason);
    }
}

#[test]
fn a_plain_board_is_counted_where_markers_were_looked_for() {
    let plain = "checker:9x7:20";
    let (picture, _) = Shot::of(plain, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]).taken();
    for (said, seen) in [
        ("charuco:10x7:20:14:DICT_5X5_100", Some("checker:9x7:20")),
        (TAGS, Some("checker:9x7:24")),
        (BOARD, None),
        ("charuco:7x9:20:14:DICT_5X5_100", None),
    ] {
        let refusal = refused(&picture, said);
        assert!(
            refusal.reason.starts_with("shows a board of 9x7 squares, and no marker"),
            "{said}: {}",
            refusal.reason
        );
        assert_eq!(refusal.seen, seen.map(|seen| seen.parse().unwrap()), "{said}");
    }
}

#[test]
fn the_other_layout_is_named_or_leaves_no_number() {
    for (shown, said) in [("new", "old"), ("old", "new")] {
        for size in ["8x6", "9x8"] {
            let [shown, said] = [shown, said].map(|layout| format!("charuco:{size}:20:14:DICT_5X5_100:{layout}"));
            let (picture, _) = Shot::of(shown.clone().leak(), [0.3, -0.25, 0.2], [3.0, -2.0, 620.0]).taken();
            let reason = refusal(&picture, &said);
            assert!(reason.contains("layout"), "{shown} as {said}: {reason}");
            let open = shown.trim_end_matches(":new").trim_end_matches(":old");
            assert!(corners_in(&picture, open.parse().unwrap()).is_ok(), "{open}");
        }
    }
}

#[test]
fn two_boards_with_the_same_markers_are_named() {
    // Side by side; and half of each, the second five and a half squares beside the first.
    for (x, z) in [(140.0, 1100.0), (55.0, 700.0)] {
        let [left, right] = [-x, x].map(|x| Shot::of(BOARD, [0.1, 0.1, 0.1], [x, 0.0, z]).taken().0);
        let both = with_pixels(&left, |image, x, y| {
            let side = if x < image.width / 2 { image } else { eight_bits(&right) };
            side.pixels[y * image.width + x]
        });
        let reason = refusal(&both, BOARD);
        assert!(reason.contains("two boards"), "{z}: {reason}");
    }
}

#[test]
fn what_is_left_of_a_torn_board_is_measured() {
    let shot = Shot::of(BOARD, [0.3, -0.25, 0.2], [3.0, -2.0, 560.0]);
    let (picture, truth) = shot.taken();
    let whole: Board = BOARD.parse().unwrap();
    // From the first corner on, so many squares.
    for squares in [0.6, 1.6, 3.3] {
        let (at, along) = (truth[0], truth[whole.index(1, 0)] - truth[0]);
        let torn = with_pixels(&picture, |image, x, y| {
            let beyond =
                (Point2::new(x as f64, y as f64) - at).dot(&(along + Vector3::z().cross(&along.push(0.0)).xy()));
            if beyond < squares * along.norm_squared() { 120 } else { image.pixels[y * image.width + x] }
        });
        let (count, chi2) = measured(BOARD, &torn, &truth);
        assert!((20..48).contains(&count) && (0.5..1.6).contains(&chi2), "{squares}: {count} corners, {chi2}");
    }
}

#[test]
fn markers_that_were_moved_give_no_corner_another_number() {
    let (picture, truth) = Shot::of(BOARD, [0.0; 3], [3.0, -2.0, 560.0]).taken();
    let board: Board = BOARD.parse().unwrap();
    let middle =
        |col: usize, row: usize| nalgebra::center(&truth[board.index(col, row)], &truth[board.index(col + 1, row + 1)]);
    let half = 0.42 * (truth[1] - truth[0]).norm();
    // Squares after these corners hold markers; each takes the one of the next.
    let places = [(0, 1), (2, 1), (4, 1), (1, 2), (3, 2), (5, 2), (0, 3), (2, 3), (4, 3), (1, 4), (3, 4), (5, 4)];
    for moved in [2, 6, 12] {
        let moved = &places[..moved];
        let other = with_pixels(&picture, |image, x, y| {
            let p = Point2::new(x as f64, y as f64);
            let into = |&(c, r): &(usize, usize)| (p - middle(c, r)).amax() < half;
            let from = moved.iter().position(into).map_or(p, |k| {
                let next = moved[(k + 1) % moved.len()];
                p + (middle(next.0, next.1) - middle(moved[k].0, moved[k].1))
            });
            image.pixels[from.y.round() as usize * image.width + from.x.round() as usize]
        });
        match corners_in(&other, board) {
            Ok(_) => assert!(measured(BOARD, &other, &truth).0 > 20),
            Err(refusal) => assert!(refusal.reason.contains("another order"), "{moved:?}: {}", refusal.reason),
        }
    }
}

#[test]
fn foreshortened_boards_are_measured() {
    let wide = "charuco:9x7:20:15:DICT_4X4_100";
    let tall = "charuco:8x11:24:18.75:DICT_4X4_1000";
    for (board, tilt, spin, z, least, most_chi2) in [
        // Squares three to four times as wide as high: their markers are nearer to the long edges than a marker of a
        // square seen from above.
        (wide, 1.2, 0.1, 300.0, 40, 3.0),
        (wide, 1.2, 0.5, 400.0, 44, 3.0),
        (wide, 1.25, 0.5, 300.0, 40, 3.0),
        (tall, 1.25, 0.1, 400.0, 40, 3.0),
        (tall, 1.3, 0.1, 400.0, 36, 3.0),
        // Small parts, of which no corner strays.
        (tall, 1.15, 0.5, 300.0, 21, f64::INFINITY),
        (tall, 1.2, 0.1, 300.0, 21, f64::INFINITY),
        (tall, 1.2, 0.1, 400.0, 21, f64::INFINITY),
        (tall, 1.2, 0.5, 300.0, 21, f64::INFINITY),
        (wide, 1.25, 0.1, 300.0, 21, f64::INFINITY),
        // At 72 to 76 degrees parts of the board are put together wrongly: every other line, or a diagonal. They are no
        // second board.
        (tall, 1.25, 0.0, 250.0, 5, f64::INFINITY),
        (wide, 1.3, 0.5, 250.0, 5, f64::INFINITY),
        (tall, 1.27, 0.1, 400.0, 5, f64::INFINITY),
        (tall, 1.32, 0.3, 500.0, 5, f64::INFINITY),
        (tall, 1.29, 0.3, 300.0, 5, f64::INFINITY),
    ] {
        let (picture, truth) = Shot::of(board, [tilt, 0.7 * spin, spin], [0.0, 0.0, z]).taken();
        // Every corner that is found lies where its number says.
        let (count, chi2) = measured(board, &picture, &truth);
        assert!(count >= least && chi2 < most_chi2, "{board} {tilt} {spin} {z}: {count} corners, {chi2}");
    }
}

#[test]
fn a_board_with_markers_is_told_from_a_plain_one_that_was_asked_for() {
    let shot = |board: &'static str, at: [f64; 3]| Shot::of(board, [0.3, -0.25, 0.2], at).taken().0;
    for (board, at) in [
        (BOARD, [3.0, -2.0, 560.0]),
        (BOARD, [110.0, 60.0, 420.0]),
        ("charuco:8x11:24:18:DICT_4X4_50", [0.0, 0.0, 800.0]),
    ] {
        let dictionary = board.rsplit(':').next().unwrap();
        let reason = detect(&shot(board, at), "checker:20x20:10".parse().unwrap()).unwrap_err().reason;
        // One that begins alike has the same markers.
        assert!(reason.contains(&format!("markers of {}", &dictionary[..9])), "{board}: {reason}");
    }
    let plain = detect(&shot("checker:9x7:20", [3.0, -2.0, 560.0]), "checker:20x20:10".parse().unwrap());
    assert!(plain.is_err_and(|refusal| !refusal.reason.contains("markers")));
}
