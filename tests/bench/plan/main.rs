//! Benchmark of the planner: is the accuracy that it promises realised, and what do its poses save against the paper's
//! layout?
//!
//! `cargo bench --bench plan [-- ROBOTS]` draws so many robots of each of three arms, measures them at 60 planned
//! poses, at 266 of the paper's layout with varied orientation and at 266 with one orientation, identifies them, and
//! judges them at fresh poses. Then it renders a plan of each arm and counts the poses that `measure` finds.
#![allow(clippy::print_stdout, reason = "a benchmark says what it measured")]
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a benchmark that cannot run has nothing to say")]

mod arms;
mod rendered;

use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use stereocal::geometry::{Transform, transform};
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::run::identify;
use stereocal::identify::settings::Method;
use stereocal::identify::{Model, Settings as Identify};
use stereocal::measurements::{Measurement, Observed, RobotPose, Role};
use stereocal::plan::pool::{Candidate, Kind, Pool};
use stereocal::plan::scene::{PoseNoise, Scene, placements};
use stereocal::plan::{Planned, Settings, plan};
use stereocal::robot::Robot;
use stereocal::simulate::draws::{Draws, Purpose};
use stereocal::simulate::rig::true_rig;
use stereocal::stereo::model::rig::Rig;

/// Robots of each arm.
const ROBOTS: u64 = 10;

/// Noise of a coordinate, mm.
const NOISE_MM: f64 = 0.02;

/// Rows to verify.
const VERIFY: usize = 20;

/// Names of the layouts that are compared.
const LAYOUTS: [&str; 3] = ["60 planned", "266 varied", "266 fixed"];

fn main() {
    let robots = std::env::args().filter_map(|a| a.parse().ok()).next().unwrap_or(ROBOTS);
    println!(
        "mean error at fresh poses after one rigid fit, mm, over {robots} robots; realised / promised root mean square"
    );
    for (name, nominal) in arms::arms() {
        table(name, &nominal, robots);
    }
    rendered::table(&Settings { verify: 8, ..settings() });
}

fn settings() -> Settings {
    Settings {
        samples: 60,
        verify: 0,
        paper: false,
        first: None,
        pool: 20_000,
        seed: 1,
        centers_mm: Vec::new(),
        radius_mm: 100.0,
        noise_mm: Some(NOISE_MM),
        repeatability_mm: 0.02,
    }
}

fn table(name: &str, nominal: &Robot, robots: u64) {
    let rig: Rig = true_rig(5120);
    let board = stereocal::config::Config::default().target_board.board(None, None, None).unwrap();
    let scene = Scene::new(rig, board, 0.03, 35f64.to_radians(), 120.0, 8.0).unwrap();
    let settings = settings();
    let found = plan(nominal, &scene, &settings, None).unwrap();
    let promised = found.expected.iter().find(|e| e.0 == 60).unwrap().1;
    let placements = placements(nominal, &scene, &settings).unwrap();
    let noise = PoseNoise { given_mm: Some(NOISE_MM), repeatability_mm: 0.0 };
    let pool = Pool { robot: nominal, scene: &scene, settings: &settings, placements: &placements, noise };
    let fresh = pool.candidates(Kind::Fresh).unwrap();
    let centers = pool.candidates(Kind::Center).unwrap();
    let planned: Vec<(usize, Vec<f64>)> = found.poses.iter().map(|p: &Planned| (p.group, p.at.joints_rad())).collect();
    let layout = |kind| -> Vec<(usize, Vec<f64>)> {
        let all = centers.iter().cloned().chain(pool.candidates(kind).unwrap());
        all.map(|c: Candidate| (c.group, c.joints_rad)).collect()
    };
    // Without rows to verify `identify` would hold a fifth out.
    let verify: Vec<(usize, Vec<f64>)> =
        pool.candidates(Kind::Verify(VERIFY)).unwrap().into_iter().map(|c| (c.group, c.joints_rad)).collect();
    let layouts = [planned, layout(Kind::Verify(262)), layout(Kind::Paper(262))];
    let errors: Vec<[(f64, f64); 3]> = (1..=robots)
        .into_par_iter()
        .map(|seed| {
            let truth = arms::deviated(nominal, seed);
            [0, 1, 2].map(|k| {
                let robot = identified(nominal, &truth, &layouts[k], &verify, seed);
                judged(&truth, &robot, &fresh)
            })
        })
        .collect();
    for (k, layout) in LAYOUTS.into_iter().enumerate() {
        let mean = errors.iter().map(|e| e[k].0).sum::<f64>() / errors.len() as f64;
        let rms = (errors.iter().map(|e| e[k].1 * e[k].1).sum::<f64>() / errors.len() as f64).sqrt();
        let ratio = if k == 0 {
            format!("promised {promised:.4}, realised / promised {:.2}", rms / promised)
        } else {
            String::new()
        };
        println!("{name:12} {layout:12} mean {mean:.4}  rms {rms:.4}  {ratio}");
    }
}

/// The robot that `identify` makes of noisy points at these readings.
fn identified(
    nominal: &Robot,
    truth: &Robot,
    poses: &[(usize, Vec<f64>)],
    verify: &[(usize, Vec<f64>)],
    seed: u64,
) -> Robot {
    let mut rows = Vec::new();
    for (k, (group, q)) in poses.iter().chain(verify).enumerate() {
        let sensor: Transform =
            transform(Vector3::new(0.3 + *group as f64, -0.7, 1.1), Vector3::new(50.0, 80.0, 500.0));
        let noise = Draws::new(seed, Purpose::Points, k as u64).normal3() * NOISE_MM;
        let point_mm: Point3<f64> = sensor * truth.target_mm(q) + noise;
        let variance = nalgebra::Matrix3::identity() * NOISE_MM * NOISE_MM;
        let first = !rows.iter().any(|r: &Measurement| r.at.group == format!("{group}"));
        rows.push(Measurement {
            at: RobotPose {
                pose: format!("p{k}"),
                group: format!("{group}"),
                role: match (first, k < poses.len()) {
                    (true, _) => Role::Center,
                    (_, true) => Role::Sample,
                    _ => Role::Verify,
                },
                joints_deg: q.iter().map(|v| v.to_degrees()).collect(),
                slides: Vec::new(),
            },
            target: String::new(),
            observed: Observed::Position { point_mm, covariance_mm2: Some(variance), rotation_rad: None },
        });
    }
    let set = Dataset::new(&rows).unwrap();
    let settings = Identify { method: Some(Method::TrustRegion), model: Some(Model::Position), ..Identify::default() };
    let found = identify(&set, nominal, &settings, 1, &|_| {}).unwrap();
    found.candidates[found.chosen].robot.clone()
}

/// Mean and root mean square distance of the two robots' targets after one rigid fit.
fn judged(truth: &Robot, robot: &Robot, fresh: &[Candidate]) -> (f64, f64) {
    let at =
        |robot: &Robot| -> Vec<Vector3<f64>> { fresh.iter().map(|c| robot.target_mm(&c.joints_rad).coords).collect() };
    let (a, b) = (at(robot), at(truth));
    let motion = stereocal::plan::after::rigid(&a, &b).unwrap();
    let squares: Vec<f64> =
        a.iter().zip(&b).map(|(a, b)| ((motion * Point3::from(*a)).coords - b).norm_squared()).collect();
    let n = squares.len() as f64;
    (squares.iter().map(|s| s.sqrt()).sum::<f64>() / n, (squares.iter().sum::<f64>() / n).sqrt())
}
