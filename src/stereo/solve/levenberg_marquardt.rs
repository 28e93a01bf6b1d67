//! The bundle: one weighted, robust least squares over the shared numbers and a pose a pair.
//!
//! In: views with whitened corners, starting values. Out: the values at the minimum, why the search stopped, and the
//! covariance. Method: Levenberg-Marquardt with Marquardt's scaling; the poses are eliminated (see
//! [`crate::stereo::solve::normal_equations`]). Blocks are computed in parallel and summed in the order of the pairs,
//! so that the bytes do not depend on the threads. Goes wrong: a start so far off that a board would have to pass
//! through a camera; unknowns that the views do not determine (no covariance then).

use std::collections::VecDeque;
use std::slice;

use nalgebra::{DVector, Vector6};
use rayon::prelude::*;

use crate::geometry::{Transform, perturb};
use crate::stereo::data::View;
use crate::stereo::model::{Layout, Values};
use crate::stereo::solve::normal_equations::{self, Block};
use crate::stereo::solve::{Equations, Loss, Priors};

/// The search is done when even a strongly damped step does not lower the cost.
const MAX_DAMPING: f64 = 1e12;

/// Numbers of a rich lens that only the corners farthest out tell apart are eleven orders of magnitude weaker than the
/// others: more damping than this would slow them down, less is lost in rounding.
const LEAST_DAMPING: f64 = 1e-14;

/// So many last steps that together lower half of chi-squared by less than this have moved nothing by a seventh of its
/// standard deviation.
const LATELY: usize = 20;
const NO_MATTER: f64 = 0.01;

/// Share of the cost by which rounding may hide a gain.
const ROUNDING: f64 = 1e-9;

/// Share of the gain that the linear equations foretell below which they are no longer good.
const FORETOLD: f64 = 0.75;

/// How far a search goes, and how carefully it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Damping of the first step: near the minimum hardly any is needed, and any slows the weak directions down.
    first_damping: f64,
    /// The search is done when a step is predicted to lower the cost by less than this share; that step is still taken.
    cost_share: f64,
    /// Steps that are tried at most.
    most_steps: usize,
}

impl Search {
    /// A start for another search: from afar, to about a standard deviation.
    pub const ROUGH: Search = Search { first_damping: 1e-4, cost_share: 1e-5, most_steps: 50 };
    /// A pose by itself, within another search.
    const POSE: Search = Search { first_damping: 1e-4, cost_share: 1e-6, most_steps: 30 };
    /// While the corners' weights are looked for: to about a tenth of a standard deviation.
    pub const WEIGHTS: Search = Search { first_damping: 1e-9, cost_share: 1e-6, most_steps: 100 };
    /// From a minimum of nearly the same problem to the limit of rounding.
    pub const NEAR: Search = Search { first_damping: 1e-9, cost_share: 1e-13, most_steps: 400 };
    /// The same with a robust loss, to a thousandth of a standard deviation: what squares of the same weights then reach
    /// is the last word.
    pub const ROBUST: Search = Search { first_damping: 1e-9, cost_share: 1e-10, most_steps: 100 };
    /// From a minimum of nearly the same problem to a hundredth of a standard deviation: a model on trial. A tilted
    /// sensor, its centre and its prism are exchanged for each other along a bent valley of up to two hundred steps;
    /// what creeps on for longer is no model that these views determine.
    pub const TRIAL: Search = Search { first_damping: 1e-9, cost_share: 1e-8, most_steps: 300 };
}

/// Why a search stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// At a minimum: no step lowers the cost noticeably.
    Minimum,
    /// After the largest number of steps, the last of which lowered the cost by nothing that matters.
    Valley,
    /// Elsewhere: after the largest number of steps; where not even a strongly damped step lowers the cost though the
    /// equations promise that one does, as it jumps there; or at the start, with a corner behind its camera or views
    /// that do not determine the poses.
    Elsewhere,
}

/// The end of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    pub values: Values,
    /// Half the (robust) sum of squares there.
    pub cost: f64,
    pub stop: Stop,
    pub steps: usize,
}

/// Minimises with what is expected of the shared numbers. Views and `start.poses` correspond by place.
pub fn solve(views: &[View], layout: &Layout, priors: &Priors, start: Values, loss: Loss, search: Search) -> Solution {
    let problem = Robust { views, layout, priors, loss };
    let Some(mut equations) = problem.equations(&start) else {
        return Solution { values: start, cost: f64::INFINITY, stop: Stop::Elsewhere, steps: 0 };
    };
    let mut values = start;
    let mut cost = equations.cost();
    let mut damping = search.first_damping;
    // Grows while steps fail: the way up from hardly any damping would be long otherwise.
    let mut rise = 10.0;
    let mut lately = VecDeque::from([cost]);
    for steps in 1..=search.most_steps {
        let mut accepted = false;
        let at = (&values, &equations, cost);
        let attempt = problem.attempt(at, damping, steps > LATELY);
        if let Some(Attempt { values: trial, equations: next, predicted_gain }) = attempt {
            let gain = next.as_ref().map_or(f64::NEG_INFINITY, |next| cost - next.cost());
            if let Some(next) = next.filter(|_| gain >= 0.0) {
                values = trial;
                equations = next;
                cost -= gain;
                damping = (damping * damping_change(gain / predicted_gain)).max(LEAST_DAMPING);
                rise = 10.0;
                accepted = true;
            }
            // Rounding in the sum of the costs hides gains smaller than this: the prediction decides.
            if predicted_gain <= search.cost_share * cost {
                return Solution { values, cost, stop: Stop::Minimum, steps };
            }
        }
        lately.push_back(cost);
        if lately.len() > LATELY + 1 {
            lately.pop_front();
        }
        if !accepted {
            damping *= rise;
            rise *= 10.0;
            if damping > MAX_DAMPING {
                // No step lowers the cost, however short: a minimum but for rounding, unless the equations still
                // promise something.
                let promised =
                    try_step(layout, &values, &equations, search.first_damping).map_or(f64::INFINITY, |s| s.1);
                let minimum = promised < NO_MATTER.max(ROUNDING * cost);
                let stop = if minimum { Stop::Minimum } else { Stop::Elsewhere };
                return Solution { values, cost, stop, steps };
            }
        }
    }
    // Numbers of a rich lens that nothing tells apart make a valley without an end; along it nothing changes that
    // matters.
    let gained = lately.front().map_or(f64::INFINITY, |before| before - cost);
    let stop = if lately.len() > LATELY && gained < NO_MATTER { Stop::Valley } else { Stop::Elsewhere };
    Solution { values, cost, stop, steps: search.most_steps }
}

/// Where a step leads.
struct Attempt {
    values: Values,
    /// There; `None` where a corner would lie behind its camera.
    equations: Option<Equations>,
    predicted_gain: f64,
}

/// What a search minimises.
struct Robust<'a> {
    views: &'a [View],
    layout: &'a Layout,
    priors: &'a Priors,
    loss: Loss,
}

impl Robust<'_> {
    fn equations(&self, values: &Values) -> Option<Equations> {
        equations(self.views, self.layout, self.priors, values, self.loss)
    }

    /// A step from these values with their equations and cost; of a search that has gone on for `long` with a search
    /// for each pose. `None` where the equations have no solution with this damping.
    fn attempt(
        &self,
        (values, equations, cost): (&Values, &Equations, f64),
        damping: f64,
        long: bool,
    ) -> Option<Attempt> {
        let (values, predicted_gain) = try_step(self.layout, values, equations, damping)?;
        let mut reached = Attempt { equations: self.equations(&values), values, predicted_gain };
        if let Some(there) = reached.equations.as_mut().filter(|there| cost - there.cost() < FORETOLD * predicted_gain)
        {
            // What bends is mostly the poses' part in it: they follow the shared numbers, each where that is nearer,
            // for the pose of a pair whose corners contradict each other jumps. A step does for most; a small board
            // that faces its camera has two poses beside each other and no slope between them.
            let followed = if long && self.layout.count() > 0 {
                Some(self.with_poses_searched(&reached.values))
            } else {
                with_poses_following(&reached.values, there)
            };
            let then = followed.as_ref().and_then(|followed| self.equations(followed));
            if let Some((followed, then)) = followed.zip(then) {
                let own = reached.values.poses.iter_mut().zip(&mut there.blocks);
                for ((pose, block), (follows, then)) in own.zip(followed.poses.into_iter().zip(then.blocks)) {
                    if then.cost < block.cost {
                        (*pose, *block) = (follows, then);
                    }
                }
            }
        }
        Some(reached)
    }

    /// The values with each pose where its pair's cost is least with these shared numbers.
    fn with_poses_searched(&self, values: &Values) -> Values {
        let pose = |(view, pose): (&View, &Transform)| {
            let alone = Values { shared: values.shared.clone(), poses: vec![*pose] };
            let found =
                solve(slice::from_ref(view), &Layout::POSES_ONLY, &Priors::NONE, alone, self.loss, Search::POSE);
            found.values.poses.first().copied().unwrap_or(*pose)
        };
        let poses = self.views.par_iter().zip(&values.poses).map(pose).collect();
        Values { shared: values.shared.clone(), poses }
    }
}

/// How the damping changes after a step that gained this share of its prediction. Gauss-Newton overshoots along weak
/// directions where the residuals bend: the gain is small then, and more damping converges faster.
fn damping_change(share: f64) -> f64 {
    match share {
        s if s > 0.75 => 0.1,
        s if s < 0.25 => 8.0,
        _ => 1.0,
    }
}

/// The normal equations; the pairs' shares in their order. `None` where a corner would lie behind its camera.
pub fn equations(views: &[View], layout: &Layout, priors: &Priors, values: &Values, loss: Loss) -> Option<Equations> {
    let block = |(view, pose)| normal_equations::block(&values.shared, layout, pose, view, loss);
    let blocks: Vec<Option<Block>> = views.par_iter().zip(&values.poses).map(block).collect();
    let blocks = blocks.into_iter().collect::<Option<Vec<Block>>>()?;
    Some(Equations { blocks, prior: priors.information(layout, &values.shared) })
}

/// The values with each pose moved by its own Gauss-Newton step, the shared numbers as they are.
fn with_poses_following(values: &Values, there: &Equations) -> Option<Values> {
    let poses = there.blocks.iter().zip(&values.poses).map(|(block, pose)| {
        let step: Vector6<f64> = -(block.pose_inverse(0.0)? * block.pose_gradient);
        Some(perturb(pose, step.as_slice()))
    });
    Some(Values { shared: values.shared.clone(), poses: poses.collect::<Option<_>>()? })
}

/// The damped step and the gain that the linear equations predict. `None` where the damped system is still singular.
fn try_step(layout: &Layout, values: &Values, equations: &Equations, damping: f64) -> Option<(Values, f64)> {
    let count = layout.count();
    let step = if count == 0 {
        DVector::zeros(0)
    } else {
        let (matrix, gradient) = normal_equations::eliminate(equations, damping)?;
        -normal_equations::solve_scaled(&matrix, &gradient)?
    };
    let mut predicted_gain = -0.5 * equations.prior.gradient.dot(&step);
    let mut poses = Vec::with_capacity(equations.blocks.len());
    for (block, pose) in equations.blocks.iter().zip(&values.poses) {
        let right = block.pose_gradient + block.mixed.tr_mul(&step);
        let pose_step: Vector6<f64> = -(block.pose_inverse(damping)? * right);
        predicted_gain -= 0.5 * block.pose_gradient.dot(&pose_step);
        poses.push(perturb(pose, pose_step.as_slice()));
        predicted_gain -= 0.5 * block.shared_gradient.dot(&step);
    }
    Some((Values { shared: layout.step(&values.shared, step.as_slice()), poses }, predicted_gain))
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::geometry::transform;
    use crate::stereo::data::Noise;
    use crate::stereo::model::Shared;
    use crate::stereo::model::board_shape::FLAT;
    use crate::stereo::synthetic::World;

    /// Boards that hardly tilt and begin tilted the other way: a step of each pose leads far from where it ends.
    #[test]
    fn a_pose_that_is_searched_ends_where_a_step_does_not() {
        let world = World::facing(6, |i| Vector3::new(0.02 * i, 0.03, 0.0));
        let corners = world.corners(1);
        let mut views: Vec<View> = corners.pairs.iter().map(|pair| View::new(&world.board, pair, 0)).collect();
        Noise { factor: 1.0, added_px: 0.0, reduced_chi_square: None }.apply(&mut views);
        let (layout, priors) = (Layout::POSES_ONLY, Priors::NONE);
        let robust = Robust { views: &views, layout: &layout, priors: &priors, loss: Loss::Student(4.0) };
        let at = |poses: Vec<Transform>| Values { shared: Shared { rig: world.rig.clone(), shape_mm: FLAT }, poses };
        let other_way = transform(Vector3::new(-0.5, -0.3, 0.0), Vector3::zeros());
        let start = at(world.poses.iter().map(|pose| pose * other_way).collect());
        let there = robust.equations(&start).unwrap();
        let cost = |values: &Values| robust.equations(values).unwrap().cost();
        let truth = cost(&at(world.poses.clone()));
        let searched = cost(&robust.with_poses_searched(&start));
        let step = cost(&with_poses_following(&start, &there).unwrap());
        assert!(searched < truth && step > 2.0 * truth, "{searched} and {step} where the truth is {truth}");
    }
}
