//! `camera-check.html` and the table on stdout: can this rig be trusted, and why.

use maud::html;

use super::figure::Plot;
use super::page;
use super::table::{Table, number};
use crate::error::Result;
use crate::files::OutDir;
use crate::stereo::accuracy::{Accuracy, Axis, Verdict};
use crate::stereo::calibrate::Calibration;

/// The word for a verdict.
fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "PASS",
        Verdict::Fail => "FAIL",
        Verdict::Undecided => "UNDECIDED",
    }
}

/// The short table on stdout.
pub fn summary(calibration: &Calibration, accuracy: &Accuracy, tolerance_mm: f64, out: &OutDir) -> String {
    let rig = calibration.rig();
    let skipped = calibration.skipped.len();
    let mut table = Table::new(["range", "lengths", "mean mm", "std mm", "max |error| mm"]);
    for range in &accuracy.ranges {
        let axis = if range.axis == Axis::X { "x" } else { "y" };
        table.row([
            format!("{axis} {}", range.nominal_mm),
            range.count.to_string(),
            number(Some(range.mean_error_mm), 4),
            number(Some(range.std_mm), 4),
            number(Some(range.max_abs_error_mm), 4),
        ]);
    }
    format!(
        "{}: largest held-out length error {} mm, expanded uncertainty {} mm, tolerance {tolerance_mm} mm\n\
         {} of {} pairs, {} lens, reprojection RMS {} px, baseline {} mm\n\n{table}\nreport: {}\n",
        word(accuracy.verdict(tolerance_mm)),
        number(Some(accuracy.max_abs_error_mm), 4),
        number(Some(accuracy.expanded_uncertainty_mm), 4),
        calibration.views.len(),
        calibration.views.len() + skipped,
        rig.left.lens.name(),
        number(Some(calibration.rms_px), 3),
        number(Some(rig.baseline_mm()), 3),
        out.join("camera-check.html"),
    )
}

/// The report.
pub fn page(calibration: &Calibration, accuracy: &Accuracy, tolerance_mm: f64) -> Result<String> {
    let verdict = accuracy.verdict(tolerance_mm);
    let tone = match verdict {
        Verdict::Pass => page::Tone::Good,
        Verdict::Undecided => page::Tone::Doubtful,
        Verdict::Fail => page::Tone::Bad,
    };
    let of = |axis| -> Vec<(f64, f64)> {
        accuracy.ranges.iter().filter(|r| r.axis == axis).map(|r| (r.nominal_mm, r.max_abs_error_mm)).collect()
    };
    let ranges = Plot::new("Largest error of every range", "range, mm", "max |error|, mm")
        .line("x", &of(Axis::X))
        .line("y", &of(Axis::Y))
        .hline(tolerance_mm, "tolerance")
        .svg()?;
    let content = html! {
        (page::verdict(tone, word(verdict), &format!(
            "largest held-out length error {:.4} mm, expanded uncertainty {:.4} mm, tolerance {tolerance_mm} mm",
            accuracy.max_abs_error_mm, accuracy.expanded_uncertainty_mm)))
        (page::figure(&ranges, "Every length was measured by cameras that had not seen its pair."))
    };
    Ok(page::page("Camera check", &format!("{} pairs", calibration.views.len()), &content))
}
