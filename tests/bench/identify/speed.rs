//! STAPSO and the other swarms with 100 particles x 500 iterations x 262 poses, without early stop.
//!
//! Without files a robot like the paper's is measured on four spheres. Prints pose evaluations per second and core;
//! `scripts/bench_identify.py` runs pyswarms and scipy on the same data.

use std::time::Instant;

use camino::Utf8Path;
use stereocal::identify::Model;
use stereocal::identify::data::dataset::Dataset;
use stereocal::identify::settings::{Method, Prior, Settings};
use stereocal::identify::solve::formulation::Formulation;
use stereocal::identify::solve::problem::Problem;
use stereocal::identify::solve::task::Task;
use stereocal::identify::solve::{swarm, trust_region};
use stereocal::measurements::{self, Measurement, Observed, RobotPose, Role};
use stereocal::robot::{self, Robot};

const SEED: u64 = 1;
/// Fitted poses of the paper's experiment, besides the four centres.
const SAMPLES: usize = 262;

/// Times every solver on the files' data (measurements, robot), or on made-up data.
pub fn table(files: &[String]) {
    let (robot, rows) = match files {
        [rows, robot] => (
            robot::file::read(Utf8Path::new(robot)).expect("the robot"),
            measurements::read(Utf8Path::new(rows)).expect("the measurements"),
        ),
        _ => made_up(),
    };
    let set = Dataset::new(&rows).expect("rows to fit");
    let mut settings = Settings { prior: Prior::Off, ..Settings::default() };
    settings.swarm.patience = 0;
    let prepared = Formulation::new(&Task {
        set: &set,
        robot: &robot,
        parameters: &robot.mdh_parameters(),
        extras: &[],
        rows: &set.fit_rows(),
        model: Model::CenterDistance,
        smooth: None,
        settings: &settings,
    })
    .expect("enough poses");
    let fit = prepared.fit();
    let (poses, threads) = (prepared.rows.rows.len(), rayon::current_num_threads());
    println!("{poses} poses, {} parameters, {threads} threads", fit.dimension());
    for method in [Method::Stapso, Method::Pso, Method::Cpso, Method::Apso, Method::Arpso] {
        let mut times: Vec<f64> = Vec::new();
        let mut solution = None;
        for _ in 0..5 {
            let start = Instant::now();
            solution = Some(swarm::solve(&fit, method, &settings.swarm, SEED));
            times.push(start.elapsed().as_secs_f64());
        }
        times.sort_by(f64::total_cmp);
        if let Some(solution) = solution {
            let rate = (solution.evaluations * poses) as f64 / times[2] / threads as f64;
            println!(
                "{:8} median {:.3} s of {} runs, cost {:.6} mm2, {} evaluations, {:.1} million pose evaluations a second and core",
                method.name(),
                times[2],
                times.len(),
                solution.cost,
                solution.evaluations,
                rate / 1e6
            );
        }
    }
    let start = Instant::now();
    let solution = trust_region::solve(&fit, &vec![0.0; fit.dimension()], &settings.trust_region);
    println!(
        "trust region {:.4} s, cost {:.6} mm2, {} iterations",
        start.elapsed().as_secs_f64(),
        solution.cost,
        solution.iterations
    );
}

/// Poses spread over the joints' ranges, measured on a robot whose links are off by up to a millimetre.
fn made_up() -> (Robot, Vec<Measurement>) {
    let nominal = Robot::paper();
    let parameters = nominal.mdh_parameters();
    let truth =
        nominal.shifted(&parameters, &(0..parameters.len()).map(|i| (1.3 * i as f64).sin()).collect::<Vec<_>>());
    let mut rows = Vec::new();
    for i in 0..SAMPLES + 4 {
        let (group, role) = (i % 4, if i < 4 { Role::Center } else { Role::Sample });
        let joints_deg: Vec<f64> =
            (0..6).map(|j| 40.0 * ((i * (2 * j + 3)) as f64 * 0.7).sin() + 90.0 * (group as f64 - 1.5)).collect();
        let at = RobotPose { pose: format!("p{i}"), group: format!("g{group}"), role, joints_deg, slides: Vec::new() };
        let point_mm = truth.target_mm(&at.joints_rad());
        rows.push(Measurement {
            at,
            target: String::new(),
            observed: Observed::Position { point_mm, covariance_mm2: None, rotation_rad: None },
        });
    }
    (nominal, rows)
}
