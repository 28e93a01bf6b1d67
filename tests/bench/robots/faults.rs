//! Planted faults: is each named as what it is, and is nothing named on clean rows? Gross errors: what do they cost, and are they named?

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::data::doctor::{self, Finding};
use stereocal::identify::data::{examine, sessions};
use stereocal::identify::judge::choose::{Identification, identify};
use stereocal::identify::settings::Method;
use stereocal::measurements::{Measurement, Observed, Role};
use stereocal::robot::Robot;

use crate::simulated::against_truth;
use crate::worlds::{Plan, arms, measured};

/// Changes rows and the nominal robot.
type Plant = fn(&mut Vec<Measurement>, &mut Robot);

/// Faults and a word of the sentence that names each.
const FAULTS: [(&str, Plant, &str); 18] = [
    ("clean", |_, _| {}, ""),
    ("radians", |rows, _| joints(rows, |_, j| j.iter_mut().for_each(|q| *q = q.to_radians())), "radians"),
    ("metres", |rows, _| points(rows, |_, p| p.coords /= 1000.0), "are in m,"),
    ("inches", |rows, _| points(rows, |_, p| p.coords /= 25.4), "inches"),
    ("exchanged joints", |rows, _| joints(rows, |_, j| j.swap(1, 3)), "exchanged"),
    ("negated joint", |rows, _| joints(rows, |_, j| j[2] = -j[2]), "sign is flipped"),
    ("joint off by 90 deg", |rows, _| joints(rows, |_, j| j[1] += 90.0), "offset by"),
    ("joint off by 180 deg", |rows, _| joints(rows, |_, j| j[3] += 180.0), "offset by"),
    ("joints a row late", |rows, _| late(rows), "lag"),
    ("standard DH", |_, robot| *robot = as_standard(robot), "standard DH"),
    ("mirrored", |rows, _| points(rows, |_, p| p.y = -p.y), "mirrored"),
    ("one point off by 5 mm", |rows, _| points(rows, |i, p| p.x += if i == 7 { 5.0 } else { 0.0 }), "far worse"),
    (
        "verify point off by 5 mm",
        |rows, _| points(rows, |i, p| p.x += if i == 90 { 5.0 } else { 0.0 }),
        "verify rows fit",
    ),
    ("base moved by 0.5 mm", |rows, _| points(rows, |i, p| p.x += if i >= 30 { 0.5 } else { 0.0 }), "sessions"),
    ("drift of 0.5 mm", |rows, _| points(rows, |i, p| p.x += 0.5 * i.min(60) as f64 / 60.0), "drift"),
    ("constant joint", |rows, _| joints(rows, |_, j| j[4] = 20.0), "same in all rows"),
    ("repeated poses", |rows, _| repeated(rows), "repeated"),
    ("another robot", |_, robot| robot.joints[2].a_mm += 60.0, "another robot"),
];

/// One line a fault, then gross errors.
pub fn table(runs: u64) {
    println!(
        "\nplanted faults, Table 1's robot, 60 poses, {runs} runs: named, findings in all, and what is said first where it is not named"
    );
    for (what, plant, word) in FAULTS {
        let said: Vec<Vec<Finding>> = (1..=runs).into_par_iter().map(|seed| diagnosed(plant, seed)).collect();
        let named = said.iter().filter(|list| list.iter().any(|f| f.finding.contains(word))).count();
        let findings: usize = said.iter().map(Vec::len).sum();
        let instead = said.iter().find(|list| !list.iter().any(|f| f.finding.contains(word)));
        let instead = instead.map_or(String::new(), |l| l.first().map_or("nothing".to_owned(), Finding::sentence));
        println!("{what:26} {named:4} of {runs:3} {findings:5}  {instead:.100}");
    }
    println!(
        "\ngross errors of 1 to 20 mm, {runs} runs: accuracy against that of the clean rows, share that is named, clean rows named"
    );
    for percent in [10, 15, 20, 25] {
        gross(percent, runs);
    }
}

fn joints(rows: &mut [Measurement], change: fn(usize, &mut [f64])) {
    rows.iter_mut().enumerate().for_each(|(i, row)| change(i, &mut row.at.joints_deg));
}

fn points(rows: &mut [Measurement], change: fn(usize, &mut Point3<f64>)) {
    for (i, row) in rows.iter_mut().enumerate() {
        if let Observed::Position { point_mm, .. } = &mut row.observed {
            change(i, point_mm);
        }
    }
}

fn late(rows: &mut [Measurement]) {
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
fn as_standard(robot: &Robot) -> Robot {
    let mut typed = robot.clone();
    let count = robot.joints.len();
    for i in 0..count {
        let next = robot.joints.get(i + 1).map_or((0.0, 0.0), |j| (j.alpha_rad, j.a_mm));
        (typed.joints[i].alpha_rad, typed.joints[i].a_mm) = next;
    }
    typed
}

fn diagnosed(plant: Plant, seed: u64) -> Vec<Finding> {
    let (mut nominal, _, mut rows) = measured(&arms()[0].1, Plan::default(), seed);
    plant(&mut rows, &mut nominal);
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let set = Dataset::new(&rows, 1).expect("rows");
    let (set, nominal, mut list) = examine::examine(&set, &nominal, &settings);
    let (set, along) = sessions::find(&set, &nominal, &settings);
    if let Ok(found) = identify(&set, &nominal, &settings, 1, &|_| {}) {
        list.extend(doctor::findings(&set, &found, &along));
    }
    list
}

fn gross(percent: usize, runs: u64) {
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let run = |rows: &[Measurement], nominal: &Robot, truth: &Robot| -> (f64, Identification) {
        let set = Dataset::new(rows, 1).expect("rows");
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
