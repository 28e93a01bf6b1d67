//! What the normal equations at a minimum say about uncertainty: covariances, and whether the views determine the
//! cameras.
//!
//! In: the blocks of all pairs at a minimum. Out: the covariance of the shared numbers, with unit variance of the
//! whitened residuals. Goes wrong: numbers that the views do not determine; then there is no covariance.

use nalgebra::{DMatrix, DMatrixViewMut};
use rayon::prelude::*;

use crate::linear_algebra::to_unit_diagonal;
use crate::stereo::model::Layout;
use crate::stereo::solve::normal_equations::{self, Block, Equations};
use crate::stereo::{Rig, Side};

/// A focal length that is known no better than this share tells no lens from another, and no rig passes with it.
pub const WORST_FOCAL_SIGMA: f64 = 0.1;
/// One that is known no better than this was told by what focal lengths usually are (a factor of two, see `priors`),
/// not by the pictures.
pub const UNTOLD_FOCAL_SIGMA: f64 = 0.35;

/// By how much chi-square (twice the cost) would fall if the equations were straight from here to the minimum: what a
/// richer model is expected to gain at a simpler one's minimum (Rao's score), or other data at the minimum of these.
/// `None` where the views do not determine the unknowns.
pub fn expected_decrease(equations: &Equations) -> Option<f64> {
    let (matrix, gradient) = normal_equations::eliminate(equations, 0.0)?;
    let of_pose = |block: &Block| Some(block.pose_gradient.dot(&(block.pose_inverse(0.0)? * block.pose_gradient)));
    let of_poses = equations.blocks.iter().map(of_pose).sum::<Option<f64>>()?;
    Some(of_poses + gradient.dot(&(invert(&matrix)? * &gradient)))
}

/// Covariance of the shared numbers at a minimum, from the equations there. `None` where the views do not determine
/// them.
pub fn covariance(equations: &Equations) -> Option<DMatrix<f64>> {
    invert(&normal_equations::eliminate(equations, 0.0)?.0)
}

/// Inverse of a symmetric positive definite matrix with rows of different units; `None` where it is singular to
/// rounding.
pub fn invert(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    /// Columns of the inverse that are worked on at a time.
    const COLUMNS: usize = 16;
    /// Smallest share of its scaled eigenvalues that double precision still tells from a dependence.
    const SMALLEST: f64 = 1e-13;
    let (scaled, scale) = to_unit_diagonal(matrix)?;
    let n = scale.len();
    let cholesky = scaled.clone().cholesky()?;
    let mut inverse = DMatrix::identity(n, n);
    inverse.as_mut_slice().par_chunks_mut((COLUMNS * n).max(1)).for_each(|columns| {
        cholesky.solve_mut(&mut DMatrixViewMut::from_slice(columns, n, columns.len() / n));
    });
    // The norms bound the ratio of the eigenvalues from below, and cost next to nothing beside them.
    let bound = 1.0 / (scaled.norm() * inverse.norm());
    if bound.is_nan() || bound <= SMALLEST {
        let eigenvalues = scaled.symmetric_eigenvalues();
        if eigenvalues.min() <= SMALLEST * eigenvalues.max() {
            return None;
        }
    }
    Some(DMatrix::from_fn(n, n, |i, j| 0.5 * (inverse[(i, j)] + inverse[(j, i)]) * scale[i] * scale[j]))
}

/// Largest relative standard deviation of a focal length.
pub fn worst_focal_sigma(shared: &DMatrix<f64>, layout: &Layout, rig: &Rig) -> f64 {
    let mut worst: f64 = 0.0;
    for side in Side::BOTH {
        let (camera, at) = (rig.camera(side), layout.camera_start(side));
        for (i, focal) in [camera.fx, camera.fy].into_iter().enumerate() {
            worst = worst.max(shared[(at + i, at + i)].sqrt() / focal.abs());
        }
    }
    worst
}
