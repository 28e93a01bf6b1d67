//! `camera-check.json`: the verdict and the figures it stands on, as a file.

use serde_json::{Map, Value, json};

use crate::diagnostic::Warning;
use crate::stereo::calibrate::Calibration;
use crate::stereo::findings;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::verdict::{COVERAGE, Verdict};

/// The content of `camera-check.json`. Lengths held out: no pair helped to calibrate the cameras that measured it.
pub fn content(calibration: &Calibration, judged: &Judged) -> Map<String, Value> {
    // By how much each side of a tag is printed farther out than it is drawn, and its expanded uncertainty, where that
    // moves corners.
    let spread = calibration.spread_mm().map(|spread| ("board_spread_mm", json!(spread)));
    let fields = judgement(calibration, judged).into_iter().chain(figures(calibration, judged)).chain(spread);
    fields.map(|(key, value)| (key.to_owned(), value)).collect()
}

/// The verdict, and the length that the verdict on held-out lengths looks at.
fn judgement(calibration: &Calibration, judged: &Judged) -> [(&'static str, Value); 15] {
    let facts = &judged.facts;
    let extremes = &facts.accuracy.extremes;
    // Of the length whose error and uncertainty together are largest.
    let worst = &extremes.largest;
    let lenses = findings::of_lenses(calibration, &facts.volume);
    let found = facts.findings.iter().cloned().chain(lenses).chain(judged.of_scale());
    let found: Vec<_> = found.chain(findings::of_pairs(&calibration.discarded.pairs)).collect();
    // `at_most_mm` is compared with the tolerance. What the corners scatter by is in the error already.
    let judged_length = json!({
        "error_mm": worst.error_mm,
        "uncertainty_mm": worst.expanded_without_corners_mm(),
        "at_most_mm": worst.at_most_mm(),
    });
    let board_mm = worst.expansion.board_mm.map(|mm| mm / COVERAGE);
    [
        ("passed", json!(judged.verdict == Verdict::Pass)),
        ("verdict", json!(judged.verdict)),
        ("tolerance_mm", json!(facts.tolerance_mm)),
        ("evidence", json!(judged.evidence)),
        // The tolerance that the rig would meet; null where something else than a length stands against it.
        ("trusted_mm", json!(judged.trusted_mm())),
        ("trusted_length_mm", json!(facts.volume.length_mm)),
        ("max_abs_error_mm", json!(extremes.max_abs_error_mm)),
        // Nineteen of twenty held-out lengths are off by no more.
        ("within_95_mm", json!(extremes.one_in_twenty_mm)),
        ("volume", json!(facts.volume.volume)),
        // The pairs at the moment for which the rig and its covariance are.
        ("moment", json!(calibration.moment())),
        ("findings", json!(found)),
        ("judged_length", judged_length),
        // Expanded uncertainty (95 %) with the scatter of the corners at its ends.
        ("expanded_uncertainty_mm", json!(worst.expanded_uncertainty_mm())),
        // Standard deviations through the corners, the calibration, and the board's certificate; null without one.
        ("uncertainty_shares_mm", json!([Some(worst.corners_mm), Some(worst.calibration_mm), board_mm])),
        ("reprojection_rms_px", json!(calibration.rms_px())),
    ]
}

/// What was calibrated and measured.
fn figures(calibration: &Calibration, judged: &Judged) -> [(&'static str, Value); 22] {
    let (facts, accuracy) = (&judged.facts, &judged.facts.accuracy);
    let all = || calibration.views.iter().flat_map(|view| &view.observations);
    let warnings: Vec<String> =
        judged.advice.iter().cloned().chain(judged.warnings.iter().map(Warning::whole)).collect();
    let [bow_x_mm, bow_y_mm, twist_mm] = calibration.values.shared.shape_mm;
    [
        ("epipolar", json!(accuracy.epipolar)),
        ("baseline_mm", json!(calibration.rig().baseline_mm())),
        ("lens", json!(calibration.rig().left.lens.name())),
        // Height of the board's middle above its edges along x and y; zero where it was taken as flat.
        ("board_bow_mm", json!([bow_x_mm, bow_y_mm])),
        // Height to which a twist lifts the board's first and last corner and lowers the others.
        ("board_twist_mm", json!(twist_mm)),
        ("pairs_used", json!(calibration.views.len())),
        ("pairs_skipped", json!(calibration.skipped)),
        ("folds", json!(accuracy.folds)),
        ("corners_used", json!(all().filter(|o| o.active).count())),
        ("corners_rejected", json!(all().filter(|o| !o.active).count())),
        ("corner_sigma_px", json!(calibration.noise.typical_px(&calibration.views))),
        // Mean of what both rays of a corner leave of it, one where its pictures scatter independently.
        ("rays_chi_square", json!(accuracy.rays_chi_square)),
        ("reduced_chi_square", json!(calibration.noise.reduced_chi_square)),
        ("ranges", json!(accuracy.ranges)),
        // `x10` and `x70` stand for one square and seven, or as many as the board has.
        ("pairs", json!(accuracy.pairs)),
        ("second_board", json!(facts.standards.second)),
        ("known_moves", json!(facts.standards.moves.measured)),
        ("lens_scores", json!(calibration.lens_scores)),
        ("disagreements", json!(facts.disagreements)),
        ("neighbour_correlation", json!(facts.residual_pattern.neighbours)),
        ("pair_scatter", json!(calibration.pair_scatter)),
        ("warnings", json!(warnings)),
    ]
}
