//! Whether angles or points were read before the arm stood still.
//!
//! In: a fit and its data set, the rows in the order of measurement. Out: by what share of the move before each pose its
//! angles are behind the arm, or ahead of it. Method: where a joint still moves while it is read, its angle is off by a
//! share of its last move, and points know the angle of the pose before, which no robot's do. The effect of that angle
//! is held against what is left (an F test), the effect of the angle itself at its best, so that a scale or a zero of
//! a joint is none; a robot that the model lacks something of differs between neighbours in the table either way, so
//! that the pose before must explain more than the one after does. Goes wrong: rows in another order; arms that sag back
//! through gear play after each move, which is a lag, too.

use nalgebra::DMatrix;

use crate::identify::data::dataset::Dataset;
use crate::identify::finding::Finding;
use crate::identify::judge::pattern::{Explained, explained};
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

/// Angles or points that know of the pose before.
pub fn find(set: &Dataset, formulation: &Formulation) -> Option<Finding> {
    let linear = Linearised::new(&formulation.rows, &formulation.offsets_of());
    let explained_by = |to: isize| explained_by(set, formulation, &linear, to);
    let lag = explained_by(-1)?;
    let is_told = lag.chance < FALSE_ALARM && lag.share > SHARE;
    // What the poses after explain is as much as the model lacks.
    let after = if is_told { explained_by(1).map_or(0.0, |after| after.share) } else { 0.0 };
    if !is_told || lag.share < BEATS * after {
        return None;
    }
    let named: Vec<(usize, f64)> = lag
        .factors
        .iter()
        .zip(&lag.sds)
        .enumerate()
        .filter(|(_, (factor, sd))| factor.abs() > NAMED * *sd)
        .map(|(joint, (factor, _))| (joint + 1, -100.0 * factor))
        .collect();
    let behind = named.iter().filter(|(_, percent)| *percent > 0.0).count();
    if named.is_empty() || behind != 0 && behind != named.len() {
        return None;
    }
    let joints: Vec<String> =
        named.iter().map(|(joint, percent)| format!("{:.2} % of it in joint {joint}", percent.abs())).collect();
    let what = if behind > 0 { "the angles" } else { "the points" };
    Some(Finding::new(
        format!(
            "{what} seem to have been read before the arm stood still: {:.0} % of the squares that are left follow the move before each pose ({})",
            100.0 * lag.share,
            joints.join(", ")
        ),
        "wait longer at each pose, or give the angles that were commanded, and identify again",
    ))
}

/// What the angles at the poses before (`to` -1) or after (1) explain; the factor of a joint is the share of its move
/// since then, with the other sign.
fn explained_by(set: &Dataset, formulation: &Formulation, linear: &Linearised, to: isize) -> Option<Explained> {
    let joints = set.joint_count();
    let offsets: Vec<Option<usize>> = (0..joints)
        .map(|joint| {
            let own = if set.is_sliding(joint) { Parameter::D(joint) } else { Parameter::Theta(joint) };
            formulation.parameters().iter().position(|parameter| *parameter == own)
        })
        .collect();
    explained(linear, joints, |placement| columns(set, &formulation.rows, placement, &offsets, to))
}

/// Of each joint the effect of its angle at the neighbour, then that of its own angle, on the white residuals. Where the
/// neighbour is of another placement, or there is none, the joint counts as if it had stood still.
fn columns(set: &Dataset, rows: &Rows, placement: &Placement, offsets: &[Option<usize>], to: isize) -> DMatrix<f64> {
    let joints = offsets.len();
    let mut columns = DMatrix::zeros(placement.poses.len(), 2 * joints);
    for (place, at) in placement.by_pose() {
        let row = rows.rows[place];
        let pose = &set.poses[row];
        let neighbour = row.checked_add_signed(to).and_then(|row| set.poses.get(row));
        let neighbour = neighbour.filter(|neighbour| neighbour.group == pose.group).unwrap_or(pose);
        for (joint, offset) in offsets.iter().enumerate() {
            let Some(offset) = offset else { continue };
            // Unknowns are in mrad and mm.
            let unit = if set.is_sliding(joint) { 1.0 } else { 1000.0 };
            for number in at.clone() {
                let effect = unit * placement.linear.jacobian[(number, *offset)];
                columns[(number, joint)] = effect * neighbour.joints_rad[joint];
                columns[(number, joints + joint)] = effect * pose.joints_rad[joint];
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
        Some(find(&set, found.formulation()?)?.finding)
    }

    #[test]
    fn angles_that_lag_are_named_with_their_joints_and_clean_ones_are_not() {
        for seed in 1..4 {
            assert_eq!(found(seed, 0.0, 0.0, |_| {}), None, "{seed}");
            let said = found(seed, 5e-4, 0.0, |_| {}).unwrap();
            let (_, shares) = said.rsplit_once('(').unwrap();
            let named: Vec<(f64, &str)> = shares
                .trim_end_matches(')')
                .split(", ")
                .map(|share| share.split_once(" % of it in joint ").unwrap())
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
