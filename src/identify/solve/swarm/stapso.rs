//! STAPSO, section 3.2 of the paper: a swarm that on stagnation also tries sine-cosine and trust-region moves.
//!
//! 1. Halton start for positions and velocities.
//! 2. While the best cost still falls by more than beta over S iterations: eq. (14).
//! 3. On stagnation each particle has three candidates: X' of eq. (15) (the swarm's move), X'' of eq. (16) (trust-region
//!    iterations from where it is), X''' of eq. (17) and (19) (sine-cosine); eq. (18) keeps the one of least cost.
//!
//! The paper's eq. (18) writes X'' twice; (16) is X'', (17) is X'''. It leaves S, beta and the trust region's share
//! open: see [`StapsoSettings`](crate::identify::settings::StapsoSettings).

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use super::halton;
use super::particles::Swarm;
use crate::identify::settings::{DescentSettings, Method, SwarmSettings};
use crate::identify::solve::problem::{Problem, Solution, Stop};
use crate::identify::solve::trust_region;

/// Relative difference below which two costs are one: they come from different sums of the same squares.
const SAME_COST: f64 = 1e-9;

/// Runs STAPSO.
pub fn solve(problem: &dyn Problem, settings: &SwarmSettings, seed: u64) -> Solution {
    let (n, m) = (problem.dimension(), settings.particles);
    let joint = halton::points(m, 2 * n, seed);
    let half = |at: usize| joint.chunks(2 * n).flat_map(move |p| p[at..at + n].to_vec());
    let draws: Vec<f64> = half(0).chain(half(n)).collect();
    let mut swarm = Swarm::start(problem, settings, Pcg64::seed_from_u64(seed), &draws);
    swarm.run(
        |swarm, history| {
            if stagnant(history, settings) { swarm.choose(history.len()) } else { swarm.advance(Method::Pso) }
        },
    )
}

fn stagnant(history: &[f64], settings: &SwarmSettings) -> bool {
    let s = settings.stapso.stagnation_iterations;
    let now = history.len() - 1;
    now >= s && history[now - s] - history[now] <= settings.stapso.stagnation_improvement * history[now]
}

impl Swarm<'_> {
    /// One stagnant iteration `t`: the three-way choice of eq. (18).
    fn choose(&mut self, t: usize) {
        let n = self.problem.dimension();
        let m = self.settings.particles;
        let swarm = self.moved(Method::Pso);
        let wave = self.sine_cosine(t);
        let swarm_costs = self.problem.costs(&swarm);
        let wave_costs = self.problem.costs(&wave);
        let descended = self.descended();
        self.evaluations += 2 * m;
        for i in 0..m {
            let part = i * n..(i + 1) * n;
            let mut kept = (&swarm[part.clone()], swarm_costs[i]);
            if wave_costs[i] < kept.1 {
                kept = (&wave[part.clone()], wave_costs[i]);
            }
            if let Some(solution) = &descended[i] {
                self.evaluations += solution.evaluations;
                if solution.stop != Stop::IterationLimit {
                    self.bottom[i] = solution.cost;
                }
                if solution.cost < kept.1 {
                    kept = (&solution.x, solution.cost);
                }
            }
            self.x[part].copy_from_slice(kept.0);
            self.costs[i] = kept.1;
        }
        self.remember();
    }

    /// Eq. (17), r1 by eq. (19), kept in the box.
    fn sine_cosine(&mut self, t: usize) -> Vec<f64> {
        let n = self.problem.dimension();
        let (lower, upper) = (self.problem.lower(), self.problem.upper());
        let a = self.settings.stapso.sine_cosine_a;
        let r1 = a - t as f64 * a / self.settings.iterations as f64;
        let mut moved = self.x.clone();
        for (k, value) in moved.iter_mut().enumerate() {
            let r2 = std::f64::consts::TAU * self.random.random::<f64>();
            let r3 = 2.0 * self.random.random::<f64>();
            let wave = if self.random.random::<f64>() <= 0.5 { r2.sin() } else { r2.cos() };
            let step = r1 * wave * (r3 * self.own_best[k] - self.x[k]).abs();
            *value = (*value + step).clamp(lower[k % n], upper[k % n]);
        }
        moved
    }

    /// Eq. (16) for the particles of least cost; `None` for the others, and for a particle whose best place is where an
    /// earlier descent has ended: another one would end there too.
    fn descended(&self) -> Vec<Option<Solution>> {
        let n = self.problem.dimension();
        let mut order: Vec<usize> = (0..self.costs.len()).collect();
        order.sort_by(|&a, &b| self.own_cost[a].total_cmp(&self.own_cost[b]));
        let chosen = &order[..self.settings.stapso.trust_region_particles.min(order.len())];
        let trust =
            DescentSettings { iterations: self.settings.stapso.trust_region_steps, ..DescentSettings::default() };
        let step = |i: usize| trust_region::solve(self.problem, &self.own_best[i * n..(i + 1) * n], &trust);
        (0..self.costs.len())
            .into_par_iter()
            .map(|i| (chosen.contains(&i) && self.own_cost[i] < self.bottom[i] * (1.0 - SAME_COST)).then(|| step(i)))
            .collect()
    }
}
