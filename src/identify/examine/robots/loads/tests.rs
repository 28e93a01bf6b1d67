use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::identify::data::dataset::Pose;
use crate::identify::examine::robots::{self, tools};
use crate::identify::examine::sessions;
use crate::identify::settings::Settings;
use crate::identify::synthetic::{normal, planned, row, seen_at, sensor};
use crate::measurements::Role;
use crate::robot::corrections::GravityTerm;

const NOISE_MM: f64 = 0.03;

/// Points all round a robot whose links are off, as many as `loaded` has: under a load its joints turn by so much a
/// metre of the load's lever, the outer ones by more; `lacking` is an error of the gears that links do not describe,
/// deg.
fn table(loaded: &[bool], k_rad_per_m: f64, lacking_deg: f64, seed: u64) -> (Dataset, Robot) {
    let world = planned(0, 0, 25.0, NOISE_MM, seed, &|_| {});
    let mut random = Pcg64Mcg::seed_from_u64(100 + seed);
    let mut bent = world.truth.clone();
    let term =
        |joint: usize| GravityTerm { joint, point: LoadPoint::Tool, k_rad_per_m: k_rad_per_m * (1.0 + joint as f64) };
    bent.corrections.gravity = (0..bent.joints.len()).map(term).collect();
    let mut rows = Vec::new();
    for (i, is_loaded) in loaded.iter().enumerate() {
        let joints_rad: Vec<f64> = bent.joints.iter().map(|_| 2.4 * random.random::<f64>() - 1.2).collect();
        let mut really = joints_rad.clone();
        really[1] += (lacking_deg * (2.0 * really[1]).sin()).to_radians();
        let robot = if *is_loaded { &bent } else { &world.truth };
        let point = sensor(0) * robot.target_mm(&really) + NOISE_MM * normal(&mut random);
        let joints_deg = joints_rad.iter().map(|q| q.to_degrees()).collect();
        rows.push(row(format!("{i}"), "g", Role::Sample, joints_deg, seen_at(point)));
    }
    (Dataset::new(&rows).unwrap(), world.nominal)
}

fn which(loaded: &[bool], state: bool) -> Vec<String> {
    (0..loaded.len()).filter(|&i| loaded[i] == state).map(|i| i.to_string()).collect()
}

#[test]
fn loads_in_rows_in_any_order_are_told_with_the_rows() {
    for (seed, k_rad_per_m, every) in [(1, 1e-3, 2), (2, 3e-3, 2), (3, 3e-3, 3), (4, 2e-3, 3)] {
        let count = [60, 120][seed as usize % 2];
        let loaded: Vec<bool> = (0..count).map(|i| i % every == 0).collect();
        let (set, robot) = table(&loaded, k_rad_per_m, 0.0, seed);
        let found = find(&set, &robot).unwrap_or_else(|| panic!("{k_rad_per_m} every {every}, {count} rows"));
        // Which of the states has the load, the joints' zeros leave open; the smaller one is named.
        let apart = |a: &[String], b: &[String]| a.iter().filter(|name| !b.contains(name)).count();
        let wrong = |list: Vec<String>| apart(&list, &found.rows) + apart(&found.rows, &list);
        let least = wrong(which(&loaded, true)).min(wrong(which(&loaded, false)));
        assert!(least * 10 <= count, "{k_rad_per_m} every {every}, {count} rows: {found:?}");
    }
}

#[test]
fn one_state_makes_no_loads_whatever_bends_the_robot_or_its_model_lacks() {
    for seed in 0..5 {
        let count = [40, 60, 120][seed as usize % 3];
        for (is_loaded, k_rad_per_m, lacking_deg) in
            [(false, 0.0, 0.0), (true, 3e-3, 0.0), (false, 0.0, 0.1), (true, 3e-3, 0.1)]
        {
            let (set, robot) = table(&vec![is_loaded; count], k_rad_per_m, lacking_deg, seed);
            assert_eq!(find(&set, &robot), None, "seed {seed}, {k_rad_per_m}, {lacking_deg} deg");
        }
    }
}

/// A gear with play stands on one side or the other, as its joint came there; it is no load, and a load is no play.
#[test]
fn a_joint_that_stands_elsewhere_in_some_rows_is_named_and_no_load() {
    for (seed, joint, deg) in [(1, 1, 0.1), (2, 1, 0.3), (3, 2, 0.2), (4, 4, 0.5)] {
        let (mut set, robot) = table(&[false; 80], 0.0, 0.0, seed);
        let there: Vec<bool> = (0..80).map(|i| (i * i + i / 3) % 5 < 2).collect();
        let moved = set.poses.iter_mut().zip(&there).filter(|(_, there)| **there);
        moved.for_each(|(pose, _)| pose.joints_rad[joint] -= f64::to_radians(deg));
        let Table { rows, points } = Table::new(&set, &robot).unwrap();
        let (all, weights): (Vec<usize>, Vec<f64>) = rows.iter().enumerate().map(|(i, _)| (i, 1.0)).unzip();
        let never = points.together(&[all], &weights);
        let of_joints = (0..6).filter_map(|joint| Some((joint, elsewhere(&points, joint, &weights, &never)?)));
        let (named, cause) = of_joints.min_by(|a, b| a.1.left.squares.total_cmp(&b.1.left.squares)).unwrap();
        assert_eq!(named, joint, "{seed}: {}", cause.what);
        let by: f64 = cause.what.split(" by ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((by / deg - 1.0).abs() < 0.1, "{seed}: {}", cause.what);
        let of_rows: Vec<usize> = smaller(&cause.there).into_iter().map(|i| rows[i]).collect();
        let wrong = (0..80).filter(|row| of_rows.contains(row) != there[*row]).count();
        assert!(wrong < 8 && cause.left.scatter_mm() < 1.5 * NOISE_MM, "{seed}: {wrong}, {}", cause.what);
    }
    let loaded: Vec<bool> = (0..60).map(|i| i % 2 == 0).collect();
    let (set, robot) = table(&loaded, 3e-3, 0.0, 2);
    let said = find(&set, &robot).expect("a load").finding;
    assert!(said.contains("a load that moves") && !said.contains("stands elsewhere"), "{said}");
}

#[test]
fn a_load_from_some_row_on_is_named_where_it_makes_sessions() {
    let mut named = 0;
    for (seed, k_rad_per_m) in [(1, 1e-3), (2, 2e-3), (3, 2e-3), (4, 4e-3)] {
        let loaded: Vec<bool> = (0..100).map(|i| i >= 50).collect();
        let (set, robot) = table(&loaded, k_rad_per_m, 0.0, seed);
        let (cut, along) = sessions::find(&set, &robot, &Settings::default());
        if along.sessions.len() == 2 {
            let said = tools::of_sessions(&set, &cut, &robot).expect("no sensor").finding;
            assert!(said.contains("a load was put on or taken off"), "{k_rad_per_m}: {said}");
            named += 1;
        }
    }
    assert!(named >= 2, "{named} of 4");
}

/// Files of one robot under the loads that these turns a metre of lever are of.
fn files(loads: &[f64], seed: u64) -> (Dataset, Robot) {
    let tables: Vec<(Dataset, Robot)> =
        loads.iter().zip(0..).map(|(&k, i)| table(&[true; 50], k, 0.0, seed + 10 * i)).collect();
    let (mut set, robot) = tables[0].clone();
    set.poses.clear();
    set.groups.clear();
    for (k, (table, _)) in tables.into_iter().enumerate() {
        set.groups.extend(table.groups);
        set.poses.extend(table.poses.into_iter().map(|pose| {
            let name = format!("{}:{}", k + 1, pose.name);
            Pose { group: k, name, ..pose }
        }));
        set.files.push(format!("load_{}.csv", k + 1));
    }
    (set, robot)
}

#[test]
fn files_under_other_loads_are_told_and_those_under_one_are_not() {
    for (seed, k_rad_per_m) in [(1, 2e-3), (3, 1e-2)] {
        let (set, robot) = files(&[0.0, k_rad_per_m, 2.0 * k_rad_per_m], seed);
        let (whole, tool) = (robots::find(&set, &robot, &Settings::default()), tools::find(&set, &robot));
        let said = robots::of_files(&set, &robot).map(|finding| finding.finding);
        assert!(whole.is_some() || tool.is_some() || said.is_some(), "{k_rad_per_m}");
        if let Some(said) = said {
            assert!(said.contains("load_1.csv") && said.contains("load_3.csv"), "{said}");
        }
        for same in [0.0, k_rad_per_m] {
            let (set, robot) = files(&[same, same, same], seed);
            assert_eq!(robots::of_files(&set, &robot), None, "{same}");
        }
    }
}
