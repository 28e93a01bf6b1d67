//! A second board that should show the scale.

use nalgebra::Vector3;
use stereocal::geometry::{Transform, transform};
use stereocal::imaging::Board;

use super::set::{Plan, Second, Set};
use super::{Case, Right, case};

/// A set with a second board of other pitch, seen by the rig after it moved.
fn with_second(seed: u64, px: u32, typed: Board, true_share: f64, moved: Transform) -> Set {
    let mut set = Plan::usual(seed, px).set();
    let mut plan = Plan::usual(seed + 50, px).pairs(4);
    plan.settings.check_board = typed;
    plan.settings.check_workmanship.scale_ppm = 1e6 * (true_share - 1.0);
    let mut pairs = plan.set().pairs;
    for pair in &mut pairs {
        pair.sides[1].camera_from_board = moved * pair.sides[1].camera_from_board;
    }
    set.second = Some(Second { pairs, typed });
    set
}

fn board(squares: &str, square_mm: f64) -> Board {
    Board::checker(squares.parse().expect("a board"), square_mm)
}

pub fn cases() -> Vec<Case> {
    let mut list = Vec::new();
    let still = Transform::identity();
    for (squares, mm) in [("20x20", 10.0), ("12x9", 15.0)] {
        list.push(case("second board", "right", squares, Right::Clean, move |seed, px| {
            with_second(seed, px, board(squares, mm), 1.0, still)
        }));
    }
    // The larger its pitch in truth, the smaller the rig's scale by it: the rig's own board may be the wrong one, so no
    // pass.
    for percent in [0.05, 0.2, 0.5, 1.0, 5.0] {
        list.push(Case {
            right: Right::Truth,
            ..case("second board", "pitch", format!("{percent} %"), Right::Truth, move |seed, px| {
                let mut set = with_second(seed, px, board("12x9", 15.0), 1.0 + percent / 100.0, still);
                // By the second board, which is the witness.
                set.scale = 1.0;
                set.rig.right_from_left.translation.vector /= 1.0 + percent / 100.0;
                set
            })
            .also_large()
        });
    }
    for deg in [0.02, 0.2, 1.0] {
        list.push(case("second board", "camera turned since", format!("{deg} deg"), Right::Truth, move |seed, px| {
            let moved = transform(Vector3::new(0.0, f64::to_radians(deg), 0.0), Vector3::zeros());
            let mut set = with_second(seed, px, board("12x9", 15.0), 1.0, moved);
            set.rig.right_from_left = moved * set.rig.right_from_left;
            set
        }));
    }
    list
}
