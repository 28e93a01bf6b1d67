//! Rows that a result was made of, known again in another file.
//!
//! In: rows. Out: a word for each, of its joints and its reading to a thousandth of a degree and a mm: a file that was
//! cut, sorted, renamed or written with fewer decimals has the same, and a pose that was measured anew has another for
//! the scatter of the reading. Goes wrong: a number that lies half-way between two thousandths and is written anew may
//! change its word.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::{Measurement, Role};
use crate::files::provenance::sha256;

/// Digits of a word: among a million rows two different ones share it with a chance of one in ten million.
const DIGITS: usize = 16;

/// The rows of a run.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Given {
    /// Those that may have been fitted.
    pub fitted: BTreeSet<String>,
    /// Those of role `verify`.
    pub verify: BTreeSet<String>,
}

impl Given {
    pub fn new(rows: &[Measurement]) -> Given {
        let words = |of_verify: bool| {
            let rows = rows.iter().filter(|row| (row.at.role == Role::Verify) == of_verify);
            rows.filter_map(word).collect()
        };
        Given { fitted: words(false), verify: words(true) }
    }

    /// The same with rows as they were mended, by which a file is known that was mended since: role, joints (deg, or
    /// mm), and point (mm).
    pub fn with_mended(mut self, rows: impl IntoIterator<Item = (Role, Vec<f64>, [f64; 3])>) -> Given {
        for (role, joints_deg, point_mm) in rows {
            let list = if role == Role::Verify { &mut self.verify } else { &mut self.fitted };
            list.insert(word_of(&joints_deg, &point_mm));
        }
        self
    }

    /// Whether a row is one of those that may have been fitted.
    pub fn fitted(&self, row: &Measurement) -> bool {
        word(row).is_some_and(|word| self.fitted.contains(&word))
    }

    /// Whether a row is any of them.
    pub fn holds(&self, row: &Measurement) -> bool {
        word(row).is_some_and(|word| self.fitted.contains(&word) || self.verify.contains(&word))
    }
}

/// `None` of a row without a reading.
fn word(row: &Measurement) -> Option<String> {
    Some(word_of(&row.at.joints_deg, &row.observed.read()?))
}

fn word_of(joints_deg: &[f64], reading: &[f64]) -> String {
    // No zero has a sign.
    let rounded = |number: &f64| format!("{:.0} ", (1000.0 * number).round() + 0.0);
    let numbers: String = joints_deg.iter().chain(reading).map(rounded).collect();
    sha256(numbers.as_bytes()).chars().take(DIGITS).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Point3;

    use super::*;
    use crate::identify::synthetic::{self, seen_at};

    fn row(joint: f64, x: f64, role: Role) -> Measurement {
        synthetic::row(joint.to_string(), "g", role, vec![joint, -0.0], seen_at(Point3::new(x, 2.0, 3.0)))
    }

    #[test]
    fn rows_are_known_by_their_numbers_and_not_by_their_names() {
        let given = Given::new(&[row(1.0, 5.0, Role::Sample), row(2.0, 6.0, Role::Verify)]);
        let mut renamed = row(1.0, 5.000_04, Role::Verify);
        renamed.at.pose = "other".to_owned();
        assert!(given.fitted(&renamed) && given.holds(&renamed));
        assert!(given.holds(&row(2.0, 6.0, Role::Sample)) && !given.fitted(&row(2.0, 6.0, Role::Sample)));
        // A row that was mended is known as it was and as it is.
        let mended = given.clone().with_mended([(Role::Sample, vec![3.0, 0.0], [7.0, 2.0, 3.0])]);
        let sample = row(3.0, 7.0, Role::Sample);
        assert!(mended.fitted(&sample) && mended.fitted(&renamed) && !given.holds(&sample));
        // The same pose measured anew, and another pose with the same reading.
        assert!(!given.holds(&row(1.0, 5.01, Role::Sample)) && !given.holds(&row(1.1, 5.0, Role::Sample)));
    }
}
