//! Files that other stages and other programs read: what is written, apart from what is judged.

pub mod board_files;
mod board_png;
pub mod board_sheet;
pub mod calibration;
pub mod camera_check;
mod checked;
pub mod dh_csv;
pub mod export;
pub mod known_robot;
pub mod lenses;
pub mod measure;
pub mod placement;
pub mod placements;
pub mod plan;
pub mod recheck;
pub mod rectified;
pub mod robot_recheck;
pub mod robots;
pub mod targets;
pub mod urdf;
