//! The plots: errors of lengths, what the model leaves of the corners, and how uncertain lengths are over the volume.

use crate::diagnostic::{short, two_digits};
use crate::report::Result;
use crate::report::drawing::figure::Plot;
use crate::report::page;
use crate::stereo::calibrate::Calibration;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::lengths::Axis;
use crate::stereo::judge::lengths::held_out::{Accuracy, HeldOutPair};
use crate::stereo::judge::residual_correlation::Field;
use maud::{Markup, html};

/// Fig. 6 of the paper, (a) to (d).
pub(super) fn lengths(judged: &Judged) -> Result<Markup> {
    let accuracy = &judged.facts.accuracy;
    let ([x_long, y_long], [x_short, y_short]) = (accuracy.long_mm.map(short), accuracy.short_mm.map(short));
    let guard = |plot: Plot| plot.hline(judged.facts.tolerance_mm, "tolerance").hline(-judged.facts.tolerance_mm, "");
    let title = match x_long == y_long {
        true => format!("(a) Errors of all lengths of {x_long} mm"),
        false => format!("(a) Errors of all lengths of {x_long} mm along x and {y_long} mm along y"),
    };
    let a = Plot::new(&title, "pair used, in the order of names", "error, mm").whole_x();
    let a = guard(a.points("", every_length(accuracy))).svg()?;
    let mean = |of: fn(&HeldOutPair) -> Option<f64>| {
        accuracy.pairs.iter().enumerate().filter_map(move |(i, p)| Some((i as f64 + 1.0, of(p)?)))
    };
    let b = Plot::new("(b) Mean error of every pair", "pair used, in the order of names", "mean error, mm")
        .whole_x()
        .points(&format!("x {x_short} mm"), mean(|p| p.mean_error_x_short_mm))
        .points(&format!("y {y_short} mm"), mean(|p| p.mean_error_y_short_mm))
        .points(&format!("x {x_long} mm"), mean(|p| p.mean_error_x_long_mm))
        .points(&format!("y {y_long} mm"), mean(|p| p.mean_error_y_long_mm))
        .svg()?;
    let range_plot = |title: &str, along: Axis| {
        let ranges = || accuracy.ranges.iter().filter(|r| r.axis == along);
        let plot = Plot::new(title, "range, mm", "error, mm")
            .error_bars("mean and std", ranges().map(|r| (r.nominal_mm, r.mean_error_mm, r.std_mm)))
            .line("max |error|", ranges().map(|r| (r.nominal_mm, r.max_abs_error_mm)));
        guard(plot).svg()
    };
    let c = range_plot("(c) Every range along x", Axis::X)?;
    let d = range_plot("(d) Every range along y", Axis::Y)?;
    Ok(html! {
        div.side {
            (page::figure(&a, "Pair after pair, x before y; of very many lengths the worst of each few are drawn. Steps between pairs are calibration, the width of the band is corner noise."))
            (page::figure(&b, "A pair far from the others was moved, blurred or hit from the side by light; a mean that grows with the range is an error of scale."))
        }
        div.side {
            (page::figure(&c, "A mean that bends with the range is a lens or a board's shape that the model lacks."))
            (page::figure(&d, "Errors that do not grow with the range come from the corners, not from the rig."))
        }
    })
}

/// Fig. 6 (a): all long lengths, spread over their pair's number. Of more than can be told apart the worst of every few
/// stay.
pub(super) fn every_length(accuracy: &Accuracy) -> Vec<(f64, f64)> {
    /// Points of a figure that still loads at once.
    const MOST_POINTS: usize = 3000;
    let total: usize = accuracy.pairs.iter().map(|pair| pair.long_errors_mm.len()).sum();
    let few = total.div_ceil(MOST_POINTS).max(1);
    let of_pair = |(i, pair): (usize, &HeldOutPair)| -> Vec<(f64, f64)> {
        let count = pair.long_errors_mm.len().max(1) as f64;
        let worst = |(k, errors): (usize, &[f64])| {
            let error = errors.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
            Some((i as f64 + 0.6 + 0.8 * (k * few) as f64 / count, error))
        };
        pair.long_errors_mm.chunks(few).enumerate().filter_map(worst).collect()
    };
    accuracy.pairs.iter().enumerate().flat_map(of_pair).collect()
}

pub(super) fn residuals(calibration: &Calibration, judged: &Judged) -> Result<Markup> {
    let rig = calibration.rig();
    let fields = judged.facts.residual_pattern.fields.iter().zip([&rig.left, &rig.right]);
    let figures = fields.map(|(field, camera)| field_figure(field, camera.width, camera.height));
    let figures: Vec<Markup> = figures.collect::<Result<_>>()?;
    let noise = &calibration.noise;
    let chi = match noise.reduced_chi_square {
        Some(chi) => format!(
            "The corners' own covariances explain the residuals with a reduced chi-square of {chi:.2}; {:.4} px were added to each \
             coordinate.",
            noise.added_px
        ),
        None => "The corners came without covariances; their scatter is that of the residuals.".to_owned(),
    };
    Ok(html! {
        p {
            (format!(
                "Root mean square {:.4} px (length of the 2-D residual, both pictures), corner scatter {:.4} px a coordinate. {chi} \
                 Neighbouring corners' residuals correlate by {:.3} (chance: {:.3}).",
                calibration.rms_px(),
                noise.typical_px(&calibration.views),
                judged.facts.residual_pattern.neighbours.along,
                judged.facts.residual_pattern.neighbours.standard_error))
        }
        div.side { @for figure in &figures { (figure) } }
    })
}

/// Mean residuals over one picture, magnified, and which cells have seen corners.
fn field_figure(field: &Field, width: u32, height: u32) -> Result<Markup> {
    let longest = field.cells.iter().map(|c| c.mean_px[0].hypot(c.mean_px[1])).fold(0.0, f64::max);
    let cell = f64::from(width) / (field.cells.len() as f64).sqrt();
    let magnify = if longest > 0.0 { 0.8 * cell / longest } else { 1.0 };
    let seen = || field.cells.iter().filter(|c| c.corners > 0);
    let arrows = seen().map(|c| [c.x_px, c.y_px, magnify * c.mean_px[0], magnify * c.mean_px[1]]);
    let empty = field.cells.iter().filter(|c| c.corners == 0).map(|c| (c.x_px, c.y_px));
    let svg = Plot::new(&format!("Mean residuals, {} picture", field.side), "x, px", "y, px")
        .vectors("", arrows)
        .points("no corner", empty)
        .ranges((-0.5, f64::from(width) - 0.5), (-0.5, f64::from(height) - 0.5))
        .y_down()
        .equal_axes()
        .svg()?;
    let caption = format!(
        "Arrows are magnified {magnify:.0} times; the longest is {longest:.4} px, the systematic part {:.4} px. Arrows that turn or point outward together \
         are a lens that the model lacks. Corners reached {} of {} cells; what lies in the others is extrapolated.",
        field.systematic_px,
        seen().count(),
        field.cells.len()
    );
    Ok(page::figure(&svg, &caption))
}

pub(super) fn volume(judged: &Judged) -> Result<Markup> {
    let lying = |axis: usize| judged.facts.volume.lengths.iter().filter(move |l| l.direction[axis].abs() > 0.7);
    let along = |axis: usize| lying(axis).map(|l| (l.at_mm.z, l.sigma_mm()));
    let svg = Plot::new(
        &format!("Standard deviation of a length of {} mm", judged.facts.volume.length_mm),
        "distance from the left camera, mm",
        "mm",
    )
    .points("along x", along(0))
    .points("along y", along(1))
    .points("along z", along(2))
    .svg()?;
    let worst = |axis: usize| lying(axis).map(|l| l.sigma_mm()).fold(0.0, f64::max);
    let caption = format!(
        "{} lengths in the volume in which the boards stood, as far as both cameras see them; corner noise at both ends and the calibration together. The worst: \
         {} mm across the line of sight{}. Where points rise above the tolerance, add pairs at that distance.",
        judged.facts.volume.lengths.len(),
        two_digits(worst(0).max(worst(1))),
        along_sight(judged, worst(2))
    );
    Ok(page::figure(&svg, &caption))
}

/// What the lengths along the line of sight are uncertain by: those that boards showed, else those of which none showed
/// any.
fn along_sight(judged: &Judged, shown_mm: f64) -> String {
    let unseen = judged.facts.volume.along_sight.iter().map(|length| length.sigma_mm()).reduce(f64::max);
    match unseen {
        _ if shown_mm > 0.0 => format!(", {} mm along it", two_digits(shown_mm)),
        Some(mm) => format!("; along it, where no board lay, it would be {} mm", two_digits(mm)),
        None => String::new(),
    }
}
