//! Views that tell little: parallel boards, small tilts, few pairs, the same pair again, boards partly out of the
//! picture.

use stereocal::simulate::check_poses::Holding;

use super::set::{Plan, Set};
use super::{Case, Right, case};

fn held(seed: u64, px: u32, count: usize, holding: Holding) -> Plan {
    let plan = Plan::usual(seed, px).pairs(count);
    Plan { holding, ..plan }
}

pub fn cases() -> Vec<Case> {
    let mut list = alike();
    list.extend(few());
    list.extend(partial());
    list
}

fn alike() -> Vec<Case> {
    let tilted = |name, to_deg: f64, count: usize| {
        case("views", name, format!("to {to_deg} deg, {count} pairs"), Right::Truth, move |seed, px| {
            held(seed, px, count, Holding { tilt_deg: (0.0, to_deg), ..Holding::USUAL }).set()
        })
    };
    let one_place = |deg: f64| {
        case("views", "one place and tilt", format!("+- {deg} deg"), Right::Truth, move |seed, px| {
            let holding = Holding {
                tilt_deg: (0.0, deg),
                turn_deg: deg,
                sideways_mm: 1.0,
                depth_mm: (0.0, 1.0),
                upright_deg: 0.0,
            };
            held(seed, px, 12, holding).set()
        })
    };
    vec![
        tilted("parallel boards", 0.0, 12),
        tilted("parallel boards", 0.3, 12),
        tilted("small tilts", 2.0, 12),
        tilted("small tilts", 5.0, 12).also_large(),
        tilted("small tilts", 5.0, 30),
        one_place(0.5),
        one_place(3.0),
    ]
}

fn few() -> Vec<Case> {
    let few = |count: usize| {
        case("views", "few pairs", format!("{count}"), Right::Truth, move |seed, px| {
            Plan::usual(seed, px).pairs(count).set()
        })
    };
    let twice = |count: usize| {
        case("views", "each pair twice", format!("{count} poses"), Right::Truth, move |seed, px| {
            let set = Plan::usual(seed, px).pairs(count).set();
            doubled(set)
        })
    };
    let copies = case("views", "one file four times", "12 poses", Right::Pass, |seed, px| {
        let mut set = Plan::usual(seed, px).set();
        for k in 0..4 {
            let mut copy = set.pairs[2].clone();
            copy.name = format!("copy{k}");
            set.pairs.push(copy);
        }
        set
    });
    vec![few(4), few(5), few(6), twice(4), twice(6), copies]
}

/// Each pair again, with other noise.
fn doubled(mut set: Set) -> Set {
    for k in 0..set.pairs.len() {
        let mut again = set.pairs[k].clone();
        again.name += "b";
        again.sides.iter_mut().for_each(|side| side.number += 1000);
        set.pairs.push(again);
    }
    set
}

/// Boards partly out of the picture.
fn partial() -> Vec<Case> {
    let beyond = |share: f64, count: usize| {
        let size = format!("{count} of 12 by {:.0} %", 100.0 * share);
        case("views", "board beyond the border", size, Right::Pass, move |seed, px| {
            let set = Plan::usual(seed, px).set();
            let right_from_left = set.rig.right_from_left;
            // Moved away from the middle until so much of the board's width is out.
            let field_mm = f64::from(set.rig.left.width) / set.rig.left.fx * set.plan.drawing.distance_mm;
            let board_mm = 2.0 * set.pairs[0].sides[0].board.plate_half_mm().0;
            let by = (field_mm - board_mm) / 2.0 + share * board_mm;
            set.pairs_in(0..count, |k, pair| {
                let mut at = pair.sides[0].camera_from_board;
                let axis = k % 2;
                let sign = if k % 4 < 2 { 1.0 } else { -1.0 };
                at.translation.vector[axis] = sign * by;
                pair.place(at, &right_from_left);
            })
        })
    };
    let one_side = case("views", "one quarter of the picture", "", Right::Truth, |seed, px| {
        let plan = Plan::usual(seed, px).board("10x10", 10.0);
        let set = plan.set();
        let right_from_left = set.rig.right_from_left;
        set.pairs_in(0..12, |_, pair| {
            let mut at = pair.sides[0].camera_from_board;
            at.translation.vector.x -= 55.0;
            at.translation.vector.y -= 55.0;
            pair.place(at, &right_from_left);
        })
    });
    vec![beyond(0.1, 4), beyond(0.3, 6), one_side]
}
