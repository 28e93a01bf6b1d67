//! Boards that are not one board, or not what the model takes a board for.

use stereocal::simulate::physical_board::{PhysicalBoard, Warp, Workmanship};

use super::set::Plan;
use super::{Case, Right, case};

pub fn cases() -> Vec<Case> {
    let mut list = others();
    list.extend(bent());
    list.extend(print());
    list.extend(growth());
    list
}

fn remade(of: &PhysicalBoard, seed: u64, index: u64, change: impl Fn(&mut Workmanship)) -> PhysicalBoard {
    let mut workmanship = of.workmanship;
    change(&mut workmanship);
    PhysicalBoard::new(of.drawing, workmanship, seed, index)
}

/// Another board in some pairs.
fn others() -> Vec<Case> {
    let pitch = |percent: f64, count: usize| {
        case("another board", "pitch", format!("{percent} % in {count} of 12"), Right::Truth, move |seed, px| {
            Plan::usual(seed, px)
                .set()
                .reboard(4..4 + count, |_, board| remade(board, seed, 0, |made| made.scale_ppm = 1e4 * percent))
        })
    };
    let print = |um: f64| {
        case("another board", "print", format!("{um} um in 4 of 12"), Right::Truth, move |seed, px| {
            let set = Plan::usual(seed, px).set();
            set.reboard(4..8, |_, board| remade(board, seed, 9, |made| made.pitch_um = um))
        })
    };
    let bowed = |um: f64| {
        case("another board", "bowed", format!("{um} um in 4 of 12"), Right::Truth, move |seed, px| {
            let set = Plan::usual(seed, px).set();
            set.reboard(4..8, |_, board| remade(board, seed, 0, |made| made.bow_um = (um, um)))
        })
    };
    vec![
        pitch(0.05, 4),
        pitch(0.2, 4),
        pitch(1.0, 4),
        pitch(0.2, 1),
        print(10.0),
        print(50.0),
        bowed(100.0),
        bowed(300.0),
    ]
}

/// A board that is not flat. Its lengths are judged against a flat one: the written rig is what counts.
fn bent() -> Vec<Case> {
    let warped = |name, um: f64, warp: Warp| {
        case("board shape", name, format!("{um} um"), Right::Truth, move |seed, px| {
            Plan::usual(seed, px).set().reboard(0..12, |_, board| {
                let mut board = board.clone();
                board.warp = warp;
                board
            })
        })
    };
    let bowed = |um: f64| {
        case("board shape", "bow", format!("{um} um"), Right::Truth, move |seed, px| {
            let mut plan = Plan::usual(seed, px);
            plan.settings.check_workmanship.bow_um = (um, 0.6 * um);
            plan.set()
        })
    };
    let mut list = vec![bowed(50.0), bowed(200.0)];
    for um in [20.0, 50.0, 200.0, 500.0] {
        list.push(warped("S", um, Warp { s_um: um, ..Warp::default() }));
        list.push(warped("twist", um, Warp { twist_um: um, ..Warp::default() }));
    }
    list
}

/// Print that is less exact than a certificate would have it.
fn print() -> Vec<Case> {
    let scattered = |um: f64, right| {
        case("board print", "scatter", format!("{um} um"), right, move |seed, px| {
            let mut plan = Plan::usual(seed, px);
            plan.settings.check_workmanship.pitch_um = um;
            plan.set()
        })
    };
    let ink = |um: f64| {
        case("board print", "ink spread", format!("{um} um"), Right::Pass, move |seed, px| {
            let mut plan = Plan::usual(seed, px);
            plan.settings.check_workmanship.ink_spread_um = um;
            plan.set()
        })
    };
    vec![
        scattered(5.0, Right::Pass),
        scattered(30.0, Right::Truth),
        scattered(100.0, Right::Truth),
        ink(20.0),
        ink(100.0),
    ]
}

/// Boards that grow as they warm up.
fn growth() -> Vec<Case> {
    let growing = |ppm: f64| {
        case("board growth", "over the series", format!("{ppm} ppm"), Right::Truth, move |seed, px| {
            let set = Plan::usual(seed, px).set();
            set.reboard(0..12, |k, board| remade(board, seed, 0, |made| made.scale_ppm = ppm * k as f64 / 11.0))
        })
    };
    // Nothing in the data shows a growth that all pairs share: the rig is judged in the board's own millimetres.
    let grown = |ppm: f64| {
        case("board growth", "before the series", format!("{ppm} ppm"), Right::Pass, move |seed, px| {
            let mut plan = Plan::usual(seed, px);
            plan.settings.check_workmanship.scale_ppm = ppm;
            let mut set = plan.set();
            set.rig.right_from_left.translation.vector /= 1.0 + 1e-6 * ppm;
            set
        })
    };
    vec![growing(35.0), growing(200.0), growing(1000.0), grown(100.0)]
}
