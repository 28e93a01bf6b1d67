//! `recheck.html` and the lines on stdout: whether the rig still stands, what the pairs would have shown, and how it
//! stood before.

use maud::{Markup, html};

use super::Result;
use super::drawing::figure::Plot;
use super::page::{self, Tone};
use super::table::{Table, with_sigma};
use crate::diagnostic::{count, short, two_digits};
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
fn sentence(recheck: &Recheck, standing: Standing, tolerance_mm: f64, mm: fn(f64) -> String) -> String {
    let length = short(recheck.length_mm);
    if let Some((contradicted, _)) = standing.contradicted(recheck) {
        return contradicted;
    }
    let found = match recheck.change {
        None => recheck.statement(),
        Some(_) => format!("{}, which moves a length by only {} mm", recheck.statement(), mm(recheck.effect_mm)),
    };
    match standing {
        Standing::OwnData => {
            "the calibration was made of these pairs, which agree with it whatever happened since".to_owned()
        }
        Standing::StillValid | Standing::Undecided => format!(
            "{found}; {} pairs would have shown a change that moves a length of {length} mm by {} mm, tolerance {tolerance_mm} mm",
            recheck.pairs.len(),
            mm(recheck.seen_mm)
        ),
        Standing::ChangedWithin | Standing::Changed => format!(
            "{}, which moves a length of {length} mm by up to {} mm, tolerance {tolerance_mm} mm",
            recheck.statement(),
            mm(recheck.effect_mm)
        ),
    }
}

/// By how much a cause changed, and within what: as many digits as that deserves.
fn changed(cause: &CauseSeen) -> [String; 2] {
    let [amount, within] = with_sigma(cause.amount, 2.0 * cause.sigma);
    [format!("{amount} {}", cause.unit), within]
}

/// What to do next.
fn next(standing: Standing, recheck: &Recheck) -> &'static str {
    match standing {
        Standing::Undecided if recheck.strays.len() == recheck.pairs.len() => {
            "look at the pictures, then take three pairs of the board that calibrated: they say whether the rig changed"
        }
        Standing::Undecided if !recheck.strays.is_empty() => {
            "clamp the cameras, and take three pairs more as the rig stands now: they say whether it moved"
        }
        Standing::StillValid => "go on with this calibration: it is as good as it was",
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
        format!("{}: {}", word(standing), sentence(recheck, standing, tolerance_mm, |mm| format!("{mm:.4}"))),
        format!("{} of {} pairs compared", recheck.pairs.len(), recheck.pairs.len() + recheck.skipped.len()),
    ];
    lines.extend(
        recheck.skipped.iter().take(4).map(|skipped| format!("  without {}: {}", skipped.pair, skipped.reason)),
    );
    lines.push(format!("next: {}", next(standing, recheck)));
    let mut table = Table::new(["cause", "changed by", "+- (95 %)", "would be seen", "mm of a length"]);
    for cause in &recheck.causes {
        let [amount, within] = changed(cause);
        let seen = format!("{} {}", two_digits(cause.seen), cause.unit);
        table.row([cause.words.clone(), amount, within, seen, two_digits(cause.seen_mm)]);
    }
    format!(
        "{}\n\n{table}\n{} in {}\nreport: {}\n",
        lines.join("\n"),
        count(checks, "check"),
        out.join(crate::formats::recheck::HISTORY),
        out.join("recheck.html")
    )
}

/// The report. Also shows the run's `warnings`.
pub fn page(
    recheck: &Recheck,
    standing: Standing,
    tolerance_mm: f64,
    checks: &[Check],
    warnings: &[String],
) -> Result<String> {
    let (effect_mm, of_effect) = match standing.contradicted(recheck) {
        Some((_, off_mm)) => (off_mm, "error of a length by pairs that contradict"),
        None => (recheck.effect_mm, "change of a length beyond chance"),
    };
    let numbers = [
        (format!("{} mm", two_digits(effect_mm)), of_effect),
        (format!("{} mm", two_digits(recheck.seen_mm)), "would have been seen"),
        (format!("{tolerance_mm} mm"), "tolerance"),
    ];
    let text = format!("{}. Next: {}.", sentence(recheck, standing, tolerance_mm, two_digits), next(standing, recheck));
    let rows = recheck.causes.iter().map(|cause| {
        let [amount, within] = changed(cause);
        let [effect_mm, seen, seen_mm] = [cause.effect_mm, cause.seen, cause.seen_mm].map(two_digits);
        [cause.words.clone(), amount, within, effect_mm, format!("{seen} {}", cause.unit), seen_mm]
    });
    let content = html! {
        (page::verdict(tone(standing), word(standing), &numbers, &text))
        (page::warnings(warnings))
        h2 { "What may have changed" }
        p { "Each cause by itself, and the smallest change of it that nineteen of twenty such checks see. Of causes that move the same corners the same way \
             all show a change where one did." }
        (page::table(&header("moves a length by, mm"), rows))
        (history(checks, tolerance_mm, "Change of a length", "the calibration no longer holds, or pairs contradict it")?)
    };
    let lead =
        compared(recheck.pairs.len(), "pair", standing, ["the calibration", "the calibration that was made of them"]);
    Ok(page::page("Is the rig still the calibrated one?", &lead, &content))
}

/// Of the table of causes.
pub(super) fn header(moves: &str) -> [&str; 6] {
    ["cause", "changed by, if it alone did", "+- (95 %)", moves, "would be seen", "would move it by, mm"]
}

/// What was compared with what: of `names` the second is for data that it was made of.
pub(super) fn compared(found: usize, noun: &str, standing: Standing, [name, of_own]: [&str; 2]) -> String {
    match standing {
        Standing::OwnData => format!("{} against {of_own}", count(found, noun)),
        _ => format!("{} against {name}", count(found, &format!("new {noun}"))),
    }
}

/// The changes of all checks over their number; where nothing changed there is none. `beyond`: what a change above the
/// tolerance means.
pub(super) fn history(checks: &[Check], tolerance_mm: f64, title: &str, beyond: &str) -> Result<Markup> {
    let over = |of: fn(&Check) -> f64| checks.iter().enumerate().map(move |(i, check)| ((i + 1) as f64, of(check)));
    let svg = Plot::new(title, "check", "mm")
        .whole_x()
        .points("changed by", over(|check| check.effect_mm))
        .points("would have been seen", over(|check| check.seen_mm))
        .hline(tolerance_mm, "tolerance")
        .log_y()
        .svg()?;
    let caption = format!(
        "Each check in this folder's history: a change above what would have been seen is none of chance, above the tolerance {beyond}. A check that \
         found no change has the dot of what it would have seen alone."
    );
    Ok(html! { h2 { "Over time" } (page::figure(&svg, &caption)) })
}
