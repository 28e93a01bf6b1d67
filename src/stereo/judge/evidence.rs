//! One fact that speaks for or against a rig: its figure, its limit with the reason, and the best verdict that it
//! allows.

use std::borrow::Cow;

use serde::Serialize;

use crate::diagnostic::{Warning, at_most, two_digits};
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
    pub remedy: Cow<'static, str>,
}

/// A figure with the digits that count: four decimals below one, none for whole numbers.
pub fn number(value: f64) -> String {
    match value.abs() {
        a if a >= 100.0 || a.fract() == 0.0 => format!("{value:.0}"),
        a if a >= 1.0 => format!("{value:.2}"),
        _ => format!("{value:.4}"),
    }
}

/// A limit that a person gave has few digits; of one that was reckoned two are enough.
fn as_given(limit: f64) -> String {
    /// Characters of a number that somebody typed.
    const TYPED: usize = 7;
    Some(limit.to_string()).filter(|text| text.len() <= TYPED).unwrap_or_else(|| two_digits(limit))
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
        self.in_one([self.value.map(number), self.limit.map(number)])
    }

    /// The same with the digits of a page, see [`Evidence::rounded`].
    pub fn short_figure(&self) -> String {
        self.in_one(self.rounded())
    }

    fn in_one(&self, [value, limit]: [Option<String>; 2]) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        // The words behind a unit are about the value alone: "0.04 mm apart (limit 3 mm)".
        let of_limit = self.unit.split(' ').next().filter(|unit| !unit.is_empty());
        let of_limit = of_limit.map_or(String::new(), |unit| format!(" {unit}"));
        match (value, limit) {
            (Some(value), Some(limit)) => format!("{value}{unit} (limit {limit}{of_limit})"),
            (Some(value), None) => format!("{value}{unit}"),
            (None, _) => "not measurable".to_owned(),
        }
    }

    /// Value and limit for a page: lengths, which are what an error is at most, with three digits and rounded up; a
    /// limit as it was given.
    pub fn rounded(&self) -> [Option<String>; 2] {
        let is_length = self.unit == "mm";
        let value = self.value.map(|value| match self.limit {
            _ if !is_length => number(value),
            Some(limit) => at_most(value, limit),
            None => two_digits(value),
        });
        let limit = self.limit.map(|limit| if is_length { as_given(limit) } else { number(limit) });
        [value, limit]
    }
}
