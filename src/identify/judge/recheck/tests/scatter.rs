//! Readings that scatter more than at the identification.

use super::*;

const TIMES: f64 = 10.0;

#[test]
fn readings_that_scatter_more_are_no_changed_robot_and_leave_more_open() {
    let (mut told, mut others) = (0, Vec::new());
    for seed in 0..3 {
        let cell = cell(false, seed);
        for k in 0..4 {
            let mut random = Pcg64Mcg::seed_from_u64(7000 + 10 * seed + k);
            let extra: Vec<Vector3<f64>> = (0..10).map(|_| TIMES * NOISE_MM * synthetic::normal(&mut random)).collect();
            let noisy = |rows: &mut [Measurement]| {
                rows.iter_mut().zip(&extra).for_each(|(row, by)| *synthetic::point(row) += by);
            };
            let [clean, found] = [&(|_: &mut [Measurement]| ()) as &dyn Fn(&mut [Measurement]), &noisy]
                .map(|spoil| cell.spoilt(&|_| {}, 10, 1200 + 10 * seed + k, spoil));
            assert!(!clean.scatters(), "{}", clean.statement());
            if !found.scatters() {
                others.push(found.statement());
                continue;
            }
            told += 1;
            assert!(found.cause() == "scatter" && found.is_open(), "{}", found.statement());
            let times = found.at_most_mm / clean.at_most_mm;
            assert!((0.3 * TIMES..4.0 * TIMES).contains(&times), "{times}: {}", found.statement());
        }
    }
    // One in twenty of all tests together and of each is taken for something of the robot.
    assert!(told >= 8, "{told} of 12, else {others:?}");
}

#[test]
fn joints_that_changed_are_no_scatter() {
    for seed in 0..3 {
        let cell = cell(false, seed);
        let both = |robot: &mut Robot| [1, 3].iter().for_each(|&joint| robot.add(Parameter::Theta(joint), 4.0));
        for fault in [&both as &dyn Fn(&mut Robot), &|robot: &mut Robot| robot.add(Parameter::Theta(2), 4.0)] {
            let found = cell.check(fault, 1.0, 1300 + seed);
            assert!(found.changed && !found.scatters(), "{}", found.statement());
        }
    }
}

/// Links that changed, seen from several placements: not all of them stand elsewhere, and no noise moves them.
#[test]
fn links_that_changed_are_no_noise_where_all_placements_seem_to_move() {
    for (seed, by_mm) in [(4, 0.5), (5, 1.0), (6, 2.0)] {
        let cell = cell(false, seed);
        let become_ = |robot: &mut Robot| {
            *robot = cell.truth.clone();
            robot.add(Parameter::A(3), by_mm);
        };
        let mut world = synthetic::planned(48, 0, 25.0, NOISE_MM, 70 + seed, &become_);
        world.rows.retain(|row| row.at.role != Role::Center);
        let placed = |group: &str| Some(stood_in(&cell, group[1..].parse().ok()?, 0.0));
        let found = recheck(&Dataset::new(&world.rows).unwrap(), &cell.found, &cell.before, &placed).unwrap();
        assert!(found.changed && !found.scatters(), "{by_mm} mm: {}", found.statement());
        let is_told = found.cause() != "unknown" || found.effect_mm > 0.5 * by_mm;
        assert!(is_told, "{by_mm} mm: {} mm, {}", found.effect_mm, found.statement());
    }
}
