//! Which joints of an arm are its shoulder, elbow and wrist, from the chain's geometry alone.
//!
//! The wrist is the last but one joint. The shoulder is the first joint whose axis is not that of the base: what it
//! turns, gravity pulls at. The elbow is the joint between them that is farthest from both: the largest of the lesser
//! of two distances, from its origin to the shoulder's axis and from the wrist's origin to its own axis, both as means
//! over postures (a joint that turns the upper arm about itself moves the wrist by little, a hinge by all of the
//! forearm). That is joint 3 of six-axis arms and joint 4 of arms with seven. What goes wrong: arms with fewer than
//! four joints have none of it.

use nalgebra::{Point3, Vector3};

use super::Robot;
use crate::geometry::Transform;

/// Sine of the angle between two axes below which they count as parallel.
const PARALLEL_SIN: f64 = 0.05;

/// Postures that the distances are averaged over.
const POSTURES: usize = 16;

/// Joints counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Anatomy {
    /// The first joint that gravity can load.
    pub shoulder: usize,
    /// The hinge in the middle of the arm.
    pub elbow: usize,
    /// The last but one joint.
    pub wrist: usize,
}

type Axes = Vec<(Vector3<f64>, Point3<f64>)>;

impl Anatomy {
    /// Of a robot; `None` where it has no joint between shoulder and wrist.
    pub fn of(robot: &Robot) -> Option<Anatomy> {
        let count = robot.joints.len();
        let wrist = count.checked_sub(2)?;
        let postures: Vec<Axes> = (0..POSTURES).map(|k| axes(robot, &posture(robot, k))).collect();
        let apart = |a: &Vector3<f64>, b: &Vector3<f64>| a.cross(b).norm() > PARALLEL_SIN;
        let first = &postures[0];
        let shoulder = (1..count).find(|&j| apart(&first[j].0, &first[0].0)).unwrap_or(1);
        let mean = |point: usize, axis: usize| {
            let distance = |p: &Axes| (p[point].1 - p[axis].1).cross(&p[axis].0).norm();
            postures.iter().map(distance).sum::<f64>() / POSTURES as f64
        };
        let reach = |e: &usize| mean(*e, shoulder).min(mean(wrist, *e));
        // The first of equals, so that rounding decides nothing.
        let elbow = (shoulder + 1..wrist).fold(None, |best: Option<usize>, e| match best {
            Some(b) if reach(&e) <= reach(&b) * (1.0 + 1e-6) => Some(b),
            _ => Some(e),
        })?;
        Some(Anatomy { shoulder, elbow, wrist })
    }

    /// Whether gravity can load the base's axis: the robot hangs on a wall or leans.
    pub fn base_leans(&self, robot: &Robot) -> bool {
        let base = axes(robot, &posture(robot, 0))[0].0;
        base.cross(&robot.corrections.gravity_direction).norm() > PARALLEL_SIN
    }
}

/// Angles of posture `k`, within half a turn of zero; sliding joints stay at zero.
fn posture(robot: &Robot, k: usize) -> Vec<f64> {
    let angle = |j: usize| (1.7 * k as f64 * (j as f64 + 1.3) + 0.9 * j as f64).sin() * std::f64::consts::FRAC_PI_2;
    robot.joints.iter().enumerate().map(|(j, joint)| if joint.slides { 0.0 } else { angle(j) }).collect()
}

fn axes(robot: &Robot, joints: &[f64]) -> Axes {
    let mut base_from_joint = Transform::identity();
    let axis = |(joint, &q): (&super::Joint, &f64)| {
        base_from_joint *= joint.previous_from_this(q);
        (base_from_joint.rotation * Vector3::z(), Point3::from(base_from_joint.translation.vector))
    };
    robot.joints.iter().zip(joints).map(axis).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::Joint;

    fn arm(links: &[(f64, f64, f64)]) -> Robot {
        let mut robot = Robot::paper();
        let joint = |&(alpha_deg, a_mm, d_mm): &(f64, f64, f64)| Joint {
            alpha_rad: f64::to_radians(alpha_deg),
            a_mm,
            d_mm,
            ..Joint::default()
        };
        robot.joints = links.iter().map(joint).collect();
        robot
    }

    #[test]
    fn six_axes_bend_at_the_third_and_seven_at_the_fourth() {
        assert_eq!(Anatomy::of(&Robot::paper()), Some(Anatomy { shoulder: 1, elbow: 2, wrist: 4 }));
        // A shoulder, an elbow and a wrist of intersecting axes, with and without offsets at the elbow.
        for offset in [0.0, 82.5] {
            let seven = arm(&[
                (0.0, 0.0, 340.0),
                (-90.0, 0.0, 0.0),
                (90.0, 0.0, 400.0),
                (90.0, offset, 0.0),
                (-90.0, -offset, 400.0),
                (90.0, 0.0, 0.0),
                (90.0, 88.0, 107.0),
            ]);
            assert_eq!(Anatomy::of(&seven), Some(Anatomy { shoulder: 1, elbow: 3, wrist: 5 }));
        }
    }

    #[test]
    fn a_base_on_the_wall_carries_too() {
        let mut robot = Robot::paper();
        let anatomy = Anatomy::of(&robot).unwrap();
        assert!(!anatomy.base_leans(&robot));
        robot.corrections.gravity_direction = Vector3::new(1.0, 0.0, 0.0);
        assert!(anatomy.base_leans(&robot));
        assert_eq!(robot.gravity_parameters(true).len(), 3 + 2 + 5);
    }
}
