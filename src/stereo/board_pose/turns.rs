//! The numbering of a target that looks the same after a turn in its plane, from pose to pose.
//!
//! Neighbouring poses of a robot differ by less than such a turn: within a group every pose is numbered like the
//! nearest one in the robot's joints, beginning at the group's centre. Where two numberings are nearly as good, that is
//! said. What the numbering of one group is against another's (the camera was moved between them) the pictures alone do
//! not tell.

use crate::geometry::{Transform, rotation_vector};
use crate::imaging::{Board, Side};
use crate::measurements::{RobotPose, Role};
use crate::stereo::data::View;
use crate::stereo::pairs::numbering::renumbered;

/// Two numberings whose turns from the neighbour differ by less than this, rad, are both possible.
const NEARLY_EQUAL: f64 = 0.35;

/// The views with their poses, numbered alike, and what could not be told.
pub fn settle(board: &Board, at: &[&RobotPose], views: &mut [View], poses: &mut [Option<Transform>]) -> Vec<String> {
    let Some(step) = board.symmetry() else { return Vec::new() };
    let mut notes = Vec::new();
    let mut groups: Vec<&str> = Vec::new();
    for pose in at {
        if !groups.contains(&pose.group.as_str()) {
            groups.push(&pose.group);
        }
    }
    for group in &groups {
        let members: Vec<usize> = (0..at.len()).filter(|&i| at[i].group == *group && poses[i].is_some()).collect();
        let doubtful = settle_group(board, step, at, &members, views, poses);
        if !doubtful.is_empty() {
            let names: Vec<&str> = doubtful.iter().map(|&i| at[i].pose.as_str()).collect();
            notes.push(format!(
                "the target looks the same after {}, and no neighbouring pose tells its numbering in {}: their orientation may be off by that",
                turn_words(step),
                names.join(", ")
            ));
        }
    }
    if groups.len() > 1 {
        notes.push(format!(
            "the target looks the same after {}: between the groups, where the cameras were moved, nothing tells its numbering; \
             points are not concerned, orientations may differ by that from group to group",
            turn_words(step)
        ));
    }
    notes
}

fn turn_words(step: usize) -> &'static str {
    if step == 1 { "a quarter turn" } else { "a half turn" }
}

/// Numbers the members like their nearest neighbours; those that remain in doubt.
fn settle_group(
    board: &Board,
    step: usize,
    at: &[&RobotPose],
    members: &[usize],
    views: &mut [View],
    poses: &mut [Option<Transform>],
) -> Vec<usize> {
    let mut doubtful = Vec::new();
    let Some(&first) = members.iter().find(|&&i| at[i].role == Role::Center).or_else(|| members.first()) else {
        return doubtful;
    };
    let mut done = vec![first];
    let mut open: Vec<usize> = members.iter().copied().filter(|&i| i != first).collect();
    while !open.is_empty() {
        let Some((k, from)) = nearest(at, &done, &open) else { break };
        let i = open.remove(k);
        done.push(i);
        let (Some(reference), Some(pose)) = (poses[from], poses[i]) else { continue };
        let turn = |quarters: usize| rotation_vector(&(reference.inverse() * pose * renumbered(quarters))).norm();
        let mut turns: Vec<(f64, usize)> = (0..4).step_by(step).map(|quarters| (turn(quarters), quarters)).collect();
        turns.sort_by(|a, b| a.0.total_cmp(&b.0));
        if turns[1].0 - turns[0].0 < NEARLY_EQUAL {
            doubtful.push(i);
        }
        let quarters = turns[0].1;
        Side::BOTH.into_iter().for_each(|side| views[i].turn(board, side, quarters));
        poses[i] = Some(pose * renumbered(quarters));
    }
    doubtful.sort_unstable();
    doubtful
}

/// The open pose nearest to one that is done, in the joints; its place in `open`, and that one.
fn nearest(at: &[&RobotPose], done: &[usize], open: &[usize]) -> Option<(usize, usize)> {
    let distance = |a: usize, b: usize| -> f64 {
        at[a].joints_deg.iter().zip(&at[b].joints_deg).map(|(a, b)| (a - b) * (a - b)).sum()
    };
    let all = open.iter().enumerate().flat_map(|(k, &i)| done.iter().map(move |&d| (k, i, d)));
    all.min_by(|a, b| distance(a.1, a.2).total_cmp(&distance(b.1, b.2))).map(|(k, _, from)| (k, from))
}
