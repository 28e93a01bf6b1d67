//! The `kinematics` file of ROS's arm descriptions (as of `ur_description`): a frame a joint, metres and radians, each joint turning
//! about its own z.

use std::fmt::Write as _;

use super::ExportedRobot;
use crate::formats::robots::urdf::roll_pitch_yaw;
use crate::geometry::Transform;
use crate::robot::Robot;

/// Names of an arm of six joints.
const SIX: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];

/// Writes the file. The robot has no corrections and counts all joints along their axes.
pub fn build(robot: &Robot) -> ExportedRobot {
    let mut text = String::from("kinematics:\n");
    for (k, joint) in robot.joints.iter().enumerate() {
        let mut origin = joint.previous_from_this(0.0);
        if k == 0 {
            origin = robot.ends.root_from_frame0 * origin;
        }
        let name = if robot.joints.len() == SIX.len() { SIX[k].to_owned() } else { format!("joint_{}", k + 1) };
        let t = origin.translation.vector / 1000.0;
        let [roll, pitch, yaw] = roll_pitch_yaw(&origin.rotation);
        let _ = writeln!(
            text,
            "  {name}:\n    x: {:?}\n    y: {:?}\n    z: {:?}\n    roll: {roll:?}\n    pitch: {pitch:?}\n    yaw: {yaw:?}",
            t.x + 0.0,
            t.y + 0.0,
            t.z + 0.0
        );
    }
    let mut notes =
        vec!["each joint turns about its own z; ur_description puts `shoulder` into base_link_inertia".to_owned()];
    if robot.ends.last_frame_from_flange != Transform::identity() {
        notes.push(
            "the constant [flange] behind the last joint has no place in this format: add it behind it".to_owned(),
        );
    }
    ExportedRobot { name: "kinematics.yaml", text, carried: robot.clone(), notes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::catalogue;

    /// Against the maker's own file: universal robots' ur5e, default_kinematics.yaml.
    #[test]
    fn a_ur5e_is_what_its_maker_publishes() {
        let text = build(&catalogue::robot("ur5e").unwrap()).text;
        let number = |joint: &str, key: &str| -> f64 {
            let part = text.split_once(&format!("  {joint}:\n")).unwrap().1;
            let value = part.split_once(&format!("    {key}: ")).unwrap().1;
            value.lines().next().unwrap().parse().unwrap()
        };
        for (joint, key, expected) in [
            ("shoulder", "z", 0.1625),
            ("upper_arm", "roll", std::f64::consts::FRAC_PI_2),
            ("forearm", "x", -0.425),
            ("wrist_1", "x", -0.3922),
            ("wrist_1", "z", 0.1333),
            ("wrist_2", "y", -0.0997),
            ("wrist_3", "y", 0.0996),
        ] {
            assert!((number(joint, key) - expected).abs() < 1e-12, "{joint} {key}: {text}");
        }
    }
}
