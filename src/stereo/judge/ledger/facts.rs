//! What the lines of the ledger are made of.

use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::Finding;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::lengths::held_out::Accuracy;
use crate::stereo::judge::lengths::model_disagreement::Disagreement;
use crate::stereo::judge::lengths::second_board::SecondBoard;
use crate::stereo::judge::moves::KnownMoves;
use crate::stereo::judge::residual_correlation::ResidualPattern;
use crate::stereo::judge::verdict::{COVERAGE, Expansion, Verdict};
use crate::stereo::judge::view_coverage::Coverage;
use crate::stereo::volume::lengths::{VolumeLength, VolumeLengths};

/// All that was asked of a calibration.
pub struct Facts<'a> {
    pub calibration: &'a Calibration,
    /// Held-out lengths.
    pub accuracy: &'a Accuracy,
    /// A second board, where one was asked for.
    pub second: Option<&'a SecondBoard>,
    /// Slides of known lengths.
    pub moves: &'a KnownMoves,
    /// Lengths through the volume that the verdict is for.
    pub volume: &'a VolumeLengths,
    /// What happened to the rig while it was photographed.
    pub findings: &'a [Finding],
    /// Whether the residuals are noise.
    pub residual_pattern: &'a ResidualPattern,
    /// Models that measure other lengths.
    pub disagreements: &'a [Disagreement],
    /// How the views are spread.
    pub coverage: &'a Coverage,
    /// The largest error that passes, mm.
    pub tolerance_mm: f64,
    /// How uncertainties are expanded.
    pub expansion: Expansion,
}

impl Evidence {
    /// A length that is held against the tolerance, mm; without one nothing can be said.
    pub(super) fn of_length(
        what: &'static str,
        remedy: &'static str,
        value_mm: Option<f64>,
        facts: &Facts,
        detail: String,
    ) -> Evidence {
        let allows = Verdict::within(value_mm.unwrap_or(f64::NAN), facts.tolerance_mm);
        Evidence { what, remedy, value: value_mm, limit: Some(facts.tolerance_mm), unit: "mm", allows, detail }
    }
}

impl Facts<'_> {
    /// Expanded uncertainty of a length, the board's certificate left out, mm.
    pub(super) fn expanded_mm(&self, length: &VolumeLength) -> f64 {
        (COVERAGE * length.corners_mm).hypot(self.expansion.calibration * length.calibration_mm)
    }
}
