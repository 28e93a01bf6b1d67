//! Planted faults at three sizes, and clean rigs: no pose may be wrong by more than five of its sigmas without a word.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use stereocal::simulate::world::World;
use stereocal::stereo::board_pose::series::measure;
use stereocal::stereo::board_pose::{Knowledge, Seen, Series};

use crate::worlds::{knowledge, run as poses_of, world};

/// A pose that is wrong by more of its sigmas than this must come with a word.
const SIGMAS: f64 = 5.0;

/// Rigs without a fault.
const CLEAN: u64 = 20;

/// Samples besides the four centres.
const SAMPLES: usize = 56;

/// The pose at which faults of one pose stand, and where a rig moves.
const FAULTY: usize = 17;
const MOVED: usize = 30;

type Plant = fn(&World, f64, &mut Knowledge, &mut Vec<Seen>);

struct Fault {
    what: &'static str,
    sizes: [f64; 3],
    plant: Plant,
}

const FAULTS: [Fault; 15] = [
    Fault {
        what: "yaw of the right camera, deg",
        sizes: [0.003, 0.03, 0.3],
        plant: |w, s, _, seen| *seen = turned(w, Vector3::y(), s),
    },
    Fault { what: "pitch, deg", sizes: [0.001, 0.03, 0.3], plant: |w, s, _, seen| *seen = turned(w, Vector3::x(), s) },
    Fault { what: "roll, deg", sizes: [0.003, 0.03, 0.3], plant: |w, s, _, seen| *seen = turned(w, Vector3::z(), s) },
    Fault {
        what: "right camera along x, mm",
        sizes: [0.1, 0.3, 1.0],
        plant: |w, s, _, seen| *seen = shifted(w, Vector3::x() * s),
    },
    Fault {
        what: "right camera along z, mm",
        sizes: [0.03, 0.1, 1.0],
        plant: |w, s, _, seen| *seen = shifted(w, Vector3::z() * s),
    },
    Fault { what: "left focal length, %", sizes: [0.01, 0.1, 1.0], plant: |w, s, _, seen| *seen = focal(w, s) },
    Fault {
        what: "squares said to be larger, %",
        sizes: [0.1, 1.0, 20.0],
        plant: |_, s, known, _| known.board.square_mm *= 1.0 + s / 100.0,
    },
    Fault {
        what: "baseline in other units, mm",
        sizes: [10.0, 25.4, 1000.0],
        plant: |_, s, known, _| known.rig.right_from_left.translation.vector /= s,
    },
    Fault { what: "pictures exchanged (any size)", sizes: [1.0; 3], plant: |_, _, _, seen| exchange(seen) },
    Fault {
        what: "one pose out of step, along x, mm",
        sizes: [0.02, 0.05, 0.5],
        plant: |w, s, _, seen| out_of_step(w, Vector3::x() * s, seen),
    },
    Fault {
        what: "one pose out of step, along y, mm",
        sizes: [0.005, 0.05, 0.5],
        plant: |w, s, _, seen| out_of_step(w, Vector3::y() * s, seen),
    },
    Fault {
        what: "one pose out of step, along z, mm",
        sizes: [0.05, 0.2, 1.0],
        plant: |w, s, _, seen| out_of_step(w, Vector3::z() * s, seen),
    },
    Fault {
        what: "rig pitched during the run, deg",
        sizes: [0.001, 0.01, 0.1],
        plant: |w, s, _, seen| moved(w, Vector3::x(), s, seen),
    },
    Fault {
        what: "rig yawed during the run, deg",
        sizes: [0.001, 0.01, 0.1],
        plant: |w, s, _, seen| moved(w, Vector3::y(), s, seen),
    },
    Fault {
        what: "corners dragged by a finger, number",
        sizes: [3.0, 8.0, 15.0],
        plant: |_, s, _, seen| drag(seen, s as usize),
    },
];

pub fn degrees(axis: Vector3<f64>, deg: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_scaled_axis(axis * deg.to_radians()))
}

fn turned(world: &World, axis: Vector3<f64>, deg: f64) -> Vec<Seen> {
    let mut other = world.clone();
    other.rig.right_from_left = degrees(axis, deg) * world.rig.right_from_left;
    poses_of(&other)
}

fn shifted(world: &World, by_mm: Vector3<f64>) -> Vec<Seen> {
    let mut other = world.clone();
    other.rig.right_from_left.translation.vector += by_mm;
    poses_of(&other)
}

fn focal(world: &World, percent: f64) -> Vec<Seen> {
    let mut other = world.clone();
    other.rig.left.fx *= 1.0 + percent / 100.0;
    other.rig.left.fy *= 1.0 + percent / 100.0;
    poses_of(&other)
}

fn exchange(seen: &mut [Seen]) {
    for pair in seen.iter_mut().filter_map(|s| s.corners.as_mut().ok()) {
        std::mem::swap(&mut pair.left, &mut pair.right);
    }
}

/// The right picture of one pose was taken when the target was elsewhere.
fn out_of_step(world: &World, by_mm: Vector3<f64>, seen: &mut [Seen]) {
    let mut later = world.clone();
    later.poses[FAULTY].left_from_target.translation.vector += by_mm;
    let right = poses_of(&later)[FAULTY].corners.clone().unwrap().right;
    seen[FAULTY].corners.as_mut().unwrap().right = right;
}

fn moved(world: &World, axis: Vector3<f64>, deg: f64, seen: &mut Vec<Seen>) {
    let after = turned(world, axis, deg);
    seen.truncate(MOVED);
    seen.extend(after.into_iter().skip(MOVED));
}

/// The first corners of one left picture lie on a finger's edge instead.
fn drag(seen: &mut [Seen], count: usize) {
    for corner in seen[FAULTY].corners.as_mut().unwrap().left.iter_mut().take(count) {
        corner.px.x += 0.5 + 0.1 * corner.col as f64;
        corner.px.y -= 0.3;
    }
}

/// The largest deviation in sigmas of a pose that came without a word of its own, and the largest in mm.
pub fn worst(series: &Series, world: &World) -> (f64, f64) {
    let mut worst = (0.0_f64, 0.0_f64);
    for (pose, truth) in series.poses.iter().zip(&world.poses) {
        let Ok(target) = &pose.target else { continue };
        let off = target.cam_from_board.translation.vector - truth.left_from_target.translation.vector;
        for k in 0..3 {
            worst.0 = worst.0.max(off[k].abs() / target.covariance[(3 + k, 3 + k)].sqrt());
        }
        worst.1 = worst.1.max(off.norm());
    }
    worst
}

pub fn run() {
    println!(
        "\nfaults, {} poses at 1280 px, target 10 um: what is said, and the worst pose that is given as good",
        SAMPLES + 4
    );
    let mut silent = 0;
    for fault in &FAULTS {
        for (k, size) in fault.sizes.into_iter().enumerate() {
            let world = world(1280, 10.0, SAMPLES, 300 + k as u64);
            let mut known = knowledge(&world);
            let mut seen = poses_of(&world);
            (fault.plant)(&world, size, &mut known, &mut seen);
            let series = measure(&known, seen);
            let (sigmas, mm) = worst(&series, &world);
            let said = series.judgement.describe(&known.rig, &known.board);
            let refused: Vec<String> = series
                .poses
                .iter()
                .filter_map(|p| Some(format!("{}: {}", p.at.pose, p.target.as_ref().err()?.status)))
                .collect();
            let missed = said.is_none() && sigmas > SIGMAS;
            silent += usize::from(missed);
            let mark = if missed { "MISSED" } else { "" };
            let row = match (&said, refused.len()) {
                (Some(said), _) => said.clone(),
                (None, 0) => "nothing".to_owned(),
                (None, n) => format!("{n} refused, {}", refused[0]),
            };
            println!(
                "{:34} {size:8} | {sigmas:5.1} sigmas {mm:8.4} mm {mark} | {}",
                fault.what,
                row.chars().take(150).collect::<String>()
            );
        }
    }
    let mut alarms = 0;
    for seed in 0..CLEAN {
        let world = world(1280, if seed % 2 == 0 { 10.0 } else { 0.0 }, SAMPLES, 400 + seed);
        let series = measure(&knowledge(&world), poses_of(&world));
        let said = series.judgement.describe(&world.rig, &world.target.drawing);
        let refused = series.poses.iter().filter(|p| p.target.is_err()).count();
        if said.is_some() || refused > 0 {
            alarms += 1;
            println!("false alarm on rig {seed}: {said:?}, {refused} poses refused");
        }
    }
    println!(
        "{silent} of {} faults wrong without a word; {alarms} false alarms on {CLEAN} clean rigs",
        3 * FAULTS.len()
    );
}
