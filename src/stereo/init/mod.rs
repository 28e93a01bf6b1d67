//! Where to start from: one picture, one camera, a board on a known rig, one camera against the other. Nothing is rejected here.

pub mod board_pose;
pub mod homography;
pub mod relative_pose;
pub mod single_camera;
