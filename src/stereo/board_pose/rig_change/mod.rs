//! Whether the rig, or the target, is another than was calibrated: at one pose, from one pose on, or during the whole
//! run.
//!
//! `consistency` finds poses and moments at which the rig is another, `judge` fits every `cause` of a change of the
//! whole run, `elsewhere` is of a right camera that stands anywhere else, `ending` ends the run where the points are
//! off by more than they may be, and a `judgement` says it in words.

pub mod cause;
pub(in crate::stereo::board_pose) mod consistency;
pub(in crate::stereo::board_pose) mod elsewhere;
mod ending;
pub mod judge;
pub mod judgement;
