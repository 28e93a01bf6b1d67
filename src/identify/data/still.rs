//! What did not move: poses that the robot came back to, joints that are the same in all rows, and how far each joint
//! moves the target.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::Point3;

use super::dataset::{Dataset, Pose};
use crate::identify::Error;
use crate::robot::Robot;
use crate::robot::tool_fit::middle_spread;

/// Joints within this, rad or mm, are the same.
const SAME_JOINT: f64 = 1e-9;

/// Points within this of each other, mm, are one: no instrument reads twice the same so closely.
const SAME_POINT_MM: f64 = 1e-9;

/// Share of the way of the robot's target that points must go at least: a fifth of it where they are in metres and are
/// taken for mm.
const LEAST_WAY: f64 = 2e-4;

/// Refuses points of groups too small to be placements, and those of which all are one although the robot moved: nothing
/// was measured, or something that stands still.
pub fn check_points(set: &Dataset, robot: Option<&Robot>) -> Result<(), Error> {
    check_groups(set)?;
    let points: Vec<Point3<f64>> = set.poses.iter().filter_map(|pose| pose.reading.point_mm()).collect();
    let moved = set.poses.iter().any(|pose| pose.joints_rad != set.poses[0].joints_rad);
    if points.len() < 2 || !moved {
        return Ok(());
    }
    let of_robot_mm = robot.map_or(0.0, |robot| way_mm(set, |pose| Some(robot.target_mm(&pose.joints_rad))));
    let way_mm = way_mm(set, |pose| pose.reading.point_mm());
    match way_mm <= SAME_POINT_MM.max(LEAST_WAY * of_robot_mm) {
        true => Err(Error::OnePoint { rows: points.len(), point_mm: points[0].coords.into(), way_mm, of_robot_mm }),
        false => Ok(()),
    }
}

/// Refuses points of which each, or each two, are a placement of their own.
fn check_groups(set: &Dataset) -> Result<(), Error> {
    /// Points of a placement that place it; a pose does by itself.
    const PLACE: usize = 3;
    let is_read = |pose: &Pose| pose.reading.point_mm().is_some();
    let rows = set.poses.iter().filter(|pose| is_read(pose)).count();
    let groups = set.groups.len();
    let of_group = |group: usize| set.poses.iter().filter(|pose| pose.group == group && is_read(pose)).count();
    let most = (0..groups).map(of_group).max().unwrap_or(0);
    if groups > 1 && rows >= PLACE && most < PLACE && !set.has_rotations() {
        Err(Error::SmallGroups { rows, groups, most })
    } else {
        Ok(())
    }
}

/// Middle distance of points from their middle, mm, in the group where it is largest.
fn way_mm(set: &Dataset, point: impl Fn(&Pose) -> Option<Point3<f64>>) -> f64 {
    let of_group = |group: usize| {
        let of_rows = set.rows(|pose| pose.group == group).into_iter();
        middle_spread(&of_rows.filter_map(|row| Some(point(&set.poses[row])?.coords)).collect::<Vec<_>>())
    };
    (0..set.groups.len()).filter_map(of_group).fold(0.0, f64::max)
}

/// Rows of the same group at the same joints.
pub fn repeated(set: &Dataset) -> Vec<String> {
    let order = by_joints(set, set.rows(|_| true));
    let same = |a: usize, b: usize| {
        let pairs = set.poses[a].joints_rad.iter().zip(&set.poses[b].joints_rad);
        set.poses[a].group == set.poses[b].group && pairs.into_iter().all(|(p, q)| (p - q).abs() <= SAME_JOINT)
    };
    let rows: BTreeSet<usize> = order.windows(2).filter(|w| same(w[0], w[1])).flat_map(|w| [w[0], w[1]]).collect();
    set.names(&rows.into_iter().collect::<Vec<_>>())
}

/// Rows by group, and within it by their joints.
pub fn by_joints(set: &Dataset, mut rows: Vec<usize>) -> Vec<usize> {
    let key = |i: usize| (set.poses[i].group, &set.poses[i].joints_rad);
    rows.sort_by(|&a, &b| key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal).then(a.cmp(&b)));
    rows
}

/// The rows of each pose: those of a group whose joints are all but the same, read anew or come back to. What a fit
/// leaves of one of them it leaves of the others as well.
pub fn by_pose(set: &Dataset, rows: Vec<usize>) -> Vec<Vec<usize>> {
    /// Of how much the joints' readings spread over the rows, root of the mean square over six joints: of a thousand
    /// poses that are drawn at random hardly two lie so near.
    const ALIKE: f64 = 0.1;
    let joint = |row: usize, joint: usize| set.poses[row].joints_rad[joint];
    let count = rows.len().max(1) as f64;
    let variance = |k: usize| {
        let mean = rows.iter().map(|&row| joint(row, k)).sum::<f64>() / count;
        rows.iter().map(|&row| (joint(row, k) - mean).powi(2)).sum::<f64>() / count
    };
    let variances: Vec<f64> = (0..set.joint_count()).map(variance).collect();
    let moving: Vec<usize> = (0..variances.len()).filter(|&k| variances[k] > 0.0).collect();
    let most = ALIKE * ALIKE * moving.len() as f64;
    let is_near = |a: usize, b: usize| {
        let square = |&k: &usize| (joint(a, k) - joint(b, k)).powi(2) / variances[k];
        set.poses[a].group == set.poses[b].group && moving.iter().map(square).sum::<f64>() <= most
    };
    let mut poses: Vec<Vec<usize>> = Vec::new();
    for row in by_joints(set, rows.clone()) {
        match poses.iter_mut().find(|pose| pose.iter().all(|&other| is_near(row, other))) {
            Some(pose) => pose.push(row),
            None => poses.push(vec![row]),
        }
    }
    poses
}

/// Way of a joint, rad or mm, below which it stands still but for what its encoder reads.
pub const STILL: f64 = 0.02;

/// From its least to its largest reading, rad or mm.
pub fn way(set: &Dataset, joint: usize) -> f64 {
    way_in(set.poses.iter(), joint)
}

/// The same in some poses.
pub fn way_in<'a>(poses: impl Iterator<Item = &'a Pose>, joint: usize) -> f64 {
    let ends = |(low, high): (f64, f64), q: f64| (low.min(q), high.max(q));
    let (low, high) = poses.map(|pose| pose.joints_rad[joint]).fold((f64::INFINITY, f64::NEG_INFINITY), ends);
    high - low
}

/// Joints that do not move, by their numbers from 1; rows that were left out tell nothing.
pub fn constant_joints(set: &Dataset, left_out: &[usize]) -> Vec<String> {
    let poses = || set.poses.iter().enumerate().filter(|(row, _)| !left_out.contains(row)).map(|(_, pose)| pose);
    (0..set.joint_count())
        .filter(|&j| (0.0..=SAME_JOINT).contains(&way_in(poses(), j)))
        .map(|joint| (joint + 1).to_string())
        .collect()
}

/// A stretch of rows one after the other in which a joint has one angle while others move, and other angles elsewhere,
/// with the end of a sentence on it; `None` where several joints have one, as where one axis after the other turns.
pub fn stuck_in(set: &Dataset) -> Option<(Range<usize>, String)> {
    /// Rows of a stretch, and the part of all rows that it must be.
    const FEWEST: usize = 8;
    const PART: usize = 5;
    let same = |a: usize, b: usize, joint: usize| {
        (set.poses[a].joints_rad[joint] - set.poses[b].joints_rad[joint]).abs() <= SAME_JOINT
    };
    let longest = |joint: usize| {
        let (mut best, mut from) = ([0, 0], 0);
        for row in 1..=set.poses.len() {
            if row == set.poses.len() || !same(row - 1, row, joint) {
                best = if row - from > best[1] - best[0] { [from, row] } else { best };
                from = row;
            }
        }
        let [from, to] = best;
        let others = (0..set.joint_count()).any(|other| way_in(set.poses[from..to].iter(), other) > STILL);
        let is_long = to - from >= FEWEST.max(set.poses.len() / PART) && to - from < set.poses.len();
        (is_long && others && way(set, joint) > STILL).then_some((joint, from..to))
    };
    let mut all = (0..set.joint_count()).filter_map(longest);
    let (joint, rows) = all.next().filter(|_| all.next().is_none())?;
    let [first, last] = [rows.start, rows.end - 1].map(|row| &set.poses[row].name);
    let said = is_stuck(&format!("joint {} has one angle in rows {first} to {last}", joint + 1));
    Some((rows, said))
}

/// What is said of joints whose column stands still in all rows or in a stretch of them, where something is wrong:
/// nothing, or the end of a sentence.
pub fn stuck(set: &Dataset) -> String {
    match &constant_joints(set, &[])[..] {
        [] => stuck_in(set).map_or_else(String::new, |(_, said)| said),
        [one] => is_stuck(&format!("joint {one} has one angle in all rows")),
        all => is_stuck(&format!("joints {} have one angle in all rows", all.join(", "))),
    }
}

fn is_stuck(said: &str) -> String {
    format!("; {said}: if it was turned there, its column is stuck")
}

/// How far the target is from where it would be if the joint stood still in the middle of these rows, mm a coordinate,
/// root of the mean square.
pub fn moves_mm(set: &Dataset, robot: &Robot, rows: &[usize], joint: usize) -> f64 {
    let middle = rows.iter().map(|&row| set.poses[row].joints_rad[joint]).sum::<f64>() / rows.len().max(1) as f64;
    let square = |&row: &usize| {
        let joints = &set.poses[row].joints_rad;
        let mut still = joints.clone();
        still[joint] = middle;
        (robot.target_mm(joints) - robot.target_mm(&still)).norm_squared()
    };
    (rows.iter().map(square).sum::<f64>() / (3 * rows.len()).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Role;

    #[test]
    fn poses_that_the_robot_came_back_to_are_those_of_one_group_at_the_same_joints() {
        let row = |name: &str, group: &str, second: f64| {
            let seen = synthetic::seen_at(Point3::new(1.0, 2.0, second));
            synthetic::row(name.to_owned(), group, Role::Sample, vec![10.0, second], seen)
        };
        let there_and_back = ["a", "b", "a2", "c"].into_iter().zip([20.0, 30.0, 20.0, 40.0]);
        let mut rows: Vec<_> = there_and_back.map(|(name, second)| row(name, "1", second)).collect();
        // The same joints seen from elsewhere say nothing of the repeatability.
        rows.push(row("d", "2", 30.0));
        let set = Dataset::new(&rows).unwrap();
        assert_eq!(repeated(&set), ["a", "a2"]);
        assert_eq!(constant_joints(&set, &[]), ["1"]);
    }

    #[test]
    fn a_column_that_stands_still_half_way_is_named() {
        let world = synthetic::planned(40, 0, 25.0, 0.02, 1, &|_| {});
        let count = world.rows.len();
        let said = |joint: usize, from: usize, to: usize| {
            let mut rows = world.rows.clone();
            let angle = rows[from].at.joints_deg[joint];
            rows[from..to].iter_mut().for_each(|row| row.at.joints_deg[joint] = angle);
            stuck(&Dataset::new(&rows).unwrap())
        };
        assert_eq!(said(3, 5, 6), "");
        for joint in 0..6 {
            let first = &world.rows[count / 2].at.pose;
            let expected = format!("; joint {} has one angle in rows {first} to ", joint + 1);
            assert!(said(joint, count / 2, count).starts_with(&expected), "{}", said(joint, count / 2, count));
            assert!(said(joint, 0, count).contains("in all rows"));
        }
        // What is said of a stretch is of the stretch, whatever stands still all along.
        let mut rows = world.rows.clone();
        let half = rows[count / 2].at.joints_deg[3];
        rows.iter_mut().for_each(|row| row.at.joints_deg[5] = 20.0);
        rows[count / 2..].iter_mut().for_each(|row| row.at.joints_deg[3] = half);
        let set = Dataset::new(&rows).unwrap();
        assert!(stuck(&set).contains("joint 6 has one angle in all rows"));
        let (stretch, said) = stuck_in(&set).unwrap();
        assert!(stretch == (count / 2..count) && said.contains("joint 4 has one angle in rows"), "{said}");
        // One axis after the other.
        let mut rows = world.rows.clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let turns = 6 * i / count;
            (0..6).filter(|joint| *joint != turns).for_each(|joint| row.at.joints_deg[joint] = 10.0);
        }
        assert_eq!(stuck(&Dataset::new(&rows).unwrap()), "");
    }
}
