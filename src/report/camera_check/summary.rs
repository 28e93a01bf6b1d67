//! The verdict in words, and the table on stdout.

use crate::files::OutDir;
use crate::report::table::{Table, number};
use crate::stereo::calibrate::Calibration;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::lengths::{Axis, Range};
use crate::stereo::judge::verdict::{COVERAGE, Verdict};

/// Rows of the table on stdout: more ranges are thinned out.
const TABLE_ROWS: usize = 7;

pub(super) fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "PASS",
        Verdict::Fail => "FAIL",
        Verdict::Undecided => "UNDECIDED",
    }
}

pub(super) fn axis(range: &Range) -> &'static str {
    if range.axis == Axis::X { "x" } else { "y" }
}

/// The short table on stdout.
pub fn summary(calibration: &Calibration, judged: &Judged, out: &OutDir) -> String {
    let accuracy = &judged.accuracy;
    let rig = calibration.rig();
    let mut table = Table::new(["range mm", "lengths", "mean mm", "std mm", "max |error| mm"]);
    for along in [Axis::X, Axis::Y] {
        let ranges: Vec<&Range> = accuracy.ranges.iter().filter(|r| r.axis == along).collect();
        let step = ranges.len().div_ceil(TABLE_ROWS).max(1);
        for range in ranges.iter().step_by(step) {
            table.row([
                format!("{} {}", axis(range), range.nominal_mm),
                range.count.to_string(),
                number(Some(range.mean_error_mm), 4),
                number(Some(range.std_mm), 4),
                number(Some(range.max_abs_error_mm), 4),
            ]);
        }
    }
    let total = calibration.views.len() + calibration.skipped.len();
    let [along_x, along_y, twist] = calibration.values.shared.shape_mm;
    let bow = if calibration.layout.shape {
        format!(", board bowed by {along_x:.4} mm along x and {along_y:.4} mm along y, twisted by {twist:.4} mm")
    } else {
        String::new()
    };
    let epipolar = &accuracy.epipolar;
    format!(
        "{}: {}\n{}\n{}\n{} of {total} pairs, {} lens, reprojection RMS {} px, baseline {} mm{bow}\nepipolar error RMS {} px, largest \
         {} px\n\n{table}\nreport: {}\n",
        word(judged.verdict),
        explanation(judged),
        deciding(judged),
        trusted(judged),
        calibration.views.len(),
        rig.left.lens.name(),
        number(Some(calibration.rms_px), 3),
        number(Some(rig.baseline_mm()), 3),
        number(Some(epipolar.rms_px), 3),
        number(Some(epipolar.max_px), 3),
        out.join("camera-check.html"),
    )
}

pub(super) fn explanation(judged: &Judged) -> String {
    let extremes = &judged.accuracy.extremes;
    let worst = &extremes.largest;
    let board = worst.expansion.board_mm.map_or_else(String::new, |mm| format!(", board {:.4}", mm / COVERAGE));
    format!(
        "largest held-out length error {:.4} mm, expanded uncertainty {:.4} mm (95 %; standard deviations: corners {:.4}, calibration \
         {:.4}{board}), tolerance {} mm",
        extremes.max_abs_error_mm,
        worst.expanded_uncertainty_mm(),
        worst.corners_mm,
        worst.calibration_mm,
        judged.tolerance_mm
    )
}

/// The line of the ledger that decides, and how many others are below a pass.
pub(super) fn deciding(judged: &Judged) -> String {
    let below = judged.evidence.iter().filter(|line| line.allows != Verdict::Pass).count();
    let others = match below.saturating_sub(1) {
        0 if below == 0 => format!("all {} lines of evidence allow a pass", judged.evidence.len()),
        0 => "nothing else stands against a pass".to_owned(),
        1 => "1 other line of evidence is below a pass".to_owned(),
        others => format!("{others} other lines of evidence are below a pass"),
    };
    judged.deciding().map_or(others.clone(), |line| format!("decided by {}: {}; {others}", line.what, line.figure()))
}

/// What the rig can be trusted to, whatever the tolerance.
pub(super) fn trusted(judged: &Judged) -> String {
    match judged.trusted_mm() {
        Some(mm) => format!("lengths can be trusted to {mm:.4} mm"),
        None => "lengths cannot be trusted to any tolerance before that is settled".to_owned(),
    }
}

/// What the verdict means for somebody who must decide.
pub(super) fn advice(judged: &Judged) -> String {
    let [long, _] = judged.accuracy.long_mm;
    let sure = judged.tolerance_mm;
    match judged.verdict {
        Verdict::Pass => {
            let trusted = judged.trusted_mm().unwrap_or(sure);
            format!("Lengths can be trusted to {trusted:.4} mm in the volume where the boards stood.")
        }
        Verdict::Undecided => format!(
            "The evidence does not decide: the lines below that are not a pass say what casts doubt and what would settle it; until \
             then do not rely on {sure} mm."
        ),
        Verdict::Fail => format!(
            "Do not rely on {sure} mm: errors of lengths of {long} mm, the pairs and the residuals below say where it is lost."
        ),
    }
}
