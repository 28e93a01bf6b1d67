//! Simulated touches: a ball in sockets, some hundredths of a millimetre of play, three known distances. Beside the
//! program a plain least squares of all MDH parameters, written for this and nothing else.

use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use stereocal::geometry::Transform;
use stereocal::identify::Settings;
use stereocal::identify::data::dataset::{Dataset, KnownDistance};
use stereocal::identify::examine;
use stereocal::identify::judge::errors::Judge;
use stereocal::identify::record::{self, spread};
use stereocal::identify::run::identify;
use stereocal::identify::settings::Method;
use stereocal::measurements::{Measurement, Observed, RobotPose, Role};
use stereocal::robot::{Robot, inverse};

use crate::faults::{as_standard, joints};
use crate::simulated::against_truth;
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
    faults(runs);
}

/// What touches are made of: the nominal robot, rows, known distances.
struct World {
    nominal: Robot,
    truth: Robot,
    rows: Vec<Measurement>,
    known: Vec<KnownDistance>,
}

impl World {
    /// With a socket that moves by so much after half of its touches.
    fn new(nominal: &Robot, beyond: Beyond, moved_mm: f64, seed: u64) -> World {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let plan = Plan { beyond, ..Plan::default() };
        let mut nominal = nominal.clone();
        nominal.tool_mm = Vector3::new(30.0, -20.0, 60.0);
        let truth = truth(&nominal, plan, &mut random);
        let (rows, sockets) = touched(&truth, moved_mm, &mut random);
        let known = (0..3)
            .map(|k| {
                let (a, b) = (k, k + SOCKETS / 2);
                let distance_mm = (sockets[a] - sockets[b]).norm() + KNOWN_MM * normal(&mut random);
                KnownDistance { a, b, distance_mm, stated_sigma_mm: Some(KNOWN_MM) }
            })
            .collect();
        World { nominal, truth, rows, known }
    }
}

/// Changes a world by so much.
type Plant = fn(&mut World, f64);

/// Faults, their sizes, and a word of the sentence that names each; what moves the socket is the world's own.
const FAULTS: [(&str, &[f64], Plant, &str); 15] = [
    ("clean", &[0.0], |_, _| {}, ""),
    ("radians", &[0.0], |w, _| joints(&mut w.rows, |_, j| j.iter_mut().for_each(|q| *q = q.to_radians())), "radians"),
    ("exchanged joints", &[0.0], |w, _| joints(&mut w.rows, |_, j| j.swap(1, 3)), "exchanged"),
    ("negated joint", &[0.0], |w, _| joints(&mut w.rows, |_, j| j[2] = -j[2]), "sign is flipped"),
    ("joint off by, deg", &[90.0, -90.0], |w, by| joints(&mut w.rows, |_, j| j[2] += by), "offset by"),
    ("standard DH", &[0.0], |w, _| w.nominal = as_standard(&w.nominal), "standard DH"),
    (
        "a joint read wrong by, deg",
        &[0.05, 0.2, 2.0, 60.0],
        |w, by| joints(&mut w.rows, |i, j| j[1] += if i == 7 { by } else { 0.0 }),
        "worse than the rest",
    ),
    ("touches exchanged", &[1.0, 3.0], |w, by| exchanged(w, by as usize), "worse than the rest"),
    ("verify joint wrong by, deg", &[0.05, 0.2, 2.0, 60.0], verify_socket, "verify row"),
    ("a socket moved by, mm", &[0.3, 1.0, 5.0], |_, _| {}, "sessions"),
    ("a known length off by, mm", &[0.3, 1.0, 5.0], |w, by| w.known[1].distance_mm += by, "known distance"),
    ("known lengths times", &[1.01, 1.1], lengths, "all links"),
    ("known lengths in inches", &[25.4], |w, by| lengths(w, 1.0 / by), "known distances are in inches"),
    ("known lengths in m", &[1000.0], |w, by| lengths(w, 1.0 / by), "known distances are in m"),
    ("a link longer by, mm", &[20.0, 60.0], |w, by| w.nominal.joints[2].a_mm += by, "another robot"),
];

/// So many touches of the first socket and of the third carry each other's joints.
fn exchanged(world: &mut World, count: usize) {
    for k in 0..count {
        let (a, b) = (5 + k, 2 * (FITTED + VERIFY) + 3 + k);
        let kept = std::mem::take(&mut world.rows[a].at.joints_deg);
        world.rows[a].at.joints_deg = std::mem::replace(&mut world.rows[b].at.joints_deg, kept);
    }
}

/// The last socket only verifies, and one of its touches has a joint that was read wrong.
fn verify_socket(world: &mut World, by_deg: f64) {
    let last = world.rows.len() - FITTED - VERIFY;
    world.rows[last..].iter_mut().for_each(|row| row.at.role = Role::Verify);
    world.rows[last + 4].at.joints_deg[1] += by_deg;
}

fn lengths(world: &mut World, factor: f64) {
    world.known.iter_mut().for_each(|k| k.distance_mm *= factor);
}

/// One line a fault and size: in how many runs it is named, and how many wrong results come without a word.
fn faults(runs: u64) {
    println!("\nplanted faults, Table 1's robot, {runs} runs: named of, findings, silently wrong");
    let diagnosed = |plant: Plant, moved_mm: f64, size: f64, seed: u64| {
        let mut world = World::new(&arms()[0].1, Beyond::Nothing, moved_mm, seed);
        let exact = Dataset::new(&world.rows).expect("rows");
        plant(&mut world, size);
        let mut set = Dataset::new(&world.rows).expect("rows");
        set.known = world.known;
        let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
        let examined = examine::examine(&set, &world.nominal, &settings, &|_| {});
        let mut list = examined.findings;
        let Ok(found) = identify(&examined.set, &examined.robot, &settings, 1, &|_| {}) else {
            list.extend(examined.unexplained);
            return (list, f64::INFINITY);
        };
        list.extend(examined.unexplained.filter(|_| !record::findings::is_explained(&examined.set, &found)));
        list.extend(record::findings::findings(&examined.set, &found, &examined.along));
        (list, against_truth(&exact, &world.truth, &found.candidates[found.chosen].robot))
    };
    let clean: Vec<f64> = (1..=runs).into_par_iter().map(|seed| diagnosed(|_, _| {}, 0.0, 0.0, seed).1).collect();
    for (what, sizes, plant, word) in FAULTS {
        for &size in sizes {
            let moved_mm = if what.contains("moved") { size } else { 0.0 };
            let said: Vec<_> = (1..=runs).into_par_iter().map(|seed| diagnosed(plant, moved_mm, size, seed)).collect();
            let named = said.iter().filter(|(list, _)| list.iter().any(|f| f.finding.contains(word))).count();
            let findings: usize = said.iter().map(|(list, _)| list.len()).sum();
            let silent = said.iter().zip(&clean).filter(|((list, e), c)| list.is_empty() && *e > 1.5 * **c).count();
            let first = said.iter().find_map(|(list, _)| list.first()).map_or(String::new(), |f| f.sentence());
            println!("{what:26} {size:7} {named:5} of {runs:3} {findings:9} {silent:15}  {first:.100}");
        }
    }
}

/// Consistency and distortion of nominal robot, program and least squares; whether an unseen scale is said without
/// known distances.
fn outcome(nominal: &Robot, beyond: Beyond, seed: u64) -> [f64; 7] {
    let World { nominal, rows, known, .. } = World::new(nominal, beyond, 0.0, seed);
    let mut set = Dataset::new(&rows).expect("rows");
    set.known = known;
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
        let findings = record::findings::findings(&unknown, &found, &Default::default());
        findings.iter().any(|f| f.finding.contains("do not determine the scale"))
    });
    [before[0], before[1], after[0], after[1], plain[0], plain[1], f64::from(u8::from(said))]
}

/// Touches, and where the sockets are in the base frame, mm. The fourth moves by so much after half of its touches.
fn touched(truth: &Robot, moved_mm: f64, random: &mut Pcg64Mcg) -> (Vec<Measurement>, Vec<Vector3<f64>>) {
    let (mut rows, mut sockets) = (Vec::new(), Vec::new());
    while sockets.len() < SOCKETS {
        let first: Vec<f64> = truth.joints.iter().map(|_| 1.2 * (2.0 * random.random::<f64>() - 1.0)).collect();
        let (socket, flange) = (truth.target_mm(&first).coords, truth.base_from_flange(&first).rotation);
        let mut postures = Vec::new();
        for _ in 0..20 * (FITTED + VERIFY) {
            let turn = Vector3::from_fn(|_, _| TURN_RAD * (2.0 * random.random::<f64>() - 1.0));
            let play = Vector3::from_fn(|_, _| PLAY_MM / 3f64.sqrt() * normal(random));
            let rotation = UnitQuaternion::from_scaled_axis(turn) * flange;
            let moves = sockets.len() == 3 && postures.len() >= FITTED / 2;
            let moved = if moves { Vector3::x() * moved_mm } else { Vector3::zeros() };
            let origin = socket + moved + play - rotation * truth.tool_mm;
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
            rows.push(Measurement {
                at,
                target: String::new(),
                observed: Observed::Distance { distance_mm: 0.0, sigma_mm: None },
            });
        }
        sockets.push(socket);
    }
    (rows, sockets)
}

/// All MDH parameters by Gauss and Newton, derivatives by differences: touches about their mean, and the known
/// distances.
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
