//! A placement in other programs' words: where a camera stands in the robot's base frame, and the target on the flange.
//!
//! In: `base_from_camera` and `flange_from_target` in mm, and the names that the frames are to have. Out: a file a placement.
//! ROS's optical frame (REP 103: x right, y down, z forward) is the camera's frame here.

pub mod easy_handeye;
pub mod file_storage;
pub mod record;
pub mod ros_static_tf;

use super::export::METRE;
use crate::geometry::Transform;

/// What the frames are called.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frames {
    /// The robot's base.
    pub base: String,
    pub flange: String,
    /// The left camera's optical frame.
    pub camera: String,
    pub target: String,
}

/// One placement to write.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement<'a> {
    /// Names of the frames.
    pub frames: &'a Frames,
    /// Where the camera stands.
    pub base_from_camera: Transform,
    /// Where the target sits, where its turn is known.
    pub flange_from_target: Option<Transform>,
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
