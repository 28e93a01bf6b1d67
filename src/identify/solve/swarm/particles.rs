//! Particle swarms: PSO of eq. (14) and its relatives CPSO, APSO and ARPSO; the paper's STAPSO is built on them.
//!
//! In: a problem in a box, constants, a seed. Out: the best point with its history. Random numbers are drawn by one
//! generator in a fixed order and costs are summed in a fixed order, so that any number of threads gives the same
//! bytes. Eq. (14) draws one number a dimension for the particle's own best and one number a particle for the swarm's
//! best. What goes wrong: eq. (14) has no inertia, so velocities are limited; a particle that meets a wall stops there.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::identify::settings::{Method, SwarmSettings};
use crate::identify::solve::problem::{Problem, Solution, Stop};

/// Pseudo-random numbers in [0, 1).
pub fn uniform(count: usize, seed: u64) -> Vec<f64> {
    let mut random = Pcg64::seed_from_u64(seed);
    (0..count).map(|_| random.random::<f64>()).collect()
}

/// Positions and velocities, one particle after the other.
pub struct Swarm<'a> {
    pub(super) problem: &'a dyn Problem,
    pub(super) settings: &'a SwarmSettings,
    pub(super) random: Pcg64,
    pub(super) x: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) costs: Vec<f64>,
    pub(super) own_best: Vec<f64>,
    pub(super) own_cost: Vec<f64>,
    pub(super) best: Vec<f64>,
    pub(super) best_cost: f64,
    pub(super) evaluations: usize,
    /// Cost at which a particle's last descent by the trust region converged; infinite where none has.
    pub(super) bottom: Vec<f64>,
    /// Mean distance to the mean point over the box's diagonal, as ARPSO last judged it: 1 attracts, -1 repels.
    pub(super) direction: f64,
}

impl<'a> Swarm<'a> {
    /// Uniform positions and velocities.
    pub fn random(problem: &'a dyn Problem, settings: &'a SwarmSettings, seed: u64) -> Swarm<'a> {
        let draws = uniform(2 * settings.particles * problem.dimension(), seed);
        let random = Pcg64::seed_from_u64(seed.wrapping_add(1));
        Swarm::start(problem, settings, random, &draws)
    }

    /// From numbers in [0, 1): the positions of all particles, then their velocities.
    pub(super) fn start(
        problem: &'a dyn Problem,
        settings: &'a SwarmSettings,
        random: Pcg64,
        draws: &[f64],
    ) -> Swarm<'a> {
        let n = problem.dimension();
        let (lower, upper) = (problem.lower(), problem.upper());
        let (for_x, for_v) = draws.split_at(settings.particles * n);
        let spread = |(k, u): (usize, &f64)| lower[k % n] + u * (upper[k % n] - lower[k % n]);
        let x: Vec<f64> = for_x.iter().enumerate().map(spread).collect();
        let v = for_v
            .iter()
            .enumerate()
            .map(|(k, u)| (2.0 * u - 1.0) * settings.velocity_limit * (upper[k % n] - lower[k % n]))
            .collect();
        let costs = problem.costs(&x);
        let mut swarm = Swarm {
            problem,
            settings,
            random,
            own_best: x.clone(),
            own_cost: costs.clone(),
            best: x[..n].to_vec(),
            best_cost: f64::INFINITY,
            evaluations: settings.particles,
            bottom: vec![f64::INFINITY; settings.particles],
            x,
            v,
            costs,
            direction: 1.0,
        };
        swarm.remember();
        swarm
    }

    /// Iterates `step` until the iterations or the patience are used up. `step` gets the history of best costs.
    pub(super) fn run(&mut self, mut step: impl FnMut(&mut Swarm<'a>, &[f64])) -> Solution {
        let mut history = vec![self.best_cost];
        let mut history_evaluations = vec![self.evaluations];
        let mut stop = if self.best_cost.is_finite() { Stop::IterationLimit } else { Stop::NotFinite };
        let mut iterations = 0;
        while iterations < self.settings.iterations && stop == Stop::IterationLimit {
            iterations += 1;
            step(self, &history);
            history.push(self.best_cost);
            history_evaluations.push(self.evaluations);
            let patience = self.settings.patience;
            if patience > 0
                && iterations >= patience
                && history[iterations - patience] - self.best_cost < self.settings.improvement_mm2
            {
                stop = Stop::Stagnation;
            }
        }
        let (x, cost, evaluations) = (self.best.clone(), self.best_cost, self.evaluations);
        Solution { x, cost, iterations, evaluations, history, history_evaluations, stop }
    }

    /// One iteration of a plain swarm.
    pub(super) fn advance(&mut self, method: Method) {
        self.x = self.moved(method);
        self.costs = self.problem.costs(&self.x);
        self.evaluations += self.settings.particles;
        self.remember();
    }

    /// Takes over what is better than a particle's best and the swarm's best.
    pub(super) fn remember(&mut self) {
        let n = self.problem.dimension();
        for (i, &cost) in self.costs.iter().enumerate() {
            let x = &self.x[i * n..(i + 1) * n];
            if cost < self.own_cost[i] {
                self.own_cost[i] = cost;
                self.own_best[i * n..(i + 1) * n].copy_from_slice(x);
            }
            if cost < self.best_cost {
                self.best_cost = cost;
                self.best.copy_from_slice(x);
            }
        }
    }

    /// New velocities by the method's rule; returns the new positions.
    pub(super) fn moved(&mut self, method: Method) -> Vec<f64> {
        let n = self.problem.dimension();
        let s = self.settings;
        let (lower, upper) = (self.problem.lower(), self.problem.upper());
        let mean_cost = self.costs.iter().sum::<f64>() / self.costs.len() as f64;
        let least_cost = self.costs.iter().copied().fold(f64::INFINITY, f64::min);
        if method == Method::Arpso {
            self.direction = self.attract_or_repel();
        }
        let mut moved = self.x.clone();
        for i in 0..s.particles {
            let rule = match method {
                Method::Cpso => Rule::constricted(s.cpso_c),
                Method::Apso => Rule {
                    inertia: adaptive_inertia(self.costs[i], least_cost, mean_cost, s.apso_inertia),
                    own: s.c1,
                    swarm: s.c2,
                },
                Method::Arpso => {
                    let rule = Rule::constricted(s.cpso_c);
                    Rule { inertia: rule.inertia, own: self.direction * rule.own, swarm: self.direction * rule.swarm }
                }
                _ => Rule { inertia: 1.0, own: s.c1, swarm: s.c2 },
            };
            let towards_best: f64 = self.random.random();
            for d in 0..n {
                let k = i * n + d;
                let limit = s.velocity_limit * (upper[d] - lower[d]);
                let towards_own: f64 = self.random.random();
                let pull = rule.own * towards_own * (self.own_best[k] - self.x[k])
                    + rule.swarm * towards_best * (self.best[d] - self.x[k]);
                let v = (rule.inertia * self.v[k] + pull).clamp(-limit, limit);
                moved[k] = (self.x[k] + v).clamp(lower[d], upper[d]);
                self.v[k] = if moved[k] == lower[d] || moved[k] == upper[d] { 0.0 } else { v };
            }
        }
        moved
    }

    /// Riget and Vesterstrom's switch: repel when the swarm has drawn together, attract when it is wide again.
    fn attract_or_repel(&self) -> f64 {
        let n = self.problem.dimension();
        let m = self.settings.particles;
        let width: Vec<f64> = self.problem.lower().iter().zip(self.problem.upper()).map(|(l, u)| u - l).collect();
        let mut mean = vec![0.0; n];
        for (k, x) in self.x.iter().enumerate() {
            mean[k % n] += x / (m as f64 * width[k % n]);
        }
        let away = |x: &[f64]| (0..n).map(|d| (x[d] / width[d] - mean[d]).powi(2)).sum::<f64>().sqrt();
        let diversity = self.x.chunks(n).map(away).sum::<f64>() / (m as f64 * (n as f64).sqrt());
        let [low, high] = self.settings.arpso_diversity;
        if diversity < low {
            -1.0
        } else if diversity > high {
            1.0
        } else {
            self.direction
        }
    }
}

/// Factors of a velocity update.
struct Rule {
    inertia: f64,
    own: f64,
    swarm: f64,
}

impl Rule {
    /// Clerc and Kennedy: chi = 2 / |2 - phi - sqrt(phi^2 - 4 phi)|, phi = 2c.
    fn constricted(c: f64) -> Rule {
        let phi = 2.0 * c;
        let chi = 2.0 / (2.0 - phi - (phi * phi - 4.0 * phi).sqrt()).abs();
        Rule { inertia: chi, own: chi * c, swarm: chi * c }
    }
}

/// Little inertia for particles better than the mean, full inertia for the others.
fn adaptive_inertia(cost: f64, least: f64, mean: f64, [low, high]: [f64; 2]) -> f64 {
    if cost <= mean && mean > least { low + (high - low) * (cost - least) / (mean - least) } else { high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A round bowl whose bottom is not at zero cost, off the middle of its box.
    struct Bowl {
        lower: Vec<f64>,
        upper: Vec<f64>,
    }

    const BOWL_DIMENSION: usize = 4;

    fn bowl() -> Bowl {
        Bowl { lower: vec![-1.0; BOWL_DIMENSION], upper: vec![1.0; BOWL_DIMENSION] }
    }

    impl Problem for Bowl {
        fn lower(&self) -> &[f64] {
            &self.lower
        }

        fn upper(&self) -> &[f64] {
            &self.upper
        }

        fn residuals(&self, x: &[f64]) -> DVector<f64> {
            DVector::from_iterator(x.len() + 1, x.iter().map(|x| x - 0.2).chain([1.0]))
        }

        fn linearised(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
            (self.residuals(x), DMatrix::identity(x.len() + 1, x.len()))
        }
    }

    /// Clerc and Kennedy give 0.7298 for phi = 4.1; another factor still finds minima, but is not theirs.
    #[test]
    fn the_constriction_is_the_published_one() {
        let rule = Rule::constricted(SwarmSettings::default().cpso_c);
        assert!((rule.inertia - 0.7298).abs() < 5e-5, "{}", rule.inertia);
        assert!((rule.own - 2.05 * 0.7298).abs() < 1e-4 && rule.own == rule.swarm);
    }

    #[test]
    fn inertia_grows_with_the_cost_up_to_the_mean_and_is_full_beyond() {
        let inertia = |cost: f64| adaptive_inertia(cost, 1.0, 3.0, [0.4, 0.9]);
        assert_eq!([1.0, 2.0, 3.0].map(inertia), [0.4, 0.65, 0.9]);
        assert_eq!([3.5, 100.0].map(inertia), [0.9, 0.9]);
        // Particles that all cost the same have no spread to divide by.
        assert_eq!(adaptive_inertia(2.0, 2.0, 2.0, [0.4, 0.9]), 0.9);
    }

    /// The stop is by what the cost fell by, and not by its share: the bottom of the bowl is not at zero.
    #[test]
    fn a_swarm_stops_as_soon_as_its_patience_gained_too_little() {
        let (bowl, settings) = (bowl(), SwarmSettings { patience: 10, ..SwarmSettings::default() });
        let found = Swarm::random(&bowl, &settings, 3).run(|swarm, _| swarm.advance(Method::Cpso));
        assert!(found.stop == Stop::Stagnation && found.iterations < settings.iterations, "{:?}", found.stop);
        let gains: Vec<f64> =
            found.history.windows(settings.patience + 1).map(|w| w[0] - w[settings.patience]).collect();
        let (last, before) = gains.split_last().unwrap();
        assert!(*last < settings.improvement_mm2 && before.iter().all(|gain| *gain >= settings.improvement_mm2));
    }
}
