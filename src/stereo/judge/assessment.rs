//! All that was asked of a calibration: held-out lengths, a second board, residuals, models, coverage, and the verdict.

use crate::diagnostic::Warning;
use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::Finding;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::ledger::{Case, Facts, KNOWN_MOVE, LensPairs, Standards, TOLERANCE, ledger};
use crate::stereo::judge::lengths::held_out::Accuracy;
use crate::stereo::judge::lengths::model_disagreement;
use crate::stereo::judge::residual_correlation;
use crate::stereo::judge::verdict::{Expansion, Verdict};
use crate::stereo::judge::view_coverage::Coverage;
use crate::stereo::pairs::Cause;
use crate::stereo::solve::priors::BOW_SHARE;
use crate::stereo::volume::Extent;
use crate::stereo::volume::lengths::VolumeLengths;

/// Lengths that may be off by such a share of themselves are not measured.
pub const NO_USE: f64 = 0.1;

/// A calibration with everything that was asked of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// What was asked of it.
    pub facts: Facts,
    /// Pass, fail or undecided: the worst line of the evidence.
    pub verdict: Verdict,
    /// Every fact with its limit; the held-out lengths first.
    pub evidence: Vec<Evidence>,
    /// Where the board's print scatters by so much that pictures do not help.
    pub print_scatter: Option<Warning>,
    /// What to photograph next, where the views are too few or too much alike.
    pub advice: Vec<String>,
    /// What else a person should know.
    pub warnings: Vec<Warning>,
}

/// What lengths are judged by.
#[derive(Debug, Clone, PartialEq)]
pub struct Demand {
    /// The largest error that passes, mm.
    pub tolerance_mm: f64,
    /// Expanded uncertainty (k = 2) of the boards' own lengths, as certified, mm.
    pub board_uncertainty_mm: Option<f64>,
    /// The volume that the verdict is for.
    pub extent: Extent,
    /// The pairs from which the lenses were known beforehand.
    pub lens_pairs: LensPairs,
    /// That nobody said how large the board is, where it is so.
    pub size_assumed: Option<String>,
}

impl Judged {
    pub fn new(
        calibration: &Calibration,
        findings: Vec<Finding>,
        accuracy: Accuracy,
        standards: Standards,
        demand: &Demand,
    ) -> Judged {
        let residual_pattern = residual_correlation::check(calibration);
        let share = accuracy.disagreement_share();
        let volume = VolumeLengths::new(calibration, demand.extent, accuracy.long_mm[0], share);
        let facts = Facts {
            tolerance_mm: demand.tolerance_mm,
            lens_pairs: demand.lens_pairs,
            expansion: Expansion::new(calibration.pair_scatter.groups, demand.board_uncertainty_mm),
            disagreements: model_disagreement::find(calibration, &volume),
            coverage: Coverage::of(calibration, &residual_pattern),
            accuracy,
            standards,
            residual_pattern,
            volume,
            findings,
        };
        let evidence = ledger(&Case { calibration, facts: &facts });
        let unusual = calibration.rig().unusual();
        let mut warnings: Vec<Warning> =
            demand.size_assumed.iter().cloned().chain(unusual).map(Warning::from).collect();
        // The held-out lengths are the result itself and stand in its first line.
        let doubts = evidence.iter().skip(1).filter(|line| line.allows != Verdict::Pass);
        warnings.extend(doubts.map(Evidence::warning));
        // A board that was said wrongly is no board that scatters.
        let other_board = facts.findings.iter().any(|finding| finding.cause == Cause::OtherBoard.word());
        let print_scatter = if other_board { None } else { print_scatter(calibration, &facts) };
        warnings.extend(print_scatter.clone());
        let verdict = evidence.iter().fold(Verdict::Pass, |verdict, line| verdict.and(line.allows));
        let advice = match verdict {
            Verdict::Pass => facts.coverage.advice(),
            _ => bent(calibration).into_iter().chain(facts.coverage.advice()).collect(),
        };
        Judged { facts, verdict, evidence, print_scatter, advice, warnings }
    }

    /// What known moves say of the scale, where they contradict it and nothing else shows the rig itself to be wrong.
    pub fn of_scale(&self) -> Option<Finding> {
        let rig_fails = self.evidence.iter().any(|line| line.allows == Verdict::Fail && line.what != KNOWN_MOVE);
        self.facts.standards.moves.finding(self.facts.volume.length_mm).filter(|_| !rig_fails)
    }

    /// The line of the ledger that decides: the worst, and of several that are equally bad the one farthest beyond its
    /// limit.
    pub fn deciding(&self) -> Option<&Evidence> {
        let beyond = |line: &Evidence| line.value.zip(line.limit).map_or(f64::INFINITY, |(value, limit)| value / limit);
        let worst = self.evidence.iter().filter(|line| line.allows == self.verdict);
        match self.verdict {
            // Nothing speaks against it: the largest length decides.
            Verdict::Pass => self.trusted().or(self.evidence.first()),
            _ => worst.max_by(|a, b| beyond(a).total_cmp(&beyond(b))),
        }
    }

    /// The tolerance that this rig would meet as far as lengths go, mm; `None` where something else than a length
    /// stands against it.
    pub fn trusted_mm(&self) -> Option<f64> {
        self.trusted().and_then(|line| line.value)
    }

    /// Whether lengths may be off by such a share of themselves that the rig measures nothing.
    pub fn measures_nothing(&self) -> bool {
        self.trusted_mm().is_some_and(|mm| mm > NO_USE * self.facts.volume.length_mm)
    }

    /// The line of the ledger that sets that tolerance.
    pub fn trusted(&self) -> Option<&Evidence> {
        let (lengths, others): (Vec<&Evidence>, Vec<&Evidence>) =
            self.evidence.iter().filter(|line| line.limit.is_some()).partition(|line| line.unit == "mm");
        let known = |line: &&Evidence| line.value.is_some_and(|mm| mm.is_finite());
        let is_of_lengths = |line: &Evidence| line.unit != "px" && line.what != TOLERANCE;
        let free = others.iter().all(|line| line.allows == Verdict::Pass || !is_of_lengths(line));
        let of = |line: &Evidence| line.value.unwrap_or_default();
        // Of equals the first, which is that of the held-out lengths.
        let largest = |a, b| if of(b) > of(a) { b } else { a };
        if free && lengths.iter().all(known) { lengths.into_iter().reduce(largest) } else { None }
    }
}

/// Asks for another board where this one is bent by more than boards are: what a bow leaves beside the paraboloid that
/// is fitted is in all lengths.
fn bent(calibration: &Calibration) -> Option<String> {
    let [along_x, along_y, twist] = calibration.values.shared.shape_mm.map(f64::abs);
    let most = BOW_SHARE * calibration.board.diagonal_mm();
    (calibration.layout.shape && along_x.max(along_y).max(twist) > most).then(|| {
        format!(
            "the board is bowed by {along_x:.2} mm along x and {along_y:.2} mm along y, and twisted by {twist:.2} mm: glue it to a flat plate (glass, \
             aluminium), and photograph again"
        )
    })
}

/// Says where it is the board that scatters and not the corners, by enough to matter: both pictures then see the same
/// deviations.
fn print_scatter(calibration: &Calibration, facts: &Facts) -> Option<Warning> {
    /// Of independent corners the mean of thousands of points lies within a tenth of one.
    const SHARED: f64 = 0.25;
    /// At both ends, at 95 %, a place that scatters by this share of the tolerance takes a twelfth of it.
    const MATTERS: f64 = 0.03;
    if facts.accuracy.rays_chi_square > SHARED {
        return None;
    }
    let depths = calibration.values.poses.iter().map(|pose| pose.translation.vector.z);
    let depth_mm = depths.sum::<f64>() / calibration.values.poses.len().max(1) as f64;
    let sigma_px = calibration.noise.typical_px(&calibration.views);
    let place_mm = sigma_px * depth_mm / calibration.rig().left.fx;
    (place_mm > MATTERS * facts.tolerance_mm).then(|| Warning {
        text: format!(
            "the corners' places on the board scatter by about {place_mm:.4} mm each: a better board would lower the \
             errors"
        ),
        reason: format!(
            "left and right picture agree on the corners {:.0} times better than the residuals suggest, so that the error is the board's, not the cameras'",
            1.0 / facts.accuracy.rays_chi_square.sqrt()
        ),
    })
}
