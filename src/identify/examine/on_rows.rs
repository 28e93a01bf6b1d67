//! What is wrong between a table and a robot that is to stay as its file has it, mended in the table.
//!
//! In: a set, and a robot as it is and as it was mended. Out: the set with joints that this robot takes as the mended
//! one takes those of the table. Of several robots each takes the rows as it counts its joints. And, for a robot whose
//! accuracy is known, what brings the rows back to it: units, signs and columns. Goes wrong: links that were mended are
//! no matter of the rows; a robot that changed and rows in other conventions at once.

use rayon::prelude::*;

use super::hypothesis::{Hypothesis, hypotheses};
use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::identify::settings::Settings;
use crate::identify::solve::task::Task;
use crate::robot::Robot;

/// Times that the rows must come nearer to a robot that is known.
const STRIKING: f64 = 10.0;

/// Times that a robot of a run of several is nearer to the rows as they are written, where it counts its joints so.
const NEARER: f64 = 4.0;

/// Times what 95 % of its errors are below, within which rows are those of a robot.
const WITHIN: f64 = 2.0;

/// The rows as the robot takes them, where the mended one differs by signs and zeros of joints alone; `None` where
/// links differ.
pub fn mended(set: &Dataset, robot: &Robot, mended: &Robot) -> Option<Dataset> {
    let mut same_links = mended.clone();
    for (joint, own) in same_links.joints.iter_mut().zip(&robot.joints) {
        (joint.sign, joint.theta_rad) = (own.sign, own.theta_rad);
    }
    if same_links != *robot {
        return None;
    }
    let mut set = set.clone();
    for pose in &mut set.poses {
        let joints = pose.joints_rad.iter_mut().zip(robot.joints.iter().zip(&mended.joints));
        for (q, (own, mended)) in joints {
            let zero = if own.slides { 0.0 } else { mended.theta_rad - own.theta_rad };
            *q = own.sign * (mended.sign * *q + zero);
        }
    }
    Some(set)
}

/// How far a robot is off the rows as it is, with nothing but the sensor placed: mm a coordinate, or the first figure
/// beyond `hopeless_mm`.
fn left_mm(set: &Dataset, robot: &Robot, settings: &Settings, hopeless_mm: f64) -> f64 {
    let rows = set.fit_rows();
    Task::plain(set, robot, &[], &rows, settings).unfitted_mm(hopeless_mm)
}

/// The rows as a robot takes them: those that were mended for another one, or where it counts its joints as they are
/// written, these. A robot that was identified from such rows has their signs and zeros in its file.
pub fn taken<'a>(written: &'a Dataset, mended: &'a Dataset, robot: &Robot, settings: &Settings) -> &'a Dataset {
    let [as_written, as_mended] = [written, mended].map(|set| left_mm(set, robot, settings, f64::INFINITY));
    if NEARER * as_written < as_mended { written } else { mended }
}

/// What was found wrong with rows of a robot that is known.
#[derive(Debug, Clone, PartialEq)]
pub struct OfKnown {
    pub set: Dataset,
    pub finding: Finding,
}

/// What of units, signs and columns brings the rows back to a robot of which 95 % of the errors are below `p95_mm`.
pub fn of_known(set: &Dataset, robot: &Robot, p95_mm: f64, settings: &Settings) -> Option<OfKnown> {
    let now_mm = left_mm(set, robot, settings, f64::INFINITY);
    if now_mm < STRIKING * p95_mm {
        return None;
    }
    let of = |h: &Hypothesis| {
        let (rows, robot_then) = h.applied(set, robot);
        let rows = mended(&rows, robot, &robot_then)?;
        let there_mm = left_mm(&rows, robot, settings, now_mm);
        let is_length = h.factor() != 1.0;
        let explains = STRIKING * there_mm < now_mm && (is_length || there_mm < WITHIN * p95_mm);
        explains.then_some((there_mm, *h, rows))
    };
    let found: Vec<(f64, Hypothesis, Dataset)> = hypotheses(set, robot).par_iter().filter_map(of).collect();
    let (there_mm, hypothesis, mended) = found.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    let finding = Finding::new(
        format!("{} (the errors fall from {now_mm:.2} to {there_mm:.3} mm)", hypothesis.name()),
        "mended for this run; mend the file",
    );
    let rows = set.names(&hypothesis.rows(set));
    Some(OfKnown { set: mended, finding: finding.about(rows) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic::{planned, point};

    #[test]
    fn rows_in_other_conventions_come_back_to_a_robot_that_is_known() {
        let world = planned(24, 0, 25.0, 0.05, 4, &|_| {});
        let said = |change: &dyn Fn(&mut crate::measurements::Measurement)| {
            let mut rows = world.rows.clone();
            rows.iter_mut().for_each(change);
            let set = Dataset::new(&rows).unwrap();
            of_known(&set, &world.truth, 0.15, &Settings::default())
        };
        assert_eq!(said(&|_| {}), None);
        let metres = said(&|row| point(row).coords /= 1000.0).unwrap();
        assert!(metres.finding.finding.contains("the readings are in m, not in mm"), "{metres:?}");
        let sign = said(&|row| row.at.joints_deg[2] *= -1.0).unwrap();
        assert!(sign.finding.finding.contains("joint 3 is counted the other way round"), "{sign:?}");
        // The robot that is off by some degrees has changed, and so have two of its joints.
        for by_deg in [0.1, 1.0, 5.0] {
            assert_eq!(said(&|row| row.at.joints_deg[2] += by_deg), None, "{by_deg}");
        }
    }

    /// Of a robot that is off either way nothing says how it counts.
    #[test]
    fn each_robot_takes_the_rows_as_it_counts_its_joints() {
        let world = planned(24, 0, 25.0, 0.05, 4, &|_| {});
        let written = Dataset::new(&world.rows).unwrap();
        let mut other = world.truth.clone();
        other.joints[2].sign = -1.0;
        let turned = mended(&written, &other, &world.truth).unwrap();
        let is_written = |robot: &Robot| taken(&written, &turned, robot, &Settings::default()) == &written;
        assert!(is_written(&world.truth) && !is_written(&other));
        let mut point = world.truth.clone();
        point.tool_mm = nalgebra::Vector3::zeros();
        point.joints.iter_mut().for_each(|joint| (joint.a_mm, joint.d_mm) = (0.0, 0.0));
        assert!(!is_written(&point));
    }

    #[test]
    fn signs_and_zeros_are_mended_in_the_rows() {
        let world = planned(8, 0, 25.0, 0.0, 4, &|_| {});
        let set = Dataset::new(&world.rows).unwrap();
        let mut other = world.truth.clone();
        other.joints[2].sign = -1.0;
        other.joints[4].theta_rad += 1.5;
        let rows = mended(&set, &world.truth, &other).unwrap();
        for (pose, before) in rows.poses.iter().zip(&set.poses) {
            let off = world.truth.target_mm(&pose.joints_rad) - other.target_mm(&before.joints_rad);
            assert!(off.norm() < 1e-9);
        }
        other.joints[1].a_mm += 1.0;
        assert_eq!(mended(&set, &world.truth, &other), None);
    }
}
