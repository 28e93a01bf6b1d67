//! The ledger of evidence: every fact that speaks for or against a rig, its limit with the reason, and the best verdict that it allows.
//!
//! In: what was asked of a calibration. Out: one line a fact. Wherever it can be computed a fact is what it could do to a length, in mm,
//! and its limit is the tolerance. No verdict is better than its worst line.

use crate::imaging::Side;
use crate::statistics::median;
use crate::stereo::calibrate::Calibration;
use crate::stereo::findings::Finding;
use crate::stereo::findings::standing::MATERIAL_SHARE;
use crate::stereo::judge::doubtful_corners::CONTRADICTED;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::lengths::held_out::Accuracy;
use crate::stereo::judge::lengths::model_disagreement::{self, Disagreement};
use crate::stereo::judge::lengths::second_board::SecondBoard;
use crate::stereo::judge::residual_correlation::ResidualPattern;
use crate::stereo::judge::verdict::{COVERAGE, Expansion, Verdict};
use crate::stereo::judge::view_coverage::Coverage;
use crate::stereo::volume::lengths::{VolumeLength, VolumeLengths};

/// All that was asked of a calibration.
pub struct Facts<'a> {
    /// The calibration.
    pub calibration: &'a Calibration,
    /// Held-out lengths.
    pub accuracy: &'a Accuracy,
    /// A second board, where one was asked for.
    pub second: Option<&'a SecondBoard>,
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

/// The ledger.
pub fn ledger(facts: &Facts) -> Vec<Evidence> {
    let mut lines = vec![
        held_out_lengths(facts),
        any_length(facts),
        models(facts),
        residuals(facts),
        pair_scatter(facts),
        folds(facts),
        rays(facts),
        epipolar(facts),
        pairs_discarded(facts),
        findings(facts),
        standing(facts),
        poses(facts),
        tilts(facts),
    ];
    lines.extend(reach(facts));
    lines.extend(known_lenses(facts));
    lines.push(second_board(facts));
    lines
}

impl Evidence {
    /// A length that is held against the tolerance, mm; without one nothing can be said.
    fn of_length(
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

fn held_out_lengths(facts: &Facts) -> Evidence {
    let extremes = &facts.accuracy.extremes;
    let worst = &extremes.largest;
    let doubtful = &facts.accuracy.doubtful;
    let left_out = if doubtful.lengths_left_out > 0 {
        format!("; {} lengths that end in doubtful corners are not counted, see rays", doubtful.lengths_left_out)
    } else {
        String::new()
    };
    Evidence {
        what: "held-out lengths",
        remedy: "look at the worst pair in camera-check.html, and at the lines below it",
        value: Some(worst.at_most_mm()),
        limit: Some(facts.tolerance_mm),
        unit: "mm",
        allows: extremes.verdict(facts.tolerance_mm),
        detail: format!(
            "largest error plus its own expanded uncertainty ({:.4} + {:.4}) over all lengths between corners of pairs that the rig had \
             not seen, {} folds; the limit is the tolerance. The largest error alone is {:.4}, one length in twenty \
             is off by more than {:.4}{left_out}",
            worst.error_mm,
            worst.expanded_uncertainty_mm(),
            facts.accuracy.folds,
            extremes.max_abs_error_mm,
            extremes.one_in_twenty_mm
        ),
    }
}

impl Facts<'_> {
    /// Expanded uncertainty of a length, the board's certificate left out, mm.
    fn expanded_mm(&self, length: &VolumeLength) -> f64 {
        (COVERAGE * length.corners_mm).hypot(self.expansion.calibration * length.calibration_mm)
    }
}

/// Steps and drifts that are in the rig.
fn findings(facts: &Facts) -> Evidence {
    let since = facts.calibration.standing.since.as_deref();
    let within = |finding: &&Finding| finding.pairs.first().map(String::as_str) != since || since.is_none();
    let left: Vec<&Finding> = facts.findings.iter().filter(within).collect();
    let value = left.iter().filter_map(|finding| finding.effect_mm).fold(0.0, f64::max);
    let detail = if left.is_empty() {
        "no change over the pairs that were used: no step, drift or change of focus beyond their scatter".to_owned()
    } else {
        let told: Vec<&str> = left.iter().map(|finding| finding.action.as_str()).collect();
        format!(
            "{}. It is included in the uncertainty of the rig; a change of a length of less than {:.0} % of the tolerance does not affect the verdict",
            told.join("; "),
            100.0 * MATERIAL_SHARE
        )
    };
    Evidence::of_length(
        "changes over the pairs",
        "clamp the cameras, switch autofocus off, and photograph again",
        Some(value),
        facts,
        detail,
    )
}

fn any_length(facts: &Facts) -> Evidence {
    let worst = facts.volume.worst(|length| facts.expanded_mm(length));
    let value = worst.map(|(mm, _)| mm);
    let detail = match worst {
        None => "the rig has no covariance over the volume in which the boards stood".to_owned(),
        Some((_, length)) => format!(
            "expanded uncertainty of a length of {:.0} mm where it is largest, {} {:.0} mm away (standard deviations: corners {:.4}, \
             calibration {:.4}, the latter times {:.2} for so few pairs; what the models leave open is in it), over the volume where the \
             boards were and in the directions that they took there{}",
            facts.volume.length_mm,
            length.lies(),
            length.at_mm.z,
            length.corners_mm,
            length.calibration_mm,
            facts.expansion.calibration,
            along_sight(facts)
        ),
    };
    Evidence::of_length(
        "any length in the volume",
        "add pairs with the board where it is least certain, and tilted",
        value,
        facts,
        detail,
    )
}

/// What lengths that no board showed would be known to.
fn along_sight(facts: &Facts) -> String {
    let worst = facts.volume.along_sight.iter().map(|length| facts.expanded_mm(length)).reduce(f64::max);
    worst.map_or(String::new(), |mm| format!(". Along the line of sight, where no board lay, it would be {mm:.4} mm"))
}

fn models(facts: &Facts) -> Evidence {
    let value = facts.disagreements.iter().map(|d| d.length_change_mm).fold(0.0, f64::max);
    let detail = model_disagreement::describe(facts.disagreements).unwrap_or_else(|| {
        "no richer lens, and no board that is not flat, has additional terms that are more than chance: no admissible model measures other lengths".to_owned()
    });
    Evidence::of_length(
        "spread of admissible models",
        "add pairs with the board at the borders of both pictures",
        Some(value),
        facts,
        detail,
    )
}

fn residuals(facts: &Facts) -> Evidence {
    let sigma_px = facts.calibration.noise.typical_px(&facts.calibration.views);
    let systematic_px = facts.residual_pattern.systematic_px(sigma_px);
    // What both pictures see alike moves no point, but the rig that is fitted to it: the corners' whole scatter counts here.
    let share = facts.accuracy.disagreement_share().sqrt();
    let corners_mm = facts.volume.worst(|length| length.corners_mm / share).map(|(mm, _)| mm);
    let value = corners_mm.map(|mm| mm * systematic_px / sigma_px);
    let neighbours = &facts.residual_pattern.neighbours;
    let detail = if systematic_px > 0.0 {
        format!(
            "the residuals are not noise: those of neighbouring corners correlate by {:.2} (chance: {:.2}), {:.3} px of pattern over \
             the pictures is common to all pairs. The lens model, the board's shape or its print lacks something; {systematic_px:.3} px \
             at both ends move a length by so much where it matters most",
            neighbours.along,
            neighbours.standard_error,
            facts.residual_pattern.pattern_px()
        )
    } else {
        format!(
            "the residuals are noise: neighbouring corners correlate by {:.3} along their edge (chance: {:.3})",
            neighbours.along, neighbours.standard_error
        )
    };
    Evidence::of_length(
        "residual correlation",
        "look at the map of residuals in camera-check.html; it takes another `--lens`, `--board-shape bowed` or a better board",
        value,
        facts,
        detail,
    )
}

fn pair_scatter(facts: &Facts) -> Evidence {
    let scatter = &facts.calibration.pair_scatter;
    let detail = match scatter.ratio {
        Some(_) => format!(
            "variance of the rig by how {} pairs with poses of their own scatter about it, over the one by the corners' noise; what \
             exceeds one is in all uncertainties here",
            scatter.groups
        ),
        None => format!(
            "one of {} pairs with poses of their own cannot be left out without losing the calibration: no other pair checks it",
            scatter.groups
        ),
    };
    Evidence {
        what: "scatter of pairs",
        remedy: "add pairs with the board elsewhere and tilted otherwise",
        value: scatter.ratio,
        limit: None,
        unit: "",
        allows: if scatter.ratio.is_some() { Verdict::Pass } else { Verdict::Undecided },
        detail,
    }
}

fn folds(facts: &Facts) -> Evidence {
    let layout = &facts.calibration.layout;
    let changes = facts.accuracy.fold_steps.iter().flat_map(|step| facts.volume.changes_by_step_mm(layout, step));
    let value = changes.fold(0.0_f64, |most, mm| most.max(mm.abs()));
    let detail = format!(
        "largest change of a length of {:.0} mm anywhere in the working volume when a block of similar pairs is left out; a rig that depends on one block has the errors of that block",
        facts.volume.length_mm
    );
    Evidence::of_length(
        "rigs without some pairs",
        "add pairs with the board elsewhere and tilted otherwise",
        Some(value),
        facts,
        detail,
    )
}

fn rays(facts: &Facts) -> Evidence {
    /// Share of corners whose rays may contradict each other: a hand or a reflection, not the rig.
    const LIMIT_PERCENT: f64 = 2.0;
    let doubtful = &facts.accuracy.doubtful;
    let value = 100.0 * doubtful.contradicted_share();
    let named = if doubtful.pairs.is_empty() { String::new() } else { format!(", in {}", doubtful.named()) };
    Evidence {
        what: "rays that contradict each other",
        remedy: "look at the corners of the named pairs for a hand, glare or shadow",
        value: Some(value),
        limit: Some(LIMIT_PERCENT),
        unit: "%",
        allows: Verdict::within(value, LIMIT_PERCENT),
        detail: format!(
            "{} of {} held-out corners have rays that miss each other by more than {CONTRADICTED} standard deviations and {} were \
             measured far worse than usual{named}; a few are a hand or a reflection, more are an error of the rig",
            doubtful.contradicted, doubtful.corners, doubtful.unsure
        ),
    }
}

fn epipolar(facts: &Facts) -> Evidence {
    let error = &facts.accuracy.epipolar;
    let sigma_px = facts.calibration.noise.typical_px(&facts.calibration.views);
    let sigma_px = sigma_px * facts.accuracy.disagreement_share().sqrt();
    // A miss as large along the epipolar line is depth, and moves lengths as corners do.
    let px_per_mm = median(facts.volume.lengths.iter().map(|length| sigma_px / length.corners_mm));
    let limit = px_per_mm.map(|px| px * facts.tolerance_mm);
    Evidence {
        what: "epipolar error",
        remedy: "look at the worst pair in camera-check.html",
        value: Some(error.rms_px),
        limit,
        unit: "px",
        allows: Verdict::within(error.rms_px, limit.unwrap_or(f64::NAN)),
        detail: format!(
            "root mean square distance of held-out corners from the epipolar lines of their partners (largest {:.3} px); as much along \
             the line is depth and moves a length by the tolerance at the limit",
            error.max_px
        ),
    }
}

/// Pairs with a board that do not fit the rig now standing: not those without a board, shown twice, or of a rig that stood before.
fn contradicting<'a>(facts: &'a Facts) -> Vec<&'a str> {
    let all = facts.calibration.discarded.pairs.iter();
    all.filter(|p| p.cause.contradicts()).map(|p| p.pair.as_str()).collect()
}

fn pairs_discarded(facts: &Facts) -> Evidence {
    /// Up to a third single pairs are wrong; beyond it what was kept may be the wrong choice.
    const LIMIT_PERCENT: f64 = 34.0;
    let contradicting = contradicting(facts);
    let judged = facts.calibration.views.len() + contradicting.len();
    let value = 100.0 * contradicting.len() as f64 / judged.max(1) as f64;
    let named: Vec<&str> = contradicting.iter().take(5).copied().collect();
    let named = if named.is_empty() { String::new() } else { format!(" ({})", named.join(", ")) };
    Evidence {
        what: "pairs discarded",
        remedy: "see why each is not used, and take those again",
        value: Some(value),
        limit: Some(LIMIT_PERCENT),
        unit: "%",
        allows: Verdict::within(value, LIMIT_PERCENT),
        detail: format!(
            "{} of {judged} pairs with corners do not fit the common rig{named}; beyond the limit the rig may have changed",
            contradicting.len()
        ),
    }
}

/// Whether the rig that was calibrated is the one that stands now.
fn standing(facts: &Facts) -> Evidence {
    let standing = &facts.calibration.standing;
    let after = &standing.unconfirmed;
    let before = match &standing.since {
        Some(since) => format!(
            "the rig changed while it was photographed: {} pairs are of the one before, all that is said here is of the one that stands \
             since {since}",
            standing.pairs_before
        ),
        None => "all pairs that were used are of one rig".to_owned(),
    };
    let detail = if after.is_empty() {
        format!("{before}, and the last pair is one of them")
    } else {
        format!(
            "{before}; {} came after them and contradict it: whether the rig is still the same is unknown. Add pairs",
            after.join(", ")
        )
    };
    Evidence {
        what: "last pairs that contradict the rig",
        remedy: "add pairs of the rig as it stands",
        value: Some(after.len() as f64),
        limit: Some(0.0),
        unit: "",
        allows: if after.is_empty() { Verdict::Pass } else { Verdict::Undecided },
        detail,
    }
}

fn poses(facts: &Facts) -> Evidence {
    /// With fewer, leaving out one loses a fifth or more of all that is known, and one wrong pair cannot be told from the others.
    const FEWEST: f64 = 6.0;
    /// Where the lenses are known, only where the cameras stand is left to be found.
    const FEWEST_OF_KNOWN: f64 = 3.0;
    let fewest = if facts.calibration.lenses_are_known() { FEWEST_OF_KNOWN } else { FEWEST };
    let groups = facts.calibration.pair_scatter.groups as f64;
    Evidence {
        what: "pairs with poses of their own",
        remedy: "add pairs with the board elsewhere and tilted otherwise",
        value: Some(groups),
        limit: Some(fewest),
        unit: "",
        allows: if groups >= fewest { Verdict::Pass } else { Verdict::Undecided },
        detail: format!(
            "{} pairs were used. Few pairs cannot show one that is wrong by a little, a rig that drifts, or a lens that differs at the \
             border: with fewer than {fewest:.0} different poses each held-out pair is judged by too few others",
            facts.coverage.pairs
        ),
    }
}

fn tilts(facts: &Facts) -> Evidence {
    /// Below, perspective hardly tells the focal length from the distance, and the lens model decides instead of the data.
    const LEAST_DEG: f64 = 5.0;
    let [horizontal, vertical] = facts.coverage.tilts_deg;
    let value = horizontal.max(vertical);
    Evidence {
        what: "tilts of the boards",
        remedy: "add pairs tilted by 20 to 45 degrees",
        value: Some(value),
        limit: Some(LEAST_DEG),
        unit: "deg",
        allows: if value >= LEAST_DEG || facts.calibration.lenses_are_known() {
            Verdict::Pass
        } else {
            Verdict::Undecided
        },
        detail: format!(
            "range of the boards' tilts, {horizontal:.0} degrees about the horizontal and {vertical:.0} about the vertical axis; boards \
             that are all parallel do not tell the focal length from the distance, and lengths on them come out right even where tilted \
             ones are wrong"
        ),
    }
}

/// Whether the pictures agree with lenses that were known.
fn known_lenses(facts: &Facts) -> Option<Evidence> {
    let check = facts.calibration.lens_check.as_ref()?;
    let seen: Vec<String> = Side::BOTH
        .into_iter()
        .filter_map(|side| Some(format!("{} {:.3} %", side.name(), 100.0 * check.focus_seen[side as usize]?)))
        .collect();
    Some(Evidence {
        what: "known lenses",
        remedy: "give the lenses as they are now, or leave `--intrinsics` out and photograph more pairs",
        value: Some(check.chi_square),
        limit: Some(check.limit),
        unit: "",
        allows: if check.contradicts() { Verdict::Undecided } else { Verdict::Pass },
        detail: format!(
            "{}: squared difference of {} known numbers from what the pictures give by themselves, in units of its covariance. Nineteen of \
             twenty such tests see a focal length that differs by {}",
            check.statement,
            check.numbers,
            seen.join(", ")
        ),
    })
}

/// Depth and field: what lies beyond is extrapolated; within, the uncertainty of lengths says what it costs.
fn reach(facts: &Facts) -> [Evidence; 2] {
    let [near, far] = facts.coverage.depths_mm;
    let [left, right] = facts.coverage.field_shares;
    let line = |what, value, unit, detail| Evidence {
        what,
        value: Some(value),
        limit: None,
        unit,
        allows: Verdict::Pass,
        detail,
        remedy: "",
    };
    [
        line(
            "depth of the working volume",
            far - near,
            "mm",
            format!(
                "the middles of the boards stood {near:.0} to {far:.0} mm away; much nearer and farther the rig was not checked"
            ),
        ),
        line(
            "field reached by corners",
            100.0 * left.min(right),
            "%",
            format!(
                "of what both cameras see corners reached {:.0} % of the left and {:.0} % of the right picture; in the rest the lens model is extrapolated and \
                 was not checked",
                100.0 * left,
                100.0 * right
            ),
        ),
    ]
}

fn second_board(facts: &Facts) -> Evidence {
    let line = |value, allows, detail| Evidence {
        what: "second board",
        remedy: "check `--check-squares` and `--check-square-mm`, and that the rig has not moved between the two boards",
        value,
        limit: Some(facts.tolerance_mm),
        unit: "mm",
        allows,
        detail,
    };
    let Some(second) = facts.second else {
        let detail = "not asked for: the scale of every length is the pitch of the board, and an error of its pitch does not show here. `--check-images DIR` names pictures of a second board";
        return Evidence { limit: None, ..line(None, Verdict::Pass, detail.to_owned()) };
    };
    let Some(extremes) = &second.extremes else {
        let detail = format!(
            "a second board was asked for and no length on it could be measured in {} pairs: another board than stated, or a rig that \
             has moved",
            second.pairs_skipped.len()
        );
        return line(None, Verdict::Undecided, detail);
    };
    let worst = &extremes.largest;
    let scale = match (second.scale_error, second.scale_error_sigma) {
        (Some(scale), Some(sigma)) => format!(
            ", its scale by {:.1} +- {:.1} parts in a million (k = 2). Either board's pitch is wrong, or the rig has moved, where this \
             is beyond the limit",
            1e6 * scale,
            2e6 * sigma
        ),
        _ => String::new(),
    };
    // A board that can be measured in half of its pairs only, or with rays that contradict each other, is no witness for a pass.
    let measured = second.pairs >= second.pairs_skipped.len() && second.doubtful.contradicted_share() <= 0.1;
    let own = extremes.verdict(facts.tolerance_mm);
    let allows = if measured { own } else { own.and(Verdict::Undecided) };
    let detail = format!(
        "largest error plus its own expanded uncertainty ({:.4} + {:.4}) over all lengths in {} pairs of a board that took no part in the calibration{scale}; {} of {} corners have rays that contradict each other",
        worst.error_mm,
        worst.expanded_uncertainty_mm(),
        second.pairs,
        second.doubtful.contradicted,
        second.doubtful.corners
    );
    line(Some(worst.at_most_mm()), allows, detail)
}
