//! Rigs that moved during the series, and pairs whose pictures are of two moments.

use nalgebra::Vector3;
use stereocal::geometry::{Transform, transform};

use super::set::{Plan, Set};
use super::{Case, Right, case};

fn shift(x_mm: f64, y_mm: f64, z_mm: f64) -> Transform {
    transform(Vector3::zeros(), Vector3::new(x_mm, y_mm, z_mm))
}

/// Turned about the camera's y-axis, or its x-axis, deg.
fn turn(yaw_deg: f64, pitch_deg: f64) -> Transform {
    transform(Vector3::new(pitch_deg.to_radians(), yaw_deg.to_radians(), 0.0), Vector3::zeros())
}

pub fn cases() -> Vec<Case> {
    let mut list = moved();
    list.extend(zoomed());
    list.extend(passing());
    list.extend(out_of_step());
    list.extend(interlaced());
    list
}

/// The right camera stands elsewhere after pair `k` of 12.
fn moved() -> Vec<Case> {
    let moved = |name, k: usize, by: Transform| {
        case("rig moved", name, format!("after {k} of 12"), Right::Truth, move |seed, px| {
            Plan::usual(seed, px).set().right_moves(k..12, by)
        })
    };
    let mut list = vec![
        moved("z 1 mm", 6, shift(0.0, 0.0, 1.0)).also_large(),
        moved("z 0.05 mm", 6, shift(0.0, 0.0, 0.05)),
        moved("yaw 0.005 deg", 6, turn(0.005, 0.0)),
        moved("x 5 mm", 6, shift(5.0, 0.0, 0.0)),
    ];
    for k in [8, 10, 11] {
        list.push(moved("x 0.2 mm", k, shift(0.2, 0.0, 0.0)));
        list.push(moved("z 0.2 mm", k, shift(0.0, 0.0, 0.2)));
        list.push(moved("yaw 0.05 deg", k, turn(0.05, 0.0)));
        list.push(moved("pitch 0.05 deg", k, turn(0.0, 0.05)));
    }
    list
}

/// The right lens is longer after pair `k` of 12.
fn zoomed() -> Vec<Case> {
    let zoomed = |k: usize, by: f64| {
        let size = format!("{:.2} % after {k} of 12", 100.0 * by);
        case("rig moved", "zoom", size, Right::Truth, move |seed, px| {
            let mut set = Plan::usual(seed, px).set();
            set.rig.right.fx *= 1.0 + by;
            set.rig.right.fy *= 1.0 + by;
            let camera = set.rig.right;
            set.pairs_in(k..12, |_, pair| pair.sides[1].camera = camera)
        })
    };
    vec![zoomed(6, 0.001), zoomed(10, 0.001), zoomed(6, 0.0001), zoomed(9, 0.01)]
}

/// Moved and back again, and moving all the time.
fn passing() -> Vec<Case> {
    let back = |by_mm: f64| {
        case("rig moved", "and back, pairs 5 to 7", format!("{by_mm} mm"), Right::Truth, move |seed, px| {
            Plan::usual(seed, px).set().right_moves(4..7, shift(by_mm, 0.0, 0.0))
        })
    };
    let drift = |by_mm: f64| {
        case("rig moved", "a little each pair", format!("{by_mm} mm"), Right::Truth, move |seed, px| {
            let mut set = Plan::usual(seed, px).set();
            for k in 0..12 {
                set = set.right_moves(k..12, shift(by_mm, 0.0, 0.0));
            }
            set
        })
    };
    vec![back(0.2), back(0.03), drift(0.005), drift(0.02)]
}

fn out_of_step() -> Vec<Case> {
    // The board moves between the left and the right picture.
    fn moved(set: Set, pairs: std::ops::Range<usize>, by_mm: f64, by_deg: f64) -> Set {
        let right_from_left = set.rig.right_from_left;
        set.pairs_in(pairs, |k, pair| {
            let about = k as f64 * 2.1;
            let direction = Vector3::new(about.cos(), about.sin(), 0.3);
            let on_the_spot = transform(direction * by_deg.to_radians(), Vector3::zeros());
            let left_from_board = shift(by_mm * direction.x, by_mm * direction.y, by_mm * direction.z)
                * pair.sides[0].camera_from_board
                * on_the_spot;
            pair.sides[1].camera_from_board = right_from_left * left_from_board;
        })
    }
    let case_of = |count: usize, mm: f64, deg: f64| {
        case("out of step", "pairs", format!("{count} by {mm} mm, {deg} deg"), Right::Truth, move |seed, px| {
            moved(Plan::usual(seed, px).set(), 3..3 + count, mm, deg)
        })
    };
    vec![
        case_of(1, 0.05, 0.0),
        case_of(1, 0.5, 0.0),
        case_of(2, 0.2, 0.0),
        case_of(2, 1.0, 0.0),
        case_of(2, 0.0, 0.1),
        case_of(2, 5.0, 2.0),
        case_of(9, 0.2, 0.0),
    ]
}

/// Odd rows are read later, while the board moves.
fn interlaced() -> Vec<Case> {
    let case_of = |count: usize, mm: f64| {
        case("out of step", "interlaced", format!("{count} pairs, {mm} mm"), Right::Truth, move |seed, px| {
            Plan::usual(seed, px).set().pairs_in(0..count, |_, pair| {
                for side in &mut pair.sides {
                    side.odd_rows = Some(shift(mm, 0.0, 0.0) * side.camera_from_board);
                }
            })
        })
    };
    vec![case_of(1, 1.0), case_of(2, 0.2), case_of(12, 0.1), case_of(12, 0.5), case_of(12, 2.0)]
}
