//! Boards from 4x4 to 30x40 squares.

use super::set::Plan;
use super::{Case, Right, case};

pub fn cases() -> Vec<Case> {
    let of = |squares: &'static str, square_mm: f64, right| {
        case("board size", squares, "", right, move |seed, px| {
            Plan::usual(seed, px).board(squares, square_mm).pairs(16).set()
        })
    };
    vec![
        of("4x4", 40.0, Right::Truth),
        of("5x4", 35.0, Right::Truth),
        of("6x4", 30.0, Right::Pass),
        of("5x5", 30.0, Right::Pass),
        of("7x6", 25.0, Right::Pass),
        of("7x7", 25.0, Right::Pass),
        of("10x7", 18.0, Right::Pass),
        of("30x40", 4.5, Right::Pass),
        of("40x30", 4.5, Right::Pass).also_large(),
    ]
}
