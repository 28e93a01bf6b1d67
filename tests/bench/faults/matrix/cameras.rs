//! Rigs that are built otherwise: rolled, one above the other, unequal, wide, small.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::picture_faults::PictureFault;
use stereocal::simulate::check_poses::Holding;
use stereocal::simulate::rig::RigDrawing;

use super::set::Plan;
use super::{Case, Right, case};

fn rig(name: &'static str, size: &'static str, right: Right, change: fn(&mut Plan, f64)) -> Case {
    case("rig", name, size, right, move |seed, px| {
        let mut plan = Plan::usual(seed, px);
        change(&mut plan, f64::from(px));
        plan.set()
    })
}

/// A lens of 90 degrees and a board of 30 mm squares that fills its picture.
fn wide(plan: &mut Plan, px: f64) {
    let k1 = -0.28;
    // At the middle of the right border x/z is 1: the lens brings it nearer by k1.
    let focal = px / 2.0 / (1.0 + k1 + 0.07);
    plan.drawing = RigDrawing {
        focal_px: [focal, 0.99 * focal],
        distortion: [[k1, 0.07, 2e-4, -3e-4, 0.0], [k1 + 0.01, 0.065, -2.5e-4, 1.5e-4, 0.0]],
        convergence_rad: 0.15,
        distance_mm: 420.0,
        ..plan.drawing.clone()
    };
    plan.settings.check_board.square_mm = 38.0;
    plan.holding = Holding { sideways_mm: 120.0, depth_mm: (-40.0, 150.0), ..Holding::USUAL };
}

pub fn cases() -> Vec<Case> {
    let mut list = rolls();
    list.extend([
        rig("one above the other", "", Right::Clean, |plan, _| plan.drawing.round_rad = FRAC_PI_2),
        rig("baseline at 45 deg", "", Right::Clean, |plan, _| plan.drawing.round_rad = FRAC_PI_4),
        rig("lenses 1.0 and 0.7", "", Right::Clean, |plan, _| {
            plan.drawing.focal_px[1] *= 0.7;
        }),
        rig("lenses and sensors differ", "", Right::Clean, |plan, px| {
            plan.drawing.size_px[1] = ((0.75 * px) as u32, (0.625 * px) as u32);
            plan.drawing.focal_px[1] *= 0.6;
            plan.drawing.distortion[1][0] = -0.2;
        }),
        rig("short baseline", "5 deg", Right::Truth, |plan, _| plan.drawing.convergence_rad = 0.087),
        rig("wide lens", "90 deg, k1 = -0.28", Right::Pass, wide).also_large(),
        case("rig", "320x240, noise 0.3 px", "16 pairs", Right::Truth, |seed, _| {
            let mut plan = Plan::usual(seed, 320).board("9x7", 22.0).pairs(16);
            plan.drawing.size_px = [(320, 240); 2];
            plan.drawing.focal_px = [520.0, 517.0];
            plan.holding.sideways_mm = 20.0;
            plan.set().each(|picture| {
                picture.optics.gaussian_px = 1.2;
                picture.faults.push(PictureFault::Noise(0.08));
            })
        }),
        case("rig", "640x480", "", Right::Pass, |seed, _| {
            let mut plan = Plan::usual(seed, 640).board("9x7", 22.0);
            plan.drawing.size_px = [(640, 480); 2];
            plan.drawing.focal_px = [1040.0, 1034.0];
            plan.holding.sideways_mm = 20.0;
            plan.set()
        }),
    ]);
    list
}

fn rolls() -> Vec<Case> {
    let roll = |name, size, right: Right, left_rad: f64, right_rad: f64, squares: &'static str| {
        case("rig", name, format!("{size}, {squares}"), right, move |seed, px| {
            // Turned by 45 degrees a board needs more room.
            let mm = if squares == "12x9" { 12.0 } else { 8.0 };
            let mut plan = Plan::usual(seed, px).board(squares, mm);
            plan.drawing.roll_rad = [left_rad, right_rad];
            plan.set()
        })
    };
    let mut list = Vec::new();
    for squares in ["20x20", "12x9"] {
        list.push(roll("both rolled", "45 deg", Right::Pass, FRAC_PI_4, FRAC_PI_4, squares));
        list.push(roll("both rolled", "90 deg", Right::Pass, FRAC_PI_2, FRAC_PI_2, squares));
        list.push(roll("both rolled", "180 deg", Right::Pass, PI, PI, squares));
        list.push(roll("one rolled", "45 deg", Right::Pass, 0.0, FRAC_PI_4, squares));
        list.push(roll("one rolled", "90 deg", Right::Pass, 0.0, FRAC_PI_2, squares));
        list.push(roll("one rolled", "180 deg", Right::Pass, 0.0, PI, squares));
    }
    list
}
