//! `recheck.html` and the lines on stdout: whether the rig still stands, what the pairs would have shown, and how it stood before.

use maud::html;

use super::Result;
use super::drawing::figure::Plot;
use super::page::{self, Tone};
use super::table::{Table, with_sigma};
use crate::diagnostic::{count, significant};
use crate::files::OutDir;
use crate::formats::recheck::{Check, Standing};
use crate::stereo::recheck::{CauseSeen, Recheck};

/// The verdict in words.
pub(super) fn word(standing: Standing) -> &'static str {
    match standing {
        Standing::StillValid => "STILL VALID",
        Standing::ChangedWithin => "CHANGED, WITHIN TOLERANCE",
        Standing::Undecided => "UNDECIDED",
        Standing::OwnData => "UNDECIDED, ITS OWN DATA",
        Standing::Changed => "CHANGED",
    }
}

/// How grave it is.
pub(super) fn tone(standing: Standing) -> Tone {
    match standing {
        Standing::StillValid => Tone::Good,
        Standing::ChangedWithin | Standing::Undecided | Standing::OwnData => Tone::Doubtful,
        Standing::Changed => Tone::Bad,
    }
}

/// What was found and what it means, in a sentence.
fn sentence(recheck: &Recheck, standing: Standing, tolerance_mm: f64) -> String {
    let length = recheck.length_mm;
    let found = match recheck.change {
        None => recheck.statement(),
        Some(_) => format!("{}, which moves a length by only {:.4} mm", recheck.statement(), recheck.effect_mm),
    };
    match standing {
        Standing::OwnData => {
            "the calibration was made of these pairs, which agree with it whatever happened since".to_owned()
        }
        Standing::StillValid | Standing::Undecided => format!(
            "{found}; {} pairs would have shown a change that moves a length of {length} mm by {:.4} mm, tolerance {tolerance_mm} mm",
            recheck.pairs.len(),
            recheck.seen_mm
        ),
        Standing::ChangedWithin | Standing::Changed => format!(
            "{}, which moves a length of {length} mm by up to {:.4} mm, tolerance {tolerance_mm} mm",
            recheck.statement(),
            recheck.effect_mm
        ),
    }
}

/// By how much a cause changed, and within what: as many digits as that deserves.
fn changed(cause: &CauseSeen) -> [String; 2] {
    let [amount, within] = with_sigma(cause.amount, 2.0 * cause.sigma);
    [format!("{amount} {}", cause.unit), within]
}

/// What to do next.
fn next(standing: Standing) -> &'static str {
    match standing {
        Standing::StillValid => "go on with this calibration",
        Standing::ChangedWithin => {
            "lengths are within the tolerance still; clamp the cameras, and calibrate anew before it grows"
        }
        Standing::Undecided => {
            "add pairs with the board elsewhere and tilted otherwise: these would not have shown a change as large as the tolerance"
        }
        Standing::OwnData => "take two or three new pairs of the board",
        Standing::Changed => "calibrate anew: what was measured since the rig changed is off by so much",
    }
}

/// The lines on stdout.
pub fn summary(recheck: &Recheck, standing: Standing, tolerance_mm: f64, checks: usize, out: &OutDir) -> String {
    let mut lines = vec![
        format!("{}: {}", word(standing), sentence(recheck, standing, tolerance_mm)),
        format!("{} of {} pairs compared", recheck.pairs.len(), recheck.pairs.len() + recheck.skipped.len()),
    ];
    lines.extend(
        recheck.skipped.iter().take(4).map(|skipped| format!("  without {}: {}", skipped.pair, skipped.reason)),
    );
    lines.push(format!("next: {}", next(standing)));
    let mut table = Table::new(["cause", "changed by", "+- (95 %)", "would be seen", "mm of a length"]);
    for cause in &recheck.causes {
        table.row([
            cause.words.clone(),
            changed(cause)[0].clone(),
            changed(cause)[1].clone(),
            format!("{} {}", significant(cause.seen, 2), cause.unit),
            significant(cause.seen_mm, 2),
        ]);
    }
    format!(
        "{}\n\n{table}\n{} in {}\nreport: {}\n",
        lines.join("\n"),
        count(checks, "check"),
        out.join(crate::formats::recheck::HISTORY),
        out.join("recheck.html")
    )
}

/// The report.
pub fn page(recheck: &Recheck, standing: Standing, tolerance_mm: f64, checks: &[Check]) -> Result<String> {
    let numbers = vec![
        (format!("{:.4} mm", recheck.effect_mm), "change of a length beyond chance".to_owned()),
        (format!("{:.4} mm", recheck.seen_mm), "would have been seen".to_owned()),
        (format!("{tolerance_mm} mm"), "tolerance".to_owned()),
    ];
    let text = format!("{}. Next: {}.", sentence(recheck, standing, tolerance_mm), next(standing));
    let rows: Vec<Vec<String>> = recheck
        .causes
        .iter()
        .map(|cause| {
            vec![
                cause.words.clone(),
                changed(cause)[0].clone(),
                changed(cause)[1].clone(),
                significant(cause.effect_mm, 2),
                format!("{} {}", significant(cause.seen, 2), cause.unit),
                significant(cause.seen_mm, 2),
            ]
        })
        .collect();
    let header =
        ["cause", "changed by, if it alone did", "+- (95 %)", "mm of a length", "would be seen", "mm of a length"];
    let content = html! {
        (page::verdict(tone(standing), word(standing), &numbers, &text))
        h2 { "What may have changed" }
        p { "Each cause by itself, and the smallest change of it that nineteen of twenty such checks see. Of causes that move the same corners the same way \
             all show a change where one did." }
        div.wide { (page::table(&header, &rows)) }
        h2 { "Over time" }
        (page::figure(&history(checks, tolerance_mm, "Change of a length")?, "Each check in this folder's history: a dot above what would have been seen is a change; \
            above the tolerance the calibration no longer holds."))
    };
    let lead = format!("{} new pairs against the calibration", recheck.pairs.len());
    Ok(page::page("Is the rig still the calibrated one?", &lead, &content))
}

/// The changes of all checks over their number.
pub(super) fn history(checks: &[Check], tolerance_mm: f64, title: &str) -> Result<String> {
    let over = |of: fn(&Check) -> f64| -> Vec<(f64, f64)> {
        checks.iter().enumerate().map(|(i, check)| ((i + 1) as f64, of(check))).collect()
    };
    Plot::new(title, "check", "mm")
        .whole_x()
        .points("changed by", &over(|check| check.effect_mm))
        .points("would have been seen", &over(|check| check.seen_mm))
        .hline(tolerance_mm, "tolerance")
        .svg()
}
