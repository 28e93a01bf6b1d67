//! Files that other stages and other programs read: what is written, apart from what is judged.

pub mod boards;
pub mod calibration;
pub mod camera_check;
mod checked;
pub mod export;
pub mod lenses;
pub mod measure;
pub mod placements;
pub mod plan;
pub mod recheck;
pub mod rectified;
pub mod robot_recheck;
pub mod robots;
pub mod targets;
