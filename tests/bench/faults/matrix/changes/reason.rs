//! Whether what is said of a series is what was planted.

use serde_json::Value;

use super::super::said::Said;
use super::super::set::Set;
use super::plants::Line;

/// How the reason that is given does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    Right,
    /// Named together with others that do the same to these pairs.
    WithEquals,
    /// Nothing is said, or that the cause is unknown.
    Unknown,
    Wrong,
}

impl Reason {
    pub const ALL: [Reason; 4] = [Reason::Right, Reason::WithEquals, Reason::Unknown, Reason::Wrong];

    /// The worst of all findings; a run without a verdict is judged by the causes that it leaves in its message.
    pub fn of(said: &Said, line: &Line, set: &Set) -> Reason {
        let Some(check) = &said.check else { return Reason::Unknown };
        let findings = check["findings"].as_array().cloned().unwrap_or_default();
        let each = findings.iter().map(|finding| of_one(finding, line, set));
        each.max_by_key(|reason| Reason::ALL.iter().position(|r| r == reason)).unwrap_or(Reason::Unknown)
    }
}

fn of_one(finding: &Value, line: &Line, set: &Set) -> Reason {
    let due = &line.due;
    let causes: Vec<&str> = finding["cause"].as_str().unwrap_or("").split('|').collect();
    let names: Vec<&str> = finding["pairs"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let meant: Vec<&str> = (due.pairs)(set.pairs.len()).into_iter().map(|k| set.pairs[k].name.as_str()).collect();
    let of_pairs = match finding["kind"].as_str() {
        Some("step") => names.first() == meant.first(),
        _ => meant.is_empty() || names.iter().all(|name| meant.contains(name)),
    };
    if causes == ["unknown"] {
        return Reason::Unknown;
    }
    if finding["kind"] != due.kind || !of_pairs {
        return Reason::Wrong;
    }
    let holds = |list: &[&str]| causes.iter().any(|cause| list.contains(cause));
    match (holds(due.right), causes.len()) {
        (true, 1) => Reason::Right,
        (true, _) => Reason::WithEquals,
        _ if holds(due.equals) => Reason::WithEquals,
        _ => Reason::Wrong,
    }
}

/// What was found, in short.
pub fn findings(said: &Said) -> String {
    let Some(check) = &said.check else {
        return said
            .words
            .iter()
            .take(2)
            .map(|line| line.chars().take(90).collect::<String>())
            .collect::<Vec<_>>()
            .join(" / ");
    };
    let short = |finding: &Value| {
        let text = |name: &str| finding[name].as_str().unwrap_or("").to_owned();
        let pairs = finding["pairs"].as_array().map_or(0, Vec::len);
        let first = finding["pairs"][0].as_str().unwrap_or("");
        format!(
            "{} {} {first}+{pairs} {:.5}{}",
            text("cause"),
            text("kind"),
            finding["size"].as_f64().unwrap_or(0.0),
            text("unit")
        )
    };
    check["findings"].as_array().into_iter().flatten().map(short).collect::<Vec<_>>().join(", ")
}
