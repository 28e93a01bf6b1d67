use nalgebra::{Matrix3, Point3, Vector3};

use super::*;
use crate::geometry::{fitted_frame, transform};
use crate::identify::data::dataset::Dataset;
use crate::identify::examine::orientations;
use crate::identify::judge::errors::Judge;
use crate::identify::synthetic::{self, point};
use crate::measurements::{Measurement, Observed, Role};
use crate::robot::Robot;

const NOISE_MM: f64 = 0.02;

/// Three targets off a line, and a fourth.
const TARGETS: [(&str, Vector3<f64>); 4] = [
    ("a", Vector3::new(60.0, 0.0, 20.0)),
    ("b", Vector3::new(-30.0, 45.0, 25.0)),
    ("c", Vector3::new(-20.0, -55.0, 40.0)),
    ("d", Vector3::new(15.0, 20.0, 70.0)),
];

fn rows(count: usize, seed: u64) -> Vec<Measurement> {
    synthetic::of_targets(&synthetic::world(40, 0.0, seed), &TARGETS[..count], NOISE_MM, seed)
}

fn one(rows: &[Measurement]) -> (Vec<Measurement>, Targets) {
    as_one(rows).unwrap().unwrap()
}

/// The true robot with the mean of so many targets for its tool.
fn with_mean(world: &synthetic::World, count: usize) -> Robot {
    let mean = TARGETS[..count].iter().map(|(_, p)| p).sum::<Vector3<f64>>() / count as f64;
    Robot { tool_mm: mean, ..world.truth.clone() }
}

fn refusal(rows: &[Measurement]) -> String {
    as_one(rows).err().unwrap().to_string()
}

#[test]
fn the_mark_point_is_the_mean_and_turns_with_the_flange() {
    for count in [3, 4] {
        let world = synthetic::world(40, 0.0, 3);
        let (poses, targets) = one(&rows(count, 3));
        assert_eq!((poses.len(), targets.names.len(), targets.oriented), (world.rows.len(), count, true));
        let scatter_mm = targets.scatter_mm.unwrap();
        assert!((scatter_mm / NOISE_MM - 1.0).abs() < 0.15, "{scatter_mm}");
        let truth = with_mean(&world, count);
        let mut turns = Vec::new();
        let mut distances = Vec::new();
        for pair in poses.iter().filter(|p| p.at.group == "g0").collect::<Vec<_>>().windows(2) {
            let of = |m: &Measurement| match &m.observed {
                Observed::Position { point_mm, rotation_rad: Some(r), .. } => transform(*r, point_mm.coords),
                _ => panic!("a point with an orientation"),
            };
            let flange = |m: &Measurement| truth.base_from_flange(&m.at.joints_rad()).rotation;
            let (a, b) = (of(pair[0]), of(pair[1]));
            turns.push(a.rotation.angle_to(&b.rotation) - flange(pair[0]).angle_to(&flange(pair[1])));
            let apart = truth.target_mm(&pair[0].at.joints_rad()) - truth.target_mm(&pair[1].at.joints_rad());
            distances.push((a.translation.vector - b.translation.vector).norm() - apart.norm());
        }
        let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt();
        // Of two means of so many readings; turns of so large a body.
        assert!(rms(&distances) < 1.5 * NOISE_MM * (2.0 / count as f64).sqrt(), "{}", rms(&distances));
        assert!(rms(&turns) < 2.0 * NOISE_MM / 50.0, "{}", rms(&turns));
        assert_eq!(targets.findings, []);
    }
}

#[test]
fn the_covariance_is_that_of_the_mean() {
    let mut list = rows(3, 5);
    let stated = Matrix3::from_diagonal(&Vector3::new(1e-4, 4e-4, 9e-4));
    synthetic::state(&mut list, |_| Some(stated));
    let (poses, _) = one(&list);
    for pose in &poses {
        let Observed::Position { covariance_mm2: Some(c), .. } = &pose.observed else { panic!() };
        // The body's origin is the mean, and its turn takes nothing from it where the noise is alike at all targets.
        assert!((c - stated / 3.0).norm() < 0.02 * stated.norm(), "{c}");
    }
}

#[test]
fn clean_targets_raise_no_alarm() {
    for seed in 0..20 {
        for count in [2, 3, 4] {
            let (_, targets) = one(&rows(count, seed));
            assert_eq!(targets.findings, [], "{seed} {count}");
        }
    }
}

#[test]
fn a_gross_error_of_one_target_is_named() {
    for (size_mm, seed) in [(0.5, 1), (2.0, 2), (50.0, 3)] {
        let mut list = rows(4, seed);
        point(&mut list[4 * 7 + 1]).x += size_mm;
        let name = list[4 * 7 + 1].at.pose.clone();
        let (poses, targets) = one(&list);
        assert_eq!(targets.findings.len(), 1, "{size_mm}");
        assert!(targets.findings[0].sentence().contains("target b does not stand"), "{:?}", targets.findings);
        assert_eq!(targets.findings[0].rows, vec![name.clone()]);
        assert!(matches!(poses[7].observed, Observed::Position { .. }));

        // Of three nobody knows which is off.
        let mut list = rows(3, seed);
        point(&mut list[3 * 7 + 1]).x += size_mm;
        let (poses, targets) = one(&list);
        assert!(targets.findings[0].sentence().contains("a fourth target"), "{:?}", targets.findings);
        assert_eq!((targets.findings.len(), &targets.findings[0].rows), (1, &vec![name]));
        assert!(matches!(poses[7].observed, Observed::Missing { .. }));
    }
}

#[test]
fn exchanged_names_are_mended() {
    for count in [3, 4] {
        let mut list = rows(count, 4);
        let (clean, _) = one(&list);
        for pose in [3, 11] {
            let (a, b) = (count * pose, count * pose + 2);
            (list[a].target, list[b].target) = (list[b].target.clone(), list[a].target.clone());
        }
        let (poses, targets) = one(&list);
        assert_eq!(targets.findings.len(), 1);
        assert!(targets.findings[0].sentence().contains("targets a and c are exchanged"));
        assert_eq!(targets.findings[0].rows, [list[count * 3].at.pose.clone(), list[count * 11].at.pose.clone()]);
        for (mended, clean) in poses.iter().zip(&clean) {
            let (Observed::Position { point_mm: a, .. }, Observed::Position { point_mm: b, .. }) =
                (&mended.observed, &clean.observed)
            else {
                panic!()
            };
            assert!((a - b).norm() < NOISE_MM, "{a} {b}");
        }
    }
}

/// Rows of so many targets, one of which stands elsewhere by so much from a pose on.
fn rows_with_moved(count: usize, seed: u64, from: usize, by_mm: f64) -> Vec<Measurement> {
    read_with_moved(count, seed, from, by_mm, NOISE_MM)
}

/// The same with another noise of a coordinate, mm.
fn read_with_moved(count: usize, seed: u64, from: usize, by_mm: f64, noise_mm: f64) -> Vec<Measurement> {
    let mut later = TARGETS;
    later[2].1 += by_mm * Vector3::new(0.6, -0.7, 0.4);
    let world = synthetic::world(40, 0.0, seed);
    let [before, after] = [TARGETS, later].map(|t| synthetic::of_targets(&world, &t[..count], noise_mm, seed));
    before[..count * from].iter().chain(&after[count * from..]).cloned().collect()
}

#[test]
fn a_target_that_moved_is_named_and_counts_as_another() {
    for (by_mm, from) in [(0.2, 25), (2.0, 10), (2.0, 25), (30.0, 40)] {
        let list = rows_with_moved(4, 6, from, by_mm);
        let (poses, targets) = one(&list);
        let sentence = targets.findings[0].sentence();
        let named = format!("target c was moved before {}", list[4 * from].at.pose);
        assert!(sentence.contains(&named) && sentence.contains("another target"), "{by_mm} {from}: {sentence}");
        assert_eq!(targets.findings.len(), 1, "{by_mm} {from}: {:?}", targets.findings);
        assert!(poses.iter().all(|p| matches!(p.observed, Observed::Position { .. })));
        // Of three the others don't tell the turn: there they are points of the body.
        let list = rows_with_moved(3, 6, from, by_mm);
        let (poses, targets) = one(&list);
        let sentence = targets.findings[0].sentence();
        // Its distance to one of them hardly changes, and to the other it may be that one's.
        let named = ["target c was moved", "target c or b was moved"].iter().any(|named| sentence.starts_with(named));
        assert!(named && sentence.contains("left out"), "{by_mm} {from}: {sentence}");
        let kept = poses.iter().filter(|p| matches!(p.observed, Observed::Position { .. })).count();
        assert_eq!(kept, poses.len(), "{by_mm} {from}");
    }
}

/// A tracker sees a micrometre; what moves by less than the robot repeats to costs no orientation and no doubt.
#[test]
fn a_target_that_moved_by_next_to_nothing_is_used_all_the_same() {
    for (count, by_mm) in [(3, 0.004), (3, 0.01), (4, 0.004)] {
        let (poses, targets) = one(&read_with_moved(count, 6, 20, by_mm, 0.0008));
        assert!(targets.findings.is_empty(), "{count} {by_mm}: {:?}", targets.findings);
        assert!(targets.sentence().contains("target c stands"), "{count} {by_mm}: {}", targets.sentence());
        let whole = |pose: &&Measurement| matches!(pose.observed, Observed::Position { rotation_rad: Some(_), .. });
        assert_eq!(poses.iter().filter(whole).count(), poses.len(), "{count} {by_mm}");
    }
}

#[test]
fn a_target_that_hardly_moved_hides_no_other_that_did() {
    let (mut slightly, count) = (TARGETS, 4);
    slightly[2].1 += 0.008 * Vector3::new(0.6, -0.7, 0.4);
    let mut later = slightly;
    later[0].1 += Vector3::new(0.3, 0.9, -0.3);
    let world = synthetic::world(40, 0.0, 6);
    let [before, after, last] =
        [TARGETS, slightly, later].map(|t| synthetic::of_targets(&world, &t[..count], 0.0008, 6));
    let rows = before[..count * 14].iter().chain(&after[count * 14..count * 27]).chain(&last[count * 27..]);
    let (_, targets) = one(&rows.cloned().collect::<Vec<_>>());
    assert!(targets.sentence().contains("target c stands"), "{}", targets.sentence());
    let told = |name: &str| targets.findings.iter().any(|f| f.sentence().contains(&format!("target {name} was moved")));
    assert!(told("a") && !told("c"), "{:?}", targets.findings);
}

#[test]
fn two_targets_and_targets_on_a_line_give_their_mean() {
    let world = synthetic::world(20, 0.0, 2);
    let line: Vec<(&str, Vector3<f64>)> =
        [("a", 0.0), ("b", 30.0), ("c", 70.0)].map(|(n, x)| (n, Vector3::new(x, 2.0 * x, 10.0))).into();
    for targets in [&line[..], &line[..2]] {
        let mut list = synthetic::of_targets(&world, targets, NOISE_MM, 1);
        list[1].observed = Observed::Missing { reason: "hidden".to_owned() };
        // Along the line: across it nothing would be seen.
        let at = 5 * targets.len();
        let away = *point(&mut list[at]) - *point(&mut list[at + 1]);
        *point(&mut list[at]) += away.normalize();
        let (poses, found) = one(&list);
        assert!(!found.oriented);
        let Observed::Position { rotation_rad: None, .. } = poses[1].observed else { panic!("{:?}", poses[1]) };
        assert!(poses[1].target.is_empty() && found.part_mm(&poses[0].target).is_some());
        assert!(matches!(&poses[5].observed, Observed::Missing { reason } if reason.contains("do not stand")));
        assert_eq!(found.findings.len(), 1);
    }
}

#[test]
fn a_pose_that_shows_too_few_is_a_point_of_the_body() {
    let mut list = rows(3, 7);
    list.remove(3 * 5);
    for row in &mut list[3 * 8 - 1..3 * 9 - 1] {
        row.observed = Observed::Missing { reason: "beam broken".to_owned() };
    }
    list[3 * 12 - 1].observed = Observed::Missing { reason: "hidden".to_owned() };
    list[3 * 12].observed = Observed::Missing { reason: "hidden".to_owned() };
    // Two targets that stand otherwise to each other than elsewhere are no part of this body.
    list[3 * 20 - 1].observed = Observed::Missing { reason: "hidden".to_owned() };
    let away = *point(&mut list[3 * 20]) - *point(&mut list[3 * 20 + 1]);
    *point(&mut list[3 * 20]) += 0.5 * away.normalize();
    let (poses, targets) = one(&list);
    let size = |name: &str| targets.part_mm(name).unwrap().norm();
    let centre = TARGETS[..3].iter().map(|(_, p)| p).sum::<Vector3<f64>>() / 3.0;
    assert_eq!((poses[5].target.as_str(), poses[12].target.as_str()), ("b + c", "c"));
    assert!((size("b + c") - ((TARGETS[1].1 + TARGETS[2].1) / 2.0 - centre).norm()).abs() < 2.0 * NOISE_MM);
    assert!(matches!(&poses[8].observed, Observed::Missing { reason } if reason == "beam broken"));
    assert!(matches!(&poses[20].observed, Observed::Missing { reason } if reason.contains("do not stand")));
    assert_eq!(targets.findings.len(), 1, "{:?}", targets.findings);
    assert!(targets.sentence().contains("2 poses show fewer"), "{}", targets.sentence());
}

/// What was measured at the poses `from` on shows one target alone, each in its turn.
fn single(list: &[Measurement], count: usize, from: usize) -> Vec<Measurement> {
    let shows = |i: usize| i / count < from || i % count == (i / count) % count;
    list.iter().enumerate().filter(|(i, _)| shows(*i)).map(|(_, row)| row.clone()).collect()
}

/// Mean distance of two robots' points at the poses of a world once their bases are brought together.
fn mean_miss(world: &synthetic::World, robot: &Robot, truth: &Robot) -> f64 {
    let joints: Vec<Vec<f64>> = world.rows.iter().map(|r| r.at.joints_rad()).collect();
    let frame = fitted_frame(joints.iter().map(|q| (robot.target_mm(q), truth.target_mm(q), 1.0)));
    let miss = |q: &Vec<f64>| (frame * robot.target_mm(q) - truth.target_mm(q)).norm();
    joints.iter().map(miss).sum::<f64>() / joints.len() as f64
}

#[test]
fn single_targets_tell_as_much_of_the_robot_as_their_points() {
    for (count, from) in [(3, 14), (2, 14)] {
        let world = synthetic::world(40, 0.0, 3);
        let truth = with_mean(&world, count);
        let miss = |rows: &[Measurement]| {
            let (set, found) = world.identified(rows);
            assert_eq!(set.skipped, []);
            mean_miss(&world, found.robot(), &truth)
        };
        let (all, alone) = (miss(&single(&rows(count, 3), count, from)), miss(&rows(count, 3)[..count * from]));
        assert!(
            all < 0.05 && all < alone,
            "{count} targets, {from} whole poses: {all} with the single ones, {alone} without"
        );
    }
}

#[test]
fn targets_that_no_pose_shows_together_are_joined_by_the_robot() {
    let world = synthetic::world(60, 0.0, 3);
    let truth = Robot { tool_mm: TARGETS[0].1, ..world.truth.clone() };
    let miss = |rows: &[Measurement]| {
        let set = Dataset::of_robot(rows, &world.nominal).unwrap();
        assert_eq!((set.skipped.len(), set.poses.len()), (0, rows.len()));
        let found = synthetic::identified(&set, &world.nominal);
        let judge = Judge { extras: &found.extras, ..Judge::plain(&set, &found.fitted, true) };
        let errors =
            judge.errors(found.robot(), &found.fitted).into_iter().filter_map(|e| e.point_mm).map(|e| e.norm());
        assert!(errors.fold(0.0, f64::max) < 10.0 * NOISE_MM);
        let solved = set.targets.clone().map(|targets| targets.solved(&found.extras));
        for (name, part) in solved.iter().flat_map(|targets| &targets.parts) {
            let place = TARGETS.iter().find(|(n, _)| n == name).unwrap().1 - TARGETS[0].1;
            assert!((Vector3::from(part.place_mm) - place).norm() < 2.0, "{name}: {part:?} for {place:?}");
        }
        mean_miss(&world, found.robot(), &truth)
    };
    let all = synthetic::of_targets(&world, &TARGETS[..3], NOISE_MM, 3);
    // The first is shown by half of the poses, the others by a quarter each.
    let shows = |i: usize| i % 3 == [0, 1, 0, 2][(i / 3 + i / 12) % 4];
    let mixed: Vec<Measurement> =
        all.iter().enumerate().filter(|(i, _)| shows(*i)).map(|(_, row)| row.clone()).collect();
    let alone: Vec<Measurement> = mixed.iter().filter(|row| row.target == "a").cloned().collect();
    let whole: Vec<Measurement> = all.iter().filter(|row| row.target == "a").cloned().collect();
    let [mixed, alone, whole] = [&mixed, &alone, &whole].map(|rows| miss(rows));
    assert!(mixed < 0.8 * alone && mixed < 2.0 * whole, "{mixed} mm, {alone} of one target, {whole} of all poses");
}

#[test]
fn few_whole_poses_tell_where_the_single_targets_of_all_others_stand() {
    for (count, from) in [(3, 1), (3, 2), (3, 14), (3, 44)] {
        let world = synthetic::world(40, 0.0, 3);
        let truth = with_mean(&world, count);
        let set = Dataset::new(&single(&rows(count, 3), count, from)).unwrap();
        let fitted: Vec<usize> = (0..set.poses.len()).collect();
        let errors = Judge::plain(&set, &fitted, false).errors(&truth, &fitted);
        assert_eq!(errors.len(), set.poses.len());
        let most = errors.iter().filter_map(|e| e.point_mm).map(|e| e.norm()).fold(0.0, f64::max);
        // The body is as its few poses show it.
        assert!(most < 10.0 * NOISE_MM, "{count} targets, {from} whole poses: {most} mm");
    }
}

#[test]
fn what_is_no_body_is_refused() {
    let mut list = rows(3, 1);
    for (i, row) in list.iter_mut().enumerate() {
        let size = 30.0 * (7.3 * i as f64).sin();
        *point(row) += Vector3::new(size, -size, 0.5 * size);
    }
    assert!(refusal(&list).contains("no rigid body"));
    list.iter_mut().for_each(|row| *point(row) = Point3::new(1.0, 2.0, 3.0));
    assert!(refusal(&list).contains("no rigid body"));
}

#[test]
fn one_target_by_name_is_one_target() {
    let list: Vec<Measurement> = rows(3, 1).into_iter().filter(|row| row.target == "b").collect();
    assert!(as_one(&list).unwrap().is_none());
    let set = Dataset::new(&list).unwrap();
    assert_eq!((set.poses.len(), set.targets.is_none()), (list.len(), true));
    assert_eq!(list.iter().filter(|r| r.at.role == Role::Center).count(), 4);
}

#[test]
fn exchanged_names_of_an_even_triangle_show_by_their_turn() {
    let triangle: Vec<(&str, Vector3<f64>)> = [("a", 90.0f64), ("b", 210.0), ("c", 330.0)]
        .map(|(name, deg)| (name, Vector3::new(60.0 * deg.to_radians().cos(), 60.0 * deg.to_radians().sin(), 20.0)))
        .into();
    let world = synthetic::world(40, 0.0, 8);
    let mut list = synthetic::of_targets(&world, &triangle, NOISE_MM, 8);
    let said = |list: &[Measurement]| orientations::examine(&Dataset::new(list).unwrap(), &world.nominal, false);
    let (clean, finding) = said(&list);
    assert_eq!((clean.poses.len(), finding), (world.rows.len(), Vec::new()));
    for pose in [0, 17] {
        let (a, b) = (3 * pose, 3 * pose + 2);
        (list[a].target, list[b].target) = (list[b].target.clone(), list[a].target.clone());
    }
    let (kept, finding) = said(&list);
    let names = [0, 17].map(|pose: usize| list[3 * pose].at.pose.clone());
    assert_eq!(finding[0].rows, names);
    assert_eq!(kept.skipped.iter().map(|s| &s.pose).collect::<Vec<_>>(), names.iter().collect::<Vec<_>>());
    // The first pose is its group's centre; the others' centres are where they were.
    assert_eq!(kept.groups[0].center, None);
    for group in &kept.groups[1..] {
        assert_eq!(kept.poses[group.center.unwrap()].role, Role::Center);
    }
}

#[test]
fn of_two_targets_that_stand_at_another_distance_both_are_named() {
    for by_mm in [0.3, 3.0] {
        let (_, targets) = one(&rows_with_moved(2, 6, 25, by_mm));
        let mut list = rows_with_moved(3, 6, 25, by_mm);
        list.retain(|row| row.target != "a");
        let (_, of_others) = one(&list);
        // The second target of two is not the one that moves; of the others it is the second.
        assert!(targets.findings.is_empty(), "{:?}", targets.findings);
        let sentence = of_others.findings[0].sentence();
        assert!(sentence.starts_with("target c or b was moved about pose"), "{by_mm}: {sentence}");
    }
}
