//! Points and joint angles that do not belong together: from some row on each point is of another row's pose, as after
//! a picture that failed.
//!
//! In: points in the order of the file, and the nominal robot. Out: the set with each reading at the row that it is of,
//! from which row on, and by how many rows. Every row and every shift by up to `MOST` is tried with the links of the
//! file, placements and the target's place fitted (least sum of distances, by reweighting). A shift is named where the
//! rows behind it come nearer by a factor, the likelihood of all rows pays for the search, and another placement of
//! these rows does not explain them as well. What goes wrong: groups of three rows or so, whose placements take up what
//! is wrong; neighbouring poses that are nearer to each other than the nominal robot is to the readings; fewer than
//! `FEWEST` rows behind the shift; rows that were left out between count as none.

use nalgebra::{Matrix3, Point3, Vector3};
use rayon::prelude::*;

use crate::geometry::{Transform, fitted_frame, rotation_matrix};
use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::finding::Finding;
use crate::robot::Robot;
use crate::statistics::median;

/// Rows by which readings may be off.
const MOST: isize = 3;

/// Fewest rows behind a shift, and of a set.
const FEWEST: usize = 4;
const FEWEST_ROWS: usize = 8;

/// A shift explains what is wrong when it brings the rows behind it nearer by this factor.
pub(super) const EXPLAINS: f64 = 4.0;

/// And by this factor nearer than another placement of these rows brings them.
const BEATS: f64 = 2.0;

/// Logarithm of the likelihood that a shift must bring beyond the number of those tried: 150 to 1.
const EVIDENCE: f64 = 5.0;

/// First rows of a shift that are tried at once, before those between the best.
const GRID: usize = 24;

/// Rounds of reweighting.
const ROUNDS: usize = 8;

/// Readings from a row on that are of the poses of other rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shift {
    /// Index of the first of them.
    pub from: usize,
    /// How many rows further down in the file their poses stand.
    pub by: isize,
    /// Median distance of these readings from the nominal robot as they stand, and as they belong, mm.
    pub before_mm: f64,
    /// With the shift undone.
    pub after_mm: f64,
}

/// What a hypothesis leaves.
struct Left {
    /// Distance of each reading from where the robot is, mm; `None` where it belongs to no row.
    errors: Vec<Option<f64>>,
    mean: f64,
    tool_mm: Vector3<f64>,
}

/// The robot and the readings, row by row.
pub(super) struct Rows {
    origins: Vec<Vector3<f64>>,
    rotations: Vec<Matrix3<f64>>,
    groups: Vec<usize>,
    points: Vec<Point3<f64>>,
    tool_mm: Vector3<f64>,
}

impl Shift {
    /// What was found.
    pub fn statement(&self, set: &Dataset) -> String {
        let rows = self.by.unsigned_abs();
        format!(
            "from pose {} on (row {} of {}) points and joint angles do not belong together: each point is of the pose {rows} {} {} in the file \
             (the nominal robot's errors there fall from {:.1} to {:.2} mm)",
            set.poses[self.from].name,
            self.from + 1,
            set.poses.len(),
            if rows == 1 { "row" } else { "rows" },
            if self.by > 0 { "further down" } else { "further up" },
            self.before_mm,
            self.after_mm
        )
    }
}

/// The set with readings at the rows that they are of, and what was wrong.
pub fn examine(set: &Dataset, robot: &Robot) -> (Dataset, Option<Finding>) {
    let Some(shift) = find(set, robot) else { return (set.clone(), None) };
    let action = "mended for this run: look for a picture that failed or was taken twice there, and mend the file (`examine = false` in \
                  [identify] takes it as it is)";
    (mended(set, &shift), Some(Finding::new(shift.statement(set), action)))
}

/// Looks for a shift.
pub fn find(set: &Dataset, robot: &Robot) -> Option<Shift> {
    let rows = Rows::new(set, robot)?;
    let count = rows.points.len();
    let before = rows.left(count, 0);
    let last = count - FEWEST;
    let step = (count / GRID).max(1);
    let shifts = || (-MOST..=MOST).filter(|by| *by != 0);
    let best_of = |starts: Vec<(usize, isize)>| {
        let left: Vec<_> = starts.into_par_iter().map(|(from, by)| (rows.left(from, by), from, by)).collect();
        left.into_iter().min_by(|a, b| a.0.mean.total_cmp(&b.0.mean))
    };
    let starts = (0..=last).step_by(step);
    let (_, near, by) = best_of(starts.flat_map(|from| shifts().map(move |by| (from, by))).collect())?;
    let between = near.saturating_sub(step)..=(near + step).min(last);
    let (after, from, by) = best_of(between.map(|from| (from, by)).collect())?;
    let behind =
        |left: &Left| median((from..count).filter(|&i| after.errors[i].is_some()).filter_map(|i| left.errors[i]));
    let (before_mm, after_mm) = (behind(&before)?, behind(&after)?);
    let tried = (count * 2 * MOST.unsigned_abs()) as f64;
    let gain = 3.0 * count as f64 * (before.mean / after.mean.max(f64::MIN_POSITIVE)).ln();
    let told = after.errors[from..].iter().flatten().count() >= FEWEST
        && after_mm * EXPLAINS < before_mm
        && gain > EVIDENCE + tried.ln()
        && rows.placed_anew(from, &after.tool_mm)? > BEATS * after_mm;
    told.then_some(Shift { from, by, before_mm, after_mm })
}

/// Each reading at the row that it is of; rows that get none are left out.
fn mended(set: &Dataset, shift: &Shift) -> Dataset {
    let count = set.poses.len();
    let mut of_row: Vec<Option<usize>> = (0..count).map(|i| (i < shift.from).then_some(i)).collect();
    for reading in shift.from..count {
        if let Some(row) = reading.checked_add_signed(shift.by).filter(|row| *row < count) {
            of_row[row] = Some(reading);
        }
    }
    let mut mended = set.clone();
    for (row, reading) in of_row.iter().enumerate() {
        let Some(reading) = *reading else { continue };
        mended.poses[row].reading = set.poses[reading].reading.clone();
        mended.poses[row].on_body_mm = set.poses[reading].on_body_mm;
        if let (Some(to), Some(from)) = (mended.shared.get_mut(row), set.shared.get(reading)) {
            to.clone_from(from);
        }
    }
    let alone: Vec<usize> = (0..count).filter(|&row| of_row[row].is_none()).collect();
    mended.without(&alone, "no reading belongs to it: points and joint angles are shifted")
}

impl Rows {
    /// `None` of sets of anything but whole points, and of too few.
    pub(super) fn new(set: &Dataset, robot: &Robot) -> Option<Rows> {
        let whole = set.poses.iter().all(|pose| pose.on_body_mm.is_none());
        if set.kind != Kind::Positions || set.poses.len() < FEWEST_ROWS || !whole {
            return None;
        }
        let flanges: Vec<Transform> = set.poses.iter().map(|pose| robot.base_from_flange(&pose.joints_rad)).collect();
        Some(Rows {
            origins: flanges.iter().map(|f| f.translation.vector).collect(),
            rotations: flanges.iter().map(rotation_matrix).collect(),
            groups: set.poses.iter().map(|pose| pose.group).collect(),
            points: set.poses.iter().map(|pose| pose.reading.point_mm()).collect::<Option<Vec<_>>>()?,
            tool_mm: robot.tool_mm,
        })
    }

    /// The distance of each reading with the target's place free; infinite where too few rows place it.
    pub(super) fn errors_mm(&self, rounds: usize) -> Vec<f64> {
        let (distances, _) = self.distances(&self.pairs(self.points.len(), 0), self.tool_mm, true, rounds);
        distances.into_iter().map(|distance| distance.unwrap_or(f64::INFINITY)).collect()
    }

    /// Pairs of a row and the reading that belongs to it.
    fn pairs(&self, from: usize, by: isize) -> Vec<(usize, usize)> {
        let count = self.points.len();
        let of = |reading: usize| {
            let row = if reading < from { Some(reading) } else { reading.checked_add_signed(by) };
            row.filter(|row| *row < count).map(|row| (row, reading))
        };
        (0..count).filter_map(of).collect()
    }

    fn target(&self, row: usize, tool_mm: &Vector3<f64>) -> Point3<f64> {
        (self.origins[row] + self.rotations[row] * tool_mm).into()
    }

    /// The frames of the groups of these pairs, by their index.
    fn frames(&self, pairs: &[(usize, usize)], weights: &[f64], tool_mm: &Vector3<f64>) -> Vec<Option<Transform>> {
        let groups = self.groups.iter().max().map_or(0, |most| most + 1);
        let frame = |group: usize| {
            let of_group = || pairs.iter().zip(weights).filter(move |((row, _), _)| self.groups[*row] == group);
            (of_group().count() >= 3).then(|| {
                fitted_frame(
                    of_group().map(|((row, reading), w)| (self.target(*row, tool_mm), self.points[*reading], *w)),
                )
            })
        };
        (0..groups).map(frame).collect()
    }

    /// The distances of these pairs with frames and tool at the least sum of them.
    fn distances(
        &self,
        pairs: &[(usize, usize)],
        mut tool_mm: Vector3<f64>,
        tool_free: bool,
        rounds: usize,
    ) -> (Vec<Option<f64>>, Vector3<f64>) {
        let mut weights = vec![1.0; pairs.len()];
        let mut errors = Vec::new();
        for _ in 0..rounds {
            let frames = self.frames(pairs, &weights, &tool_mm);
            if tool_free {
                tool_mm = self.tool(pairs, &weights, &frames).unwrap_or(tool_mm);
            }
            let error = |(row, reading): &(usize, usize)| {
                let frame = frames[self.groups[*row]].as_ref()?;
                Some((frame * self.target(*row, &tool_mm) - self.points[*reading]).norm())
            };
            errors = pairs.iter().map(error).collect();
            let floor = (0.1 * median(errors.iter().flatten().copied()).unwrap_or(0.0)).max(1e-9);
            weights = errors.iter().map(|e| e.map_or(0.0, |e: f64| 1.0 / e.max(floor))).collect();
        }
        (errors, tool_mm)
    }

    /// The target's place that brings the pairs together best in these frames.
    fn tool(&self, pairs: &[(usize, usize)], weights: &[f64], frames: &[Option<Transform>]) -> Option<Vector3<f64>> {
        let (mut normal, mut pull) = (Matrix3::zeros(), Vector3::zeros());
        for ((row, reading), weight) in pairs.iter().zip(weights) {
            let Some(frame) = &frames[self.groups[*row]] else { continue };
            let turn = rotation_matrix(frame) * self.rotations[*row];
            normal += *weight * turn.transpose() * turn;
            pull += *weight * turn.transpose() * (self.points[*reading] - frame * Point3::from(self.origins[*row]));
        }
        normal.cholesky().map(|c| c.solve(&pull))
    }

    /// With the readings from a row on shifted by so many.
    fn left(&self, from: usize, by: isize) -> Left {
        let pairs = self.pairs(from, by);
        let (distances, tool_mm) = self.distances(&pairs, self.tool_mm, true, ROUNDS);
        let mut errors = vec![None; self.points.len()];
        for ((_, reading), distance) in pairs.iter().zip(distances) {
            errors[*reading] = distance;
        }
        let known: Vec<f64> = errors.iter().flatten().copied().collect();
        Left { mean: known.iter().sum::<f64>() / known.len().max(1) as f64, errors, tool_mm }
    }

    /// Median distance of the readings from a row on where they stand as they are and only the sensor was moved.
    fn placed_anew(&self, from: usize, tool_mm: &Vector3<f64>) -> Option<f64> {
        let pairs: Vec<(usize, usize)> = (from..self.points.len()).map(|i| (i, i)).collect();
        let (distances, _) = self.distances(&pairs, *tool_mm, false, ROUNDS);
        // A group of so few that a placement takes up everything tells nothing for another placement.
        Some(median(distances.into_iter().flatten()).unwrap_or(f64::INFINITY))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Measurement;

    /// Moves the readings from a row on, as if pictures had failed or one had been taken twice: each is of the pose
    /// `by` rows further down.
    fn planted(rows: &[Measurement], from: usize, by: isize) -> Vec<Measurement> {
        let of = |(i, row): (usize, &Measurement)| {
            let pose = if i < from { Some(i) } else { i.checked_add_signed(by) };
            let source = pose.and_then(|pose| rows.get(pose))?;
            Some(Measurement { observed: source.observed.clone(), ..row.clone() })
        };
        rows.iter().enumerate().filter_map(of).collect()
    }

    #[test]
    fn planted_shifts_are_found_with_row_and_size() {
        for (samples, seed) in [(16, 1), (36, 2), (150, 3)] {
            let world = synthetic::planned(samples, 0, 25.0, 0.02, seed, &|_| {});
            let count = world.rows.len();
            for by in [1, 2, -1] {
                for from in [0, count / 2] {
                    let rows = planted(&world.rows, from, by);
                    // Where the first rows have no reading the table starts later.
                    let dropped = if by < 0 && from == 0 { by.unsigned_abs() } else { 0 };
                    let set = Dataset::new(&rows).unwrap();
                    let found = find(&set, &world.nominal);
                    let said = format!("{count} rows, from {from} by {by}: {found:?}");
                    let shift = found.expect(&said);
                    assert_eq!(shift.by, by, "{said}");
                    assert!(shift.from + dropped >= from && shift.from <= from + 1, "{said}");
                    let (mended, finding) = examine(&set, &world.nominal);
                    assert!(finding.unwrap().finding.contains("do not belong together"));
                    assert!(find(&mended, &world.nominal).is_none(), "{said}: mended, and found again");
                }
            }
        }
    }

    #[test]
    fn clean_tables_and_moved_cameras_raise_no_alarm() {
        for seed in 0..40 {
            let samples = [8, 20, 60, 120][seed as usize % 4];
            let mut world = synthetic::planned(samples, 4, [25.0, 5.0][seed as usize % 2], 0.1, seed, &|_| {});
            assert_eq!(find(&Dataset::new(&world.rows).unwrap(), &world.nominal), None, "{seed}");
            // The cameras were knocked halfway.
            let half = world.rows.len() / 2;
            for row in &mut world.rows[half..] {
                let point = synthetic::point(row);
                *point =
                    crate::geometry::transform(Vector3::new(0.1, 0.0, 0.05), Vector3::new(20.0, 0.0, 0.0)) * *point;
            }
            assert_eq!(find(&Dataset::new(&world.rows).unwrap(), &world.nominal), None, "{seed}, cameras moved");
        }
    }
}
