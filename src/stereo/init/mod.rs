//! Where to start from: one picture, one camera, a board on a known rig. Nothing is rejected here.

pub mod board_pose;
pub mod homography;
pub mod single_camera;
