//! `camera-check.html` and the table on stdout: can this rig be trusted, and why.

mod figures;
mod summary;

use crate::diagnostic::{Warning, aligned, at_most, capital, two_digits};
use crate::imaging::Corners;
use crate::report::drawing::pair_picture::{self, PairPicture};
use crate::report::drawing::scene::{Ink, Scene};
use crate::report::page::{self, Tone};
use crate::report::table::{number, with_sigma};
use crate::report::{Result, blur, rig};
use crate::stereo::Side;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::residuals::rms_px;
use crate::stereo::judge::assessment::Judged;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::lengths::held_out::HeldOutPair;
use crate::stereo::judge::verdict::Verdict;
use maud::{Markup, html};

use self::figures::{lengths, residuals, volume};
pub use self::summary::summary;
use self::summary::{advice, deciding_by, word};
pub use crate::report::blur::warning as blurred;

/// The pairs by their largest held-out error, the worst first.
pub fn worst_first(judged: &Judged) -> Vec<usize> {
    let pairs = &judged.facts.accuracy.pairs;
    let mut order: Vec<usize> = (0..pairs.len()).collect();
    let worst = |i: usize| pairs[i].max_abs_error_mm.unwrap_or(-1.0);
    order.sort_by(|&a, &b| worst(b).total_cmp(&worst(a)));
    order
}

/// What was found over the pairs: of the board, or of what happened during the series.
fn found(judged: &Judged, of_board: bool) -> Vec<String> {
    let findings = judged.facts.findings.iter().filter(|finding| finding.is_of_board() == of_board);
    findings.map(|finding| finding.action.clone()).collect()
}

/// Warnings with their reasons, but for those that stand in the table of checks.
fn warnings(judged: &Judged) -> Vec<String> {
    let is_new = |warning: &&Warning| judged.evidence.iter().all(|line| line.detail != warning.reason);
    // Of what stands among the things to do only the reason is new.
    let next = summary::next(judged);
    let said = |warning: &Warning| match next.contains(&warning.text.as_str()) {
        true => warning.reason.clone(),
        false => warning.whole(),
    };
    judged.warnings.iter().filter(is_new).map(said).filter(|said| !said.is_empty()).collect()
}

/// What the terminal says of the page, said on it.
fn on_this_page(said: &str) -> String {
    said.replace(" in camera-check.html", " below")
}

/// The report, with pictures of some pairs.
pub fn page(calibration: &Calibration, judged: &Judged, corners: &Corners, pictures: &[PairPicture]) -> Result<String> {
    let tone = match judged.verdict {
        Verdict::Pass => Tone::Good,
        Verdict::Undecided => Tone::Doubtful,
        Verdict::Fail => Tone::Bad,
    };
    let next: Vec<String> = summary::next(judged).into_iter().map(on_this_page).collect();
    let warnings = warnings(judged);
    let content = html! {
        (page::verdict(tone, word(judged.verdict), &numbers(judged), &format!("{} {}.", advice(judged), capital(&deciding_by(judged, Evidence::short_figure)))))
        @if !next.is_empty() { p { "What to do next:" } (page::warnings(&next)) }
        @for (heading, of_board) in [("What happened during the series:", false), ("What was found of the board:", true)] {
            @let found = found(judged, of_board);
            @if !found.is_empty() { p { (heading) } (page::warnings(&found)) }
        }
        (ledger(judged))
        @if !warnings.is_empty() { p { "What else to know:" } }
        (page::warnings(&warnings))
        (scale(judged))
        h2 { "Lengths on held-out pairs" }
        (lengths(judged)?)
        h2 { "Pairs, the worst first" }
        (pairs(calibration, judged))
        (pair_picture::section(pictures))
        h2 { "Residuals of the corners" }
        (residuals(calibration, judged)?)
        (blur::section(corners))
        h2 { "Where the boards were" }
        p { "The verdict is " (summary::volume(judged)) "." }
        (in_space(calibration, judged))
        h2 { "The cameras and the rig" }
        (parameters(calibration))
        (lenses(calibration))
        (disagreements(judged))
        h2 { "How uncertain a length is over the working volume" }
        (volume(judged)?)
    };
    let total = calibration.views.len() + calibration.skipped.len();
    let board = &calibration.board;
    let lead = format!(
        "{} of {total} pairs of a board of {}; {} lens, board {}",
        calibration.views.len(),
        board.said(),
        calibration.rig().left.lens.name(),
        if calibration.layout.shape { "free to be bowed" } else { "flat" }
    );
    Ok(page::page("Camera check", &lead, &content))
}

/// The three numbers of the verdict.
fn numbers(judged: &Judged) -> [(String, String); 3] {
    let (extremes, tolerance_mm) = (&judged.facts.accuracy.extremes, judged.facts.tolerance_mm);
    let mm = |value: f64| format!("{} mm", two_digits(value));
    [
        (
            mm(extremes.one_in_twenty_mm),
            "95 % of lengths on pairs left out of the calibration are within this".to_owned(),
        ),
        (mm(extremes.max_abs_error_mm), "largest error of such a length".to_owned()),
        match judged.trusted_mm() {
            Some(_) if judged.measures_nothing() => (
                "no length".to_owned(),
                "can be trusted: what they may be off by is more than a tenth of them".to_owned(),
            ),
            Some(trusted_mm) => (
                format!("{} mm", at_most(trusted_mm, tolerance_mm)),
                format!("{} can be trusted to this; the tolerance is {tolerance_mm} mm", summary::lengths(judged)),
            ),
            None => (
                "not known".to_owned(),
                format!(
                    "what lengths can be trusted to, as long as a check is open; the tolerance is {tolerance_mm} mm"
                ),
            ),
        },
    ]
}

/// The checks that are not passed; folded, all of them: what was looked at, what was found, up to where it allows a
/// pass, what it means.
fn ledger(judged: &Judged) -> Markup {
    // What stands among the things to do is not said again.
    let next = summary::next(judged);
    let with_remedy = |line: &Evidence| match line.remedy.is_empty() || next.contains(&&*line.remedy) {
        true => line.detail.clone(),
        false => format!("{}. To do: {}", line.detail, on_this_page(&line.remedy)),
    };
    let below: Vec<&Evidence> = judged.evidence.iter().filter(|line| line.allows != Verdict::Pass).collect();
    html! {
        @if !below.is_empty() {
            h2 { "Checks that are not passed" }
            (lines(&below, &with_remedy))
        }
        (page::details(
            &format!("All {} checks", judged.evidence.len()),
            &lines(&judged.evidence.iter().collect::<Vec<_>>(), &|line| line.detail.clone()),
        ))
    }
}

fn lines(evidence: &[&Evidence], detail: &dyn Fn(&Evidence) -> String) -> Markup {
    let class = |verdict| match verdict {
        Verdict::Pass => "allows good",
        Verdict::Undecided => "allows doubtful",
        Verdict::Fail => "allows bad",
    };
    let cell = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    html! {
        div.wide { table.ledger {
            thead { tr { th { "what" } th { "value" } th { "limit" } th { "unit" } th { "result" } th { "detail" } } }
            tbody { @for line in evidence { @let [value, limit] = line.rounded(); tr {
                td { (line.name()) }
                td { (cell(value)) }
                td { (cell(limit)) }
                td { (line.unit) }
                td { span class=(class(line.allows)) { (word(line.allows).to_lowercase()) } }
                td.detail { (page::text(&detail(line))) }
            } } }
        } }
    }
}

/// What the figures do not show: the scale.
fn scale(judged: &Judged) -> Markup {
    html! {
        @for known in &judged.facts.standards.moves.measured { p { (capital(&known.statement())) "." } }
        @match &judged.facts.standards.second {
            Some(second) => p {
                @match (second.scale_error, second.scale_error_sigma, second.max_abs_error_mm) {
                    (Some(scale), Some(sigma), Some(error)) => (format!(
                        "The second board, which took no part in the calibration, comes out too large by {:.1} +- {:.1} parts in a million (k = 2); its worst length over \
                         {} pairs is off by {} mm.",
                        1e6 * scale, 2e6 * sigma, second.pairs, two_digits(error))),
                    _ => "A second board was asked for, and no length on it could be measured.",
                }
            }
            None if !judged.facts.standards.moves.measured.is_empty() => {}
            None => p {
                "The scale of every length is that of the board: an error of its pitch does not show in these figures. A second board of known pitch checks it: " code { "--check-images DIR" } "; or a slide of the board by a known length: " code { "--known-move MM" } "."
            }
        }
    }
}

fn pairs(calibration: &Calibration, judged: &Judged) -> Markup {
    let order = worst_first(judged);
    let column = |of: fn(&HeldOutPair) -> Option<f64>| {
        aligned(&order.iter().map(|&i| of(&judged.facts.accuracy.pairs[i])).collect::<Vec<_>>())
    };
    let errors = [
        column(|pair| pair.max_abs_error_mm),
        column(|pair| pair.mean_error_x_long_mm),
        column(|pair| pair.mean_error_y_long_mm),
        column(|pair| pair.gap_rms_mm),
    ];
    let values = &calibration.values;
    let row = |(row, &i): (usize, &usize)| {
        let view = &calibration.views[i];
        let rms = Side::BOTH.map(|side| number(rms_px(&values.shared, &values.poses[i], view, side), 3));
        let corners = Side::BOTH.map(|side| view.active(side).count().to_string());
        let outliers = view.observations.iter().filter(|o| !o.active).count();
        let errors = errors.each_ref().map(|column| column[row].clone());
        let name = judged.facts.accuracy.pairs[i].pair.clone();
        std::iter::once(name).chain(errors).chain(rms).chain(corners).chain([outliers.to_string()])
    };
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
    let skipped = calibration.skipped.iter().map(|s| [s.pair.clone(), s.reason.clone()]);
    html! {
        div.scroll { (page::table(&header, order.iter().enumerate().map(row))) }
        @if !calibration.skipped.is_empty() { h2 { "Pairs that were not used" } (page::table(&["pair", "why"], skipped)) }
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
    rig::volume(&mut scene, &calibration.rig().left, &judged.facts.volume.volume);
    scene.figure(
        "cameras, boards and the volume of the verdict",
        "Both cameras, the boards of all pairs (the worst pair's in red, the best one's in green) and, as two outlines joined by lines, the \
         volume that the verdict is for. Nothing was checked outside of it: measure there only after pairs with the board there.",
    )
}

fn parameters(calibration: &Calibration) -> Markup {
    let layout = &calibration.layout;
    let values = layout.numbers(&calibration.values.shared);
    let covariance = &calibration.covariance;
    let row = |(i, name): (usize, String)| {
        let [value, sigma] = with_sigma(values[i], covariance[(i, i)].sqrt());
        [name, value, sigma]
    };
    let mut rows: Vec<[String; 3]> = layout.names().into_iter().enumerate().map(row).collect();
    // How the cameras stand to each other first: lenses are known from elsewhere, too.
    rows.sort_by_key(|row| !row[0].starts_with("right_from_left"));
    let rig = calibration.rig();
    html! {
        p {
            "Baseline " (number(Some(rig.baseline_mm()), 3)) " mm, the right camera turned by "
            (number(Some(rig.right_from_left.rotation.angle().to_degrees()), 3)) " degrees against the left one. A point in the left camera's frame is brought into the right \
             one's by " code { "right_from_left" } "."
        }
        (page::table(&["number", "value", "standard deviation"], rows))
    }
}

fn lenses(calibration: &Calibration) -> Markup {
    let rows = calibration.lens_scores.iter().map(|s| {
        let px = s.held_out_rms_px.map_or("-".to_owned(), |px| format!("{px:.5}"));
        [s.model.to_owned(), px]
    });
    html! {
        @if !calibration.lens_scores.is_empty() {
            p { "Lens models on held-out pairs. The simplest within two standard errors of the best was taken; those without a figure give no significant gain, or these pairs do not determine them." }
            (page::table(&["lens", "held-out residual px"], rows))
        }
    }
}

fn disagreements(judged: &Judged) -> Markup {
    let rows = judged.facts.disagreements.iter().map(|d| {
        let [x, y, z] = d.translation_change_mm;
        let [fall, chance] = [d.chi_square_fall, d.chance].map(|value| format!("{value:.0}"));
        [d.name(), two_digits(d.length_change_mm), fall, chance, format!("{x:.3}, {y:.3}, {z:.3}")]
    });
    let header = ["model", "lengths change by mm", "chi-squared falls by", "chance", "baseline vector mm"];
    html! {
        @if !judged.facts.disagreements.is_empty() {
            p {
                "Other models that fit the corners, and that give other lengths. The standard deviations above hold only if lens and board are what they were taken \
                 for; the truth may lie anywhere between these models, and lengths with it."
            }
            (page::table(&header, rows))
        }
    }
}
