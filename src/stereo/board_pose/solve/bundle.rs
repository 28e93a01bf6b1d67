//! One weighted least squares over all poses: the rig within its calibration, the target's crossings within their
//! certificate.
//!
//! In: views with whitened corners, what is known before, a start for every pose. Out: the values at the minimum and
//! the normal equations there. Method: Gauss-Newton with the poses eliminated (Triggs et al. 2000, section 6.1); a step
//! that does not lower the cost is halved. Poses are worked on in parallel and summed in their order, so that the bytes
//! do not depend on the threads.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use crate::geometry::{Transform, perturb};
use crate::imaging::Board;
use crate::stereo::board_pose::solve::pose_block::{Eliminated, PoseBlock, Scene};
use crate::stereo::board_pose::solve::prior::{RigPrior, ShapePrior, weights};
use crate::stereo::board_pose::solve::totals::Totals;
use crate::stereo::data::View;
use crate::stereo::solve::Loss;
use crate::stereo::solve::normal_equations::{inverse6, solve_scaled};

/// Steps of one search at most; each squares what is left.
const STEPS: usize = 12;

/// How close to the minimum a search goes: it is done when a step promises to lower the cost by less than this, in
/// squared residuals of unit variance. A thousandth of a standard deviation lowers it by a millionth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Promise(pub f64);

impl Promise {
    /// For values that are a result.
    pub const RESULT: Promise = Promise(1e-7);
    /// For values that only tell which corners are outliers.
    pub const ROUGH: Promise = Promise(1e-2);
}

/// Values of all unknowns.
#[derive(Debug, Clone)]
pub struct Values {
    /// Of the rig's prior.
    pub rig: DVector<f64>,
    /// The crossings' deviations from the drawing, mm.
    pub deviations_mm: Vec<Vector3<f64>>,
    /// `left_from_board` of every pose that takes part.
    pub poses: Vec<Option<Transform>>,
}

/// The problem: what was seen and what is known before.
#[derive(Debug, Clone)]
pub struct Bundle<'a> {
    /// The target as drawn.
    pub board: &'a Board,
    pub views: Vec<View>,
    /// The calibration.
    pub rig: RigPrior,
    /// The certificate.
    pub shape: ShapePrior,
    /// Standard deviation of what bent edges add to the corners of each crossing, mm.
    pub edge_bends_mm: Vec<f64>,
}

/// The normal equations.
#[derive(Debug, Clone)]
pub struct Normal {
    /// What the corners say.
    pub told: Totals,
    /// What is known before.
    pub weights: DMatrix<f64>,
    /// A part a pose that takes part.
    pub poses: Vec<Option<Eliminated>>,
}

impl<'a> Bundle<'a> {
    /// The shared unknowns as one vector.
    pub fn shared(values: &Values) -> DVector<f64> {
        let all = values.rig.iter().copied().chain(values.deviations_mm.iter().flat_map(|d| [d.x, d.y, d.z]));
        DVector::from_iterator(values.rig.len() + 3 * values.deviations_mm.len(), all)
    }

    /// The rig and the target at these values.
    pub fn scene(&self, values: &Values) -> Scene<'a> {
        Scene::new(self.rig.rig_at(&values.rig), self.board, &values.deviations_mm)
    }

    /// Linearises. `None` where a corner would lie behind its camera or no pose takes part.
    pub fn normal(&self, values: &Values, loss: Loss) -> Option<Normal> {
        let scene = self.scene(values);
        let present: Vec<(usize, &Transform)> =
            values.poses.iter().enumerate().filter_map(|(i, pose)| Some((i, pose.as_ref()?))).collect();
        if present.is_empty() {
            return None;
        }
        let mut poses = vec![None; values.poses.len()];
        let told = Totals::of(
            &present,
            (&self.rig.basis, scene.crossings.len()),
            |&(i, pose)| PoseBlock::of(&scene, pose, &self.views[i], loss),
            |k, _, part| poses[present[k].0] = Some(part),
        )?;
        let weights = weights(&self.rig, &self.shape, self.board, &told.matrix);
        Some(Normal { told, weights, poses })
    }

    /// Cost of the corners at these values; infinite where a corner would lie behind its camera.
    fn cost(&self, values: &Values, weights: &DMatrix<f64>, loss: Loss) -> f64 {
        let scene = self.scene(values);
        let of = |(view, pose): (&View, &Option<Transform>)| -> f64 {
            let Some(pose) = pose else { return 0.0 };
            let costs = view.observations.iter().filter(|o| o.active).map(|o| {
                scene.residual(pose, o).map_or(f64::INFINITY, |r| loss.cost_and_weight(o.whiten(r).norm_squared()).0)
            });
            costs.sum()
        };
        let corners: Vec<f64> = self.views.par_iter().zip(&values.poses).map(of).collect();
        let shared = Self::shared(values);
        corners.iter().sum::<f64>() + 0.5 * shared.dot(&(weights * &shared))
    }

    /// Minimises from these values. `None` where the corners do not determine the poses.
    pub fn solve(&self, start: Values, loss: Loss, least: Promise) -> Option<(Values, Normal)> {
        let mut values = start;
        let mut normal = self.normal(&values, loss)?;
        for _ in 0..STEPS {
            let (step, promise) = normal.step(&Self::shared(&values))?;
            if promise < least.0 {
                break;
            }
            let before = self.cost(&values, &normal.weights, loss);
            let mut share = 1.0;
            let better = loop {
                let trial = values.moved(&step, &normal, share);
                if self.cost(&trial, &normal.weights, loss) <= before {
                    break Some(trial);
                }
                share *= 0.5;
                if share < 1e-3 {
                    break None;
                }
            };
            let Some(trial) = better else { break };
            values = trial;
            normal = self.normal(&values, loss)?;
        }
        Some((values, normal))
    }
}

impl Values {
    /// A share of a step.
    fn moved(&self, step: &DVector<f64>, normal: &Normal, share: f64) -> Values {
        let n = self.rig.len();
        let deviation = |(k, d): (usize, &Vector3<f64>)| d + Vector3::from_fn(|i, _| share * step[n + 3 * k + i]);
        let pose = |(pose, part): (&Option<Transform>, &Option<Eliminated>)| {
            let (pose, part) = (pose.as_ref()?, part.as_ref()?);
            let shared = part.by_shared() * step;
            Some(perturb(pose, ((part.step() + shared) * share).as_slice()))
        };
        Values {
            rig: &self.rig + step.rows(0, n) * share,
            deviations_mm: self.deviations_mm.iter().enumerate().map(deviation).collect(),
            poses: self.poses.iter().zip(&normal.poses).map(pose).collect(),
        }
    }
}

impl Normal {
    /// The step of the shared unknowns from these values, and by how much the cost would fall if the equations were
    /// straight.
    fn step(&self, shared: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let gradient = &self.told.gradient + &self.weights * shared;
        let step = -solve_scaled(&(&self.told.matrix + &self.weights), &gradient)?;
        let own = self.poses.iter().flatten().map(|part| {
            let s = part.step();
            inverse6(&part.pose_inverse).map_or(0.0, |curvature| 0.5 * s.dot(&(curvature * s)))
        });
        let promise = -0.5 * gradient.dot(&step) + own.sum::<f64>();
        Some((step, promise))
    }
}
