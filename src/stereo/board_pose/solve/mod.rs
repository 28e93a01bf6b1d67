//! One weighted least squares over all poses: the rig within its calibration, the target within its certificate, the corners through their
//! windows.
//!
//! `pose_block` linearises a pose, `totals` sums over the poses, `bundle` steps, `prior` is what is known before, `window` what a corner's window sees of
//! misprinted crossings, `edge_bend` where those are; `estimate` finds the weights with the values, and `alone` fits a pose with everything
//! shared held.

pub(in crate::stereo::board_pose) mod alone;
pub(in crate::stereo::board_pose) mod bundle;
pub(in crate::stereo::board_pose) mod edge_bend;
pub(in crate::stereo::board_pose) mod estimate;
pub(in crate::stereo::board_pose) mod pose_block;
pub(in crate::stereo::board_pose) mod prior;
pub(in crate::stereo::board_pose) mod totals;
pub(in crate::stereo::board_pose) mod window;
