//! `camera-check.json`: the verdict and the figures it stands on, as a file.

use serde::Serialize;

use super::accuracy::{Accuracy, Range, Verdict};
use super::calibrate::Calibration;
use super::lens_choice::LensScore;
use crate::imaging::Skipped;

/// The content of `camera-check.json`. Lengths held out: no pair helped to calibrate the cameras that measured it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraCheckFile {
    passed: bool,
    verdict: Verdict,
    tolerance_mm: f64,
    max_abs_error_mm: f64,
    expanded_uncertainty_mm: f64,
    reprojection_rms_px: f64,
    baseline_mm: f64,
    lens: String,
    pairs_used: usize,
    pairs_skipped: Vec<Skipped>,
    folds: usize,
    corners_used: usize,
    corners_rejected: usize,
    corner_sigma_px: f64,
    reduced_chi_square: Option<f64>,
    ranges: Vec<Range>,
    pairs: Vec<PairRecord>,
    lens_scores: Vec<LensScore>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct PairRecord {
    pair: String,
    mean_error_x10_mm: Option<f64>,
    mean_error_y10_mm: Option<f64>,
    mean_error_x70_mm: Option<f64>,
    mean_error_y70_mm: Option<f64>,
    max_abs_error_mm: f64,
    gap_rms_mm: f64,
}

impl CameraCheckFile {
    /// Gathers the figures. `x10` and `x70` stand for one square and seven, or as many as the board has.
    pub fn new(calibration: &Calibration, accuracy: &Accuracy, tolerance_mm: f64) -> CameraCheckFile {
        let verdict = accuracy.verdict(tolerance_mm);
        let all = || calibration.views.iter().flat_map(|view| &view.observations);
        let pairs = accuracy
            .pairs
            .iter()
            .map(|p| PairRecord {
                pair: p.pair.clone(),
                mean_error_x10_mm: p.mean_error_x_short_mm,
                mean_error_y10_mm: p.mean_error_y_short_mm,
                mean_error_x70_mm: p.mean_error_x_long_mm,
                mean_error_y70_mm: p.mean_error_y_long_mm,
                max_abs_error_mm: p.max_abs_error_mm,
                gap_rms_mm: p.gap_rms_mm,
            })
            .collect();
        CameraCheckFile {
            passed: verdict == Verdict::Pass,
            verdict,
            tolerance_mm,
            max_abs_error_mm: accuracy.max_abs_error_mm,
            expanded_uncertainty_mm: accuracy.expanded_uncertainty_mm,
            reprojection_rms_px: calibration.rms_px,
            baseline_mm: calibration.rig().baseline_mm(),
            lens: calibration.rig().left.lens.name().to_owned(),
            pairs_used: calibration.views.len(),
            pairs_skipped: calibration.skipped.clone(),
            folds: accuracy.folds,
            corners_used: all().filter(|o| o.active).count(),
            corners_rejected: all().filter(|o| !o.active).count(),
            corner_sigma_px: calibration.noise.typical_px(&calibration.views),
            reduced_chi_square: calibration.noise.reduced_chi_square,
            ranges: accuracy.ranges.clone(),
            pairs,
            lens_scores: calibration.lens_scores.clone(),
        }
    }
}
