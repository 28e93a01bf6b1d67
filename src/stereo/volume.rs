//! How uncertain a length is, depending on where in the working volume it lies.
//!
//! In: a calibrated rig with its covariance. Out: the standard deviation of a length along x, y and z on a lattice through the volume that
//! the boards filled, from the corners' scatter at both ends and from the calibration they share.

use nalgebra::{Point3, Vector3};
use serde::Serialize;

use super::Rig;
use super::calibrate::Calibration;
use super::observations::{Observation, Side};
use super::triangulate::{RigCovariance, SpacePoint, triangulate};

/// Places along x and y; along z three.
const PLACES: usize = 5;

/// A length at a place of the volume.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LengthSigma {
    /// Middle of the length in the left camera's frame, mm.
    pub at_mm: [f64; 3],
    /// Standard deviation of the length lying along x, y and z, mm.
    pub sigma_mm: [f64; 3],
}

/// Standard deviations of lengths of `length_mm` over the volume in which the boards stood. Places that a camera does not see are left out.
pub fn length_sigmas(calibration: &Calibration, length_mm: f64) -> Vec<LengthSigma> {
    let rig = calibration.rig();
    let Some(covariance) = rig.covariance.as_ref().map(RigCovariance::new) else { return Vec::new() };
    let sigma_px = calibration.noise.typical_px(&calibration.views);
    let points = calibration
        .views
        .iter()
        .zip(&calibration.values.poses)
        .flat_map(|(view, pose)| view.active(Side::Left).map(move |o| pose * o.board_mm));
    let (low, high) = points
        .fold((Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)), |(low, high), p| {
            (low.inf(&p.coords), high.sup(&p.coords))
        });
    let mut all = Vec::new();
    for iz in 0..3 {
        for iy in 0..PLACES {
            for ix in 0..PLACES {
                let share = |i: usize, of: usize| i as f64 / (of - 1) as f64;
                let at =
                    low + (high - low).component_mul(&Vector3::new(share(ix, PLACES), share(iy, PLACES), share(iz, 3)));
                let sigma = [Vector3::x(), Vector3::y(), Vector3::z()].map(|direction| {
                    let half = direction * (length_mm / 2.0);
                    let a = point(rig, &Point3::from(at - half), sigma_px)?;
                    let b = point(rig, &Point3::from(at + half), sigma_px)?;
                    Some((a.corner_variance_mm2(&b) + covariance.length_variance_mm2(&a, &b)).max(0.0).sqrt())
                });
                if let [Some(x), Some(y), Some(z)] = sigma {
                    all.push(LengthSigma { at_mm: [at.x, at.y, at.z], sigma_mm: [x, y, z] });
                }
            }
        }
    }
    all
}

/// A point as both cameras would see it; `None` where one does not.
fn point(rig: &Rig, at: &Point3<f64>, sigma_px: f64) -> Option<SpacePoint> {
    let in_front = at.z > 0.0 && (rig.right_from_left * at).z > 0.0;
    if !in_front {
        return None;
    }
    let (left, right) = rig.project(at);
    let seen = |side, camera: &super::Camera, px: nalgebra::Point2<f64>| {
        let inside = px.x >= -0.5
            && px.y >= -0.5
            && px.x <= f64::from(camera.width) - 0.5
            && px.y <= f64::from(camera.height) - 0.5;
        inside.then(|| Observation::of_point(side, px, sigma_px))
    };
    triangulate(rig, &seen(Side::Left, &rig.left, left)?, &seen(Side::Right, &rig.right, right)?)
}
