//! How the check of a rig's lengths ended, and what that says to those who use the rig.

use serde::{Deserialize, Serialize};

use crate::diagnostic::{at_most, two_digits};
use crate::stereo::judge::assessment::NO_USE;
use crate::stereo::judge::verdict::Verdict;

/// How the check of the rig's lengths ended.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Check {
    pub(super) verdict: Verdict,
    /// The largest error of a length that passed, mm.
    pub tolerance_mm: f64,
    /// What lengths can be trusted to; none where something else than a length stands against the rig.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) trusted_mm: Option<f64>,
    /// Up to which length, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) length_mm: Option<f64>,
}

impl Check {
    pub fn has_failed(&self) -> bool {
        self.verdict == Verdict::Fail
    }

    /// What lengths can be trusted to, mm.
    pub fn trusted_mm(&self) -> Option<f64> {
        self.trusted_mm.filter(|mm| mm.is_finite())
    }

    /// What it says against the rig, where the rig did not pass.
    pub fn doubt(&self) -> Option<String> {
        let verdict = match self.verdict {
            Verdict::Pass => return None,
            Verdict::Undecided => "UNDECIDED",
            Verdict::Fail => "FAIL",
        };
        let trusted = match (self.trusted_mm(), self.length_mm) {
            (None, _) => "to what its lengths can be trusted is not known".to_owned(),
            (Some(mm), Some(length_mm)) if mm > NO_USE * length_mm => format!(
                "no length can be trusted: of one of {length_mm:.0} mm an error of {} mm is not ruled out",
                two_digits(mm)
            ),
            (Some(mm), length_mm) => {
                let up_to = length_mm.map_or_else(String::new, |mm| format!(" of up to {mm:.0} mm"));
                format!("lengths{up_to} can be trusted to {} mm", at_most(mm, f64::INFINITY))
            }
        };
        let tolerance_mm = self.tolerance_mm;
        Some(format!("this rig did not pass its check ({verdict} at a tolerance of {tolerance_mm} mm): {trusted}"))
    }
}
