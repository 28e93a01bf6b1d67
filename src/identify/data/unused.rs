//! Rows that are not used, in words.

use super::dataset::{Dataset, Skipped};
use crate::identify::finding::Finding;

/// Reasons that are said each by itself.
const REASONS: usize = 3;

/// The rows without a usable reading, by their reason; of many reasons the first.
pub fn unused(set: &Dataset) -> Vec<Finding> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for Skipped { pose, reason } in &set.skipped {
        match reasons.iter_mut().find(|(known, _)| known == reason) {
            Some((_, poses)) => poses.push(pose.clone()),
            None => reasons.push((reason, vec![pose.clone()])),
        }
    }
    let has = |count: usize| if count == 1 { "1 row has".to_owned() } else { format!("{count} rows have") };
    if reasons.len() > REASONS {
        let Skipped { pose, reason } = &set.skipped[0];
        let said = format!("{} no usable reading, the first {pose} ({reason})", has(set.skipped.len()));
        return vec![Finding::new(said, "left out")];
    }
    let finding = |(reason, poses): (&str, Vec<String>)| {
        Finding::new(format!("{} no usable reading ({reason})", has(poses.len())), "left out").about(poses)
    };
    reasons.into_iter().map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_named_by_their_reason() {
        let set = |reasons: &[&str]| {
            let skipped = |(k, reason): (usize, &&str)| Skipped { pose: format!("p{k}"), reason: (*reason).to_owned() };
            Dataset { skipped: reasons.iter().enumerate().map(skipped).collect(), ..Dataset::default() }
        };
        let said = |reasons: &[&str]| unused(&set(reasons)).iter().map(Finding::sentence).collect::<Vec<_>>();
        assert_eq!(said(&[]), Vec::<String>::new());
        assert_eq!(
            said(&["dark", "hidden", "dark"]),
            [
                "2 rows have no usable reading (dark): p0, p2; left out",
                "1 row has no usable reading (hidden): p1; left out"
            ]
        );
        assert_eq!(said(&["a", "b", "c", "d"]), ["4 rows have no usable reading, the first p0 (a); left out"]);
    }
}
