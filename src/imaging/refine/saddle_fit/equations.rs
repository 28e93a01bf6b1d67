//! The equations of a fit's step, and what a fit found.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use super::evaluation::{Arm, Misfit};
use super::model::{COLUMNS, Model, N};

/// Least blur, px: that of the box of a pixel alone, 1/sqrt(12). Sharpened pictures would fit less, with a slope that no pixel sees.
pub(super) const LEAST_BLUR_PX: f64 = 0.3;

/// Sum of squared residuals at a model, with its normal matrix and gradient.
pub(super) struct Equations {
    pub(super) cost: f64,
    /// The same of pixels that see an edge.
    pub(super) near_cost: f64,
    pub(super) matrix: Normal,
    pub(super) gradient: Column,
    pub(super) arms: [[Arm<COLUMNS>; 2]; 2],
}

pub(super) type Normal = SMatrix<f64, N, N>;
pub(super) type Column = SVector<f64, N>;

/// What a fit found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The parameters.
    pub model: Model,
    /// Covariance of the corner's place, px^2.
    pub covariance_px2: Matrix2<f64>,
    /// Standard deviation of the residuals, grey values.
    pub residual: f64,
    /// Covariance of the corner's place (rows, px) with the light's slope (columns, 1/px).
    pub place_by_light: Matrix2<f64>,
    /// Covariance of the light's slope, 1/px^2.
    pub light_covariance: Matrix2<f64>,
    /// For each edge, on either side of the crossing: chi-squared (two degrees of freedom) of that arm's edge against the common model.
    pub arm_misfit: [[f64; 2]; 2],
    /// By how much both edges bend at the crossing, and by how much their arms are apart there, beyond the common model.
    pub misfits: [Misfit; 2],
    /// Slope of stray light, grey values per px, and its covariance, where it was looked for.
    pub stray: Option<(Vector2<f64>, Matrix2<f64>)>,
    /// Number of pixels.
    pub pixels: usize,
    /// Number of pixels in the window that were left out: saturated, or not explained by a first fit.
    pub left_out: usize,
    /// Number of steps to the end.
    pub steps: usize,
}
