//! Plain boards that the picture's border or a hand cuts: a corner never gets another's number.

use nalgebra::Point2;

use crate::imaging::find::seen_in;
use crate::imaging::image::Picture;
use crate::imaging::input::cache::Sighting;
use crate::imaging::lattice::{Lattice, Places};
use crate::imaging::shot::{Shot, with_pixels};
use crate::imaging::{Board, Corner};

/// What became of pictures of cut boards.
#[derive(Default, Debug)]
struct Tally {
    whole: usize,
    numbered: usize,
    open: usize,
    refused: usize,
}

/// How far a measured corner lies at most from where its number says, in steps of the grid, in the best of the
/// numberings that the board's looks leave open.
fn farthest(board: &Board, corners: &Lattice<Corner>, truth: &Places) -> f64 {
    let step_px = truth.least_step_px().unwrap();
    let off = |quarters: usize| {
        let truth = truth.turned(quarters);
        let measured = corners.iter().filter(|(_, _, corner)| corner.used);
        measured.map(|(col, row, c)| (truth.get(col, row).unwrap() - c.px).norm() / step_px).fold(0.0, f64::max)
    };
    board.turns_left_open().into_iter().map(off).fold(f64::INFINITY, f64::min)
}

/// Looks at a picture: no wrong number, and the right one among those that are left open.
fn look(board: &Board, picture: &Picture, truth: &[Point2<f64>], what: &str, tally: &mut Tally) {
    /// Other numbers are a step off.
    const RIGHT: f64 = 0.4;
    let truth = Lattice::from_fn(board.columns(), board.rows(), |col, row| Some(truth[board.index(col, row)]));
    match seen_in(picture, *board) {
        Err(_) => tally.refused += 1,
        Ok(Sighting { corners, open: None, .. }) => {
            let off = farthest(board, &corners, &truth);
            assert!(off < RIGHT, "{what}: off by {off} squares");
            *if corners.count() == board.corner_count() { &mut tally.whole } else { &mut tally.numbered } += 1;
        }
        Ok(Sighting { corners, open: Some(open), .. }) => {
            let size = (board.columns(), board.rows());
            let others = open.others.iter().map(|other| corners.renumbered(other, size).unwrap());
            let off: Vec<f64> =
                std::iter::once(corners.clone()).chain(others).map(|way| farthest(board, &way, &truth)).collect();
            assert!(off.iter().filter(|off| **off < RIGHT).count() == 1, "{what}: {off:?}");
            tally.open += 1;
        }
    }
}

const BOARDS: [&str; 4] = ["checker:9x7:20", "checker:10x7:20", "checker:8x8:18", "checker:7x7:20"];
const TURNS: [[f64; 3]; 3] = [[-0.5, 0.5, 0.2], [0.0, 0.0, 0.0], [0.7, -0.4, 1.1]];

#[test]
fn a_board_cut_by_borders_has_no_wrong_number() {
    let mut tally = Tally::default();
    for (first, board) in BOARDS.into_iter().enumerate() {
        let places = [(-140.0, 0.0), (110.0, 60.0), (-90.0, -80.0), (60.0, 90.0), (70.0, 0.0), (-40.0, 45.0)];
        // Each place with one of the turns, another one for the next board.
        let turns = TURNS.into_iter().cycle().skip(first);
        for (k, ((x, y), turn)) in places.into_iter().zip(turns).enumerate() {
            let z = [250.0, 420.0][(k + first) % 2];
            let (picture, truth) = Shot::of(board, turn, [x * z / 420.0, y * z / 420.0, z]).taken();
            look(&board.parse().unwrap(), &picture, &truth, &format!("{board} {x} {y} {z} {turn:?}"), &mut tally);
        }
    }
    assert!(tally.numbered > 3 && tally.open > 3, "{tally:?}");
}

#[test]
fn a_board_behind_a_hand_has_no_wrong_number() {
    let mut tally = Tally::default();
    for board in [BOARDS[0], BOARDS[2]] {
        for (k, (z, turn)) in [(420.0, TURNS[0]), (560.0, TURNS[2])].into_iter().enumerate() {
            // The nearer one is cut by the border as well.
            let x = [-70.0, 5.0][k];
            let (picture, truth) = Shot { seed: k as u64, ..Shot::of(board, turn, [x, 3.0, z]) }.taken();
            let board: Board = board.parse().unwrap();
            let (first, last) = (truth[0], truth[board.index(board.columns() - 1, board.rows() - 1)]);
            for (share, grey) in [(0.25, 90), (0.5, 190)] {
                // From the first corner's side along the columns, or from the last one's aslant.
                for (along, ahead) in [(truth[board.columns() - 1] - first, true), (last - first, false)] {
                    let hidden = with_pixels(&picture, |image, x, y| {
                        let at = (Point2::new(x as f64, y as f64) - first).dot(&along) / along.norm_squared();
                        let covers = if ahead { at < share } else { at > 1.0 - share };
                        if covers { grey } else { image.pixels[y * image.width + x] }
                    });
                    let what = format!("{board} {k} {x} {share} {grey} {along} {ahead}");
                    look(&board, &hidden, &truth, &what, &mut tally);
                }
            }
        }
    }
    assert!(tally.open > 5, "{tally:?}");
}

#[test]
fn a_finger_over_border_squares_hides_no_line_of_corners() {
    let mut tally = Tally::default();
    let mut pictures = 0;
    for board in [BOARDS[0], BOARDS[2]] {
        let (picture, truth) = Shot::of(board, TURNS[0], [0.0, 0.0, 420.0]).taken();
        let board: Board = board.parse().unwrap();
        let (columns, rows) = (board.columns(), board.rows());
        let at = |col: usize, row: usize| truth[board.index(col, row)];
        // In the outer square beside a corner of each border: outwards by half a step, and as long as it takes to hide
        // half of the border's corners.
        let sides = [
            (at(0, rows / 2), at(1, rows / 2), rows),
            (at(columns - 1, rows / 2), at(columns - 2, rows / 2), rows),
            (at(columns / 2, 0), at(columns / 2, 1), columns),
            (at(columns / 2, rows - 1), at(columns / 2, rows - 2), columns),
        ];
        for (corner, inner, count) in sides {
            for (long, grey) in [(0.12, 150), (0.18, 110), (0.24, 150)] {
                let outwards = corner - inner;
                let (middle, long) = (corner + outwards * 0.4, long * count as f64);
                let hidden = with_pixels(&picture, |image, x, y| {
                    let off = (Point2::new(x as f64, y as f64) - middle) / outwards.norm();
                    let (out, beside) = (off.dot(&outwards) / outwards.norm(), off.perp(&outwards) / outwards.norm());
                    let covers = (out / 0.6).powi(2) + (beside / long).powi(2) < 1.0;
                    if covers { grey } else { image.pixels[y * image.width + x] }
                });
                pictures += 1;
                look(&board, &hidden, &truth, &format!("{board} {corner} {long}"), &mut tally);
            }
        }
    }
    // One of the pictures is still refused, with a reason, and not numbered wrongly.
    assert!(tally.whole + tally.numbered + 1 >= pictures, "{tally:?}");
}
