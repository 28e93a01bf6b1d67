//! Simulated arms: do intervals hold, is the promised accuracy the realised one, and is the result ever worse than
//! nominal?

use rayon::prelude::*;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::{Dataset, Reading};
use stereocal::identify::judge::errors::Judge;
use stereocal::identify::judge::uncertainty::Expected;
use stereocal::identify::run::Against;
use stereocal::identify::run::{Identification, identify};
use stereocal::identify::settings::Method;
use stereocal::robot::Robot;

use crate::worlds::{Beyond, Plan, arms, measured};

/// Normal numbers lie within so many standard deviations in 95 of 100 cases.
const SIGMAS: f64 = 1.96;

/// One line a case.
pub fn table(runs: u64) {
    println!("\npoint errors against the truth, mm, over {runs} runs a line, and how far the promises hold");
    println!(
        "{:12} {:26} {:>8} {:>8} {:>9} {:>9} {:>9} {:>6} {:>6} {:>8}",
        "", "", "nominal", "found", "promised", "95 % par", "95 % pts", "worse", "1.1x", "refused"
    );
    let few = Plan { noise_mm: 0.1, error_mm: 0.3, error_mrad: 0.3, ..Plan::default() };
    let perfect = Plan { error_mm: 0.0, error_mrad: 0.0, ..few };
    for (name, nominal) in arms() {
        for (what, plan) in [
            ("60 poses", Plan::default()),
            ("60 poses, gravity", Plan { beyond: Beyond::Gravity, ..Plan::default() }),
            ("60 poses, bending", Plan { beyond: Beyond::Bending, ..Plan::default() }),
            ("60 poses, harmonics", Plan { beyond: Beyond::Harmonics, ..Plan::default() }),
            ("60 poses, harmonics, 4 pl.", Plan { groups: 4, beyond: Beyond::Harmonics, ..Plan::default() }),
            ("60 poses, 4 placements off", Plan { groups: 4, beyond: Beyond::Common, ..Plan::default() }),
            ("20 poses, 0.1 mm", Plan { samples: 20, ..few }),
            ("12 poses, 0.1 mm", Plan { samples: 12, ..few }),
            ("8 poses, 0.1 mm", Plan { samples: 8, ..few }),
            ("20 poses, perfect robot", Plan { samples: 20, ..perfect }),
            ("12 poses, perfect robot", Plan { samples: 12, ..perfect }),
            ("8 poses, perfect robot", Plan { samples: 8, ..perfect }),
        ] {
            line(name, what, &nominal, plan, runs);
        }
    }
}

/// What one run says.
#[derive(Debug, Default, Clone, Copy)]
pub struct Outcome {
    /// Of the nominal robot and of the one that is kept.
    pub errors_mm: [f64; 2],
    /// Promised and realised, each placement fitted by itself.
    pub promise_mm: Option<[f64; 2]>,
    /// Base parameters whose interval holds the truth, and all of them.
    pub parameters: [usize; 2],
    /// Verify points within what is promised for 95 of 100, and all of them.
    pub points: [usize; 2],
}

fn line(name: &str, what: &str, nominal: &Robot, plan: Plan, runs: u64) {
    let outcomes: Vec<Option<Outcome>> = (1..=runs).into_par_iter().map(|seed| outcome(nominal, plan, seed)).collect();
    let done: Vec<Outcome> = outcomes.iter().flatten().copied().collect();
    let mean = |of: &dyn Fn(&Outcome) -> f64| done.iter().map(of).sum::<f64>() / done.len().max(1) as f64;
    let share = |of: &dyn Fn(&Outcome) -> [usize; 2]| {
        let sums = done.iter().map(of).fold([0, 0], |s, c| [s[0] + c[0], s[1] + c[1]]);
        if sums[1] == 0 { "n/a".to_owned() } else { format!("{:.1}", 100.0 * sums[0] as f64 / sums[1] as f64) }
    };
    let sum = |k: usize| done.iter().filter_map(|o| o.promise_mm).map(|p| p[k]).sum::<f64>();
    let ratio = sum(0) / sum(1);
    let worse = |by: f64| done.iter().filter(|o| o.errors_mm[1] > o.errors_mm[0] * by * (1.0 + 1e-9)).count();
    println!(
        "{name:12} {what:26} {:8.4} {:8.4} {ratio:9.2} {:>9} {:>9} {:6} {:6} {:8}",
        mean(&|o| o.errors_mm[0]),
        mean(&|o| o.errors_mm[1]),
        share(&|o| o.parameters),
        share(&|o| o.points),
        worse(1.0),
        worse(1.1),
        outcomes.len() - done.len(),
    );
}

fn outcome(nominal: &Robot, plan: Plan, seed: u64) -> Option<Outcome> {
    let (nominal, truth, rows) = measured(nominal, plan, seed);
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let set = Dataset::new(&rows).expect("rows");
    judged(&nominal, &truth, (&set, &set), &settings).map(|(outcome, _)| outcome)
}

/// What becomes of a robot, and the one that is kept; what is identified from are the first poses of the set.
pub fn judged(
    nominal: &Robot,
    truth: &Robot,
    (seen, set): (&Dataset, &Dataset),
    settings: &Settings,
) -> Option<(Outcome, Robot)> {
    let found = identify(seen, nominal, settings, 1, &|_| {}).ok()?;
    let robot = &found.candidates[found.chosen].robot;
    // As with all methods, where the verify rows may keep the nominal robot.
    let kept = if found.against_nominal(seen, nominal, settings) == Against::Worse { nominal } else { robot };
    let errors_mm = [nominal, kept].map(|robot| against_truth(set, truth, robot));
    let mut outcome = Outcome { errors_mm, ..Outcome::default() };
    if let Some((formulation, _)) = &found.candidates[found.chosen].found {
        // Where the truth is asked: poses that turn one axis after the other are easier than these.
        let expected = Expected::at(formulation, set, &found.fitted, &set.verify_rows());
        outcome.promise_mm = Some([expected.of_robot_mm, off(set, truth, robot, true)]);
        let verify = set.verify_rows();
        let errors = Judge::plain(set, &found.fitted, true).errors(robot, &verify);
        let sizes: Vec<f64> = errors.iter().filter_map(|e| e.point_mm).map(|p| p.norm()).collect();
        outcome.points = [sizes.iter().filter(|s| **s <= expected.p95_mm).count(), sizes.len()];
        outcome.parameters = intervals(&found, nominal, truth);
    }
    Some((outcome, kept.clone()))
}

/// How many base parameters of the chosen fit have the truth in their interval, and how many there are; none where the
/// truth has parameters that the model lacks.
fn intervals(found: &Identification, nominal: &Robot, truth: &Robot) -> [usize; 2] {
    let Some((formulation, _)) = &found.candidates[found.chosen].found else { return [0, 0] };
    let (parameters, base) = (formulation.parameters(), &formulation.base);
    let offset = |i: usize| truth.value(parameters[i]) - nominal.value(parameters[i]);
    let all: Vec<f64> = (0..parameters.len()).map(offset).collect();
    let lacks = |p: &stereocal::robot::Parameter| {
        !parameters.contains(p) && (truth.value(*p) - nominal.value(*p)).abs() > 1e-12
    };
    let gravity = [nominal.gravity_parameters(true), nominal.bending_parameters()].concat();
    let beyond = [nominal.mdh_parameters(), gravity, nominal.harmonic_parameters(2)].concat();
    if beyond.iter().any(lacks) {
        return [0, 0];
    }
    let covariance = formulation.covariance();
    let holds = |k: &usize| {
        let others = (0..base.dependent.len()).map(|c| base.coefficients[(*k, c)] * all[base.dependent[c]]);
        let is = all[base.free[*k]] + others.sum::<f64>();
        (formulation.free_fit.x[*k] - is).abs() <= SIGMAS * covariance[(*k, *k)].sqrt()
    };
    [(0..base.rank()).filter(holds).count(), base.rank()]
}

/// Mean error of points at the verify rows with no noise, after one rigid fit of the robot to the truth at all of them.
pub fn against_truth(set: &Dataset, truth: &Robot, robot: &Robot) -> f64 {
    off(set, truth, robot, false)
}

/// The same, or after one rigid fit to the fitted rows of each placement, as the program promises it.
fn off(set: &Dataset, truth: &Robot, robot: &Robot, by_placement: bool) -> f64 {
    let mut exact = set.clone();
    for pose in &mut exact.poses {
        if !by_placement {
            pose.group = 0;
        }
        // What is asked is where the mark point is, of a pose that shows one target, too.
        pose.on_body_mm = None;
        if let Reading::Position { point_mm, .. } = &mut pose.reading {
            *point_mm = truth.target_mm(&pose.joints_rad);
        }
    }
    let rows = exact.verify_rows();
    let placing = if by_placement { exact.fit_rows() } else { rows.clone() };
    let errors = Judge::plain(&exact, &placing, true).errors(robot, &rows);
    errors.iter().filter_map(|e| e.point_mm).map(|p| p.norm()).sum::<f64>() / errors.len().max(1) as f64
}
