//! What is wrong with the orientations of points: degrees for radians, angles about fixed axes for a rotation vector.
//!
//! In: a data set and the nominal robot. Out: the set as the best hypothesis has it, and its name. The turn of the target between two
//! poses of a placement is that of the flange, whatever the sensor's frame and the target's are; where the two differ, each hypothesis is
//! tried, and the one with which they agree is taken.
//! What goes wrong: an inverse rotation turns by the same angle, and is not told from the rotation.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector3};

use crate::identify::data::dataset::{Dataset, Pose, Reading};
use crate::identify::finding::Finding;
use crate::robot::Robot;
use crate::statistics::median;

/// Median difference of turns that no built robot has, rad.
const IMPLAUSIBLE_RAD: f64 = 0.05;

/// A hypothesis explains what is wrong when it brings the difference down by this factor.
const EXPLAINS: f64 = 4.0;

/// Pairs of poses that are enough to tell.
const PAIRS: usize = 200;

/// A rotation from three numbers.
type Reader = fn(Vector3<f64>) -> UnitQuaternion<f64>;

/// Ways in which three numbers may have been meant, and their names.
const HYPOTHESES: [(&str, Reader); 3] = [
    ("rotation vectors in degrees, not in radians", |v| UnitQuaternion::from_scaled_axis(v * PI / 180.0)),
    ("angles about fixed x, y and z, not rotation vectors", of_fixed_axes),
    ("angles about fixed x, y and z in degrees, not rotation vectors in radians", |v| of_fixed_axes(v * PI / 180.0)),
];

fn of_fixed_axes(v: Vector3<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(v.x, v.y, v.z)
}

/// The set with orientations that go with the joints, and what was wrong with them. Those that don't are left out unless they are `asked` for.
pub fn examine(set: &Dataset, robot: &Robot, asked: bool) -> (Dataset, Option<Finding>) {
    let mut set = set.clone();
    let Some(as_read) = difference_rad(&set, robot, UnitQuaternion::from_scaled_axis) else { return (set, None) };
    if as_read < IMPLAUSIBLE_RAD {
        return without_turned(set, robot, EXPLAINS * as_read);
    }
    let tried =
        HYPOTHESES.iter().filter_map(|(name, reader)| Some((difference_rad(&set, robot, *reader)?, name, reader)));
    let best = tried.min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((left, name, reader)) = best.filter(|(left, ..)| left * EXPLAINS < as_read) else {
        let said = format!(
            "the orientations contradict the joint angles: between poses the target turns by {:.1} deg more or less than the flange",
            as_read.to_degrees()
        );
        if !asked {
            for pose in &mut set.poses {
                if let Reading::Position { rotation_rad, .. } = &mut pose.reading {
                    *rotation_rad = None;
                }
            }
        }
        let action = "they are left out unless `--model pose` asks for them; look at rx_rad, ry_rad, rz_rad";
        return (set, Some(Finding::new(said, action)));
    };
    for pose in &mut set.poses {
        if let Reading::Position { rotation_rad: Some(rotation), .. } = &mut pose.reading {
            *rotation = reader(*rotation).scaled_axis();
        }
    }
    let said = format!(
        "the orientations are {name} (turns between poses differ from the flange's by {:.2} deg, before by {:.1})",
        left.to_degrees(),
        as_read.to_degrees()
    );
    let action = "mended for this run; mend the file (`examine = false` in [identify] takes it as it is)";
    (set, Some(Finding::new(said, action)))
}

/// Several targets count with their turn; a pose whose turn is another one is left out. Their lengths don't tell the names of targets that
/// stand alike, of an even triangle say, but turned by the exchange they are.
fn without_turned(set: Dataset, robot: &Robot, usual_rad: f64) -> (Dataset, Option<Finding>) {
    if set.targets.is_none() {
        return (set, None);
    }
    let turn = |pose: &Pose| {
        let read = UnitQuaternion::from_scaled_axis(pose.reading.rotation_rad()?);
        Some((read, robot.base_from_flange(&pose.joints_rad).rotation))
    };
    let turns: Vec<_> = set.poses.iter().map(turn).collect();
    let is_turned = |&row: &usize| {
        let of_group = set.rows(|p| p.group == set.poses[row].group);
        let step = (of_group.len() / PAIRS).max(1);
        let others = of_group.into_iter().step_by(step).filter(|&other| other != row);
        let difference = |other: usize| {
            let ((a, flange_a), (b, flange_b)) = (turns[row]?, turns[other]?);
            Some((a.angle_to(&b) - flange_a.angle_to(&flange_b)).abs())
        };
        median(others.filter_map(difference)).is_some_and(|off| off > usual_rad.max(IMPLAUSIBLE_RAD))
    };
    let turned: Vec<usize> = (0..set.poses.len()).filter(is_turned).collect();
    if turned.is_empty() {
        return (set, None);
    }
    let finding = Finding::new(
        "the targets are turned otherwise than the flange, as where the names of two are exchanged",
        "left out; look at their names in `target`",
    )
    .about(set.names(&turned));
    (set.without(&turned, "the targets are turned otherwise than the flange"), Some(finding))
}

/// Median difference between the target's turn from pose to pose and the flange's, rad; `None` without orientations in two poses of one
/// group.
fn difference_rad(set: &Dataset, robot: &Robot, reader: Reader) -> Option<f64> {
    let oriented = |row: usize| set.poses[row].reading.rotation_rad().map(reader);
    let flange = |row: usize| robot.base_from_flange(&set.poses[row].joints_rad).rotation;
    let mut differences = Vec::new();
    for group in 0..set.groups.len() {
        let rows = set.rows(|p| p.group == group);
        for two in rows.windows(2).take(PAIRS) {
            if let (Some(a), Some(b)) = (oriented(two[0]), oriented(two[1])) {
                differences.push((a.angle_to(&b) - flange(two[0]).angle_to(&flange(two[1]))).abs());
            }
        }
    }
    median(differences)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Observed;

    /// What is said of orientations that are written in this way.
    fn said(written: Writer) -> (Dataset, Dataset, Option<String>) {
        let world = synthetic::world(40, 0.0, 2);
        let sensor = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.7, 1.1));
        let target = UnitQuaternion::from_scaled_axis(Vector3::new(2.0, 0.5, -0.4));
        let rows = |written: Writer| {
            let mut rows = world.rows.clone();
            for row in &mut rows {
                let turn = sensor * world.truth.base_from_flange(&row.at.joints_rad()).rotation * target;
                if let Observed::Position { rotation_rad, .. } = &mut row.observed {
                    *rotation_rad = Some(written(turn));
                }
            }
            Dataset::new(&rows).unwrap()
        };
        let (right, read) = (rows(&|r| r.scaled_axis()), rows(written));
        let (mended, finding) = examine(&read, &world.nominal, false);
        (right, mended, finding.map(|f| f.finding))
    }

    /// How orientations are written.
    type Writer<'a> = &'a dyn Fn(UnitQuaternion<f64>) -> Vector3<f64>;

    fn fixed_axes(r: UnitQuaternion<f64>) -> Vector3<f64> {
        let (x, y, z) = r.euler_angles();
        Vector3::new(x, y, z)
    }

    #[test]
    fn rotation_vectors_in_radians_are_taken_as_they_are() {
        let (right, mended, said) = said(&|r| r.scaled_axis());
        assert_eq!((mended, said), (right, None));
    }

    #[test]
    fn other_ways_of_writing_them_are_named_and_mended() {
        let degrees = |v: Vector3<f64>| v * 180.0 / PI;
        let ways: [(Writer, &str); 3] = [
            (&|r| degrees(r.scaled_axis()), "rotation vectors in degrees"),
            (&fixed_axes, "angles about fixed x, y and z, not"),
            (&|r| degrees(fixed_axes(r)), "angles about fixed x, y and z in degrees"),
        ];
        for (written, name) in ways {
            let (right, mended, said) = said(written);
            assert!(said.as_ref().is_some_and(|s| s.contains(name)), "{name}: {said:?}");
            for (a, b) in right.poses.iter().zip(&mended.poses) {
                let [a, b] = [a, b].map(|p| UnitQuaternion::from_scaled_axis(p.reading.rotation_rad().unwrap()));
                assert!(a.angle_to(&b) < 1e-6, "{name}");
            }
        }
    }

    #[test]
    fn orientations_of_other_poses_are_said_to_be_so() {
        let counter = std::cell::Cell::new(0.0);
        let (.., said) = said(&|_| {
            counter.set(counter.get() + 1.3);
            Vector3::new(counter.get() % 3.0, 0.7, 0.1)
        });
        assert!(said.is_some_and(|s| s.contains("contradict the joint angles")));
    }
}
