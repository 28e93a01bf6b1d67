//! The same question as `coverage`, from rendered pictures through the program: what windows, blur and bent edges do is
//! in it.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{DMatrix, Isometry3, Vector3};
use stereocal::files::OutDir;
use stereocal::measurements::{Observed, Role, read};
use stereocal::simulate::settings::Settings;
use stereocal::simulate::truth_files;
use stereocal::simulate::world::World;

use crate::coverage::Tally;
use crate::speed::run;

/// What a pose's row and the shared part say.
struct Found {
    point: Vector3<f64>,
    turn: Vector3<f64>,
    /// Of the point, then the rotation vector.
    sum: DMatrix<f64>,
    sensitivity: DMatrix<f64>,
}

/// What the files of one run say of all of its poses, and the covariance of what they share.
fn read_run(folder: &Path) -> (BTreeMap<String, Found>, DMatrix<f64>) {
    let text = std::fs::read_to_string(folder.join("out/measure.json")).expect("measure.json");
    let file: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let matrix = |value: &serde_json::Value| {
        let rows: Vec<Vec<f64>> = serde_json::from_value(value.clone()).expect("a matrix");
        DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
    };
    let shared = matrix(&file["shared"]["covariance"]);
    let by_shared: BTreeMap<String, DMatrix<f64>> = file["shared"]["poses"]
        .as_array()
        .expect("poses")
        .iter()
        .map(|pose| (pose["pose"].as_str().expect("a name").to_owned(), matrix(&pose["sensitivity"])))
        .collect();
    let path = camino::Utf8PathBuf::from_path_buf(folder.join("out/measurements.csv")).expect("a name");
    let table = std::fs::read_to_string(&path).expect("measurements.csv");
    let mut lines = table.lines();
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let mut turns = BTreeMap::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |name: &str| cells[header.iter().position(|h| *h == name)?].parse::<f64>().ok();
        let axes = ["x", "y", "z"];
        let entry = |i: usize, j: usize| {
            let (i, j) = (i.min(j), i.max(j));
            number(&format!("sr{}r{}_rad2", axes[i], axes[j]))
        };
        turns.insert(cells[0].to_owned(), nalgebra::Matrix3::from_fn(|i, j| entry(i, j).unwrap_or(f64::NAN)));
    }
    let found = read(&path).expect("measurements").into_iter().filter_map(|row| {
        let Observed::Position { point_mm, covariance_mm2: Some(covariance), rotation_rad: Some(turn) } = row.observed
        else {
            return None;
        };
        let mut sum = DMatrix::zeros(6, 6);
        sum.view_mut((0, 0), (3, 3)).copy_from(&covariance);
        sum.view_mut((3, 3), (3, 3)).copy_from(&turns[&row.at.pose]);
        let sensitivity = by_shared[&row.at.pose].clone();
        Some((row.at.pose.clone(), Found { point: point_mm.coords, turn, sum, sensitivity }))
    });
    (found.collect(), shared)
}

fn one(size_px: u32, target_um: f64, samples: usize, seed: u64) -> ([Tally; 3], usize) {
    let mut settings = Settings { size_px, samples, verify: 0, seed, ..Settings::small() };
    settings.target_workmanship.pitch_um = target_um;
    let world = World::new(settings, None).expect("the preset is possible");
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).expect("a folder");
    let out = OutDir::open(camino::Utf8Path::from_path(folder.path()).expect("a name")).expect("a folder");
    truth_files::write(&world, &out).expect("the truth");
    world.write_pictures(&out).expect("the pictures");
    run(folder.path(), &["camera-check", "check"]);
    run(folder.path(), &["measure", "poses"]);
    let (found, shared) = read_run(folder.path());
    let mut tallies: [Tally; 3] = std::array::from_fn(|_| Tally::default());
    let center = |group: usize| {
        world.poses.iter().find(|pose| pose.group == group && pose.commanded.role == Role::Center).expect("a center")
    };
    for pose in &world.poses {
        let Some(here) = found.get(&pose.commanded.pose) else { continue };
        let truth: &Isometry3<f64> = &pose.left_from_target;
        let off = here.point - truth.translation.vector;
        let turn = (nalgebra::UnitQuaternion::from_scaled_axis(here.turn) * truth.rotation.inverse()).scaled_axis();
        for k in 0..3 {
            tallies[0].add(off[k], here.sum[(k, k)].sqrt());
            tallies[1].add(turn[k], here.sum[(3 + k, 3 + k)].sqrt());
        }
        let middle = center(pose.group);
        let Some(there) = found.get(&middle.commanded.pose).filter(|_| middle.commanded.pose != pose.commanded.pose)
        else {
            continue;
        };
        let through = |by: &DMatrix<f64>| by * &shared * by.transpose();
        let own = |f: &Found| &f.sum - through(&f.sensitivity);
        let spread = own(here) + own(there) + through(&(&here.sensitivity - &there.sensitivity));
        let way = here.point - there.point;
        let true_way = truth.translation.vector - middle.left_from_target.translation.vector;
        let along = way.normalize();
        let variance = along.dot(&(spread.fixed_view::<3, 3>(0, 0) * along));
        tallies[2].add(way.norm() - true_way.norm(), variance.sqrt());
    }
    (tallies, world.poses.len() - found.len())
}

pub fn run_all(size: Option<u32>) {
    println!(
        "pictures: rendered, calibrated and measured by the program; columns as above, then poses without an answer"
    );
    println!("  px  target poses rigs | point um            | orientation urad    | distance um         | missing");
    let lines = [
        (1280, 0.0, 296, 6),
        (1280, 10.0, 296, 6),
        (1280, 0.0, 8, 24),
        (1280, 10.0, 8, 24),
        (5120, 0.0, 8, 12),
        (5120, 10.0, 8, 12),
    ];
    for (size_px, target_um, samples, rigs) in lines.into_iter().filter(|line| size.is_none_or(|px| px == line.0)) {
        let mut sum: [Tally; 3] = std::array::from_fn(|_| Tally::default());
        let mut missing = 0;
        for seed in 0..rigs {
            let (one, without) = one(size_px, target_um, samples, 300 + seed);
            let mut one = one.into_iter();
            sum = sum.map(|tally| tally.merge(one.next().expect("three")));
            missing += without;
        }
        let [points, turns, distances] = sum;
        println!(
            "{size_px:5} {target_um:5.0} um {:4} {rigs:4} | {} | {} | {} | {missing}",
            samples + 4,
            points.show(1e3),
            turns.show(1e6),
            distances.show(1e3)
        );
    }
}
