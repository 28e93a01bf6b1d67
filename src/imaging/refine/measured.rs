//! A corner as its window shows it.

use nalgebra::Point2;

use super::saddle_fit::Fit;

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
