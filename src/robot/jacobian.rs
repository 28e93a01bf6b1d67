//! The target's point and its derivatives with respect to every parameter, in closed form.
//!
//! A rotation about an axis `u` through `o` moves the target `p` by `u x (p - o)`, a shift along `u` by `u`; every
//! parameter of the chain is one of the two. Corrections of a joint turn it, by their feature at the pose.

use nalgebra::{Matrix3, Point3, Vector3};

use super::bent::{Bent, Torques};
use super::{Joint, Parameter};

/// Columns of angles are per mrad.
pub const RAD_PER_MRAD: f64 = 1e-3;

/// What a parameter's joint turns by at a pose per unit of the parameter: about its axis (first number), or, where its
/// link tilts, about x and y of its link.
pub type Feature = [f64; 2];

/// The screws of a chain in one pose: what each of its parameters turns about or shifts along, base frame.
#[derive(Debug, Clone)]
pub struct Screws {
    joints: Vec<JointScrews>,
    /// Rotation of the flange, base frame.
    pub base_from_flange: Matrix3<f64>,
    /// The target's mark point, mm.
    pub target_mm: Point3<f64>,
}

#[derive(Debug, Clone)]
struct JointScrews {
    /// Axis of alpha and a, and a point on it.
    x: Vector3<f64>,
    before: Point3<f64>,
    y: Vector3<f64>,
    /// Axis of theta and d; both this and `y` pass through `origin`.
    z: Vector3<f64>,
    origin: Point3<f64>,
    /// What the joint does by itself goes along `z` or about it, counted like this.
    sign: f64,
    slides: bool,
}

/// A joint's turn with its sine and cosine, from which those of turns near it follow without another call.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    pub(super) rad: f64,
    pub(super) sine: f64,
    pub(super) cosine: f64,
}

impl Turn {
    /// The same of a turn in rad.
    pub fn new(rad: f64) -> Turn {
        let (sine, cosine) = rad.sin_cos();
        Turn { rad, sine, cosine }
    }

    /// Sine and cosine of another turn.
    pub fn sin_cos(&self, rad: f64) -> (f64, f64) {
        if self.is_near(rad) { self.near(rad) } else { rad.sin_cos() }
    }

    /// Whether another turn is so near that [`Turn::near`] has it to the last digit.
    #[inline(always)]
    pub(super) fn is_near(&self, rad: f64) -> bool {
        Small::is_small(rad - self.rad)
    }

    /// Sine and cosine of a turn that is near.
    #[inline(always)]
    pub(super) fn near(&self, rad: f64) -> (f64, f64) {
        self.further(Small::new(rad - self.rad))
    }

    /// Sine and cosine of the turn that is so much further.
    #[inline(always)]
    pub(super) fn further(&self, Small { sine, fall }: Small) -> (f64, f64) {
        (self.sine + (self.cosine * sine - self.sine * fall), self.cosine - (self.sine * sine + self.cosine * fall))
    }
}

/// The sine of a turn of up to a tenth, and what its cosine is below one.
#[derive(Debug, Clone, Copy)]
pub struct Small {
    sine: f64,
    fall: f64,
}

impl Small {
    /// Whether the series of a turn in rad end below the last digit.
    #[inline(always)]
    pub fn is_small(by: f64) -> bool {
        by.abs() <= 0.1
    }

    /// Of a turn in rad, by series that end below the last digit.
    #[inline(always)]
    pub fn new(by: f64) -> Small {
        // The reciprocals are constants: a division costs as much as ten products.
        let nested = |square: f64, [a, b, c]: [f64; 3]| 1.0 - square * a * (1.0 - square * b * (1.0 - square * c));
        let square = by * by;
        let sine = by * (1.0 - square * (1.0 / 6.0) * nested(square, [1.0 / 20.0, 1.0 / 42.0, 1.0 / 72.0]));
        Small { sine, fall: 0.5 * square * nested(square, [1.0 / 12.0, 1.0 / 30.0, 1.0 / 56.0]) }
    }
}

/// How a joint stands at a pose, or at several: sine and cosine of its alpha, its beta and its turn, and its way along
/// its axis, mm.
#[derive(Debug, Clone, Copy)]
pub struct Stance<T = f64> {
    pub alpha: [T; 2],
    pub beta: [T; 2],
    pub turn: [T; 2],
    pub shift_mm: T,
}

impl Stance {
    fn new(joint: &Joint, q: f64) -> Stance {
        let [alpha, beta, turn] = [joint.alpha_rad, joint.beta_rad, joint.turn_rad(q)].map(|rad| rad.sin_cos().into());
        Stance { alpha, beta, turn, shift_mm: joint.shift_mm(q) }
    }
}

impl Screws {
    /// Of the robot as it stands (see [`super::Robot::bent`]), with the target at `tool_mm` in the last joint's frame.
    pub fn new(bent: &Bent, tool_mm: &Vector3<f64>) -> Screws {
        let stances = bent.joints.iter().zip(&bent.joints_rad).map(|(joint, &q)| Stance::new(joint, q));
        Screws::standing(&bent.joints, stances, tool_mm)
    }

    /// The same of joints that stand like this; of the joints themselves only lengths, signs and kinds count.
    pub fn standing(joints: &[Joint], stances: impl Iterator<Item = Stance>, tool_mm: &Vector3<f64>) -> Screws {
        let mut screws = Vec::with_capacity(joints.len());
        let mut rotation = Matrix3::identity();
        let mut origin = Point3::origin();
        for (joint, Stance { alpha: [sa, ca], beta: [sb, cb], turn: [st, ct], shift_mm }) in joints.iter().zip(stances)
        {
            let x: Vector3<f64> = rotation.column(0).into();
            let (y0, z0) = (rotation.column(1), rotation.column(2));
            let y: Vector3<f64> = ca * y0 + sa * z0;
            let z1: Vector3<f64> = ca * z0 - sa * y0;
            let before = origin;
            origin += joint.a_mm * x;
            let x1 = cb * x - sb * z1;
            let z = sb * x + cb * z1;
            screws.push(JointScrews { x, before, y, z, origin, sign: joint.sign, slides: joint.slides });
            origin += shift_mm * z;
            rotation = Matrix3::from_columns(&[ct * x1 + st * y, ct * y - st * x1, z]);
        }
        Screws { joints: screws, base_from_flange: rotation, target_mm: origin + rotation * tool_mm }
    }

    /// Derivative of the target's point, mm per mm or mrad. `feature` is the parameter's factor at this pose (see
    /// [`feature`]).
    pub fn point_column(&self, parameter: Parameter, feature: Feature) -> Vector3<f64> {
        let p = self.target_mm;
        let column =
            |i: usize, f: &dyn Fn(&JointScrews) -> Vector3<f64>| self.joints.get(i).map_or(Vector3::zeros(), f);
        match parameter {
            Parameter::Alpha(i) => column(i, &|s| s.x.cross(&(p - s.before)) * RAD_PER_MRAD),
            Parameter::A(i) => column(i, &|s| s.x),
            Parameter::Beta(i) => column(i, &|s| s.y.cross(&(p - s.origin)) * RAD_PER_MRAD),
            Parameter::Theta(i) => column(i, &|s| s.z.cross(&(p - s.origin)) * RAD_PER_MRAD),
            Parameter::D(i) => column(i, &|s| s.z),
            Parameter::V(axis) => self.base_from_flange.column(axis.min(2)).into(),
            Parameter::Gravity(i, _) | Parameter::Harmonic(i, _) | Parameter::Coupling(i, _) => column(i, &|s| {
                let way = if s.slides { s.z } else { s.z.cross(&(p - s.origin)) };
                way * (s.sign * feature[0] * RAD_PER_MRAD)
            }),
            Parameter::Bending(i, _) | Parameter::Wobble(i, _) => {
                column(i, &|s| (s.x * feature[0] + s.y * feature[1]).cross(&(p - s.origin)) * RAD_PER_MRAD)
            }
        }
    }

    /// Derivative of the flange's orientation as a rotation vector in the base frame, rad per mm or mrad.
    pub fn rotation_column(&self, parameter: Parameter, feature: Feature) -> Vector3<f64> {
        let column =
            |i: usize, f: &dyn Fn(&JointScrews) -> Vector3<f64>| self.joints.get(i).map_or(Vector3::zeros(), f);
        match parameter {
            Parameter::Alpha(i) => column(i, &|s| s.x * RAD_PER_MRAD),
            Parameter::Beta(i) => column(i, &|s| s.y * RAD_PER_MRAD),
            Parameter::Theta(i) => column(i, &|s| s.z * RAD_PER_MRAD),
            Parameter::Bending(i, _) | Parameter::Wobble(i, _) => {
                column(i, &|s| (s.x * feature[0] + s.y * feature[1]) * RAD_PER_MRAD)
            }
            _ => parameter.corrected_joint().map_or(Vector3::zeros(), |i| {
                column(i, &|s| if s.slides { Vector3::zeros() } else { s.z * (s.sign * feature[0] * RAD_PER_MRAD) })
            }),
        }
    }
}

/// The feature of a parameter: 1 but for corrections.
pub fn feature(parameter: Parameter, torques: &Torques, joints_rad: &[f64]) -> Feature {
    let about_axis = match parameter {
        Parameter::Bending(joint, point) => return torques.levers_across_m(joint, point),
        Parameter::Wobble(joint, wave) => return joints_rad.get(joint).map_or([0.0; 2], |&q| wave.across(q)),
        Parameter::Gravity(joint, point) => torques.lever_m(joint, point),
        Parameter::Harmonic(joint, wave) => joints_rad.get(joint).map_or(0.0, |&q| wave.at(q)),
        Parameter::Coupling(_, of) => joints_rad.get(of).copied().unwrap_or(0.0),
        _ => 1.0,
    };
    [about_axis, 0.0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Robot;
    use crate::robot::chain::Joint;

    /// Step of the central differences, mm or mrad; their error is its square times the third derivative (below 1e-3
    /// mm).
    const STEP: f64 = 1e-2;
    const TOLERANCE_MM: f64 = 1e-6;

    #[test]
    fn a_turn_near_a_known_one_keeps_its_digits() {
        for at in [-2.5_f64, 0.0, 0.4, 1.6, 3.1] {
            for by in [0.0, 1e-9, -3e-4, 0.02, -0.0999, 0.11, 2.0] {
                let ((sine, cosine), rad) = (Turn::new(at).sin_cos(at + by), at + by);
                let off = (sine - rad.sin()).abs().max((cosine - rad.cos()).abs());
                assert!(off < 4e-16, "{at} {by}: {off}");
            }
        }
    }

    fn robots() -> Vec<Robot> {
        let mut bent = Robot::paper();
        for (i, joint) in bent.joints.iter_mut().enumerate() {
            joint.alpha_rad += 0.01 * i as f64;
            joint.beta_rad = 0.02 - 0.01 * i as f64;
            joint.a_mm += 3.0;
        }
        bent.tool_mm = Vector3::new(11.0, -7.0, 40.0);
        let mut seven = bent.clone();
        seven.joints.push(Joint {
            alpha_rad: 1.5,
            a_mm: 10.0,
            theta_rad: 0.3,
            d_mm: 20.0,
            sign: -1.0,
            ..Joint::default()
        });
        let mut sliding = bent.clone();
        sliding.joints[2].slides = true;
        sliding.joints[4].slides = true;
        sliding.joints[4].sign = -1.0;
        let mut two = bent.clone();
        two.joints.truncate(2);
        vec![bent, seven, two, sliding]
    }

    #[test]
    fn points_agree_with_the_chain() {
        for robot in robots() {
            let q: Vec<f64> = (0..robot.joints.len()).map(|i| 0.4 * i as f64 - 1.0).collect();
            assert!((Screws::new(&robot.bent(&q), &robot.tool_mm).target_mm - robot.target_mm(&q)).norm() < 1e-10);
        }
    }

    #[test]
    fn columns_agree_with_central_differences() {
        for robot in robots() {
            let mut parameters = robot.mdh_parameters();
            parameters.extend((1..robot.joints.len()).map(Parameter::Beta));
            parameters.extend(robot.harmonic_parameters(2));
            parameters.extend(robot.coupling_parameters(true));
            let q: Vec<f64> = (0..robot.joints.len()).map(|i| 0.7 * i as f64 - 1.1).collect();
            let screws = Screws::new(&robot.bent(&q), &robot.tool_mm);
            let torques = Torques::new(&robot, &q);
            for parameter in parameters {
                let at = |delta: f64| robot.shifted(&[parameter], &[delta]);
                let (plus, minus) = (at(STEP), at(-STEP));
                let difference = (plus.target_mm(&q) - minus.target_mm(&q)) / (2.0 * STEP);
                let feature = feature(parameter, &torques, &q);
                let column = screws.point_column(parameter, feature);
                assert!((column - difference).norm() < TOLERANCE_MM, "{}: {column} {difference}", parameter.name());
                let turn = plus.base_from_flange(&q).rotation * minus.base_from_flange(&q).rotation.inverse();
                let turn = turn.scaled_axis() / (2.0 * STEP);
                assert!(
                    (screws.rotation_column(parameter, feature) - turn).norm() < TOLERANCE_MM,
                    "{}",
                    parameter.name()
                );
            }
        }
    }

    #[test]
    fn sag_and_bending_turn_by_their_levers() {
        let robot = &robots()[0];
        let q = [0.3, -0.4, 0.5, 0.6, -0.7, 0.8];
        let (screws, torques) = (Screws::new(&robot.bent(&q), &robot.tool_mm), Torques::new(robot, &q));
        for parameter in
            [robot.gravity_parameters(true), robot.bending_parameters(), robot.wobble_parameters()].concat()
        {
            let at = |delta: f64| robot.shifted(&[parameter], &[delta]).target_mm(&q);
            let difference = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            let column = screws.point_column(parameter, feature(parameter, &torques, &q));
            assert!((column - difference).norm() < TOLERANCE_MM, "{}", parameter.name());
        }
    }
}
