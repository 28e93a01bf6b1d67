//! One camera: a pinhole with OpenCV's distortion model.

use nalgebra::{Matrix3, Point2, Point3};

/// How many numbers of OpenCV's distortion vector are free: the value of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Lens {
    /// `k1 k2`; `p1 p2` stay zero.
    Radial2 = 2,
    /// `k1 k2 p1 p2`.
    Brown4 = 4,
    /// `k1 k2 p1 p2 k3`.
    Brown5 = 5,
    /// Adds the denominators `k4 k5 k6`.
    Rational8 = 8,
    /// Adds the thin prism `s1..s4`.
    ThinPrism12 = 12,
    /// Adds the tilted sensor `tauX tauY`.
    Tilted14 = 14,
}

impl Lens {
    /// All of them, from the simplest.
    pub const LADDER: [Lens; 6] =
        [Lens::Radial2, Lens::Brown4, Lens::Brown5, Lens::Rational8, Lens::ThinPrism12, Lens::Tilted14];

    /// Number of free distortion parameters.
    pub fn free_count(self) -> usize {
        self as usize
    }

    /// Length of the distortion vector in files: one that OpenCV takes.
    pub fn vector_length(self) -> usize {
        self.free_count().max(4)
    }

    /// The name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Lens::Radial2 => "radial2",
            Lens::Brown4 => "brown4",
            Lens::Brown5 => "brown5",
            Lens::Rational8 => "rational8",
            Lens::ThinPrism12 => "thin-prism12",
            Lens::Tilted14 => "tilted14",
        }
    }

    /// The lens of a name, or of a bare count of parameters (`5`).
    pub fn from_name(name: &str) -> Option<Lens> {
        Lens::LADDER.into_iter().find(|lens| lens.name() == name || lens.free_count().to_string() == name)
    }
}

/// A pinhole camera with lens distortion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Width of its pictures, px.
    pub width: u32,
    /// Height of its pictures, px.
    pub height: u32,
    /// Focal length along x, px.
    pub fx: f64,
    /// Focal length along y, px.
    pub fy: f64,
    /// Principal point, px.
    pub cx: f64,
    /// Principal point, px.
    pub cy: f64,
    /// Which of the distortion parameters are in use.
    pub lens: Lens,
    /// OpenCV's `k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tauX tauY`; those beyond the lens are zero.
    pub distortion: [f64; 14],
}

impl Camera {
    /// A camera without distortion.
    pub fn pinhole(width: u32, height: u32, focal_px: f64) -> Camera {
        let [cx, cy] = [width, height].map(|size| (f64::from(size) - 1.0) / 2.0);
        let (lens, distortion) = (Lens::Radial2, [0.0; 14]);
        Camera { width, height, fx: focal_px, fy: focal_px, cx, cy, lens, distortion }
    }

    /// Where a point in the camera's frame (mm, any scale) falls in the raw picture, px. The point must lie in front (z
    /// > 0).
    pub fn project(&self, point: &Point3<f64>) -> Point2<f64> {
        let d = self.distort(&Point2::new(point.x / point.z, point.y / point.z));
        Point2::new(self.fx * d.x + self.cx, self.fy * d.y + self.cy)
    }

    /// Normalised image coordinates (x/z, y/z) as the lens bends them (OpenCV, `calib3d` documentation).
    pub fn distort(&self, n: &Point2<f64>) -> Point2<f64> {
        self.distort_with_slope(self.tilt().as_ref(), n).0
    }

    /// The ray through a raw picture point: normalised coordinates (x/z, y/z) with `distort` undone by Newton's method.
    /// `None` where the lens model folds over, so that no ray belongs to the point.
    pub fn undistort(&self, px: &Point2<f64>) -> Option<Point2<f64>> {
        let target = Point2::new((px.x - self.cx) / self.fx, (px.y - self.cy) / self.fy);
        let mut n = target;
        let tilt = self.tilt();
        for _ in 0..50 {
            let (at, slope) = self.distort_with_slope(tilt.as_ref(), &n);
            let miss = at - target;
            let det = slope.determinant();
            // A lens keeps orientation; past the fold of the radial polynomial the determinant changes sign.
            if det <= 1e-6 || !det.is_finite() {
                return None;
            }
            let dx = (slope.m22 * miss.x - slope.m12 * miss.y) / det;
            let dy = (slope.m11 * miss.y - slope.m21 * miss.x) / det;
            n.x -= dx;
            n.y -= dy;
            if dx.abs().max(dy.abs()) < 1e-14 * (1.0 + n.coords.amax()) {
                break;
            }
        }
        let miss = self.distort(&n) - target;
        (miss.amax() < 1e-10).then_some(n)
    }

    /// `fx fy cx cy k1 k2 ...`; the terms beyond the lens are zero.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        [self.fx, self.fy, self.cx, self.cy].into_iter().chain(self.distortion)
    }

    /// One of these.
    pub fn number(&self, at: usize) -> f64 {
        self.numbers().nth(at).unwrap_or(0.0)
    }

    /// Adds a step to `fx fy cx cy k1 k2 ...`, as many of them as it has.
    pub fn add(&mut self, step: &[f64]) {
        let Camera { fx, fy, cx, cy, distortion, .. } = self;
        for (number, change) in [fx, fy, cx, cy].into_iter().chain(distortion).zip(step) {
            *number += change;
        }
    }

    /// The pinhole matrix.
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    pub fn for_opencv(&self) -> crate::opencv::Lens<'_> {
        let distortion = &self.distortion[..self.lens.vector_length()];
        crate::opencv::Lens { matrix: self.matrix(), distortion, size: (self.width, self.height) }
    }
}

/// OpenCV's matrix of a tilted sensor, `[[R33, 0, -R13], [0, R33, -R23], [0, 0, 1]] R(tau_x, tau_y)`.
pub fn tilt_matrix(tau_x: f64, tau_y: f64) -> Matrix3<f64> {
    let [about_x, about_y] = tilts(tau_x, tau_y);
    let r = about_y * about_x;
    onto_tilted(&r, 1.0) * r
}

/// The turns of a tilted sensor about x and about y.
pub fn tilts(tau_x: f64, tau_y: f64) -> [Matrix3<f64>; 2] {
    let (sx, cx) = tau_x.sin_cos();
    let (sy, cy) = tau_y.sin_cos();
    [Matrix3::new(1.0, 0.0, 0.0, 0.0, cx, sx, 0.0, -sx, cx), Matrix3::new(cy, 0.0, -sy, 0.0, 1.0, 0.0, sy, 0.0, cy)]
}

/// The matrix before `R` in [`tilt_matrix`]; its last element is zero in the derivative.
pub fn onto_tilted(r: &Matrix3<f64>, last: f64) -> Matrix3<f64> {
    Matrix3::new(r[(2, 2)], 0.0, -r[(0, 2)], 0.0, r[(2, 2)], -r[(1, 2)], 0.0, 0.0, last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn undistort_inverts_distort() {
        let mut camera = Camera::pinhole(1280, 1280, 2500.0);
        camera.lens = Lens::Tilted14;
        camera.distortion = [-0.12, 0.08, 1e-3, -7e-4, 0.02, 0.01, -0.02, 0.003, 1e-3, -2e-4, 5e-4, 3e-4, 0.01, -0.02];
        for (x, y) in [(0.0, 0.0), (0.25, -0.2), (-0.25, 0.25), (0.1, 0.02)] {
            let ray = Point2::new(x, y);
            let px = camera.project(&Point3::new(x, y, 1.0));
            let back = camera.undistort(&px).unwrap();
            assert!((back - ray).norm() < 1e-12, "{ray} came back as {back}");
        }
    }

    #[test]
    fn a_point_beyond_the_fold_has_no_ray() {
        let mut camera = Camera::pinhole(1000, 1000, 500.0);
        camera.distortion[0] = -0.5;
        assert_eq!(camera.undistort(&Point2::new(5000.0, 499.5)), None);
    }
}
