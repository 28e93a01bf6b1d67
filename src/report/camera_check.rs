//! `camera-check.html` and the table on stdout: can this rig be trusted, and why.

use maud::{Markup, html};

use super::Result;
use super::blur;
use super::drawing::figure::Plot;
use super::drawing::pair_picture::{self, PairPicture};
use super::drawing::scene::{Ink, Scene};
use super::page::{self, Tone};
use super::rig;
use super::table::{Table, number, with_sigma};
use crate::files::OutDir;
use crate::imaging::Corners;
use crate::stereo::Side;
use crate::stereo::calibrate::Calibration;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::evidence;
use crate::stereo::judge::held_out::{Accuracy, HeldOutPair};
use crate::stereo::judge::lengths::{Axis, Range};
use crate::stereo::judge::residual_correlation::Field;
use crate::stereo::judge::verdict::{COVERAGE, Verdict};

/// Rows of the table on stdout: more ranges are thinned out.
const TABLE_ROWS: usize = 7;

fn word(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Pass => "PASS",
        Verdict::Fail => "FAIL",
        Verdict::Undecided => "UNDECIDED",
    }
}

fn axis(range: &Range) -> &'static str {
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

fn explanation(judged: &Judged) -> String {
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
fn deciding(judged: &Judged) -> String {
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
fn trusted(judged: &Judged) -> String {
    match judged.trusted_mm() {
        Some(mm) => format!("lengths can be trusted to {mm:.4} mm"),
        None => "lengths cannot be trusted to any tolerance before that is settled".to_owned(),
    }
}

/// What the verdict means for somebody who must decide.
fn advice(judged: &Judged) -> String {
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

/// The pairs by their largest held-out error, the worst first.
pub fn worst_first(judged: &Judged) -> Vec<usize> {
    let pairs = &judged.accuracy.pairs;
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    order.sort_by(|&a, &b| pairs[b].max_abs_error_mm.total_cmp(&pairs[a].max_abs_error_mm));
    order
}

/// The report, with pictures of some pairs.
pub fn page(calibration: &Calibration, judged: &Judged, corners: &Corners, pictures: &[PairPicture]) -> Result<String> {
    let tone = match judged.verdict {
        Verdict::Pass => Tone::Good,
        Verdict::Undecided => Tone::Doubtful,
        Verdict::Fail => Tone::Bad,
    };
    let content = html! {
        (page::verdict(tone, word(judged.verdict), &format!("{}. {}", explanation(judged), advice(judged))))
        (ledger(judged))
        @if !judged.advice.is_empty() { p { "What to photograph next, before anything below is relied on:" } (page::warnings(&judged.advice)) }
        @if !judged.warnings.is_empty() { p { "What else to know:" } }
        (page::warnings(&judged.warnings))
        (scale(judged))
        h2 { "Lengths on pairs that the cameras had not seen" }
        (lengths(judged)?)
        h2 { "Pairs, the worst first" }
        (pairs(calibration, judged))
        (pair_picture::section(pictures))
        h2 { "What the model leaves of the corners" }
        (residuals(calibration, judged)?)
        (blur::section(corners))
        h2 { "The cameras and the rig" }
        (in_space(calibration, judged))
        (parameters(calibration))
        (lenses(calibration))
        (disagreements(judged))
        h2 { "How uncertain a length is over the working volume" }
        (volume(judged)?)
    };
    let total = calibration.views.len() + calibration.skipped.len();
    let board = &calibration.board;
    let lead = format!(
        "{} of {total} pairs of a board of {} squares of {} mm; {} lens, board {}",
        calibration.views.len(),
        board.squares,
        board.square_mm,
        calibration.rig().left.lens.name(),
        if calibration.layout.shape { "free to be bowed" } else { "flat" }
    );
    Ok(page::page("Camera check", &lead, &content))
}

/// The ledger: what was looked at, what was found, up to where it allows a pass, and what it means.
fn ledger(judged: &Judged) -> Markup {
    let class = |verdict| match verdict {
        Verdict::Pass => "allows good",
        Verdict::Undecided => "allows doubtful",
        Verdict::Fail => "allows bad",
    };
    let cell = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), evidence::number);
    html! {
        h2 { "What the verdict rests on" }
        p { (format!("No verdict is better than its worst line; this one is {}; {}.", deciding(judged), trusted(judged))) }
        div.wide { table.ledger {
            thead { tr { th { "what" } th { "value" } th { "limit" } th { "unit" } th { "allows" } th { "detail" } } }
            tbody { @for line in &judged.evidence { tr {
                td { (line.what) }
                td { (cell(line.value)) }
                td { (cell(line.limit)) }
                td { (line.unit) }
                td { span class=(class(line.allows)) { (word(line.allows).to_lowercase()) } }
                td.detail { (page::text(&line.detail)) }
            } } }
        } }
    }
}

/// What the figures do not show: the scale.
fn scale(judged: &Judged) -> Markup {
    html! {
        @match &judged.second {
            Some(second) => p {
                @match (second.scale_error, second.scale_error_sigma, second.max_abs_error_mm) {
                    (Some(scale), Some(sigma), Some(error)) => (format!(
                        "The second board, which calibrated nothing, comes out too large by {:.1} +- {:.1} parts in a million (k = 2); its worst length over \
                         {} pairs is off by {error:.4} mm.",
                        1e6 * scale, 2e6 * sigma, second.pairs)),
                    _ => "A second board was asked for, and no length on it could be measured.",
                }
            }
            None => p {
                "The scale of every length is the pitch of the board that calibrated: an error of its pitch is invisible in these figures. \
                 A second board of known pitch shows it: " code { "--check-images DIR" } "."
            }
        }
    }
}

/// Fig. 6 of the paper, (a) to (d).
fn lengths(judged: &Judged) -> Result<Markup> {
    let accuracy = &judged.accuracy;
    let [long, _] = accuracy.long_mm;
    let [short, _] = accuracy.short_mm;
    let every = every_length(accuracy);
    let guard = |plot: Plot| plot.hline(judged.tolerance_mm, "tolerance").hline(-judged.tolerance_mm, "");
    let a =
        guard(Plot::new(&format!("(a) Errors of all lengths of {long} mm"), "pair", "error, mm").points("", &every))
            .svg()?;
    let mean = |of: fn(&HeldOutPair) -> Option<f64>| -> Vec<(f64, f64)> {
        accuracy.pairs.iter().enumerate().filter_map(|(i, p)| Some((i as f64 + 1.0, of(p)?))).collect()
    };
    let b = Plot::new("(b) Mean error of every pair", "pair", "mean error, mm")
        .points(&format!("x {short} mm"), &mean(|p| p.mean_error_x_short_mm))
        .points(&format!("y {short} mm"), &mean(|p| p.mean_error_y_short_mm))
        .points(&format!("x {long} mm"), &mean(|p| p.mean_error_x_long_mm))
        .points(&format!("y {long} mm"), &mean(|p| p.mean_error_y_long_mm))
        .svg()?;
    let range_plot = |title: &str, along: Axis| {
        let of = |y: fn(&Range) -> f64| -> Vec<(f64, f64)> {
            accuracy.ranges.iter().filter(|r| r.axis == along).map(|r| (r.nominal_mm, y(r))).collect()
        };
        let bars: Vec<(f64, f64, f64)> = accuracy
            .ranges
            .iter()
            .filter(|r| r.axis == along)
            .map(|r| (r.nominal_mm, r.mean_error_mm, r.std_mm))
            .collect();
        guard(
            Plot::new(title, "range, mm", "error, mm")
                .error_bars("mean and std", &bars)
                .line("max |error|", &of(|r| r.max_abs_error_mm)),
        )
        .svg()
    };
    let c = range_plot("(c) Every range along x", Axis::X)?;
    let d = range_plot("(d) Every range along y", Axis::Y)?;
    Ok(html! {
        div.side {
            (page::figure(&a, "Pair after pair, x before y; of very many lengths the worst of each few are drawn. Steps between pairs are calibration, the width of the band is corner noise."))
            (page::figure(&b, "A pair far from the others was moved, blurred or hit from the side by light; a mean that grows with the range is a scale."))
        }
        div.side {
            (page::figure(&c, "A mean that bends with the range is a lens or a board's shape that the model lacks."))
            (page::figure(&d, "Errors that do not grow with the range come from the corners, not from the rig."))
        }
    })
}

/// Fig. 6 (a): all long lengths, spread over their pair's number. Of more than can be told apart the worst of every few stay.
fn every_length(accuracy: &Accuracy) -> Vec<(f64, f64)> {
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

fn pairs(calibration: &Calibration, judged: &Judged) -> Markup {
    let rows: Vec<Vec<String>> = worst_first(judged)
        .iter()
        .map(|&i| {
            let pair = &judged.accuracy.pairs[i];
            let view = &calibration.views[i];
            let rms = |side| {
                crate::stereo::data::residuals::rms_px(
                    &calibration.values.shared,
                    &calibration.values.poses[i],
                    view,
                    side,
                )
            };
            vec![
                pair.pair.clone(),
                number(Some(pair.max_abs_error_mm), 4),
                number(pair.mean_error_x_long_mm, 4),
                number(pair.mean_error_y_long_mm, 4),
                number(Some(pair.gap_rms_mm), 4),
                number(rms(Side::Left), 3),
                number(rms(Side::Right), 3),
                view.active(Side::Left).count().to_string(),
                view.active(Side::Right).count().to_string(),
                view.observations.iter().filter(|o| !o.active).count().to_string(),
            ]
        })
        .collect();
    let header = [
        "pair",
        "max |error| mm",
        "mean x mm",
        "mean y mm",
        "ray gap mm",
        "left px",
        "right px",
        "corners left",
        "right",
        "outliers",
    ];
    let skipped: Vec<Vec<String>> =
        calibration.skipped.iter().map(|s| vec![s.pair.clone(), s.reason.clone()]).collect();
    html! {
        div.scroll { (page::table(&header, &rows)) }
        @if !skipped.is_empty() { h2 { "Pairs that were not used" } (page::table(&["pair", "why"], &skipped)) }
    }
}

fn residuals(calibration: &Calibration, judged: &Judged) -> Result<Markup> {
    let rig = calibration.rig();
    let mut figures = Vec::new();
    for (field, camera) in judged.residual_pattern.fields.iter().zip([&rig.left, &rig.right]) {
        figures.push(field_figure(field, camera.width, camera.height)?);
    }
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
                calibration.rms_px,
                noise.typical_px(&calibration.views),
                judged.residual_pattern.neighbours.along,
                judged.residual_pattern.neighbours.standard_error))
        }
        div.side { @for (svg, caption) in &figures { (page::figure(svg, caption)) } }
    })
}

/// Mean residuals over one picture, magnified, and which cells have seen corners.
fn field_figure(field: &Field, width: u32, height: u32) -> Result<(String, String)> {
    let longest = field.cells.iter().map(|c| c.mean_px[0].hypot(c.mean_px[1])).fold(0.0, f64::max);
    let cell = f64::from(width) / (field.cells.len() as f64).sqrt();
    let magnify = if longest > 0.0 { 0.8 * cell / longest } else { 1.0 };
    let arrows: Vec<[f64; 4]> = field
        .cells
        .iter()
        .filter(|c| c.corners > 0)
        .map(|c| [c.x_px, c.y_px, magnify * c.mean_px[0], magnify * c.mean_px[1]])
        .collect();
    let empty: Vec<(f64, f64)> = field.cells.iter().filter(|c| c.corners == 0).map(|c| (c.x_px, c.y_px)).collect();
    let svg = Plot::new(&format!("Mean residuals, {} picture", field.side), "x, px", "y, px")
        .vectors("", &arrows)
        .points("no corner", &empty)
        .x_range(-0.5, f64::from(width) - 0.5)
        .y_range(-0.5, f64::from(height) - 0.5)
        .y_down()
        .equal_axes()
        .svg()?;
    let seen = field.cells.iter().filter(|c| c.corners > 0).count();
    let caption = format!(
        "Arrows are {magnify:.0} times too long; the longest is {longest:.4} px, the systematic part {:.4} px. Arrows that turn or point outward together \
         are a lens that the model lacks. Corners reached {seen} of {} cells; what lies in the others is extrapolated.",
        field.systematic_px,
        field.cells.len()
    );
    Ok((svg, caption))
}

/// Cameras and boards as they stood.
fn in_space(calibration: &Calibration, judged: &Judged) -> Markup {
    let mut scene = Scene::default();
    rig::cameras(&mut scene, calibration.rig(), calibration.rig().baseline_mm() / 2.0);
    let order = worst_first(judged);
    for (i, pose) in calibration.values.poses.iter().enumerate() {
        let ink = match i {
            _ if order.first() == Some(&i) => Ink::Bad,
            _ if order.last() == Some(&i) => Ink::Good,
            _ => Ink::Plain,
        };
        rig::board(&mut scene, ink, &calibration.board, pose);
    }
    scene.figure(
        "cameras and boards",
        "Both cameras and the boards of all pairs; the worst pair's in red, the best one's in green. Where no board stood, nothing was checked.",
    )
}

fn parameters(calibration: &Calibration) -> Markup {
    let layout = &calibration.layout;
    let values = layout.numbers(&calibration.values.shared);
    let covariance = &calibration.uncertainty.shared;
    let rows: Vec<Vec<String>> = layout
        .names()
        .into_iter()
        .enumerate()
        .map(|(i, name)| std::iter::once(name).chain(with_sigma(values[i], covariance[(i, i)].sqrt())).collect())
        .collect();
    html! { div.scroll { (page::table(&["number", "value", "standard deviation"], &rows)) } }
}

fn lenses(calibration: &Calibration) -> Markup {
    let rows: Vec<Vec<String>> = calibration
        .lens_scores
        .iter()
        .map(|s| {
            let px = s.held_out_rms_px.map_or("-".to_owned(), |px| format!("{px:.5}"));
            vec![s.model.to_owned(), px]
        })
        .collect();
    html! {
        @if !rows.is_empty() {
            p { "Lens models on pairs they had not seen. The simplest within two standard errors of the best was taken; those without a figure promise nothing beyond chance, or these pairs do not determine them." }
            (page::table(&["lens", "held-out residual px"], &rows))
        }
    }
}

fn disagreements(judged: &Judged) -> Markup {
    let rows: Vec<Vec<String>> = judged
        .disagreements
        .iter()
        .map(|d| {
            let [x, y, z] = d.translation_change_mm;
            vec![
                d.name(),
                format!("{:.4}", d.length_change_mm),
                format!("{:.0}", d.chi_square_fall),
                format!("{:.0}", d.chance),
                format!("{x:.3}, {y:.3}, {z:.3}"),
            ]
        })
        .collect();
    let header = ["model", "lengths change by mm", "chi-squared falls by", "chance", "baseline vector mm"];
    html! {
        @if !rows.is_empty() {
            p {
                "Models that the corners admit and that measure other lengths. The standard deviations above hold only if lens and board are what they were taken \
                 for; the truth may lie anywhere between these models, and lengths with it."
            }
            (page::table(&header, &rows))
        }
    }
}

fn volume(judged: &Judged) -> Result<Markup> {
    let lying = |axis: usize| judged.volume.lengths.iter().filter(move |l| l.direction[axis] > 0.99);
    let along = |axis: usize| -> Vec<(f64, f64)> { lying(axis).map(|l| (l.at_mm.z, l.sigma_mm())).collect() };
    let svg = Plot::new(
        &format!("Standard deviation of a length of {} mm", judged.volume.length_mm),
        "distance from the left camera, mm",
        "mm",
    )
    .points("along x", &along(0))
    .points("along y", &along(1))
    .points("along z", &along(2))
    .svg()?;
    let worst = |axis: usize| lying(axis).map(|l| l.sigma_mm()).fold(0.0, f64::max);
    let caption = format!(
        "{} lengths in the volume in which the boards stood, as far as both cameras see them; corner noise at both ends and the calibration together. The worst: \
         {:.4} mm across, {:.4} mm along the line of sight.",
        judged.volume.lengths.len(),
        worst(0).max(worst(1)),
        worst(2)
    );
    Ok(page::figure(&svg, &caption))
}
