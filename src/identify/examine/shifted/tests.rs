use nalgebra::Vector3;

use super::*;
use crate::identify::synthetic;
use crate::measurements::Measurement;

/// Moves the readings from a row on, as if pictures had failed or one had been taken twice: each is of the pose
/// `by` rows further down.
fn planted(rows: &[Measurement], from: usize, by: isize) -> Vec<Measurement> {
    let of = |(i, row): (usize, &Measurement)| {
        let pose = if i < from { Some(i) } else { i.checked_add_signed(by) };
        let source = pose.and_then(|pose| rows.get(pose))?;
        Some(Measurement { observed: source.observed.clone(), ..row.clone() })
    };
    rows.iter().enumerate().filter_map(of).collect()
}

#[test]
fn planted_shifts_are_found_with_row_and_size() {
    for (samples, seed) in [(16, 1), (36, 2), (150, 3)] {
        let world = synthetic::planned(samples, 0, 25.0, 0.02, seed, &|_| {});
        let count = world.rows.len();
        for by in [1, 2, -1] {
            for from in [0, count / 2] {
                let rows = planted(&world.rows, from, by);
                // Where the first rows have no reading the table starts later.
                let dropped = if by < 0 && from == 0 { by.unsigned_abs() } else { 0 };
                let set = Dataset::new(&rows).unwrap();
                let found = find(&set, &world.nominal);
                let said = format!("{count} rows, from {from} by {by}: {found:?}");
                let shift = found.expect(&said);
                assert_eq!(shift.by, by, "{said}");
                assert!(shift.from + dropped >= from && shift.from <= from + 1, "{said}");
                let (mended, finding) = examine(&set, &world.nominal);
                assert!(finding.unwrap().finding.contains("do not belong together"));
                assert!(find(&mended, &world.nominal).is_none(), "{said}: mended, and found again");
            }
        }
    }
}

#[test]
fn clean_tables_and_moved_cameras_raise_no_alarm() {
    for seed in 0..40 {
        let samples = [8, 20, 60, 120][seed as usize % 4];
        let mut world = synthetic::planned(samples, 4, [25.0, 5.0][seed as usize % 2], 0.1, seed, &|_| {});
        assert_eq!(find(&Dataset::new(&world.rows).unwrap(), &world.nominal), None, "{seed}");
        // The cameras were knocked halfway.
        let half = world.rows.len() / 2;
        for row in &mut world.rows[half..] {
            let point = synthetic::point(row);
            *point = crate::geometry::transform(Vector3::new(0.1, 0.0, 0.05), Vector3::new(20.0, 0.0, 0.0)) * *point;
        }
        assert_eq!(find(&Dataset::new(&world.rows).unwrap(), &world.nominal), None, "{seed}, cameras moved");
    }
}

/// Rows in order of their groups, 14 of each, with noise of 0.02 mm.
fn in_groups(seed: u64) -> synthetic::World {
    let mut world = synthetic::planned(44, 8, 25.0, 0.02, seed, &|_| {});
    world.rows.sort_by(|a, b| a.at.group.cmp(&b.at.group));
    world
}

/// Joint angles lost or repeated: from a row on those of the row `by` further down, beside the points.
fn moved_joints(rows: &[Measurement], from: usize, by: isize) -> Vec<Measurement> {
    let of = |(i, row): (usize, &Measurement)| {
        let other = if i < from { Some(i) } else { i.checked_add_signed(by) };
        let mut row = row.clone();
        row.at.joints_deg.clone_from(&rows.get(other?)?.at.joints_deg);
        Some(row)
    };
    rows.iter().enumerate().filter_map(of).collect()
}

/// Each point is where the true robot was, in the frame of its group, and with its own joint angles or its own point.
fn check(mended: &Dataset, world: &synthetic::World, side: Option<Side>, said: &str) {
    for pose in &mended.poses {
        let group = mended.groups[pose.group].name[1..].parse().unwrap();
        let there = synthetic::sensor(group) * world.truth.target_mm(&pose.joints_rad);
        let off_mm = (there - pose.reading.point_mm().unwrap()).norm();
        assert!(off_mm < 0.2, "{said}: {} is off by {off_mm} mm", pose.name);
        let mut own = world.rows.iter().find(|row| row.at.pose == pose.name).unwrap().clone();
        let is_own = match side {
            Some(Side::Joints) => own.at.joints_rad() == pose.joints_rad,
            Some(Side::Points) => Some(*synthetic::point(&mut own)) == pose.reading.point_mm(),
            None => true,
        };
        assert!(is_own && own.at.role == pose.role, "{said}: {}", pose.name);
    }
}

fn mends(side: Side, plant: impl Fn(&[Measurement], usize, isize) -> Vec<Measurement>, seed: u64) {
    let world = in_groups(seed);
    // In the first group, where one begins, in the middle of the table, and in the last group, where nothing tells the
    // side.
    for from in [5, 14, 31, 46] {
        for by in [1, 2, -1, -2] {
            let rows = plant(&world.rows, from, by);
            let set = Dataset::new(&rows).unwrap();
            let (mended, finding) = examine(&set, &world.nominal);
            let said = format!("{side:?} from {from} by {by}: {finding:?}");
            let finding = finding.expect(&said);
            let cause = match side {
                Side::Points if from < 42 => "joint angles that were lost or are twice",
                _ => "a picture that failed or was taken twice",
            };
            assert!(finding.action.contains(cause) && finding.rows.is_empty(), "{said}");
            assert!(mended.poses.len() + 2 * by.unsigned_abs() >= rows.len() && mended.repeats.is_none(), "{said}");
            check(&mended, &world, (from < 42).then_some(side), &said);
        }
    }
}

#[test]
fn points_keep_their_group_where_joint_angles_were_lost_or_are_twice() {
    mends(Side::Points, moved_joints, 5);
}

#[test]
fn joint_angles_keep_their_group_where_pictures_failed_or_were_taken_twice() {
    mends(Side::Joints, planted, 6);
}

/// Two points at the joint angles that are twice are of two poses: their mean is of none.
#[test]
fn points_at_joint_angles_that_are_twice_stay_two() {
    let world = in_groups(7);
    let count = world.rows.len();
    for lost in [6, 20, 44] {
        let mut rows = moved_joints(&world.rows, lost, 1);
        let mut last = world.rows[count - 1].clone();
        last.at.joints_deg.clone_from(&rows[count - 2].at.joints_deg);
        rows.push(last);
        let set = Dataset::new(&rows).unwrap();
        assert_eq!(set.repeats.as_ref().map(|repeats| repeats.poses), Some(1), "{lost}");
        let (mended, finding) = examine(&set, &world.nominal);
        assert!(finding.is_some() && mended.repeats.is_none(), "{lost}: {finding:?}");
        assert_eq!(mended.poses.len(), count - 1, "{lost}");
        check(&mended, &world, None, &format!("lost {lost}"));
    }
}

/// Cameras that were not moved between groups do not tell of which group a row is.
#[test]
fn rows_whose_group_is_not_determined_are_left_out_and_named() {
    let mut world = in_groups(8);
    let mut random = rand::SeedableRng::seed_from_u64(8);
    for row in &mut world.rows {
        let point = synthetic::sensor(0) * world.truth.target_mm(&row.at.joints_rad());
        *synthetic::point(row) = point + 0.3 * synthetic::normal(&mut random);
    }
    let name = |row: usize| world.rows[row].at.pose.clone();
    for (from, left_out) in [(7, vec![13, 27, 41]), (30, vec![41])] {
        let set = Dataset::new(&moved_joints(&world.rows, from, 1)).unwrap();
        let (mended, finding) = examine(&set, &world.truth);
        let finding = finding.unwrap();
        assert_eq!(finding.rows, left_out.iter().map(|row| name(*row)).collect::<Vec<_>>(), "{from}: {finding:?}");
        let sentence = finding.sentence();
        assert!(sentence.contains(&format!("either of two groups are left out: {}", finding.rows.join(", "))));
        for row in &finding.rows {
            assert!(mended.poses.iter().all(|pose| pose.name != *row), "{row}");
            assert!(mended.skipped.iter().any(|skipped| skipped.pose == *row), "{row}");
        }
    }
}

#[test]
fn readings_repeated_without_a_shift_are_one_as_before() {
    for (seed, by_mm) in [(1, 0.0), (2, 0.05), (3, 3.0), (4, 60.0)] {
        let mut world = in_groups(seed);
        // Every third pose was read twice, one of them a good deal off the second time.
        for row in (2..world.rows.len()).rev().step_by(3) {
            let mut again = world.rows[row].clone();
            synthetic::point(&mut again).x += if row == 22 { by_mm } else { 0.01 };
            world.rows.insert(row + 1, again);
        }
        let set = Dataset::new(&world.rows).unwrap();
        let (as_one, finding) = examine(&set, &world.nominal);
        assert_eq!(finding, None, "{by_mm}");
        assert_eq!(as_one, Dataset { apart: None, ..set }, "{by_mm}");
    }
}
