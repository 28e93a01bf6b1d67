//! Readings that were repeated at one pose, as trackers measure: their mean, and their scatter.
//!
//! In: rows of measurements. Out: one row for rows of one group and role that follow each other with the same joints,
//! and the standard deviation of a coordinate within them: what the instrument repeats. It says nothing about the
//! robot, which stood still, so that as rows of their own they would count one error of the robot several times. A pose
//! that the robot came back to is another row. One reading of three or more that is far from the others of its pose was
//! misread, and is left out; of two nobody knows which. Two that are as far from each other at every pose are of two
//! points.

use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

use crate::identify::finding::Finding;
use crate::measurements::{Measurement, Observed, Role};
use crate::statistics::median;

/// Readings of a pose that tell which of them was misread.
const TELL: usize = 3;

/// Times what readings are off the median of their pose, and mm at the least, that a reading which was misread is: an
/// instrument drifts and settles by some times that, and by less than an arm repeats to.
const FAR: f64 = 12.0;
const LEAST_MM: f64 = 0.2;

/// Readings of one place are nearer to each other than this, mm, and those of two poses farther apart.
const ONE_PLACE_MM: f64 = 1.0;

/// Rows that were made one a pose, and what was repeated.
pub type AsOne = (Vec<Measurement>, Option<Repeats>);

/// Readings repeated at one pose.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Repeats {
    /// Readings in all, of the poses that have several.
    pub readings: usize,
    /// Poses that have several.
    pub poses: usize,
    /// Standard deviation of a coordinate, or of a distance, within a pose, mm.
    pub scatter_mm: f64,
    /// Those that were misread and left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub misread: Vec<String>,
    /// How far the two readings of each pose are from each other, where that is the same at all poses, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub two_points_mm: Option<f64>,
}

impl Repeats {
    /// For the terminal and the page.
    pub fn sentence(&self) -> String {
        format!(
            "{} readings were repeated at {} poses: each pose counts once, with their mean; the instrument repeats to {:.4} mm",
            self.readings, self.poses, self.scatter_mm
        )
    }

    /// That readings are of two points, whose mean is none.
    pub fn of_two_points(&self) -> Option<Finding> {
        let said = format!(
            "the two readings of each pose are {:.3} mm from each other at all poses: they are of two tools or targets, and their mean is of none",
            self.two_points_mm?
        );
        Some(Finding::new(said, "identify each by itself, or name them in a column `target`"))
    }

    /// What was misread.
    pub fn finding(&self) -> Option<Finding> {
        let said = match self.misread.len() {
            0 => return None,
            1 => "1 reading is far from the others of its pose".to_owned(),
            count => format!("{count} readings are far from the others of their poses"),
        };
        Some(Finding::new(said, "left out: the others of the pose are used").about(self.misread.clone()))
    }
}

/// One row a pose.
pub fn as_one(rows: &[Measurement]) -> AsOne {
    as_one_where(rows, same)
}

/// The same with readings that follow each other at equal joints far from each other left as they are: they are of two
/// poses where joints and points are shifted. `None` where there are none.
pub fn apart(rows: &[Measurement]) -> Option<AsOne> {
    let is_apart = |pair: &[Measurement]| same(&pair[0], &pair[1]) && !near(&pair[0], &pair[1]);
    rows.windows(2).any(is_apart).then(|| as_one_where(rows, |a, b| same(a, b) && near(a, b)))
}

/// Whether two rows are readings of one pose, by what is written.
fn same(a: &Measurement, b: &Measurement) -> bool {
    a.at.role != Role::Center
        && (a.at.role, &a.at.group, &a.at.joints_deg, &a.target)
            == (b.at.role, &b.at.group, &b.at.joints_deg, &b.target)
        && numbers(a).is_some_and(|n| numbers(b).is_some_and(|m| m.len() == n.len()))
}

fn near(a: &Measurement, b: &Measurement) -> bool {
    let apart = |(n, m): (Vec<f64>, Vec<f64>)| n.iter().zip(&m).map(|(n, m)| (n - m).powi(2)).sum::<f64>().sqrt();
    numbers(a).zip(numbers(b)).map(apart).is_some_and(|mm| mm < ONE_PLACE_MM)
}

fn as_one_where(rows: &[Measurement], same: impl Fn(&Measurement, &Measurement) -> bool + Copy) -> AsOne {
    let mut merged = Vec::with_capacity(rows.len());
    let (mut readings, mut poses, mut squares, mut freedom) = (0, 0, 0.0, 0usize);
    let mut apart_mm = Vec::new();
    let far = misread(rows, same);
    let misread = far.iter().map(|&row| rows[row].at.pose.clone()).collect();
    let kept = rows.iter().enumerate().filter(|(row, _)| !far.contains(row));
    let rows: Vec<Measurement> = kept.map(|(_, row)| row.clone()).collect();
    for pose in rows.chunk_by(same) {
        merged.push(mean(pose));
        if pose.len() > 1 {
            readings += pose.len();
            poses += 1;
            let all: Vec<Vec<f64>> = pose.iter().filter_map(numbers).collect();
            for k in 0..all[0].len() {
                let middle = all.iter().map(|n| n[k]).sum::<f64>() / all.len() as f64;
                squares += all.iter().map(|n| (n[k] - middle).powi(2)).sum::<f64>();
                freedom += all.len() - 1;
            }
            if let [Observed::Position { point_mm: a, .. }, Observed::Position { point_mm: b, .. }] =
                pose.iter().map(|row| &row.observed).collect::<Vec<_>>()[..]
            {
                apart_mm.push((a - b).norm());
            }
        }
    }
    let scatter_mm = (squares / freedom.max(1) as f64).sqrt();
    let two_points_mm = same_everywhere(&apart_mm);
    (merged, (poses > 0).then_some(Repeats { readings, poses, scatter_mm, misread, two_points_mm }))
}

/// A distance that is the same at all poses, within a tenth: of lengths that an instrument's scatter makes, one in six
/// is so near to their median.
fn same_everywhere(lengths_mm: &[f64]) -> Option<f64> {
    const FEWEST: usize = 8;
    const SHARE: f64 = 0.1;
    let middle = median(lengths_mm.iter().copied()).filter(|&mm| lengths_mm.len() >= FEWEST && mm > LEAST_MM)?;
    lengths_mm.iter().all(|mm| (mm - middle).abs() < SHARE * middle).then_some(middle)
}

/// The readings that are far from the median of their pose, by their row.
fn misread(rows: &[Measurement], same: impl Fn(&Measurement, &Measurement) -> bool) -> Vec<usize> {
    let mut start = 0;
    let mut all: Vec<(f64, usize)> = Vec::new();
    for pose in rows.chunk_by(same) {
        let read: Vec<Vec<f64>> = pose.iter().filter_map(numbers).collect();
        if read.len() >= TELL {
            let middle = |k: usize| median(read.iter().map(|n| n[k])).unwrap_or(0.0);
            let off = |n: &Vec<f64>| (0..n.len()).map(|k| (n[k] - middle(k)).powi(2)).sum::<f64>().sqrt();
            all.extend(read.iter().map(off).zip(start..));
        }
        start += pose.len();
    }
    let usual = median(all.iter().map(|(off, _)| *off)).unwrap_or(0.0);
    let is_far = |off: f64| off > (FAR * usual).max(LEAST_MM);
    all.into_iter().filter(|(off, _)| is_far(*off)).map(|(_, row)| row).collect()
}

/// What was read, where it can be averaged; a touch says that the target was there, and has nothing to average.
fn numbers(row: &Measurement) -> Option<Vec<f64>> {
    match &row.observed {
        Observed::Position { point_mm, .. } => Some(point_mm.coords.iter().copied().collect()),
        Observed::Distance { distance_mm, .. } if *distance_mm > 0.0 => Some(vec![*distance_mm]),
        _ => None,
    }
}

/// The mean of what was read at one pose. Its covariance is that of one reading: what is stated may be shared by all of
/// them.
fn mean(rows: &[Measurement]) -> Measurement {
    let mut one = rows[0].clone();
    let count = rows.len() as f64;
    match &mut one.observed {
        Observed::Position { point_mm, covariance_mm2, .. } => {
            let points = rows.iter().filter_map(|r| match &r.observed {
                Observed::Position { point_mm, .. } => Some(point_mm.coords),
                _ => None,
            });
            point_mm.coords = points.sum::<Vector3<f64>>() / count;
            let covariance = |r: &Measurement| match r.observed {
                Observed::Position { covariance_mm2, .. } => covariance_mm2,
                _ => None,
            };
            let stated: Option<Vec<Matrix3<f64>>> = rows.iter().map(covariance).collect();
            *covariance_mm2 = stated.map(|all| all.iter().sum::<Matrix3<f64>>() / count);
        }
        Observed::Distance { distance_mm, .. } => {
            *distance_mm = rows.iter().filter_map(numbers).map(|n| n[0]).sum::<f64>() / count;
        }
        Observed::Missing { .. } => {}
    }
    one
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use nalgebra::Point3;

    fn row(joint: f64, x: f64) -> Measurement {
        let observed = synthetic::seen_at(Point3::new(x, 0.0, 0.0));
        synthetic::row(format!("{joint} {x}"), "g", Role::Sample, vec![joint], observed)
    }

    #[test]
    fn readings_at_one_pose_are_one_with_their_scatter() {
        let (rows, repeats) = as_one(&[row(1.0, 0.1), row(1.0, 0.3), row(2.0, 5.0), row(1.0, 7.0)]);
        assert_eq!(rows.iter().map(|r| numbers(r).unwrap()[0]).collect::<Vec<_>>(), [0.2, 5.0, 7.0]);
        let repeats = repeats.unwrap();
        assert_eq!((repeats.readings, repeats.poses), (2, 1));
        assert!((repeats.scatter_mm - (0.02f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(as_one(&[row(1.0, 0.1), row(2.0, 0.3)]).1, None);
    }

    #[test]
    fn a_reading_that_was_misread_is_named_and_left_out() {
        let triples: Vec<Measurement> = (0..8)
            .flat_map(|k| [0.0, 0.01, 0.02].map(|dx| row(f64::from(k), 100.0 + 7.0 * f64::from(k) + dx)))
            .collect();
        assert!(as_one(&triples).1.unwrap().misread.is_empty());
        for by_mm in [1.0, 10.0, 1e3, 1e7] {
            let mut rows = triples.clone();
            rows[10] = row(3.0, 121.01 + by_mm);
            let (merged, repeats) = as_one(&rows);
            let repeats = repeats.unwrap();
            assert_eq!(repeats.misread, [rows[10].at.pose.clone()], "{by_mm}");
            assert!(repeats.finding().unwrap().sentence().starts_with("1 reading is far from the others of its pose"));
            assert!(
                merged.len() == 8
                    && repeats.scatter_mm < 0.02
                    && (numbers(&merged[3]).unwrap()[0] - 121.01).abs() < 1e-9
            );
        }
        // Of two readings nobody knows which is wrong.
        assert!(as_one(&[row(1.0, 0.1), row(1.0, 90.0), row(2.0, 5.0)]).1.unwrap().misread.is_empty());
    }

    #[test]
    fn two_points_that_were_read_in_turn_are_no_repeated_readings() {
        let world = synthetic::planned(40, 0, 25.0, 0.05, 1, &|_| {});
        for (by_mm, varied, told) in [(5.0, 0.0, true), (0.3, 0.0, true), (5.0, 0.5, false), (0.02, 0.0, false)] {
            let both = |(k, row): (usize, &Measurement)| {
                let mut other = row.clone();
                other.at.pose += "b";
                synthetic::point(&mut other).x += by_mm * (1.0 + varied * (k as f64).sin());
                [row.clone(), other]
            };
            let rows = world.rows.iter().filter(|row| row.at.role != Role::Center);
            let rows: Vec<Measurement> = rows.enumerate().flat_map(both).collect();
            let set = crate::identify::data::dataset::Dataset::new(&rows).unwrap();
            let repeats = set.repeats.unwrap();
            assert_eq!((repeats.of_two_points().is_some(), repeats.poses), (told, 40), "{by_mm} {varied}");
        }
    }

    #[test]
    fn readings_far_from_each_other_are_apart() {
        let is_apart = |by_mm: f64| apart(&[row(1.0, 0.1), row(1.0, 0.1 + by_mm), row(2.0, 5.0), row(2.0, 5.2)]);
        for by_mm in [0.0, 0.02, 0.9] {
            assert_eq!(is_apart(by_mm), None, "{by_mm}");
        }
        for by_mm in [1.1, 20.0, 1e4] {
            let (rows, repeats) = is_apart(by_mm).unwrap();
            assert_eq!((rows.len(), repeats.unwrap().poses), (3, 1), "{by_mm}");
        }
    }
}
