//! What the run that found a robot says of its use.

use camino::Utf8Path;
use serde::{Deserialize, Serialize};

use crate::diagnostic::Status;

/// What to do with the robot that was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Advice {
    Use,
    /// Use it once the reason was looked at.
    Check,
    /// Nothing better than the nominal robot was found, and that is the result.
    KeepNominal,
    DoNotUse,
}

/// The advice with its reason, as files carry it to whatever uses the robot.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Check {
    pub advice: Advice,
    /// Why, in one sentence; empty where there is nothing to say.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    /// Whether links are farther from the nominal robot's than any maker builds them, so that whatever is made with
    /// both may be off by as much.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub out_of_tolerance: bool,
    /// How the joints of this robot are counted otherwise than the nominal robot's file says, and what to mend:
    /// readings for the one mean something else for the other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub mended: Vec<String>,
}

impl Advice {
    /// What a command that found or uses such a robot ends with, at best: one that is to be checked first is a result.
    pub fn status(self) -> Status {
        match self {
            Advice::Use | Advice::Check | Advice::KeepNominal => Status::Done,
            Advice::DoNotUse => Status::OutOfTolerance,
        }
    }
}

impl Check {
    /// What a command that found or uses the robot ends with at best.
    pub fn status(&self) -> Status {
        if self.out_of_tolerance { Status::OutOfTolerance } else { self.advice.status() }
    }

    /// What a user of `file` must know; `None` where there is nothing to say.
    pub fn warning(&self, file: &Utf8Path) -> Option<String> {
        let reason = &self.reason;
        match self.advice {
            Advice::DoNotUse => Some(format!("do not use {file}, says its own `check`: {reason}")),
            Advice::Check => Some(format!("check before you use {file}, says its own `check`: {reason}")),
            Advice::Use | Advice::KeepNominal => None,
        }
    }
}
