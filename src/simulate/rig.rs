//! The true rig: two cameras whose axes meet in the middle of the field.

use nalgebra::Vector3;

use crate::geometry::{Transform, transform};
use crate::stereo::{Camera, Lens, Rig};

/// Focal length at the paper's 5120 px (25 mm, pixels of 2.5 um), px.
const FOCAL_PX_AT_5120: f64 = 10_000.0;

/// Distance of both cameras from the middle of the field, mm: 5120 px see 269 mm there.
pub const DISTANCE_MM: f64 = 525.0;

/// Angle between the two axes, rad: a baseline of 218 mm.
const CONVERGENCE_RAD: f64 = 0.4189;

/// How a rig is built: two cameras that look at the middle of one field.
#[derive(Debug, Clone, PartialEq)]
pub struct RigDrawing {
    /// Width and height of the pictures, left and right, px.
    pub size_px: [(u32, u32); 2],
    /// Focal lengths, px.
    pub focal_px: [f64; 2],
    /// Principal points off the pictures' middles, px.
    pub off_middle_px: [(f64, f64); 2],
    /// `k1 k2 p1 p2 k3` of both lenses.
    pub distortion: [[f64; 5]; 2],
    /// Distance of both cameras from the middle of the field, mm.
    pub distance_mm: f64,
    /// Angle between the two axes, rad.
    pub convergence_rad: f64,
    /// How far the right camera stands round the field's axis from where it stands right of the left one, rad: a
    /// quarter turn puts it below. The cameras stay upright.
    pub round_rad: f64,
    /// Turn of each camera about its own axis, rad.
    pub roll_rad: [f64; 2],
}

impl RigDrawing {
    /// The paper's rig for square pictures of a size, px. The lenses differ; neither camera is quite what its drawing
    /// says.
    pub fn paper(size_px: u32) -> RigDrawing {
        let scale = f64::from(size_px) / 5120.0;
        RigDrawing {
            size_px: [(size_px, size_px); 2],
            focal_px: [1.002, 0.997].map(|share| FOCAL_PX_AT_5120 * scale * share),
            off_middle_px: [(14.0 * scale, -9.0 * scale), (-21.0 * scale, 6.0 * scale)],
            distortion: [[-0.08, 0.12, 2e-4, -3e-4, 0.0], [-0.065, 0.05, -2.5e-4, 1.5e-4, 0.0]],
            distance_mm: DISTANCE_MM,
            convergence_rad: CONVERGENCE_RAD,
            round_rad: 0.0,
            roll_rad: [0.0; 2],
        }
    }

    fn camera(&self, side: usize) -> Camera {
        let (width, height) = self.size_px[side];
        let mut camera = Camera::pinhole(width, height, self.focal_px[side]);
        // Pixels are square to a part in ten thousand.
        camera.fy *= 1.0001;
        camera.cx += self.off_middle_px[side].0;
        camera.cy += self.off_middle_px[side].1;
        camera.lens = Lens::Brown5;
        camera.distortion[..5].copy_from_slice(&self.distortion[side]);
        camera
    }

    /// The rig as it was really mounted.
    pub fn rig(&self) -> Rig {
        let (sin, cos) = self.convergence_rad.sin_cos();
        let right_center = Vector3::new(self.distance_mm * sin, 0.0, self.distance_mm * (1.0 - cos));
        let mounting = transform(Vector3::new(0.004, -0.003, 0.006), Vector3::new(0.8, -1.1, 0.6));
        let left_from_right = transform(Vector3::new(0.0, -self.convergence_rad, 0.0), right_center);
        let level = mounting * left_from_right.inverse();
        let right_from_left = turn(self.roll_rad[1] - self.round_rad) * level * turn(self.round_rad - self.roll_rad[0]);
        Rig { left: self.camera(0), right: self.camera(1), right_from_left, covariance: None }
    }

    /// The frame in the middle of the field, its z-axis halfway between the cameras' axes: a board with the
    /// identity there faces both, and stands upright in the pictures of a left camera that is not rolled.
    pub fn left_from_field(&self) -> Transform {
        let level =
            transform(Vector3::new(0.0, -self.convergence_rad / 2.0, 0.0), Vector3::new(0.0, 0.0, self.distance_mm));
        turn(self.roll_rad[0] - self.round_rad) * level * turn(self.round_rad)
    }
}

/// A turn about the axis of sight.
fn turn(angle_rad: f64) -> Transform {
    transform(Vector3::z() * angle_rad, Vector3::zeros())
}

/// The true rig of the presets for pictures of a size, px.
pub fn true_rig(size_px: u32) -> Rig {
    RigDrawing::paper(size_px).rig()
}

/// The frame in the middle of the presets' field: a board with the identity there faces both cameras.
pub fn left_from_field() -> Transform {
    RigDrawing::paper(1).left_from_field()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn both_cameras_see_the_field_of_the_paper() {
        let rig = true_rig(5120);
        for (x, y) in [(-128.0, -128.0), (128.0, -128.0), (128.0, 128.0), (-128.0, 128.0)] {
            let (left, right) = rig.project(&(left_from_field() * Point3::new(x, y, 0.0)));
            for px in [left, right] {
                assert!(px.iter().all(|v| (-150.0..5270.0).contains(v)), "{px}");
            }
        }
        assert!((rig.baseline_mm() - 218.0).abs() < 3.0);
    }
}
