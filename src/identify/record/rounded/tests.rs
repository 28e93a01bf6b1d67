use nalgebra::Point3;

use super::*;
use crate::identify::synthetic::{World, planned, point};

/// Rows of one group, as a display with these steps shows them.
fn shown(noise_mm: f64, seed: u64, [joints_deg, points_mm]: [f64; 2]) -> World {
    let mut world = planned(66, 0, 25.0, noise_mm, seed, &|_| {});
    let rounded = |value: f64, step: f64| (value / step).round() * step;
    for row in &mut world.rows {
        row.at.joints_deg.iter_mut().for_each(|q| *q = rounded(*q, joints_deg));
        let at = point(row);
        *at = Point3::from(at.coords.map(|x| rounded(x, points_mm)));
    }
    world
}

fn said(world: &World) -> Option<String> {
    let (set, found) = world.identified(&world.rows);
    as_closely_as_digits(&set, &found)
}

#[test]
fn points_computed_from_joints_are_known_by_their_digits() {
    for (seed, steps) in [(1, [0.01, 0.01]), (2, [1e-3, 1e-3]), (3, [0.01, 1e-3]), (4, [1e-3, 0.05]), (5, [1e-4, 0.01])]
    {
        let told = said(&shown(0.0, seed, steps)).unwrap_or_else(|| panic!("{steps:?}"));
        assert!(told.contains("were computed, by the robot's controller") && told.contains("not measured"), "{told}");
    }
    // Of so coarse points nobody knows whether more was measured than they show; of so coarse angles it is said of them
    // alone.
    let told = said(&shown(0.0, 6, [0.01, 0.5])).unwrap();
    assert!(told.contains("were computed, or have too few digits"), "{told}");
    assert_eq!(said(&shown(0.0, 6, [0.1, 0.1])), None);
}

#[test]
fn points_that_were_measured_leave_more_than_their_digits() {
    for (seed, noise_mm, steps) in
        [(1, 0.05, [1e-3, 1e-3]), (2, 0.1, [0.01, 0.01]), (3, 0.02, [1e-4, 1e-4]), (4, 0.3, [0.05, 0.1])]
    {
        assert_eq!(said(&shown(noise_mm, seed, steps)), None, "{noise_mm} mm, {steps:?}");
    }
    // Joints that were commanded to whole degrees stand there.
    let mut world = planned(66, 0, 25.0, 0.05, 7, &|_| {});
    for row in &mut world.rows {
        let before = world.truth.target_mm(&row.at.joints_rad());
        row.at.joints_deg.iter_mut().for_each(|q| *q = q.round());
        let group = row.at.group[1..].parse().unwrap();
        let moved = crate::identify::synthetic::sensor(group) * (world.truth.target_mm(&row.at.joints_rad()) - before);
        *point(row) += moved;
    }
    assert_eq!(said(&world), None);
}

#[test]
fn points_computed_and_written_with_six_digits_each_are_known_too() {
    // Joints in radians, as many a controller shows them, and points with as many digits before the point as they need.
    for (seed, joints_rad, noise_mm) in [(1, 1e-5, 0.0), (2, 1e-4, 0.0), (3, 1e-5, 0.05)] {
        let mut world = planned(66, 0, 25.0, noise_mm, seed, &|_| {});
        for row in &mut world.rows {
            for q in &mut row.at.joints_deg {
                *q = ((q.to_radians() / joints_rad).round() * joints_rad).to_degrees();
            }
            let at = point(row);
            *at = Point3::from(at.coords.map(|x| format!("{x:.5e}").parse().unwrap()));
        }
        let told = said(&world);
        assert_eq!(told.is_some_and(|told| told.contains("not measured")), noise_mm == 0.0, "{joints_rad} rad");
    }
}
