//! Normal equations of a placement's own unknowns.

use nalgebra::{DMatrix, DVector};

use crate::linear_algebra::product;

/// Squares and products of white residuals r and of their derivatives D with respect to the unknowns.
#[derive(Debug, Clone)]
pub struct Normal {
    /// `r' r`
    pub cost: f64,
    /// `D' r`
    pub gradient: DVector<f64>,
    /// `D' D`
    pub matrix: DMatrix<f64>,
}

impl Normal {
    /// Of residuals and their derivatives.
    pub fn new((residuals, design): (DVector<f64>, DMatrix<f64>)) -> Normal {
        let matrix = product(&design, &design);
        Normal { cost: residuals.norm_squared(), gradient: design.tr_mul(&residuals), matrix }
    }
}
