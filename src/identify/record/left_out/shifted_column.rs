//! A joint's column that stands some rows off in the rows that were left out, as after a cell that was pasted twice.
//!
//! In: the rows that were left out, with the errors that the robot has in these. Out: the joint, and by how many rows.
//! Method: with the joint's readings of other rows of the table nearly all of these rows come nearer by a factor that
//! chance does not bring. Goes wrong: a joint that is read at one angle over many rows.

use crate::identify::data::dataset::Dataset;
use crate::identify::judge::errors::RowError;

/// Rows by which a column may stand off.
const MOST: isize = 3;
/// Fewest rows left out that tell of a column.
const FEWEST: usize = 6;
/// Share of these rows that come nearer, and by what factor: the robot was found beside rows of this kind, and may be off
/// by some of what they were. Another row's angle brings one row so near by chance in an eighth of the cases.
const NEARLY_ALL: f64 = 0.8;
const NEARER: f64 = 4.0;

/// A joint whose readings of these rows stand so many rows further down in the table (further up where it is below
/// zero). `errors` are the robot's in these rows, of the set with its joints as they are or moved.
pub(super) fn find(
    set: &Dataset,
    rows: &[usize],
    errors: &dyn Fn(&Dataset) -> Vec<RowError>,
) -> Option<(usize, isize)> {
    let sizes = |set: &Dataset| -> Vec<f64> {
        errors(set).iter().filter_map(|error| error.point_mm).map(|point| point.norm()).collect()
    };
    let here = sizes(set);
    if rows.len() < FEWEST || here.len() != rows.len() {
        return None;
    }
    let nearer = |joint: usize, by: isize| {
        let mut moved = set.clone();
        for &row in rows {
            let there = row.checked_add_signed(by).and_then(|row| set.poses.get(row));
            moved.poses[row].joints_rad[joint] = there.unwrap_or(&set.poses[row]).joints_rad[joint];
        }
        sizes(&moved).iter().zip(&here).filter(|(there, here)| NEARER * *there < **here).count()
    };
    let looks = (0..set.joint_count()).flat_map(|joint| (1..=MOST).flat_map(move |by| [(joint, by), (joint, -by)]));
    let (count, joint, by) =
        looks.map(|(joint, by)| (nearer(joint, by), joint, by)).max_by_key(|(count, ..)| *count)?;
    (count as f64 >= NEARLY_ALL * rows.len() as f64).then_some((joint, by))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::judge::errors::Judge;
    use crate::identify::synthetic::{self, World};

    /// What is found in a world, and how many rows were left out.
    fn found_in(world: &World) -> (Option<(usize, isize)>, usize) {
        let (set, found) = world.identified(&world.rows);
        let errors = |set: &Dataset| Judge::plain(set, &found.fitted, false).errors(found.robot(), &found.outliers);
        (find(&set, &found.outliers, &errors), found.outliers.len())
    }

    /// The same where a joint's readings from row 40 on are those of so many rows further on.
    fn found(joint: usize, by: isize, seed: u64) -> (Option<(usize, isize)>, usize) {
        let mut world = synthetic::world(60, 0.02, seed);
        let read: Vec<f64> = world.rows.iter().map(|row| row.at.joints_deg[joint]).collect();
        for (k, row) in world.rows.iter_mut().enumerate().skip(40) {
            row.at.joints_deg[joint] = *k.checked_add_signed(by).and_then(|k| read.get(k)).unwrap_or(&read[k]);
        }
        found_in(&world)
    }

    #[test]
    fn a_column_that_stands_some_rows_off_from_a_row_on_is_named() {
        for (joint, by) in [(0, 1), (2, -1)] {
            for seed in [3, 4] {
                let (found, out) = found(joint, by, seed);
                assert_eq!(found, Some((joint, -by)), "{out} left out, seed {seed}");
            }
        }
    }

    #[test]
    fn rows_whose_angles_are_of_no_other_row_are_of_no_column() {
        let mut world = synthetic::world(60, 0.02, 3);
        for (k, row) in world.rows.iter_mut().enumerate().filter(|(k, _)| k % 5 == 2) {
            row.at.joints_deg[2] += 3.0 + k as f64;
        }
        let (found, out) = found_in(&world);
        assert!(found.is_none() && out >= FEWEST, "{found:?}, {out} left out");
    }
}
