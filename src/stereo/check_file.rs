//! `camera-check.json`: the verdict and the figures it stands on, as a file.

use serde::Serialize;

use super::accuracy::{Accuracy, Range, SecondBoard, Verdict, Worst};
use super::calibrate::Calibration;
use super::disagreement::{self, Disagreement};
use super::lens_choice::LensScore;
use super::neighbours::NeighbourCorrelation;
use super::variety;
use super::volume::{self, LengthSigma};
use super::whiteness::{self, Whiteness};
use crate::imaging::Skipped;

/// A calibration with everything that was asked of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The tolerance, mm.
    pub tolerance_mm: f64,
    /// Pass, fail or undecided: the held-out pairs and, where there is one, the second board.
    pub verdict: Verdict,
    /// Held-out accuracy.
    pub accuracy: Accuracy,
    /// A second board.
    pub second: Option<SecondBoard>,
    /// Whether the residuals are noise.
    pub whiteness: Whiteness,
    /// Lens models that disagree.
    pub disagreements: Vec<Disagreement>,
    /// Uncertainty of the long range over the volume.
    pub length_sigmas: Vec<LengthSigma>,
    /// What to photograph next, where the views are too few or too much alike.
    pub advice: Vec<String>,
    /// What else a person should know.
    pub warnings: Vec<String>,
}

/// What lengths are judged by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demand {
    /// The largest error that passes, mm.
    pub tolerance_mm: f64,
    /// Expanded uncertainty (k = 2) of the boards' own lengths, as certified, mm.
    pub board_uncertainty_mm: f64,
}

impl Judged {
    /// Judges.
    pub fn new(
        calibration: &Calibration,
        mut accuracy: Accuracy,
        mut second: Option<SecondBoard>,
        demand: &Demand,
    ) -> Judged {
        let Demand { tolerance_mm, board_uncertainty_mm } = *demand;
        // An error is measured minus nominal: what the board's true length may differ from its nominal one adds to its uncertainty.
        let with_board = |worst: &mut Worst| *worst = worst.with_board(board_uncertainty_mm);
        with_board(&mut accuracy.worst);
        second.iter_mut().for_each(|second| with_board(&mut second.worst));
        let whiteness = whiteness::check(calibration);
        let disagreements = disagreement::find(calibration);
        let advice = variety::advise(calibration, &whiteness);
        let mut warnings = Vec::from_iter(calibration.rig().unusual());
        warnings.extend(whiteness.describe());
        warnings.extend(disagreement::describe(&disagreements));
        warnings.extend(print_scatter(calibration, &accuracy));
        let held_out = accuracy.verdict(tolerance_mm);
        let verdict = second.as_ref().map_or(held_out, |second| {
            let own = Verdict::of(&second.worst, tolerance_mm);
            if own != Verdict::Pass {
                warnings.push(format!(
                    "the second board's lengths are off by up to {:.4} mm (+- {:.4} mm, k = 2), its scale by {:.1} +- {:.1} parts in a million",
                    second.worst.error_mm,
                    second.worst.expanded_uncertainty_mm(),
                    1e6 * second.scale_error,
                    2e6 * second.scale_error_sigma
                ));
            }
            held_out.and(own)
        });
        let length_sigmas = volume::length_sigmas(calibration, accuracy.long_mm[0]);
        Judged { tolerance_mm, verdict, accuracy, second, whiteness, disagreements, length_sigmas, advice, warnings }
    }
}

/// Says where it is the board that scatters and not the corners: both pictures then see the same deviations.
fn print_scatter(calibration: &Calibration, accuracy: &Accuracy) -> Option<String> {
    /// Of independent corners the mean of thousands of points lies within a tenth of one.
    const SHARED: f64 = 0.25;
    if accuracy.rays_chi_square > SHARED {
        return None;
    }
    let depths = calibration.values.poses.iter().map(|pose| pose.translation.vector.z);
    let depth_mm = depths.sum::<f64>() / calibration.values.poses.len().max(1) as f64;
    let sigma_px = calibration.noise.typical_px(&calibration.views);
    Some(format!(
        "left and right picture agree on the corners {:.0} times better than the residuals let expect: what scatters is the places of the corners on the \
         board, by about {:.4} mm each, not what the cameras see of them. A better board, not more pictures, would lower the errors",
        1.0 / accuracy.rays_chi_square.sqrt(),
        sigma_px * depth_mm / calibration.rig().left.fx
    ))
}

/// The content of `camera-check.json`. Lengths held out: no pair helped to calibrate the cameras that measured it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraCheckFile {
    passed: bool,
    verdict: Verdict,
    tolerance_mm: f64,
    max_abs_error_mm: f64,
    expanded_uncertainty_mm: f64,
    /// Its standard deviations through the corners, the calibration, and the board's certificate, mm.
    uncertainty_shares_mm: [f64; 3],
    reprojection_rms_px: f64,
    baseline_mm: f64,
    lens: String,
    /// Height of the board's middle above its edges along x and y, mm; zero where it was taken as flat.
    board_bow_mm: [f64; 2],
    pairs_used: usize,
    pairs_skipped: Vec<Skipped>,
    folds: usize,
    corners_used: usize,
    corners_rejected: usize,
    corner_sigma_px: f64,
    /// Mean of what both rays of a corner leave of it, one where its pictures scatter independently.
    rays_chi_square: f64,
    reduced_chi_square: Option<f64>,
    ranges: Vec<Range>,
    pairs: Vec<PairRecord>,
    second_board: Option<SecondBoard>,
    lens_scores: Vec<LensScore>,
    disagreements: Vec<Disagreement>,
    neighbour_correlation: NeighbourCorrelation,
    warnings: Vec<String>,
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
    pub fn new(calibration: &Calibration, judged: &Judged) -> CameraCheckFile {
        let accuracy = &judged.accuracy;
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
            passed: judged.verdict == Verdict::Pass,
            verdict: judged.verdict,
            tolerance_mm: judged.tolerance_mm,
            max_abs_error_mm: accuracy.worst.error_mm,
            expanded_uncertainty_mm: accuracy.worst.expanded_uncertainty_mm(),
            uncertainty_shares_mm: [accuracy.worst.corners_mm, accuracy.worst.calibration_mm, accuracy.worst.board_mm],
            reprojection_rms_px: calibration.rms_px,
            baseline_mm: calibration.rig().baseline_mm(),
            lens: calibration.rig().left.lens.name().to_owned(),
            board_bow_mm: calibration.values.shared.shape_mm,
            pairs_used: calibration.views.len(),
            pairs_skipped: calibration.skipped.clone(),
            folds: accuracy.folds,
            corners_used: all().filter(|o| o.active).count(),
            corners_rejected: all().filter(|o| !o.active).count(),
            rays_chi_square: accuracy.rays_chi_square,
            corner_sigma_px: calibration.noise.typical_px(&calibration.views),
            reduced_chi_square: calibration.noise.reduced_chi_square,
            ranges: accuracy.ranges.clone(),
            pairs,
            second_board: judged.second.clone(),
            lens_scores: calibration.lens_scores.clone(),
            disagreements: judged.disagreements.clone(),
            neighbour_correlation: judged.whiteness.neighbours,
            warnings: judged.advice.iter().chain(&judged.warnings).cloned().collect(),
        }
    }
}
