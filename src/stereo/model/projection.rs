//! Derivatives of the projection: what Newton's method, the bundle and the propagation of covariances stand on.
//!
//! In: a camera and a point in its frame. Out: the pixel and its derivatives by the point and by the camera's own
//! numbers. The equations are those of OpenCV's `calib3d` documentation, differentiated by hand.

use nalgebra::{Matrix2, Matrix2x3, Matrix3, Point2, Point3, Vector2, Vector3};

use crate::stereo::model::camera::{onto_tilted, tilt_matrix, tilts};
use crate::stereo::{Camera, Lens};

/// Numbers of a camera: `fx fy cx cy`, then OpenCV's 14 distortion coefficients.
pub const CAMERA_NUMBERS: usize = 18;

/// A projected point with its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    /// Raw pixel.
    pub px: Point2<f64>,
    /// By the point in the camera's frame, px/mm.
    pub by_point: Matrix2x3<f64>,
    /// By `fx fy cx cy k1 k2 p1 p2 k3 ...`; columns beyond the camera's lens stay zero.
    pub by_camera: [Vector2<f64>; CAMERA_NUMBERS],
}

/// Normalised coordinates after the lens, with derivatives.
struct Bent {
    at: Point2<f64>,
    by_ray: Matrix2<f64>,
    by_distortion: [Vector2<f64>; 14],
}

impl Camera {
    /// Projects a point (mm, in front of the camera) and differentiates. `None` at or behind the camera's plane.
    pub fn project_with_derivatives(&self, point: &Point3<f64>) -> Option<Projection> {
        self.project_through(self.tilt().as_ref(), point)
    }

    /// The same of a camera whose sensor's tilt is at hand.
    #[inline(always)]
    pub fn project_through(&self, tilt: Option<&Tilt>, point: &Point3<f64>) -> Option<Projection> {
        // A comparison with NaN is false, so this way round it is refused as well.
        let in_front = point.z > 0.0;
        if !in_front {
            return None;
        }
        // One division for all: they are what a corner costs most.
        let by_depth = 1.0 / point.z;
        let ray = Point2::new(point.x * by_depth, point.y * by_depth);
        let bent = self.bend(tilt, &ray);
        let f = Matrix2::new(self.fx, 0.0, 0.0, self.fy);
        let ray_by_point = Matrix2x3::new(1.0, 0.0, -ray.x, 0.0, 1.0, -ray.y) * by_depth;
        let mut by_camera = [Vector2::zeros(); CAMERA_NUMBERS];
        by_camera[0].x = bent.at.x;
        by_camera[1].y = bent.at.y;
        by_camera[2].x = 1.0;
        by_camera[3].y = 1.0;
        for (column, derivative) in by_camera[4..].iter_mut().zip(&bent.by_distortion[..self.lens.free_count()]) {
            *column = Vector2::new(self.fx * derivative.x, self.fy * derivative.y);
        }
        Some(Projection {
            px: Point2::new(self.fx * bent.at.x + self.cx, self.fy * bent.at.y + self.cy),
            by_point: f * bent.by_ray * ray_by_point,
            by_camera,
        })
    }

    /// `distort` with its derivative by the ray.
    pub fn distort_with_slope(&self, tilt: Option<&Tilt>, ray: &Point2<f64>) -> (Point2<f64>, Matrix2<f64>) {
        let bent = self.bend(tilt, ray);
        (bent.at, bent.by_ray)
    }

    /// How its sensor is tilted; `None` for a lens without.
    pub fn tilt(&self) -> Option<Tilt> {
        (self.lens == Lens::Tilted14).then(|| Tilt::new(self.distortion[12], self.distortion[13]))
    }

    #[inline(always)]
    fn bend(&self, tilt: Option<&Tilt>, ray: &Point2<f64>) -> Bent {
        let [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, ..] = self.distortion;
        let (x, y) = (ray.x, ray.y);
        let r2 = x * x + y * y;
        let (r4, r6) = (r2 * r2, r2 * r2 * r2);
        let share = 1.0 / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
        let radial = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) * share;
        let radial_by_r2 =
            (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3) - radial * (k4 + r2 * (2.0 * k5 + 3.0 * r2 * k6))) * share;
        let (prism_x, prism_y) = (2.0 * (s1 + 2.0 * s2 * r2), 2.0 * (s3 + 2.0 * s4 * r2));
        let at = Point2::new(
            x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (s1 + r2 * s2),
            y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (s3 + r2 * s4),
        );
        let mixed = 2.0 * (x * y * radial_by_r2 + p1 * x + p2 * y);
        let by_ray = Matrix2::new(
            radial + 2.0 * x * x * radial_by_r2 + 2.0 * p1 * y + 6.0 * p2 * x + prism_x * x,
            mixed + prism_x * y,
            mixed + prism_y * x,
            radial + 2.0 * y * y * radial_by_r2 + 6.0 * p1 * y + 2.0 * p2 * x + prism_y * y,
        );
        let along = |factor: f64| Vector2::new(x, y) * (factor * share);
        let by_distortion = [
            along(r2),
            along(r4),
            Vector2::new(2.0 * x * y, r2 + 2.0 * y * y),
            Vector2::new(r2 + 2.0 * x * x, 2.0 * x * y),
            along(r6),
            along(-radial * r2),
            along(-radial * r4),
            along(-radial * r6),
            Vector2::new(r2, 0.0),
            Vector2::new(r4, 0.0),
            Vector2::new(0.0, r2),
            Vector2::new(0.0, r4),
            Vector2::zeros(),
            Vector2::zeros(),
        ];
        let bent = Bent { at, by_ray, by_distortion };
        match tilt {
            Some(tilt) => tilt.put_behind(bent),
            None => bent,
        }
    }
}

/// A tilted sensor: the matrix of its tilt, and the derivatives of that by both angles.
pub struct Tilt {
    matrix: Matrix3<f64>,
    by_angles: [Matrix3<f64>; 2],
}

impl Tilt {
    fn new(tau_x: f64, tau_y: f64) -> Tilt {
        Tilt { matrix: tilt_matrix(tau_x, tau_y), by_angles: tilt_matrix_slopes(tau_x, tau_y) }
    }

    /// Puts the sensor behind the lens.
    #[inline(always)]
    fn put_behind(&self, flat: Bent) -> Bent {
        let from = Vector3::new(flat.at.x, flat.at.y, 1.0);
        let to = self.matrix * from;
        let by_depth = 1.0 / to.z;
        let at = Point2::new(to.x * by_depth, to.y * by_depth);
        let divide = Matrix2x3::new(1.0, 0.0, -at.x, 0.0, 1.0, -at.y) * by_depth;
        let slope: Matrix2<f64> = divide * self.matrix.fixed_view::<3, 2>(0, 0);
        let mut by_distortion = flat.by_distortion;
        by_distortion[..12].iter_mut().for_each(|derivative| *derivative = slope * *derivative);
        for (derivative, by_angle) in by_distortion[12..].iter_mut().zip(&self.by_angles) {
            *derivative = divide * by_angle * from;
        }
        Bent { at, by_ray: slope * flat.by_ray, by_distortion }
    }
}

/// Derivatives of [`tilt_matrix`] by `tau_x` and `tau_y`.
fn tilt_matrix_slopes(tau_x: f64, tau_y: f64) -> [Matrix3<f64>; 2] {
    let (sx, cx) = tau_x.sin_cos();
    let (sy, cy) = tau_y.sin_cos();
    let [about_x, about_y] = tilts(tau_x, tau_y);
    let about_x_slope = Matrix3::new(0.0, 0.0, 0.0, 0.0, -sx, cx, 0.0, -cx, -sx);
    let about_y_slope = Matrix3::new(-sy, 0.0, -cy, 0.0, 0.0, 0.0, cy, 0.0, -sy);
    let r = about_y * about_x;
    let slope = |r_slope: Matrix3<f64>| onto_tilted(&r_slope, 0.0) * r + onto_tilted(&r, 1.0) * r_slope;
    [slope(about_y * about_x_slope), slope(about_y_slope * about_x)]
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A camera with every coefficient of its lens in use.
    pub fn bent_camera(lens: Lens) -> Camera {
        let mut camera = Camera::pinhole(1280, 1024, 1500.0);
        camera.fy = 1490.0;
        camera.cx += 12.0;
        camera.lens = lens;
        let all = [-0.21, 0.13, 1.1e-3, -7e-4, 0.05, 0.02, -0.03, 0.004, 1e-3, -2e-4, 5e-4, 3e-4, 0.015, -0.02];
        camera.distortion[..lens.free_count()].copy_from_slice(&all[..lens.free_count()]);
        camera
    }

    /// Central differences with steps near the cube root of the rounding error are good to about 1e-9 of the value.
    const DIFFERENCE: f64 = 2e-7;

    #[test]
    fn derivatives_equal_central_differences() {
        for lens in Lens::LADDER {
            let camera = bent_camera(lens);
            for point in
                [Point3::new(120.0, -80.0, 500.0), Point3::new(-200.0, 150.0, 620.0), Point3::new(0.0, 0.0, 400.0)]
            {
                let analytic = camera.project_with_derivatives(&point).unwrap();
                assert!((analytic.px - camera.project(&point)).norm() < 1e-9);
                for axis in 0..3 {
                    let mut step = Vector3::zeros();
                    step[axis] = 1e-3;
                    let numeric = (camera.project(&(point + step)) - camera.project(&(point - step))) / 2e-3;
                    let off = (numeric - analytic.by_point.column(axis)).norm();
                    assert!(off < DIFFERENCE * (1.0 + numeric.norm()), "{lens:?} point {axis}: off by {off}");
                }
                for index in 0..4 + lens.free_count() {
                    let step = if index < 4 { 1e-2 } else { 1e-5 };
                    let changed = |by: f64| {
                        let (mut changed, mut change) = (camera, [0.0; CAMERA_NUMBERS]);
                        change[index] = by;
                        changed.add(&change);
                        changed.project(&point)
                    };
                    let numeric = (changed(step) - changed(-step)) / (2.0 * step);
                    let off = (numeric - analytic.by_camera[index]).norm();
                    assert!(off < DIFFERENCE * (1.0 + numeric.norm()), "{lens:?} number {index}: off by {off}");
                }
            }
        }
    }

    #[test]
    fn behind_the_camera_there_is_no_projection() {
        let camera = Camera::pinhole(640, 480, 500.0);
        assert!(camera.project_with_derivatives(&Point3::new(1.0, 2.0, -5.0)).is_none());
        assert!(camera.project_with_derivatives(&Point3::new(1.0, 2.0, f64::NAN)).is_none());
    }

    #[test]
    fn projection_equals_opencv() {
        for lens in Lens::LADDER {
            let camera = bent_camera(lens);
            let points: Vec<Point3<f64>> = (0..40)
                .map(|i| Point3::new(f64::from(i % 8) * 55.0 - 190.0, f64::from(i / 8) * 60.0 - 120.0, 600.0))
                .collect();
            let theirs = crate::opencv::project_points(&camera.for_opencv(), &points).unwrap();
            for (point, px) in points.iter().zip(theirs) {
                let off = (camera.project(point) - px).norm();
                // Rounding of both sides, at coordinates of about 1000 px.
                assert!(off < 1e-9, "{lens:?}: {off}");
                let ray = camera.undistort(&px).unwrap();
                assert!((ray - Point2::new(point.x / point.z, point.y / point.z)).norm() < 1e-11, "{lens:?}");
            }
        }
    }
}
