//! Flat shapes in space, each with its brightness.

use nalgebra::Point2;

use super::outline::Outline;
use crate::geometry::Transform;

/// Brightness of a surface: at its first corner and how it changes per mm along its x and y. 1 is the board's white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    pub value: f64,
    /// Change across its whole extent in the picture, along x and y, as a share.
    pub slope: (f64, f64),
}

impl Tone {
    /// Brightness at picture point (0, 0) and its change per px along x and y, for a surface with this outline.
    pub fn across(&self, outline: &Outline) -> (f64, f64, f64) {
        let size = (outline.high - outline.low).map(|v| v.max(1.0));
        let (along_x, along_y) = (self.value * self.slope.0 / size.x, self.value * self.slope.1 / size.y);
        let middle = nalgebra::center(&outline.low, &outline.high);
        (self.value - along_x * middle.x - along_y * middle.y, along_x, along_y)
    }

    /// The same everywhere.
    pub fn flat(value: f64) -> Tone {
        Tone { value, slope: (0.0, 0.0) }
    }
}

/// A flat shape somewhere in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Its plane (z = 0) in the frame of what it belongs to.
    pub parent_from_patch: Transform,
    /// Its corners in that plane, mm.
    pub corners_mm: Vec<Point2<f64>>,
    pub tone: Tone,
}
