//! Simulated touches: a ball in sockets, some hundredths of a millimetre of play, three known distances. Beside the program a plain least squares of
//! all MDH parameters, written for this and nothing else.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use stereocal::geometry::Transform;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::{Dataset, KnownDistance};
use stereocal::identify::data::doctor;
use stereocal::identify::judge::choose::identify;
use stereocal::identify::judge::errors::Judge;
use stereocal::identify::record::spread;
use stereocal::identify::settings::Method;
use stereocal::measurements::{Measurement, Observed, RobotPose, Role};
use stereocal::robot::{Robot, inverse};

use crate::worlds::{Beyond, Plan, arms, normal, truth};

/// Sockets, touches of each that are fitted, and that verify.
const SOCKETS: usize = 8;
const FITTED: usize = 12;
const VERIFY: usize = 6;

/// Play, mm, root mean square of its length.
const PLAY_MM: f64 = 0.05;

/// Standard deviation of the known distances, mm.
const KNOWN_MM: f64 = 0.01;

/// How far the flange turns between touches of a socket, rad.
const TURN_RAD: f64 = 0.6;

/// One line an arm.
pub fn table(runs: u64) {
    println!(
        "\nsimulated touches, {SOCKETS} sockets, {PLAY_MM} mm of play, {runs} runs a line: consistency and distortion of touches that"
    );
    println!(
        "were not fitted, mm in the mean, against plain least squares, and in how many runs an unseen scale is said"
    );
    println!(
        "{:12} {:10} {:>17} {:>17} {:>17} {:>7} {:>11}",
        "", "", "nominal", "program", "least squares", "ratio", "scale said"
    );
    for (name, nominal) in arms().into_iter().filter(|(name, _)| *name != "SCARA") {
        for (what, beyond) in [("", Beyond::Nothing), ("gravity", Beyond::Gravity)] {
            let all: Vec<[f64; 7]> = (1..=runs).into_par_iter().map(|seed| outcome(&nominal, beyond, seed)).collect();
            let mean = |k: usize| all.iter().map(|o| o[k]).sum::<f64>() / runs as f64;
            println!(
                "{name:12} {what:10} {:8.4} {:8.4} {:8.4} {:8.4} {:8.4} {:8.4} {:7.2} {:5.0} of {runs:2}",
                mean(0),
                mean(1),
                mean(2),
                mean(3),
                mean(4),
                mean(5),
                mean(2) / mean(4),
                mean(6) * runs as f64
            );
        }
    }
}

/// Consistency and distortion of nominal robot, program and least squares; whether an unseen scale is said without known distances.
fn outcome(nominal: &Robot, beyond: Beyond, seed: u64) -> [f64; 7] {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let plan = Plan { beyond, ..Plan::default() };
    let mut nominal = nominal.clone();
    nominal.tool_mm = Vector3::new(30.0, -20.0, 60.0);
    let truth = truth(&nominal, plan, &mut random);
    let (rows, sockets) = touched(&truth, &mut random);
    let mut set = Dataset::new(&rows, 1).expect("rows");
    set.known = (0..3)
        .map(|k| {
            let (a, b) = (k, k + SOCKETS / 2);
            let distance_mm = (sockets[a] - sockets[b]).norm() + KNOWN_MM * normal(&mut random);
            KnownDistance { a, b, distance_mm, sigma_mm: KNOWN_MM }
        })
        .collect();
    let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
    let found = identify(&set, &nominal, &settings, 1, &|_| {}).expect("it is enough");
    let judge = Judge::plain(&set, &found.fitted, true);
    let verify = set.verify_rows();
    let judged = |robot: &Robot| {
        let figures = spread(&judge, robot, &judge.errors(robot, &verify), &verify);
        [figures.consistency, figures.distortion].map(|s| s.and_then(|s| s.mean_abs_mm).unwrap_or(f64::NAN))
    };
    let [before, after, plain] =
        [&nominal, &found.candidates[found.chosen].robot, &least_squares(&set, &nominal)].map(judged);
    let unknown = Dataset { known: Vec::new(), ..set.clone() };
    let said = identify(&unknown, &nominal, &settings, 1, &|_| {}).is_ok_and(|found| {
        let findings = doctor::findings(&unknown, &found, &Default::default());
        findings.iter().any(|f| f.finding.contains("scale of the robot unseen"))
    });
    [before[0], before[1], after[0], after[1], plain[0], plain[1], f64::from(u8::from(said))]
}

/// Touches, and where the sockets are in the base frame, mm.
fn touched(truth: &Robot, random: &mut Pcg64Mcg) -> (Vec<Measurement>, Vec<Vector3<f64>>) {
    let (mut rows, mut sockets) = (Vec::new(), Vec::new());
    while sockets.len() < SOCKETS {
        let first: Vec<f64> = truth.joints.iter().map(|_| 1.2 * (2.0 * random.random::<f64>() - 1.0)).collect();
        let (socket, flange) = (truth.target_mm(&first).coords, truth.base_from_flange(&first).rotation);
        let mut postures = Vec::new();
        for _ in 0..20 * (FITTED + VERIFY) {
            let turn = Vector3::from_fn(|_, _| TURN_RAD * (2.0 * random.random::<f64>() - 1.0));
            let play = Vector3::from_fn(|_, _| PLAY_MM / 3f64.sqrt() * normal(random));
            let rotation = UnitQuaternion::from_scaled_axis(turn) * flange;
            let origin = socket + play - rotation * truth.tool_mm;
            let wanted = Transform::from_parts(origin.into(), rotation);
            postures.extend(inverse::from_start(truth, &wanted, &first));
            if postures.len() == FITTED + VERIFY {
                break;
            }
        }
        if postures.len() < FITTED + VERIFY {
            continue;
        }
        for (i, joints) in postures.iter().enumerate() {
            let at = RobotPose {
                pose: format!("s{}_{i}", sockets.len()),
                group: format!("s{}", sockets.len()),
                role: if i < FITTED { Role::Sample } else { Role::Verify },
                joints_deg: joints.iter().map(|q| q.to_degrees()).collect(),
                slides: vec![],
            };
            rows.push(Measurement { at, observed: Observed::Distance { distance_mm: 0.0, sigma_mm: None } });
        }
        sockets.push(socket);
    }
    (rows, sockets)
}

/// All MDH parameters by Gauss and Newton, derivatives by differences: touches about their mean, and the known distances.
fn least_squares(set: &Dataset, nominal: &Robot) -> Robot {
    let parameters = nominal.mdh_parameters();
    let rows = set.fit_rows();
    let residuals = |offsets: &[f64]| {
        let robot = nominal.shifted(&parameters, offsets);
        let mut list = Vec::new();
        let mut middles = Vec::new();
        for group in 0..set.groups.len() {
            let of_group = rows.iter().filter(|&&r| set.poses[r].group == group);
            let points: Vec<Vector3<f64>> =
                of_group.map(|&r| robot.target_mm(&set.poses[r].joints_rad).coords).collect();
            let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            list.extend(
                points.iter().flat_map(|p| (p - middle).iter().map(|v| v * 3f64.sqrt() / PLAY_MM).collect::<Vec<_>>()),
            );
            middles.push(middle);
        }
        list.extend(set.known.iter().map(|k| ((middles[k.a] - middles[k.b]).norm() - k.distance_mm) / KNOWN_MM));
        DVector::from_vec(list)
    };
    /// Steps that end far below the play, and the change of a parameter for a derivative, mm or mrad.
    const STEPS: usize = 8;
    const CHANGE: f64 = 1e-3;
    let mut offsets = vec![0.0; parameters.len()];
    for _ in 0..STEPS {
        let at = residuals(&offsets);
        let mut jacobian = DMatrix::zeros(at.len(), parameters.len());
        for k in 0..parameters.len() {
            let mut moved = offsets.clone();
            moved[k] += CHANGE;
            jacobian.set_column(k, &((residuals(&moved) - &at) / CHANGE));
        }
        let svd = jacobian.svd(true, true);
        let least = 1e-6 * svd.singular_values.max();
        let Ok(step) = svd.solve(&at, least) else { break };
        offsets.iter_mut().zip(step.iter()).for_each(|(o, s)| *o -= s);
    }
    nominal.shifted(&parameters, &offsets)
}
