//! What to plan.

use nalgebra::Vector3;

/// What to plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Poses to identify from, over all groups.
    pub samples: usize,
    /// Poses to verify with, over all groups.
    pub verify: usize,
    /// The paper's layout instead of the best one.
    pub paper: bool,
    /// Only poses that find out where the cameras stand, a group.
    pub first: Option<usize>,
    /// Candidates.
    pub pool: usize,
    /// Seed of the candidates.
    pub seed: u64,
    /// Middles of the spheres, base frame, mm; empty for the paper's, scaled by the robot's reach.
    pub centers_mm: Vec<Vector3<f64>>,
    /// Radius of the spheres, mm.
    pub radius_mm: f64,
    /// Standard deviation of a coordinate of the measured point, mm, instead of the rig's and the robot's.
    pub noise_mm: Option<f64>,
    /// Pose repeatability RP (ISO 9283), mm.
    pub repeatability_mm: f64,
}

/// Numbers of poses that the accuracy is always said for.
pub const COUNTS: [usize; 4] = [10, 20, 40, 80];

/// The paper's samples.
pub const PAPER_SAMPLES: usize = 262;
