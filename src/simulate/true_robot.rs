//! The nominal robot as its maker delivers it, and the true one with its hidden deviations.

use nalgebra::Vector3;

use super::draws::{Draws, Purpose};
use super::settings::RobotDeviations;
use crate::robot::corrections::{GravityTerm, HarmonicTerm, LoadPoint, Wave};
use crate::robot::{Robot, catalogue};

/// The target's nominal mark point in the flange's frame, mm.
const TOOL_MM: [f64; 3] = [12.0, -8.0, 25.0];

/// Sine of a twist below which neighbouring axes are called parallel.
const PARALLEL: f64 = 1e-3;

/// The robot of Table 1 with joint limits and a target at its flange.
pub fn nominal() -> Robot {
    Robot { tool_mm: Vector3::from(TOOL_MM), ..catalogue::paper() }
}

/// A robot whose parameters differ from the nominal one's as drawn from the seed.
pub fn deviated(nominal: &Robot, deviations: &RobotDeviations, seed: u64) -> Robot {
    let mut robot = nominal.clone();
    let mut draws = Draws::new(seed, Purpose::RobotErrors, 0);
    let angle = deviations.angle_deg.to_radians();
    for joint in &mut robot.joints {
        joint.alpha_rad += draws.uniform(-angle, angle);
        joint.a_mm += draws.uniform(-deviations.length_mm, deviations.length_mm);
        joint.theta_rad += draws.uniform(-angle, angle);
        joint.d_mm += draws.uniform(-deviations.length_mm, deviations.length_mm);
    }
    for k in 0..3 {
        robot.tool_mm[k] += draws.uniform(-deviations.length_mm, deviations.length_mm);
    }
    robot
}

/// Effects outside of the plain model: parallel axes that are not, joints that sag, drives with periodic errors. Those
/// of size zero are left out.
pub fn add_effects(robot: &mut Robot, nominal: &Robot, deviations: &RobotDeviations, seed: u64) {
    let mut draws = Draws::new(seed, Purpose::Effects, 0);
    let beta = deviations.beta_deg.to_radians();
    for (joint, drawn) in robot.joints.iter_mut().zip(&nominal.joints).skip(1) {
        if beta > 0.0 && drawn.alpha_rad.sin().abs() < PARALLEL {
            joint.beta_rad += draws.uniform(-beta, beta);
        }
    }
    let per_m = deviations.gravity_mrad_per_m * 1e-3;
    if per_m > 0.0 {
        for (joint, point) in [(1, LoadPoint::Origin(2)), (1, LoadPoint::Origin(4)), (2, LoadPoint::Origin(4))] {
            if joint < robot.joints.len() {
                let k_rad_per_m = per_m * draws.uniform(0.5, 1.0);
                robot.corrections.gravity.push(GravityTerm { joint, point, k_rad_per_m });
            }
        }
    }
    let amplitude = deviations.harmonics_mrad * 1e-3;
    if amplitude > 0.0 {
        for joint in 0..robot.joints.len() {
            for (wave, share) in Wave::ALL.into_iter().zip([1.0, 1.0, 0.5, 0.5]) {
                let amplitude_rad = draws.uniform(-amplitude, amplitude) * share;
                robot.corrections.harmonics.push(HarmonicTerm { joint, wave, amplitude_rad });
            }
        }
    }
}
