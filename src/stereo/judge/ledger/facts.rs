//! What the lines of the ledger are made of.

use std::borrow::Cow;

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
#[derive(Debug, Clone, PartialEq)]
pub struct Facts {
    /// The largest error that passes, mm.
    pub tolerance_mm: f64,
    /// The pairs from which the lenses were known beforehand.
    pub lens_pairs: LensPairs,
    pub expansion: Expansion,
    pub accuracy: Accuracy,
    /// What checks the scale.
    pub standards: Standards,
    /// Whether the residuals are noise.
    pub residual_pattern: ResidualPattern,
    /// Lens models that disagree.
    pub disagreements: Vec<Disagreement>,
    /// Lengths of the long range over the volume that the verdict is for.
    pub volume: VolumeLengths,
    /// What happened to the rig while it was photographed.
    pub findings: Vec<Finding>,
    pub coverage: Coverage,
}

/// Pairs that are among those from which the lenses were known beforehand: what they tell counts twice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LensPairs {
    /// How many are.
    pub same: usize,
    /// Of how many the lenses are known.
    pub of: usize,
}

impl LensPairs {
    /// Whether so many count twice that the uncertainty is too small by a good part.
    pub fn are_many(&self) -> bool {
        self.same > 0 && 2 * self.same >= self.of
    }

    /// For a person.
    pub fn statement(&self) -> Option<String> {
        let LensPairs { same, of } = self;
        let by = if self.are_many() { "" } else { "a little " };
        (*same > 0).then(|| {
            format!("the lenses were calibrated from {same} of these pairs (of {of}), which count twice: the uncertainty that is stated is {by}too small")
        })
    }
}

/// Lengths that are known by something else than the board that calibrated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Standards {
    pub second: Option<SecondBoard>,
    /// Slides of known lengths.
    pub moves: KnownMoves,
}

pub struct Case<'a> {
    pub calibration: &'a Calibration,
    pub facts: &'a Facts,
}

impl Evidence {
    /// A length that is held against the tolerance, mm; without one nothing can be said.
    pub(super) fn of_length(
        what: &'static str,
        remedy: impl Into<Cow<'static, str>>,
        value_mm: Option<f64>,
        case: &Case,
        detail: String,
    ) -> Evidence {
        let allows = Verdict::within(value_mm.unwrap_or(f64::NAN), case.facts.tolerance_mm);
        Evidence {
            what,
            remedy: remedy.into(),
            value: value_mm,
            limit: Some(case.facts.tolerance_mm),
            unit: "mm",
            allows,
            detail,
        }
    }

    /// A figure beside its limit, which casts doubt on a rig where it is not kept.
    pub(super) fn of_doubt(
        what: &'static str,
        remedy: impl Into<Cow<'static, str>>,
        [value, limit]: [f64; 2],
        unit: &'static str,
        is_kept: bool,
        detail: String,
    ) -> Evidence {
        let allows = if is_kept { Verdict::Pass } else { Verdict::Undecided };
        Evidence { what, remedy: remedy.into(), value: Some(value), limit: Some(limit), unit, allows, detail }
    }
}

impl Case<'_> {
    /// Expanded uncertainty of a length, the board's certificate left out, mm.
    pub(super) fn expanded_mm(&self, length: &VolumeLength) -> f64 {
        (COVERAGE * length.corners_mm).hypot(self.facts.expansion.calibration * length.calibration_mm)
    }
}
