//! `verify.html` and the lines on stdout: whether a robot still is the identified one, and what the poses would have
//! shown.

use maud::html;

use super::recheck::{compared, header, history, tone, word};
use super::table::{Table, number, with_sigma};
use super::{Result, page};
use crate::diagnostic::{count, two_digits};
use crate::files::OutDir;
use crate::formats::recheck::{Check, Standing};
use crate::formats::robot_recheck::HISTORY;
use crate::identify::judge::recheck::{CauseSeen, Recheck};
use crate::robot::Advice;

/// What was judged of the robot, and by which tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    pub standing: Standing,
    pub tolerance_mm: f64,
    /// What the robot's own file says of its use.
    pub advice: Advice,
    /// Whether the rows were mended for the check: they are not what their file says.
    pub is_mended: bool,
}

fn sentence(recheck: &Recheck, judged: Judged, mm: fn(f64) -> String) -> String {
    let Judged { standing, tolerance_mm, .. } = judged;
    if standing == Standing::OwnData {
        return "the robot was identified from these poses, which say nothing of what happened since".to_owned();
    }
    let tolerance = mm(tolerance_mm);
    let far_within =
        if recheck.changed && standing == Standing::StillValid { "far within the tolerance: " } else { "" };
    let mended = if judged.is_mended { "with the rows mended: " } else { "" };
    let statement = format!("{mended}{far_within}{}", recheck.statement());
    let of_rest = match recheck.is_open() {
        _ if recheck.is_unknown_here() => format!("{statement}, tolerance {tolerance} mm"),
        true => format!(
            "{statement}; these {} poses leave room for a single cause that moves the target by up to {} mm at them and {} mm elsewhere where the robot \
             was identified (95 %), tolerance {tolerance} mm, and see each one that moves it by {} mm at them in 19 of 20 such checks{}",
            recheck.poses.len(),
            mm(recheck.at_most_mm),
            mm(recheck.elsewhere_mm),
            mm(recheck.seen_mm),
            recheck.unseen().map_or_else(String::new, |unseen| format!(", and nothing of: {unseen}"))
        ),
        false => {
            // A cause by itself is said of the base; the table has what another placement does not take up of it.
            let base = if recheck.changed && !recheck.likeliest.is_empty() { " in the robot's base" } else { "" };
            match recheck.changed {
                true => format!(
                    "{statement}; the robot's change moves the target by up to {} mm{base}, tolerance {tolerance} mm",
                    mm(recheck.of_robot_mm)
                ),
                false => format!("{statement}; tolerance {tolerance} mm"),
            }
        }
    };
    recheck.of_strays().map_or(of_rest.clone(), |strays| format!("{strays}; without: {of_rest}"))
}

/// No single cause moves the target so far, mm, on an arm that still is that arm: it is another one.
const ANOTHER_ARM_MM: f64 = 50.0;

fn next(judged: Judged, recheck: &Recheck) -> &'static str {
    match judged.standing {
        Standing::StillValid if judged.advice == Advice::DoNotUse => {
            "identify anew: it is the same robot, and what was found of it is advised against"
        }
        Standing::StillValid if judged.is_mended => {
            "mend the file as the warning says, and check again (until then the status is 1): the robot still is that robot for rows that were mended"
        }
        Standing::StillValid if judged.advice == Advice::Check => {
            "it is the robot that was identified, and what its own `check` says of it stands: look at that, then go on with it"
        }
        Standing::StillValid => "go on with this robot",
        Standing::Undecided if !recheck.strays.is_empty() => {
            "take again what is named, its joints or its reading are those of another pose or misread, and check with that"
        }
        Standing::Undecided if !recheck.extrapolated.is_empty() => {
            "check with poses inside these ranges, or identify anew with poses of both"
        }
        Standing::Undecided if recheck.is_unknown_here() => {
            "identify anew with these poses beside the old ones: over them the robot is not known as well as was stated"
        }
        Standing::Undecided if recheck.scatters() => {
            "measure a pose twice: readings that differ are the instrument's, joint angles want their decimals, and what only differs after other motions is play; mend it, and check again"
        }
        Standing::Undecided => {
            "add poses spread over the workspace, which bend every joint and turn the wrist, or say with --tolerance-mm what matters: these do not rule out a change as large as the tolerance"
        }
        Standing::OwnData => "measure ten new poses",
        _ if !recheck.changed && !recheck.instead.is_empty() => {
            "add poses spread over the workspace, which bend every joint and turn the wrist, and check with them: they tell the robot from what measures it; until then use neither"
        }
        _ if !recheck.changed && !recheck.is_same() => {
            "`stereocal locate TABLE --robot IDENTIFIED --out DIR` finds the placement anew, `--placement DIR/placement.json` then checks with it; add poses spread over the workspace, which bend every joint and turn the wrist: they tell whether the robot stays"
        }
        _ if !recheck.changed && recheck.by_cameras => {
            "`stereocal locate TABLE --robot IDENTIFIED --out DIR` finds the cameras anew, `--placement DIR/placement.json` then checks with it; the robot stays"
        }
        _ if !recheck.changed => {
            "`stereocal locate TABLE --robot IDENTIFIED --out DIR` finds the instrument's placement anew, `--placement DIR/placement.json` then checks with it; the robot stays"
        }
        Standing::ChangedWithin => {
            "targets are within the tolerance still; look at what is named, and identify anew before it grows"
        }
        Standing::Changed if recheck.likeliest.is_empty() && recheck.effect_mm > ANOTHER_ARM_MM => {
            "look first whether the file is of the arm that was measured: no arm changes so much by itself; then identify anew"
        }
        Standing::Changed if recheck.by_cameras => {
            "look for what happened to arm, tool and cameras since, then identify anew"
        }
        Standing::Changed => "look for what happened to arm, tool and instrument since, then identify anew",
    }
}

/// Cause, change, its interval, its effect, what would be seen and its effect.
fn cells(recheck: &Recheck) -> Vec<[String; 6]> {
    let of = |cause: &CauseSeen| {
        let with_unit = |value: f64| format!("{} {}", two_digits(value), cause.unit);
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
            told(two_digits(cause.effect_mm)),
            cause.seen.map_or_else(String::new, with_unit),
            told(cause.seen_mm.map_or_else(String::new, two_digits)),
        ]
    };
    let placements = recheck.placements.iter().map(|moved| {
        let [shift, seen] = [moved.shift_mm, moved.seen_mm].map(two_digits);
        let placed =
            format!("the {} of group {}", if recheck.by_cameras { "cameras" } else { "instrument" }, moved.group);
        [placed, format!("{shift} mm"), String::new(), shift, format!("{seen} mm"), seen]
    });
    recheck.causes.iter().map(of).chain(placements).collect()
}

/// The same for a terminal of 80 columns: change with its interval, unit, its effect, what would be seen and its
/// effect.
fn lines(recheck: &Recheck) -> Table {
    let four = |value: f64| number(Some(value), 4);
    let mut table = Table::new(["cause", "changed by", "", "mm", "seen", "mm"]);
    for cause in &recheck.causes {
        let what = cause.what.trim_start_matches("the ").to_owned();
        let (Some(amount), Some(sigma)) = (cause.amount, cause.sigma) else {
            table.row([what, "not seen".to_owned()]);
            continue;
        };
        let [seen, seen_mm] = [cause.seen, cause.seen_mm].map(|value| value.map_or_else(String::new, four));
        let by = format!("{} +- {}", four(amount), four(2.0 * sigma));
        table.row([what, by, cause.unit.to_owned(), four(cause.effect_mm), seen, seen_mm]);
    }
    for moved in &recheck.placements {
        let what = format!("{} of group {}", if recheck.by_cameras { "cameras" } else { "instrument" }, moved.group);
        let [shift, seen] = [moved.shift_mm, moved.seen_mm].map(four);
        table.row([what, shift.clone(), "mm".to_owned(), shift, seen.clone(), seen]);
    }
    table
}

/// The lines on stdout.
pub fn summary(recheck: &Recheck, judged: Judged, checks: usize, out: &OutDir) -> String {
    format!(
        "{}: {}\nnext: {}\n\neach cause by itself, 95 % intervals; seen: from so much on; mm: at the target, once placed anew, which takes up a part\n{}\n{} in {}\nreport: {}\n",
        word(judged.standing),
        sentence(recheck, judged, |mm| format!("{mm:.4}")),
        next(judged, recheck),
        lines(recheck),
        count(checks, "check"),
        out.join(HISTORY),
        out.join("verify.html")
    )
}

/// The report. Also shows the run's `warnings`.
pub fn page(recheck: &Recheck, judged: Judged, checks: &[Check], warnings: &[String]) -> Result<String> {
    let Judged { standing, tolerance_mm, .. } = judged;
    let of_target = match recheck.is_open() {
        _ if recheck.is_unknown_here() => (recheck.missed_mm, "half of the poses miss the robot by this and more"),
        true => (recheck.room_mm(), "movement of the target that is not ruled out"),
        false => (recheck.effect_mm, "movement of the target beyond chance"),
    };
    let numbers = [of_target, (recheck.seen_mm, "would have been seen"), (tolerance_mm, "tolerance")]
        .map(|(mm, what)| (format!("{} mm", two_digits(mm)), what));
    let text = format!("{}. Next: {}.", sentence(recheck, judged, two_digits), next(judged, recheck));
    let (sensor, moved) = match recheck.by_cameras {
        true => ("once the cameras' place was found anew", "cameras that moved"),
        false => ("once the instrument's place was found anew", "an instrument that moved"),
    };
    let content = html! {
        (page::verdict(tone(standing), word(standing), &numbers, &text))
        (page::warnings(warnings))
        h2 { "What may have changed" }
        p { "Each cause by itself, and the smallest change of it that nineteen of twenty such checks see; mm at the pose where it moves the target most, \
             " (sensor) ". The zero of joint 1 is seen as " (moved) "." }
        (page::table(&header("moves the target by, mm"), cells(recheck)))
        (history(checks, tolerance_mm, "Movement of the target", "the robot is no longer the identified one")?)
    };
    let names = ["the identified robot", "the robot that was identified from them"];
    let lead = compared(recheck.poses.len(), "pose", standing, names);
    Ok(page::page("Is it still the identified robot?", &lead, &content))
}
