//! Pass, fail or undecided: the largest length errors and their uncertainty against the tolerance (ISO 14253-1).

use serde::{Deserialize, Serialize};

/// Coverage factor of the expanded uncertainty: 95 %.
pub const COVERAGE: f64 = 2.0;

/// The corners' scatter moves the worst of a million lengths by as many of its standard deviations.
const LARGEST_OF_MANY: f64 = 5.0;

/// What the verdict is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Within tolerance, uncertainty included.
    Pass,
    /// The uncertainty reaches across the tolerance.
    Undecided,
    /// Out of tolerance, whatever the uncertainty.
    Fail,
}

impl Verdict {
    /// Of two verdicts on one rig the worse one: a pass needs both.
    pub fn and(self, other: Verdict) -> Verdict {
        self.max(other)
    }

    /// A pass where the value is within the limit (a value that is no number is not), undecided otherwise: for what
    /// casts doubt on a rig without showing an error.
    pub fn within(value: f64, limit: f64) -> Verdict {
        if value <= limit { Verdict::Pass } else { Verdict::Undecided }
    }
}

/// By what an uncertainty is expanded, and what a certificate says of the board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expansion {
    /// Coverage factor of what the calibration makes uncertain: as many standard deviations as hold 95 % where they are
    /// known from so many pairs.
    pub calibration: f64,
    /// Expanded uncertainty of the board's own lengths, mm; `None` where nothing is known of it.
    pub board_mm: Option<f64>,
}

impl Expansion {
    /// For a calibration that rests on so many groups of pairs with poses of their own.
    pub fn new(groups: usize, board_mm: Option<f64>) -> Expansion {
        let freedom = groups.saturating_sub(1).max(1) as f64;
        Expansion { calibration: COVERAGE * student_95(freedom) / NORMAL_95, board_mm }
    }
}

/// 97.5 % quantile of the normal distribution.
const NORMAL_95: f64 = 1.959_964;

/// 97.5 % quantile of Student's distribution (the expansion of Fisher and Cornish, to the third power of the inverse
/// freedom: right to one per cent from three degrees of freedom).
fn student_95(freedom: f64) -> f64 {
    let z = NORMAL_95;
    let power = |n: i32| z.powi(n);
    let first = (power(3) + z) / 4.0;
    let second = (5.0 * power(5) + 16.0 * power(3) + 3.0 * z) / 96.0;
    let third = (3.0 * power(7) + 19.0 * power(5) + 17.0 * power(3) - 15.0 * z) / 384.0;
    z + first / freedom + second / freedom.powi(2) + third / freedom.powi(3)
}

/// A length error and what makes it uncertain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LengthError {
    /// Place of its pair among those that were measured.
    pub pair: usize,
    /// Its absolute error, mm.
    pub error_mm: f64,
    /// Standard deviation through the corners at both its ends, mm.
    pub corners_mm: f64,
    /// Through the calibration that both ends share, mm.
    pub calibration_mm: f64,
    pub expansion: Expansion,
}

impl LengthError {
    /// Expanded uncertainty (95 %) of the error, mm.
    pub fn expanded_uncertainty_mm(&self) -> f64 {
        self.expanded_without_corners_mm().hypot(COVERAGE * self.corners_mm)
    }

    /// The calibration's share, expanded, mm.
    pub fn expanded_calibration_mm(&self) -> f64 {
        self.expansion.calibration * self.calibration_mm
    }

    /// The share that is not the corners': calibration and board, expanded, mm.
    pub fn expanded_without_corners_mm(&self) -> f64 {
        self.expanded_calibration_mm().hypot(self.expansion.board_mm.unwrap_or(0.0))
    }

    /// The error may be as large as this, mm. What the corners at its ends scatter by is in the error already.
    pub fn at_most_mm(&self) -> f64 {
        self.error_mm + self.expanded_without_corners_mm()
    }

    /// The error that is not the corners' scatter is at least as large as this, mm, for whichever of very many lengths
    /// is looked at.
    pub fn at_least_mm(&self) -> f64 {
        self.error_mm - self.expanded_without_corners_mm().hypot(LARGEST_OF_MANY * self.corners_mm)
    }
}

/// The length errors that decide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    pub max_abs_error_mm: f64,
    /// The length whose error may be largest.
    pub largest: LengthError,
    /// The length whose error surely is largest.
    pub surest: LengthError,
    /// The error that one length in twenty exceeds, mm.
    pub one_in_twenty_mm: f64,
}

impl Extremes {
    /// Of two sets of lengths together; the larger of what one in twenty exceeds.
    pub fn and(self, other: Extremes) -> Extremes {
        let larger = |a: LengthError, b: LengthError, of: fn(&LengthError) -> f64| if of(&b) > of(&a) { b } else { a };
        Extremes {
            max_abs_error_mm: self.max_abs_error_mm.max(other.max_abs_error_mm),
            largest: larger(self.largest, other.largest, LengthError::at_most_mm),
            surest: larger(self.surest, other.surest, LengthError::at_least_mm),
            one_in_twenty_mm: self.one_in_twenty_mm.max(other.one_in_twenty_mm),
        }
    }

    /// Pass only where every error with its own uncertainty fits into the tolerance. Fail where one exceeds it by more
    /// than its ends scatter and the calibration and the board are uncertain, or where one length in twenty does: then
    /// the scatter itself is too large. A few lengths that corner noise carries across are no error of the rig.
    pub fn verdict(&self, tolerance_mm: f64) -> Verdict {
        if self.largest.at_most_mm() <= tolerance_mm {
            Verdict::Pass
        } else if self.surest.at_least_mm() > tolerance_mm
            || self.one_in_twenty_mm - self.surest.expanded_without_corners_mm() > tolerance_mm
        {
            Verdict::Fail
        } else {
            Verdict::Undecided
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_pairs_widen_the_interval_as_student_says() {
        // Tables: 3.182 at three degrees of freedom, 2.262 at nine, 2.093 at nineteen.
        for (groups, table) in [(4, 3.182), (10, 2.262), (20, 2.093)] {
            let factor = Expansion::new(groups, None).calibration * NORMAL_95 / COVERAGE;
            assert!((factor - table).abs() < 0.03, "{groups} groups: {factor}, table {table}");
        }
    }

    #[test]
    fn a_value_that_is_no_number_never_passes() {
        assert_eq!(Verdict::within(f64::NAN, 1.0), Verdict::Undecided);
        let error = |error_mm| LengthError {
            pair: 0,
            error_mm,
            corners_mm: 0.0,
            calibration_mm: 0.0,
            expansion: Expansion::new(9, None),
        };
        let extremes = |e| Extremes { max_abs_error_mm: e, largest: error(e), surest: error(e), one_in_twenty_mm: 0.0 };
        assert_eq!(extremes(f64::NAN).verdict(1.0), Verdict::Undecided);
        assert_eq!(extremes(0.5).verdict(1.0), Verdict::Pass);
        assert_eq!(extremes(1.5).verdict(1.0), Verdict::Fail);
    }
}
