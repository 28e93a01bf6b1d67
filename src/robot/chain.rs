//! Modified Denavit-Hartenberg chain: forward kinematics of the flange and the target point.
//!
//! Source: eq. (1), (2) and (5) of Shi et al., with Hayati's rotation about y for nearly parallel axes.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::corrections::Corrections;
use crate::geometry::Transform;

/// One joint with the link before it: `Rx(alpha) Tx(a) Ry(beta) Rz(sign q + theta) Tz(d)`, or, where it slides,
/// `Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d + sign q)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Twist of the link before, rad.
    pub alpha_rad: f64,
    /// Length of the link before, mm.
    pub a_mm: f64,
    /// Hayati's rotation about y, rad; zero in the plain model.
    pub beta_rad: f64,
    /// Offset of the joint angle, rad.
    pub theta_rad: f64,
    /// Offset along the joint's axis, mm.
    pub d_mm: f64,
    /// Range of the commanded angle, rad (of a sliding joint: of its way, mm), where known.
    pub limits_rad: Option<(f64, f64)>,
    /// Whether it slides along its axis instead of turning about it.
    pub slides: bool,
    /// How the controller counts it: 1, or -1 where it counts against the axis.
    pub sign: f64,
}

/// A turning joint with all parameters zero, counted along its axis.
impl Default for Joint {
    fn default() -> Joint {
        Joint {
            alpha_rad: 0.0,
            a_mm: 0.0,
            beta_rad: 0.0,
            theta_rad: 0.0,
            d_mm: 0.0,
            limits_rad: None,
            slides: false,
            sign: 1.0,
        }
    }
}

/// What stands before the first and behind the last joint's frame: constant transforms that no calibration changes, the
/// identity by default. A drawing's base and flange need not be the frames of the Denavit-Hartenberg chain: `[base]`
/// and `[flange]` of a robot file say where they are, so that an imported chain reaches exactly the flange poses of its
/// source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    /// Frame 0 of the chain in the root frame of its source.
    pub root_from_frame0: Transform,
    /// The flange in the last joint's frame.
    pub last_frame_from_flange: Transform,
}

impl Default for Ends {
    fn default() -> Ends {
        Ends { root_from_frame0: Transform::identity(), last_frame_from_flange: Transform::identity() }
    }
}

/// A serial robot with a target at its flange.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// What it is called.
    pub name: String,
    /// Its joints from the base.
    pub joints: Vec<Joint>,
    /// The target's mark point in the last joint's frame, mm.
    pub tool_mm: Vector3<f64>,
    /// What the joints do beyond the commanded angle; nothing by default.
    pub corrections: Corrections,
    /// The constant transforms at both ends.
    pub ends: Ends,
}

impl Joint {
    /// Turn about the joint's axis when `q` is commanded (rad, of a sliding joint mm), rad.
    pub fn turn_rad(&self, q: f64) -> f64 {
        if self.slides { self.theta_rad } else { self.sign * q + self.theta_rad }
    }

    /// Way along the joint's axis when `q` is commanded (rad, of a sliding joint mm), mm.
    pub fn shift_mm(&self, q: f64) -> f64 {
        if self.slides { self.sign * q + self.d_mm } else { self.d_mm }
    }

    /// Maps the joint's frame to the frame of the joint before when `q` is commanded (rad, of a sliding joint mm).
    pub fn previous_from_this(&self, q: f64) -> Transform {
        let x = Vector3::x_axis();
        let link = Isometry3::from_parts(
            Translation3::new(self.a_mm, 0.0, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), self.beta_rad),
        );
        let joint = Isometry3::from_parts(
            Translation3::new(0.0, 0.0, self.shift_mm(q)),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.turn_rad(q)),
        );
        UnitQuaternion::from_axis_angle(&x, self.alpha_rad) * link * joint
    }
}

impl Robot {
    /// The flange's frame (the last joint's) in the base frame. One commanded angle a joint, rad (mm where it slides);
    /// corrections are applied.
    pub fn base_from_flange(&self, joints_rad: &[f64]) -> Transform {
        debug_assert_eq!(joints_rad.len(), self.joints.len());
        let bent = self.bent(joints_rad);
        bent.joints
            .iter()
            .zip(&bent.joints_rad)
            .fold(Transform::identity(), |base, (joint, &q)| base * joint.previous_from_this(q))
    }

    /// Origins of the base and of every joint's frame and the target, in the base frame, mm: the arm as a line.
    pub fn skeleton_mm(&self, joints_rad: &[f64]) -> Vec<Point3<f64>> {
        let bent = self.bent(joints_rad);
        let mut base_from_this = Transform::identity();
        let mut places = vec![Point3::origin()];
        for (joint, &q) in bent.joints.iter().zip(&bent.joints_rad) {
            base_from_this *= joint.previous_from_this(q);
            places.push(base_from_this * Point3::origin());
        }
        places.push(base_from_this * Point3::from(self.tool_mm));
        places
    }

    /// Length of the stretched arm, mm.
    pub fn reach_mm(&self) -> f64 {
        self.joints.iter().map(|j| j.a_mm.hypot(j.d_mm)).sum()
    }

    /// The numbers, from 1, of joints whose limits are not known.
    pub fn joints_without_limits(&self) -> Vec<String> {
        let open = self.joints.iter().zip(1..).filter(|(joint, _)| joint.limits_rad.is_none());
        open.map(|(_, number)| number.to_string()).collect()
    }

    /// The target's mark point in the base frame, mm.
    pub fn target_mm(&self, joints_rad: &[f64]) -> Point3<f64> {
        self.base_from_flange(joints_rad) * Point3::from(self.tool_mm)
    }

    /// The robot of Table 1 of the paper, with the target point in the flange's origin.
    pub fn paper() -> Robot {
        let joint = |alpha_deg: f64, a_mm, theta_deg: f64, d_mm| Joint {
            alpha_rad: alpha_deg.to_radians(),
            a_mm,
            theta_rad: theta_deg.to_radians(),
            d_mm,
            ..Joint::default()
        };
        Robot {
            name: "six-axis robot of Table 1".to_owned(),
            joints: vec![
                joint(0.0, 0.0, 0.0, 144.0),
                joint(90.0, 0.0, -90.0, 0.0),
                joint(0.0, -264.0, 0.0, 0.0),
                joint(0.0, -236.0, -90.0, 106.0),
                joint(90.0, 0.0, 0.0, 114.0),
                joint(-90.0, 0.0, 0.0, 67.0),
            ],
            tool_mm: Vector3::zeros(),
            corrections: Corrections::default(),
            ends: Ends::default(),
        }
    }

    /// This robot, six joints of Table 1 of the paper, with what the paper identified (Table 2, deg and mm).
    pub fn with_table_2(mut self) -> Robot {
        const ALPHA_DEG: [f64; 6] = [-0.1746, 0.6159, -0.7798, -0.5255, 0.9999, 0.6489];
        const A_MM: [f64; 6] = [0.0, 0.9999, 0.9999, -0.2770, 0.2263, 0.0];
        const THETA_DEG: [f64; 6] = [-0.3136, -0.9993, 0.9999, -0.6520, 0.1365, 0.0];
        const D_MM: [f64; 6] = [0.0, 0.0, 0.0, 0.5261, 0.2078, 0.1015];
        let deviations = ALPHA_DEG.into_iter().zip(A_MM).zip(THETA_DEG.into_iter().zip(D_MM));
        for (joint, ((alpha_deg, a_mm), (theta_deg, d_mm))) in self.joints.iter_mut().zip(deviations) {
            joint.alpha_rad += alpha_deg.to_radians();
            joint.a_mm += a_mm;
            joint.theta_rad += theta_deg.to_radians();
            joint.d_mm += d_mm;
        }
        self
    }

    /// The flange in the root frame, both constant transforms included. One commanded reading a joint.
    pub fn root_from_flange(&self, joints: &[f64]) -> Transform {
        self.ends.root_from_frame0 * self.base_from_flange(joints) * self.ends.last_frame_from_flange
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_skeleton_goes_from_the_base_to_the_target() {
        let robot = Robot { tool_mm: nalgebra::Vector3::new(1.0, 2.0, 30.0), ..Robot::paper() };
        let joints = [0.1, -0.2, 0.3, -0.4, 0.5, 0.6];
        let places = robot.skeleton_mm(&joints);
        assert_eq!((places.len(), places[0]), (8, Point3::origin()));
        assert!((places[7] - robot.target_mm(&joints)).norm() < 1e-9);
        assert!((places[6].coords - robot.base_from_flange(&joints).translation.vector).norm() < 1e-9);
    }
    use approx::assert_relative_eq;
    use nalgebra::Matrix4;

    /// Eq. (1) written out as the paper prints it.
    fn equation_1(joint: &Joint, q: f64) -> Matrix4<f64> {
        let (st, ct) = (q + joint.theta_rad).sin_cos();
        let (sa, ca) = joint.alpha_rad.sin_cos();
        let (a, d) = (joint.a_mm, joint.d_mm);
        #[rustfmt::skip]
        let matrix = Matrix4::new(
            ct, -st, 0.0, a,
            st * ca, ct * ca, -sa, -d * sa,
            st * sa, ct * sa, ca, d * ca,
            0.0, 0.0, 0.0, 1.0,
        );
        matrix
    }

    #[test]
    fn joints_agree_with_equation_1() {
        for joint in Robot::paper().joints {
            for q in [-2.0, 0.0, 0.3] {
                assert_relative_eq!(joint.previous_from_this(q).to_matrix(), equation_1(&joint, q), epsilon = 1e-12);
            }
        }
    }

    #[test]
    fn the_stretched_robot_stands_upright() {
        // All angles zero: the links 264 and 236 point straight up from the shoulder at 144 mm.
        let base_from_flange = Robot::paper().base_from_flange(&[0.0; 6]);
        assert_relative_eq!(base_from_flange.translation.vector.z, 144.0 + 264.0 + 236.0 + 114.0, epsilon = 1e-9);
    }
}
