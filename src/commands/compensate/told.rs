//! What `compensate` says of its targets: the JSON file and the lines on the terminal.

use serde::Serialize;

use super::pair::Pair;
use crate::compensate::{Compensated, Target};
use crate::diagnostic::count;
use crate::formats::targets::Row;
use crate::programs::{Cause, Instruction};
use crate::robot::Check;

/// Length of the lists of refused targets and of motions that stay as they are on the terminal.
const MOST_SAID: usize = 20;

/// Corrections that turn a joint farther are said, deg: arms are off by fractions of a degree.
const FAR_TURN_DEG: f64 = 5.0;

/// What `compensate.json` says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Summary {
    targets: usize,
    /// Those with readings.
    compensated: usize,
    /// Mean distance of the real tool from where it was meant to be, without compensation, mm.
    before_mean_mm: Option<f64>,
    /// Largest.
    before_max_mm: Option<f64>,
    /// What an arm of fewer than six joints leaves of orientations at most, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    orientation_left_deg: Option<f64>,
    /// The tool that was used for both robots, in the last frame, mm; absent where each file has its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    tool_mm: Option<[f64; 3]>,
    /// What the run that found the robot says of its use.
    #[serde(skip_serializing_if = "Option::is_none")]
    check: Option<Check>,
    /// Those without.
    refused: Vec<Refused>,
    /// The correction that turns a joint farthest, where that is far.
    #[serde(skip)]
    far_turn: Option<String>,
    /// Of a program: every instruction that moves the robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    motions: Option<Vec<Moved>>,
}

/// A motion of a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Moved {
    line: u64,
    instruction: String,
    target: String,
    /// `compensated` or `unchanged`.
    done: &'static str,
    /// Why it is unchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct Refused {
    name: String,
    line: u64,
    reason: String,
}

impl Summary {
    pub(super) fn new(rows: &[Row], found: &[Compensated], motions: Option<&[Instruction]>, pair: &Pair) -> Summary {
        let refused = rows.iter().zip(found).filter_map(|(row, found)| {
            let reason = found.readings.as_ref().err()?.to_string();
            Some(Refused { name: row.name.clone(), line: row.line, reason })
        });
        let refused: Vec<Refused> = refused.collect();
        let misses: Vec<f64> = found.iter().filter_map(|f| f.miss_mm).collect();
        Summary {
            targets: rows.len(),
            compensated: rows.len() - refused.len(),
            before_mean_mm: (!misses.is_empty()).then(|| misses.iter().sum::<f64>() / misses.len() as f64),
            before_max_mm: misses.iter().copied().reduce(f64::max),
            orientation_left_deg: found.iter().filter_map(|f| f.left_rad).reduce(f64::max).map(f64::to_degrees),
            tool_mm: pair.tool_mm.map(Into::into),
            check: pair.check.clone(),
            far_turn: far_turn(rows, found, pair),
            refused,
            motions: motions.map(|motions| motions.iter().map(Moved::new).collect()),
        }
    }

    /// Whether nothing was left as it is.
    pub(super) fn is_whole(&self) -> bool {
        let all = |motions: &Vec<Moved>| !motions.is_empty() && motions.iter().all(|m| m.reason.is_none());
        self.refused.is_empty() && self.motions.as_ref().is_none_or(all)
    }
}

impl Moved {
    fn new(motion: &Instruction) -> Moved {
        Moved {
            line: motion.line,
            instruction: motion.word.clone(),
            target: motion.target.clone(),
            done: if motion.moves_by.is_ok() { "compensated" } else { "unchanged" },
            reason: motion.moves_by.as_ref().err().map(Cause::to_string),
        }
    }
}

/// Which joint is turned farthest by a correction of readings, and at which target, where that is far.
fn far_turn(rows: &[Row], found: &[Compensated], pair: &Pair) -> Option<String> {
    let turns = rows.iter().zip(found).filter_map(|(row, found)| match (&row.target, &found.readings) {
        (Target::Readings(given), Ok(readings)) => Some((row, given.iter().zip(readings).zip(&pair.nominal.joints))),
        _ => None,
    });
    let turns = turns.flat_map(|(row, joints)| {
        let turning = joints.enumerate().filter(|(_, (_, joint))| !joint.slides);
        turning.map(move |(j, ((a, b), _))| ((b - a).abs().to_degrees(), j + 1, row))
    });
    let (turn_deg, joint, row) = turns.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(turn, ..)| *turn > FAR_TURN_DEG)?;
    Some(format!(
        "the correction of {} turns joint {joint} by {turn_deg:.1} deg, farther than any other: beside a singular posture small corrections are large turns",
        named(&row.name, row.line)
    ))
}

/// A target by its name and its line.
fn named(name: &str, line: u64) -> String {
    if name == format!("line {line}") { name.to_owned() } else { format!("{name} (line {line})") }
}

/// The lines on the terminal.
pub(super) fn said(summary: &Summary, pair: &Pair, motions: Option<&[Instruction]>, written: &str) -> String {
    let mut text = pair.same.as_ref().map_or_else(String::new, |same| format!("{same}\n"));
    text += &format!("{} of {} compensated: {written}\n", summary.compensated, count(summary.targets, "target"));
    if let Some(motions) = motions {
        let through = motions.iter().filter(|m| m.moves_by.is_ok()).count();
        text += &match motions.len() {
            0 => "no instruction in this file moves to them: whether each use of them is a motion is not known\n"
                .to_owned(),
            1 if through == 1 => "the program has one motion, and it is corrected\n".to_owned(),
            _ if through == 0 => "no motion is corrected: the program is left as written\n".to_owned(),
            all if all == through => format!("all {all} motions move to them\n"),
            all => format!("{through} of {all} motions move to them; {} left as written\n", all - through),
        };
    }
    let is_corrected = pair.same.is_none() && summary.compensated > 0;
    if let (Some(mean), Some(max), true) = (summary.before_mean_mm, summary.before_max_mm, is_corrected) {
        text += &format!(
            "without it the real tool would be off by {mean:.3} mm on average, {max:.3} at most (in the base frame; the errors of `identify` are \
             those after a rigid fit of each placement)\n"
        );
    }
    if let Some(left_deg) = summary.orientation_left_deg {
        text += &format!(
            "an arm of {} joints cannot turn its tool every way: its place is corrected, and up to {left_deg:.3} deg of its orientation stay\n",
            pair.nominal.joints.len()
        );
    }
    summary.far_turn.iter().for_each(|said| text += &format!("{said}\n"));
    pair.of_tools.iter().for_each(|said| text += &format!("{said}\n"));
    let left = motions.into_iter().flatten().filter(|m| m.moves_by.is_err());
    let left: Vec<String> = left.map(|m| format!("left: {m}")).collect();
    // Of a program's target the motion to it says why.
    let is_said = |r: &&Refused| left.iter().any(|motion| motion.ends_with(&r.reason));
    let refused: Vec<&Refused> = summary.refused.iter().filter(|r| !is_said(r)).collect();
    let lines = refused.iter().map(|r| format!("not compensated: {}: {}", named(&r.name, r.line), r.reason));
    listed(&mut text, lines, refused.len(), "compensated.csv");
    let of_motions = left.len();
    listed(&mut text, left.into_iter(), of_motions, "compensate.json");
    text
}

/// At most so many lines of a list, and where the others are named.
fn listed(text: &mut String, lines: impl Iterator<Item = String>, count: usize, file: &str) {
    lines.take(MOST_SAID).for_each(|line| *text += &format!("{line}\n"));
    if count > MOST_SAID {
        *text += &format!("... and {} more, named in {file}\n", count - MOST_SAID);
    }
}
