//! Lines on lengths: held out, anywhere in the volume, with other models, without some pairs, on a second board; and on
//! what residuals, rays and epipolar lines say of them.

use std::borrow::Cow;

use super::facts::{Case, Facts};
use crate::diagnostic::{summed, two_digits};
use crate::statistics::median;
use crate::stereo::judge::doubtful_corners::CONTRADICTED;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::lengths::model_disagreement;
use crate::stereo::judge::verdict::{COVERAGE, LengthError, Verdict};
use crate::stereo::judge::view_coverage;
use crate::stereo::volume::Extent;
use crate::stereo::volume::lengths::VolumeLength;

pub(super) fn held_out_lengths(case: &Case) -> Evidence {
    let extremes = &case.facts.accuracy.extremes;
    let worst = &extremes.largest;
    let doubtful = &case.facts.accuracy.doubtful;
    let left_out = match doubtful.lengths_left_out {
        0 => String::new(),
        n => format!("; {n} lengths that end in doubtful corners are not counted (see the check of rays)"),
    };
    let board_mm = worst.expansion.board_mm.unwrap_or_default();
    // What is left of the tolerance beside an uncertain board decides nothing about pictures.
    let remedy = if worst.at_most_mm() - board_mm <= case.facts.tolerance_mm && 2.0 * board_mm > case.facts.tolerance_mm
    {
        "measure the board's own lengths more finely, and give that: `--board-uncertainty-mm`, or `--measured-mm` with more digits"
    } else {
        beyond_others(case).unwrap_or(
            "look at the worst pair in camera-check.html, and move both of its pictures away where they show why; where all are alike: \
             a flat board on a stand, both cameras triggered at once, or the `--tolerance-mm` that your robot needs",
        )
    };
    let detail = format!(
        "{} of all lengths between corners of pairs that the rig had not seen, {} folds: {}. The limit is the tolerance. The largest error of \
         any length is {} mm, one length in twenty is off by more than {} mm{left_out}",
        LARGEST_SUM,
        case.facts.accuracy.folds,
        as_added(worst),
        two_digits(extremes.max_abs_error_mm),
        two_digits(extremes.one_in_twenty_mm)
    );
    let line = Evidence::of_length("held-out lengths", remedy, Some(worst.at_most_mm()), case, detail);
    Evidence { allows: extremes.verdict(case.facts.tolerance_mm), ..line }
}

/// What to do where the length that decides is uncertain, not wrong, and lies in a pair whose corners lie farther out
/// than all others.
fn beyond_others(case: &Case) -> Option<&'static str> {
    let worst = &case.facts.accuracy.extremes.largest;
    let uncertain_mm = worst.expanded_calibration_mm();
    let decides = uncertain_mm > worst.error_mm && uncertain_mm > case.facts.tolerance_mm;
    let lens_told = decides && !case.facts.coverage.lenses_known;
    lens_told.then(|| view_coverage::beyond_others(case.calibration, worst.pair)).flatten()
}

/// What is compared with the tolerance.
const LARGEST_SUM: &str = "largest sum of error and expanded uncertainty (95 %)";

/// The error and the uncertainty that are added.
fn as_added(length: &LengthError) -> String {
    let [error, uncertainty, sum] = summed(length.error_mm, length.expanded_without_corners_mm());
    format!(
        "{error} + {uncertainty} = {sum} mm, the uncertainty being that of calibration and board, since what the corners scatter by is in the \
         error already"
    )
}

/// Name of the line on the tolerance itself.
pub const TOLERANCE: &str = "tolerance";

/// A tolerance that no rig can miss whose corners were counted rightly: an error of half a square puts a corner nearer
/// to another one.
pub(super) fn tolerance(case: &Case) -> Option<Evidence> {
    let (tolerance_mm, half_mm) = (case.facts.tolerance_mm, 0.5 * case.calibration.board.square_mm);
    let remedy = "`--tolerance-mm` and `--square-mm` are in mm: see that both are";
    let detail = "as wide as half a square of the board or wider: any rig would be within it".to_owned();
    let figures = [tolerance_mm, half_mm];
    (tolerance_mm >= half_mm).then(|| Evidence::of_doubt(TOLERANCE, remedy, figures, "mm asked for", false, detail))
}

pub(super) fn any_length(case: &Case) -> Evidence {
    let worst = case.facts.volume.worst(|length| case.expanded_mm(length));
    let value = worst.map(|(mm, _)| mm);
    let detail = match worst {
        None => "the rig has no covariance over the volume in which the boards stood".to_owned(),
        Some((_, length)) => format!(
            "expanded uncertainty of a length of {:.0} mm where it is largest, {} {:.0} mm away (standard deviations: corners {} mm, \
             calibration {} mm, the latter times {:.2}, as Student has it for {} pairs with poses of their own; what the models leave open is in it), over {}{}",
            case.facts.volume.length_mm,
            length.lies(),
            length.at_mm.z,
            two_digits(length.corners_mm),
            two_digits(length.calibration_mm),
            case.facts.expansion.calibration,
            case.calibration.pair_scatter.groups,
            case.facts.volume.extent.said(),
            unseen(case)
        ),
    };
    let remedy = worst
        .map_or(Cow::Borrowed("add pairs with the board elsewhere, and tilted"), |(_, length)| surer(case, length));
    Evidence::of_length("any length in the volume", remedy, value, case, detail)
}

/// What makes the length that is known least known better: pairs where it lies, unless what the corners at its ends
/// scatter by is too much already.
fn surer(case: &Case, length: &VolumeLength) -> Cow<'static, str> {
    if COVERAGE * length.corners_mm > case.facts.tolerance_mm {
        return "what corners scatter by is more than the tolerance where lengths are least certain, and no more pairs change that: a flat board on a stand, \
                sharper pictures, both cameras triggered at once, cameras farther apart, or a board that is nearer"
            .into();
    }
    let (left, _) = case.calibration.rig().project(&length.at_mm);
    let place = format!("at ({:.0}, {:.0}) px of the left picture, {:.0} mm away", left.x, left.y, length.at_mm.z);
    format!("add pairs with the board where lengths are least certain, {place}, {}", length.lies()).into()
}

/// What lengths that no board showed would be known to.
fn unseen(case: &Case) -> String {
    if case.facts.volume.extent != Extent::Boards {
        return String::new();
    }
    let worst = case.facts.volume.along_sight.iter().map(|length| case.expanded_mm(length)).reduce(f64::max);
    worst.map_or(String::new(), |mm| {
        format!(". Along the line of sight, where no board lay, it would be {} mm", two_digits(mm))
    })
}

/// What the calibration alone makes of lengths that no board showed: of a robot's way towards the cameras, over whose
/// target the corners' noise averages out. Boards that hardly tilt fit rigs whose depths differ by a tenth.
pub(super) fn along_sight(case: &Case) -> Option<Evidence> {
    let Facts { volume, expansion, .. } = case.facts;
    let sigma_mm = volume.along_sight_mm.filter(|_| volume.extent == Extent::Boards)?;
    Some(Evidence::of_length(
        "calibration along the line of sight",
        "tilt the board more, by 20 to 45 degrees about both axes, at several distances",
        Some(expansion.calibration * sigma_mm),
        case,
        format!(
            "expanded uncertainty, by the calibration alone, of a length of {:.0} mm that lies along the line of sight, where it is largest in the volume: a focal \
             length that is hardly known stretches all depths",
            volume.length_mm
        ),
    ))
}

pub(super) fn models(case: &Case) -> Evidence {
    let value = case.facts.disagreements.iter().map(|d| d.length_change_mm).fold(0.0, f64::max);
    let detail = model_disagreement::describe(&case.facts.disagreements).unwrap_or_else(|| {
        "no richer lens, and no board that is not flat, has additional terms that are more than chance: no admissible model measures other lengths".to_owned()
    });
    Evidence::of_length(
        "spread of admissible models",
        "add pairs with the board at the borders of both pictures",
        Some(value),
        case,
        detail,
    )
}

pub(super) fn residuals(case: &Case) -> Evidence {
    let sigma_px = case.calibration.noise.typical_px(&case.calibration.views);
    let systematic_px = case.facts.residual_pattern.systematic_px(sigma_px);
    // What both pictures see alike moves no point, but the rig that is fitted to it: the corners' whole scatter counts
    // here.
    let share = case.facts.accuracy.disagreement_share().sqrt();
    let corners_mm = case.facts.volume.worst(|length| length.corners_mm / share).map(|(mm, _)| mm);
    let value = corners_mm.map(|mm| mm * systematic_px / sigma_px);
    let neighbours = &case.facts.residual_pattern.neighbours;
    let detail = if systematic_px > 0.0 {
        format!(
            "the residuals are not noise: those of neighbouring corners correlate by {:.2} (chance: {:.2}), {:.3} px of pattern over \
             the pictures is common to all pairs. The lens model, the board's shape or its print lacks something; {systematic_px:.3} px \
             at both ends move a length by so much where it matters most",
            neighbours.along,
            neighbours.standard_error,
            case.facts.residual_pattern.pattern_px()
        )
    } else {
        format!(
            "the residuals are noise: neighbouring corners correlate by {:.3} along their edge (chance: {:.3})",
            neighbours.along, neighbours.standard_error
        )
    };
    Evidence::of_length(
        "residual correlation",
        "look at the map of residuals in camera-check.html; it takes another `--lens` or a better board, or `--board-shape bowed` where it was taken as flat",
        value,
        case,
        detail,
    )
}

pub(super) fn folds(case: &Case) -> Evidence {
    let layout = &case.calibration.layout;
    let changes = case.facts.accuracy.fold_steps.iter().map(|step| case.facts.volume.most_changed_mm(layout, step));
    let value = changes.fold(0.0, f64::max);
    let unchecked = &case.facts.accuracy.unchecked;
    let names = unchecked.join(", ");
    let alone = format!(". Without {names} the others do not determine the cameras: nothing checks what it says");
    let alone = if unchecked.is_empty() { String::new() } else { alone };
    let detail = format!(
        "largest change of a length of {:.0} mm anywhere in the working volume when a block of similar pairs is left out; a rig that depends on one block has the errors of that block{alone}",
        case.facts.volume.length_mm
    );
    Evidence::of_length(
        "rigs without some pairs",
        "add pairs with the board elsewhere and tilted otherwise",
        unchecked.is_empty().then_some(value),
        case,
        detail,
    )
}

/// Name of the line on rays.
pub const RAYS: &str = "rays that contradict each other";

pub(super) fn rays(case: &Case) -> Evidence {
    /// Share of corners whose rays may contradict each other: a hand or a reflection, not the rig.
    const LIMIT_PERCENT: f64 = 2.0;
    let doubtful = &case.facts.accuracy.doubtful;
    let value = 100.0 * doubtful.contradicted_share();
    let named = if doubtful.pairs.is_empty() { String::new() } else { format!(", in {}", doubtful.named()) };
    let remedy = "look at the corners of the pairs that the page names, for a hand, glare or shadow";
    let detail = format!(
        "{} of {} held-out corners have rays that miss each other by more than {CONTRADICTED} standard deviations and {} were \
         measured far worse than usual{named}; a few are a hand or a reflection, more are an error of the rig",
        doubtful.contradicted, doubtful.corners, doubtful.unsure
    );
    Evidence::of_doubt(RAYS, remedy, [value, LIMIT_PERCENT], "%", value <= LIMIT_PERCENT, detail)
}

pub(super) fn epipolar(case: &Case) -> Evidence {
    let error = &case.facts.accuracy.epipolar;
    let sigma_px = case.calibration.noise.typical_px(&case.calibration.views);
    let sigma_px = sigma_px * case.facts.accuracy.disagreement_share().sqrt();
    // A miss as large along the epipolar line is depth, and moves lengths as corners do.
    let px_per_mm = median(case.facts.volume.lengths.iter().map(|length| sigma_px / length.corners_mm));
    let limit = px_per_mm.map(|px| px * case.facts.tolerance_mm);
    Evidence {
        what: "epipolar error",
        remedy: "look at the worst pair in camera-check.html".into(),
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

pub(super) fn second_board(case: &Case) -> Evidence {
    let remedy =
        "check `--check-squares` and `--check-square-mm`, and that the rig has not moved between the two boards";
    let line =
        |value, allows, detail| Evidence { allows, ..Evidence::of_length("second board", remedy, value, case, detail) };
    let Some(second) = &case.facts.standards.second else {
        let detail = "not asked for: the scale of every length is the pitch of the board, and an error of its pitch does not show here. `--check-images DIR` names pictures of a second board, `--known-move MM` a slide of a known length";
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
    let scale = match (second.scale_error, second.scale_error_sigma) {
        (Some(scale), Some(sigma)) => format!(
            "; its scale is off by {:.1} +- {:.1} parts in a million (k = 2). Either board's pitch is wrong, or the rig has moved, where this \
             is beyond the limit",
            1e6 * scale,
            2e6 * sigma
        ),
        _ => String::new(),
    };
    // A board that can be measured in half of its pairs only, or with rays that contradict each other, is no witness
    // for a pass.
    let measured = second.pairs >= second.pairs_skipped.len() && second.doubtful.contradicted_share() <= 0.1;
    let own = extremes.verdict(case.facts.tolerance_mm);
    let allows = if measured { own } else { own.and(Verdict::Undecided) };
    let detail = format!(
        "{} of all lengths in {} pairs of a board that took no part in the calibration: {}{scale}; {} of {} corners have rays that contradict each other",
        LARGEST_SUM,
        second.pairs,
        as_added(&extremes.largest),
        second.doubtful.contradicted,
        second.doubtful.corners
    );
    line(Some(extremes.largest.at_most_mm()), allows, detail)
}
