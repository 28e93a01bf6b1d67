//! `measure.html` and the table on stdout: where the target was, and how well that is known.

use maud::{Markup, html};

use super::figure::Plot;
use super::page::{self, Tone};
use super::table::number;
use crate::error::Result;
use crate::files::OutDir;
use crate::stereo::measure_file::{MeasureFile, MeasuredPose};
use crate::stereo::target::TargetPose;

/// The short text on stdout.
pub fn summary(file: &MeasureFile, out: &OutDir) -> String {
    format!(
        "{}\nmeasurements: {}\nreport: {}\n",
        headline(file),
        out.join("measurements.csv"),
        out.join("measure.html")
    )
}

fn headline(file: &MeasureFile) -> String {
    let (poses, measured) = file.counts();
    format!("{measured} of {poses} poses measured; {}", quality(file))
}

fn quality(file: &MeasureFile) -> String {
    let (fit_mm, px) = file.residuals();
    let sigma = file.sigma_mm();
    let along = |i: usize| number(sigma.map(|s| s[i]), 4);
    format!(
        "board fit {} mm, reprojection {} px RMS; median sigma of the mark point x {} y {} z {} mm",
        number(fit_mm, 4),
        number(px, 3),
        along(0),
        along(1),
        along(2),
    )
}

/// Poses in the table of the worst.
const WORST: usize = 10;

/// The poses with the largest residuals.
fn worst_table(measured: &[MeasuredPose]) -> Markup {
    let mut found: Vec<_> = measured.iter().filter_map(|m| Some((m, m.target.as_ref().ok()?))).collect();
    found.sort_by(|a, b| b.1.rms_px.total_cmp(&a.1.rms_px));
    let row = |(m, t): &(&MeasuredPose, &TargetPose)| {
        let sigma = |k: usize| number(Some(t.covariance[(k, k)].sqrt()), 4);
        let figures = [number(Some(t.rms_px), 3), number(Some(t.fit_rms_mm), 4), sigma(3), sigma(4), sigma(5)];
        let mut row = vec![m.at.pose.clone(), m.at.group.clone()];
        row.extend(figures);
        row.push(t.corners.to_string());
        row
    };
    let rows: Vec<Vec<String>> = found.iter().take(WORST).map(row).collect();
    page::table(
        &["pose", "group", "reprojection, px", "board fit, mm", "sigma x, mm", "sigma y, mm", "sigma z, mm", "corners"],
        &rows,
    )
}

/// The report.
pub fn page(measured: &[MeasuredPose], file: &MeasureFile) -> Result<String> {
    let (poses, count) = file.counts();
    let tone = if count == poses { Tone::Good } else { Tone::Doubtful };
    let of = |figure: fn(&TargetPose) -> f64| -> Vec<(f64, f64)> {
        measured.iter().enumerate().filter_map(|(i, m)| Some((i as f64, figure(m.target.as_ref().ok()?)))).collect()
    };
    let place = |i: usize, j: usize| -> Vec<(f64, f64)> {
        measured
            .iter()
            .filter_map(|m| m.target.as_ref().ok())
            .map(|t| (t.cam_from_board.translation.vector[i], t.cam_from_board.translation.vector[j]))
            .collect()
    };
    let residual = Plot::new("Residual of every pose", "pose, in the order of the list", "RMS, px")
        .points("", &of(|t| t.rms_px))
        .svg()?;
    let sigma = Plot::new("Standard deviation of the mark point", "pose, in the order of the list", "mm")
        .points("x", &of(|t| t.covariance[(3, 3)].sqrt()))
        .points("y", &of(|t| t.covariance[(4, 4)].sqrt()))
        .points("z", &of(|t| t.covariance[(5, 5)].sqrt()))
        .svg()?;
    let front = Plot::new("Mark points, as the left camera sees them", "x, mm", "y, mm")
        .points("", &place(0, 1))
        .equal_axes()
        .y_down()
        .svg()?;
    let top = Plot::new("Mark points, from above", "x, mm", "z, mm").points("", &place(0, 2)).equal_axes().svg()?;
    let missing: Vec<Vec<String>> =
        measured.iter().filter_map(|m| Some(vec![m.at.pose.clone(), m.target.as_ref().err()?.clone()])).collect();
    let content = html! {
        (page::verdict(tone, &format!("{count} of {poses} poses measured"), &quality(file)))
        (page::warnings(file.warnings()))
        (page::figure(&residual, "A pose far above the others was blurred, moved between the two pictures, or shows another board. All poses \
            far above the camera check's residual: the target's print is less true than the check board's (the board fit in mm says \
            by how much), or the rig has changed since."))
        h2 { "Poses, the worst first" }
        (worst_table(measured))
        (page::figure(&sigma, "From the corners and from the calibration together. z, away from the camera, is always the weakest."))
        div.side { (page::figure(&front, "Where the target was in the pictures: a corner of the field that no pose visits says nothing about the lens there.")) (page::figure(&top, "Where the robot was sent: empty regions are not calibrated.")) }
        @if !missing.is_empty() {
            h2 { "Poses without a measurement" }
            (page::table(&["pose", "why"], &missing))
        }
    };
    Ok(page::page("Target measurements", &format!("{poses} poses"), &content))
}
