//! The `kinematics` file of ROS's arm descriptions (as of `ur_description`): a frame a joint, metres and radians, each
//! joint turning about its own z.
//!
//! In, where it is read: the file, in YAML's block or flow style. Out: the robot from the first frame's parent to the
//! last frame, without limits. What goes wrong: names that do not say in which order the joints stand (YAML's keys have
//! none, and some programs sort them), a frame that lacks a number, mm and degrees; refused with the line.

use std::fmt::Write as _;

use camino::Utf8Path;
use nalgebra::{Point3, Vector3};

use super::ExportedRobot;
use crate::diagnostic::count;
use crate::files::{self, Result};
use crate::formats::robots::urdf::{beyond, of_origin, roll_pitch_yaw};
use crate::geometry::Transform;
use crate::progress;
use crate::robot::Robot;
use crate::robot::axes::{self, Axis};

/// Names of an arm of six joints.
const SIX: [&str; 6] = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];

/// What a frame has.
const NUMBERS: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

/// Words before the number of a joint, `joint_1`.
const COUNTED: [&str; 3] = ["joint", "link", "axis"];

/// A line and what is wrong there.
type Wrong = (u64, String);

/// A frame in the one before.
struct Frame {
    line: u64,
    name: String,
    numbers: [Option<f64>; 6],
}

/// The robot of such a file; none where the file is no text, or has no such frames.
pub fn read(path: &Utf8Path, name: &str) -> Result<Option<Robot>> {
    const HINT: &str = "each frame has x, y, z (m), roll, pitch, yaw (rad); frames are called as in ur_description, or joint_1, joint_2, ... from the base \
                        on, those of joints that turn alone; `xacro FILE > robot.urdf` makes a description of the whole arm, which is read too";
    let Ok(text) = files::read_text(path, "kinematics file", None) else { return Ok(None) };
    let refuse = |(line, message): Wrong| files::Error::format(path, Some(line), message, Some(HINT));
    let (frames, wrong) = frames(&text);
    let is_whole = |frame: &Frame| frame.numbers.iter().all(Option::is_some);
    if !frames.iter().any(is_whole) {
        return Ok(None);
    }
    if let Some(wrong) = wrong {
        return Err(refuse(wrong));
    }
    let frames = ordered(frames).map_err(refuse)?;
    let origins = frames.iter().map(origin).collect::<std::result::Result<Vec<Transform>, Wrong>>();
    let robot = of_origins(name, &origins.map_err(refuse)?);
    progress::note(format!(
        "{path}: {}; frames in m and rad, each joint turning about its own z, the flange in the last frame, no joint limits (as in ur_description)",
        count(robot.joints.len(), "joint")
    ));
    Ok(Some(robot))
}

/// The frames below the key `kinematics`, and the first thing that is wrong in them.
fn frames(text: &str) -> (Vec<Frame>, Option<Wrong>) {
    let (mut frames, mut wrong): (Vec<Frame>, Option<Wrong>) = (Vec::new(), None);
    let mut outside = None;
    for (line, text) in (1..).zip(text.lines()) {
        let text = text.split('#').next().unwrap_or("");
        let indented = text.len() - text.trim_start().len();
        if !text.trim().is_empty() && outside.is_some_and(|outside| indented <= outside) {
            outside = None;
        }
        for piece in text.split([',', '{', '}']) {
            let Some((key, value)) = piece.split_once(':') else { continue };
            let (key, value) = (key.trim().trim_matches(['"', '\'']), value.trim());
            let which = NUMBERS.iter().position(|number| *number == key);
            match (which, frames.last_mut()) {
                _ if outside.is_none() => outside = (key == "kinematics" && value.is_empty()).then_some(indented),
                (Some(which), Some(frame)) => {
                    let number = value.parse::<f64>().ok().filter(|v| v.is_finite());
                    let twice = frame.numbers[which].is_some();
                    if twice || number.is_none() {
                        let what = if twice { "a second time" } else { "where a number was needed" };
                        let message = format!("`{}` has `{key}: {value}` {what}", frame.name);
                        wrong.get_or_insert((line, message));
                    }
                    frame.numbers[which] = number;
                }
                (None, _) if value.is_empty() => frames.push(Frame { line, name: key.to_owned(), numbers: [None; 6] }),
                // `hash: ...`
                _ => {}
            }
        }
    }
    (frames, wrong)
}

/// The frames from the base on, as their names have it.
fn ordered(frames: Vec<Frame>) -> std::result::Result<Vec<Frame>, Wrong> {
    let counted = |name: &str| -> Option<usize> {
        let word = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let is_joint = COUNTED.iter().any(|of| word.trim_end_matches(['_', '-']).to_lowercase().ends_with(of));
        name[word.len()..].parse().ok().filter(|_| is_joint)
    };
    let six = |name: &str| SIX.iter().position(|known| *known == name).map(|at| at + 1);
    let all = |place: &dyn Fn(&str) -> Option<usize>| -> Option<Vec<usize>> {
        let places: Vec<usize> = frames.iter().map(|frame| place(&frame.name)).collect::<Option<_>>()?;
        (1..=frames.len()).all(|joint| places.contains(&joint)).then_some(places)
    };
    let places = all(&six).filter(|places| places.len() == SIX.len()).or_else(|| all(&counted));
    if let Some(places) = places {
        let mut placed: Vec<(usize, Frame)> = places.into_iter().zip(frames).collect();
        placed.sort_by_key(|(place, _)| *place);
        return Ok(placed.into_iter().map(|(_, frame)| frame).collect());
    }
    let names = frames.iter().map(|frame| frame.name.as_str()).collect::<Vec<_>>().join(", ");
    let line = frames.first().map_or(1, |frame| frame.line);
    Err((line, format!("the names of the frames, {names}, do not say which joints there are and in which order")))
}

/// A frame's origin in the one before.
fn origin(frame: &Frame) -> std::result::Result<Transform, Wrong> {
    let wrong = |message: String| (frame.line, format!("`{}` {message}", frame.name));
    if let Some(lacks) = frame.numbers.iter().position(Option::is_none) {
        return Err(wrong(format!("has no `{}`", NUMBERS[lacks])));
    }
    let [x, y, z, roll, pitch, yaw] = frame.numbers.map(Option::unwrap_or_default);
    if let Some(beyond) = beyond([x, y, z], [roll, pitch, yaw]) {
        return Err(wrong(beyond));
    }
    Ok(of_origin([x, y, z], [roll, pitch, yaw]))
}

/// The robot whose joints turn about the z of these frames, each in the one before.
fn of_origins(name: &str, origins: &[Transform]) -> Robot {
    let mut root_from_joint = Transform::identity();
    let axis = |origin: &Transform| {
        root_from_joint *= *origin;
        Axis {
            point_mm: Point3::from(root_from_joint.translation.vector),
            direction: root_from_joint.rotation * Vector3::z(),
            limits_rad: None,
            slides: false,
        }
    };
    let axes: Vec<Axis> = origins.iter().map(axis).collect();
    axes::robot(name, &axes, &root_from_joint)
}

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
    use crate::robot::refit::Residual;
    use crate::robot::{Corrections, Ends, catalogue};

    fn of(text: &str) -> Result<Option<Robot>> {
        let (_folder, path) = files::temporary("kinematics.yaml", text);
        read(&path, "arm")
    }

    fn said(text: &str) -> String {
        crate::diagnostic::report(&of(text).unwrap_err())
    }

    #[test]
    fn what_is_written_is_read_again() {
        for arm in catalogue::ARMS {
            let mut robot = arm.robot();
            (robot.corrections, robot.ends) = (Corrections::default(), Ends::default());
            robot.ends.root_from_frame0 = crate::compensate::pose(&[10.0, -20.0, 30.0, 0.3, -0.2, 1.1]);
            for (k, joint) in robot.joints.iter_mut().enumerate() {
                let s = (1.7 * k as f64).sin();
                (joint.sign, joint.slides) = (1.0, false);
                (joint.alpha_rad, joint.beta_rad) = (joint.alpha_rad + 2e-3 * s, joint.beta_rad - 1e-3);
                (joint.a_mm, joint.theta_rad) = (joint.a_mm + 0.4 * s, joint.theta_rad + 4e-3 * s);
            }
            let back = of(&build(&robot).text).unwrap().unwrap();
            let off = Residual::between(&robot, &back);
            assert!(off.max_mm < 1e-9 && off.max_rad < 1e-11, "{}: {off:?}", arm.name);
        }
    }

    /// Keys in any order, as programs write them that sort them, and what stands beside the frames.
    const FLOW: &str = "# an arm\nother: {x: 1}\nkinematics:\n  forearm: {x: -0.3, y: 0, z: 0.001, roll: 3.13, pitch: 3.13, yaw: -3.12}\n  hash: calib_7\n  \
        shoulder: {x: 0, y: 0, z: 0.15, roll: -0, pitch: 0, yaw: 1.0e-05}\n  upper_arm: {pitch: 0, roll: 1.57, x: 9e-05,\n    y: 0, yaw: 0.2, z: 0}\n  \
        wrist_1:\n    x: -0.25\n    y: 0\n    z: 0.11\n    roll: 0.003\n    pitch: 0  # rad\n    yaw: 0\n  wrist_2: {x: 0, y: -0.09, z: 0, roll: 1.6, pitch: 0, yaw: 0}\n  \
        wrist_3: {x: 0, y: 0.08, z: 0, roll: 1.5, pitch: 3.1, yaw: 3.1}\nx: 3\n";

    /// Against the chain written out: turns about x, y, z by roll, pitch, yaw, then the joint's own.
    #[test]
    fn frames_stand_one_behind_the_other_from_the_shoulder_to_the_last_wrist() {
        let robot = of(FLOW).unwrap().unwrap();
        let q = [0.4, -1.1, 0.9, 0.3, -0.7, 2.0];
        let frames = [
            [0.0, 0.0, 150.0, 0.0, 0.0, 1e-5],
            [0.09, 0.0, 0.0, 1.57, 0.0, 0.2],
            [-300.0, 0.0, 1.0, 3.13, 3.13, -3.12],
            [-250.0, 0.0, 110.0, 0.003, 0.0, 0.0],
            [0.0, -90.0, 0.0, 1.6, 0.0, 0.0],
            [0.0, 80.0, 0.0, 1.5, 3.1, 3.1],
        ];
        let mut expected = Transform::identity();
        for ([x, y, z, roll, pitch, yaw], q) in frames.into_iter().zip(q) {
            let rotation = nalgebra::UnitQuaternion::from_euler_angles(roll, pitch, yaw);
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), q);
            expected *= Transform::from_parts(Vector3::new(x, y, z).into(), rotation * turn);
        }
        let off = robot.root_from_flange(&q).inverse() * expected;
        assert!(off.translation.vector.norm() < 1e-9 && off.rotation.angle() < 1e-11, "{off}");
    }

    #[test]
    fn joints_that_are_counted_stand_in_that_order() {
        let frame = |name: &str, z: f64| format!("  {name}: {{x: 0, y: {z}, z: {z}, roll: {z}, pitch: 0, yaw: 0}}\n");
        let text = |names: [&str; 3]| {
            let frames: String = names.iter().zip([0.3, 0.2, 0.1]).map(|(name, z)| frame(name, z)).collect();
            format!("kinematics:\n{frames}")
        };
        let place = |names| of(&text(names)).unwrap().unwrap().root_from_flange(&[0.1, 0.2, 0.3]).translation.vector;
        let first = place(["joint_1", "joint_2", "joint_3"]);
        assert!((place(["r6_joint3", "r6_joint2", "r6_joint1"]) - first).norm() > 1.0);
        // A frame that no joint turns by its name, an order that no name says, a part of an arm.
        for names in [
            ["joint_1", "joint_2", "tool0"],
            ["elbow", "hand", "root"],
            ["wrist_1", "wrist_2", "wrist_3"],
            ["joint_1", "joint_2", "joint_2"],
            ["joint_1", "joint_2", "joint_4"],
        ] {
            let said = said(&text(names));
            assert!(said.contains(names[2]) && said.contains("do not say which joints"), "{said}");
        }
        assert!(said(&format!("{FLOW}kinematics:\n{}", frame("flange", 0.1))).contains("flange"));
    }

    #[test]
    fn what_is_no_frame_of_a_robot_is_refused_with_its_line() {
        for (old, new, words) in [
            ("z: 0.11\n", "", ["kinematics.yaml:9", "`wrist_1` has no `z`"]),
            ("z: 0.11\n", "z: 0.11\n    x: 1\n", ["kinematics.yaml:13", "`wrist_1` has `x: 1` a second time"]),
            ("0.11\n", "d4\n", ["kinematics.yaml:12", "`z: d4` where a number was needed"]),
            ("-0.25\n", "-250\n", ["`wrist_1` has 250", "these are mm"]),
            ("roll: 1.6,", "roll: 90,", ["`wrist_2` has 90", "these are degrees"]),
        ] {
            let said = said(&FLOW.replacen(old, new, 1));
            assert!(words.iter().all(|word| said.contains(word)), "{said}");
        }
        // Settings of a solver, and parameters that a table's reader knows.
        for text in [
            "kinematics:\n  arm:\n    solver: kdl\n",
            "kinematics:\n  j1: {a: 0, d: 0.1, alpha: 0}\n",
            &FLOW.replace("kinematics:", "frames:"),
        ] {
            assert!(of(text).unwrap().is_none(), "{text}");
        }
    }

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
