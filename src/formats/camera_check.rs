//! `camera-check.json`: the verdict and the figures it stands on, as a file.

use serde::Serialize;

use crate::diagnostic::Warning;
use crate::imaging::Skipped;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::neighbour_correlation::NeighbourCorrelation;
use crate::stereo::findings::{self, Finding};
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::lengths::Range;
use crate::stereo::judge::lengths::held_out::{EpipolarError, HeldOutPair};
use crate::stereo::judge::lengths::model_disagreement::Disagreement;
use crate::stereo::judge::lengths::second_board::SecondBoard;
use crate::stereo::judge::moves::KnownMove;
use crate::stereo::judge::verdict::{COVERAGE, Verdict};
use crate::stereo::select::model_comparison::LensScore;
use crate::stereo::select::pair_scatter::PairScatter;
use crate::stereo::volume::Volume;

/// The content of `camera-check.json`. Lengths held out: no pair helped to calibrate the cameras that measured it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraCheckFile {
    passed: bool,
    verdict: Verdict,
    tolerance_mm: f64,
    evidence: Vec<Evidence>,
    /// The tolerance that the rig would meet, mm; null where something else than a length stands against it.
    trusted_mm: Option<f64>,
    /// Up to which length, mm.
    trusted_length_mm: f64,
    max_abs_error_mm: f64,
    /// Nineteen of twenty held-out lengths are off by no more, mm.
    within_95_mm: f64,
    /// What the verdict is for.
    volume: Volume,
    /// The pairs at the moment for which the rig and its covariance are.
    moment: [String; 2],
    /// What happened over the pairs, and to pairs that are not used.
    findings: Vec<Finding>,
    /// The length that the verdict on held-out lengths looks at.
    judged_length: JudgedLength,
    /// Expanded uncertainty (95 %) of that length's error with the scatter of the corners at its ends, mm.
    expanded_uncertainty_mm: f64,
    /// Its standard deviations through the corners, the calibration, and the board's certificate, mm; null without a certificate.
    uncertainty_shares_mm: [Option<f64>; 3],
    reprojection_rms_px: f64,
    epipolar: EpipolarError,
    baseline_mm: f64,
    lens: String,
    /// Height of the board's middle above its edges along x and y, mm; zero where it was taken as flat.
    board_bow_mm: [f64; 2],
    /// Height to which a twist lifts the board's first and last corner and lowers the others, mm.
    board_twist_mm: f64,
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
    /// `x10` and `x70` stand for one square and seven, or as many as the board has.
    pairs: Vec<HeldOutPair>,
    second_board: Option<SecondBoard>,
    known_moves: Vec<KnownMove>,
    lens_scores: Vec<LensScore>,
    disagreements: Vec<Disagreement>,
    neighbour_correlation: NeighbourCorrelation,
    pair_scatter: PairScatter,
    warnings: Vec<String>,
}

/// Of the length whose error and uncertainty together are largest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
struct JudgedLength {
    error_mm: f64,
    /// Expanded uncertainty (95 %) through calibration and board: what the corners scatter by is in the error already, mm.
    uncertainty_mm: f64,
    /// Their sum, which is compared with the tolerance, mm.
    at_most_mm: f64,
}

impl CameraCheckFile {
    pub fn new(calibration: &Calibration, judged: &Judged) -> CameraCheckFile {
        let accuracy = &judged.facts.accuracy;
        let worst = &accuracy.extremes.largest;
        let lenses = findings::of_lenses(calibration, &judged.facts.volume);
        let found = judged.facts.findings.iter().cloned().chain(lenses).chain(judged.of_scale());
        let all = || calibration.views.iter().flat_map(|view| &view.observations);
        CameraCheckFile {
            passed: judged.verdict == Verdict::Pass,
            verdict: judged.verdict,
            tolerance_mm: judged.facts.tolerance_mm,
            evidence: judged.evidence.clone(),
            trusted_mm: judged.trusted_mm(),
            trusted_length_mm: judged.facts.volume.length_mm,
            max_abs_error_mm: accuracy.extremes.max_abs_error_mm,
            within_95_mm: accuracy.extremes.one_in_twenty_mm,
            volume: judged.facts.volume.volume.clone(),
            moment: calibration.moment(),
            findings: found.chain(findings::of_pairs(&calibration.discarded.pairs)).collect(),
            judged_length: JudgedLength {
                error_mm: worst.error_mm,
                uncertainty_mm: worst.expanded_without_corners_mm(),
                at_most_mm: worst.at_most_mm(),
            },
            expanded_uncertainty_mm: worst.expanded_uncertainty_mm(),
            uncertainty_shares_mm: [
                Some(worst.corners_mm),
                Some(worst.calibration_mm),
                worst.expansion.board_mm.map(|mm| mm / COVERAGE),
            ],
            reprojection_rms_px: calibration.rms_px,
            epipolar: accuracy.epipolar,
            baseline_mm: calibration.rig().baseline_mm(),
            lens: calibration.rig().left.lens.name().to_owned(),
            board_bow_mm: [calibration.values.shared.shape_mm[0], calibration.values.shared.shape_mm[1]],
            board_twist_mm: calibration.values.shared.shape_mm[2],
            pairs_used: calibration.views.len(),
            pairs_skipped: calibration.skipped.clone(),
            folds: accuracy.folds,
            corners_used: all().filter(|o| o.active).count(),
            corners_rejected: all().filter(|o| !o.active).count(),
            rays_chi_square: accuracy.rays_chi_square,
            corner_sigma_px: calibration.noise.typical_px(&calibration.views),
            reduced_chi_square: calibration.noise.reduced_chi_square,
            ranges: accuracy.ranges.clone(),
            pairs: accuracy.pairs.clone(),
            second_board: judged.facts.standards.second.clone(),
            known_moves: judged.facts.standards.moves.measured.clone(),
            lens_scores: calibration.lens_scores.clone(),
            disagreements: judged.facts.disagreements.clone(),
            neighbour_correlation: judged.facts.residual_pattern.neighbours,
            pair_scatter: calibration.pair_scatter.clone(),
            warnings: judged.advice.iter().cloned().chain(judged.warnings.iter().map(Warning::whole)).collect(),
        }
    }
}
