//! easy_handeye's calibration file (ROS 1; `~/.ros/easy_handeye/NAME.yaml`): an eye-on-base calibration.
//!
//! The form is `HandeyeCalibration.to_dict` in `easy_handeye/src/easy_handeye/handeye_calibration.py` of IFL-CAMP/easy_handeye: `parameters` with
//! every argument of `HandeyeCalibrationParameters`, and `transformation`, which is published from `robot_base_frame` (parent) to
//! `tracking_base_frame` (child), in metres.

use super::{Placement, metres_and_quaternion, quoted};

pub fn text(placement: &Placement, name: &str) -> String {
    let frames = placement.frames;
    let parameters = [
        ("eye_on_hand", "false".to_owned()),
        ("move_group", quoted("manipulator")),
        ("move_group_namespace", quoted("/")),
        ("namespace", quoted(&format!("/{name}/"))),
        ("robot_base_frame", quoted(&frames.base)),
        ("robot_effector_frame", quoted(&frames.flange)),
        ("tracking_base_frame", quoted(&frames.camera)),
        ("tracking_marker_frame", quoted(&frames.target)),
    ];
    let mut text = String::from("parameters:\n");
    parameters.iter().for_each(|(key, value)| text.push_str(&format!("  {key}: {value}\n")));
    text.push_str("transformation:\n");
    for (key, value) in metres_and_quaternion(&placement.base_from_camera) {
        text.push_str(&format!("  {key}: {value:?}\n"));
    }
    text
}
