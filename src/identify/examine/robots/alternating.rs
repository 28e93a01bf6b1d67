//! Rows that alternate between two arms, tools or targets, as where two programs wrote one table in turn.
//!
//! In: points, and the nominal robot. Out: what is said of it, or nothing. Method: every other row is a part of its own,
//! judged as files are ([`super`]): two robots are held against one with one tool. Goes wrong: rows that are missing in
//! between, from which on the others are of the other part.

use super::Table;
use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::robot::Robot;

/// What one robot leaves of all rows at the least, mm: play of gears parts rows that were reached from two sides in
/// turn as well, by less.
const LEAST_MM: f64 = 0.3;

/// Rows of each part that are named.
const NAMED: usize = 3;

/// What is said where each part has far less error by itself.
pub fn find(set: &Dataset, robot: &Robot) -> Option<Finding> {
    let table = Table::new(set, robot)?;
    let (even, odd): (Vec<usize>, Vec<usize>) = (0..table.rows.len()).partition(|&i| table.rows[i].is_multiple_of(2));
    if even.len().min(odd.len()) < super::SHORTEST {
        return None;
    }
    let (parts, compared) = table.judged(vec![even, odd], 1.0, Table::compared_as_one)?;
    let all_mm = compared.together.scatter_mm();
    let said = |(rows, left): (&Vec<usize>, &super::Left)| {
        let names = rows.iter().take(NAMED).map(|&i| set.poses[table.rows[i]].name.as_str());
        format!("{}, ... {:.3} mm", names.collect::<Vec<&str>>().join(", "), left.scatter_mm())
    };
    let each = parts.iter().zip(&compared.each).map(said).collect::<Vec<String>>().join(", in ");
    (all_mm >= LEAST_MM).then(|| {
        Finding::new(
            format!(
                "every other row is of another arm, tool or target: a robot of its own leaves in {each} a coordinate, one robot for all of them \
                 {all_mm:.3} mm"
            ),
            "identify each half by itself, every other row a table",
        )
    })
}
