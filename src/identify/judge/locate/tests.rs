use nalgebra::Matrix3;

use super::*;
use crate::identify::sensor::REPEATABILITY_MM;
use crate::identify::synthetic;
use crate::measurements::{Measurement, Observed};

/// Poses of one group with noise of a coordinate that is stated, and turns where asked.
fn rows(count: usize, noise_mm: f64, oriented: bool, seed: u64) -> (Robot, Vec<Measurement>) {
    let mut world = synthetic::planned(4 * count, 0, 25.0, noise_mm, seed, &|_| {});
    world.rows.retain(|row| row.at.group == "g1");
    world.rows.truncate(count);
    if oriented {
        let mut random = rand_pcg::Pcg64Mcg::new(u128::from(seed) + 77);
        synthetic::orient(&mut world.rows, &world.truth, NOISE_RAD, &mut random);
    }
    synthetic::state(&mut world.rows, |_| Some(Matrix3::identity() * noise_mm * noise_mm));
    (world.truth, world.rows)
}

const NOISE_RAD: f64 = 3e-4;

/// A robot that is known to scatter by no more than a micrometre.
const EXACT: Trust = Trust { point_mm: 1e-3, rotation_rad: None };

#[test]
fn intervals_of_few_poses_hold() {
    for count in [3, 5, 10] {
        let (mut within, mut all, mut alarms) = (0, 0, 0);
        for seed in 0..60 {
            let (truth, rows) = rows(count, 0.05, true, seed);
            // The target is looked for from where another robot's file has it.
            let robot = Robot { tool_mm: truth.tool_mm + Vector3::new(30.0, -20.0, 40.0), ..truth.clone() };
            let located = locate(&Dataset::new(&rows).unwrap(), &robot, EXACT, None, &Settings::default()).unwrap();
            alarms += usize::from(located.fit.contradicted);
            let fresh = synthetic::planned(24, 0, 25.0, 0.0, 900 + seed, &|_| {});
            let joints: Vec<Vec<f64>> =
                fresh.rows.iter().filter(|r| r.at.group == "g1").map(|r| r.at.joints_rad()).collect();
            let joints: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
            for (q, (point, covariance)) in joints.iter().zip(located.placed.points(0, &joints)) {
                let off = point - (synthetic::sensor(1) * truth.target_mm(q)).coords;
                all += 3;
                within += (0..3).filter(|&k| off[k].abs() < 1.96 * covariance[(k, k)].sqrt()).count();
            }
        }
        let share = within as f64 / all as f64;
        assert!((0.90..=1.0).contains(&share), "{count} poses: {share}");
        assert!(alarms <= 3, "{count} poses: {alarms} of 60");
    }
}

#[test]
fn three_points_alone_place_the_cameras_with_the_target_of_the_file() {
    let (truth, rows) = rows(3, 0.01, false, 5);
    let located = locate(&Dataset::new(&rows).unwrap(), &truth, EXACT, None, &Settings::default()).unwrap();
    assert!(!located.placed.target_found && !located.placed.oriented && !located.fit.contradicted);
    let off = located.placed.groups[0].1.translation.vector - synthetic::sensor(1).translation.vector;
    assert!(off.norm() < 0.5, "{off}");
}

#[test]
fn a_robot_that_contradicts_the_points_is_said() {
    for oriented in [true, false] {
        let (truth, rows) = rows(10, 0.02, oriented, 6);
        let nominal = Robot { tool_mm: truth.tool_mm, ..Robot::paper() };
        let trust = Trust { point_mm: REPEATABILITY_MM, rotation_rad: None };
        let set = Dataset::new(&rows).unwrap();
        assert!(locate(&set, &nominal, trust, None, &Settings::default()).unwrap().fit.contradicted);
        assert!(!locate(&set, &truth, trust, None, &Settings::default()).unwrap().fit.contradicted);
    }
}

/// A point that was misread, and the joints of another pose.
#[test]
fn a_row_that_alone_contradicts_the_others_is_named_and_left_out() {
    let (mut told, mut wrong) = (0, Vec::new());
    for (count, is_stated) in [(6, true), (6, false), (12, true), (12, false)] {
        for seed in 0..4 {
            let (truth, mut all) = rows(count + 1, 0.02, false, 20 + seed);
            if !is_stated {
                synthetic::state(&mut all, |_| None);
            }
            let trust = if is_stated { EXACT } else { Trust { point_mm: 0.02, rotation_rad: None } };
            let at = seed as usize + 1;
            let placed = |rows: &[Measurement]| {
                locate(&Dataset::new(rows).unwrap(), &truth, trust, None, &Settings::default()).unwrap()
            };
            let (clean, other) = (all[..count].to_vec(), all[count].at.joints_deg.clone());
            let [mut misread, mut exchanged, mut rest] = [(); 3].map(|()| clean.clone());
            synthetic::point(&mut misread[at]).x += 4.0;
            exchanged[at].at.joints_deg = other;
            rest.remove(at);
            let (of_clean, of_rest) = (placed(&clean).fit, placed(&rest));
            let shift = |located: &Located| located.placed.groups[0].1.translation.vector;
            let is_clean = of_clean.stray.is_none() && of_clean.objection().is_none();
            for (what, rows) in [("misread", misread), ("exchanged", exchanged)] {
                let found = placed(&rows);
                let name = found.fit.stray.as_ref().map(|stray| stray.pose.clone());
                let is_named = name.as_ref() == Some(&clean[at].at.pose);
                let said = found.fit.objection().unwrap_or_default();
                told += usize::from(is_named && is_clean && said.contains("is left out, without it they agree"));
                if !is_named {
                    wrong.push(format!("{count} {is_stated} {seed} {what}: {name:?} {said}"));
                    continue;
                }
                assert_eq!(found.fit.poses, count - 1);
                assert!((shift(&found) - shift(&of_rest)).norm() < 1e-3, "{} {}", shift(&found), shift(&of_rest));
                let off_mm = found.fit.stray.unwrap().off_mm;
                assert!(what == "exchanged" || (off_mm - 4.0).abs() < 2.0, "{off_mm}");
            }
        }
    }
    assert!(told >= 28, "{told} of 32: {wrong:?}");
    // Of four rows any three agree.
    let (truth, mut four) = rows(4, 0.02, false, 20);
    synthetic::point(&mut four[1]).x += 4.0;
    let fit = locate(&Dataset::new(&four).unwrap(), &truth, EXACT, None, &Settings::default()).unwrap().fit;
    assert!(
        fit.stray.is_none() && (fit.misfit.freedom > 3 || fit.objection().unwrap().contains("are too few")),
        "{fit:?}"
    );
}

/// An instrument about which nothing is stated may be as coarse as it is: only what a robot's geometry explains beyond
/// that speaks against the robot.
#[test]
fn noise_that_nobody_stated_is_no_fault_of_the_robot() {
    let trust = Trust { point_mm: REPEATABILITY_MM, rotation_rad: None };
    let (mut doubts, mut doubts_of_right) = (Vec::new(), 0);
    for (count, noise_mm) in [(6, 0.02), (6, 0.1), (12, 0.02), (12, 0.1), (30, 0.02), (30, 0.1)] {
        let mut of_nominal = [0; 2];
        for seed in 0..10 {
            let (truth, mut rows) = rows(count, noise_mm, false, seed);
            synthetic::state(&mut rows, |_| None);
            let set = Dataset::new(&rows).unwrap();
            let fit = |robot: &Robot| locate(&set, robot, trust, None, &Settings::default()).unwrap().fit;
            let right = fit(&truth);
            assert!(!right.contradicted, "{count} poses, {noise_mm} mm, seed {seed}");
            doubts_of_right += usize::from(count == 30 && right.doubted);
            let nominal = fit(&Robot { tool_mm: truth.tool_mm, ..Robot::paper() });
            assert!(!(nominal.contradicted && nominal.doubted));
            of_nominal[0] += usize::from(nominal.doubted);
            of_nominal[1] += usize::from(nominal.contradicted);
        }
        // Six poses are as many as the geometry takes: nothing tells the two apart. None passes.
        let expected = if count == 6 { [10, 0] } else { [0, 10] };
        doubts.push((of_nominal, expected));
    }
    assert!(doubts.iter().all(|(found, expected)| found == expected), "{doubts:?}");
    assert!(doubts_of_right <= 4, "{doubts_of_right} of 20 right robots");
}

#[test]
fn poses_that_tell_too_little_are_refused_with_what_is_open() {
    let (truth, all) = rows(6, 0.01, true, 7);
    let refused = |rows: &[Measurement]| {
        let set = Dataset::new(rows).unwrap();
        locate(&set, &truth, EXACT, None, &Settings::default()).unwrap_err().to_string()
    };
    assert!(refused(&all[..2]).contains("has 2 poses with a point; a placement takes 3"));
    // One axis turns: the cameras and the target may move along it together, or turn about it together. Either is
    // named.
    let mut one_axis = all[..4].to_vec();
    for (k, row) in one_axis.iter_mut().enumerate() {
        row.at.joints_deg = all[0].at.joints_deg.clone();
        row.at.joints_deg[5] += 20.0 * k as f64;
        let there = synthetic::sensor(1) * truth.base_from_flange(&row.at.joints_rad());
        if let Observed::Position { point_mm, rotation_rad, .. } = &mut row.observed {
            *point_mm = synthetic::sensor(1) * truth.target_mm(&row.at.joints_rad());
            *rotation_rad = Some(there.rotation.scaled_axis());
        }
    }
    let said = refused(&one_axis);
    let both =
        |way: &str| said.contains(&format!("the cameras' {way}")) && said.contains(&format!("the target's {way}"));
    assert!(both("shift along") || both("turn about"), "{said}");
}

#[test]
fn what_a_later_placement_leaves_open_is_named() {
    let (truth, mut all) = rows(8, 0.01, false, 7);
    // Three readings at one pose: about that point the cameras may be turned at will.
    for k in 0..3 {
        let mut row = all[0].clone();
        row.at.group = "g2".to_owned();
        row.at.joints_deg[5] += 1e-6 * f64::from(k);
        all.push(row);
    }
    let refused = locate(&Dataset::new(&all).unwrap(), &truth, EXACT, None, &Settings::default()).unwrap_err();
    assert!(refused.to_string().contains("the cameras' turn about"), "{refused}");
}

/// A scatter that three points alone had to tell is known by three numbers, and intervals of 95 % are Student's.
#[test]
fn covariances_grow_by_what_the_scatter_of_few_poses_leaves_open() {
    let (truth, mut rows) = rows(3, 0.05, false, 8);
    synthetic::state(&mut rows, |_| None);
    let set = Dataset::new(&rows).unwrap();
    let placed = |point_mm: f64| {
        let trust = Trust { point_mm, rotation_rad: None };
        locate(&set, &truth, trust, None, &Settings::default()).unwrap().placed
    };
    let told = placed(1e-6);
    // The same scatter, but as one that is known.
    let known = placed((told.fresh_mm2 / 3.0).sqrt() * (1.0 + 1e-9));
    let grown = told.sensor_from_base(0).covariance.trace() / known.sensor_from_base(0).covariance.trace();
    assert!((grown - (3.182f64 / 1.960).powi(2)).abs() < 0.01, "{grown}");
}

/// Of a robot that was identified, what that left open moves placements and fresh points by more than the noise of the
/// rows does.
#[test]
fn what_an_identification_left_open_is_in_the_intervals() {
    let mut shares = Vec::new();
    for known in [true, false] {
        let (mut within, mut all) = ([0; 2], [0; 2]);
        for seed in 0..60 {
            let (truth, rows) = rows([4, 8, 12][seed as usize % 3], 0.01, true, seed);
            let mut random = rand_pcg::Pcg64Mcg::new(u128::from(seed) + 5);
            let parameters = truth.mdh_parameters();
            // Twists and joints known to 0.3 mrad, lengths to 0.1 mm.
            let sigma = |p: &Parameter| if p.unit() == crate::robot::Unit::Mm { 0.1 } else { 0.3 };
            let sigmas: Vec<f64> = parameters.iter().map(sigma).collect();
            let of_base = |p: &Parameter| is_held(*p, usize::MAX);
            let drawn = parameters.iter().zip(&sigmas);
            let off: Vec<f64> = drawn
                .map(|(p, sigma)| if of_base(p) { 0.0 } else { sigma * synthetic::normal(&mut random).x })
                .collect();
            let robot = truth.shifted(&parameters, &off);
            let covariance = DMatrix::from_diagonal(&DVector::from_vec(sigmas).map(|s| s * s));
            let open = LeftOpen { parameters, covariance, freedom: 1e6, point_mm: 1e-3 };
            let open = known.then_some(&open);
            let trust = Trust { point_mm: 1.0, rotation_rad: Some(NOISE_RAD) };
            let set = Dataset::new(&rows).unwrap();
            let trust = if known { trust } else { EXACT };
            let located = locate(&set, &robot, trust, open, &Settings::default()).unwrap();
            assert_eq!(located.fit.robot_uncertain, known);
            let placed = located.placed;
            let (found, there) = (placed.sensor_from_base(0), synthetic::sensor(1));
            let turn = (found.transform.rotation * there.rotation.inverse()).scaled_axis();
            let shift = found.transform.translation.vector - there.translation.vector;
            let numbers = turn.iter().chain(shift.iter()).enumerate();
            all[0] += 6;
            within[0] += numbers.filter(|(k, off)| off.abs() < 1.96 * found.covariance[(*k, *k)].sqrt()).count();
            for row in rows.iter().map(|row| row.at.joints_rad()) {
                let joints: Vec<f64> = row.iter().enumerate().map(|(j, q)| q + 0.2 * ((j + 1) as f64).sin()).collect();
                let (point, covariance) = placed.points(0, &[&joints])[0];
                let off = point - (there * truth.target_mm(&joints)).coords;
                all[1] += 3;
                within[1] += (0..3).filter(|&k| off[k].abs() < 1.96 * covariance[(k, k)].sqrt()).count();
            }
        }
        shares.push([0, 1].map(|k| within[k] as f64 / f64::from(all[k])));
    }
    let [with, without] = shares[..] else { panic!() };
    assert!(with.iter().all(|share| (0.91..0.99).contains(share)), "{with:?}");
    assert!(without.iter().all(|share| *share < 0.8), "{without:?}");
}
