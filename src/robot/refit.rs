//! A robot without corrections that comes as near as it can to one with them: for formats that have no place for sag
//! and waves.
//!
//! In: a robot with all of its terms. Out: parameters of the plain chain (beta included), and what the flange's pose is
//! off by. Method: Gauss-Newton on the flange's places and turns at postures spread over the joints' ranges, or over
//! those in which the robot is known; directions that no posture tells apart stay where they are (a small ridge).

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::inverse::{self, ARM_MM};
use super::jacobian::Screws;
use super::{Corrections, Parameter, Robot};

/// Postures that are fitted, and those that the rest is judged at (others).
const FITTED: usize = 600;
const JUDGED: usize = 1000;

/// Steps; the problem is nearly linear.
const STEPS: usize = 6;

/// Ridge as a share of the largest diagonal.
const RIDGE: f64 = 1e-13;

/// Deviation of the flange between two robots over the ranges of their joints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// Mean distance, mm.
    pub mean_mm: f64,
    /// Largest distance, mm.
    pub max_mm: f64,
    /// Largest turn, rad.
    pub max_rad: f64,
}

impl Residual {
    /// Between two robots of the same joints, readings of the first.
    pub fn between(a: &Robot, b: &Robot) -> Residual {
        let off = |k: usize| {
            let q = inverse::spread_start(a, FITTED + k);
            let off = a.root_from_flange(&q).inverse() * b.root_from_flange(&q);
            (off.translation.vector.norm(), off.rotation.angle())
        };
        let all: Vec<(f64, f64)> = (0..JUDGED).into_par_iter().map(off).collect();
        let most = |f: &dyn Fn(&(f64, f64)) -> f64| all.iter().map(f).fold(0.0, f64::max);
        let mean_mm = all.iter().map(|o| o.0).sum::<f64>() / JUDGED as f64;
        Residual { mean_mm, max_mm: most(&|o| o.0), max_rad: most(&|o| o.1) }
    }
}

impl Robot {
    /// The same robot, the last link that of `drawn`: what it was turned and moved by along its axis is the tool's, for
    /// nothing that is measured at a tool's point tells the two apart. The tool stands where it stood.
    pub fn with_last_link_of(&self, drawn: &Robot) -> Robot {
        let mut robot = self.clone();
        if let (Some(joint), Some(of_drawn)) = (robot.joints.last_mut(), drawn.joints.last()) {
            let axis = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), joint.theta_rad - of_drawn.theta_rad);
            robot.tool_mm = axis * (robot.tool_mm + Vector3::z() * (joint.d_mm - of_drawn.d_mm));
            (joint.theta_rad, joint.d_mm) = (of_drawn.theta_rad, of_drawn.d_mm);
        }
        robot
    }

    /// The same robot with other ranges of its joints, rad (mm).
    pub fn within(&self, ranges: &[(f64, f64)]) -> Robot {
        let mut robot = self.clone();
        robot.joints.iter_mut().zip(ranges).for_each(|(joint, range)| joint.limits_rad = Some(*range));
        robot
    }

    /// The robot as a plain chain: itself where it has no corrections, else the nearest one without.
    pub fn without_corrections(&self) -> Robot {
        let gravity_direction = self.corrections.gravity_direction;
        let mut plain = self.clone();
        plain.corrections = Corrections { gravity_direction, ..Corrections::default() };
        if self.corrections.is_empty() {
            return plain;
        }
        let tool = |p: &Parameter| matches!(p, Parameter::V(_));
        let mut parameters: Vec<Parameter> = self.mdh_parameters().into_iter().filter(|p| !tool(p)).collect();
        parameters.extend(self.beta_parameters());
        for _ in 0..STEPS {
            let step = self.step(&plain, &parameters);
            plain = plain.shifted(&parameters, step.as_slice());
        }
        plain
    }

    /// The Gauss-Newton step of the plain robot's parameters towards this one.
    fn step(&self, plain: &Robot, parameters: &[Parameter]) -> DVector<f64> {
        let n = parameters.len();
        let part = |k: usize| self.equations(plain, parameters, &inverse::spread_start(self, k));
        let parts: Vec<(DMatrix<f64>, DVector<f64>)> = (0..FITTED).into_par_iter().map(part).collect();
        let zero = (DMatrix::zeros(n, n), DVector::zeros(n));
        // Summed in their order, so that the number of threads changes nothing.
        let (mut normal, gradient) = parts.into_iter().fold(zero, |sum, part| (sum.0 + part.0, sum.1 + part.1));
        let ridge = RIDGE * normal.diagonal().max();
        (0..n).for_each(|i| normal[(i, i)] += ridge);
        normal.cholesky().map_or_else(|| DVector::zeros(n), |c| c.solve(&gradient))
    }

    fn equations(&self, plain: &Robot, parameters: &[Parameter], q: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let screws = Screws::new(&plain.bent(q), &Vector3::zeros());
        let mut columns = DMatrix::zeros(6, parameters.len());
        for (k, &parameter) in parameters.iter().enumerate() {
            columns.fixed_view_mut::<3, 1>(0, k).copy_from(&screws.point_column(parameter, [1.0, 0.0]));
            columns.fixed_view_mut::<3, 1>(3, k).copy_from(&(screws.rotation_column(parameter, [1.0, 0.0]) * ARM_MM));
        }
        let (wanted, there) = (self.base_from_flange(q), plain.base_from_flange(q));
        let residual = DVector::from_column_slice(inverse::off(&wanted, &there, ARM_MM).as_slice());
        (columns.tr_mul(&columns), columns.tr_mul(&residual))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::catalogue;
    use crate::robot::corrections::{GravityTerm, HarmonicTerm, LoadPoint, Wave};

    #[test]
    fn what_the_last_link_is_longer_and_turned_by_is_the_tools() {
        let drawn = catalogue::robot("abb-irb120").unwrap();
        let mut found = drawn.clone();
        found.joints[2].a_mm += 0.4;
        found.joints[5].d_mm += 93.0;
        found.joints[5].theta_rad += 0.3;
        found.tool_mm = Vector3::new(20.0, -3.0, 5.0);
        let taken = found.with_last_link_of(&drawn);
        assert_eq!((taken.joints[5], taken.joints[2]), (drawn.joints[5], found.joints[2]));
        for k in 0..20 {
            let q = inverse::spread_start(&drawn, k);
            assert!((taken.target_mm(&q) - found.target_mm(&q)).norm() < 1e-9);
        }
    }

    #[test]
    fn a_plain_robot_is_its_own_nearest_one() {
        let robot = catalogue::robot("ur5e").unwrap();
        let off = Residual::between(&robot, &robot.without_corrections());
        assert!(off.max_mm < 1e-9 && off.max_rad < 1e-12, "{off:?}");
    }

    /// The refit takes what a constant can take: far less is left than if the terms were cut off, and it is told as it
    /// is.
    #[test]
    fn what_is_left_of_sag_and_waves_is_less_than_they_are() {
        let mut robot = catalogue::robot("ur5e").unwrap();
        robot.corrections.gravity = vec![GravityTerm { joint: 1, point: LoadPoint::Origin(2), k_rad_per_m: 2e-3 }];
        robot.corrections.harmonics = vec![HarmonicTerm { joint: 2, wave: Wave::Cos, amplitude_rad: 1e-3 }];
        let mut cut = robot.clone();
        cut.corrections = Corrections::default();
        let (cut_off, left) =
            (Residual::between(&robot, &cut), Residual::between(&robot, &robot.without_corrections()));
        assert!(left.mean_mm < 0.9 * cut_off.mean_mm && left.mean_mm > 0.01, "{left:?} {cut_off:?}");
    }

    /// A coupling that is a plain offset of the chain is fitted away to rounding.
    #[test]
    fn a_wave_that_is_an_offset_leaves_nothing() {
        let mut robot = catalogue::robot("abb-irb120").unwrap();
        robot.joints[2].limits_rad = Some((0.4, 0.4 + 1e-9));
        robot.corrections.harmonics = vec![HarmonicTerm { joint: 2, wave: Wave::Cos, amplitude_rad: 1e-2 }];
        let left = Residual::between(&robot, &robot.without_corrections());
        assert!(left.max_mm < 1e-6, "{left:?}");
    }
}
