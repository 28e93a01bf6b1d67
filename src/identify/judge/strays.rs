//! Rows that are so far off a robot that is not fitted that they are no errors of it: a misread point, the joints of
//! another row.
//!
//! In: robots, each with the rows as it takes them, those that place the sensor and those that are judged. Out: the
//! rows that are many times as far off as most, by the robot that is nearest, and whether the readings of two of them
//! are exchanged. Method: placements by the four fifths of each group's rows that come nearest (the concentration steps
//! of Rousseeuw and Van Driessen, 1999). Goes wrong: robots that are off by as much as the strays, and strays that are
//! more than a fifth of the rows: then none is named.

use super::errors::{Judge, RowError};
use crate::identify::data::dataset::Dataset;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::robot::Robot;
use crate::statistics::median;

/// Errors of a robot vary with the posture by some times their median; a row that is off by more than so many is
/// another thing.
const FAR: f64 = 12.0;

/// A row that another robot has within this share of that is none.
const NEAR: f64 = 0.5;

/// One row in so many may be a stray.
const SHARE: usize = 5;

/// Rows of a group below which all of them place it.
const FEWEST: usize = 6;

const ROUNDS: usize = 6;

/// Rows that stray.
#[derive(Debug, Clone, PartialEq)]
pub struct Strays {
    pub rows: Vec<usize>,
    /// What the farthest is off by, and the median of all rows, mm.
    pub most_mm: f64,
    pub median_mm: f64,
    /// Whether they are two whose readings are each other's.
    pub exchanged: bool,
}

impl Strays {
    /// For a person.
    pub fn statement(&self, set: &Dataset) -> String {
        let names = set.names(&self.rows);
        let far = format!("up to {:.2} mm off, the median is {:.3} mm", self.most_mm, self.median_mm);
        match &names[..] {
            [a, b] if self.exchanged => {
                format!("the readings of rows {a} and {b}, or their joints, are exchanged ({far}): mend the file")
            }
            [one] => format!("row {one} fits far worse than the rest ({far}): take it again"),
            all => format!("rows {} fit far worse than the rest ({far}): take them again", all.join(", ")),
        }
    }
}

/// Errors of these rows by their rows, with the sensor placed by those nearest.
fn sizes(judge: &Judge, robot: &Robot, placing: &[usize], rows: &[usize]) -> Vec<(usize, f64)> {
    let judge = Judge { fitted: placing, ..judge.clone() };
    let size_mm = |error: &RowError| error.point_mm.map(|p| p.norm()).or(error.distance_mm.map(f64::abs));
    judge.errors(robot, rows).iter().filter_map(|error| Some((error.row, size_mm(error)?))).collect()
}

/// The rows that the sensor is placed by without those that come least near.
fn nearest(judge: &Judge, robot: &Robot) -> Vec<usize> {
    let mut placing = judge.fitted.to_vec();
    for _ in 0..ROUNDS {
        let mut all = sizes(judge, robot, &placing, judge.fitted);
        all.sort_by(|a, b| a.1.total_cmp(&b.1));
        let order: Vec<usize> = all.iter().map(|(row, _)| *row).collect();
        let mut near = Vec::new();
        for group in 0..judge.set.groups.len() {
            let of_group = judge.set.of_group(&order, group);
            let spare = if of_group.len() < FEWEST { 0 } else { of_group.len() / SHARE };
            near.extend(&of_group[..of_group.len() - spare]);
        }
        near.sort_unstable();
        if near == placing {
            break;
        }
        placing = near;
    }
    placing
}

/// Looks for strays among rows that place the sensor and these; `sets` are the same rows as each robot takes them.
pub fn find(judge: &Judge, (robots, sets): (&[&Robot], &[&Dataset]), judged: &[usize]) -> Option<Strays> {
    if (0..judge.set.poses.len()).any(|row| judge.set.touches(row)) {
        return None;
    }
    let mut rows = [judge.fitted, judged].concat();
    rows.sort_unstable();
    rows.dedup();
    let all = robots.iter().zip(sets).filter_map(|(&robot, &set)| {
        let judge = Judge { set, ..judge.clone() };
        let placing = nearest(&judge, robot);
        let sizes = sizes(&judge, robot, &placing, &rows);
        let median_mm = median(sizes.iter().map(|(_, size)| *size))?;
        Some((median_mm, sizes, placing, robot, judge))
    });
    let all: Vec<_> = all.collect();
    let (median_mm, sizes, placing, robot, judge) = all.iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let limit_mm = FAR * median_mm.max(REPEATABILITY_MM);
    // What another robot has near is no misread row, but where this robot is not right.
    let is_near = |row: usize| all.iter().any(|of| of.1.iter().any(|&(r, size)| r == row && size < limit_mm * NEAR));
    let far: Vec<(usize, f64)> =
        sizes.iter().copied().filter(|&(row, size)| size > limit_mm && !is_near(row)).collect();
    if far.is_empty() || far.len() * SHARE > sizes.len() {
        return None;
    }
    let rows: Vec<usize> = far.iter().map(|(row, _)| *row).collect();
    let most_mm = far.iter().map(|(_, size)| *size).fold(0.0, f64::max);
    let exchanged = match rows[..] {
        [a, b] => are_exchanged(judge, robot, placing, [a, b], limit_mm),
        _ => false,
    };
    Some(Strays { rows, most_mm, median_mm: *median_mm, exchanged })
}

/// Whether two rows are near with each other's readings.
fn are_exchanged(judge: &Judge, robot: &Robot, placing: &[usize], [a, b]: [usize; 2], limit_mm: f64) -> bool {
    let mut set = judge.set.clone();
    if set.poses[a].group != set.poses[b].group {
        return false;
    }
    let of_a = set.poses[a].reading.clone();
    set.poses[a].reading = std::mem::replace(&mut set.poses[b].reading, of_a);
    let near: Vec<usize> = placing.iter().copied().filter(|row| ![a, b].contains(row)).collect();
    let judge = Judge { set: &set, ..judge.clone() };
    let then = sizes(&judge, robot, &near, &[a, b]);
    then.len() == 2 && then.iter().all(|(_, size)| *size < limit_mm)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic::{planned, point};
    use crate::measurements::Measurement;

    fn found(spoil: &dyn Fn(&mut [Measurement])) -> (Dataset, Option<Strays>) {
        let mut world = planned(40, 0, 25.0, 0.03, 3, &|_| {});
        spoil(&mut world.rows);
        let set = Dataset::new(&world.rows).unwrap();
        let rows = set.rows(|_| true);
        let robots = [&world.nominal, &world.truth];
        let strays = find(&Judge::plain(&set, &rows, false), (&robots, &[&set, &set]), &rows);
        (set, strays)
    }

    #[test]
    fn rows_that_stray_are_named_and_those_that_are_exchanged() {
        assert_eq!(found(&|_| {}).1, None);
        for by_mm in [3.0, 30.0, 3000.0] {
            let (_, strays) = found(&|rows| point(&mut rows[9]).x += by_mm);
            assert_eq!(strays.map(|s| (s.rows, s.exchanged)), Some((vec![9], false)), "{by_mm}");
        }
        let (set, strays) = found(&|rows| {
            let of_first = *point(&mut rows[8]);
            *point(&mut rows[8]) = std::mem::replace(point(&mut rows[24]), of_first);
        });
        let strays = strays.unwrap();
        assert!(strays.rows == [8, 24] && strays.exchanged, "{strays:?}");
        assert!(strays.statement(&set).contains("are exchanged"), "{}", strays.statement(&set));
    }

    #[test]
    fn a_row_that_another_robot_has_near_is_no_stray() {
        let world = planned(40, 0, 25.0, 0.03, 3, &|_| {});
        let truth = &world.truth;
        let set = Dataset::new(&world.rows).unwrap();
        let rows = set.rows(|_| true);
        // As a robot would that is wrong where this pose alone is.
        let mut spoilt = set.clone();
        spoilt.poses[9].joints_rad[2] += 0.02;
        let judge = Judge::plain(&set, &rows, false);
        let alone = find(&judge, (&[truth], &[&spoilt]), &rows);
        assert_eq!(alone.map(|strays| strays.rows), Some(vec![9]));
        assert_eq!(find(&judge, (&[truth, truth], &[&spoilt, &set]), &rows), None);
    }
}
