use nalgebra::{Matrix3, Point3, Vector3, Vector6};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;

use crate::geometry::{Transform, rotation_vector, transform};
use crate::identify::data::dataset::Dataset;
use crate::identify::data::shared::suppose_scale;
use crate::identify::judge::placement::{Placed, Uncertain, is_held};
use crate::identify::run::identify;
use crate::identify::settings::{Extensions, Model, Settings};
use crate::identify::synthetic::{self, World};
use crate::measurements::{Observed, Role};
use crate::robot::{Parameter, Robot};

/// Noise of a coordinate, mm, and of a turn, rad.
const NOISE_MM: f64 = 0.03;
const NOISE_RAD: f64 = 2e-4;

/// A robot off by normal errors of about a workshop's, in every parameter.
fn spoiled(seed: u64) -> impl Fn(&mut Robot) {
    move |robot| {
        let mut random = Pcg64Mcg::seed_from_u64(1000 + seed);
        for parameter in robot.mdh_parameters() {
            let off = synthetic::normal(&mut random).x;
            robot.add(parameter, if matches!(parameter, Parameter::V(_)) { off } else { 0.5 * off });
        }
    }
}

fn world(samples: usize, verify: usize, oriented: bool, seed: u64) -> World {
    let mut world = synthetic::planned(samples, verify, 25.0, NOISE_MM, seed, &spoiled(seed));
    if oriented {
        synthetic::orient(&mut world.rows, &world.truth, NOISE_RAD, &mut Pcg64Mcg::seed_from_u64(2000 + seed));
    }
    world
}

/// Where sensors and target are where what the placements stand for is as the found robot has it.
fn truth(world: &World, found: &Robot, group: usize) -> (Transform, Transform) {
    let first = |robot: &Robot| robot.joints[0].previous_from_this(0.0);
    let last = |robot: &Robot| {
        let joint = &robot.joints[robot.joints.len() - 1];
        transform(Vector3::z() * joint.theta_rad, Vector3::z() * joint.d_mm)
    };
    let sensor = synthetic::sensor(group) * first(&world.truth) * first(found).inverse();
    let target = Transform::from_parts(world.truth.tool_mm.into(), synthetic::turned());
    (sensor, last(found).inverse() * last(&world.truth) * target)
}

/// Error in the coordinates of the covariance: the truth is the estimate moved by it.
fn error(estimate: &Uncertain, truth: &Transform) -> Vector6<f64> {
    let turn = rotation_vector(&Transform::from_parts(
        Vector3::zeros().into(),
        truth.rotation * estimate.transform.rotation.inverse(),
    ));
    let shift = truth.translation.vector - estimate.transform.translation.vector;
    Vector6::from_iterator(turn.iter().chain(shift.iter()).copied())
}

/// What simulated robots say of the stated uncertainties.
#[derive(Debug, Default)]
struct Tally {
    /// Chi-squared of placements, over six.
    sensor: Vec<f64>,
    /// Of the target's place, over the numbers that it has.
    target: Vec<f64>,
    /// Fresh coordinates, and those within their 95 % interval.
    coordinates: (usize, usize),
    /// The scatter of a coordinate that was found, over the noise.
    scatter: Vec<f64>,
}

impl Tally {
    fn add(&mut self, world: &World, fresh: &World, placed: &Placed) {
        for index in 0..placed.groups.len() {
            let group = placed.groups[index].0;
            let (sensor, target) = truth(world, &placed.robot, group);
            let of_sensor = placed.sensor_from_base(index);
            for (uncertain, truth) in [(of_sensor.clone(), sensor), (of_sensor.inverse(), sensor.inverse())] {
                let off = error(&uncertain, &truth);
                self.sensor.push(off.dot(&uncertain.covariance.cholesky().unwrap().solve(&off)) / 6.0);
            }
            if index == 0 {
                let (uncertain, off) = (placed.target(), error(&placed.target(), &target));
                self.target.push(match placed.oriented {
                    true => off.dot(&uncertain.covariance.cholesky().unwrap().solve(&off)) / 6.0,
                    false => {
                        let shift = uncertain.covariance.fixed_view::<3, 3>(3, 3).into_owned();
                        let off = Vector3::new(off[3], off[4], off[5]);
                        off.dot(&shift.cholesky().unwrap().solve(&off)) / 3.0
                    }
                });
            }
            let of_group = fresh.rows.iter().filter(|row| row.at.group == format!("g{group}"));
            let joints: Vec<Vec<f64>> = of_group.map(|row| row.at.joints_rad()).collect();
            let joints: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
            for (q, (point, covariance)) in joints.iter().zip(placed.points(index, &joints)) {
                let true_point: Point3<f64> = synthetic::sensor(group) * world.truth.target_mm(q);
                for axis in 0..3 {
                    let within = (point[axis] - true_point[axis]).abs() < 1.96 * covariance[(axis, axis)].sqrt();
                    self.coordinates.0 += 1;
                    self.coordinates.1 += usize::from(within);
                }
            }
        }
    }
}

fn tally(robots: u64, samples: usize, oriented: bool, extensions: Extensions) -> Tally {
    let settings = Settings { extensions, ..synthetic::settings() };
    let mut tally = Tally::default();
    for seed in 0..robots {
        let (world, fresh) = (world(samples, 0, oriented, seed), world(24, 0, false, 500 + seed));
        let set = Dataset::new(&world.rows).unwrap();
        let found = identify(&set, &world.nominal, &settings, 1, &|_| {}).unwrap();
        let placed = found.placed(&set, &world.nominal, &settings).unwrap().unwrap();
        assert_eq!(placed.oriented, oriented);
        tally.scatter.push((placed.fresh_mm2 / 3.0).sqrt() / NOISE_MM);
        tally.add(&world, &fresh, &placed);
    }
    tally
}

#[test]
fn stated_uncertainties_are_those_of_simulated_robots() {
    for oriented in [false, true] {
        let Tally { sensor, target, coordinates, scatter } = tally(8, 60, oriented, Extensions::None);
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        // Four placements of eight robots, and what they have in common: three standard deviations of a chi-squared
        // over its degrees of freedom.
        assert!((0.7..1.4).contains(&mean(&sensor)), "{oriented}: placements {}", mean(&sensor));
        assert!((0.6..1.5).contains(&mean(&target)), "{oriented}: target {}", mean(&target));
        let share = coordinates.1 as f64 / coordinates.0 as f64;
        assert!((0.91..0.98).contains(&share), "{oriented}: {share} of {}", coordinates.0);
        // Orientations are worth little beside these points: what the fit took is the points' alone.
        assert!((0.96..1.04).contains(&mean(&scatter)), "{oriented}: scatter {}", mean(&scatter));
    }
}

#[test]
fn what_is_held_is_what_a_placement_stands_for() {
    let world = world(40, 0, true, 1);
    let set = Dataset::new(&world.rows).unwrap();
    let settings = Settings { extensions: Extensions::None, ..synthetic::settings() };
    let found = identify(&set, &world.nominal, &settings, 1, &|_| {}).unwrap();
    let placed = found.placed(&set, &world.nominal, &settings).unwrap().unwrap();
    for parameter in world.nominal.mdh_parameters() {
        // Of what moves the target on the flange the last joint takes the share that its tolerance has beside the
        // target's.
        let held = is_held(parameter, usize::MAX);
        let off = (placed.robot.value(parameter) - world.nominal.value(parameter)).abs();
        assert!(!held || off < 1e-9, "{} moved by {off}", parameter.name());
    }
}

#[test]
fn a_robot_found_by_distances_and_a_nominal_one_are_placed_too() {
    let world = world(40, 0, false, 2);
    let set = Dataset::new(&world.rows).unwrap();
    let plain = Settings { extensions: Extensions::None, ..synthetic::settings() };
    let by_distance = Settings { model: Some(Model::CenterDistance), ..plain.clone() };
    let mut nominal = identify(&set, &world.nominal, &plain, 1, &|_| {}).unwrap();
    nominal.keep_nominal(&world.nominal, Model::Position, None);
    for (found, settings) in
        [(identify(&set, &world.nominal, &by_distance, 1, &|_| {}).unwrap(), &by_distance), (nominal, &plain)]
    {
        let placed = found.placed(&set, &world.nominal, settings).unwrap().unwrap();
        assert_eq!(placed.groups.len(), 4);
        let is_nominal = found.formulation().is_none();
        let (sensor, _) = truth(&world, &placed.robot, placed.groups[0].0);
        let off = error(&placed.sensor_from_base(0), &sensor);
        let bound = if is_nominal { 5.0 } else { 1.0 };
        assert!(off.fixed_rows::<3>(3).norm() < bound, "{is_nominal} {off}");
        assert_eq!(placed.target_found, !is_nominal);
    }
}

/// Points whose noise is stated, with a rig that reads all lengths too long by this share.
fn stated(world: &mut World, scale: f64) {
    for row in &mut world.rows {
        if let Observed::Position { covariance_mm2, point_mm, .. } = &mut row.observed {
            *covariance_mm2 = Some(Matrix3::identity() * NOISE_MM * NOISE_MM);
            *point_mm *= 1.0 + scale;
        }
    }
}

/// Where noise is stated cameras have an unknown scale: what is uncertain of it is uncertain of the robot, and not of
/// what they read.
#[test]
fn a_rigs_own_scale_is_not_expected_in_what_it_reads() {
    let settings = Settings { extensions: Extensions::None, ..synthetic::settings() };
    for oriented in [false, true] {
        let mut ratios = Vec::new();
        for seed in 0..12 {
            let mut world = world(60, 60, oriented, seed);
            stated(&mut world, 0.0);
            let supposed = |world: &World| {
                let mut set = Dataset::new(&world.rows).unwrap();
                suppose_scale(&mut set);
                set
            };
            let sd = supposed(&world).supposed_scale;
            assert_eq!(sd.is_some(), oriented);
            let scale = sd.unwrap_or(0.0) * synthetic::normal(&mut Pcg64Mcg::seed_from_u64(4000 + seed)).x;
            stated(&mut world, scale);
            let set = supposed(&world);
            let found = identify(&set, &world.nominal, &settings, 1, &|_| {}).unwrap();
            let placed = found.placed(&set, &world.nominal, &settings).unwrap().unwrap();
            for index in 0..placed.groups.len() {
                let group = placed.groups[index].0;
                let fresh = set.poses.iter().filter(|pose| pose.group == group && pose.role == Role::Verify);
                let joints: Vec<&[f64]> = fresh.map(|pose| pose.joints_rad.as_slice()).collect();
                let off = |(q, (point, _)): (&&[f64], (Vector3<f64>, _))| {
                    let read = (synthetic::sensor(group) * world.truth.target_mm(q)) * (1.0 + scale);
                    (point - read.coords).norm()
                };
                let mean = joints.iter().zip(placed.points(index, &joints)).map(off).sum::<f64>() / joints.len() as f64;
                ratios.push(mean / placed.expected(&set, index).mean_mm);
            }
        }
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((0.8..1.25).contains(&mean), "oriented {oriented}: {mean}");
    }
}
