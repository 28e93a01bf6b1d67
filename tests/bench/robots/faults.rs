//! Planted faults: is each named as what it is, and is nothing named on clean rows? Gross errors: what do they cost,
//! and are they named?

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::examine::{self, Examined};
use stereocal::identify::finding::Finding;
use stereocal::identify::judge::scale::CommonScale;
use stereocal::identify::record;
use stereocal::identify::run::{Identification, identify};
use stereocal::identify::settings::Method;
use stereocal::measurements::{Measurement, Observed, Role};
use stereocal::robot::Robot;

use crate::simulated::against_truth;
use crate::worlds::{Plan, arms, measured};

/// Changes rows and the nominal robot, by so much.
type Plant = fn(&mut Vec<Measurement>, &mut Robot, f64);

/// Faults, their sizes, and a word of the sentence that names each.
const FAULTS: [(&str, &[f64], Plant, &str); 30] = [
    ("clean", &[0.0], |_, _, _| {}, ""),
    ("radians", &[0.0], |rows, _, _| joints(rows, |_, j| j.iter_mut().for_each(|q| *q = q.to_radians())), "radians"),
    ("metres", &[0.0], |rows, _, _| points(rows, |_, p| p.coords /= 1000.0), "are in m,"),
    ("inches", &[0.0], |rows, _, _| points(rows, |_, p| p.coords /= 25.4), "inches"),
    ("exchanged joints", &[0.0], |rows, _, _| joints(rows, |_, j| j.swap(1, 3)), "exchanged"),
    ("negated joint", &[0.0], |rows, _, _| joints(rows, |_, j| j[2] = -j[2]), "sign is flipped"),
    // Half a turn of the shoulder is the base's axis counted the other way round, and may be called that.
    ("joint off by, deg", &[180.0], |rows, _, by| joints(rows, |_, j| j[1] += by), "joint"),
    ("joint off by, deg", &[90.0, -90.0], |rows, _, by| joints(rows, |_, j| j[1] += by), "offset by"),
    ("joints a row late", &[0.0], |rows, _, _| late(rows), "do not belong together"),
    ("standard DH", &[0.0], |_, robot, _| *robot = as_standard(robot), "standard DH"),
    ("mirrored", &[0.0], |rows, _, _| points(rows, |_, p| p.y = -p.y), "mirrored"),
    ("scaled by", &[0.998, 1.01, 1.1], |rows, _, by| points(rows, |_, p| p.coords *= by), "all links"),
    ("rotations in degrees", &[0.0], |rows, _, _| turned(rows), "in degrees"),
    ("rows exchanged", &[2.0, 4.0, 12.0], |rows, _, by| exchanged(rows, by as usize), "far worse"),
    (
        "one point off by, mm",
        &[0.15, 0.5, 5.0],
        |rows, _, by| points(rows, |i, p| p.x += if i == 7 { by } else { 0.0 }),
        "worse than the rest",
    ),
    ("centre off by, mm", &[0.15, 0.5, 5.0], |rows, _, by| centre(rows, by), "worse than the rest"),
    (
        "verify point off by, mm",
        &[0.3, 1.0, 5.0],
        |rows, _, by| points(rows, |i, p| p.x += if i == 130 { by } else { 0.0 }),
        "verify row",
    ),
    (
        "base moved by, mm",
        &[0.1, 0.5, 5.0],
        |rows, _, by| points(rows, |i, p| p.x += if i >= 30 { by } else { 0.0 }),
        "sessions",
    ),
    (
        "drift of, mm",
        &[0.15, 0.5, 3.0],
        |rows, _, by| points(rows, |i, p| p.x += by * i.min(60) as f64 / 60.0),
        "drift",
    ),
    ("placements off by, mm", &[0.0, 0.03, 0.1, 0.5], |rows, _, by| placements(rows, by), "smooth error"),
    ("sigmas too large by", &[3.0, 10.0, 30.0], |rows, _, by| stated(rows, by), "too large"),
    ("sigmas too small by", &[3.0, 10.0, 30.0], |rows, _, by| stated(rows, 1.0 / by), "too small"),
    ("a group's too small by", &[3.0, 10.0], |rows, _, by| of_group(rows, 1.0 / by), "of group"),
    ("a group's too large by", &[3.0, 10.0], |rows, _, by| of_group(rows, by), "of group"),
    ("covariance of nought", &[0.0], |rows, _, _| stated(rows, 0.0), "no variance"),
    ("constant joint", &[0.0], |rows, _, _| joints(rows, |_, j| j[4] = 20.0), "same in all rows"),
    ("repeated poses", &[0.0], |rows, _, _| repeated(rows), "repeated"),
    // The target's place is free: wherever the file has it, on the last axis too, it costs nothing and is no fault.
    ("target on the last axis", &[0.0], |_, robot, _| robot.tool_mm = Vector3::zeros(), ""),
    (
        "target elsewhere by, mm",
        &[5.0, 50.0, 150.0],
        |_, robot, by| robot.tool_mm += Vector3::new(by, -by, 0.5 * by),
        "",
    ),
    ("a link longer by, mm", &[20.0, 60.0, 200.0], |_, robot, by| robot.joints[2].a_mm += by, "another robot"),
];

/// A result so many times as far off as without the fault, and nothing said, is absorbed in silence.
const SILENT: f64 = 1.5;

/// How the target is read.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Sensor {
    /// As points.
    Points,
    /// As distances to the first pose's point.
    Center,
    /// As distances to a fixed point that nobody knows.
    Wire,
}

/// Faults that distances do not have, or do not see.
const OF_POINTS: [&str; 5] = ["mirrored", "placements", "rotations", "nought", "centre"];

/// One line a fault and size, for points and for distances, then distances with a zero, then gross errors.
///
/// With `only` the faults whose name holds it.
pub fn table(runs: u64, only: &str) {
    for (sensor, name) in [
        (Sensor::Points, "60 points"),
        (Sensor::Center, "120 distances to a centre"),
        (Sensor::Wire, "120 lengths of a draw wire"),
    ] {
        println!("\nplanted faults, Table 1's robot, {name}, {runs} runs");
        println!("{:26} {:>7} {:>12} {:>9} {:>15}", "", "", "named of", "findings", "silently wrong");
        lines(sensor, runs, only);
    }
    if !only.is_empty() {
        return;
    }
    zeros(runs);
    println!(
        "\ngross errors of 1 to 20 mm, {runs} runs: accuracy against that of the clean rows, share that is named, clean rows named"
    );
    for percent in [10, 15, 20, 25] {
        gross(percent, runs);
    }
}

fn lines(sensor: Sensor, runs: u64, only: &str) {
    let clean: Vec<f64> = (1..=runs).into_par_iter().map(|seed| diagnosed(sensor, |_, _, _| {}, 0.0, seed).1).collect();
    let seen = |what: &str| sensor == Sensor::Points || !OF_POINTS.iter().any(|fault| what.contains(fault));
    for (what, sizes, plant, word) in FAULTS.into_iter().filter(|(what, ..)| what.contains(only) && seen(what)) {
        for &size in sizes {
            let said: Vec<(Vec<Finding>, f64, Option<CommonScale>)> =
                (1..=runs).into_par_iter().map(|seed| diagnosed(sensor, plant, size, seed)).collect();
            let named = said.iter().filter(|(list, ..)| list.iter().any(|f| f.finding.contains(word))).count();
            let findings: usize = said.iter().map(|(list, ..)| list.len()).sum();
            let silent =
                said.iter().zip(&clean).filter(|((list, e, _), c)| list.is_empty() && *e > SILENT * **c).count();
            let instead =
                said.iter().find(|(list, ..)| !word.is_empty() && !list.iter().any(|f| f.finding.contains(word)));
            let mut instead =
                instead.map_or(String::new(), |(l, ..)| l.first().map_or(String::new(), Finding::sentence));
            if what == "scaled by" {
                // What the links' tolerance cannot tell is said with every result.
                let unseen = |scale: &Option<CommonScale>| scale.is_some_and(|s| (size - 1.0).abs() < s.unseen);
                let warned = said.iter().filter(|(list, _, scale)| list.is_empty() && unseen(scale)).count();
                instead = format!("{warned} more within the scale that is said not to be seen");
            }
            println!("{what:26} {size:7} {named:5} of {runs:3} {findings:9} {silent:15}  {instead:.80}");
        }
    }
}

/// Distances to a centre whose zero is off: what does it cost?
fn zeros(runs: u64) {
    println!("\ndistances to a centre with a zero that is off, {runs} runs: error against that without");
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    for by in [0.05, 0.5, 5.0] {
        let ratio = |seed: u64| {
            let (nominal, truth, rows) = measured(&arms()[0].1, Plan { samples: 120, ..Plan::default() }, seed);
            let error = |by: f64| {
                let set = Dataset::new(&distances(&rows, by)).expect("rows");
                let found = identify(&set, &nominal, &settings, 1, &|_| {}).expect("it is enough");
                against_truth(&Dataset::new(&rows).expect("rows"), &truth, &found.candidates[found.chosen].robot)
            };
            (error(by), error(0.0))
        };
        let errors: Vec<(f64, f64)> = (1..=runs).into_par_iter().map(ratio).collect();
        let mut all: Vec<f64> = errors.iter().map(|(with, without)| with / without).collect();
        all.sort_by(f64::total_cmp);
        let mean = |of: fn(&(f64, f64)) -> f64| errors.iter().map(of).sum::<f64>() / runs as f64;
        println!(
            "{by:5} mm: {:.3} in the median, {:.3} at worst; mean {:.4} and {:.4} mm",
            all[all.len() / 2],
            all[all.len() - 1],
            mean(|e| e.0),
            mean(|e| e.1)
        );
    }
}

/// The points as distances to the first one, their zero off by so much.
fn distances(rows: &[Measurement], zero_mm: f64) -> Vec<Measurement> {
    let mut list = lengths(rows, at(&rows[0]), zero_mm);
    list[0].at.role = Role::Center;
    list
}

/// The points as distances to another, their zero off by so much; as certain as the points along x.
fn lengths(rows: &[Measurement], from: Point3<f64>, zero_mm: f64) -> Vec<Measurement> {
    let mut list = rows.to_vec();
    for row in &mut list {
        let sigma_mm = match &row.observed {
            Observed::Position { covariance_mm2: Some(covariance), .. } => Some(covariance[(0, 0)].sqrt()),
            _ => None,
        };
        let distance_mm = (at(row) - from).norm() + zero_mm;
        row.observed = Observed::Distance { distance_mm, sigma_mm };
    }
    list
}

fn at(row: &Measurement) -> Point3<f64> {
    if let Observed::Position { point_mm, .. } = &row.observed { *point_mm } else { Point3::origin() }
}

/// States covariances that are off by this factor of a standard deviation.
fn stated(rows: &mut [Measurement], factor: f64) {
    let sigma = Plan::default().noise_mm * factor;
    for row in rows {
        if let Observed::Position { covariance_mm2, .. } = &mut row.observed {
            *covariance_mm2 = Some(Matrix3::identity() * sigma * sigma);
        }
    }
}

/// Four placements, of which one states covariances that are off by this factor of a standard deviation.
fn of_group(rows: &mut [Measurement], factor: f64) {
    placements(rows, 0.0);
    stated(rows, 1.0);
    for row in rows.iter_mut().filter(|row| row.at.group == "g2") {
        if let Observed::Position { covariance_mm2: Some(covariance), .. } = &mut row.observed {
            *covariance *= factor * factor;
        }
    }
}

/// Four placements, in each of which space is bent by so much in a way of its own.
fn placements(rows: &mut [Measurement], by: f64) {
    for (i, row) in rows.iter_mut().enumerate() {
        row.at.group = format!("g{}", i % 4);
    }
    let bent = |i: usize, p: Point3<f64>| {
        let phase = |axis: usize| 1.7 * (i % 4) as f64 + 2.3 * axis as f64;
        Vector3::from_fn(|axis, _| by * (p[(axis + 1) % 3] / 200.0 + phase(axis)).sin())
    };
    points(rows, |i, p| *p += bent(i, *p));
}

/// The first row becomes the centre, and its point is off.
fn centre(rows: &mut [Measurement], by: f64) {
    rows[0].at.role = Role::Center;
    points(rows, |i, p| p.x += if i == 0 { by } else { 0.0 });
}

/// So many rows have each other's points.
fn exchanged(rows: &mut [Measurement], count: usize) {
    for k in 0..count / 2 {
        let (a, b) = (3 + 4 * k, 5 + 4 * k);
        let kept = rows[a].observed.clone();
        rows[a].observed = rows[b].observed.clone();
        rows[b].observed = kept;
    }
}

pub fn joints(rows: &mut [Measurement], change: impl Fn(usize, &mut [f64])) {
    rows.iter_mut().enumerate().for_each(|(i, row)| change(i, &mut row.at.joints_deg));
}

fn points(rows: &mut [Measurement], change: impl Fn(usize, &mut Point3<f64>)) {
    for (i, row) in rows.iter_mut().enumerate() {
        if let Observed::Position { point_mm, .. } = &mut row.observed {
            change(i, point_mm);
        }
    }
}

/// Orientations as Table 1's robot has them, in degrees.
fn turned(rows: &mut [Measurement]) {
    let robot = &arms()[0].1;
    for row in rows {
        let turn = robot.base_from_flange(&row.at.joints_rad()).rotation.scaled_axis();
        if let Observed::Position { rotation_rad, .. } = &mut row.observed {
            *rotation_rad = Some(turn.map(f64::to_degrees));
        }
    }
}

pub fn late(rows: &mut [Measurement]) {
    let joints: Vec<Vec<f64>> = rows.iter().map(|r| r.at.joints_deg.clone()).collect();
    for (row, joints) in rows.iter_mut().skip(1).zip(joints) {
        row.at.joints_deg = joints;
    }
}

fn repeated(rows: &mut Vec<Measurement>) {
    let again: Vec<Measurement> = rows.iter().take(5).cloned().collect();
    rows.extend(again);
}

/// The rows of a standard DH table of the same arm, as somebody would type them who takes them for modified ones.
pub fn as_standard(robot: &Robot) -> Robot {
    let mut typed = robot.clone();
    let count = robot.joints.len();
    for i in 0..count {
        let next = robot.joints.get(i + 1).map_or((0.0, 0.0), |j| (j.alpha_rad, j.a_mm));
        (typed.joints[i].alpha_rad, typed.joints[i].a_mm) = next;
    }
    typed
}

/// What is said, and how far off the result is, mm.
fn diagnosed(sensor: Sensor, plant: Plant, size: f64, seed: u64) -> (Vec<Finding>, f64, Option<CommonScale>) {
    let samples = if sensor == Sensor::Points { Plan::default().samples } else { 120 };
    let (mut nominal, truth, mut rows) = measured(&arms()[0].1, Plan { samples, ..Plan::default() }, seed);
    let unspoilt = Dataset::new(&rows).expect("rows");
    if sensor == Sensor::Wire {
        // The wire's end is a point like the others, so that what is done to space is done to it as well.
        let mut end = rows[0].clone();
        end.at.pose = "end".to_owned();
        points(std::slice::from_mut(&mut end), |_, p| *p = Point3::new(600.0, 300.0, 0.0));
        rows.push(end);
    }
    plant(&mut rows, &mut nominal, size);
    let rows = match sensor {
        Sensor::Points => rows,
        Sensor::Center => distances(&rows, 0.0),
        Sensor::Wire => {
            let end = rows.iter().position(|row| row.at.pose == "end").expect("the wire's end");
            let from = at(&rows.remove(end));
            lengths(&rows, from, 0.0)
        }
    };
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let set = Dataset::new(&rows).expect("rows");
    let Examined { set, robot: nominal, along, findings: mut list, unexplained, .. } =
        examine::examine(&set, &nominal, &settings, &|_| {});
    let Ok(found) = identify(&set, &nominal, &settings, 1, &|_| {}) else {
        list.extend(unexplained);
        return (list, f64::INFINITY, None);
    };
    list.extend(unexplained.filter(|_| !record::findings::is_explained(&set, &found)));
    list.extend(record::findings::findings(&set, &found, &along));
    let error = against_truth(&unspoilt, &truth, &found.candidates[found.chosen].robot);
    (list, error, found.scale(&set))
}

fn gross(percent: usize, runs: u64) {
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let run = |rows: &[Measurement], nominal: &Robot, truth: &Robot| -> (f64, Identification) {
        let set = Dataset::new(rows).expect("rows");
        let found = identify(&set, nominal, &settings, 1, &|_| {}).expect("it is enough");
        (against_truth(&set, truth, &found.candidates[found.chosen].robot), found)
    };
    let one = |seed: u64| {
        let plan = Plan { samples: 120, ..Plan::default() };
        let (nominal, truth, rows) = measured(&arms()[0].1, plan, seed);
        let (mut spoilt, mut planted) = (rows.clone(), Vec::new());
        for (i, row) in spoilt.iter_mut().enumerate().filter(|(_, r)| r.at.role == Role::Sample) {
            if (i * 37 + seed as usize * 11) % 100 < percent {
                planted.push(i);
                if let Observed::Position { point_mm, .. } = &mut row.observed {
                    let k = i as f64;
                    let size = 10f64.powf(1.3 * (0.5 + 0.5 * (2.1 * k).sin()));
                    *point_mm += Vector3::new((1.3 * k).sin(), (2.7 * k).cos(), (0.9 * k).sin()).normalize() * size;
                }
            }
        }
        let clean: Vec<Measurement> =
            rows.iter().enumerate().filter(|(i, _)| !planted.contains(i)).map(|(_, r)| r.clone()).collect();
        let (without, _) = run(&clean, &nominal, &truth);
        let (with, found) = run(&spoilt, &nominal, &truth);
        let named = planted.iter().filter(|i| found.outliers.contains(i)).count();
        [with / without, named as f64, planted.len() as f64, (found.outliers.len() - named) as f64]
    };
    let all: Vec<[f64; 4]> = (1..=runs).into_par_iter().map(one).collect();
    let sum = |k: usize| all.iter().map(|r| r[k]).sum::<f64>();
    let worst = all.iter().map(|r| r[0]).fold(0.0, f64::max);
    println!(
        "{percent:3} %: error times {:.3} in the mean, {worst:.3} at worst; {:.1} % named; {} clean rows named",
        sum(0) / runs as f64,
        100.0 * sum(1) / sum(2),
        sum(3)
    );
}
