//! What the joints do beyond the commanded angle: sag under gravity, and once- and twice-a-turn errors of the drives.
//!
//! In: the commanded angles. Out: the small angle that is added to each of them.
//! Sag of joint j is its compliance times the torque of unit weights at origins of the chain and at the tool about its axis,
//! on the robot's own chain without corrections; the periodic errors are `a sin q + b cos q + c sin 2q + d cos 2q`; a coupling
//! is a ratio times the angle of another joint, or of the joint itself (an error of its scale).
//! All are linear in their coefficients, so a pose contributes constants (the features) and the coefficients are parameters.
//! The direction of gravity must be known: a robot on a wall needs its own.

use nalgebra::{Point3, Vector3};

use super::Robot;

/// Where a unit weight hangs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LoadPoint {
    /// The origin of a joint's frame, the joint counted from 0.
    Origin(usize),
    /// The target's mark point.
    Tool,
}

impl LoadPoint {
    /// Its name in files: `joint_3`, `tool`.
    pub fn name(self) -> String {
        match self {
            LoadPoint::Origin(joint) => format!("joint_{}", joint + 1),
            LoadPoint::Tool => "tool".to_owned(),
        }
    }

    /// The point of that name on a robot of so many joints. `elbow` and `wrist` are the third and the last but one joint.
    pub fn from_name(name: &str, joint_count: usize) -> Option<LoadPoint> {
        let joint = match name {
            "tool" => return Some(LoadPoint::Tool),
            "elbow" => 2,
            "wrist" => joint_count.checked_sub(2)?,
            _ => name.strip_prefix("joint_")?.parse::<usize>().ok()?.checked_sub(1)?,
        };
        (joint < joint_count).then_some(LoadPoint::Origin(joint))
    }

    /// The joint whose frame's origin it is, or `None` for the tool.
    fn joint(self) -> Option<usize> {
        match self {
            LoadPoint::Origin(joint) => Some(joint),
            LoadPoint::Tool => None,
        }
    }
}

/// A joint yields to the torque of a unit weight.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GravityTerm {
    /// The joint, from 0.
    pub joint: usize,
    /// Where the weight hangs.
    pub point: LoadPoint,
    /// Turn a metre of lever, rad.
    pub k_rad_per_m: f64,
}

/// A periodic error of a drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wave {
    /// `sin q`
    Sin,
    /// `cos q`
    Cos,
    /// `sin 2q`
    Sin2,
    /// `cos 2q`
    Cos2,
}

impl Wave {
    /// All of them, in the order of the files.
    pub const ALL: [Wave; 4] = [Wave::Sin, Wave::Cos, Wave::Sin2, Wave::Cos2];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Wave::Sin => "sin",
            Wave::Cos => "cos",
            Wave::Sin2 => "sin2",
            Wave::Cos2 => "cos2",
        }
    }

    /// Its value at the commanded angle.
    pub fn at(self, q_rad: f64) -> f64 {
        match self {
            Wave::Sin => q_rad.sin(),
            Wave::Cos => q_rad.cos(),
            Wave::Sin2 => (2.0 * q_rad).sin(),
            Wave::Cos2 => (2.0 * q_rad).cos(),
        }
    }
}

/// One wave of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HarmonicTerm {
    /// The joint, from 0.
    pub joint: usize,
    /// Which wave.
    pub wave: Wave,
    /// Its amplitude, rad.
    pub amplitude_rad: f64,
}

/// A joint that moves by itself as another one moves, or that counts its own angle too long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CouplingTerm {
    /// The joint that moves, from 0.
    pub joint: usize,
    /// The joint that moves it, from 0; itself for an error of scale.
    pub of: usize,
    /// Way of the one over the commanded way of the other.
    pub ratio: f64,
}

/// All corrections of a robot; none by default.
#[derive(Debug, Clone, PartialEq)]
pub struct Corrections {
    /// Unit vector along gravity in the base frame.
    pub gravity_direction: Vector3<f64>,
    /// Sag.
    pub gravity: Vec<GravityTerm>,
    /// Periodic errors.
    pub harmonics: Vec<HarmonicTerm>,
    /// Scale and coupling.
    pub couplings: Vec<CouplingTerm>,
}

impl Default for Corrections {
    fn default() -> Corrections {
        Corrections {
            gravity_direction: Vector3::new(0.0, 0.0, -1.0),
            gravity: Vec::new(),
            harmonics: Vec::new(),
            couplings: Vec::new(),
        }
    }
}

impl Corrections {
    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.gravity.is_empty() && self.harmonics.is_empty() && self.couplings.is_empty()
    }
}

/// Torques of unit weights about the joints of the chain without corrections.
#[derive(Debug, Clone)]
pub struct Torques {
    axes: Vec<(Vector3<f64>, Point3<f64>)>,
    tool_mm: Point3<f64>,
    gravity_direction: Vector3<f64>,
}

impl Torques {
    /// Of the chain at the commanded angles, one a joint, rad.
    pub fn new(robot: &Robot, joints_rad: &[f64]) -> Torques {
        let mut axes = Vec::with_capacity(robot.joints.len());
        let mut base_from_joint = nalgebra::Isometry3::identity();
        for (joint, &q) in robot.joints.iter().zip(joints_rad) {
            base_from_joint *= joint.previous_from_this(q);
            axes.push((base_from_joint.rotation * Vector3::z(), Point3::from(base_from_joint.translation.vector)));
        }
        let tool_mm = base_from_joint * Point3::from(robot.tool_mm);
        Torques { axes, tool_mm, gravity_direction: robot.corrections.gravity_direction }
    }

    /// The lever of a unit weight at `point` about the axis of `joint` (from 0), m; zero where either does not exist.
    pub fn lever_m(&self, joint: usize, point: LoadPoint) -> f64 {
        let place = match point.joint() {
            Some(index) => self.axes.get(index).map(|(_, origin)| *origin),
            None => Some(self.tool_mm),
        };
        match (self.axes.get(joint), place) {
            (Some((axis, origin)), Some(place)) => axis.dot(&(place - origin).cross(&self.gravity_direction)) / 1000.0,
            _ => 0.0,
        }
    }
}

impl Robot {
    /// The angles the joints really take when these are commanded, rad.
    pub fn corrected_rad(&self, joints_rad: &[f64]) -> Vec<f64> {
        if self.corrections.is_empty() {
            return joints_rad.to_vec();
        }
        self.corrected_with(joints_rad, &Torques::new(self, joints_rad))
    }

    /// The same with levers that are given.
    pub fn corrected_with(&self, joints_rad: &[f64], torques: &Torques) -> Vec<f64> {
        let mut corrected = joints_rad.to_vec();
        for term in &self.corrections.harmonics {
            if let (Some(angle), Some(&q)) = (corrected.get_mut(term.joint), joints_rad.get(term.joint)) {
                *angle += term.amplitude_rad * term.wave.at(q);
            }
        }
        for term in &self.corrections.couplings {
            if let (Some(angle), Some(&q)) = (corrected.get_mut(term.joint), joints_rad.get(term.of)) {
                *angle += term.ratio * q;
            }
        }
        for term in &self.corrections.gravity {
            if let Some(angle) = corrected.get_mut(term.joint) {
                *angle += term.k_rad_per_m * torques.lever_m(term.joint, term.point);
            }
        }
        corrected
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretched_arm_sags_and_an_upright_one_does_not() {
        let mut robot = Robot::paper();
        robot.corrections.gravity = vec![GravityTerm { joint: 1, point: LoadPoint::Origin(2), k_rad_per_m: 1e-3 }];
        let upright = robot.corrected_rad(&[0.0; 6]);
        assert!(upright[1].abs() < 1e-15);
        // Lying flat, the elbow has a lever of 0.264 m; gravity lowers the target.
        let flat = [0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0];
        let sag = robot.corrected_rad(&flat)[1] - flat[1];
        assert!((sag.abs() - 0.264e-3).abs() < 1e-12, "{sag}");
        let mut stiff = robot.clone();
        stiff.corrections = Corrections::default();
        assert!(robot.target_mm(&flat).z < stiff.target_mm(&flat).z);
    }

    #[test]
    fn waves_add_to_their_joint() {
        let mut robot = Robot::paper();
        robot.corrections.harmonics = vec![HarmonicTerm { joint: 3, wave: Wave::Cos2, amplitude_rad: 0.01 }];
        let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let corrected = robot.corrected_rad(&q);
        assert!((corrected[3] - 0.4 - 0.01 * 0.8f64.cos()).abs() < 1e-15);
        assert_eq!(corrected[..3], q[..3]);
    }
}
