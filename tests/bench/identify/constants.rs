//! How surely STAPSO ends at the least cost: the paper's constants and those shipped, with the paper's stop and
//! without.
//!
//! The least cost is that of 50 starts of the trust region drawn in the box. "Below" counts the seeds whose best cost
//! is less than that of each of PSO, CPSO, APSO and ARPSO at as many evaluations as STAPSO spent (at the most their 500
//! iterations'); "level" those where one or more of them has reached the same cost by then, to the rounding of
//! different sums, and none a lesser one.

use camino::Utf8Path;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use stereocal::identify::Model;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::settings::{DescentSettings, Method, Prior, Settings, SwarmSettings};
use stereocal::identify::solve::formulation::Formulation;
use stereocal::identify::solve::problem::{Problem, Solution};
use stereocal::identify::solve::task::Task;
use stereocal::identify::solve::{swarm, trust_region};
use stereocal::{measurements, robot};

use crate::experiment;

/// Starts of the trust region.
const STARTS: usize = 50;

/// Relative difference from the least cost that counts as having reached it.
const REACHED: f64 = 1e-6;

/// Relative difference below which two costs are one: they come from different sums of the same squares.
const SAME: f64 = 1e-9;

/// A table for the paper's plan in its own box, and one for varied orientation.
pub fn table(seeds: u64) {
    for (plan, widen_bounds, orientation) in [
        ("one orientation, box of 1 deg and 1 mm", false, "fixed"),
        ("varied orientation, box widened", true, "varied"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        experiment::simulate(folder.path(), orientation, "1", &[]);
        let root = Utf8Path::from_path(folder.path()).expect("a path of letters");
        let rows = measurements::read(&root.join("measurements.csv")).expect("the measurements");
        let nominal = robot::file::read(&root.join("robot.toml")).expect("the robot");
        let set = Dataset::new(&rows).expect("rows to fit");
        let settings = Settings { prior: Prior::Off, widen_bounds, ..Settings::default() };
        let parameters = nominal.mdh_parameters();
        let prepared = Formulation::new(&Task {
            set: &set,
            robot: &nominal,
            parameters: &parameters,
            extras: &[],
            rows: &set.fit_rows(),
            model: Model::CenterDistance,
            smooth: None,
            settings: &settings,
        })
        .expect("enough poses");
        compare(plan, &prepared.fit(), seeds);
    }
}

fn compare(plan: &str, problem: &dyn Problem, seeds: u64) {
    let least = least_of_starts(problem);
    println!("\n{plan}: {} unknowns, least cost of {STARTS} starts {least:.6} mm2, {seeds} seeds", problem.dimension());
    println!(
        "{:20} {:>9} {:>7} {:>7} {:>24} {:>17}",
        "constants", "reached %", "below %", "level %", "evaluations to get there", "relative excess"
    );
    println!("{:20} {:>9} {:>7} {:>7} {:>12} {:>11} {:>17}", "", "", "", "", "median", "most", "median, most");
    let endless = SwarmSettings { patience: 0, ..SwarmSettings::default() };
    let others: Vec<Vec<Solution>> = (0..seeds)
        .into_par_iter()
        .map(|seed| OTHERS.map(|method| swarm::solve(problem, method, &endless, seed)).to_vec())
        .collect();
    for (name, constants) in [
        ("shipped", SwarmSettings::default()),
        ("shipped, no stop", endless.clone()),
        ("paper", SwarmSettings::paper()),
        ("paper, S = 50", with_patience(50)),
    ] {
        let ours: Vec<Solution> =
            (0..seeds).into_par_iter().map(|seed| swarm::solve(problem, Method::Stapso, &constants, seed)).collect();
        row(name, least, &ours, &others);
    }
    for (k, method) in OTHERS.iter().enumerate() {
        let alone: Vec<Solution> = others.iter().map(|o| o[k].clone()).collect();
        row(method.name(), least, &alone, &[]);
    }
}

const OTHERS: [Method; 4] = [Method::Pso, Method::Cpso, Method::Apso, Method::Arpso];

/// The paper's constants with the stop's 50 iterations as S too: the stop comes first.
fn with_patience(iterations: usize) -> SwarmSettings {
    let mut constants = SwarmSettings::paper();
    constants.stapso.stagnation_iterations = iterations;
    constants
}

fn row(name: &str, least: f64, ours: &[Solution], others: &[Vec<Solution>]) {
    let end = least * (1.0 + REACHED);
    let percent = |count: usize| 100.0 * count as f64 / ours.len() as f64;
    let mut spent: Vec<usize> = ours
        .iter()
        .filter_map(|s| s.history.iter().zip(&s.history_evaluations).find(|(c, _)| **c <= end).map(|(_, e)| *e))
        .collect();
    spent.sort_unstable();
    let mut excess: Vec<f64> = ours.iter().map(|s| s.cost / least - 1.0).collect();
    excess.sort_by(f64::total_cmp);
    // Relative to the best of the others at equal evaluations.
    let against = |(ours, theirs): (&Solution, &Vec<Solution>)| {
        let over = |t: &Solution| {
            let budget = ours.evaluations.min(t.evaluations);
            cost_after(ours, budget) / cost_after(t, budget) - 1.0
        };
        theirs.iter().map(over).fold(f64::NEG_INFINITY, f64::max)
    };
    let outcomes: Vec<f64> = ours.iter().zip(others).map(against).collect();
    let share = |inside: &dyn Fn(f64) -> bool| match outcomes.is_empty() {
        true => "-".to_owned(),
        false => format!("{:.0}", percent(outcomes.iter().filter(|o| inside(**o)).count())),
    };
    let count = |at: Option<&usize>| at.map_or("-".to_owned(), usize::to_string);
    println!(
        "{name:20} {:9.0} {:>7} {:>7} {:>12} {:>11} {:>17}",
        percent(spent.len()),
        share(&|over| over < -SAME),
        share(&|over| over.abs() <= SAME),
        count(spent.get(spent.len() / 2)),
        count(spent.last()),
        format!("{:.1e} {:.1e}", excess[excess.len() / 2], excess[excess.len() - 1]),
    );
}

/// Best cost when that many evaluations were spent.
fn cost_after(solution: &Solution, evaluations: usize) -> f64 {
    let history = solution.history.iter().zip(&solution.history_evaluations);
    history.filter(|(_, e)| **e <= evaluations).map(|(c, _)| *c).fold(f64::INFINITY, f64::min)
}

fn least_of_starts(problem: &dyn Problem) -> f64 {
    let mut random = Pcg64::seed_from_u64(99);
    let settings = DescentSettings::default();
    let starts: Vec<Vec<f64>> = (0..STARTS)
        .map(|_| {
            problem.lower().iter().zip(problem.upper()).map(|(l, u)| l + (u - l) * random.random::<f64>()).collect()
        })
        .collect();
    let costs: Vec<f64> = starts.par_iter().map(|s| trust_region::solve(problem, s, &settings).cost).collect();
    costs.into_iter().fold(f64::INFINITY, f64::min)
}
