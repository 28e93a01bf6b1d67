//! The bundle: one weighted, robust least squares over the shared numbers and a pose a pair.
//!
//! In: views with whitened corners, starting values. Out: the values at the minimum, why the search stopped, and the
//! covariance. Method: Levenberg-Marquardt with Marquardt's scaling; the poses are eliminated (see [`super::schur`]).
//! Blocks are computed in parallel and summed in the order of the pairs, so that the bytes do not depend on the threads.
//! Goes wrong: a start so far off that a board would have to pass through a camera; unknowns that the views do not determine
//! (no covariance then).

use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};
use rayon::prelude::*;

use super::layout::{Layout, Shared};
use super::observations::View;
use super::robust::Loss;
use super::schur::{self, Block};
use crate::geometry::{Transform, perturb};

/// The search is done when even a strongly damped step does not lower the cost.
const MAX_DAMPING: f64 = 1e12;

/// How far a search goes, and how carefully it begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Search {
    /// Damping of the first step: near the minimum hardly any is needed, and any slows the weak directions down.
    first_damping: f64,
    /// The search is done when a step promises to lower the cost by less than this share; that step is still taken.
    cost_share: f64,
    /// Steps that are tried at most.
    most_steps: usize,
}

impl Search {
    /// A start for another search: from afar, to about a tenth of a standard deviation.
    pub const ROUGH: Search = Search { first_damping: 1e-4, cost_share: 1e-7, most_steps: 50 };
    /// From afar to the limit of rounding.
    pub const EXACT: Search = Search { first_damping: 1e-4, cost_share: 1e-13, most_steps: 100 };
    /// From a minimum of nearly the same problem to the limit of rounding.
    pub const NEAR: Search = Search { first_damping: 1e-9, cost_share: 1e-13, most_steps: 100 };
    /// From a minimum of nearly the same problem to a hundredth of a standard deviation: a model on trial. What creeps on for longer
    /// than this is a valley, and no model that these views determine.
    pub const TRIAL: Search = Search { first_damping: 1e-9, cost_share: 1e-8, most_steps: 30 };
}

/// Values of all unknowns.
#[derive(Debug, Clone, PartialEq)]
pub struct Values {
    /// The rig and the board's shape.
    pub shared: Shared,
    /// `left_from_board` of every view.
    pub poses: Vec<Transform>,
}

/// Why a search stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// At a minimum: no step lowers the cost noticeably.
    Minimum,
    /// After the largest number of steps.
    Steps,
    /// A corner lies behind its camera at the start, or the views do not determine the poses.
    NoStart,
}

/// The end of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The values reached.
    pub values: Values,
    /// Half the (robust) sum of squares there.
    pub cost: f64,
    /// Why it stopped.
    pub stop: Stop,
    /// Steps tried.
    pub steps: usize,
}

/// Minimises. Views and `start.poses` correspond by place.
pub fn solve(views: &[View], layout: &Layout, start: Values, loss: Loss, search: Search) -> Solution {
    let Some(mut blocks) = blocks(views, layout, &start, loss) else {
        return Solution { values: start, cost: f64::INFINITY, stop: Stop::NoStart, steps: 0 };
    };
    let mut values = start;
    let mut cost = total_cost(&blocks);
    let mut damping = search.first_damping;
    // Grows while steps fail: the way up from hardly any damping would be long otherwise.
    let mut rise = 10.0;
    for steps in 1..=search.most_steps {
        let mut accepted = false;
        if let Some((trial, promise)) = try_step(layout, &values, &blocks, damping) {
            let next = self::blocks(views, layout, &trial, loss);
            let gain = next.as_ref().map_or(f64::NEG_INFINITY, |b| cost - total_cost(b));
            if let Some(next) = next.filter(|_| gain >= 0.0) {
                values = trial;
                blocks = next;
                cost -= gain;
                damping = (damping * damping_change(gain / promise)).max(1e-10);
                rise = 10.0;
                accepted = true;
            }
            // Rounding in the sum of the costs hides gains smaller than this: what is promised decides.
            if promise <= search.cost_share * cost {
                return Solution { values, cost, stop: Stop::Minimum, steps };
            }
        }
        if !accepted {
            damping *= rise;
            rise *= 10.0;
            if damping > MAX_DAMPING {
                return Solution { values, cost, stop: Stop::Minimum, steps };
            }
        }
    }
    Solution { values, cost, stop: Stop::Steps, steps: search.most_steps }
}

/// How the damping changes after a step that gained this share of its promise. Gauss-Newton overshoots along weak directions
/// where the residuals bend: the gain is small then, and more damping converges faster.
fn damping_change(share: f64) -> f64 {
    match share {
        s if s > 0.75 => 0.1,
        s if s < 0.25 => 8.0,
        _ => 1.0,
    }
}

/// The blocks of all pairs, in their order. `None` where a corner would lie behind its camera.
pub fn blocks(views: &[View], layout: &Layout, values: &Values, loss: Loss) -> Option<Vec<Block>> {
    views
        .par_iter()
        .zip(&values.poses)
        .map(|(view, pose)| schur::block(&values.shared, layout, pose, view, loss))
        .collect::<Vec<_>>()
        .into_iter()
        .collect()
}

fn total_cost(blocks: &[Block]) -> f64 {
    blocks.iter().map(|b| b.cost).sum()
}

/// The damped step and the gain it promises. `None` where the damped system is still singular.
fn try_step(layout: &Layout, values: &Values, blocks: &[Block], damping: f64) -> Option<(Values, f64)> {
    let count = layout.count();
    let step = if count == 0 {
        DVector::zeros(0)
    } else {
        let (matrix, gradient) = schur::eliminate(blocks, damping, count)?;
        -schur::solve_scaled(&matrix, &gradient)?
    };
    let mut promise = 0.0;
    let mut poses = Vec::with_capacity(blocks.len());
    for (block, pose) in blocks.iter().zip(&values.poses) {
        let right = block.pose_gradient + block.mixed.tr_mul(&step);
        let pose_step: Vector6<f64> = -(block.pose_inverse(damping)? * right);
        promise -= 0.5 * block.pose_gradient.dot(&pose_step);
        poses.push(perturb(
            pose,
            Vector3::new(pose_step[0], pose_step[1], pose_step[2]),
            Vector3::new(pose_step[3], pose_step[4], pose_step[5]),
        ));
        promise -= 0.5 * block.shared_gradient.dot(&step);
    }
    Some((Values { shared: layout.step(&values.shared, step.as_slice()), poses }, promise))
}

/// By how much chi-square (twice the cost) would fall if the equations were straight from here to the minimum: what a richer
/// model promises at a simpler one's minimum (Rao's score). `None` where the views do not determine the unknowns.
pub fn promised_chi_square(blocks: &[Block], layout: &Layout) -> Option<f64> {
    let (matrix, gradient) = schur::eliminate(blocks, 0.0, layout.count())?;
    Some(gradient.dot(&(invert(&matrix)? * &gradient)))
}

/// Covariance of the shared numbers and of each pose (its own block), with unit variance of the whitened residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Of the shared numbers, in the layout's order.
    pub shared: DMatrix<f64>,
    /// Of each pose: rotation (rad), then translation (mm); the share of the shared numbers included.
    pub poses: Vec<Matrix6<f64>>,
}

impl Uncertainty {
    /// All covariances times a factor.
    pub fn scaled(mut self, factor: f64) -> Uncertainty {
        self.shared *= factor;
        self.poses.iter_mut().for_each(|pose| *pose *= factor);
        self
    }
}

/// Covariance at a minimum. `None` where the views do not determine the unknowns.
pub fn uncertainty(views: &[View], layout: &Layout, values: &Values) -> Option<Uncertainty> {
    uncertainty_of(&blocks(views, layout, values, Loss::Squared)?, layout)
}

/// The same from the blocks at the minimum.
pub fn uncertainty_of(blocks: &[Block], layout: &Layout) -> Option<Uncertainty> {
    let count = layout.count();
    let shared = if count == 0 { DMatrix::zeros(0, 0) } else { invert(&schur::eliminate(blocks, 0.0, count)?.0)? };
    let poses = blocks
        .iter()
        .map(|block| {
            let inverse = block.pose_inverse(0.0)?;
            let through = inverse * block.mixed.transpose();
            let spread = &through * &shared * through.transpose();
            Some(inverse + Matrix6::from_fn(|i, j| spread[(i, j)]))
        })
        .collect::<Option<Vec<_>>>()?;
    Some(Uncertainty { shared, poses })
}

/// Inverse of a symmetric positive definite matrix with rows of different units; `None` where it is singular to rounding.
pub fn invert(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    /// Smallest share of its scaled eigenvalues that double precision still tells from a dependence.
    const SMALLEST: f64 = 1e-13;
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let n = matrix.nrows();
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let eigen = scaled.clone().symmetric_eigen();
    if eigen.eigenvalues.min() <= SMALLEST * eigen.eigenvalues.max() {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| 0.5 * (inverse[(i, j)] + inverse[(j, i)]) * scale[i] * scale[j]))
}
