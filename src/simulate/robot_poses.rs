//! Where the cameras stand, and where the robot is sent: poses on spheres that it reaches and both cameras see.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};

use super::Error;
use super::check_poses::seen_by_both;
use super::draws::{Draws, Purpose};
use super::physical_board::PhysicalBoard;
use super::rig::left_from_field;
use super::settings::{Orientation, Settings, Sphere};
use crate::geometry::{Transform, facing, transform};
use crate::measurements::{RobotPose, Role};
use crate::robot::{Robot, inverse};
use crate::statistics::RP_OVER_SIGMA;
use crate::stereo::Rig;

/// Largest tilt of the flange out of its group's orientation, and largest turn about its axis, deg.
const VARIED_DEG: f64 = 25.0;

/// How far the cameras miss the place that was meant for them: rad and mm.
const PLACEMENT_RAD: f64 = 0.03;
const PLACEMENT_MM: f64 = 5.0;

/// How far the target is mounted off its drawing, rad.
const MOUNTING_RAD: f64 = 0.005;

/// Commanded angles are given to the controller with this many digits after the point, deg.
const COMMAND_STEP_DEG: f64 = 1e-4;

/// Starts from which the postures of a group's centre are looked for: a six-axis arm has up to eight.
const POSTURE_STARTS: usize = 200;

/// Draws a pose before it is given up.
const ATTEMPTS: usize = 4000;

/// A pose of the robot and what is true there.
#[derive(Debug, Clone, PartialEq)]
pub struct TruePose {
    /// What the controller was told.
    pub commanded: RobotPose,
    /// Index of its group.
    pub group: usize,
    /// Where the target really was in the left camera's frame.
    pub left_from_target: Transform,
}

/// The robot, nominal and true, and the target on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm {
    /// As its maker says.
    pub nominal: Robot,
    pub truth: Robot,
}

/// The target's printed side faces along the flange's z-axis: its own z-axis points back into the flange.
fn flange_from_target(robot: &Robot, mounting_rad: Vector3<f64>) -> Transform {
    let facing = UnitQuaternion::from_scaled_axis(Vector3::x() * PI);
    let turned = UnitQuaternion::from_scaled_axis(mounting_rad) * facing;
    transform(turned.scaled_axis(), robot.tool_mm)
}

struct Group<'a> {
    settings: &'a Settings,
    arm: &'a Arm,
    rig: &'a Rig,
    target: &'a PhysicalBoard,
    sphere: &'a Sphere,
    index: usize,
    nominal_flange_from_target: Transform,
    true_flange_from_target: Transform,
    left_from_base: Transform,
    draws: Draws,
}

/// All poses of all groups: each group its centre, then its samples, then those to verify.
pub fn plan(settings: &Settings, arm: &Arm, rig: &Rig, target: &PhysicalBoard) -> Result<Vec<TruePose>, Error> {
    let mut poses = Vec::new();
    let groups = settings.spheres.len();
    let share = |total: usize, index: usize| total / groups + usize::from(index < total % groups);
    for index in 0..groups {
        let mut group = Group::new(settings, arm, rig, target, index);
        let (samples, verify) = (share(settings.samples, index), share(settings.verify, index));
        let roles = std::iter::once(Role::Center)
            .chain(std::iter::repeat_n(Role::Sample, samples))
            .chain(std::iter::repeat_n(Role::Verify, verify));
        let center = group.center_start()?;
        for (number, role) in roles.enumerate() {
            poses.push(group.pose(number, role, &center)?);
        }
    }
    Ok(poses)
}

impl<'a> Group<'a> {
    fn new(settings: &'a Settings, arm: &'a Arm, rig: &'a Rig, target: &'a PhysicalBoard, index: usize) -> Group<'a> {
        let sphere = &settings.spheres[index];
        let mut draws = Draws::new(settings.seed, Purpose::RobotPoses, index as u64);
        // One target is mounted once: its stream does not depend on the group.
        let mounting = Draws::new(settings.seed, Purpose::RobotPoses, u64::MAX).direction() * MOUNTING_RAD;
        let placement = transform(draws.direction() * PLACEMENT_RAD, draws.direction() * PLACEMENT_MM);
        let nominal_flange_from_target = flange_from_target(&arm.nominal, Vector3::zeros());
        let base_from_flange = facing(&sphere.flange_axis);
        let base_from_field =
            transform((base_from_flange * nominal_flange_from_target.rotation).scaled_axis(), sphere.center_mm);
        let left_from_base = left_from_field() * placement * base_from_field.inverse();
        Group {
            settings,
            arm,
            rig,
            target,
            sphere,
            index,
            nominal_flange_from_target,
            true_flange_from_target: flange_from_target(&arm.truth, mounting),
            left_from_base,
            draws,
        }
    }

    /// Joint angles of the group's centre. Of the postures found from starts spread over the joints' ranges: the one
    /// that leaves the flange the most freedom and its joints room, so that the sphere round it can be reached without
    /// a flip.
    fn center_start(&mut self) -> Result<Vec<f64>, Error> {
        let wanted = self.base_from_flange(self.sphere.center_mm, UnitQuaternion::identity());
        let nominal = &self.arm.nominal;
        let mut starts = Draws::new(0, Purpose::RobotPoses, self.index as u64);
        let mut best: Option<(f64, Vec<f64>)> = None;
        for attempt in 0..ATTEMPTS {
            if attempt >= POSTURE_STARTS && best.is_some() {
                break;
            }
            let ranges = nominal.joints.iter().map(|joint| joint.limits_rad.unwrap_or((-PI, PI)));
            let start: Vec<f64> = ranges.map(|(low, high)| starts.uniform(0.8 * low, 0.8 * high)).collect();
            let Some(q) = inverse::from_start(nominal, &wanted, &start) else { continue };
            let merit = inverse::merit(nominal, &q);
            if best.as_ref().is_none_or(|(most, _)| merit > *most) {
                best = Some((merit, q));
            }
        }
        let out_of_reach = || Error::OutOfReach { group: self.name(), point_mm: self.sphere.center_mm.into() };
        best.map(|(_, q)| q).ok_or_else(out_of_reach)
    }

    fn name(&self) -> String {
        (self.index + 1).to_string()
    }

    /// The flange's pose that brings the mark point to `point_mm`, turned by `turn` from the group's orientation.
    fn base_from_flange(&self, point_mm: Vector3<f64>, turn: UnitQuaternion<f64>) -> Transform {
        let rotation = facing(&self.sphere.flange_axis) * turn * self.nominal_flange_from_target.rotation;
        transform(rotation.scaled_axis(), point_mm) * self.nominal_flange_from_target.inverse()
    }

    fn turn(&mut self) -> UnitQuaternion<f64> {
        match self.settings.orientation {
            Orientation::Fixed => UnitQuaternion::identity(),
            Orientation::Varied => {
                let (sin, cos) = self.draws.uniform(0.0, std::f64::consts::TAU).sin_cos();
                let tilt = VARIED_DEG.to_radians() * self.draws.unit().sqrt();
                let spin = self.draws.uniform(-VARIED_DEG, VARIED_DEG).to_radians();
                UnitQuaternion::from_scaled_axis(Vector3::new(cos, sin, 0.0) * tilt)
                    * UnitQuaternion::from_scaled_axis(Vector3::z() * spin)
            }
        }
    }

    fn pose(&mut self, number: usize, role: Role, center_rad: &[f64]) -> Result<TruePose, Error> {
        for _ in 0..ATTEMPTS {
            let (point, turn) = if role == Role::Center {
                (self.sphere.center_mm, UnitQuaternion::identity())
            } else {
                (self.sphere.center_mm + self.draws.direction() * self.settings.radius_mm, self.turn())
            };
            let wanted = self.base_from_flange(point, turn);
            let Some(q) = inverse::from_start(&self.arm.nominal, &wanted, center_rad) else { continue };
            let joints_deg = q.iter().map(|q| (q.to_degrees() / COMMAND_STEP_DEG).round() * COMMAND_STEP_DEG);
            let commanded = RobotPose {
                slides: Vec::new(),
                pose: format!("g{}_{number:03}", self.index + 1),
                group: self.name(),
                role,
                // Rounded once more so that the file shows four digits, not the products of a binary fraction; + 0
                // makes -0 a 0.
                joints_deg: joints_deg.map(|deg| format!("{deg:.4}").parse().unwrap_or(deg) + 0.0).collect(),
            };
            let left_from_target = self.true_pose(&commanded);
            if seen_by_both(self.rig, self.target, &left_from_target) {
                return Ok(TruePose { commanded, group: self.index, left_from_target });
            }
            if role == Role::Center {
                break;
            }
        }
        Err(Error::OutOfReach { group: self.name(), point_mm: self.sphere.center_mm.into() })
    }

    /// Where the true robot brings the target when told these angles, repeatability included.
    fn true_pose(&mut self, commanded: &RobotPose) -> Transform {
        let base_from_flange = self.arm.truth.base_from_flange(&commanded.joints_rad());
        let sigma_mm = self.settings.robot.repeatability_mm / RP_OVER_SIGMA;
        let shift = transform(Vector3::zeros(), self.draws.normal3() * sigma_mm);
        self.left_from_base * shift * base_from_flange * self.true_flange_from_target
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::world::World;

    fn before(world: &World) -> Vec<f64> {
        let mut center = (Vector3::zeros(), Vector3::zeros());
        let mut deviations = Vec::new();
        for pose in &world.poses {
            let nominal = world.arm.nominal.target_mm(&pose.commanded.joints_rad()).coords;
            let truth = pose.left_from_target.translation.vector;
            match pose.commanded.role {
                Role::Center => center = (nominal, truth),
                Role::Sample => {}
                Role::Verify => deviations.push(((truth - center.1).norm() - (nominal - center.0).norm()).abs()),
            }
        }
        deviations
    }

    #[test]
    fn poses_are_what_the_plan_says() {
        for orientation in [Orientation::Fixed, Orientation::Varied] {
            let world = World::new(Settings { orientation, ..Settings::paper() }, None).unwrap();
            let count = |role| world.poses.iter().filter(|p| p.commanded.role == role).count();
            assert_eq!([Role::Center, Role::Sample, Role::Verify].map(count), [4, 262, 50]);
            for pose in &world.poses {
                let q = pose.commanded.joints_rad();
                for (joint, q) in world.arm.nominal.joints.iter().zip(&q) {
                    let (low, high) = joint.limits_rad.unwrap();
                    assert!((low - 1e-6..=high + 1e-6).contains(q));
                }
                assert!(seen_by_both(&world.rig, &world.target, &pose.left_from_target));
                let sphere = &world.settings.spheres[pose.group];
                let out = (world.arm.nominal.target_mm(&q).coords - sphere.center_mm).norm();
                let radius = if pose.commanded.role == Role::Center { 0.0 } else { world.settings.radius_mm };
                // Commands are rounded to 1e-4 deg: 1 um at the arm's reach, a few joints together.
                assert!((out - radius).abs() < 0.005, "{out}");
                let axis = world.arm.nominal.base_from_flange(&q).rotation * Vector3::z();
                let tilt_deg = axis.angle(&sphere.flange_axis).to_degrees();
                let most = if orientation == Orientation::Fixed { 0.01 } else { VARIED_DEG + 0.01 };
                assert!(tilt_deg <= most, "{tilt_deg}");
            }
        }
    }

    #[test]
    fn distances_are_off_as_in_the_paper_before_identification() {
        let means: Vec<f64> = (1..=6)
            .map(|seed| {
                let settings = Settings { seed, orientation: Orientation::Fixed, ..Settings::paper() };
                let deviations = before(&World::new(settings, None).unwrap());
                deviations.iter().sum::<f64>() / deviations.len() as f64
            })
            .collect();
        let mean = means.iter().sum::<f64>() / means.len() as f64;
        // The paper's robot had 1.16 mm; six robots of this spread have a mean with a standard error of 0.16 mm.
        assert!((0.8..1.5).contains(&mean), "{mean}: {means:?}");
    }

    #[test]
    fn a_robot_without_deviations_is_where_it_should_be() {
        let robot = super::super::settings::RobotDeviations::default();
        let world = World::new(Settings { robot, ..Settings::small() }, None).unwrap();
        assert!(before(&world).iter().all(|d| *d < 1e-9));
    }
}
