//! The target's point at every pose for one vector of offsets, without derivatives: the hot loop of the swarms.
//!
//! Per pose the sine and cosine of each joint's nominal angle are constants; per vector of offsets those of the offsets are computed once,
//! and the angle-sum formulas leave multiplications only. Points are carried from the target back to the base, joint by joint and all poses
//! together (structure of arrays, for the compiler to vectorise). Gravity and harmonics add a small angle that differs by pose, bending and
//! wobble small tilts of the links; their sine and cosine are short series (error below 1e-13 up to a tenth of a radian, where the linear
//! models have long ceased to hold).

use std::borrow::Cow;

use nalgebra::{Matrix3, Vector3};

use super::Kinematics;
use crate::robot::{Parameter, Robot};

/// Length of the axes whose ends give a rotation, mm: as long as the arm, so that rounding of the points is rounding of the axes.
const AXIS_MM: f64 = 1000.0;

/// Sine and cosine of an angle.
type Turn = (f64, f64);

/// Points, coordinate by coordinate, mm; one a pose.
#[derive(Debug, Clone)]
pub struct Points {
    x: Vec<f64>,
    y: Vec<f64>,
    z: Vec<f64>,
}

impl Points {
    /// The point at a pose, mm.
    pub fn at(&self, pose: usize) -> Vector3<f64> {
        Vector3::new(self.x[pose], self.y[pose], self.z[pose])
    }

    fn coordinates(&mut self) -> impl Iterator<Item = [&mut f64; 3]> {
        self.x.iter_mut().zip(&mut self.y).zip(&mut self.z).map(|((x, y), z)| [x, y, z])
    }
}

impl Kinematics {
    /// The target's points for these offsets (mm, mrad), base frame.
    pub fn points(&self, offsets: &[f64]) -> Points {
        let robot = self.nominal.shifted(&self.parameters, offsets);
        self.carried(&robot, offsets, robot.tool_mm)
    }

    /// `base_from_flange` at every pose for these offsets: where the ends of the flange's axes go.
    pub fn rotations(&self, offsets: &[f64]) -> Vec<Matrix3<f64>> {
        let robot = self.nominal.shifted(&self.parameters, offsets);
        let ends = [Vector3::zeros(), Vector3::x() * AXIS_MM, Vector3::y() * AXIS_MM];
        let [origin, x, y] = ends.map(|end| self.carried(&robot, offsets, end));
        let axis = |points: &Points, pose: usize| (points.at(pose) - origin.at(pose)) / AXIS_MM;
        let rotation = |pose: usize| {
            let (x, y) = (axis(&x, pose), axis(&y, pose));
            Matrix3::from_columns(&[x, y, x.cross(&y)])
        };
        (0..self.poses.len()).map(rotation).collect()
    }

    /// Carries a point of the flange back to the base at every pose.
    fn carried(&self, robot: &Robot, offsets: &[f64], at: Vector3<f64>) -> Points {
        let [x, y, z] = [at.x, at.y, at.z].map(|v| vec![v; self.poses.len()]);
        let mut points = Points { x, y, z };
        for (k, joint) in robot.joints.iter().enumerate().rev() {
            let offset = (joint.theta_rad - self.nominal.joints[k].theta_rad).sin_cos();
            let (alpha, beta, shift) = (joint.alpha_rad.sin_cos(), joint.beta_rad.sin_cos(), [joint.a_mm, joint.d_mm]);
            let small = self.free(k, Parameter::corrected_joint, 0, offsets);
            let is_tilted =
                self.nominal.corrections.tilts(k) || self.parameters.iter().any(|p| p.tilted_joint() == Some(k));
            if joint.slides {
                let ways = self.poses.iter().map(|pose| pose.angles_rad[k]);
                points.z.iter_mut().zip(ways).for_each(|(z, way)| *z += joint.sign * way);
            }
            if let (true, Some(small)) = (joint.slides, &small) {
                points.z.iter_mut().zip(small).for_each(|(z, small)| *z += joint.sign * small);
            }
            let mut turns = Cow::Borrowed(&self.turns[k]);
            if let (false, Some(small)) = (joint.slides, &small) {
                let small = small.iter().map(|small| small_turn(joint.sign * small));
                turns.to_mut().iter_mut().zip(small).for_each(|(turn, small)| *turn = sum(*turn, small));
            }
            if !is_tilted {
                points
                    .coordinates()
                    .zip(&*turns)
                    .for_each(|(at, turn)| carry(at, sum(*turn, offset), [alpha, beta], shift));
                continue;
            }
            let [about_x, about_y] = [0, 1].map(|axis| {
                let mut tilts =
                    self.free(k, Parameter::tilted_joint, axis, offsets).unwrap_or_else(|| vec![0.0; self.poses.len()]);
                let own = self.poses.iter().filter_map(|pose| pose.tilts_rad.get(k));
                tilts.iter_mut().zip(own).for_each(|(tilt, own)| *tilt += own[axis]);
                tilts
            });
            for (((at, turn), x), y) in points.coordinates().zip(&*turns).zip(about_x).zip(about_y) {
                carry(at, sum(*turn, offset), [sum(alpha, small_turn(x)), sum(beta, small_turn(y))], shift);
            }
        }
        points
    }

    /// What the free corrections of a joint add at every pose, rad (mm); `None` where it has none.
    fn free(&self, joint: usize, of: fn(Parameter) -> Option<usize>, axis: usize, offsets: &[f64]) -> Option<Vec<f64>> {
        let mut free = None;
        for (i, offset) in
            offsets.iter().enumerate().filter(|(i, _)| self.parameters.get(*i).is_some_and(|p| of(*p) == Some(joint)))
        {
            let sums = free.get_or_insert_with(|| vec![0.0; self.poses.len()]);
            sums.iter_mut().zip(&self.poses).for_each(|(sum, pose)| *sum += offset / 1000.0 * pose.features[i][axis]);
        }
        free
    }
}

/// Carries a point from a joint's frame to the frame before it.
#[inline(always)]
fn carry([x, y, z]: [&mut f64; 3], turn: Turn, [alpha, beta]: [Turn; 2], [a_mm, d_mm]: [f64; 2]) {
    let (turned_x, turned_y) = turned(turn, (*x, *y));
    let (swung_z, swung_x) = turned(beta, (*z + d_mm, turned_x));
    (*y, *z) = turned(alpha, (turned_y, swung_z));
    *x = swung_x + a_mm;
}

/// The plane vector (u, v) turned from u towards v.
#[inline(always)]
fn turned((sin, cos): Turn, (u, v): (f64, f64)) -> (f64, f64) {
    (cos * u - sin * v, sin * u + cos * v)
}

/// Of the sum of two angles.
#[inline(always)]
fn sum((sin, cos): Turn, by: Turn) -> Turn {
    let (cos, sin) = turned(by, (cos, sin));
    (sin, cos)
}

/// Error below 1e-13 up to a tenth of a radian.
#[inline(always)]
fn small_turn(angle: f64) -> Turn {
    let square = angle * angle;
    let sin = angle * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))));
    let cos = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0)));
    (sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::corrections::{GravityTerm, LoadPoint};

    /// Rounding of some dozen operations on coordinates of a metre.
    const TOLERANCE_MM: f64 = 1e-10;

    #[test]
    fn the_hot_loop_agrees_with_the_chain() {
        let mut robot = Robot::paper();
        robot.tool_mm = Vector3::new(10.0, -20.0, 30.0);
        robot.joints[3].slides = true;
        robot.joints[4].sign = -1.0;
        let mut parameters = robot.mdh_parameters();
        parameters.extend(robot.beta_parameters());
        parameters.extend(robot.gravity_parameters(true));
        parameters.extend(robot.bending_parameters());
        parameters.extend(robot.wobble_parameters());
        robot.corrections.bending = vec![GravityTerm { joint: 2, point: LoadPoint::Tool, k_rad_per_m: 3e-3 }];
        parameters.extend(robot.harmonic_parameters(2));
        parameters.extend(robot.coupling_parameters(true));
        let joints: Vec<Vec<f64>> = (0..21).map(|i| (0..6).map(|j| ((7 * i + 3 * j) as f64).sin()).collect()).collect();
        let rows: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
        let kinematics = Kinematics::new(&robot, &robot, &parameters, &rows);
        let offsets: Vec<f64> = (0..parameters.len()).map(|i| 3.0 * (i as f64).cos()).collect();
        let places = kinematics.places(&offsets, false);
        let (points, rotations) = (kinematics.points(&offsets), kinematics.rotations(&offsets));
        for (i, (place, rotation)) in places.iter().zip(rotations).enumerate() {
            let point = points.at(i);
            assert!((point - place.point_mm.coords).norm() < TOLERANCE_MM, "{i}: {point} {}", place.point_mm);
            let turned = rotation - place.rotation;
            assert!(turned.norm() * AXIS_MM < 10.0 * TOLERANCE_MM, "{i}: {turned}");
        }
    }
}
