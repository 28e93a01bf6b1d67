//! A point in space from its two pixels, what its corners and the calibration make it uncertain by.
//!
//! In: a rig, a left and a right observation. Out: the point in the left camera's frame, its covariance, its
//! derivatives by the rig, and the gap between the two rays. Method: the middle of the shortest connection of the rays,
//! then Gauss-Newton on the whitened reprojection residuals, which for Gaussian corners is the most likely point. Goes
//! wrong: parallel rays, a pixel no ray belongs to.

use nalgebra::{Matrix3, Matrix4x3, Point2, Point3, Vector2, Vector3, Vector4};

use crate::geometry::rotation_matrix;
use crate::imaging::Side;
use crate::stereo::Rig;
use crate::stereo::data::Observation;
use crate::stereo::model::Covariance;
use crate::stereo::model::parameters::{CAMERA_NAMES, TRANSFORM_NAMES};
use crate::stereo::model::projection::CAMERA_NUMBERS;

/// Numbers of a rig: both cameras, then `right_from_left`.
pub const RIG_NUMBERS: usize = 2 * CAMERA_NUMBERS + 6;

/// Steps of Gauss-Newton; the start is within a pixel, so that three reach rounding.
const STEPS: usize = 5;

#[derive(Debug, Clone, PartialEq)]
pub struct SpacePoint {
    /// The point in the left camera's frame, mm.
    pub point_mm: Point3<f64>,
    /// Its covariance from the two corners alone, mm^2.
    pub covariance_mm2: Matrix3<f64>,
    /// Distance between the two rays where they are nearest, mm, negative where the right ray passes below the left.
    pub gap_mm: f64,
    /// Squared whitened residual that the best point leaves in both pictures: chi-square with one degree of freedom
    /// where the corners scatter independently and as much as they say.
    pub chi_square: f64,
    /// Derivatives by the rig's numbers.
    pub by_rig: [Vector3<f64>; RIG_NUMBERS],
}

impl SpacePoint {
    /// Variance of the length to another point through the corners of both, mm^2; through the calibration:
    /// [`RigCovariance::length_variance_mm2`].
    pub fn corner_variance_mm2(&self, other: &SpacePoint) -> f64 {
        let direction = (other.point_mm - self.point_mm).normalize();
        direction.dot(&((self.covariance_mm2 + other.covariance_mm2) * direction))
    }
}

/// Index of a number of the rig by its name in `calibration.json`; `None` for names of other things (the board's
/// shape).
pub fn rig_number(name: &str) -> Option<usize> {
    let (part, number) = name.split_once('.')?;
    let camera = |start: usize| CAMERA_NAMES.iter().position(|n| *n == number).map(|i| start + i);
    match part {
        "left" => camera(0),
        "right" => camera(CAMERA_NUMBERS),
        "right_from_left" => TRANSFORM_NAMES.iter().position(|n| *n == number).map(|i| 2 * CAMERA_NUMBERS + i),
        _ => None,
    }
}

/// Triangulates; both observations carry their whiteners. `None` for parallel rays, points behind a camera, pixels
/// without a ray.
pub fn triangulate(rig: &Rig, left: &Observation, right: &Observation) -> Option<SpacePoint> {
    let (mut point, gap_mm) = between_rays(rig, &left.px, &right.px)?;
    let mut linear = Linear::at(rig, &point, left, right)?;
    for _ in 0..STEPS {
        let step = linear.inverse * linear.by_point.tr_mul(&linear.residual);
        point -= step;
        linear = Linear::at(rig, &point, left, right)?;
        if step.norm() < 1e-12 * point.coords.norm() {
            break;
        }
    }
    let gain = linear.inverse * linear.by_point.transpose();
    let by_rig = linear.by_rig.map(|column| -(gain * column));
    let chi_square = linear.residual.norm_squared();
    Some(SpacePoint { point_mm: point, covariance_mm2: linear.inverse, gap_mm, chi_square, by_rig })
}

/// Middle and length of the shortest connection of the two rays.
fn between_rays(rig: &Rig, left: &Point2<f64>, right: &Point2<f64>) -> Option<(Point3<f64>, f64)> {
    let left_ray = rig.left.undistort(left)?;
    let right_ray = rig.right.undistort(right)?;
    let left_from_right = rig.right_from_left.inverse();
    let a = Vector3::new(left_ray.x, left_ray.y, 1.0);
    let b = left_from_right.rotation * Vector3::new(right_ray.x, right_ray.y, 1.0);
    let origin = left_from_right.translation.vector;
    let normal = a.cross(&b);
    let across = normal.norm_squared();
    // Rays that meet beyond a million baselines are parallel for any purpose.
    if across <= 1e-12 * a.norm_squared() * b.norm_squared() {
        return None;
    }
    let along_a = origin.cross(&b).dot(&normal) / across;
    let along_b = origin.cross(&a).dot(&normal) / across;
    let gap_mm = origin.dot(&normal) / across.sqrt();
    let in_front = along_a > 0.0 && along_b > 0.0;
    in_front.then(|| (Point3::from((a * along_a + origin + b * along_b) / 2.0), gap_mm))
}

/// The whitened reprojection, linearised.
struct Linear {
    residual: Vector4<f64>,
    by_point: Matrix4x3<f64>,
    by_rig: [Vector4<f64>; RIG_NUMBERS],
    inverse: Matrix3<f64>,
}

impl Linear {
    fn at(rig: &Rig, point: &Point3<f64>, left: &Observation, right: &Observation) -> Option<Linear> {
        let in_right = rig.right_from_left * point;
        let l = rig.left.project_with_derivatives(point)?;
        let r = rig.right.project_with_derivatives(&in_right)?;
        let l_by_point = left.whitener * l.by_point;
        let r_by_point = right.whitener * r.by_point;
        let mut by_point = Matrix4x3::zeros();
        by_point.fixed_view_mut::<2, 3>(0, 0).copy_from(&l_by_point);
        by_point.fixed_view_mut::<2, 3>(2, 0).copy_from(&(r_by_point * rotation_matrix(&rig.right_from_left)));
        let (a, b) = (left.whiten(l.px - left.px), right.whiten(r.px - right.px));
        let mut by_rig = [Vector4::zeros(); RIG_NUMBERS];
        let upper = |v: Vector2<f64>| Vector4::new(v.x, v.y, 0.0, 0.0);
        let lower = |v: Vector2<f64>| Vector4::new(0.0, 0.0, v.x, v.y);
        for i in 0..CAMERA_NUMBERS {
            by_rig[i] = upper(left.whitener * l.by_camera[i]);
            by_rig[CAMERA_NUMBERS + i] = lower(right.whitener * r.by_camera[i]);
        }
        let turn = -(r_by_point * (rig.right_from_left.rotation * point.coords).cross_matrix());
        for i in 0..3 {
            by_rig[2 * CAMERA_NUMBERS + i] = lower(turn.column(i).into());
            by_rig[2 * CAMERA_NUMBERS + 3 + i] = lower(r_by_point.column(i).into());
        }
        let inverse = by_point.tr_mul(&by_point).try_inverse()?;
        Some(Linear { residual: Vector4::new(a.x, a.y, b.x, b.y), by_point, by_rig, inverse })
    }
}

/// A covariance of the rig, arranged by [`rig_number`].
#[derive(Debug, Clone, PartialEq)]
pub struct RigCovariance {
    numbers: Vec<(usize, usize)>,
    covariance: Covariance,
}

impl RigCovariance {
    /// Keeps the rig's numbers of a covariance.
    pub fn new(covariance: &Covariance) -> RigCovariance {
        let numbers =
            covariance.order.iter().enumerate().filter_map(|(at, name)| Some((at, rig_number(name)?))).collect();
        RigCovariance { numbers, covariance: covariance.clone() }
    }

    /// Variance of the length between two points through the calibration, mm^2: its share is common to both.
    pub fn length_variance_mm2(&self, a: &SpacePoint, b: &SpacePoint) -> f64 {
        let direction = (b.point_mm - a.point_mm).normalize();
        let slope = |number: usize| direction.dot(&(b.by_rig[number] - a.by_rig[number]));
        let slopes: Vec<(usize, f64)> = self.numbers.iter().map(|&(at, number)| (at, slope(number))).collect();
        let mut sum = 0.0;
        for &(i, a) in &slopes {
            for &(j, b) in &slopes {
                sum += a * self.covariance.matrix[(i, j)] * b;
            }
        }
        sum
    }
}

/// The corners both pictures show, by their place on the board, row by row.
pub fn common(view: &crate::stereo::data::view::View) -> Vec<(&Observation, &Observation)> {
    let key = |o: &Observation| (o.row, o.col);
    let right: std::collections::BTreeMap<(usize, usize), &Observation> =
        view.active(Side::Right).map(|o| (key(o), o)).collect();
    let mut both: Vec<_> = view.active(Side::Left).filter_map(|l| Some((l, *right.get(&key(l))?))).collect();
    both.sort_by_key(|(l, _)| key(l));
    both
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::data::View;
    use crate::stereo::synthetic::World;

    fn seen(sigma_px: f64, seed: u64) -> (World, View) {
        let mut world = World::new(1, 31);
        world.sigma_px = sigma_px;
        let view = View::new(&world.board, &world.corners(seed).pairs[0], 0);
        (world, view)
    }

    #[test]
    fn exact_corners_meet_in_their_point() {
        let (world, view) = seen(0.0, 1);
        for (left, right) in common(&view) {
            let found = triangulate(&world.rig, left, right).unwrap();
            let truth = world.poses[0] * left.board_mm;
            assert!((found.point_mm - truth).norm() < 1e-7 && found.gap_mm.abs() < 1e-7, "{found:?}");
        }
    }

    #[test]
    fn the_covariance_is_the_scatter() {
        let mut sums = Vector3::zeros();
        let mut count = 0.0;
        for seed in 0..12 {
            let (world, view) = seen(0.05, seed);
            for (left, right) in common(&view) {
                let found = triangulate(&world.rig, left, right).unwrap();
                let off = found.point_mm - world.poses[0] * left.board_mm;
                // The whitener is one pixel here, the noise a twentieth.
                sums += off.component_mul(&off).component_div(&(found.covariance_mm2.diagonal() * 0.05 * 0.05));
                count += 1.0;
            }
        }
        for axis in 0..3 {
            // About a thousand draws know a variance to 5 %.
            assert!((0.85..1.15).contains(&(sums[axis] / count)), "{}", sums / count);
        }
    }

    #[test]
    fn derivatives_by_the_rig_equal_central_differences() {
        let (world, view) = seen(0.05, 3);
        let (left, right) = common(&view)[20];
        let found = triangulate(&world.rig, left, right).unwrap();
        let layout = crate::stereo::model::parameters::Layout::rig(crate::stereo::Lens::Brown4, false);
        let shared = crate::stereo::model::parameters::Shared { rig: world.rig.clone(), shape_mm: [0.0; 3] };
        for (i, name) in layout.names().iter().enumerate() {
            let h = if name.contains(".k") || name.contains(".p") || name.contains("rad") { 1e-6 } else { 1e-3 };
            let at = |h: f64| {
                let mut step = vec![0.0; layout.count()];
                step[i] = h;
                triangulate(&layout.step(&shared, &step).rig, left, right).unwrap().point_mm
            };
            let numeric = (at(h) - at(-h)) / (2.0 * h);
            let analytic = found.by_rig[rig_number(name).unwrap()];
            // The analytic one leaves out the curvature times the residual, a ten-thousandth here.
            assert!((numeric - analytic).norm() < 1e-3 * (1e-3 + numeric.norm()), "{name}: {numeric} {analytic}");
        }
    }

    #[test]
    fn parallel_rays_meet_nowhere() {
        let (mut world, view) = seen(0.0, 1);
        world.rig.right = world.rig.left;
        world.rig.right_from_left = crate::geometry::transform(Vector3::zeros(), Vector3::new(-100.0, 0.0, 0.0));
        let (left, _) = common(&view)[0];
        assert!(triangulate(&world.rig, left, left).is_none());
    }
}
