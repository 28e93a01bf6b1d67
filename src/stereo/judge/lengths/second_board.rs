//! A second board, measured by the rig as it is.
//!
//! In: a calibration and the corners of a board that helped to calibrate nothing. Out: the errors of all its lengths
//! that can be triangulated, and its scale. No pose is fitted and no miss is forgiven: a board that fits nothing is
//! wrong, or the rig has moved.

use serde::Serialize;

use crate::imaging::{Corners, Skipped};
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::residuals::mean;
use crate::stereo::judge::doubtful_corners::{self, DoubtfulCorners};
use crate::stereo::judge::lengths::{self, Range, all_ranges, measure};
use crate::stereo::judge::verdict::{Expansion, Extremes};
use crate::stereo::model::Shared;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::pairs::numbering;
use crate::stereo::triangulate::RigCovariance;

/// A second board, measured by the rig as it is: it helped to calibrate nothing, so that its pitch shows the scale.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SecondBoard {
    /// Pairs that were measured.
    pub pairs: usize,
    pub pairs_skipped: Vec<Skipped>,
    /// The length errors that decide; `None` where no length could be measured.
    #[serde(skip)]
    pub extremes: Option<Extremes>,
    #[serde(skip)]
    pub doubtful: DoubtfulCorners,
    pub max_abs_error_mm: Option<f64>,
    /// Measured lengths over nominal ones, minus one; both boards' pitch errors and the rig's scale together.
    pub scale_error: Option<f64>,
    /// Its standard deviation over the pairs.
    pub scale_error_sigma: Option<f64>,
    /// Every range, x first, from the shortest.
    pub ranges: Vec<Range>,
}

/// Measures a second board. `board_mm` is the expanded uncertainty of each board's lengths; the rig has its scale from
/// the first, so that both count.
pub fn second_board(calibration: &Calibration, corners: &Corners, board_mm: Option<f64>) -> SecondBoard {
    let (rig, board) = (calibration.rig(), &corners.board);
    let shared = Shared { rig: rig.clone(), shape_mm: FLAT };
    let mut skipped = corners.skipped.clone();
    let (mut measured, mut names) = (Vec::new(), Vec::new());
    for pair in &corners.pairs {
        // Lengths have no part in how it is numbered.
        let lengths = measure(rig, board, &numbering::seen_on_rig(&shared, board, pair, Some(&calibration.noise)));
        if lengths.lengths.is_empty() {
            let reason =
                "no length of the second board can be measured in it: no two corners are seen in both pictures";
            skipped.push(Skipped { pair: pair.pair.clone(), reason: reason.to_owned() });
        } else {
            measured.push(lengths);
            names.push(pair.pair.as_str());
        }
    }
    let doubtful = doubtful_corners::leave_out(&mut measured, &names, calibration.noise.typical_px(&calibration.views));
    measured.retain(|m| !m.lengths.is_empty());
    let both_boards = board_mm.map(|mm| mm * std::f64::consts::SQRT_2);
    let expansion = Expansion::new(calibration.pair_scatter.groups, both_boards);
    let covariance = rig.covariance.as_ref().map(RigCovariance::new);
    let extremes = lengths::extremes(&measured, |_| covariance.as_ref(), expansion, 1.0);
    let scales: Vec<f64> = measured.iter().map(|m| m.scale_error(board)).collect();
    let scale_error = mean(scales.iter().copied());
    let scale_error_sigma = scale_error.map(|mean| {
        let spread: f64 = scales.iter().map(|s| (s - mean) * (s - mean)).sum();
        let n = scales.len() as f64;
        (spread / (n - 1.0).max(1.0) / n).sqrt()
    });
    SecondBoard {
        pairs: measured.len(),
        pairs_skipped: skipped,
        max_abs_error_mm: extremes.map(|e| e.max_abs_error_mm),
        extremes,
        doubtful,
        scale_error,
        scale_error_sigma,
        ranges: all_ranges(board, &measured),
    }
}
