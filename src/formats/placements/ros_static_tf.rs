//! A ROS 2 launch file in YAML that publishes the placement on `/tf_static`.
//!
//! The arguments are those of `tf2_ros/src/static_transform_broadcaster_program.cpp` in ros2/geometry2: `--x --y --z` in metres, `--qx --qy --qz
//! --qw`, `--frame-id` of the parent and `--child-frame-id`. The published transform maps the child's coordinates to the parent's.

use super::{Placement, metres_and_quaternion, quoted};
use crate::geometry::Transform;

pub fn text(placement: &Placement) -> String {
    let frames = placement.frames;
    let node = |parent: &str, child: &str, transform: &Transform| {
        let numbers = metres_and_quaternion(transform).map(|(name, value)| format!("--{name} {value}")).join(" ");
        let name: String = child.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        let args = quoted(&format!("{numbers} --frame-id {parent} --child-frame-id {child}"));
        format!(
            "- node:\n    pkg: tf2_ros\n    exec: static_transform_publisher\n    name: {}\n    args: {args}\n",
            quoted(&format!("{name}_publisher"))
        )
    };
    let mut text = format!("launch:\n{}", node(&frames.base, &frames.camera, &placement.base_from_camera));
    if let Some(target) = &placement.flange_from_target {
        text.push_str(&node(&frames.flange, &frames.target, target));
    }
    text
}
