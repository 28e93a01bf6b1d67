//! Tables as people have them, simulated: one axis after the other, three readings a pose, a tool that nobody knows.
//! Errors against the truth beside those of the least squares that knows the noise and the tolerance, which nothing can
//! better on average.

use nalgebra::DMatrix;
use rayon::prelude::*;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::sensor::Scatter;
use stereocal::identify::settings::Method;
use stereocal::identify::solve::task::Task;
use stereocal::measurements::{Measurement, Role};
use stereocal::robot::{Parameter, Robot, Unit};

use crate::simulated::{Outcome, against_truth, judged};
use crate::targets::of_targets;
use crate::worlds::{Plan, arms, measured};

/// Standard deviation of an unknown tool, mm.
const TOOL_MM: f64 = 200.0;

/// Standard deviation of an angle about which nothing is known, mrad.
const UNKNOWN_MRAD: f64 = 3000.0;

/// Rounds of linear least squares.
const ROUNDS: usize = 6;

/// A run in which the nominal robot is kept though the least squares is better by this share is a lost one.
const LOST: f64 = 0.2;

pub fn table(runs: u64) {
    println!(
        "\ntables as people have them, {runs} runs a line: errors against the truth, mm; `bound` is least squares with the true priors"
    );
    println!(
        "{:12} {:34} {:>8} {:>8} {:>8} {:>7} {:>9} {:>6} {:>6}",
        "", "", "nominal", "found", "bound", "ratio", "promised", "worse", "lost"
    );
    let sweep = Plan { one_axis: true, ..Plan::default() };
    for (name, nominal) in arms() {
        for (what, plan) in [
            ("24 poses, one axis after the other", Plan { samples: 24, ..sweep }),
            ("36 poses, one axis after the other", Plan { samples: 36, ..sweep }),
            ("40 poses, three readings each", Plan { samples: 40, readings: 3, ..Plan::default() }),
            ("40 poses, tool off by 200 mm", Plan { samples: 40, no_tool: true, ..Plan::default() }),
            ("46 poses, most show one of 3 targets", Plan { samples: 46, parts: true, ..Plan::default() }),
            ("40 poses, none to verify, no centre", Plan { samples: 40, unverified: true, ..Plan::default() }),
            ("36 by axes, none to verify", Plan { samples: 36, unverified: true, ..sweep }),
            ("40 poses, last axis never turned", Plan { samples: 40, still: true, ..Plan::default() }),
        ] {
            line(name, what, &nominal, plan, runs);
        }
    }
}

fn line(name: &str, what: &str, nominal: &Robot, plan: Plan, runs: u64) {
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let outcomes: Vec<(Outcome, f64)> = (1..=runs)
        .into_par_iter()
        .filter_map(|seed| {
            let (nominal, truth, rows) = measured(nominal, plan, seed);
            let rows = if plan.parts { shown_in_part(&truth, &rows, plan, seed) } else { rows };
            let set = Dataset::new(&rows).expect("rows");
            let samples: Vec<_> = rows.iter().filter(|r| r.at.role == Role::Sample).cloned().collect();
            let seen = if plan.unverified { Dataset::new(&samples).expect("rows") } else { set.clone() };
            let (outcome, _) = judged(&nominal, &truth, (&seen, &set), &settings)?;
            Some((outcome, against_truth(&set, &truth, &bound(&nominal, &set, plan, &settings))))
        })
        .collect();
    let mean =
        |of: &dyn Fn(&(Outcome, f64)) -> f64| outcomes.iter().map(of).sum::<f64>() / outcomes.len().max(1) as f64;
    let (found, least) = (mean(&|(o, _)| o.errors_mm[1]), mean(&|(_, b)| *b));
    let sum = |k: usize| outcomes.iter().filter_map(|(o, _)| o.promise_mm).map(|p| p[k]).sum::<f64>();
    let worse = outcomes.iter().filter(|(o, _)| o.errors_mm[1] > o.errors_mm[0] * (1.0 + 1e-9)).count();
    let lost =
        outcomes.iter().filter(|(o, b)| o.errors_mm[1] == o.errors_mm[0] && *b < (1.0 - LOST) * o.errors_mm[0]).count();
    println!(
        "{name:12} {what:34} {:8.4} {found:8.4} {least:8.4} {:7.2} {:9.2} {worse:6} {lost:6}",
        mean(&|(o, _)| o.errors_mm[0]),
        found / least,
        sum(0) / sum(1)
    );
}

/// Three targets a pose, of which only the first poses show all.
fn shown_in_part(truth: &Robot, rows: &[Measurement], plan: Plan, seed: u64) -> Vec<Measurement> {
    let whole = plan.samples * 2 / 5;
    let all = of_targets(truth, rows, 3, plan.noise_mm, seed);
    let shows = |i: &usize| i / 3 < whole || all[*i].at.role == Role::Verify || i % 3 == (i / 3) % 3;
    (0..all.len()).filter(shows).map(|i| all[i].clone()).collect()
}

/// Least squares of all MDH parameters with noise and tolerance as they are.
fn bound(nominal: &Robot, set: &Dataset, plan: Plan, settings: &Settings) -> Robot {
    let parameters = nominal.mdh_parameters();
    let sd = |p: &Parameter| match (p, p.unit()) {
        (Parameter::V(_), _) if plan.no_tool => TOOL_MM,
        (_, Unit::Mm) => plan.error_mm,
        _ => plan.error_mrad,
    };
    let rows = set.fit_rows();
    let task = Task::plain(set, nominal, &parameters, &rows, settings);
    let rows = task.rows_at(Scatter::of_point(plan.noise_mm), nominal);
    let mut x = vec![0.0; rows.offset_count()];
    for _ in 0..ROUNDS {
        let (residuals, jacobian) = rows.evaluate(&x, true);
        let mut normal = jacobian.tr_mul(&jacobian);
        let mut gradient = jacobian.tr_mul(&residuals);
        for i in 0..x.len() {
            // How a body of targets is turned nobody knows.
            let sd = parameters.get(i).map_or(UNKNOWN_MRAD, sd);
            normal[(i, i)] += sd.powi(-2);
            gradient[i] += x[i] / sd.powi(2);
        }
        let step: DMatrix<f64> = normal
            .cholesky()
            .expect("the prior makes it definite")
            .solve(&DMatrix::from_column_slice(x.len(), 1, gradient.as_slice()));
        x.iter_mut().zip(step.iter()).for_each(|(x, s)| *x -= s);
    }
    nominal.shifted(&parameters, &x[..parameters.len()])
}
