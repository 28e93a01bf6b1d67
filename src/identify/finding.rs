//! What is wrong with the data, in words.

use serde::Serialize;

#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    pub finding: String,
    /// The rows it is about, by pose; empty where it is about all of them.
    pub rows: Vec<String>,
    /// What was done: mended, left out, or nothing but this warning, and how to have it otherwise.
    pub action: String,
    /// Whether it is about how joints are counted, so that readings for this robot mean something else than the robot
    /// file says.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub of_joints: bool,
}

/// Rows that a sentence names.
const NAMED: usize = 40;

impl Finding {
    /// About all rows.
    pub fn new(finding: impl Into<String>, action: impl Into<String>) -> Finding {
        Finding { finding: finding.into(), rows: Vec::new(), action: action.into(), of_joints: false }
    }

    /// The same about these rows.
    pub fn about(self, rows: Vec<String>) -> Finding {
        Finding { rows, ..self }
    }

    /// As a warning.
    pub fn sentence(&self) -> String {
        let mut text = self.finding.clone();
        if !self.rows.is_empty() {
            let named = self.rows.iter().take(NAMED).cloned().collect::<Vec<_>>().join(", ");
            let more = self.rows.len().saturating_sub(NAMED);
            text.push_str(&format!(": {named}{}", if more > 0 { format!(" and {more} more") } else { String::new() }));
        }
        format!("{text}; {}", self.action)
    }
}
