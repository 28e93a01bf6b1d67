//! The target on the robot: its pose on a calibrated rig at every pose of the robot, and whether all of it fits together.
//!
//! In: a rig with its covariance and noise, the target's certificate, the corners of every robot pose in the order of the run. Out:
//! `cam_from_board` and its covariance, or why there is none; the target's own shape; what all poses share; a judgement of the rig.
//! `start` finds each pose by itself; `solve` is one least squares over all of them, within what is known before and through the windows
//! that corners are measured in; `rig_change` finds poses and moments at which the rig is another, and what changed; `finish` makes the
//! answers, and `series` is the list of these steps. `turns` numbers targets that look alike after a turn. `print_share` asks the same
//! equations what a calibration board's own print does to a rig, `pair_excess` how far the calibration's pairs scattered about it.

pub mod finish;
pub mod pair_excess;
pub mod print_share;
pub mod rig_change;
pub mod series;
mod solve;
mod start;
mod turns;

use nalgebra::{Matrix6, Matrix6xX};

use crate::geometry::Transform;

/// Fewest corners in each picture for six unknowns with something to spare.
pub const FEWEST_CORNERS: usize = 6;

/// The target at one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetPose {
    /// `cam_from_board`: the left camera is the camera.
    pub cam_from_board: Transform,
    /// Covariance: rotation (rad), then translation (mm); the pose's own part and what all poses share.
    pub covariance: Matrix6<f64>,
    /// The pose's own part.
    pub own_covariance: Matrix6<f64>,
    /// Derivative by the shared numbers, in the order of [`finish::Shared::parameters`]: rotation (rad), then translation (mm).
    pub sensitivity: Matrix6xX<f64>,
    /// Root mean square distance of the triangulated corners from the fitted target, mm.
    pub fit_rms_mm: f64,
    /// Root mean square of the length of the 2-D residuals, px.
    pub rms_px: f64,
    /// Corners used, both pictures together.
    pub corners: usize,
    /// Corners that were found and missed their prediction by more than chance allows.
    pub outliers: usize,
    /// Reduced chi-square of the corners that were used.
    pub chi_square: f64,
    /// How far `right_from_left` seems turned at this pose against all others, about x (epipolar residual), rad, and its sigma.
    pub pitch_rad: [f64; 2],
    /// The same about y: the residual of the target's size.
    pub yaw_rad: [f64; 2],
}
