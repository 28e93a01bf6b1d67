//! Whether angles or points were read before the arm stood still, or joints have play.
//!
//! In: a fit and its data set, the rows in the order of measurement. Out: by what share of the move before each pose its
//! angles are behind the arm, or ahead of it; or how far a joint stands apart by the side that it comes from. Method:
//! where a joint still moves while it is read, its angle is off by a share of its last move, and points know the angle of
//! the pose before, which no robot's do; where its gear has play, by the sign of that move alone. The effect of that
//! angle, or sign, is held against what is left (an F test, and one by poses, whose numbers err together where angles
//! scatter), the effect of the angle itself at its best, so that a scale or a zero of a joint is none; a robot that the
//! model lacks something of differs between neighbours in the table either way, so that the pose before must explain
//! more than the one after does. Of the two the likelier one is told, both where neither is 150 times likelier. Goes
//! wrong: rows in another order.

use nalgebra::DMatrix;

use crate::difference::TOLD_APART;
use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::identify::judge::pattern::{Explained, Left};
use crate::identify::residuals::rows::Rows;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::robot::Parameter;

/// Chance that poses before that mean nothing are said to mean something.
const FALSE_ALARM: f64 = 1e-3;
/// Share of what is left that they explain at least, and times that of the poses after.
const SHARE: f64 = 0.1;
const BEATS: f64 = 2.0;
/// Standard deviations from which on a joint is named.
const NAMED: f64 = 4.0;

/// What a joint is held against: its angle at a neighbour in the table (-1 before, 1 after), or the sign of its way from
/// there.
#[derive(Debug, Clone, Copy)]
enum By {
    Angle(isize),
    Side(isize),
}

/// Share from which on play is a doubt: below that the robot that was found would be three tenths nearer without it at
/// the most, and a robot has what play it has.
const DOUBT: f64 = 0.5;

/// Angles or points that know of the pose before.
pub struct Lag {
    pub finding: Finding,
    /// Whether it speaks against the result.
    pub is_doubt: bool,
}

/// Looks for them, and for play.
pub fn find(set: &Dataset, formulation: &Formulation) -> Option<Lag> {
    let linear = Linearised::new(&formulation.rows, &formulation.offsets_of());
    let told = |by: fn(isize) -> By| {
        let left = left_beside(set, formulation, &linear, by(-1))?;
        let is_told = |of: &Explained| of.chance < FALSE_ALARM && of.share > SHARE;
        let before = left.explained().filter(is_told)?.by_pose(&left).filter(is_told)?;
        // What the poses after explain is as much as the model lacks.
        let after = left_beside(set, formulation, &linear, by(1)).and_then(|left| left.explained());
        (before.share >= BEATS * after.map_or(0.0, |after| after.share)).then_some(before)
    };
    let lag = told(By::Angle).and_then(|lag| Some((of_lag(&lag)?, lag)));
    let play = told(By::Side).and_then(|play| Some((of_play(set, &play)?, play)));
    let of_play = |said: &str, play: &Explained| Lag { is_doubt: play.share > DOUBT, ..of(said, play, APPROACH) };
    Some(match (lag, play) {
        (Some((said, lag)), Some((or, play))) => {
            let numbers: usize = linear.placements.iter().map(|placement| placement.poses.len()).sum();
            let play_is_likelier = 0.5 * numbers as f64 * ((1.0 - lag.share) / (1.0 - play.share)).ln();
            match play_is_likelier {
                more if more > TOLD_APART => of_play(&or, &play),
                more if more < -TOLD_APART => of(&said, &lag, WAIT),
                _ => of(&format!("{said}, or {or}"), &lag, &format!("{WAIT}; or {APPROACH}")),
            }
        }
        (Some((said, lag)), None) => of(&said, &lag, WAIT),
        (None, Some((said, play))) => of_play(&said, &play),
        (None, None) => return None,
    })
}

const WAIT: &str = "wait longer at each pose, or give the angles that were commanded, and identify again";
const APPROACH: &str = "come to each pose from one side in every joint, as the robot will in use, and identify again";

fn of(said: &str, by: &Explained, hint: &str) -> Lag {
    let share = 100.0 * by.share;
    let said = format!("{said}: {share:.0} % of the squares that are left follow the move before each pose");
    Lag { finding: Finding::new(said, hint), is_doubt: true }
}

/// Joints whose factor is significant, by their numbers from 1.
fn named(of: &Explained) -> Vec<(usize, f64)> {
    let all = of.factors.iter().zip(&of.sds).enumerate();
    all.filter(|(_, (factor, sd))| factor.abs() > NAMED * *sd)
        .map(|(joint, (factor, _))| (joint + 1, *factor))
        .collect()
}

fn of_lag(lag: &Explained) -> Option<String> {
    let named = named(lag);
    let behind = named.iter().filter(|(_, factor)| *factor < 0.0).count();
    if named.is_empty() || behind != 0 && behind != named.len() {
        return None;
    }
    let of_joint =
        |(joint, factor): &(usize, f64)| format!("{:.2} % of its move in joint {joint}", 100.0 * factor.abs());
    let joints: Vec<String> = named.iter().map(of_joint).collect();
    let what = if behind > 0 { "the angles" } else { "the points" };
    Some(format!("{what} seem to have been read before the arm stood still ({})", joints.join(", ")))
}

fn of_play(set: &Dataset, play: &Explained) -> Option<String> {
    let size = |(joint, factor): &(usize, f64)| match set.is_sliding(joint - 1) {
        true => format!("{:.3} mm", 2.0 * factor.abs()),
        false => format!("{:.3} deg", 2.0 * factor.abs().to_degrees()),
    };
    match named(play).as_slice() {
        [] => None,
        [one] => Some(format!(
            "joint {} stands {} apart by the side that it comes from, as with play of its gear",
            one.0,
            size(one)
        )),
        several => {
            let joints: Vec<String> = several.iter().map(|one| format!("joint {} by {}", one.0, size(one))).collect();
            Some(format!(
                "joints stand apart by the side that they come from, as with play of their gears ({})",
                joints.join(", ")
            ))
        }
    }
}

/// What is left beside angles at a neighbour, or the sides that joints come from; the factor of an angle is the share of
/// its move since then, with the other sign, that of a side in rad or mm.
fn left_beside(set: &Dataset, formulation: &Formulation, linear: &Linearised, by: By) -> Option<Left> {
    let joints = set.joint_count();
    let offsets: Vec<Option<usize>> = (0..joints)
        .map(|joint| {
            let own = if set.is_sliding(joint) { Parameter::D(joint) } else { Parameter::Theta(joint) };
            formulation.parameters().iter().position(|parameter| *parameter == own)
        })
        .collect();
    Left::new(linear, joints, |placement| columns(set, &formulation.rows, placement, &offsets, by))
}

/// Of each joint the effect of what it is held against, then that of its own angle, on the white residuals. Where the
/// neighbour is of another placement, or there is none, the joint counts as if it had stood still.
fn columns(set: &Dataset, rows: &Rows, placement: &Placement, offsets: &[Option<usize>], by: By) -> DMatrix<f64> {
    let joints = offsets.len();
    let mut columns = DMatrix::zeros(placement.poses.len(), 2 * joints);
    let (By::Angle(to) | By::Side(to)) = by;
    for (place, at) in placement.by_pose() {
        let row = rows.rows[place];
        let pose = &set.poses[row];
        let neighbour = row.checked_add_signed(to).and_then(|row| set.poses.get(row));
        let neighbour = neighbour.filter(|neighbour| neighbour.group == pose.group).unwrap_or(pose);
        for (joint, offset) in offsets.iter().enumerate() {
            let Some(offset) = offset else { continue };
            // Unknowns are in mrad and mm.
            let unit = if set.is_sliding(joint) { 1.0 } else { 1000.0 };
            let (own, other) = (pose.joints_rad[joint], neighbour.joints_rad[joint]);
            let against = match by {
                By::Angle(_) => other,
                By::Side(_) if own == other => 0.0,
                By::Side(_) => (own - other).signum(),
            };
            for number in at.clone() {
                let effect = unit * placement.linear.jacobian[(number, *offset)];
                columns[(number, joint)] = effect * against;
                columns[(number, joints + joint)] = effect * own;
            }
        }
    }
    columns
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    use super::*;
    use crate::identify::synthetic::{World, normal, planned};

    /// A world whose angles are behind by a share of the last move, or whose points are.
    fn found(seed: u64, of_angles: f64, of_points: f64, spoil: impl Fn(&mut World)) -> Option<String> {
        Some(told(seed, of_angles, of_points, spoil)?.finding.finding)
    }

    fn told(seed: u64, of_angles: f64, of_points: f64, spoil: impl Fn(&mut World)) -> Option<Lag> {
        let mut world = planned(120, 0, 25.0, 0.02, seed, &|_| {});
        world.rows.retain(|row| row.at.group == "g1");
        let true_deg: Vec<Vec<f64>> = world.rows.iter().map(|row| row.at.joints_deg.clone()).collect();
        for (i, row) in world.rows.iter_mut().enumerate().skip(1) {
            for joint in [0, 1] {
                row.at.joints_deg[joint] -= (of_angles - of_points) * (true_deg[i][joint] - true_deg[i - 1][joint]);
            }
        }
        spoil(&mut world);
        let (set, found) = world.identified(&world.rows);
        find(&set, found.formulation()?)
    }

    #[test]
    fn angles_that_lag_are_named_with_their_joints_and_clean_ones_are_not() {
        for seed in 1..4 {
            assert_eq!(found(seed, 0.0, 0.0, |_| {}), None, "{seed}");
            let said = found(seed, 5e-4, 0.0, |_| {}).unwrap();
            let (_, shares) = said.split_once('(').unwrap();
            let (shares, _) = shares.split_once(')').unwrap();
            let named: Vec<(f64, &str)> = shares
                .split(", ")
                .map(|share| share.split_once(" % of its move in joint ").unwrap())
                .map(|(percent, joint)| (percent.parse().unwrap(), joint))
                .collect();
            assert!(said.starts_with("the angles") && named.len() == 2, "{said}");
            assert!(
                named
                    .iter()
                    .zip(["1", "2"])
                    .all(|((percent, joint), own)| *joint == own && (0.03..0.07).contains(percent)),
                "{said}"
            );
            let said = found(seed, 0.0, 5e-4, |_| {}).unwrap();
            assert!(said.starts_with("the points"), "{said}");
        }
    }

    /// Points of joints that stand apart by the side they come from, by this much, deg; and of which the angles lag.
    #[test]
    fn play_of_a_gear_is_told_from_a_lag() {
        for seed in 1..4 {
            for (joint, apart_deg) in [(1, 0.02), (2, 0.06), (0, 0.2)] {
                let spoil = |world: &mut World| {
                    let read: Vec<f64> = world.rows.iter().map(|row| row.at.joints_deg[joint]).collect();
                    for (i, row) in world.rows.iter_mut().enumerate().skip(1) {
                        row.at.joints_deg[joint] += 0.5 * apart_deg * (read[i] - read[i - 1]).signum();
                    }
                };
                let Lag { finding, is_doubt } = told(seed, 0.0, 0.0, spoil).expect("play");
                assert!(is_doubt || apart_deg < 0.05, "{seed}: {}", finding.finding);
                let said = finding.finding;
                let of_joint =
                    ["stands", "by"].iter().find_map(|verb| said.split_once(&format!("joint {} {verb} ", joint + 1)));
                let found: f64 = of_joint.expect(&said).1.split_once(" deg").unwrap().0.parse().unwrap();
                // The smallest is near what is noticed: some of it is in the robot.
                assert!((found / apart_deg - 1.0).abs() < 0.5 && !said.contains("stood still"), "{seed}: {said}");
            }
            let said = found(seed, 2e-3, 0.0, |_| {}).unwrap_or_default();
            assert!(said.contains("stood still") && !said.contains("play"), "{seed}: {said}");
        }
    }

    /// They err in all numbers of a pose together.
    #[test]
    fn angles_that_scatter_lag_in_nothing() {
        for seed in 1..9 {
            for joint in 0..3 {
                let scattered = |world: &mut World| {
                    let mut random = Pcg64Mcg::seed_from_u64(100 * seed + joint as u64);
                    world.rows.iter_mut().for_each(|row| row.at.joints_deg[joint] += 0.1 * normal(&mut random).x);
                };
                assert_eq!(found(seed, 0.0, 0.0, scattered), None, "seed {seed}, joint {}", joint + 1);
            }
        }
    }

    #[test]
    fn a_joint_whose_scale_is_off_and_a_robot_with_more_errors_than_the_model_lag_in_nothing() {
        let scaled = |world: &mut World| world.rows.iter_mut().for_each(|row| row.at.joints_deg[1] *= 1.002);
        let noisy = |world: &mut World| {
            let mut random = Pcg64Mcg::seed_from_u64(9);
            let mut drift = 0.0;
            for row in &mut world.rows {
                drift += 0.01 * normal(&mut random).x;
                row.at.joints_deg[2] += 0.02 * (5.0 * row.at.joints_deg[2].to_radians()).sin() + drift;
            }
        };
        assert_eq!(found(5, 0.0, 0.0, scaled), None);
        assert_eq!(found(5, 0.0, 0.0, noisy), None);
    }
}
