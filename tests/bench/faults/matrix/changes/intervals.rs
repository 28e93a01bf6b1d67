//! Whether the 95 % intervals of lengths hold where the series is not as the model has it: for the rig at the moment
//! that the ledger names.

use std::path::Path;

use rayon::prelude::*;
use serde_json::Value;
use stereocal::stereo::{Camera, Rig};

use super::super::said::Said;
use super::super::set::Set;
use super::super::truth;
use super::corners::World;
use super::limit::rig_of;
use super::plants::{self, Plant};

/// Rigs a line.
const RIGS: u64 = 20;

/// Fresh boards a rig.
const BOARDS: usize = 4;

/// Of a Gaussian within its 95 % interval.
const WIDTH: f64 = 1.96;

struct Line {
    name: &'static str,
    /// Factor on the corners' scatter that they do not say.
    noise: f64,
    plant: Plant,
    /// Whether the rig changes evenly, so that it has a moment; else it is the one about which the pairs scatter.
    drifts: bool,
}

const LINES: [Line; 12] = [
    Line { name: "nothing", noise: 1.0, plant: |_, _| (), drifts: false },
    Line {
        name: "focal drift 20 ppm",
        noise: 1.0,
        plant: |set, _| along(set, |set, k, s| plants::focus(set, k, 20.0 * s)),
        drifts: true,
    },
    Line {
        name: "focal drift 100 ppm",
        noise: 1.0,
        plant: |set, _| along(set, |set, k, s| plants::focus(set, k, 100.0 * s)),
        drifts: true,
    },
    Line {
        name: "focal drift 500 ppm",
        noise: 1.0,
        plant: |set, _| along(set, |set, k, s| plants::focus(set, k, 500.0 * s)),
        drifts: true,
    },
    Line {
        name: "yaw drift 0.002 deg",
        noise: 1.0,
        plant: |set, _| along(set, |set, k, s| plants::yaw(set, k, 0.002 * s)),
        drifts: true,
    },
    Line {
        name: "yaw drift 0.01 deg",
        noise: 1.0,
        plant: |set, _| along(set, |set, k, s| plants::yaw(set, k, 0.01 * s)),
        drifts: true,
    },
    Line {
        name: "baseline creep 50 um",
        noise: 1.0,
        plant: |set, _| along(set, |set, k, s| plants::longer(set, k, 50.0 * s)),
        drifts: true,
    },
    Line { name: "random yaw 0.002 deg", noise: 1.0, plant: |set, _| plants::random_yaw(set, 0.002), drifts: false },
    Line { name: "random yaw 0.01 deg", noise: 1.0, plant: |set, _| plants::random_yaw(set, 0.01), drifts: false },
    Line { name: "noise all over, 8 times", noise: 8.0, plant: |_, _| (), drifts: false },
    Line { name: "board bowed by 100 um", noise: 1.0, plant: |set, _| bowed(set, 100.0), drifts: false },
    Line {
        name: "not simultaneous, 20 ms",
        noise: 1.0,
        plant: |set, _| (0..set.pairs.len()).for_each(|k| plants::late(set, k, 20.0)),
        drifts: false,
    },
];

fn along(set: &mut Set, change: fn(&mut Set, usize, f64)) {
    let last = set.pairs.len() - 1;
    (0..=last).for_each(|k| change(set, k, k as f64 / last as f64));
}

fn bowed(set: &mut Set, um: f64) {
    let of = &set.pairs[0].sides[0].board;
    let mut workmanship = of.workmanship;
    workmanship.bow_um = (um, 0.5 * um);
    let board =
        stereocal::simulate::physical_board::PhysicalBoard::new(of.drawing, workmanship, set.plan.settings.seed, 0);
    let board = std::sync::Arc::new(board);
    set.pairs.iter_mut().flat_map(|pair| &mut pair.sides).for_each(|side| side.board = board.clone());
}

/// The set with the rig of the moment that is named: between two pairs of the series; that of the last pair where
/// nothing is said.
fn at_moment(set: Set, said: &Said, drifts: bool) -> Set {
    let named = |k: usize| {
        let name = said.check.as_ref()?["moment"][k].as_str()?.to_owned();
        Some(rig_of(&set, set.pairs.iter().find(|pair| pair.name == name)?))
    };
    let Some((before, after)) = named(0).zip(named(1)).filter(|_| drifts) else { return set };
    let middle = |a: &Camera, b: &Camera| {
        let half = |a: f64, b: f64| 0.5 * (a + b);
        Camera { fx: half(a.fx, b.fx), fy: half(a.fy, b.fy), cx: half(a.cx, b.cx), cy: half(a.cy, b.cy), ..*a }
    };
    let right_from_left = before.right_from_left.lerp_slerp(&after.right_from_left, 0.5);
    let rig = Rig {
        left: middle(&before.left, &after.left),
        right: middle(&before.right, &after.right),
        right_from_left,
        covariance: None,
    };
    Set { rig, ..set }
}

/// Prints a line a case and size.
pub fn run(program: &Path, seed: u64, chooses: &dyn Fn(&str) -> bool) {
    let lines: Vec<&Line> = LINES.iter().filter(|line| chooses(&format!("intervals/{}", line.name))).collect();
    if lines.is_empty() {
        return;
    }
    println!(
        "\nintervals: {RIGS} rigs a line, lengths on {BOARDS} fresh boards each: within 95 %, chi-squared, RMS mm; rigs without a verdict; what was found"
    );
    for line in lines {
        for px in super::corners::SIZES_PX {
            one(program, seed, line, px);
        }
    }
}

fn one(program: &Path, seed: u64, line: &Line, px: u32) {
    let each: Vec<Option<(Vec<truth::Off>, String)>> = (0..RIGS)
        .into_par_iter()
        .map(|k| {
            let mut world = World::new(px, seed + 700 + k);
            world.sigma_px *= line.noise;
            let mut set = world.plan.set();
            (line.plant)(&mut set, 0.0);
            let said = world.check(program, &world.corners(&set));
            let found = said.check.as_ref().map(causes).unwrap_or_default();
            let file = said.calibration.clone()?;
            Some((truth::compare(&at_moment(set, &said, line.drifts), &file, BOARDS)?.lengths, found))
        })
        .collect();
    let lengths: Vec<truth::Off> = each.iter().flatten().flat_map(|(lengths, _)| lengths.iter().copied()).collect();
    let count = lengths.len().max(1) as f64;
    let inside = lengths.iter().filter(|off| off.sigmas <= WIDTH).count() as f64 / count;
    let chi = lengths.iter().map(|off| off.sigmas.powi(2)).sum::<f64>() / count;
    let rms = (lengths.iter().map(|off| off.mm.powi(2)).sum::<f64>() / count).sqrt();
    let mut found: Vec<&str> =
        each.iter().flatten().map(|(_, found)| found.as_str()).filter(|f| !f.is_empty()).collect();
    found.sort_unstable();
    let mut said: Vec<(&str, usize)> = Vec::new();
    for cause in found {
        match said.last_mut().filter(|(last, _)| *last == cause) {
            Some((_, times)) => *times += 1,
            None => said.push((cause, 1)),
        }
    }
    println!(
        "intervals/{:26} {px} px | {:5.1} % chi2 {chi:5.2} RMS {rms:8.5} | {} | {said:?}",
        line.name,
        100.0 * inside,
        each.iter().filter(|one| one.is_none()).count(),
    );
}

fn causes(check: &Value) -> String {
    let list = check["findings"].as_array().cloned().unwrap_or_default();
    let of = |f: &Value| format!("{} {}", f["cause"].as_str().unwrap_or(""), f["kind"].as_str().unwrap_or(""));
    list.iter().map(of).collect::<Vec<_>>().join(", ")
}
