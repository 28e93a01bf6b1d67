//! Whether what was said is what the truth bears out.

use super::Right;
use super::said::Said;
use super::set::Set;
use super::truth::{self, Deviation};

/// The largest length error that passes: the command's own default, mm.
pub const TOLERANCE_MM: f64 = 0.05;

/// A pass is false where fresh boards are off by more than so many tolerances.
const FALSE_PASS: f64 = 1.1;

/// A rig is wrong where it is off by so many of its own standard deviations.
const SIGMAS: f64 = 5.0;

/// Lengths that are off by less are no harm, mm: the certificate of the presets' board leaves as much open, corner by
/// corner the same in all pairs, and no picture of that board shows it.
const CERTIFICATE_MM: f64 = 0.004;

/// What came of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Judgement {
    Right,
    /// A pass of a rig that is out of tolerance.
    FalsePass,
    /// A rig off by many of its sigmas, and no word of it.
    Silent,
    /// No pass where one was to be had.
    FalseFail,
    /// Neither pass nor fail where a pass was to be had, with the line of evidence that is missing.
    Undecided,
    /// Words about nothing.
    FalseAlarm,
}

impl Judgement {
    pub fn name(self) -> &'static str {
        match self {
            Judgement::Right => "right",
            Judgement::FalsePass => "FALSE PASS",
            Judgement::Silent => "SILENT",
            Judgement::FalseFail => "FALSE FAIL",
            Judgement::Undecided => "undecided",
            Judgement::FalseAlarm => "FALSE ALARM",
        }
    }
}

/// A run, judged.
pub struct Judged {
    pub said: Said,
    pub deviation: Option<Deviation>,
    pub judgement: Judgement,
}

/// Judges a run of a set.
pub fn judge(set: &Set, right: Right, said: Said) -> Judged {
    let deviation = said.calibration.as_ref().and_then(|file| truth::deviation(set, file));
    let passed = said.verdict == "pass";
    let silent = |d: &Deviation| {
        let sigmas = d.length_sigmas.unwrap_or(0.0).max(d.point_sigmas.unwrap_or(0.0));
        sigmas > SIGMAS && d.length_mm > CERTIFICATE_MM
    };
    let out = |d: &Deviation| d.length_mm > FALSE_PASS * TOLERANCE_MM;
    let judgement = match &deviation {
        Some(d) if passed && out(d) => Judgement::FalsePass,
        Some(d) if passed && said.words.is_empty() && silent(d) => Judgement::Silent,
        Some(_) if said.verdict == "undecided" && !said.words.is_empty() && right != Right::Truth => {
            Judgement::Undecided
        }
        _ if !passed && right != Right::Truth => Judgement::FalseFail,
        _ if right == Right::Clean && !said.words.is_empty() => Judgement::FalseAlarm,
        _ => Judgement::Right,
    };
    Judged { said, deviation, judgement }
}
