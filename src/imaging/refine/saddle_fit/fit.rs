//! What a fit found, and the corner that it was made for.

use nalgebra::{Matrix2, Point2, Vector2};

use super::evaluation::Misfit;
use super::model::Model;

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
    /// For each edge, on either side of the crossing: chi-squared (two degrees of freedom) of that arm's edge against
    /// the common model.
    pub arm_misfit: [[f64; 2]; 2],
    /// By how much both edges bend at the crossing, and by how much their arms are apart there, beyond the common
    /// model.
    pub misfits: [Misfit; 2],
    /// Slope of stray light, grey values per px, and its covariance, where it was looked for.
    pub stray: Option<(Vector2<f64>, Matrix2<f64>)>,
    pub pixels: usize,
    /// Number of pixels in the window that were left out: saturated, or not explained by a first fit.
    pub left_out: usize,
    /// Number of steps to the end.
    pub steps: usize,
}

/// A corner and all that its fit tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Raw place in the picture, px.
    pub px: Point2<f64>,
    /// The fit it comes from.
    pub fit: Fit,
    /// How far the window reaches along the two edges, as a share of the square's side.
    pub reach: [f64; 2],
}

impl Fit {
    /// The fit with all its covariances `factor` times as large.
    pub fn scattering(self, factor: f64) -> Fit {
        Fit {
            covariance_px2: self.covariance_px2 * factor,
            place_by_light: self.place_by_light * factor,
            light_covariance: self.light_covariance * factor,
            stray: self.stray.map(|(slope, own)| (slope, own * factor)),
            ..self
        }
    }

    /// The corner in the picture whose window started at `start`, px.
    pub fn place(&self, start: &Point2<f64>) -> Point2<f64> {
        start + self.model.corner
    }
}

#[cfg(test)]
impl Fit {
    /// Of a corner that nothing is known of but that it misses its model as noise does.
    pub fn example() -> Fit {
        Fit {
            model: Model::example(),
            covariance_px2: Matrix2::identity(),
            residual: 1.0,
            place_by_light: Matrix2::identity(),
            light_covariance: Matrix2::identity(),
            arm_misfit: [[1.0; 2]; 2],
            misfits: [Misfit::default(); 2],
            stray: None,
            pixels: 400,
            left_out: 0,
            steps: 3,
        }
    }
}
