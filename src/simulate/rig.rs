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

/// The true rig for pictures of a size, px. The lenses differ; neither camera is quite what its drawing says.
pub fn true_rig(size_px: u32) -> Rig {
    let scale = f64::from(size_px) / 5120.0;
    let camera = |focal: f64, cx: f64, cy: f64, distortion: [f64; 5]| {
        let mut camera = Camera::pinhole(size_px, size_px, FOCAL_PX_AT_5120 * scale * focal);
        // Pixels are square to a part in ten thousand.
        camera.fy *= 1.0001;
        camera.cx += cx * scale;
        camera.cy += cy * scale;
        camera.lens = Lens::Brown5;
        camera.distortion[..5].copy_from_slice(&distortion);
        camera
    };
    let left = camera(1.002, 14.0, -9.0, [-0.08, 0.12, 2e-4, -3e-4, 0.0]);
    let right = camera(0.997, -21.0, 6.0, [-0.065, 0.05, -2.5e-4, 1.5e-4, 0.0]);
    let (sin, cos) = CONVERGENCE_RAD.sin_cos();
    let right_center = Vector3::new(DISTANCE_MM * sin, 0.0, DISTANCE_MM * (1.0 - cos));
    let mounting = transform(Vector3::new(0.004, -0.003, 0.006), Vector3::new(0.8, -1.1, 0.6));
    let left_from_right = transform(Vector3::new(0.0, -CONVERGENCE_RAD, 0.0), right_center);
    Rig { left, right, right_from_left: mounting * left_from_right.inverse(), covariance: None }
}

/// The frame in the middle of the field, its z-axis halfway between the cameras' axes: a board with the
/// identity there faces both.
pub fn left_from_field() -> Transform {
    transform(Vector3::new(0.0, -CONVERGENCE_RAD / 2.0, 0.0), Vector3::new(0.0, 0.0, DISTANCE_MM))
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
