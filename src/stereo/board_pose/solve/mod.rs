//! One weighted least squares over all poses: the rig within its calibration, the target within its certificate, the
//! corners through their windows.
//!
//! `pose_block` linearises a pose, `totals` sums over the poses, `bundle` steps, `prior` is what is known before,
//! `window` what a corner's window sees of misprinted crossings, `edge_bend` where those are; `estimate` finds the
//! weights with the values, and `alone` fits a pose with everything shared held.

pub mod alone;
pub mod bundle;
pub mod edge_bend;
pub mod estimate;
pub mod pose_block;
pub mod prior;
pub mod totals;
pub mod window;
