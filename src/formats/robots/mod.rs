//! A robot in other programs' words: URDF, tables, the kinematics of ROS and of Universal Robots.
//!
//! Each format carries the robot as far as it can; what it can carry is a [`Robot`] again, so that the rest is measured
//! and said.

pub mod dh_csv;
pub mod dh_text;
pub mod dh_words;
pub mod known;
pub mod ros_kinematics;
pub mod ur_calibration;
pub mod urdf;
pub mod urdf_corrected;
pub mod urdf_plain;

use crate::robot::Robot;

#[derive(Debug, Clone, PartialEq)]
pub struct ExportedRobot {
    pub name: &'static str,
    pub text: String,
    /// The robot that a reader of the file has, constant transforms added that the notes ask for.
    pub carried: Robot,
    /// What the reader must know.
    pub notes: Vec<String>,
}
