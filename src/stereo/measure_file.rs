//! `measurements.csv` and `measure.json`: what was measured at every robot pose, as files.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use serde::Serialize;

use super::target::{TargetPose, nearest_half_turn};
use crate::geometry::{Transform, rotation_vector};
use crate::imaging::{Board, Corners};
use crate::measurements::{RobotPose, Role, pose_fields, pose_header, quoted};
use crate::median::median;

/// A residual this many times the median's is worth a warning.
const UNUSUAL: f64 = 3.0;

/// A robot pose and what was measured there.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPose {
    /// Where the robot was.
    pub at: RobotPose,
    /// The target's pose, or why there is none.
    pub target: Result<TargetPose, String>,
}

/// The content of `measure.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeasureFile {
    board: String,
    square_mm: f64,
    poses: usize,
    measured: usize,
    /// Root mean square over the poses of the corners' distance from the fitted board, mm.
    fit_rms_mm: Option<f64>,
    /// Root mean square over the poses of the 2-D residuals, px.
    reprojection_rms_px: Option<f64>,
    /// Median standard deviation of the mark point along x, y, z, mm.
    sigma_mm: Option<[f64; 3]>,
    missing: Vec<Missing>,
    warnings: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct Missing {
    pose: String,
    reason: String,
}

impl MeasureFile {
    /// Gathers the figures.
    pub fn new(measured: &[MeasuredPose], corners: &Corners, board: &Board) -> MeasureFile {
        let targets: Vec<&TargetPose> = measured.iter().filter_map(|m| m.target.as_ref().ok()).collect();
        let rms = |of: fn(&TargetPose) -> f64| {
            let squares: Vec<f64> = targets.iter().map(|t| of(t) * of(t)).collect();
            super::residuals::root_mean_square(&squares)
        };
        let sigma = |axis: usize| median(targets.iter().map(|t| t.covariance[(3 + axis, 3 + axis)].sqrt()));
        let missing: Vec<Missing> = measured
            .iter()
            .filter_map(|m| Some(Missing { pose: m.at.pose.clone(), reason: m.target.as_ref().err()?.clone() }))
            .collect();
        let mut warnings = corners.notes.clone();
        warnings.extend(unusual(measured));
        MeasureFile {
            board: board.squares.to_string(),
            square_mm: board.square_mm,
            poses: measured.len(),
            measured: targets.len(),
            fit_rms_mm: rms(|t| t.fit_rms_mm),
            reprojection_rms_px: rms(|t| t.rms_px),
            sigma_mm: sigma(0).zip(sigma(1)).zip(sigma(2)).map(|((x, y), z)| [x, y, z]),
            missing,
            warnings,
        }
    }

    /// What a person should look at.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Poses in the list, and poses measured.
    pub fn counts(&self) -> (usize, usize) {
        (self.poses, self.measured)
    }

    /// Residuals: mm on the board, px in the pictures.
    pub fn residuals(&self) -> (Option<f64>, Option<f64>) {
        (self.fit_rms_mm, self.reprojection_rms_px)
    }

    /// Median standard deviation of the mark point, mm.
    pub fn sigma_mm(&self) -> Option<[f64; 3]> {
        self.sigma_mm
    }
}

/// Poses that fit much worse than most.
fn unusual(measured: &[MeasuredPose]) -> Vec<String> {
    let usual = median(measured.iter().filter_map(|m| Some(m.target.as_ref().ok()?.rms_px))).unwrap_or(0.0);
    measured
        .iter()
        .filter_map(|m| Some((&m.at.pose, m.target.as_ref().ok()?.rms_px)))
        .filter(|(_, px)| *px > UNUSUAL * usual)
        .map(|(pose, px)| format!("pose {pose} fits worse than most: {px:.3} px against {usual:.3} px"))
        .collect()
}

/// `measurements.csv`: one row a pose in the order of the list; numbers are empty where there is no measurement.
pub fn to_csv(measured: &[MeasuredPose]) -> String {
    let joints = measured.first().map_or(0, |m| m.at.joints_deg.len());
    let mut text = pose_header(joints);
    text.push_str(",x_mm,y_mm,z_mm,sxx_mm2,sxy_mm2,sxz_mm2,syy_mm2,syz_mm2,szz_mm2,rx_rad,ry_rad,rz_rad,fit_rms_mm,corners,status\n");
    for m in measured {
        text.push_str(&pose_fields(&m.at));
        match &m.target {
            Ok(t) => {
                let p = t.cam_from_board.translation.vector;
                let r = rotation_vector(&t.cam_from_board);
                let s = |i: usize, j: usize| t.covariance[(3 + i, 3 + j)];
                let numbers =
                    [p.x, p.y, p.z, s(0, 0), s(0, 1), s(0, 2), s(1, 1), s(1, 2), s(2, 2), r.x, r.y, r.z, t.fit_rms_mm];
                for number in numbers {
                    let _ = write!(text, ",{number}");
                }
                let _ = writeln!(text, ",{},ok", t.corners);
            }
            Err(reason) => {
                let _ = writeln!(text, "{},{}", ",".repeat(14), quoted(reason));
            }
        }
    }
    text
}

/// Settles the half turn of a board that looks the same after one: in each group as at its centre, or its first measured pose.
pub fn agree_on_half_turns(board: &Board, measured: &mut [MeasuredPose]) {
    let mut references: BTreeMap<String, Transform> = BTreeMap::new();
    for wanted in [true, false] {
        for m in measured.iter().filter(|m| !wanted || m.at.role == Role::Center) {
            if let Ok(target) = &m.target {
                references.entry(m.at.group.clone()).or_insert(target.cam_from_board);
            }
        }
    }
    for m in measured {
        if let (Ok(target), Some(reference)) = (&mut m.target, references.get(&m.at.group)) {
            *target = nearest_half_turn(board, reference, target);
        }
    }
}
