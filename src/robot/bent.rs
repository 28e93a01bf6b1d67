//! The robot at a commanded pose with all of its corrections applied, and the levers that weights have there.

use nalgebra::{Point3, Vector3};

use super::corrections::LoadPoint;
use super::{Joint, Robot};

/// The robot at one commanded pose with all of its corrections applied: a chain without any.
#[derive(Debug, Clone)]
pub struct Bent {
    /// Its joints, tilted by their bending at this pose.
    pub joints: Vec<Joint>,
    /// The angles that they really take, rad (ways, mm, where they slide).
    pub joints_rad: Vec<f64>,
}

impl Bent {
    /// Tilts a joint about x and y of its link, rad. A joint that the robot lacks is left alone.
    pub fn tilt(&mut self, joint: usize, [about_x, about_y]: [f64; 2]) {
        if let Some(joint) = self.joints.get_mut(joint) {
            joint.alpha_rad += about_x;
            joint.beta_rad += about_y;
        }
    }
}

#[derive(Debug, Clone)]
struct Axes {
    /// The joint's own.
    z: Vector3<f64>,
    origin: Point3<f64>,
    /// Of alpha and of beta, and the foot of the joint's axis, which both pass through.
    x: Vector3<f64>,
    y: Vector3<f64>,
    foot: Point3<f64>,
}

/// Torques of unit weights about the joints of the chain without corrections.
#[derive(Debug, Clone)]
pub struct Torques {
    axes: Vec<Axes>,
    tool_mm: Point3<f64>,
    gravity_direction: Vector3<f64>,
}

impl Torques {
    /// Of the chain at the commanded angles, one a joint, rad.
    pub fn new(robot: &Robot, joints_rad: &[f64]) -> Torques {
        let mut axes = Vec::with_capacity(robot.joints.len());
        let mut base_from_joint = nalgebra::Isometry3::identity();
        for (joint, &q) in robot.joints.iter().zip(joints_rad) {
            let before = base_from_joint;
            base_from_joint *= joint.previous_from_this(q);
            let (x, z) = (before.rotation * Vector3::x(), base_from_joint.rotation * Vector3::z());
            let (sin, cos) = joint.alpha_rad.sin_cos();
            axes.push(Axes {
                z,
                origin: Point3::from(base_from_joint.translation.vector),
                x,
                y: before.rotation * Vector3::new(0.0, cos, sin),
                foot: before * Point3::new(joint.a_mm, 0.0, 0.0),
            });
        }
        let tool_mm = base_from_joint * Point3::from(robot.tool_mm);
        Torques { axes, tool_mm, gravity_direction: robot.corrections.gravity_direction }
    }

    /// The lever of a unit weight at `point` about the axis of `joint` (from 0), m; zero where either does not exist.
    pub fn lever_m(&self, joint: usize, point: LoadPoint) -> f64 {
        match (self.axes.get(joint), self.place(point)) {
            (Some(axes), Some(place)) => self.torque(&axes.z, &axes.origin, &place),
            _ => 0.0,
        }
    }

    /// The levers of a unit weight at `point` about x and y of the link before `joint` (from 0), at the foot of its
    /// axis, m.
    pub fn levers_across_m(&self, joint: usize, point: LoadPoint) -> [f64; 2] {
        match (self.axes.get(joint), self.place(point)) {
            (Some(axes), Some(place)) => [axes.x, axes.y].map(|axis| self.torque(&axis, &axes.foot, &place)),
            _ => [0.0; 2],
        }
    }

    fn place(&self, point: LoadPoint) -> Option<Point3<f64>> {
        match point {
            LoadPoint::Origin(index) => self.axes.get(index).map(|axes| axes.origin),
            LoadPoint::Tool => Some(self.tool_mm),
        }
    }

    fn torque(&self, axis: &Vector3<f64>, through: &Point3<f64>, place: &Point3<f64>) -> f64 {
        axis.dot(&(place - through).cross(&self.gravity_direction)) / 1000.0
    }
}

impl Robot {
    /// What the joints really do when these angles are commanded, rad.
    pub fn bent(&self, joints_rad: &[f64]) -> Bent {
        if self.corrections.is_empty() {
            return Bent { joints: self.joints.clone(), joints_rad: joints_rad.to_vec() };
        }
        self.bent_with(joints_rad, &Torques::new(self, joints_rad))
    }

    /// The same with levers that are given.
    pub fn bent_with(&self, joints_rad: &[f64], torques: &Torques) -> Bent {
        let mut bent = Bent { joints: self.joints.clone(), joints_rad: self.corrected_with(joints_rad, torques) };
        for term in &self.corrections.bending {
            let levers_m = torques.levers_across_m(term.joint, term.point);
            bent.tilt(term.joint, levers_m.map(|lever| term.k_rad_per_m * lever));
        }
        for term in &self.corrections.wobble {
            if let Some(&q) = joints_rad.get(term.joint) {
                bent.tilt(term.joint, term.wave.across(q).map(|tilt| term.amplitude_rad * tilt));
            }
        }
        bent
    }

    fn corrected_with(&self, joints_rad: &[f64], torques: &Torques) -> Vec<f64> {
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
    use crate::robot::corrections::{Corrections, GravityTerm, HarmonicTerm, Wave};

    #[test]
    fn a_stretched_arm_sags_and_an_upright_one_does_not() {
        let mut robot = Robot::paper();
        robot.corrections.gravity = vec![GravityTerm { joint: 1, point: LoadPoint::Origin(2), k_rad_per_m: 1e-3 }];
        let upright = robot.bent(&[0.0; 6]).joints_rad;
        assert!(upright[1].abs() < 1e-15);
        // Lying flat, the elbow has a lever of 0.264 m; gravity lowers the target.
        let flat = [0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0];
        let sag = robot.bent(&flat).joints_rad[1] - flat[1];
        assert!((sag.abs() - 0.264e-3).abs() < 1e-12, "{sag}");
        let mut stiff = robot.clone();
        stiff.corrections = Corrections::default();
        assert!(robot.target_mm(&flat).z < stiff.target_mm(&flat).z);
    }

    #[test]
    fn a_bearing_yields_across_its_axis_and_not_about_it() {
        // The arm lies flat along -x of the base; a soft bearing of the base's axis lets it down, and turns it nowhere
        // else.
        let mut robot = Robot::paper();
        let flat = [0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0];
        let stiff = robot.target_mm(&flat);
        robot.corrections.bending = vec![GravityTerm { joint: 0, point: LoadPoint::Tool, k_rad_per_m: 1e-3 }];
        let (bent, reach_m) = (robot.target_mm(&flat), stiff.coords.xy().norm() / 1000.0);
        // The tilt is the compliance times the reach, and lowers what reaches so far by that angle.
        assert!((stiff.z - bent.z - 1e-3 * reach_m * reach_m * 1000.0).abs() < 1e-4, "{stiff} {bent}");
        assert!((stiff.coords.xy().norm() - bent.coords.xy().norm()).abs() < 0.1, "{stiff} {bent}");
        // Hanging from a ceiling it is let down the other way round in its own frame.
        robot.corrections.gravity_direction = Vector3::new(0.0, 0.0, 1.0);
        assert!(robot.target_mm(&flat).z > stiff.z);
    }

    #[test]
    fn a_tilt_that_turns_with_the_joint_is_a_twist_and_a_wobble_is_not() {
        let plain = Robot { tool_mm: Vector3::new(30.0, -20.0, 60.0), ..Robot::paper() };
        let mut wobbling = plain.clone();
        wobbling.corrections.wobble = vec![HarmonicTerm { joint: 4, wave: Wave::Cos, amplitude_rad: 1e-3 }];
        let q = |turn: f64| [0.1, 0.2, 0.3, 0.4, turn, 0.6];
        let moved = |turn: f64| (wobbling.target_mm(&q(turn)) - plain.target_mm(&q(turn))).norm();
        // At zero it tilts about x of the link alone, as its twist would; a quarter of a turn on about minus y.
        let twisted = plain.shifted(&[crate::robot::Parameter::Alpha(4)], &[1.0]);
        assert!((twisted.target_mm(&q(0.0)) - wobbling.target_mm(&q(0.0))).norm() < 1e-9);
        let quarter = std::f64::consts::FRAC_PI_2;
        let swung = plain.shifted(&[crate::robot::Parameter::Beta(4)], &[-1.0]);
        assert!((swung.target_mm(&q(quarter)) - wobbling.target_mm(&q(quarter))).norm() < 1e-9);
        assert!(moved(0.0) > 0.01 && moved(quarter) > 0.01);
    }

    #[test]
    fn waves_add_to_their_joint() {
        let mut robot = Robot::paper();
        robot.corrections.harmonics = vec![HarmonicTerm { joint: 3, wave: Wave::Cos2, amplitude_rad: 0.01 }];
        let q = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6];
        let corrected = robot.bent(&q).joints_rad;
        assert!((corrected[3] - 0.4 - 0.01 * 0.8f64.cos()).abs() < 1e-15);
        assert_eq!(corrected[..3], q[..3]);
    }
}
