//! Particle swarms: PSO of eq. (14) and its relatives CPSO, APSO and ARPSO; the paper's STAPSO is built on them.

pub mod halton;
mod particles;
mod stapso;

pub use particles::uniform;

use self::particles::Swarm;
use crate::identify::settings::{Method, SwarmSettings};
use crate::identify::solve::problem::{Problem, Solution};

/// Runs the swarm that `method` names (the trust region is none: it runs STAPSO's plain swarm).
pub fn solve(problem: &dyn Problem, method: Method, settings: &SwarmSettings, seed: u64) -> Solution {
    match method {
        Method::Stapso => stapso::solve(problem, settings, seed),
        _ => {
            let mut swarm = Swarm::random(problem, settings, seed);
            swarm.run(|swarm, _| swarm.advance(method))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::settings::{DescentSettings, Model, Prior, Settings};
    use crate::identify::solve::formulation::Formulation;
    use crate::identify::solve::task::Task;
    use crate::identify::solve::trust_region;
    use crate::identify::synthetic;
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;

    /// Twelve poses' worth of slack: enough rows for 19 parameters, few enough for a test.
    const SAMPLES: usize = 60;

    fn paper_settings() -> Settings {
        Settings { prior: Prior::Off, widen_bounds: false, ..Settings::default() }
    }

    fn prepared(noise_mm: f64) -> Formulation {
        let world = synthetic::world(SAMPLES, noise_mm, 7);
        let set = Dataset::new(&world.rows).unwrap();
        let parameters = world.nominal.mdh_parameters();
        let (rows, settings) = (set.fit_rows(), paper_settings());
        let plain = Task::plain(&set, &world.nominal, &parameters, &rows, &settings);
        Formulation::new(&Task { model: Model::CenterDistance, ..plain }).unwrap()
    }

    /// Best of many trust-region starts drawn in the box.
    fn best_of_starts(problem: &dyn Problem, starts: usize) -> f64 {
        let mut random = Pcg64::seed_from_u64(99);
        let start = |random: &mut Pcg64| -> Vec<f64> {
            problem.lower().iter().zip(problem.upper()).map(|(l, u)| l + (u - l) * random.random::<f64>()).collect()
        };
        let settings = DescentSettings::default();
        (0..starts)
            .map(|_| trust_region::solve(problem, &start(&mut random), &settings).cost)
            .fold(f64::INFINITY, f64::min)
    }

    /// How surely it does so, from other starts and with other constants, `cargo bench --bench identify -- constants`
    /// counts.
    #[test]
    fn stapso_ends_at_the_best_of_many_starts_and_below_the_other_swarms() {
        let prepared = prepared(0.02);
        let fit = prepared.fit();
        let least = best_of_starts(&fit, 8);
        let settings = SwarmSettings { patience: 0, ..SwarmSettings::default() };
        let ours = solve(&fit, Method::Stapso, &settings, 0);
        assert!(ours.cost <= least * (1.0 + 1e-6), "{} for {least}", ours.cost);
        for other in [Method::Pso, Method::Cpso, Method::Apso, Method::Arpso] {
            let theirs = solve(&fit, other, &settings, 0);
            let so_far = ours.history.iter().zip(&ours.history_evaluations);
            let ours_then = so_far.filter(|(_, e)| **e <= theirs.evaluations).map(|(c, _)| *c);
            let ours_then = ours_then.fold(f64::INFINITY, f64::min);
            assert!(ours_then < theirs.cost, "{other:?}: {ours_then} and {}", theirs.cost);
        }
    }
}
