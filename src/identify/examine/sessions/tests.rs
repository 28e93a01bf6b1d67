use nalgebra::{Point3, Vector3};

use super::*;
use crate::identify::synthetic;
use crate::measurements::{Measurement, Observed, Role};

/// Wire lengths to an anchor that moves by 5 mm after `moved` rows.
fn wire(moved: usize) -> (synthetic::World, Vec<Measurement>) {
    let world = synthetic::planned(120, 20, 25.0, 0.0, 5, &|_| {});
    let mut rows = world.rows.clone();
    rows.retain(|row| row.at.role != Role::Center);
    for (i, row) in rows.iter_mut().enumerate() {
        let anchor = Point3::new(600.0, if i < moved { 300.0 } else { 305.0 }, 0.0);
        // A ripple of 0.05 mm stands for noise.
        let ripple_mm = 0.05 * (1.7 * i as f64).sin();
        let distance_mm = (world.truth.target_mm(&row.at.joints_rad()) - anchor).norm() + ripple_mm;
        row.at.group = "wire".into();
        row.observed = Observed::Distance { distance_mm, sigma_mm: None };
    }
    (world, rows)
}

#[test]
fn an_anchor_that_moved_is_found_where_it_moved_and_gross_errors_hide_no_session_and_make_none() {
    for off_mm in [0.0, 10.0, 100.0, 2000.0] {
        for (moved, sessions) in [(70, 2), (1000, 0)] {
            let (world, mut rows) = wire(moved);
            for i in [7, 31, 32, 55, 76, 90, 108] {
                if let Observed::Distance { distance_mm, .. } = &mut rows[i].observed {
                    *distance_mm += off_mm;
                }
            }
            let set = Dataset::new(&rows).unwrap();
            let (cut, along) = find(&set, &world.nominal, &Settings::default());
            assert_eq!(along.sessions.len(), sessions, "{off_mm} mm, {moved}: {:?}", along.sessions);
            assert!(off_mm > 0.0 || cut.groups.len() == sessions.max(1));
            let first = along.sessions.first().map_or(70, |session| session.count);
            assert!(first.abs_diff(70) <= if off_mm > 0.0 { 2 } else { 1 }, "{off_mm} mm: {:?}", along.sessions);
        }
    }
}

/// Distances to the first pose, and everything but it moved by so much: evenly along the rows, or at once after 40 of
/// them.
fn to_center(moved_mm: f64, evenly: bool) -> (synthetic::World, Dataset) {
    let world = synthetic::planned(120, 20, 25.0, 0.0, 5, &|_| {});
    // The first row and those that are no centres.
    let count = (world.rows.len() - 3) as f64;
    let set = synthetic::to_first(&world, |i, place, from| {
        let share = if evenly { i as f64 / count } else { f64::from(u8::from(i > 40)) };
        let place = place + moved_mm * share * Vector3::y();
        // A ripple of 0.02 mm stands for noise, 0.3 mm for a zero that is off.
        if i == 0 { 0.0 } else { (place - from).norm() + 0.02 * (1.7 * i as f64).sin() + 0.3 }
    });
    (world, set)
}

#[test]
fn a_base_that_moved_is_found_in_distances_to_a_centre() {
    for moved_mm in [0.2, 1.0, 5.0] {
        let (world, set) = to_center(moved_mm, false);
        let (_, along) = find(&set, &world.nominal, &Settings::default());
        assert!(along.sessions.len() == 2 && along.sessions[0].count.abs_diff(40) <= 2, "{moved_mm}: {along:?}");
        let (world, set) = to_center(moved_mm, true);
        let (_, along) = find(&set, &world.nominal, &Settings::default());
        assert!(!along.drifting.is_empty() || along.sessions.len() > 1, "{moved_mm}: {along:?}");
    }
    let (world, set) = to_center(0.0, false);
    assert_eq!(find(&set, &world.nominal, &Settings::default()).1, Along::default());
}

/// A drift of a joint is none of the sensor, and one of the sensor none of a joint; without either nothing is said.
#[test]
fn a_joint_that_creeps_is_told_from_a_sensor_that_drifts() {
    let creeping = |joint: Option<(usize, f64)>, sensor_mm: f64, seed: u64| {
        let mut world = synthetic::planned(240, 0, 25.0, 0.02, seed, &|_| {});
        world.rows.retain(|row| row.at.group == "g1" && row.at.role == Role::Sample);
        let count = world.rows.len() as f64;
        for (k, row) in world.rows.iter_mut().enumerate() {
            *synthetic::point(row) += Vector3::new(0.5, -0.6, 0.6) * sensor_mm * k as f64 / count;
            if let Some((joint, deg)) = joint {
                row.at.joints_deg[joint] -= deg * k as f64 / count;
            }
        }
        find(&Dataset::new(&world.rows).unwrap(), &world.nominal, &Settings::default()).1
    };
    for seed in [1, 2] {
        for (joint, deg) in [(1, 0.05), (1, 0.3), (2, 0.05), (4, 0.3), (0, 0.1)] {
            let said = creeping(Some((joint, deg)), 0.0, seed).instead.map(|finding| finding.finding);
            let said = said.unwrap_or_else(|| panic!("{seed}: joint {} by {deg} deg", joint + 1));
            assert!(said.contains(&format!("the zero of joint {} creeps", joint + 1)), "{seed} {deg}: {said}");
            assert!(joint > 0 || said.contains("or the sensor"), "{seed} {deg}: {said}");
        }
        for by_mm in [0.2, 1.0, 5.0] {
            let along = creeping(None, by_mm, seed);
            assert!(along.instead.is_none() && !along.drifting.is_empty(), "{seed} {by_mm}: {along:?}");
        }
        assert_eq!(creeping(None, 0.0, seed), Along::default());
    }
}

/// Steps that all go one way are none.
#[test]
fn a_sensor_that_moves_in_steps_is_no_drift() {
    for (by_mm, seed) in [(0.5, 1), (2.0, 2), (5.0, 3)] {
        let mut world = synthetic::planned(240, 0, 25.0, 0.02, seed, &|_| {});
        world.rows.retain(|row| row.at.group == "g1" && row.at.role == Role::Sample);
        for (k, row) in world.rows.iter_mut().enumerate() {
            *synthetic::point(row) += Vector3::new(0.5, -0.6, 0.6) * by_mm * (k / 15) as f64;
        }
        let (_, along) = find(&Dataset::new(&world.rows).unwrap(), &world.nominal, &Settings::default());
        assert!(along.drifting.is_empty() && along.instead.is_none(), "{by_mm} mm: {along:?}");
        let counts: Vec<usize> = along.sessions.iter().map(|session| session.count).collect();
        assert_eq!(counts, [15; 4], "{by_mm} mm");
    }
}

/// The same joint at once: the row and the size are said, and not that it creeps.
#[test]
fn a_joint_that_steps_is_told_from_one_that_creeps() {
    for (joint, deg) in [(4, 0.3), (4, 0.6), (5, 1.5)] {
        let mut world = synthetic::planned(240, 0, 25.0, 0.02, 2, &|_| {});
        world.rows.retain(|row| row.at.group == "g1" && row.at.role == Role::Sample);
        for row in world.rows.iter_mut().skip(30) {
            row.at.joints_deg[joint] -= deg;
        }
        let (_, along) = find(&Dataset::new(&world.rows).unwrap(), &world.nominal, &Settings::default());
        // A sensor that moves may explain a large step as well; its rows are cut.
        let Some(said) = along.instead.map(|finding| finding.finding) else {
            assert!(!along.sessions.is_empty(), "joint {} by {deg} deg", joint + 1);
            continue;
        };
        assert!(said.contains(&format!("the zero of joint {} steps by", joint + 1)), "{deg}: {said}");
        assert!(!said.contains("creeps"), "{deg}: {said}");
    }
}

#[test]
fn a_socket_that_moved_is_found_where_it_moved() {
    for moved_mm in [0.3, 1.0, 5.0] {
        let (world, _) = synthetic::touched(moved_mm, 2);
        let set = Dataset::new(&world.rows).unwrap();
        let (_, along) = find(&set, &world.nominal, &Settings::default());
        let parts: Vec<&str> = along.sessions.iter().map(|s| s.first.as_str()).collect();
        assert_eq!(parts, ["s2_0", "s2_6"], "{moved_mm}");
    }
    let (world, _) = synthetic::touched(0.0, 2);
    let set = Dataset::new(&world.rows).unwrap();
    assert_eq!(find(&set, &world.nominal, &Settings::default()).1, Along::default());
}
