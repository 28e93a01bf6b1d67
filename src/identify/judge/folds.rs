//! Which rows are held out together: every pose once in each repeat, in five parts of all placements alike.
//!
//! In: rows. Out: for each repeat the fold of each row. Rows of one pose are in one fold, or one would tell of the
//! other; centres, which their group's distances are measured from, are in none. The draws are the same in every
//! run: no seed of the user's changes them.

use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::errors::{Judge, RowError};
use crate::identify::data::dataset::Dataset;
use crate::identify::data::still::by_pose;
use crate::measurements::Role;
use crate::robot::Robot;

/// Parts that are held out in turn: a fifth of the rows each.
pub const FOLDS: usize = 5;

/// Times that the rows are cut into folds anew.
pub const REPEATS: usize = 4;

/// The fold of each row of the data set, a list a repeat; `None` for rows that are not among these, and for centres.
pub fn folds(set: &Dataset, rows: &[usize]) -> Vec<Vec<Option<usize>>> {
    let kept = rows.iter().copied().filter(|&r| set.poses[r].role != Role::Center);
    let mut poses = by_pose(set, kept.collect());
    poses.sort_by_key(|pose| set.poses[pose[0]].group);
    (1..=REPEATS as u64)
        .map(|repeat| {
            let mut random = Pcg64Mcg::seed_from_u64(repeat);
            let mut of_row = vec![None; set.poses.len()];
            let mut next = 0;
            for of_group in poses.chunk_by(|a, b| set.poses[a[0]].group == set.poses[b[0]].group) {
                // Fisher and Yates' shuffle.
                let mut shuffled: Vec<&Vec<usize>> = of_group.iter().collect();
                for i in (1..shuffled.len()).rev() {
                    shuffled.swap(i, random.random_range(0..=i));
                }
                for pose in shuffled {
                    pose.iter().for_each(|&row| of_row[row] = Some(next % FOLDS));
                    next += 1;
                }
            }
            of_row
        })
        .collect()
}

/// Errors of a robot on rows that take no part in placing the sensor, which the other fitted ones do.
pub fn without(judge: &Judge, robot: &Robot, rows: &[usize]) -> Vec<RowError> {
    let others: Vec<usize> = judge.fitted.iter().copied().filter(|r| !rows.contains(r)).collect();
    (Judge { fitted: &others, ..judge.clone() }).errors(robot, rows)
}

/// Errors of a robot that nothing is fitted of, each row by a placement that it takes no part in.
pub fn judged(judge: &Judge, robot: &Robot, rows: &[usize]) -> Vec<RowError> {
    let cut = folds(judge.set, rows);
    let parts = cut.iter().flat_map(|of_row| {
        (0..FOLDS).map(move |fold| (0..of_row.len()).filter(|&r| of_row[r] == Some(fold)).collect::<Vec<usize>>())
    });
    one_a_row(judge.set, parts.filter(|rows| !rows.is_empty()).flat_map(|rows| without(judge, robot, &rows)))
}

/// One error for each row that was left out several times: of mean size.
pub fn one_a_row(set: &Dataset, errors: impl Iterator<Item = RowError>) -> Vec<RowError> {
    let mut of_row: Vec<Vec<RowError>> = vec![Vec::new(); set.poses.len()];
    errors.for_each(|error| of_row[error.row].push(error));
    of_row.into_iter().filter_map(mean_of_repeats).collect()
}

/// Of mean size, in the direction of the first.
fn mean_of_repeats(errors: Vec<RowError>) -> Option<RowError> {
    let count = errors.len() as f64;
    let mean = |size: &dyn Fn(&RowError) -> Option<f64>| {
        let sizes: Option<Vec<f64>> = errors.iter().map(size).collect();
        sizes.map(|sizes| sizes.iter().sum::<f64>() / count)
    };
    let distance = mean(&|e| e.distance_mm.map(f64::abs));
    let point = mean(&|e| e.point_mm.map(|p| p.norm()));
    let first = errors.first()?.clone();
    let sign = first.distance_mm.map_or(1.0, f64::signum);
    let towards = |p: Vector3<f64>| p.try_normalize(f64::MIN_POSITIVE).unwrap_or_else(Vector3::x);
    Some(RowError {
        distance_mm: distance.map(|d| sign * d),
        point_mm: first.point_mm.and_then(|p| Some(towards(p) * point?)),
        ..first
    })
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::RobotPose;

    #[test]
    fn every_row_is_left_out_once_in_each_repeat_and_rows_of_one_pose_together() {
        let mut world = synthetic::world(60, 0.01, 1);
        let RobotPose { joints_deg, group, .. } = world.rows[20].at.clone();
        world.rows[40].at = RobotPose { joints_deg, group, ..world.rows[40].at.clone() };
        let set = Dataset::new(&world.rows).unwrap();
        let rows = set.fit_rows();
        for of_row in folds(&set, &rows) {
            let sizes: Vec<usize> = (0..FOLDS).map(|f| of_row.iter().filter(|r| **r == Some(f)).count()).collect();
            assert!(sizes.iter().all(|s| (11..=13).contains(s)), "{sizes:?}");
            let is_center = |r: usize| set.poses[r].role == Role::Center;
            assert!(rows.iter().all(|&r| of_row[r].is_some() != is_center(r)));
            assert_eq!(of_row[20], of_row[40]);
        }
        assert_eq!(folds(&set, &rows), folds(&set, &rows));
    }

    #[test]
    fn a_row_that_was_left_out_several_times_has_one_error_of_mean_size() {
        let set = Dataset::new(&synthetic::world(60, 0.01, 1).rows).unwrap();
        let error = |row: usize, distance_mm: f64, point_mm: [f64; 3]| RowError {
            row,
            distance_mm: Some(distance_mm),
            point_mm: Some(point_mm.into()),
            covariance_mm2: Matrix3::zeros(),
        };
        let once = error(3, 2.0, [1.0, 0.0, 0.0]);
        let errors = [error(7, -1.0, [0.0, 3.0, 4.0]), once.clone(), error(7, 3.0, [0.0, 0.0, -15.0])];
        let [first, second] = &one_a_row(&set, errors.into_iter())[..] else { panic!("two rows") };
        assert_eq!(first, &once);
        // Sizes are averaged, for signed errors could cancel; sign and direction are the first's.
        assert_eq!((second.row, second.distance_mm), (7, Some(-2.0)));
        assert!((second.point_mm.unwrap() - Vector3::new(0.0, 6.0, 8.0)).norm() < 1e-12);
    }
}
