//! What poses near to each other, or outside of what was identified, leave open.

use nalgebra::DMatrix;

use super::*;
use crate::robot::corrections::Wave;

/// Ten poses within so many degrees of the first, by the true robot as it has become.
fn near(cell: &Cell, within_deg: f64, fault: &dyn Fn(&mut Robot), seed: u64) -> Dataset {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut truth = cell.truth.clone();
    fault(&mut truth);
    let mut rows = cell.rows(&|_| {}, 10, seed);
    let first = rows[0].at.joints_deg.clone();
    for row in &mut rows {
        let by = [synthetic::normal(&mut random), synthetic::normal(&mut random)];
        let by = by.iter().flat_map(|by| by.iter().copied().collect::<Vec<_>>());
        row.at.joints_deg = first.iter().zip(by).map(|(q, by)| q + within_deg * by.clamp(-1.0, 1.0)).collect();
        let joints: Vec<f64> = row.at.joints_deg.iter().map(|q| q.to_radians()).collect();
        *synthetic::point(row) =
            synthetic::sensor(2) * truth.target_mm(&joints) + NOISE_MM * synthetic::normal(&mut random);
    }
    Dataset::new(&rows).unwrap()
}

#[test]
fn poses_near_to_each_other_call_no_robot_the_same() {
    let cell = cell(false, 4);
    let said = |set: &Dataset, shift_mm: f64| {
        recheck(set, &cell.found, &cell.before, &|_| Some(stood(&cell, shift_mm))).unwrap()
    };
    let mut seen = 0;
    for (k, within_deg) in [0.1, 1.0, 2.0].into_iter().enumerate() {
        for (joint, deg) in [(1, 0.05), (1, 0.2), (2, 0.2), (4, 0.4)] {
            let fault = |robot: &mut Robot| robot.add(Parameter::Theta(joint), f64::to_radians(deg) * 1e3);
            let found = said(&near(&cell, within_deg, &fault, 80 + k as u64), 0.0);
            let text = format!("joint {}, {deg} deg, within {within_deg}: {}", joint + 1, found.statement());
            assert!(!found.is_same() && !text.contains("robot is the same"), "{text}");
            let moved = found.cause().starts_with("camera-moved");
            assert!(!moved || found.cause().contains(&format!("joint-{}", joint + 1)), "{text}");
            seen += usize::from(moved);
        }
        // Nor does a sensor that was moved; poses within a tenth of a degree hardly place it.
        let moved = said(&near(&cell, within_deg, &|_| {}, 90 + k as u64), 5.0);
        assert!(!moved.is_same(), "{}", moved.statement());
        let is_said = moved.cause().starts_with("camera-moved") && moved.statement().contains("elsewhere");
        assert!(is_said || within_deg < 1.0, "{within_deg} deg: {}", moved.statement());
        let clean = said(&near(&cell, within_deg, &|_| {}, 95 + k as u64), 0.0);
        assert_eq!(clean.cause(), "");
        assert!(!clean.is_same() && clean.room_mm() > 3.0 * clean.at_most_mm, "{within_deg} deg: {clean:?}");
    }
    // Mostly too little is off for any of the two to be said.
    assert!(seen >= 1, "{seen} of 12");
}

/// A robot that was hardly known: what misses it by more than is promised is no change, and no proof that it is good.
#[test]
fn poses_that_miss_what_was_promised_call_no_robot_valid() {
    let cell = cell(false, 4);
    let set = Dataset::new(&cell.rows(&|_| {}, 20, 61)).unwrap();
    let is_unknown = |before: &Before, robot: &Robot| {
        let found = recheck(&set, robot, before, &|_| None).unwrap();
        assert_eq!(found.cause(), "", "{}", found.statement());
        found.is_unknown_here()
    };
    assert!(!is_unknown(&cell.before, &cell.found));
    let unsure = Before { covariance: 1e6 * &cell.before.covariance, ..cell.before.clone() };
    assert!(!is_unknown(&unsure, &cell.found));
    let mut robot = cell.found.clone();
    robot.add(Parameter::Theta(3), 20.0);
    assert!(is_unknown(&unsure, &robot));
}

#[test]
fn poses_that_see_every_joint_tell_a_moved_sensor_from_a_changed_robot() {
    for seed in [4, 5] {
        let cell = cell(false, seed);
        let set = Dataset::new(&cell.rows(&|_| {}, 10, 61)).unwrap();
        for shift_mm in [2.0, 7.0] {
            let found = recheck(&set, &cell.found, &cell.before, &|_| Some(stood(&cell, shift_mm))).unwrap();
            assert_eq!(found.cause(), "camera-moved|joint-1", "{}", found.statement());
            // By as much as they leave open.
            let room_mm = found.at_most_mm.max(found.elsewhere_mm);
            let of = |tolerance_mm: f64| Recheck { tolerance_mm, ..found.clone() };
            assert!(of(1.01 * room_mm).is_same() && !of(0.99 * room_mm).is_same());
            assert!(of(1.01 * room_mm).statement().starts_with("the robot is the same"));
        }
    }
}

/// A term that was found over a range of its joint, of which the robot has nothing beyond.
#[test]
fn terms_are_as_uncertain_as_they_are_large_where_their_joint_was_not_identified() {
    for (seed, mrad) in [(4, 3.0), (5, 10.0)] {
        let Cell { truth, mut found, mut before } = cell(false, seed);
        let term = Parameter::Harmonic(3, Wave::Cos);
        found.add(term, mrad);
        let count = before.parameters.len();
        before.correction = vec![0.0; count];
        before.parameters.push(term);
        before.correction.push(mrad);
        let mut covariance = DMatrix::zeros(count + 1, count + 1);
        covariance.view_mut((0, 0), (count, count)).copy_from(&before.covariance);
        covariance[(count, count)] = 1e-4;
        before.covariance = covariance;
        let cell = Cell { truth, found, before };
        let said = |outside: &[usize], fault: &dyn Fn(&mut Robot)| {
            let set = Dataset::new(&cell.rows(fault, 10, 33)).unwrap();
            recheck(&set, &cell.found, &cell.before.outside(outside), &|_| None).unwrap()
        };
        assert!(said(&[], &|_| {}).changed && said(&[0, 4], &|_| {}).changed);
        assert!(!said(&[3], &|_| {}).changed, "{}", said(&[3], &|_| {}).statement());
        let turned = said(&[3], &|robot| robot.add(Parameter::Theta(2), 10.0));
        assert!(turned.changed, "{}", turned.statement());
    }
}
