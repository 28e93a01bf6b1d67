use nalgebra::{Point3, Vector3};

use super::*;
use crate::geometry::{Transform, transform};
use crate::identify::data::dataset::{Pose, Reading};
use crate::identify::synthetic::{World, planned, point};
use crate::measurements::{Measurement, Role};
use crate::robot::Parameter;

const NOISE_MM: f64 = 0.05;

/// Rows of one sphere by an arm whose links are off by so many mm and mrad more, and whose tool stands elsewhere.
fn arm(samples: usize, off: f64, tool_mm: f64, seed: u64) -> World {
    planned(4 * samples, 8, 25.0, NOISE_MM, seed, &|robot| {
        for (i, joint) in robot.joints.iter_mut().enumerate() {
            joint.theta_rad += 1e-3 * off * (1.0 + 2.0 * i as f64 + seed as f64).sin();
            joint.a_mm += off * (2.0 + 3.0 * i as f64 + seed as f64).cos();
        }
        robot.tool_mm += Vector3::new(tool_mm, -tool_mm, 0.5 * tool_mm);
    })
}

/// The rows of each world, as files of a run of several where `files`, else as the parts of one table that no column
/// tells apart.
fn tables(worlds: &[World], files: bool) -> (Dataset, Robot) {
    let mut rows: Vec<Measurement> = Vec::new();
    for (k, world) in worlds.iter().enumerate() {
        let of_sphere = world.rows.iter().filter(|row| row.at.group == "g0" && row.at.role != Role::Center);
        rows.extend(of_sphere.cloned().map(|mut row| {
            let name = format!("{}:", k + 1);
            row.at.group = if files { name.clone() + "1" } else { "1".into() };
            row.at.pose = if files { name } else { ["a", "b", "c"][k].to_owned() } + &row.at.pose;
            row
        }));
    }
    let mut set = Dataset::new(&rows).unwrap();
    set.files = if files { (1..=worlds.len()).map(|k| format!("arm_{k}.csv")).collect() } else { Vec::new() };
    (set, worlds[0].nominal.clone())
}

/// Moves the points of all rows from one on, as a sensor that was moved there.
fn move_from(set: &mut Dataset, row: usize, moved: Transform) {
    for pose in &mut set.poses[row..] {
        *point_of(pose) = moved * *point_of(pose);
    }
}

fn point_of(pose: &mut Pose) -> &mut Point3<f64> {
    let Reading::Position { point_mm, .. } = &mut pose.reading else { panic!("a point") };
    point_mm
}

fn found(set: &Dataset, robot: &Robot) -> Option<Robots> {
    find(set, robot, &Settings::default())
}

#[test]
fn files_of_two_or_three_arms_are_told_with_what_each_leaves() {
    // Some draws are of arms that are nearly one within a single sphere; these are not.
    for (samples, off) in [(60, 1.0), (30, 1.0), (30, 3.0), (16, 3.0)] {
        for seed in [1, 3] {
            let worlds = [arm(samples, 0.0, 0.0, seed), arm(samples, off, 0.0, seed + 20)];
            let (set, robot) = tables(&worlds, true);
            let Robots { parts, together_mm } = found(&set, &robot).expect("two arms");
            let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
            assert_eq!(names, ["arm_1.csv", "arm_2.csv"], "{samples} rows, {off}, seed {seed}");
            for Part { alone_mm, .. } in parts {
                assert!((0.5..2.0).contains(&(alone_mm / NOISE_MM)) && together_mm > 2.0 * alone_mm, "{alone_mm}");
            }
        }
    }
    let worlds = [arm(40, 0.0, 0.0, 1), arm(40, 1.0, 0.0, 2), arm(40, 1.0, 0.0, 3)];
    let (set, robot) = tables(&worlds, true);
    assert_eq!(found(&set, &robot).expect("three arms").parts.len(), 3);
}

#[test]
fn the_part_of_a_table_that_is_of_another_arm_is_found_where_it_begins() {
    let (mut told, mut all) = (0, 0);
    for (first, second, off) in [(60, 60, 1.0), (60, 30, 1.0), (20, 60, 2.0), (60, 12, 3.0)] {
        let seed = 1;
        let worlds = [arm(first, 0.0, 0.0, seed), arm(second, off, 5.0, seed + 20)];
        let (set, robot) = tables(&worlds, false);
        all += 1;
        let Some(robots) = found(&set, &robot) else { continue };
        told += 1;
        let begins = robots.parts[1].rows[0];
        let table_begins = set.poses.iter().position(|pose| pose.name.starts_with('b')).unwrap();
        assert!(robots.parts.len() == 2 && begins.abs_diff(table_begins) <= 2, "{off}, seed {seed}: {robots:?}");
        let parted = robots.parted(&set);
        assert_eq!(parted.groups.len(), 2);
        assert_ne!(parted.poses[begins].group, parted.poses[begins - 1].group);
    }
    // Arms that are nearly one within a single sphere are not told.
    assert!(told + 1 >= all, "{told} of {all}");
    let worlds = [arm(40, 0.0, 0.0, 1), arm(40, 2.0, 0.0, 2), arm(40, 2.0, 0.0, 3)];
    let (set, robot) = tables(&worlds, false);
    assert_eq!(found(&set, &robot).expect("three arms").parts.len(), 3);
}

#[test]
fn rows_that_alternate_between_two_arms_or_tools_are_told() {
    for (off, tool_mm) in [(0.0, 0.0), (0.0, 2.0), (2.0, 0.0), (2.0, 30.0)] {
        for seed in [1, 3] {
            let worlds = [arm(30, 0.0, 0.0, seed), arm(30, off, tool_mm, seed + 20)];
            let (mut set, robot) = tables(&worlds, false);
            let late = set.poses.split_off(set.poses.len() / 2);
            set.poses = set.poses.into_iter().zip(late).flat_map(|(early, late)| [early, late]).collect();
            let said = alternating::find(&set, &robot).map(|finding| finding.finding);
            let is_told = said.as_ref().is_some_and(|said| said.starts_with("every other row is of another arm"));
            assert_eq!(is_told, off + tool_mm > 0.0, "{off}, {tool_mm} mm, seed {seed}: {said:?}");
            let examined = crate::identify::examine::examine(&set, &robot, &Settings::default(), &|_| {});
            assert_eq!(examined.against.first().map(|finding| finding.finding.clone()), said);
        }
    }
    for (set, robot) in lacking(0, 2, 0.1, 1) {
        assert_eq!(alternating::find(&set, &robot), None);
    }
}

#[test]
fn one_robot_is_one_whatever_was_moved_beside_it() {
    for seed in [0, 8] {
        let (samples, tool_mm) = ([12, 30, 60][seed as usize % 3], [0.0, 2.0, 60.0][seed as usize / 3 % 3]);
        for files in [true, false] {
            // The second table is by the same arm, with another tool, seen by a camera that was moved.
            let worlds = [arm(samples, 0.0, 0.0, seed), arm(samples, 0.0, tool_mm, seed + 50)];
            let (mut set, robot) = tables(&worlds, files);
            assert_eq!(found(&set, &robot), None, "seed {seed}, a tool {tool_mm} mm elsewhere, files {files}");
            let moved = transform(Vector3::new(0.02, 0.1, -0.05), Vector3::new(30.0, -80.0, 15.0));
            let half = set.poses.len() / 2;
            move_from(&mut set, half + 1, moved);
            set.poses.iter_mut().skip(4).step_by(9).for_each(|pose| point_of(pose).x += 3.0);
            assert_eq!(found(&set, &robot), None, "seed {seed}, camera moved, gross errors, files {files}");
        }
    }
}

#[test]
fn cameras_that_moved_several_times_are_no_robots() {
    for seed in 0..6 {
        let mut world = planned(240, 0, 25.0, NOISE_MM, seed, &|_| {});
        world.rows.retain(|row| row.at.group == "g0");
        for (i, row) in world.rows.iter_mut().enumerate() {
            let step = (i / 15) as f64;
            *point(row) =
                transform(Vector3::new(0.01, 0.0, 0.02) * step, Vector3::new(3.0, 0.0, 1.0) * step) * *point(row);
        }
        assert_eq!(found(&Dataset::new(&world.rows).unwrap(), &world.nominal), None, "{seed}");
    }
}

/// Gears and the weight of the arm, which the links do not describe, in rows as they come and in the order of a joint.
fn lacking(seed: u64, weighed: usize, by_deg: f64, order: usize) -> [(Dataset, Robot); 2] {
    let mut world = planned(160, 0, 25.0, 0.02, seed, &|_| {});
    world.rows.retain(|row| row.at.role != Role::Center);
    for row in &mut world.rows {
        row.at.joints_deg[1] += 0.1 * (2.0 * row.at.joints_deg[1].to_radians()).sin();
        row.at.joints_deg[weighed] += by_deg * row.at.joints_deg[weighed].to_radians().cos();
    }
    let as_they_come = Dataset::new(&world.rows).unwrap();
    world.rows.sort_by(|a, b| a.at.joints_deg[order].total_cmp(&b.at.joints_deg[order]));
    [as_they_come, Dataset::new(&world.rows).unwrap()].map(|set| (set, world.nominal.clone()))
}

#[test]
fn what_a_model_lacks_makes_no_robots_and_moves_no_tool() {
    for seed in 0..2 {
        for (set, robot) in lacking(seed, 2, 0.1, 1) {
            assert_eq!(found(&set, &robot), None, "{seed}");
        }
        for (set, robot) in lacking(seed, 4, 0.2, 4) {
            assert_eq!(tools::find(&set, &robot), None, "{seed}");
        }
    }
}

/// Spheres one after the other by an arm one joint of which turns by so many thousandths more than it reads.
#[test]
fn a_joint_that_reads_too_much_makes_no_robots() {
    const NOISE_MM: f64 = 0.005;
    for (seed, joint, per_mille) in [(0, 2, 1.0), (1, 2, 3.0), (2, 1, 1.0), (3, 2, 3.0), (4, 3, 3.0)] {
        let mut world =
            planned(76, 0, 25.0, NOISE_MM, seed, &|robot| robot.add(Parameter::Coupling(joint, joint), per_mille));
        world.rows.retain(|row| row.at.role != Role::Center);
        world.rows.sort_by(|a, b| a.at.group.cmp(&b.at.group));
        let set = Dataset::new(&world.rows).unwrap();
        let what = format!("joint {}, {per_mille} per mille", joint + 1);
        assert_eq!(found(&set, &world.nominal), None, "{what}");
        // The links alone leave far more than noise, the joint's scale does not.
        let table = Table::new(&set, &world.nominal).unwrap();
        let rows = [(0..table.rows.len()).collect::<Vec<usize>>()];
        let links_mm = table.points.together(&rows, &vec![1.0; rows[0].len()]).scatter_mm();
        assert!(links_mm > MUCH_LARGER * NOISE_MM, "{what}: {links_mm}");
        assert!(table.is_one_beyond_links(&rows, NOISE_MM), "{what}");
    }
}

#[test]
fn tools_of_their_own_leave_no_more_than_one_tool_does() {
    for seed in 0..4 {
        let world = arm(150, 3.0, 33.0, seed);
        let (set, robot) = tables(std::slice::from_ref(&world), false);
        let table = Table::new(&set, &robot).unwrap();
        let count = table.rows.len();
        let parts: Vec<Vec<usize>> = [0, 8, 17, 46, count].windows(2).map(|cut| (cut[0]..cut[1]).collect()).collect();
        let weights = vec![1.0; count];
        let [several, one] = [parts, vec![(0..count).collect()]].map(|p| table.points.together(&p, &weights).squares);
        assert!(several < 1.001 * one, "seed {seed}: {several} {one}");
    }
}

#[test]
fn a_tool_that_moved_between_rows_or_files_is_told_with_how_far() {
    for seed in 0..3 {
        let files = seed != 1;
        let (samples, tool_mm) = ([20, 40, 60][seed as usize % 3], [2.0, 20.0][seed as usize % 2]);
        let (set, robot) = tables(&[arm(samples, 0.0, 0.0, seed), arm(samples, 0.0, tool_mm, seed + 50)], files);
        let told = tools::find(&set, &robot).unwrap_or_else(|| panic!("seed {seed}, files {files}"));
        assert!(!told.is_placed, "{told:?}");
        let finding = told.finding;
        // The tool moves along x, y and half of that along z.
        let text = finding.finding.split(" by ").nth(1).unwrap();
        let far_mm: f64 = text.split(' ').next().unwrap().parse().unwrap();
        assert!((far_mm / (1.5 * tool_mm) - 1.0).abs() < 0.1, "{seed} {files}: {finding:?}");
        let where_ = if files { "elsewhere on the flange than in arm_1.csv: in arm_2.csv" } else { "from row b" };
        assert!(finding.finding.contains(where_), "{seed} {files}: {finding:?}");
        let (same, robot) = tables(&[arm(samples, 0.0, 0.0, seed), arm(samples, 0.0, 0.0, seed + 50)], files);
        assert_eq!(tools::find(&same, &robot), None, "seed {seed}, files {files}");
        // A camera that moved is no tool.
        let mut moved = same.clone();
        let step = transform(Vector3::new(0.02, 0.1, -0.05), Vector3::new(30.0, -80.0, 15.0));
        let half = moved.poses.len() / 2;
        move_from(&mut moved, half, step);
        let told = tools::find(&moved, &robot);
        assert!(told.is_none_or(|told| told.is_placed), "seed {seed}, files {files}, camera moved");
    }
}

/// One target that the last joint turns moves as on a tool that was turned; a tool that went along the axis is no
/// joint's.
#[test]
fn the_last_joint_is_named_beside_the_tool_where_one_target_does_not_tell_them_apart() {
    for seed in 0..3 {
        let (mut set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 0.0, seed + 50)], false);
        let half = set.poses.len() / 2;
        set.poses[half..].iter_mut().for_each(|pose| pose.joints_rad[5] -= 0.1);
        let told = tools::find(&set, &robot).expect("a tool").finding.finding;
        assert!(told.contains("the tool moved on the flange by"), "{seed}: {told}");
        let named = told.split("or the zero of joint 6 moved by ").nth(1).unwrap_or_else(|| panic!("{seed}: {told}"));
        let by_deg: f64 = named.split(' ').next().unwrap().parse().unwrap();
        assert!((by_deg.abs() - 0.1_f64.to_degrees()).abs() < 0.5, "{seed}: {told}");
        let (set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 20.0, seed + 50)], false);
        let told = tools::find(&set, &robot).expect("a tool").finding.finding;
        assert!(!told.contains("the zero of joint"), "{seed}: {told}");
    }
}

#[test]
fn rows_that_were_misread_are_no_other_tool_and_no_other_robot() {
    for (seed, by_mm) in [(0, 10.0), (4, 1e7)] {
        let (mut set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 0.0, seed + 50)], false);
        for row in [9, 47] {
            point_of(&mut set.poses[row]).y += by_mm;
            assert_eq!((tools::find(&set, &robot), found(&set, &robot)), (None, None), "{by_mm} mm, {row}");
        }
        // Beside them a tool that moved is found all the same.
        let (mut set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 20.0, seed + 50)], false);
        point_of(&mut set.poses[9]).y += by_mm;
        let told = tools::find(&set, &robot).expect("a tool").finding.finding;
        assert!(told.contains("the tool moved on the flange by 30."), "{by_mm}: {told}");
    }
}

/// What is said of rows that were cut into sessions.
fn of_sessions(set: &Dataset, robot: &Robot) -> Option<(usize, Option<String>)> {
    let (cut, along) = sessions::find(set, robot, &Settings::default());
    let said = tools::of_sessions(set, &cut, robot).map(|finding| finding.finding);
    (!along.sessions.is_empty()).then_some((along.sessions.len(), said))
}

#[test]
fn sessions_that_a_tool_explains_better_are_not_said_to_be_the_sensors() {
    for (seed, tool_mm) in [(1, 0.2), (2, 0.2), (3, 0.5), (4, 0.5), (5, 3.0)] {
        let (set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, tool_mm, seed + 50)], false);
        let Some((_, said)) = of_sessions(&set, &robot) else { continue };
        let said = said.unwrap_or_else(|| panic!("{tool_mm} mm, seed {seed}"));
        assert!(said.contains("the tool moved on the flange by"), "{tool_mm} mm, seed {seed}: {said}");
        assert!(tool_mm < 0.5 || !said.contains("the sensor"), "{tool_mm} mm, seed {seed}: {said}");
    }
    for (seed, by) in [(1, 0.3), (2, 1.0), (3, 10.0)] {
        let (mut set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 0.0, seed + 50)], false);
        let step = transform(1e-3 * by * Vector3::new(1.0, 0.7, -0.5), by * Vector3::new(1.0, -0.5, 0.7));
        let half = set.poses.len() / 2;
        move_from(&mut set, half, step);
        let said = of_sessions(&set, &robot);
        assert!(said.as_ref().is_none_or(|(_, said)| said.is_none()), "{by} mm, seed {seed}: {said:?}");
        assert!(by < 10.0 || said.is_some(), "{by} mm, seed {seed}");
    }
}

#[test]
fn a_joint_that_was_mastered_anew_between_sessions_is_named() {
    for (seed, joint, by_deg) in [(1, 1, 0.05), (2, 2, 0.1), (3, 4, 0.3)] {
        let (mut set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 0.0, seed + 50)], false);
        let half = set.poses.len() / 2;
        set.poses[half..].iter_mut().for_each(|pose| pose.joints_rad[joint] -= f64::to_radians(by_deg));
        let Some((_, said)) = of_sessions(&set, &robot) else { continue };
        let said = said.unwrap_or_else(|| panic!("joint {}", joint + 1));
        assert!(said.contains(&format!("the zero of joint {} moved by", joint + 1)), "{said}");
    }
}

/// What is said where the zero of a joint seems to step half way.
#[test]
fn a_step_that_a_tool_explains_is_not_said_to_be_a_joints() {
    let at_half = |set: &Dataset, robot: &Robot| {
        let from = &set.poses[set.poses.len() / 2].name;
        tools::of_step(set, from, robot).map(|finding| finding.finding)
    };
    for (seed, tool_mm) in [(1, 0.3), (2, 0.5), (3, 3.0)] {
        let (set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, tool_mm, seed + 50)], false);
        let said = at_half(&set, &robot).unwrap_or_else(|| panic!("{tool_mm} mm, seed {seed}"));
        assert!(said.contains("the tool moved on the flange by"), "{tool_mm} mm, seed {seed}: {said}");
    }
    for (seed, joint, by_deg) in [(1, 1, 0.05), (2, 2, 0.1), (3, 1, 0.3)] {
        let (mut set, robot) = tables(&[arm(40, 0.0, 0.0, seed), arm(40, 0.0, 0.0, seed + 50)], false);
        let half = set.poses.len() / 2;
        set.poses[half..].iter_mut().for_each(|pose| pose.joints_rad[joint] -= f64::to_radians(by_deg));
        assert_eq!(at_half(&set, &robot), None, "joint {}", joint + 1);
    }
}
