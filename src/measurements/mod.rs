//! `poses.csv` and `measurements.csv`: where the robot was sent, and what was measured there.

mod assemble;
mod blanks;
mod columns;
mod copies;
mod given;
mod keys;
mod pose_list;
mod readings;
mod rows;
pub mod source;
mod stuck;
mod summaries;

pub use crate::csv_table::quoted;
pub use columns::is_not_near;
pub use given::Given;
pub(crate) use pose_list::read_pose_list;
pub use rows::{
    Measurement, Observed, RobotPose, Role, pose_fields, pose_header, poses_csv, read, read_poses, reading_name,
};
pub use source::Source;
