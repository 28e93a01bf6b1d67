//! What is said of the target at each pose, and of the run as a whole.

use nalgebra::{DMatrix, Matrix6, Matrix6xX, Vector3};

use crate::geometry::Transform;
use crate::measurements::RobotPose;
use crate::stereo::board_pose::rig_change::judgement::Judgement;

/// A change of the rig at one pose that lowers chi-square by more than this is none of chance: one pose in twenty
/// million.
pub(in crate::stereo::board_pose) const POSE_LIMIT: f64 = 45.0;

#[derive(Debug, Clone, PartialEq)]
pub struct TargetPose {
    /// `cam_from_board`: the left camera is the camera.
    pub cam_from_board: Transform,
    /// Covariance: rotation (rad), then translation (mm); the pose's own part and what all poses share.
    pub covariance: Matrix6<f64>,
    /// The pose's own part.
    pub own_covariance: Matrix6<f64>,
    /// Derivative by the shared numbers, in the order of [`Shared::parameters`]: rotation (rad), then translation (mm).
    pub sensitivity: Matrix6xX<f64>,
    /// Root mean square distance of the triangulated corners from the fitted target, mm; `None` where none is in use in
    /// both pictures.
    pub fit_rms_mm: Option<f64>,
    /// Root mean square of the length of the 2-D residuals, px.
    pub rms_px: f64,
    /// Corners used, both pictures together.
    pub corners: usize,
    /// Corners that were found and missed their prediction by more than chance allows.
    pub outliers: usize,
    /// Reduced chi-square of the corners that were used.
    pub chi_square: f64,
    /// How far `right_from_left` seems turned at this pose against all others, about x (epipolar residual), rad, and
    /// its sigma.
    pub pitch_rad: [f64; 2],
    /// The same about y: the residual of the target's size.
    pub yaw_rad: [f64; 2],
}

/// Why a pose has no measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// In one or two words.
    pub status: &'static str,
    /// For a person.
    pub reason: String,
}

#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPose {
    pub at: RobotPose,
    pub target: Result<TargetPose, Refusal>,
}

/// The target as it was found to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// Each crossing against the drawing, row by row, mm; without shift, turn and tilt.
    pub deviations_mm: Vec<Vector3<f64>>,
    /// Standard deviation of each.
    pub sigma_mm: Vec<Vector3<f64>>,
    /// How far crossings scatter in the plane, a coordinate, mm.
    pub in_plane_mm: f64,
    /// How far they scatter out of it, mm.
    pub out_of_plane_mm: f64,
    /// Its size against the drawing, minus one, and the standard deviation.
    pub stretch: [f64; 2],
}

/// What all poses share.
#[derive(Debug, Clone, PartialEq)]
pub struct Shared {
    /// Names: the rig's numbers with a covariance, then the crossings' deviations.
    pub parameters: Vec<String>,
    /// Their change against calibration and drawing.
    pub change: Vec<f64>,
    pub covariance: DMatrix<f64>,
}

#[derive(Debug, Clone, Default, PartialEq)]
pub struct Series {
    /// A row a pose, in the order of the run.
    pub poses: Vec<MeasuredPose>,
    /// The target, where any pose was measured.
    pub shape: Option<Shape>,
    pub shared: Option<Shared>,
    pub judgement: Judgement,
    /// How corners scatter here, px.
    pub noise_px: Option<f64>,
    /// How they scattered at the calibration, px.
    pub usual_px: Option<f64>,
    /// Chi-square of the rig's numbers and the target's size against what was known before, and its degrees of freedom.
    pub prior_chi_square: Option<[f64; 2]>,
    /// Chi-square a number over all poses, against the calibration's noise where that is known.
    pub chi_square: Option<f64>,
    /// How much larger the poses' disagreement with the common rig is than chance; covariances hold it.
    pub excess: f64,
    /// How much larger it was at the calibration, in units of the noise here; one where that is not known.
    pub usual_excess: f64,
    /// What nothing could tell.
    pub notes: Vec<String>,
}
