//! Simulated arms: a nominal robot, a true one, and points that a tracker would see.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use stereocal::geometry::Transform;
use stereocal::measurements::{Measurement, Observed, RobotPose, Role};
use stereocal::robot::{Joint, Parameter, Robot, Unit};

/// What the truth has beyond MDH, or the readings beyond white noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Beyond {
    /// Nothing.
    Nothing,
    /// Joints that give way under the arm's weight.
    Gravity,
    /// Bearings that give way across their axes under the load, and joints that do under both weights.
    Bending,
    /// Errors once and twice a turn.
    Harmonics,
    /// A smooth error of 0.03 mm common to a placement.
    Common,
}

/// What a simulated robot is measured with.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Placements of the sensor.
    pub groups: usize,
    /// What the model lacks.
    pub beyond: Beyond,
    /// Poses to fit.
    pub samples: usize,
    /// Poses to verify.
    pub verify: usize,
    /// Noise of a coordinate, mm.
    pub noise_mm: f64,
    /// Standard deviation of the truth's lengths, mm.
    pub error_mm: f64,
    /// Standard deviation of the truth's angles, mrad.
    pub error_mrad: f64,
    /// Whether the poses to fit turn one axis after the other, all others where they were.
    pub one_axis: bool,
    /// Whether the last axis stands still in the poses to fit.
    pub still: bool,
    /// Whether there is nothing to verify: the other poses are for the truth alone.
    pub unverified: bool,
    /// Whether three targets are measured, of which most poses to fit show one.
    pub parts: bool,
    /// Readings of each pose to fit.
    pub readings: usize,
    /// Whether the file of the nominal robot knows nothing of the tool.
    pub no_tool: bool,
}

impl Default for Plan {
    /// 60 poses of one placement, a robot as it leaves the factory, a good tracker.
    fn default() -> Plan {
        Plan {
            groups: 1,
            beyond: Beyond::Nothing,
            samples: 60,
            verify: 100,
            noise_mm: 0.02,
            error_mm: 0.5,
            error_mrad: 1.0,
            one_axis: false,
            still: false,
            unverified: false,
            parts: false,
            readings: 1,
            no_tool: false,
        }
    }
}

/// Names and nominal robots.
pub fn arms() -> Vec<(&'static str, Robot)> {
    let mut large = Robot::paper();
    for joint in &mut large.joints {
        joint.a_mm *= 4.5;
        joint.d_mm *= 4.5;
    }
    vec![
        ("Table 1", Robot::paper()),
        (
            "UR-like",
            arm(&[
                (0.0, 0.0, 89.0),
                (90.0, 0.0, 0.0),
                (0.0, -425.0, 0.0),
                (0.0, -392.0, 109.0),
                (90.0, 0.0, 95.0),
                (-90.0, 0.0, 82.0),
            ]),
        ),
        (
            "seven axes",
            arm(&[
                (0.0, 0.0, 333.0),
                (-90.0, 0.0, 0.0),
                (90.0, 0.0, 316.0),
                (90.0, 82.5, 0.0),
                (-90.0, -82.5, 384.0),
                (90.0, 0.0, 0.0),
                (90.0, 88.0, 107.0),
            ]),
        ),
        ("SCARA", scara()),
        ("2.5 m", large),
    ]
}

fn arm(rows: &[(f64, f64, f64)]) -> Robot {
    let mut robot = Robot::paper();
    let joint = |&(alpha_deg, a_mm, d_mm): &(f64, f64, f64)| Joint {
        alpha_rad: alpha_deg.to_radians(),
        a_mm,
        d_mm,
        ..Joint::default()
    };
    robot.joints = rows.iter().map(joint).collect();
    robot
}

fn scara() -> Robot {
    let mut robot = arm(&[(0.0, 0.0, 200.0), (0.0, 325.0, 0.0), (180.0, 275.0, 0.0), (0.0, 0.0, 50.0)]);
    robot.joints[2].slides = true;
    robot
}

/// A nominal robot, a truth, and the rows that a tracker would read.
pub fn measured(nominal: &Robot, plan: Plan, seed: u64) -> (Robot, Robot, Vec<Measurement>) {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut nominal = nominal.clone();
    nominal.tool_mm = Vector3::new(30.0, -20.0, 60.0);
    let mut truth = truth(&nominal, plan, &mut random);
    if plan.no_tool {
        truth.tool_mm += Vector3::new(110.0, -80.0, 145.0);
        nominal.tool_mm = Vector3::zeros();
    }
    let mut of_sensors = Pcg64Mcg::seed_from_u64(seed ^ 0x5eed);
    let phases: Vec<f64> = (0..3 * plan.groups).map(|_| std::f64::consts::TAU * of_sensors.random::<f64>()).collect();
    let home: Vec<f64> = truth.joints.iter().map(|j| 0.4 * drawn(j, &mut of_sensors)).collect();
    let axes = home.len();
    let pose = |i: usize, random: &mut Pcg64Mcg| -> Vec<f64> {
        let mut joints: Vec<f64> = truth.joints.iter().map(|j| drawn(j, random)).collect();
        if plan.still && i < plan.samples {
            joints[axes - 1] = home[axes - 1];
        }
        if !plan.one_axis || i >= plan.samples {
            return joints;
        }
        let axis = i * axes / plan.samples;
        let (first, next) = ((axis * plan.samples).div_ceil(axes), ((axis + 1) * plan.samples).div_ceil(axes));
        let step = (i - first) as f64 / (next - first - 1).max(1) as f64;
        let mut joints = home.clone();
        joints[axis] = if truth.joints[axis].slides { 20.0 + 160.0 * step } else { 1.2 * (2.0 * step - 1.0) };
        joints
    };
    let readings = |i: usize| if i < plan.samples { plan.readings } else { 1 };
    let mut drawn_rows = Vec::new();
    for i in 0..plan.samples + plan.verify {
        let joints = pose(i, &mut random);
        for k in 0..readings(i) {
            let noise = Vector3::from_fn(|_, _| plan.noise_mm * normal(&mut random));
            drawn_rows.push((i, k, joints.clone(), noise));
        }
    }
    let rows = drawn_rows
        .into_iter()
        .map(|(i, k, joints, noise)| {
            let group = i % plan.groups;
            let seen: Point3<f64> = sensor(group) * truth.target_mm(&joints);
            let common = match plan.beyond {
                Beyond::Common => {
                    Vector3::from_fn(|axis, _| 0.03 * (seen[axis] / 300.0 + phases[3 * group + axis]).sin())
                }
                _ => Vector3::zeros(),
            };
            let slides: Vec<bool> = truth.joints.iter().map(|j| j.slides).collect();
            let joints_deg = joints.iter().zip(&slides).map(|(q, s)| if *s { *q } else { q.to_degrees() }).collect();
            let role = if i < plan.samples { Role::Sample } else { Role::Verify };
            let pose = if plan.readings > 1 { format!("p{i}.{k}") } else { format!("p{i}") };
            let at = RobotPose { pose, group: format!("g{group}"), role, joints_deg, slides };
            let point_mm = seen + common + noise;
            Measurement {
                at,
                target: String::new(),
                observed: Observed::Position { point_mm, covariance_mm2: None, rotation_rad: None },
            }
        })
        .collect();
    (nominal, truth, rows)
}

/// A robot that is off as the plan says.
pub fn truth(nominal: &Robot, plan: Plan, random: &mut Pcg64Mcg) -> Robot {
    let mut parameters = nominal.mdh_parameters();
    let size = |p: &Parameter| if p.unit() == Unit::Mm { plan.error_mm } else { plan.error_mrad };
    let mut errors: Vec<f64> = parameters.iter().map(|p| normal(random) * size(p)).collect();
    let more = match plan.beyond {
        Beyond::Gravity => nominal.gravity_parameters(false),
        Beyond::Bending => [nominal.gravity_parameters(true), nominal.bending_parameters()].concat(),
        Beyond::Harmonics => nominal.harmonic_parameters(2),
        Beyond::Nothing | Beyond::Common => Vec::new(),
    };
    let size = if matches!(plan.beyond, Beyond::Gravity | Beyond::Bending) { 1.0 } else { 0.3 };
    errors.extend(more.iter().map(|_| size * normal(random)));
    parameters.extend(more);
    nominal.shifted(&parameters, &errors)
}

/// Where a placement's sensor sees the base.
pub fn sensor(group: usize) -> Transform {
    let turn = 0.7 * group as f64;
    Transform::from_parts(
        Vector3::new(1200.0 * turn.cos(), -700.0 + 300.0 * turn.sin(), 400.0).into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.8 + turn, 1.9)),
    )
}

fn drawn(joint: &Joint, random: &mut Pcg64Mcg) -> f64 {
    let u = 2.0 * random.random::<f64>() - 1.0;
    if joint.slides { 100.0 + 80.0 * u } else { 1.6 * u }
}

pub fn normal(random: &mut Pcg64Mcg) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
