//! What a solver sees: a vector of parameters in a box, residuals, their derivatives and the cost.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// A least-squares problem in a box. The cost is half the sum of the squared residuals, as in eq. (12).
pub trait Problem: Sync {
    /// Lower bounds, one a parameter; their number is the dimension.
    fn lower(&self) -> &[f64];

    /// Upper bounds.
    fn upper(&self) -> &[f64];

    fn residuals(&self, x: &[f64]) -> DVector<f64>;

    /// The residuals at `x` and their derivatives, a column a parameter.
    fn linearised(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>);

    /// The cost of many points that stand one after the other in `xs`. The same for any number of threads.
    fn costs(&self, xs: &[f64]) -> Vec<f64> {
        xs.par_chunks(self.lower().len().max(1)).map(|x| 0.5 * self.residuals(x).norm_squared()).collect()
    }

    /// Number of parameters.
    fn dimension(&self) -> usize {
        self.lower().len()
    }
}

/// Why a solver stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// The cost no longer falls.
    SmallReduction,
    /// The steps have become as small as rounding.
    SmallStep,
    /// The gradient vanishes.
    SmallGradient,
    /// The best cost has not improved for so many iterations.
    Stagnation,
    /// The iterations are used up.
    IterationLimit,
    /// The cost is not a number at the start.
    NotFinite,
}

/// What a solver found and how it went.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The best point.
    pub x: Vec<f64>,
    pub cost: f64,
    pub iterations: usize,
    /// Evaluations of the residuals; a Jacobian counts as one for each of its columns.
    pub evaluations: usize,
    /// Best cost after each iteration, the start first.
    pub history: Vec<f64>,
    /// Evaluations used at each entry of the history.
    pub history_evaluations: Vec<usize>,
    pub stop: Stop,
}
