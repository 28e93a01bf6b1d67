//! Whether robots that are identified from measured poses are as uncertain as `identify` says: what all poses share
//! comes along in `measure.json`, and the robot repeats exactly, so that nothing but the corners' noise is left.

use camino::Utf8Path;
use nalgebra::Point3;
use rayon::prelude::*;
use stereocal::files::OutDir;
use stereocal::formats::measure::{MeasureFile, to_csv};
use stereocal::identify::data::dataset::{Dataset, Reading};
use stereocal::identify::data::shared;
use stereocal::identify::judge::errors::Judge;
use stereocal::identify::judge::uncertainty::Expected;
use stereocal::identify::run::{Identification, identify};
use stereocal::identify::settings::{Extensions, Method, Settings};
use stereocal::measurements::{self, Measurement, Observed};
use stereocal::robot::Robot;
use stereocal::simulate::world::World;
use stereocal::stereo::board_pose::series::measure;

use crate::worlds::{knowledge, run as poses_of, still_world};

/// Robots for each line.
const ROBOTS: u64 = 48;

/// Poses besides the four centres.
const SAMPLES: usize = 96;

/// Of a Gaussian within its 95 % interval.
const WIDTH: f64 = 1.96;

/// What becomes of one robot.
struct Outcome {
    /// Mean error of points at the poses that the robot has, mm: promised, and against the truth.
    promise_mm: [f64; 2],
    /// Base parameters of the noisy points against those of the same points without noise, in standard deviations; none
    /// where other terms were taken.
    parameters: Option<Vec<f64>>,
}

pub fn run() {
    println!(
        "robots: {ROBOTS} a line with {} poses at 1280 px, their repeatability 0; mean over the robots of the points' errors",
        SAMPLES + 4
    );
    println!(
        "  target | promised um   found um  promised / found | base parameters: found / promised, within the 95 % interval"
    );
    for target_um in [0.0, 10.0] {
        let outcomes: Vec<Outcome> = (0..if std::env::var("DUMP").is_ok() { 1 } else { ROBOTS })
            .into_par_iter()
            .map(|seed| outcome(target_um, 300 + seed))
            .collect();
        let mean = |k: usize| outcomes.iter().map(|o| o.promise_mm[k]).sum::<f64>() / outcomes.len() as f64;
        let (promised, found) = (mean(0), mean(1));
        let robots = outcomes.iter().filter(|o| o.parameters.is_some()).count();
        let mut off: Vec<f64> = outcomes.into_iter().filter_map(|o| o.parameters).flatten().map(f64::abs).collect();
        off.sort_by(f64::total_cmp);
        let inside = 100.0 * off.iter().filter(|z| **z <= WIDTH).count() as f64 / off.len() as f64;
        // Not their mean square: what the poses hardly see may be shared out otherwise, by many of its sigmas, in a
        // robot that is the same.
        let quantile = off[(0.95 * off.len() as f64) as usize] / WIDTH;
        println!(
            "{target_um:5.0} um | {:11.3} {:10.3} {:17.2} | {quantile:23.2} {inside:17.1} % ({robots} robots of MDH)",
            1e3 * promised,
            1e3 * found,
            promised / found
        );
    }
}

fn outcome(target_um: f64, seed: u64) -> Outcome {
    let world = still_world(1280, target_um, SAMPLES, seed);
    let folder = tempfile::tempdir().expect("a folder");
    let folder = Utf8Path::from_path(folder.path()).expect("a name");
    let rows = measured(&world, folder);
    let set = dataset(&rows, folder);
    let found = identified(&set, &world.arm.nominal, Extensions::Auto);
    let exact = identified(&dataset(&without_noise(&rows, &world), folder), &world.arm.nominal, Extensions::None);
    let candidate = &found.candidates[found.chosen];
    let (formulation, _) = candidate.found.as_ref().expect("a fit");
    let (of_exact, _) = exact.candidates[exact.chosen].found.as_ref().expect("a fit");
    // Numbers of other unknowns could not be compared.
    let alike = formulation.parameters() == of_exact.parameters() && formulation.base.free == of_exact.base.free;
    let parameters = alike.then(|| {
        let covariance = formulation.covariance();
        let off = |k: usize| (formulation.free_fit.x[k] - of_exact.free_fit.x[k]) / covariance[(k, k)].sqrt();
        (0..formulation.base.rank()).map(off).collect()
    });
    let promised = Expected::new(formulation, &set, &found.fitted, &found.outliers).of_robot_mm;
    Outcome { promise_mm: [promised, against_truth(&set, &found, &candidate.robot, &world.arm.truth)], parameters }
}

/// What `measure` writes, read as `identify` reads it.
fn measured(world: &World, folder: &Utf8Path) -> Vec<Measurement> {
    let known = knowledge(world);
    let series = measure(&known, poses_of(world));
    let out = OutDir::open(folder).expect("a folder");
    let csv = folder.join("measurements.csv");
    std::fs::write(&csv, to_csv(&series.poses)).expect("a file");
    out.write_json("measure.json", &MeasureFile::new(&series, &world.pose_corners(), &known)).expect("a file");
    measurements::read(&csv).expect("rows")
}

fn dataset(rows: &[Measurement], folder: &Utf8Path) -> Dataset {
    let mut set = Dataset::new(rows).expect("rows");
    shared::take(&folder.join("measure.json"), &mut set);
    assert!(!set.shared.is_empty(), "the shared part belongs to the rows");
    set
}

/// The same rows with the target where it was.
fn without_noise(rows: &[Measurement], world: &World) -> Vec<Measurement> {
    let mut exact = rows.to_vec();
    for row in &mut exact {
        let truth = world.poses.iter().find(|pose| pose.commanded.pose == row.at.pose).expect("a pose");
        if let Observed::Position { point_mm, rotation_rad, .. } = &mut row.observed {
            *point_mm = Point3::from(truth.left_from_target.translation.vector);
            *rotation_rad = Some(truth.left_from_target.rotation.scaled_axis());
        }
    }
    exact
}

fn identified(set: &Dataset, nominal: &Robot, extensions: Extensions) -> Identification {
    let settings = Settings { method: Some(Method::TrustRegion), extensions, ..Settings::default() };
    identify(set, nominal, &settings, 1, &|_| {}).expect("a robot")
}

/// Mean error of the robot's points with no noise, after one rigid fit of each placement, as it is promised.
fn against_truth(set: &Dataset, found: &Identification, robot: &Robot, truth: &Robot) -> f64 {
    let mut exact = set.clone();
    for pose in &mut exact.poses {
        if let Reading::Position { point_mm, .. } = &mut pose.reading {
            *point_mm = truth.target_mm(&pose.joints_rad);
        }
    }
    let rows: Vec<usize> = (0..exact.poses.len()).collect();
    let errors = Judge::plain(&exact, &found.fitted, true).errors(robot, &rows);
    let sizes: Vec<f64> = errors.iter().filter_map(|e| e.point_mm).map(|p| p.norm()).collect();
    sizes.iter().sum::<f64>() / sizes.len() as f64
}
