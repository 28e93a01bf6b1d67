//! `verify.html` and the lines on stdout: whether a robot still is the identified one, and what the poses would have shown.

use maud::html;

use super::Result;
use super::page;
use super::recheck::{history, tone, word};
use super::table::{Table, with_sigma};
use crate::diagnostic::{count, significant};
use crate::files::OutDir;
use crate::formats::recheck::{Check, Standing};
use crate::formats::robot_recheck::HISTORY;
use crate::identify::judge::recheck::{CauseSeen, Recheck};

fn sentence(recheck: &Recheck, tolerance_mm: f64) -> String {
    let statement = recheck.statement();
    match recheck.cause().is_empty() {
        true => format!(
            "{statement}; {} poses would have shown a single cause that moves the target by {:.4} mm, tolerance {tolerance_mm:.4} mm",
            recheck.poses.len(),
            recheck.seen_mm
        ),
        false => format!(
            "{statement}; the target is off by up to {:.4} mm, tolerance {tolerance_mm:.4} mm",
            recheck.effect_mm
        ),
    }
}

fn next(standing: Standing, recheck: &Recheck) -> &'static str {
    match standing {
        Standing::StillValid => "go on with this robot",
        Standing::Undecided => {
            "add poses that bend every joint and turn the wrist, or say with --tolerance-mm what matters: these would not have shown a change as large as the tolerance"
        }
        Standing::OwnData => {
            "measure ten new poses: the robot was identified from these, which agree with it whatever happened since"
        }
        _ if !recheck.changed => "`stereocal locate` finds the cameras anew; the robot stays",
        Standing::ChangedWithin => {
            "targets are within the tolerance still; look at what is named, and identify anew before it grows"
        }
        Standing::Changed => "look for what happened to arm, tool and cameras since, then identify anew",
    }
}

/// Cause, change, its interval, its effect, what would be seen and its effect.
fn cells(recheck: &Recheck) -> Vec<[String; 6]> {
    let of = |cause: &CauseSeen| {
        let with_unit = |value: f64| format!("{} {}", significant(value, 2), cause.unit);
        let changed = cause.amount.map(|amount| {
            let [amount, within] = with_sigma(amount, 2.0 * cause.sigma.unwrap_or(f64::NAN));
            [format!("{amount} {}", cause.unit), within]
        });
        let [changed, within] =
            changed.unwrap_or_else(|| ["not observable: the placement absorbs it".to_owned(), String::new()]);
        let told = |text: String| if cause.amount.is_some() { text } else { String::new() };
        [
            cause.what.clone(),
            changed,
            within,
            told(significant(cause.effect_mm, 2)),
            cause.seen.map_or_else(String::new, with_unit),
            told(cause.seen_mm.map_or_else(String::new, |mm| significant(mm, 2))),
        ]
    };
    let placements = recheck.placements.iter().map(|moved| {
        [
            format!("the cameras of group {}", moved.group),
            format!("{} mm", significant(moved.shift_mm, 2)),
            String::new(),
            significant(moved.shift_mm, 2),
            format!("{} mm", significant(moved.seen_mm, 2)),
            significant(moved.seen_mm, 2),
        ]
    });
    recheck.causes.iter().map(of).chain(placements).collect()
}

const HEADER: [&str; 6] =
    ["cause", "changed by, if it alone did", "+- (95 %)", "mm at the target", "would be seen", "mm at the target"];

/// The lines on stdout.
pub fn summary(recheck: &Recheck, standing: Standing, tolerance_mm: f64, checks: usize, out: &OutDir) -> String {
    let mut table = Table::new(HEADER);
    cells(recheck).into_iter().for_each(|row| table.row(row));
    format!(
        "{}: {}\nnext: {}\n\n{table}\n{} in {}\nreport: {}\n",
        word(standing),
        sentence(recheck, tolerance_mm),
        next(standing, recheck),
        count(checks, "check"),
        out.join(HISTORY),
        out.join("verify.html")
    )
}

/// The report.
pub fn page(recheck: &Recheck, standing: Standing, tolerance_mm: f64, checks: &[Check]) -> Result<String> {
    let numbers = vec![
        (format!("{:.4} mm", recheck.effect_mm), "movement of the target beyond chance".to_owned()),
        (format!("{:.4} mm", recheck.seen_mm), "would have been seen".to_owned()),
        (format!("{tolerance_mm:.4} mm"), "tolerance".to_owned()),
    ];
    let text = format!("{}. Next: {}.", sentence(recheck, tolerance_mm), next(standing, recheck));
    let rows: Vec<Vec<String>> = cells(recheck).into_iter().map(|row| row.to_vec()).collect();
    let content = html! {
        (page::verdict(tone(standing), word(standing), &numbers, &text))
        h2 { "What may have changed" }
        p { "Each cause by itself, and the smallest change of it that nineteen of twenty such checks see; mm at the pose where it moves the target most, \
             once the cameras' place was found anew. The zero of joint 1 is seen as cameras that moved." }
        div.wide { (page::table(&HEADER, &rows)) }
        h2 { "Over time" }
        (page::figure(&history(checks, tolerance_mm, "Movement of the target")?, "Each check in this folder's history: a dot above what would have been seen \
            is a change; above the tolerance the robot is no longer the identified one."))
    };
    let lead = format!("{} new poses against the identified robot", recheck.poses.len());
    Ok(page::page("Is it still the identified robot?", &lead, &content))
}
