//! What the poses do not test: joints that hardly move the target or do not move, a flange that does not turn.
//!
//! In: the rows and the robot that was found. Out: each such joint, and whether the file's tool lets expect otherwise.
//! A column that is wrong (another unit, another sign, other rows) makes a fit put the target on the joint's axis,
//! where it fits as well.

use crate::identify::data::dataset::{Dataset, Kind};
use crate::identify::data::still::{self, constant_joints};
use crate::identify::examine::conventions;
use crate::identify::finding::Finding;
use crate::identify::run::Identification;
use crate::robot::Robot;

/// Chi-square of what a joint does to the points below which they do not tell its column from none: 150 to 1 after the
/// two places of the tool that it takes. Nor is it tested where it does less than the points scatter.
const TESTED: f64 = 2.0 * crate::difference::TOLD_APART + 2.0;

/// Orientations within this are one: a robot keeps an orientation to far less, and so small a turn shows nothing.
const ONE_ORIENTATION_DEG: f64 = 1.0;

/// Times as far as the target that was found by which a joint would move the file's target where one of both is wrong.
const ELSEWHERE: f64 = 4.0;

/// Joints that read the same in all rows though they move: one column is a copy of the other.
fn copied(set: &Dataset) -> Option<Finding> {
    let joints = set.joint_count();
    let same = |&(i, j): &(usize, usize)| {
        still::way(set, i) > 0.0 && set.poses.iter().all(|pose| pose.joints_rad[i] == pose.joints_rad[j])
    };
    let (i, j) = (0..joints).flat_map(|i| (i + 1..joints).map(move |j| (i, j))).find(same)?;
    Some(Finding::new(
        format!("joints {} and {} read the same in all rows: one column seems to be a copy of the other", i + 1, j + 1),
        "compare both columns with the controller, and identify again",
    ))
}

/// What is said of the joints that are not tested: what speaks against their columns, and what is only not known.
pub fn joints(set: &Dataset, found: &Identification) -> (Vec<Finding>, Vec<Finding>) {
    let (mut against, mut unknown): (Vec<Finding>, _) = (copied(set).into_iter().collect(), Vec::new());
    let one_point = set.kind == Kind::Positions && set.poses.iter().all(|pose| pose.on_body_mm.is_none());
    let Some(formulation) = found.formulation().filter(|_| one_point) else { return (against, unknown) };
    let nominal = &formulation.rows.kinematics.nominal;
    for joint in 0..set.joint_count() {
        let moves = |robot: &Robot| still::moves_mm(set, robot, &found.fitted, joint);
        let (expected_mm, found_mm) = (moves(nominal), moves(found.robot()));
        let chi_square = 3.0 * found.fitted.len() as f64 * (found_mm / found.scatter.point_mm).powi(2);
        let is_tested = chi_square > TESTED && found_mm > found.scatter.point_mm;
        if still::way(set, joint) < still::STILL || is_tested {
            continue;
        }
        let number = joint + 1;
        if expected_mm > conventions::IMPLAUSIBLE_MM && expected_mm > ELSEWHERE * found_mm {
            against.push(Finding::new(
                format!(
                    "the readings do not follow joint {number}: with the file's tool it would move the target by {expected_mm:.2} mm a coordinate, \
                     with the tool that was found by {found_mm:.2} mm"
                ),
                "compare that column (its unit, its sign, its rows) with the controller, and the file's tool with the real one",
            ));
        } else if found.scatter.point_mm < conventions::IMPLAUSIBLE_MM {
            // A fit that leaves more than a robot may tells nothing of where the target is.
            unknown.push(Finding::new(
                format!(
                    "joint {number} moves the target by {found_mm:.2} mm a coordinate only: unit, sign and zero of its column are not tested"
                ),
                "they matter for a tool off that axis: measure with a target some 50 mm off it",
            ));
        }
    }
    (against, unknown)
}

/// Several joints that did not move.
pub fn still(set: &Dataset, left_out: &[usize]) -> Option<String> {
    let joints = constant_joints(set, left_out);
    (joints.len() > 1).then(|| {
        format!(
            "joints {} did not move: the identified robot is right for these readings of theirs only; move every joint between poses",
            joints.join(", ")
        )
    })
}

/// A flange that hardly turns within a group.
pub fn one_orientation(set: &Dataset, nominal: &Robot, found: &Identification) -> Option<String> {
    (tilt_deg(set, nominal, &found.fitted) < ONE_ORIENTATION_DEG).then(|| {
        "the flange keeps one orientation within each group: the tool and parts of the wrist cannot be separated from other parameters, and \
         the identified robot is right for that orientation only; vary it by 20 deg or more between poses"
            .to_owned()
    })
}

/// The largest turn of the nominal flange between two poses of a group (one of them the group's first), deg.
fn tilt_deg(set: &Dataset, nominal: &Robot, rows: &[usize]) -> f64 {
    let rotation = |i: usize| nominal.base_from_flange(&set.poses[i].joints_rad).rotation;
    let mut first = vec![None; set.groups.len()];
    let turn = |&i: &usize| first[set.poses[i].group].get_or_insert_with(|| rotation(i)).angle_to(&rotation(i));
    rows.iter().map(turn).fold(0.0, f64::max).to_degrees()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::identify::synthetic::{identified, planned};

    /// What is said of an arm with a target this far off its last axis, whose file has it that far off, and whose last
    /// column is that of other rows or not.
    fn said(off_mm: f64, of_file_mm: f64, is_shuffled: bool) -> (Vec<Finding>, Vec<Finding>) {
        let mut world = planned(40, 0, 25.0, 0.05, 7, &|robot| robot.tool_mm = Vector3::new(off_mm, 0.0, 120.0));
        world.nominal.tool_mm = Vector3::new(of_file_mm, 0.0, 120.0);
        let column: Vec<f64> = world.rows.iter().map(|row| row.at.joints_deg[5]).collect();
        if is_shuffled {
            for (i, row) in world.rows.iter_mut().enumerate() {
                row.at.joints_deg[5] = column[(7 * i + 3) % column.len()];
            }
        }
        let set = Dataset::new(&world.rows).unwrap();
        joints(&set, &identified(&set, &world.nominal))
    }

    #[test]
    fn a_column_that_the_points_do_not_follow_is_named_where_the_file_lets_expect_it() {
        for off_mm in [2.0, 5.0] {
            assert_eq!(said(off_mm, off_mm, false), Default::default(), "{off_mm}");
            let (against, _) = said(off_mm, off_mm, true);
            assert!(
                against.len() == 1 && against[0].finding.contains("do not follow joint 6"),
                "{off_mm}: {against:?}"
            );
        }
    }

    #[test]
    fn a_joint_whose_axis_goes_through_the_target_is_not_tested_and_nothing_speaks_against_it() {
        for is_shuffled in [false, true] {
            let (against, unknown) = said(0.0, 0.0, is_shuffled);
            assert_eq!(against, [], "{is_shuffled}");
            assert!(unknown.len() == 1 && unknown[0].finding.starts_with("joint 6 moves"), "{unknown:?}");
        }
    }

    #[test]
    fn a_column_that_is_a_copy_of_another_is_named() {
        let mut world = planned(20, 0, 25.0, 0.05, 7, &|_| {});
        assert_eq!(copied(&Dataset::new(&world.rows).unwrap()), None);
        world.rows.iter_mut().for_each(|row| row.at.joints_deg[5] = row.at.joints_deg[3]);
        let said = copied(&Dataset::new(&world.rows).unwrap()).unwrap();
        assert!(said.finding.starts_with("joints 4 and 6 read the same"), "{said:?}");
        // Joints that stand still read the same, too.
        for row in &mut world.rows {
            (row.at.joints_deg[3], row.at.joints_deg[5]) = (0.0, 0.0);
        }
        assert_eq!(copied(&Dataset::new(&world.rows).unwrap()), None);
    }
}
