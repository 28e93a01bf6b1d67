//! `camera-check.html` and the table on stdout: can this rig be trusted, and why.

mod figures;
mod summary;

use crate::diagnostic::Warning;
use crate::imaging::Corners;
use crate::report::Result;
use crate::report::blur;
use crate::report::drawing::pair_picture::{self, PairPicture};
use crate::report::drawing::scene::{Ink, Scene};
use crate::report::page::{self, Tone};
use crate::report::rig;
use crate::report::table::{number, with_sigma};
use crate::stereo::Side;
use crate::stereo::calibrate::Calibration;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::evidence;
use crate::stereo::judge::verdict::Verdict;
use maud::{Markup, html};

use self::figures::{lengths, residuals, volume};
pub use self::summary::summary;
use self::summary::{advice, deciding, explanation, trusted, word};

/// The pairs by their largest held-out error, the worst first.
pub fn worst_first(judged: &Judged) -> Vec<usize> {
    let pairs = &judged.accuracy.pairs;
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    let worst = |i: usize| pairs[i].max_abs_error_mm.unwrap_or(-1.0);
    order.sort_by(|&a, &b| worst(b).total_cmp(&worst(a)));
    order
}

/// Warnings with their reasons, but for those whose reason stands in the table of evidence.
fn warnings(judged: &Judged) -> Vec<String> {
    let said = |warning: &Warning| judged.evidence.iter().any(|line| line.detail == warning.reason);
    judged.warnings.iter().map(|warning| if said(warning) { warning.text.clone() } else { warning.whole() }).collect()
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
        (page::warnings(&warnings(judged)))
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
                number(pair.max_abs_error_mm, 4),
                number(pair.mean_error_x_long_mm, 4),
                number(pair.mean_error_y_long_mm, 4),
                number(pair.gap_rms_mm, 4),
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
