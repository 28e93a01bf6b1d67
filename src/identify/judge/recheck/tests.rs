use nalgebra::Vector3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use super::*;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::locate::Trust;
use crate::identify::judge::placement::Uncertain;
use crate::identify::run::identify;
use crate::identify::settings::{Extensions, Method, Settings};
use crate::identify::synthetic;
use crate::robot::{Parameter, Robot};

const NOISE_MM: f64 = 0.03;
const NOISE_RAD: f64 = 2e-4;

/// An identified robot, what is known of it, and how it really is.
struct Cell {
    truth: Robot,
    found: Robot,
    before: Before,
}

fn cell(oriented: bool, seed: u64) -> Cell {
    let spoil = |robot: &mut Robot| {
        let mut random = Pcg64Mcg::seed_from_u64(1000 + seed);
        for parameter in robot.mdh_parameters() {
            robot.add(parameter, 0.5 * synthetic::normal(&mut random).x);
        }
    };
    let mut world = synthetic::planned(60, 0, 25.0, NOISE_MM, seed, &spoil);
    if oriented {
        synthetic::orient(&mut world.rows, &world.truth, NOISE_RAD, &mut Pcg64Mcg::seed_from_u64(3000 + seed));
    }
    let set = Dataset::new(&world.rows).unwrap();
    let settings = Settings { method: Some(Method::TrustRegion), extensions: Extensions::None, ..Settings::default() };
    let identified = identify(&set, &world.nominal, &settings, 1, &|_| {}).unwrap();
    let candidate = &identified.candidates[identified.chosen];
    let (formulation, _) = candidate.found.as_ref().unwrap();
    let scatter = formulation.rows.scatter;
    let before = Before {
        parameters: formulation.parameters().to_vec(),
        covariance: formulation.whole_covariance(),
        trust: Trust { point_mm: scatter.point_mm, rotation_rad: oriented.then_some(scatter.rotation_rad) },
        poses: set.poses.len(),
        p95_mm: 0.1,
    };
    Cell { truth: world.truth, found: candidate.robot.clone(), before }
}

impl Cell {
    /// Ten poses of one group of the true robot as it has become.
    fn check(&self, fault: &dyn Fn(&mut Robot), scale: f64, seed: u64) -> Recheck {
        self.check_beside(fault, scale, seed, &|_| None)
    }

    fn check_beside(
        &self,
        fault: &dyn Fn(&mut Robot),
        scale: f64,
        seed: u64,
        stood: &dyn Fn(&str) -> Option<Uncertain>,
    ) -> Recheck {
        let become_ = |robot: &mut Robot| {
            *robot = self.truth.clone();
            fault(robot);
        };
        let mut world = synthetic::planned(40, 0, 25.0, NOISE_MM, seed, &become_);
        world.rows.retain(|row| row.at.group == "g2");
        world.rows.truncate(10);
        if self.before.trust.rotation_rad.is_some() {
            synthetic::orient(&mut world.rows, &world.truth, NOISE_RAD, &mut Pcg64Mcg::seed_from_u64(4000 + seed));
        }
        world.rows.iter_mut().for_each(|row| *synthetic::point(row) *= scale);
        recheck(&Dataset::new(&world.rows).unwrap(), &self.found, &self.before, stood).unwrap()
    }
}

#[test]
fn robots_that_did_not_change_raise_an_alarm_as_often_as_stated() {
    let mut alarms = 0;
    for seed in 0..20 {
        let cell = cell(seed % 2 == 0, seed);
        alarms += (0..10).filter(|k| cell.check(&|_| {}, 1.0, 100 + 10 * seed + k).changed).count();
    }
    // One in a hundred in each: nine or more in two hundred have a chance of one in four thousand.
    assert!(alarms < 9, "{alarms} of 200");
}

#[test]
fn a_planted_change_is_seen_from_the_stated_size_on_and_named() {
    let parameters = [Parameter::Theta(1), Parameter::Theta(2), Parameter::Theta(3), Parameter::Theta(4)];
    let (mut seen, mut named, mut wrong) = ([0usize; 3], [0usize; 3], 0);
    let mut all = 0;
    for seed in 0..10 {
        let cell = cell(seed % 2 == 0, seed);
        let clean = cell.check(&|_| {}, 1.0, 700 + seed);
        for (k, parameter) in parameters.into_iter().enumerate() {
            let word = format!("joint-{}", k + 2);
            let stated = clean.causes.iter().find(|c| c.cause == word).unwrap();
            all += 1;
            for (i, times) in [0.5, 1.0, 2.0].into_iter().enumerate() {
                let off = times * stated.seen.unwrap() / parameter.file_unit().1;
                let found = cell.check(&|robot| robot.add(parameter, off), 1.0, 700 + seed);
                seen[i] += usize::from(found.changed);
                named[i] += usize::from(found.cause().split('|').any(|cause| cause == word));
                wrong += usize::from(found.changed && !found.likeliest.is_empty() && !found.cause().contains(&word));
            }
        }
    }
    assert!(seen[0] < all / 2 && seen[1] * 100 >= 80 * all && seen[2] == all, "{seen:?} of {all}");
    assert!(named[2] * 10 >= 9 * all && wrong * 10 <= all, "{named:?}, {wrong} wrong, of {all}");
}

#[test]
fn another_tool_and_another_scale_are_named() {
    let cell = cell(true, 3);
    let tool = cell.check(&|robot| robot.tool_mm += Vector3::new(0.4, -0.3, 0.2), 1.0, 5);
    assert!(tool.cause().split('|').any(|cause| cause == "tool"), "{}", tool.statement());
    let scale = cell.check(&|_| {}, 1.003, 5);
    assert!(scale.cause().split('|').any(|cause| cause == "scale"), "{}", scale.statement());
}

#[test]
fn a_large_change_is_named_though_it_is_not_linear() {
    let cell = cell(false, 4);
    let turned = cell.check(&|robot| robot.add(Parameter::Theta(2), 20.0), 1.0, 6);
    assert_eq!(turned.cause(), "joint-3", "{}", turned.statement());
    let amount = turned.causes.iter().find(|c| c.cause == "joint-3").unwrap().amount.unwrap();
    assert!((amount - 20.0 * 1e-3f64.to_degrees()).abs() < 0.05, "{amount}");
}

#[test]
fn cameras_that_stand_elsewhere_are_said_while_the_robot_is_the_same() {
    let cell = cell(true, 4);
    let mut moved = 0;
    for (shift_mm, seed) in (0..12).map(|k| (if k < 10 { 0.0 } else { 1.0 }, 50 + k)) {
        // Where the sensor stood as the found robot has it: its first link is the file's.
        let first = |robot: &Robot| robot.joints[0].previous_from_this(0.0);
        let mut transform = synthetic::sensor(2) * first(&cell.truth) * first(&cell.found).inverse();
        transform.translation.vector.x += shift_mm;
        let stood = Uncertain { transform, covariance: nalgebra::Matrix6::identity() * 1e-9 };
        let found = cell.check_beside(&|_| {}, 1.0, seed, &|_| Some(stood.clone()));
        assert!(!found.changed, "{}", found.statement());
        match shift_mm > 0.0 {
            true => {
                assert!(found.cause().starts_with("camera-moved") && found.effect_mm > 0.8, "{}", found.statement())
            }
            false => moved += usize::from(!found.cause().is_empty()),
        }
    }
    assert!(moved <= 1, "{moved} of 10");
}
