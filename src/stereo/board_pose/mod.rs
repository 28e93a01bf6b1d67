//! The target on the robot: its pose on a calibrated rig at every pose of the robot, and whether all of it fits
//! together.
//!
//! In: a rig with its covariance and noise, the target's certificate, the corners of every robot pose in the order of
//! the run. Out: `cam_from_board` and its covariance, or why there is none; the target's own shape; what all poses
//! share; a judgement of the rig. `start` finds each pose by itself; `solve` is one least squares over all of them,
//! within what is known before and through the windows that corners are measured in; `rig_change` finds poses and
//! moments at which the rig is another, and what changed; `finish` makes the answers, and `series` is the list of these
//! steps. `turns` numbers targets that look alike after a turn. `print_share` asks the same equations what a
//! calibration board's own print does to a rig, `pair_excess` how far the calibration's pairs scattered about it.

mod answer;
mod finish;
pub mod pair_excess;
pub mod print_share;
pub mod rig_change;
mod run;
pub mod series;
mod solve;
mod start;
mod turns;

pub use answer::{MeasuredPose, Refusal, Series, Shape, Shared, TargetPose};
pub use run::{Knowledge, Seen};
