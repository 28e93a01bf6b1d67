//! Controls: nothing is wrong with them.

use super::set::Plan;
use super::{Case, Right, case};

pub fn cases() -> Vec<Case> {
    vec![
        case("clean", "control", "", Right::Clean, |seed, px| Plan::usual(seed, px).set()).also_large(),
        case("clean", "control", "20x20", Right::Clean, |seed, px| Plan::ceramic(seed + 100, px).set()),
        case("clean", "perfect print", "", Right::Clean, |seed, px| {
            let mut plan = Plan::usual(seed, px);
            plan.settings.check_workmanship.pitch_um = 0.0;
            plan.set()
        }),
        case("clean", "20 pairs", "", Right::Clean, |seed, px| Plan::usual(seed, px).pairs(20).set()),
        case("clean", "board 12x9", "", Right::Pass, |seed, px| Plan::usual(seed, px).board("12x9", 16.0).set()),
    ]
}
