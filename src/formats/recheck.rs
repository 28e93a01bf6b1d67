//! `recheck.json` and `recheck.csv`: whether a rig still stands, and how it stood at every check before.

use camino::Utf8Path;
use serde::{Deserialize, Serialize};

use crate::diagnostic::Status;
use crate::files::{self, OutDir, Result};
use crate::stereo::findings::standing::MATERIAL_SHARE;
use crate::stereo::recheck::Recheck;

/// The history's name in a results folder.
pub const HISTORY: &str = "recheck.csv";

/// What is said of the rig.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Standing {
    /// No change was seen that moves a length by more than a tenth of the tolerance, and one that moves it by the
    /// tolerance would have been.
    StillValid,
    /// It changed, by less than the tolerance.
    ChangedWithin,
    /// No change was seen, but the pairs would not have shown one that moves a length by the tolerance.
    Undecided,
    /// It changed by more than the tolerance.
    Changed,
    /// The data are those that it was made of: they show no change, and would show none.
    OwnData,
}

impl Standing {
    /// Of a comparison: whether anything changed, by how much that moves a length or the target, and what would have
    /// been seen, mm.
    pub fn of(changed: bool, effect_mm: f64, seen_mm: f64, tolerance_mm: f64) -> Standing {
        let harmless = !changed || effect_mm <= MATERIAL_SHARE * tolerance_mm;
        match (harmless, seen_mm <= tolerance_mm) {
            (true, true) => Standing::StillValid,
            (true, false) => Standing::Undecided,
            (false, _) if effect_mm <= tolerance_mm => Standing::ChangedWithin,
            (false, _) => Standing::Changed,
        }
    }

    /// The same where the data may be those that the calibration or the robot was made of.
    #[must_use]
    pub fn by(self, own_data: bool) -> Standing {
        match self {
            Standing::StillValid | Standing::Undecided if own_data => Standing::OwnData,
            other => other,
        }
    }

    /// The same where pairs contradict the calibration by themselves.
    #[must_use]
    pub fn beside(self, contradicted: bool) -> Standing {
        if contradicted && self == Standing::StillValid { Standing::Undecided } else { self }
    }

    /// What pairs say that contradict the calibration by themselves, and what they are off by, mm, where this standing
    /// is because of them or would hide them.
    pub fn contradicted(self, recheck: &Recheck) -> Option<(String, f64)> {
        match self {
            Standing::Undecided | Standing::OwnData => recheck.contradiction(),
            _ => None,
        }
    }

    /// With which status a check ends.
    pub fn status(self) -> Status {
        match self {
            Standing::StillValid => Status::Done,
            Standing::ChangedWithin | Standing::Undecided | Standing::OwnData => Status::OutOfTolerance,
            Standing::Changed => Status::Undetermined,
        }
    }
}

/// What a check of a rig or of a robot says, as far as those who use either need it.
#[derive(Debug, Deserialize)]
pub struct CheckedAgainst {
    pub standing: Standing,
    pub statement: String,
}

/// What is said, and by how much the change moves a length or the pairs that contradict the calibration are off, mm.
fn found(recheck: &Recheck, standing: Standing) -> (String, f64) {
    standing.contradicted(recheck).unwrap_or_else(|| (recheck.statement(), recheck.effect_mm))
}

/// The content of `recheck.json`; `against` is the calibration that was compared with.
pub fn content(recheck: &Recheck, standing: Standing, against: &Utf8Path, tolerance_mm: f64) -> serde_json::Value {
    let (statement, effect_mm) = found(recheck, standing);
    serde_json::json!({
        "standing": standing,
        "tolerance_mm": tolerance_mm,
        "against": against,
        "pairs": recheck.pairs,
        "pairs_skipped": recheck.skipped,
        // Pairs that contradict the calibration by themselves, and by what matters.
        "pairs_contradicting": recheck.strays,
        // The length that changes are given for.
        "length_mm": recheck.length_mm,
        // One or, not told apart, several with `|`; empty where nothing changed.
        "cause": recheck.cause(),
        "statement": statement,
        "effect_mm": effect_mm,
        // The largest change of a length that a single cause could make without being seen in nineteen of twenty
        // checks.
        "seen_mm": recheck.seen_mm,
        "causes": recheck.causes,
    })
}

/// One check in the history.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// UTC; empty without provenance.
    pub date: String,
    /// The calibration that was compared with.
    pub against: String,
    /// How many pairs, or poses.
    #[serde(alias = "poses")]
    pub pairs: usize,
    pub standing: Standing,
    /// The cause; empty where nothing changed.
    pub cause: String,
    /// By how much the change moves a length, or the target of a robot, or the pairs that contradict the calibration
    /// are off, mm.
    pub effect_mm: f64,
    /// What would have been seen, mm.
    pub seen_mm: f64,
    /// The length that both are for, mm; none of a robot.
    pub length_mm: Option<f64>,
}

impl Check {
    pub fn new(recheck: &Recheck, standing: Standing, against: &Utf8Path, date: String) -> Check {
        Check {
            date,
            against: against.to_string(),
            pairs: recheck.pairs.len(),
            standing,
            cause: recheck.cause(),
            effect_mm: found(recheck, standing).1,
            seen_mm: recheck.seen_mm,
            length_mm: Some(recheck.length_mm),
        }
    }
}

/// The checks before this one in a results folder; none where there is no history.
pub fn history(out: &OutDir, name: &str) -> Result<Vec<Check>> {
    let path = out.join(name);
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let text = files::read_text(&path, "history of checks", None)?;
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    reader.deserialize().collect::<Result<Vec<Check>, csv::Error>>().map_err(|error| {
        let line = error.position().map(csv::Position::line);
        let message = format!("not a history of checks: {error}");
        files::Error::format(&path, line, message, Some("move it away, or name another `--out`"))
    })
}

/// The history as a file, of checks by so many `counted`: pairs, or poses.
pub fn to_csv(checks: &[Check], counted: &str) -> String {
    let mut text = format!("date,against,{counted},standing,cause,effect_mm,seen_mm,length_mm\n");
    for check in checks {
        let standing = serde_json::to_value(check.standing).ok();
        let standing = standing.as_ref().and_then(|value| value.as_str()).unwrap_or_default();
        let fields = [
            crate::csv_table::quoted(&check.date),
            crate::csv_table::quoted(&check.against),
            check.pairs.to_string(),
            standing.to_owned(),
            check.cause.clone(),
            format!("{:.6}", check.effect_mm),
            format!("{:.6}", check.seen_mm),
            check.length_mm.map_or_else(String::new, |mm| mm.to_string()),
        ];
        text.push_str(&format!("{}\n", fields.join(",")));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_history_survives_the_file() {
        let (_keep, path) = files::temporary_folder();
        let out = OutDir::open(&path.join("out")).unwrap();
        assert_eq!(history(&out, HISTORY).unwrap(), []);
        let check = |date: &str, standing| Check {
            date: date.to_owned(),
            against: "a, b/calibration.json".to_owned(),
            pairs: 3,
            standing,
            cause: "baseline|other-board".to_owned(),
            effect_mm: 0.0125,
            seen_mm: 0.004,
            length_mm: (!date.is_empty()).then_some(70.0),
        };
        let checks = [check("2026-01-02T03:04:05Z", Standing::StillValid), check("", Standing::ChangedWithin)];
        for counted in ["pairs", "poses"] {
            out.write(HISTORY, to_csv(&checks, counted).as_bytes()).unwrap();
            assert_eq!(history(&out, HISTORY).unwrap(), checks);
        }
        std::fs::write(out.join(HISTORY), "a,b\n1,2\n").unwrap();
        assert!(history(&out, HISTORY).unwrap_err().to_string().contains("not a history of checks"));
    }
}
