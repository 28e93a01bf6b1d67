//! The order of the run: placement by placement, the centre first, then ways between poses as short for the joints as
//! can be found.

use super::pool::Candidate;
use super::scene::Placement;
use crate::geometry::Transform;
use crate::measurements::{Measurement, RobotPose, Role};
use crate::robot::Robot;

/// A planned pose.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// As poses.csv has it.
    pub at: RobotPose,
    /// Index of its group.
    pub group: usize,
    /// Where the target should be seen.
    pub left_from_target: Transform,
}

/// A way's length: the largest turn of a joint, which is what it takes time for, and a little of all others. A sliding
/// joint's mm count as milliradians.
fn way(robot: &Robot, a: &[f64], b: &[f64]) -> f64 {
    let turn =
        |(joint, (a, b)): (&crate::robot::Joint, (&f64, &f64))| (a - b).abs() * if joint.slides { 1e-3 } else { 1.0 };
    let turns: Vec<f64> = robot.joints.iter().zip(a.iter().zip(b)).map(turn).collect();
    turns.iter().copied().fold(0.0, f64::max) + 0.1 * turns.iter().sum::<f64>()
}

/// A short tour from a start: the nearest next one, then turned pieces as long as that is shorter (2-opt).
fn tour<'a>(robot: &Robot, start: &[f64], mut left: Vec<&'a Candidate>) -> Vec<&'a Candidate> {
    let mut order: Vec<&Candidate> = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let from = order.last().map_or(start, |c| c.joints_rad.as_slice());
        let lengths = left.iter().map(|c| way(robot, from, &c.joints_rad)).enumerate();
        let next = lengths.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best }).0;
        order.push(left.remove(next));
    }
    let at = |order: &[&'a Candidate], k: usize| -> &'a [f64] { &order[k].joints_rad };
    let mut improved = true;
    while improved {
        improved = false;
        for i in 0..order.len() {
            for j in i + 1..order.len() {
                let before = if i == 0 { start } else { at(&order, i - 1) };
                let behind = (j + 1 < order.len()).then(|| at(&order, j + 1));
                let link = |a: &[f64], b: Option<&[f64]>| b.map_or(0.0, |b| way(robot, a, b));
                let now = way(robot, before, at(&order, i)) + link(at(&order, j), behind);
                let turned = way(robot, before, at(&order, j)) + link(at(&order, i), behind);
                if turned < now - 1e-9 {
                    order[i..=j].reverse();
                    improved = true;
                }
            }
        }
    }
    order
}

/// Rows of poses.csv. A group whose centre was measured already gets no other; names that were used are not used again.
pub fn poses(
    robot: &Robot,
    placements: &[Placement],
    centers: &[Candidate],
    samples: &[Candidate],
    verify: &[Candidate],
    measured: Option<&[Measurement]>,
) -> Vec<Planned> {
    let used = |name: &str| measured.is_some_and(|rows| rows.iter().any(|r| r.at.pose == name));
    let mut planned = Vec::new();
    for (group, placement) in placements.iter().enumerate() {
        let [centers, samples, verify] =
            [centers, samples, verify].map(|list| list.iter().filter(|c| c.group == group).collect::<Vec<_>>());
        let center = centers.first().copied();
        let start = center.map_or_else(Vec::new, |c| c.joints_rad.clone());
        let has_center =
            measured.is_some_and(|rows| rows.iter().any(|r| r.at.group == placement.name && r.at.role == Role::Center));
        let mut list: Vec<(Role, &Candidate)> = Vec::new();
        list.extend(center.filter(|_| !has_center).map(|c| (Role::Center, c)));
        list.extend(tour(robot, &start, samples).into_iter().map(|c| (Role::Sample, c)));
        let end = list.last().map_or(start, |(_, c)| c.joints_rad.clone());
        list.extend(tour(robot, &end, verify).into_iter().map(|c| (Role::Verify, c)));
        let mut number = 0;
        for (role, candidate) in list {
            while used(&format!("g{}_{number:03}", placement.name)) {
                number += 1;
            }
            let name = format!("g{}_{number:03}", placement.name);
            number += 1;
            let at = robot_pose(robot, name, &placement.name, role, &candidate.joints_rad);
            planned.push(Planned { at, group, left_from_target: candidate.left_from_target });
        }
    }
    planned
}

/// A row of poses.csv: readings rounded as a controller takes them.
fn robot_pose(robot: &Robot, name: String, group: &str, role: Role, joints_rad: &[f64]) -> RobotPose {
    let slides: Vec<bool> = robot.joints.iter().map(|j| j.slides).collect();
    let reading = |(q, slides): (&f64, &bool)| rounded(if *slides { *q } else { q.to_degrees() });
    let joints_deg = joints_rad.iter().zip(&slides).map(reading).collect();
    let slides = if slides.contains(&true) { slides } else { Vec::new() };
    RobotPose { pose: name, group: group.to_owned(), role, joints_deg, slides }
}

/// Four digits behind the point, and no minus before a zero.
fn rounded(value: f64) -> f64 {
    format!("{value:.4}").parse().unwrap_or(value) + 0.0
}
