//! `stereocal camera-check`: a rig from pictures of a board, or, with `--against`, whether one that was calibrated
//! still holds.

mod calibrate;
mod recheck;
mod squares;

pub use calibrate::run;
