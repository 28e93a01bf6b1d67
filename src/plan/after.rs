//! Where the cameras really stand, from poses that were measured already.
//!
//! In: rows of `measurements.csv` whose groups are those of the plan. Out: `cam_from_base` of each group, fitted by the
//! nominal robot: points, and points beside them where the orientation was measured too, brought together by a rigid
//! motion (Kabsch, 1976).

use nalgebra::{Matrix3, Point3, Vector3};

use super::error::{Error, Result};
use super::pool::Candidate;
use super::scene::{self, Placement, PoseNoise, Scene};
use crate::geometry::{Transform, cross_covariance, fitted_frame, transform};
use crate::measurements::{Measurement, Observed};
use crate::robot::Robot;

/// Arm at whose end an orientation counts as a point, mm.
const ARM_MM: f64 = 50.0;

/// Points that lie closer to a line than this share of their extent do not say how the cameras are turned.
const LINE: f64 = 1e-3;

/// Noise of rows that say none, mm.
const NOISE_MM: f64 = 0.02;

/// Puts the placements where the measurements say. Returns the measured poses as candidates.
pub fn place(
    robot: &Robot,
    scene: &Scene,
    placements: &mut [Placement],
    rows: &[Measurement],
    file: &str,
) -> Result<Vec<Candidate>> {
    let refuse = |message: String| Error::Measured { message, place: file.to_owned() };
    let joints = rows.first().map_or(0, |r| r.at.joints_deg.len());
    if joints != robot.joints.len() {
        let needed = robot.joints.len();
        return Err(refuse(format!("the rows have {joints} joint readings, the robot has {needed} joints")));
    }
    let mut earlier = Vec::new();
    for (group, placement) in placements.iter_mut().enumerate() {
        let (mut base, mut camera) = (Vec::new(), Vec::new());
        let name = placement.name.clone();
        let of_group = || rows.iter().filter(|r| r.at.group == name);
        for row in of_group() {
            let Observed::Position { point_mm, rotation_rad, .. } = &row.observed else { continue };
            let base_from_target = robot.base_from_flange(&row.at.joints_rad()) * scene::flange_from_target(robot);
            let left_from_target = transform(rotation_rad.unwrap_or_default(), point_mm.coords);
            let arms = [Vector3::x(), Vector3::y(), Vector3::z()];
            let arms = arms.iter().filter(|_| rotation_rad.is_some()).map(|a| Point3::from(a * ARM_MM));
            for point in std::iter::once(Point3::origin()).chain(arms) {
                base.push((base_from_target * point).coords);
                camera.push((left_from_target * point).coords);
            }
        }
        let Some(left_from_base) = rigid(&base, &camera) else { continue };
        placement.put(scene, left_from_base);
        for row in of_group() {
            let Observed::Position { covariance_mm2, .. } = &row.observed else { continue };
            let joints_rad = row.at.joints_rad();
            let left_from_target =
                placement.left_from_base * robot.base_from_flange(&joints_rad) * scene::flange_from_target(robot);
            let noise = PoseNoise { given_mm: Some(NOISE_MM), repeatability_mm: 0.0 };
            let assumed = scene.covariance_mm2(&left_from_target, &noise).unwrap_or_else(Matrix3::identity);
            let floor = Matrix3::identity() * 1e-8;
            let covariance_mm2 = placement.in_base(&(covariance_mm2.unwrap_or(assumed) + floor));
            earlier.push(Candidate { group, joints_rad, left_from_target, covariance_mm2 });
        }
    }
    if earlier.is_empty() {
        let names: Vec<&str> = placements.iter().map(|p| p.name.as_str()).collect();
        let message = format!(
            "no group {} with three measured points, or one with its orientation: where the cameras stand is not said",
            names.join(", ")
        );
        return Err(refuse(message));
    }
    Ok(earlier)
}

/// The rigid motion that brings points onto others best; `None` for fewer than three, or all on a line.
pub fn rigid(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Option<Transform> {
    let pairs = || from.iter().zip(to).map(|(a, b)| (Point3::from(*a), Point3::from(*b), 1.0));
    let mut values: Vec<f64> = cross_covariance(pairs()).2.singular_values().iter().copied().collect();
    values.sort_by(|x, y| y.total_cmp(x));
    let is_line = from.len() < 3 || values[1] <= LINE * LINE * values[0] || values[0] == 0.0;
    (!is_line).then(|| fitted_frame(pairs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_found_and_a_line_refused() {
        let there = transform(Vector3::new(0.4, -1.2, 0.7), Vector3::new(30.0, -400.0, 90.0));
        let from: Vec<Vector3<f64>> =
            (0..5).map(f64::from).map(|k| Vector3::new(20.0 * k, 9.0 * (k * 1.7).sin(), 5.0 * (k * k).cos())).collect();
        let to: Vec<Vector3<f64>> = from.iter().map(|p| (there * Point3::from(*p)).coords).collect();
        let found = rigid(&from, &to).unwrap();
        let off = found.inverse() * there;
        assert!(off.translation.vector.norm() < 1e-10 && off.rotation.angle() < 1e-12);
        let line: Vec<Vector3<f64>> = (0..5).map(|k| Vector3::x() * f64::from(k)).collect();
        assert_eq!(rigid(&line, &line), None);
        assert_eq!(rigid(&from[..2], &to[..2]), None);
    }
}
