//! OpenCV's FileStorage, YAML, with the names of `calibrateHandEye` and `calibrateRobotWorldHandEye` for a camera that stands still, in mm.
//!
//! `R_cam2base`, `t_cam2base` map camera coordinates to the base's, as `calibrateHandEye` gives them for poses of the base in the gripper
//! (OpenCV documents that use for an eye to hand); `R_target2gripper`, `t_target2gripper` those of the target to the flange's.

use nalgebra::Vector3;

use super::Placement;
use crate::formats::export::matrix;
use crate::geometry::{Transform, rotation_matrix};

pub fn text(placement: &Placement) -> String {
    let mut text = String::from("%YAML:1.0\n---\n");
    let mut add = |name: &str, transform: &Transform| {
        let shift: Vector3<f64> = transform.translation.vector;
        text.push_str(&matrix(&format!("R_{name}"), 3, 3, rotation_matrix(transform).transpose().as_slice()));
        text.push_str(&matrix(&format!("t_{name}"), 3, 1, shift.as_slice()));
    };
    add("cam2base", &placement.base_from_camera);
    if let Some(target) = &placement.flange_from_target {
        add("target2gripper", target);
    }
    text
}
