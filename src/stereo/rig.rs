//! Two cameras and where they stand to each other.

use nalgebra::{DMatrix, Point2, Point3};

use super::{Camera, Error};
use crate::geometry::Transform;
use crate::imaging::{Corners, Side};

/// A calibrated pair of cameras.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    /// The left camera, the reference frame of every point.
    pub left: Camera,
    /// The right camera.
    pub right: Camera,
    /// Maps the left camera's frame to the right camera's.
    pub right_from_left: Transform,
    /// Joint covariance of the rig's parameters, where known.
    pub covariance: Option<Covariance>,
}

/// A covariance matrix with names: `left.fx`, `right.k1`, `right_from_left.rx_rad`, ...
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Names of rows and columns.
    pub order: Vec<String>,
    /// The matrix, in the squares of the parameters' units.
    pub matrix: DMatrix<f64>,
}

impl Rig {
    /// Distance of the two cameras' centres, mm.
    pub fn baseline_mm(&self) -> f64 {
        self.right_from_left.translation.vector.norm()
    }

    /// Pictures of another size than the calibration's were binned, cut or taken by other cameras.
    pub fn check_size(&self, corners: &Corners) -> Result<(), Error> {
        for (side, camera, found) in
            [(Side::Left, &self.left, corners.left_size), (Side::Right, &self.right, corners.right_size)]
        {
            let (width, height) = (camera.width, camera.height);
            if found != (width, height) {
                let (found_width, found_height) = found;
                return Err(Error::PictureSize { side, found_width, found_height, width, height });
            }
        }
        Ok(())
    }

    /// Raw picture points, left and right, of a point in the left camera's frame, px.
    pub fn project(&self, point_mm: &Point3<f64>) -> (Point2<f64>, Point2<f64>) {
        (self.left.project(point_mm), self.right.project(&(self.right_from_left * point_mm)))
    }
}
