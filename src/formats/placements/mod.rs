//! A placement in other programs' words: where a camera stands in the robot's base frame, and the target on the flange.
//!
//! In: `base_from_camera` and `flange_from_target` in mm, and the names that the frames are to have. Out: a file a
//! placement. ROS's optical frame (REP 103: x right, y down, z forward) is the camera's frame here.

pub mod record;

use super::export::{METRE, matrix};
use crate::geometry::{Transform, rotation_matrix};

/// What the frames are called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frames {
    pub base: String,
    pub flange: String,
    /// The left camera's optical frame.
    pub camera: String,
    pub target: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Placement<'a> {
    pub frames: &'a Frames,
    pub base_from_camera: Transform,
    /// Where the target sits, where its turn is known.
    pub flange_from_target: Option<Transform>,
}

impl Placement<'_> {
    /// easy_handeye's calibration file (ROS 1; `~/.ros/easy_handeye/NAME.yaml`): an eye-on-base calibration.
    ///
    /// The form is `HandeyeCalibration.to_dict` in `easy_handeye/src/easy_handeye/handeye_calibration.py` of
    /// IFL-CAMP/easy_handeye: `parameters` with every argument of `HandeyeCalibrationParameters`, and `transformation`,
    /// which is published from `robot_base_frame` (parent) to `tracking_base_frame` (child), in metres.
    pub fn easy_handeye(&self, name: &str) -> String {
        let parameters = [
            ("eye_on_hand", "false".to_owned()),
            ("move_group", quoted("manipulator")),
            ("move_group_namespace", quoted("/")),
            ("namespace", quoted(&format!("/{name}/"))),
            ("robot_base_frame", quoted(&self.frames.base)),
            ("robot_effector_frame", quoted(&self.frames.flange)),
            ("tracking_base_frame", quoted(&self.frames.camera)),
            ("tracking_marker_frame", quoted(&self.frames.target)),
        ];
        let mut text = String::from("parameters:\n");
        parameters.iter().for_each(|(key, value)| text.push_str(&format!("  {key}: {value}\n")));
        text.push_str("transformation:\n");
        for (key, value) in metres_and_quaternion(&self.base_from_camera) {
            text.push_str(&format!("  {key}: {value:?}\n"));
        }
        text
    }

    /// OpenCV's FileStorage, YAML, with the names of `calibrateHandEye` and `calibrateRobotWorldHandEye` for a camera
    /// that stands still, in mm.
    ///
    /// `R_cam2base`, `t_cam2base` map camera coordinates to the base's, as `calibrateHandEye` gives them for poses of
    /// the base in the gripper (OpenCV documents that use for an eye to hand); `R_target2gripper`, `t_target2gripper`
    /// those of the target to the flange's.
    pub fn file_storage(&self) -> String {
        let mut text = String::from("%YAML:1.0\n---\n");
        let mut add = |name: &str, transform: &Transform| {
            text.push_str(&matrix(&format!("R_{name}"), 3, 3, rotation_matrix(transform).transpose().as_slice()));
            text.push_str(&matrix(&format!("t_{name}"), 3, 1, transform.translation.vector.as_slice()));
        };
        add("cam2base", &self.base_from_camera);
        if let Some(target) = &self.flange_from_target {
            add("target2gripper", target);
        }
        text
    }

    /// A ROS 2 launch file in YAML that publishes the placement on `/tf_static`.
    ///
    /// The arguments are those of `tf2_ros/src/static_transform_broadcaster_program.cpp` in ros2/geometry2: `--x --y
    /// --z` in metres, `--qx --qy --qz --qw`, `--frame-id` of the parent and `--child-frame-id`. The published
    /// transform maps the child's coordinates to the parent's.
    pub fn ros_static_tf(&self) -> String {
        let node = |parent: &str, child: &str, transform: &Transform| {
            let numbers = metres_and_quaternion(transform).map(|(name, value)| format!("--{name} {value}")).join(" ");
            let args = quoted(&format!("{numbers} --frame-id {parent} --child-frame-id {child}"));
            let name = quoted(&format!("{}_publisher", plain(child)));
            format!(
                "- node:\n    pkg: tf2_ros\n    exec: static_transform_publisher\n    name: {name}\n    args: {args}\n"
            )
        };
        let Frames { base, flange, camera, target } = self.frames;
        let of_target = self.flange_from_target.as_ref().map(|pose| node(flange, target, pose)).unwrap_or_default();
        format!("launch:\n{}{of_target}", node(base, camera, &self.base_from_camera))
    }
}

/// `x`, `y`, `z` in metres, then `qx`, `qy`, `qz`, `qw`, with their names.
fn metres_and_quaternion(transform: &Transform) -> [(&'static str, f64); 7] {
    let (t, q) = (transform.translation.vector * METRE, transform.rotation.quaternion());
    [("x", t.x), ("y", t.y), ("z", t.z), ("qx", q.i), ("qy", q.j), ("qz", q.k), ("qw", q.w)]
}

/// A string as YAML and JSON have it.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A name that files and ROS frames may have.
pub fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}
