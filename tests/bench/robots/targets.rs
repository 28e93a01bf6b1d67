//! Several targets a pose beside one: errors against the truth, at the mark point and at a tool further out, and
//! whether intervals hold.

use nalgebra::{Point3, Vector3};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::settings::{Method, Model};
use stereocal::measurements::{Measurement, Observed};
use stereocal::robot::Robot;

use crate::simulated::{Outcome, against_truth, judged};
use crate::worlds::{Beyond, Plan, arms, measured, normal, sensor};

/// Four places on the flange round the mark point, mm.
const ROUND: [[f64; 3]; 4] = [[60.0, 10.0, -20.0], [-40.0, 45.0, 0.0], [-20.0, -55.0, 20.0], [0.0, 0.0, 40.0]];

/// A tool further out than the targets, from the mark point, mm.
const FURTHER_MM: [f64; 3] = [0.0, 0.0, 200.0];

pub fn table(runs: u64) {
    println!(
        "\nseveral targets of 0.02 mm a pose, {runs} runs a line: errors at the mark point and 200 mm further out, mm"
    );
    println!(
        "{:12} {:28} {:>8} {:>8} {:>9} {:>9} {:>9}",
        "", "", "mark", "further", "promised", "95 % par", "95 % pts"
    );
    for (name, nominal) in arms() {
        for (what, beyond) in [("", Beyond::Nothing), ("harmonics, ", Beyond::Harmonics)] {
            for (count, model) in [(1, None), (3, Some(Model::Position)), (3, None), (4, None)] {
                let plan = Plan { beyond, samples: 40, ..Plan::default() };
                let how = if count == 1 {
                    ""
                } else if model.is_some() {
                    ", mean alone"
                } else {
                    ", turned"
                };
                line(name, &format!("{what}{count} a pose{how}"), &nominal, plan, (count, model), runs);
            }
        }
    }
}

fn line(name: &str, what: &str, nominal: &Robot, plan: Plan, (count, model): (usize, Option<Model>), runs: u64) {
    let settings = Settings { method: Some(Method::TrustRegion), model, ..Settings::default() };
    let outcomes: Vec<(Outcome, f64)> = (1..=runs)
        .into_par_iter()
        .filter_map(|seed| {
            let (nominal, truth, rows) = measured(nominal, plan, seed);
            let rows = if count == 1 { rows } else { of_targets(&truth, &rows, count, plan.noise_mm, seed) };
            let set = Dataset::new(&rows).expect("rows");
            let (outcome, kept) = judged(&nominal, &truth, (&set, &set), &settings)?;
            let further = |robot: &Robot| Robot { tool_mm: robot.tool_mm + Vector3::from(FURTHER_MM), ..robot.clone() };
            Some((outcome, against_truth(&set, &further(&truth), &further(&kept))))
        })
        .collect();
    let mean =
        |of: &dyn Fn(&(Outcome, f64)) -> f64| outcomes.iter().map(of).sum::<f64>() / outcomes.len().max(1) as f64;
    let share = |of: &dyn Fn(&Outcome) -> [usize; 2]| {
        let sums = outcomes.iter().map(|(o, _)| of(o)).fold([0, 0], |s, c| [s[0] + c[0], s[1] + c[1]]);
        if sums[1] == 0 { "n/a".to_owned() } else { format!("{:.1}", 100.0 * sums[0] as f64 / sums[1] as f64) }
    };
    let sum = |k: usize| outcomes.iter().filter_map(|(o, _)| o.promise_mm).map(|p| p[k]).sum::<f64>();
    println!(
        "{name:12} {what:28} {:8.4} {:8.4} {:9.2} {:>9} {:>9}",
        mean(&|(o, _)| o.errors_mm[1]),
        mean(&|(_, further)| *further),
        sum(0) / sum(1),
        share(&|o| o.parameters),
        share(&|o| o.points),
    );
}

/// The rows with so many targets a pose, whose mean is the truth's mark point.
pub fn of_targets(truth: &Robot, rows: &[Measurement], count: usize, noise_mm: f64, seed: u64) -> Vec<Measurement> {
    let mut random = Pcg64Mcg::seed_from_u64(seed ^ 0x7a26);
    let mean = ROUND[..count].iter().map(|p| Vector3::from(*p)).sum::<Vector3<f64>>() / count as f64;
    let mut all = Vec::new();
    for row in rows {
        let group = row.at.group.trim_start_matches('g').parse().expect("a number");
        let sensor_from_flange = sensor(group) * truth.base_from_flange(&row.at.joints_rad());
        for (k, place) in ROUND[..count].iter().enumerate() {
            let noise = Vector3::from_fn(|_, _| noise_mm * normal(&mut random));
            let place = truth.tool_mm + Vector3::from(*place) - mean;
            let point_mm = sensor_from_flange * Point3::from(place) + noise;
            let observed = Observed::Position { point_mm, covariance_mm2: None, rotation_rad: None };
            all.push(Measurement { at: row.at.clone(), target: format!("t{k}"), observed });
        }
    }
    all
}
