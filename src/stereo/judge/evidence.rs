//! One fact that speaks for or against a rig: its figure, its limit with the reason, and the best verdict that it allows.

use serde::Serialize;

use crate::diagnostic::Warning;
use crate::stereo::judge::verdict::Verdict;

/// One line of the ledger.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Evidence {
    /// What was looked at.
    pub what: &'static str,
    /// What was found; `None` where nothing could be measured.
    pub value: Option<f64>,
    /// Up to where (or from where on) it allows a pass; `None` for a line that only informs.
    pub limit: Option<f64>,
    /// Unit of both.
    pub unit: &'static str,
    /// The best verdict that it allows.
    pub allows: Verdict,
    /// What it means, with the reason of the limit.
    pub detail: String,
    /// What to do where it does not allow a pass; empty where it always does.
    pub remedy: &'static str,
}

/// A figure with the digits that count: four decimals below one, none for whole numbers.
pub fn number(value: f64) -> String {
    match value.abs() {
        a if a >= 100.0 || a.fract() == 0.0 => format!("{value:.0}"),
        a if a >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.4}"),
    }
}

impl Evidence {
    /// Its name for a person; `what` is the one that scripts know.
    pub fn name(&self) -> &'static str {
        match self.what {
            "rigs without some pairs" => "stability without a block of pairs",
            "pairs with poses of their own" => "number of different poses",
            "scatter of pairs" => "scatter from pair to pair",
            "spread of admissible models" => "difference between models that fit",
            "changes over the pairs" => "changes during the series",
            same => same,
        }
    }

    /// The warning of a line that does not allow a pass.
    pub fn warning(&self) -> Warning {
        Warning { text: format!("{}: {}; {}", self.name(), self.figure(), self.remedy), reason: self.detail.clone() }
    }

    /// What this line says, in one: the value against its limit.
    pub fn figure(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        match (self.value, self.limit) {
            (Some(value), Some(limit)) => format!("{}{unit} (limit {}{unit})", number(value), number(limit)),
            (Some(value), None) => format!("{}{unit}", number(value)),
            (None, _) => "not measurable".to_owned(),
        }
    }
}

/// The verdict of the worst line.
pub fn verdict(ledger: &[Evidence]) -> Verdict {
    ledger.iter().fold(Verdict::Pass, |verdict, line| verdict.and(line.allows))
}
