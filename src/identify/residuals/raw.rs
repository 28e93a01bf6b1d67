//! Residuals before whitening.

use nalgebra::{Matrix3, Vector3};

/// A residual before whitening, and the variance that the measurement gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// A length; the scatter enters so many times.
    Length(f64, f64, f64),
    Point(Vector3<f64>, Matrix3<f64>),
    /// An orientation, rad.
    Turn(Vector3<f64>),
}
