//! `poses.csv` and `measurements.csv`: where the robot was sent, and what was measured there.

mod apart;
mod assemble;
mod blanks;
mod copies;
mod given;
mod judge;
mod keys;
mod layout;
mod part;
mod pick;
mod rows;
pub mod source;
mod stuck;
mod unsettled;

pub use crate::csv_table::quoted;
pub use given::Given;
pub use rows::{
    Measurement, Observed, RobotPose, Role, pose_fields, pose_header, poses_csv, read, read_poses, reading_name,
};
pub use source::Source;
pub use unsettled::is_not_near;
