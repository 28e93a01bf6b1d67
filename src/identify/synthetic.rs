//! A small world for tests: the paper's robot with Table 2's errors, measured on spheres round the paper's four start
//! points.

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::data::dataset::Dataset;
use super::run::{Identification, identify};
use super::settings::{Method, Settings};
use crate::geometry::Transform;
use crate::measurements::{Measurement, Observed, RobotPose, Role};
use crate::robot::{Robot, inverse};

/// A nominal robot, the true one, and what was measured.
pub struct World {
    /// As its maker delivers it.
    pub nominal: Robot,
    pub truth: Robot,
    pub rows: Vec<Measurement>,
}

impl World {
    /// What these rows tell of the nominal robot.
    pub fn identified(&self, rows: &[Measurement]) -> (Dataset, Identification) {
        let set = Dataset::new(rows).unwrap();
        let found = identified(&set, &self.nominal);
        (set, found)
    }
}

/// What a set tells by the trust region alone.
pub fn identified(set: &Dataset, nominal: &Robot) -> Identification {
    identify(set, nominal, &settings(), 1, &|_| {}).unwrap()
}

/// The trust region alone.
pub fn settings() -> Settings {
    Settings { method: Some(Method::TrustRegion), ..Settings::default() }
}

/// A row of a target without a name.
pub fn row(pose: String, group: &str, role: Role, joints_deg: Vec<f64>, observed: Observed) -> Measurement {
    let at = RobotPose { pose, group: group.to_owned(), role, joints_deg, slides: vec![] };
    Measurement { at, target: String::new(), observed }
}

/// A point about which nothing else is stated.
pub fn seen_at(point_mm: Point3<f64>) -> Observed {
    Observed::Position { point_mm, covariance_mm2: None, rotation_rad: None }
}

/// States the covariances of points.
pub fn state(rows: &mut [Measurement], covariance: impl Fn(&RobotPose) -> Option<Matrix3<f64>>) {
    for row in rows {
        if let Observed::Position { covariance_mm2, .. } = &mut row.observed {
            *covariance_mm2 = covariance(&row.at);
        }
    }
}

/// Start points of section 4.2, mm in the base frame.
const STARTS: [[f64; 3]; 4] = [[200.0, 0.0, 379.0], [-200.0, 0.0, 379.0], [0.0, 200.0, 379.0], [0.0, -230.0, 379.0]];

/// `samples` poses with orientations tilted up to 25 degrees, noise a coordinate in mm; an eighth as many again to
/// verify.
pub fn world(samples: usize, noise_mm: f64, seed: u64) -> World {
    planned(samples, samples / 8 + 4, 25.0, noise_mm, seed, &|_| {})
}

/// Poses on spheres of radius 100 mm; the flange keeps one orientation where `tilt_deg` is zero.
pub fn planned(
    samples: usize,
    verify: usize,
    tilt_deg: f64,
    noise_mm: f64,
    seed: u64,
    spoil: &dyn Fn(&mut Robot),
) -> World {
    let mut nominal = Robot::paper();
    nominal.tool_mm = Vector3::new(12.0, -8.0, 25.0);
    let mut truth = nominal.clone().with_table_2();
    spoil(&mut truth);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut rows = Vec::new();
    let roles = std::iter::repeat_n(Role::Sample, samples).chain(std::iter::repeat_n(Role::Verify, verify));
    let plan: Vec<(usize, Role)> =
        (0..4).map(|g| (g, Role::Center)).chain(roles.enumerate().map(|(i, r)| (i % 4, r))).collect();
    // The centre's angles start the search of its sphere's poses, so that the arm does not flip over within a sphere.
    let mut centers: Vec<Option<Vec<f64>>> = vec![None; STARTS.len()];
    for (group, role) in plan {
        for _ in 0..200 {
            let start = Vector3::from(STARTS[group]);
            let mut unit = || 2.0 * random.random::<f64>() - 1.0;
            let towards = Vector3::new(unit(), unit(), unit());
            let tilt = Vector3::new(unit(), unit(), unit()) * tilt_deg.to_radians();
            let radius = if role == Role::Center { 0.0 } else { 100.0 };
            if towards.norm() > 1.0 || towards.norm() < 0.1 {
                continue;
            }
            // The flange looks down and outwards, so that the robot reaches all four spheres with the same wrist.
            let flange = UnitQuaternion::from_scaled_axis(tilt)
                * UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.4);
            let origin = start + radius * towards.normalize();
            let target = Transform::from_parts(origin.into(), flange);
            let near = centers[group].clone().map_or_else(starts, |q| vec![q]);
            let Some(q) = near.iter().find_map(|start| inverse::from_start(&nominal, &target, start)) else { continue };
            centers[group].get_or_insert_with(|| q.clone());
            let q_deg: Vec<f64> = q.iter().map(|r| r.to_degrees()).collect();
            let q_rad: Vec<f64> = q_deg.iter().map(|d| d.to_radians()).collect();
            let point = sensor(group) * truth.target_mm(&q_rad) + noise_mm * normal(&mut random);
            rows.push(row(format!("p{}", rows.len()), &format!("g{group}"), role, q_deg, seen_at(point)));
            break;
        }
    }
    World { nominal, truth, rows }
}

/// Elbow up, all round the base.
fn starts() -> Vec<Vec<f64>> {
    (0..8).map(|k| vec![0.785 * k as f64 - 3.0, 0.6, -1.2, 0.5, 1.3, 0.2]).collect()
}

/// Distances of all spheres' poses to the first sphere's centre, as one group: by the index of the row, where the robot
/// is and where from.
pub fn to_first(world: &World, distance: impl Fn(usize, Point3<f64>, Point3<f64>) -> f64) -> Dataset {
    let place = |row: &Measurement| world.truth.target_mm(&row.at.joints_rad());
    let (mut rows, from) = (world.rows.clone(), place(&world.rows[0]));
    let mut index = 0..;
    rows.retain(|row| index.next() == Some(0) || row.at.role != Role::Center);
    for (i, row) in rows.iter_mut().enumerate() {
        row.at.group = "one".into();
        row.observed = Observed::Distance { distance_mm: distance(i, place(row), from), sigma_mm: None };
    }
    Dataset::new(&rows).unwrap()
}

/// What a tracker reads of several targets on the flange, by their places in the last joint's frame, mm, and the noise
/// of a coordinate.
pub fn of_targets(world: &World, targets: &[(&str, Vector3<f64>)], noise_mm: f64, seed: u64) -> Vec<Measurement> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut rows = Vec::new();
    for row in &world.rows {
        let group = row.at.group[1..].parse().unwrap_or(0);
        let sensor_from_flange = sensor(group) * world.truth.base_from_flange(&row.at.joints_rad());
        for (name, place) in targets {
            let point_mm = sensor_from_flange * Point3::from(*place) + noise_mm * normal(&mut random);
            let target = (*name).to_owned();
            rows.push(Measurement { at: row.at.clone(), target, observed: seen_at(point_mm) });
        }
    }
    rows
}

/// The point of a row.
pub fn point(row: &mut Measurement) -> &mut Point3<f64> {
    match &mut row.observed {
        Observed::Position { point_mm, .. } => point_mm,
        _ => panic!("a point"),
    }
}

/// How a target with an orientation sits on the flange.
pub fn turned() -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(&Rotation3::new(Vector3::new(0.2, -0.1, 2.9)))
}

/// Orientations of a robot's rows, with this noise.
pub fn orient(rows: &mut [Measurement], truth: &Robot, noise_rad: f64, random: &mut Pcg64Mcg) {
    for row in rows {
        let group = row.at.group[1..].parse().unwrap_or(0);
        let flange = sensor(group).rotation * truth.base_from_flange(&row.at.joints_rad()).rotation;
        let noise = UnitQuaternion::from_scaled_axis(noise_rad * normal(random));
        if let Observed::Position { rotation_rad, .. } = &mut row.observed {
            *rotation_rad = Some((noise * flange * turned()).scaled_axis());
        }
    }
}

/// Where the camera of a group is.
pub fn sensor(group: usize) -> Transform {
    let turn = Vector3::new(0.3 + group as f64, -0.7, 1.1);
    Transform::from_parts(Vector3::new(50.0, 80.0, 500.0).into(), UnitQuaternion::from_scaled_axis(turn))
}

/// Three normal numbers (Box and Muller).
pub fn normal(random: &mut Pcg64Mcg) -> Vector3<f64> {
    let mut one = || {
        let (u, v): (f64, f64) = (random.random(), random.random());
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    Vector3::new(one(), one(), one())
}

/// Eight sockets touched twelve times each with 0.03 mm of play a coordinate; the third moves by so much after half of
/// its touches. Where they are, mm, stands beside the world.
pub fn touched(moved_mm: f64, seed: u64) -> (World, Vec<Vector3<f64>>) {
    let mut world = planned(0, 0, 25.0, 0.0, seed, &|_| {});
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut sockets: Vec<Vector3<f64>> = Vec::new();
    world.rows.clear();
    while sockets.len() < 8 {
        let mut unit = || 2.0 * random.random::<f64>() - 1.0;
        let first: Vec<f64> = world.truth.joints.iter().map(|_| 1.2 * unit()).collect();
        let (socket, flange) = (world.truth.target_mm(&first).coords, world.truth.base_from_flange(&first).rotation);
        let mut postures = Vec::new();
        for _ in 0..200 {
            let turn = Vector3::from_fn(|_, _| 0.6 * (2.0 * random.random::<f64>() - 1.0));
            let moves = sockets.len() == 2 && postures.len() >= 6;
            let moved = Vector3::x() * if moves { moved_mm } else { 0.0 };
            let rotation = UnitQuaternion::from_scaled_axis(turn) * flange;
            let origin = socket + moved + 0.03 * normal(&mut random) - rotation * world.truth.tool_mm;
            let flange = Transform::from_parts(origin.into(), rotation);
            postures.extend(inverse::from_start(&world.truth, &flange, &first));
            if postures.len() == 12 {
                break;
            }
        }
        if postures.len() < 12 {
            continue;
        }
        for (i, joints) in postures.iter().enumerate() {
            let group = format!("s{}", sockets.len());
            let joints_deg = joints.iter().map(|q| q.to_degrees()).collect();
            let touch = Observed::Distance { distance_mm: 0.0, sigma_mm: None };
            world.rows.push(row(format!("{group}_{i}"), &group, Role::Sample, joints_deg, touch));
        }
        sockets.push(socket);
    }
    (world, sockets)
}
