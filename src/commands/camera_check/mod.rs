//! `stereocal camera-check`: a rig from pictures of a board, or, with `--against`, whether one that was calibrated still holds.

mod calibrate;
mod recheck;

pub use calibrate::run;
