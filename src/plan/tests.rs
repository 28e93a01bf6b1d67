//! The planner on the paper's robot and rig.

use nalgebra::{DVector, Vector3};

use super::choose::{Information, choose};
use super::pool::{Candidate, Kind, Pool};
use super::predict::Problem;
use super::scene::{PoseNoise, Scene, flange_from_target, placements, safe};
use super::*;
use crate::measurements::{Measurement, RobotPose, Role};
use crate::robot::{Robot, catalogue};
use crate::simulate::rig::{RigDrawing, true_rig};

const NOISE_MM: f64 = 0.02;

fn robot() -> Robot {
    let mut robot = catalogue::robot("paper").unwrap();
    robot.tool_mm = Vector3::new(12.0, -8.0, 25.0);
    robot
}

fn scene() -> Scene {
    let board = crate::config::Config::default().target_board.board(None, None, None).unwrap();
    Scene::new(true_rig(5120), board, 0.03, 35f64.to_radians(), 120.0, 8.0).unwrap()
}

fn settings() -> Settings {
    Settings {
        samples: 24,
        verify: 8,
        paper: false,
        first: None,
        pool: 800,
        seed: 1,
        centers_mm: Vec::new(),
        radius_mm: 100.0,
        noise_mm: Some(NOISE_MM),
        repeatability_mm: 0.02,
    }
}

/// A problem with its centres' information and candidates.
fn world() -> (Problem, Information, Vec<Candidate>, Vec<Candidate>) {
    let (robot, scene, settings) = (robot(), scene(), settings());
    let placements = placements(&robot, &scene, &settings).unwrap();
    let noise = PoseNoise { given_mm: settings.noise_mm, repeatability_mm: 0.0 };
    let pool = Pool { robot: &robot, scene: &scene, settings: &settings, placements: &placements, noise };
    let problem = Problem::new(&robot, &placements, pool.candidates(Kind::Fresh).unwrap());
    let centers = pool.candidates(Kind::Center).unwrap();
    let mut information = Information::new(&problem);
    centers.iter().for_each(|c| information.add(&problem.rows(c)));
    (problem, information, pool.candidates(Kind::Pool(800)).unwrap(), centers)
}

#[test]
fn the_field_of_a_rig_is_where_its_axes_meet() {
    let drawing = RigDrawing::paper(5120);
    let off = scene().left_from_field.inverse() * drawing.left_from_field();
    // The rig is mounted a mm and a few mrad off its drawing.
    assert!(off.translation.vector.norm() < 8.0 && off.rotation.angle() < 0.02, "{off}");
    let parallel = RigDrawing { convergence_rad: 0.0, ..drawing };
    let mut rig = parallel.rig();
    rig.right_from_left.translation.vector.x = -60.0;
    let board = scene().board;
    assert!(Scene::new(rig.clone(), board, 0.03, 0.6, 120.0, 8.0).is_ok());
    // Cameras that look away from each other never see one target.
    rig.right_from_left = crate::geometry::transform(Vector3::new(0.0, 1.5, 0.0), Vector3::new(-200.0, 0.0, 0.0));
    let said = Scene::new(rig, board, 0.03, 0.6, 120.0, 8.0).unwrap_err().to_string();
    assert!(said.contains("never sees a target of 82 x 72 mm"), "{said}");
}

#[test]
fn every_planned_pose_is_seen_reached_and_safe() {
    let (robot, scene) = (robot(), scene());
    let plan = plan(&robot, &scene, &settings(), None).unwrap();
    let count = |role| plan.poses.iter().filter(|p| p.at.role == role).count();
    assert_eq!([Role::Center, Role::Sample, Role::Verify].map(count), [4, 24, 8]);
    for pose in &plan.poses {
        let q = pose.at.joints_rad();
        assert!(safe(&robot, &q), "{}", pose.at.pose);
        let placement = &plan.placements[pose.group];
        let there = placement.left_from_base * robot.base_from_flange(&q) * flange_from_target(&robot);
        // Readings are rounded to 1e-4 deg.
        let off = there.inverse() * pose.left_from_target;
        assert!(off.translation.vector.norm() < 0.01 && off.rotation.angle() < 1e-4, "{}", pose.at.pose);
        assert!(scene.sees(&there, scene.margin_mm - 0.1), "{}", pose.at.pose);
    }
    assert!(plan.warnings[0].contains("not checked"));
}

/// The gain of a candidate is what the mean square really falls by, and the choice beats one without choosing.
#[test]
fn the_choice_is_better_than_taking_what_comes() {
    let (problem, start, pool, _) = world();
    let (chosen, expected) = choose(&problem, &start, &pool, 24);
    assert_eq!(chosen.len(), 24);
    let mut sorted = chosen.clone();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), 24, "no pose twice");
    let rms = |which: &mut dyn Iterator<Item = usize>| {
        let mut information = start.clone();
        which.for_each(|k| information.add(&problem.rows(&pool[k])));
        information.rms_mm(&problem)
    };
    let best = rms(&mut chosen.iter().copied());
    assert!((best - expected.iter().find(|e| e.0 == 24).unwrap().1).abs() < 1e-9);
    for shift in 0..5 {
        let any = rms(&mut (0..24).map(|k| (k * 33 + shift) % pool.len()));
        assert!(best < 0.8 * any, "{best} {any}");
    }
    // More poses never hurt.
    assert!(expected.windows(2).all(|w| w[1].1 < w[0].1 * 1.02), "{expected:?}");
}

/// What is promised is what comes out: parameters fitted linearly to noisy points, many times.
#[test]
fn the_promise_is_the_spread_of_fits() {
    let (problem, start, pool, centers) = world();
    let (chosen, expected) = choose(&problem, &start, &pool, 24);
    let poses: Vec<&Candidate> = centers.iter().chain(chosen.iter().map(|&k| &pool[k])).collect();
    let mut information = Information::new(&problem);
    poses.iter().for_each(|c| information.add(&problem.rows(c)));
    let mut draws = crate::simulate::draws::Draws::new(1, crate::simulate::draws::Purpose::Points, 0);
    let (runs, mut sum) = (200, 0.0);
    for _ in 0..runs {
        // The prior is a measurement too: its noise is the parameters' own.
        let prior = problem.prior();
        let n = prior.len();
        let mut pull = DVector::from_fn(n, |i, _| draws.normal() / prior[i].sqrt());
        for pose in &poses {
            let rows = problem.rows(pose);
            let width = rows.values.len() / 3;
            for row in rows.values.chunks_exact(width) {
                let noise = draws.normal();
                for (k, v) in row.iter().enumerate() {
                    let at = if k < problem.count() { k } else { k + predict::FRAME * rows.group };
                    pull[at] += v * noise;
                }
            }
        }
        let offsets = information.covariance() * &pull;
        let offsets = offsets.rows(0, problem.count());
        sum += (&problem.weight * offsets).dot(&offsets);
    }
    let realised = (sum / f64::from(runs)).sqrt();
    let promised = expected.iter().find(|e| e.0 == 24).unwrap().1;
    assert!((0.9..1.1).contains(&(realised / promised)), "{realised} {promised}");
}

#[test]
fn the_papers_orientation_leaves_the_wrist_unknown() {
    let (robot, scene) = (robot(), scene());
    let found = plan(&robot, &scene, &settings(), None).unwrap();
    let (paper, curve) = found.paper.unwrap();
    assert!(found.accuracy.rank > paper.rank + 4, "{} {}", found.accuracy.rank, paper.rank);
    assert_eq!(found.accuracy.zero, ["alpha_0", "a_0", "theta_1", "d_1"]);
    let ours = found.expected.iter().find(|e| e.0 == 24).unwrap().1;
    assert!(curve.last().unwrap().1 > 20.0 * ours, "{curve:?} {ours}");
}

#[test]
fn first_poses_find_cameras_that_stand_elsewhere() {
    let (robot, scene) = (robot(), scene());
    let first = plan(&robot, &scene, &Settings { first: Some(4), ..settings() }, None).unwrap();
    assert_eq!(first.poses.len(), 4 * 5);
    // Really 100 mm and 10 degrees off.
    let off = crate::geometry::transform(Vector3::new(0.1, -0.1, 0.1), Vector3::new(60.0, -50.0, 60.0));
    let truly = |group: usize| off * first.placements[group].left_from_base;
    let row = |p: &Planned| {
        let there = truly(p.group) * robot.base_from_flange(&p.at.joints_rad()) * flange_from_target(&robot);
        let observed = crate::measurements::Observed::Position {
            point_mm: there.translation.vector.into(),
            covariance_mm2: None,
            rotation_rad: Some(there.rotation.scaled_axis()),
        };
        Measurement { at: p.at.clone(), target: String::new(), observed }
    };
    let rows: Vec<Measurement> = first.poses.iter().map(row).collect();
    let rest = plan(&robot, &scene, &settings(), Some((&rows, "m.csv"))).unwrap();
    assert_eq!(rest.poses.iter().filter(|p| p.at.role == Role::Center).count(), 0, "a group has one centre");
    for pose in &rest.poses {
        assert!(rows.iter().all(|r| r.at.pose != pose.at.pose), "names are used once");
        let there = truly(pose.group) * robot.base_from_flange(&pose.at.joints_rad()) * flange_from_target(&robot);
        assert!(scene.sees(&there, scene.margin_mm - 0.1), "{}", pose.at.pose);
    }
    let other = vec![Measurement { at: RobotPose { group: "x".to_owned(), ..rows[0].at.clone() }, ..rows[0].clone() }];
    let said = plan(&robot, &scene, &settings(), Some((&other, "m.csv"))).unwrap_err();
    assert!(said.to_string().contains("no group 1, 2, 3, 4 with three measured points"), "{said}");
}

#[test]
fn places_out_of_reach_name_one_that_is_not() {
    let far = Settings { centers_mm: vec![Vector3::new(1500.0, 0.0, 300.0)], ..settings() };
    let said = plan(&robot(), &scene(), &far, None).unwrap_err();
    let message = crate::diagnostic::report(&said);
    assert!(message.contains("does not reach (1500, 0, 300) mm") && message.contains("--center "), "{message}");
    let mut narrow = robot();
    narrow.joints.iter_mut().for_each(|j| j.limits_rad = Some((-0.01, 0.01)));
    assert!(plan(&narrow, &scene(), &settings(), None).is_err());
}

#[test]
fn every_common_arm_has_a_plan() {
    for arm in catalogue::ARMS {
        let quick = Settings { pool: 150, samples: 20, verify: 4, ..settings() };
        let found = plan(&arm.robot(), &scene(), &quick, None);
        assert!(found.is_ok(), "{}: {}", arm.name, found.err().map(|e| e.to_string()).unwrap_or_default());
    }
}
