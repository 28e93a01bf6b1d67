//! Simulated worlds as files: the same bytes for any number of threads, and what each command's reader makes of them.
#![allow(clippy::unwrap_used, reason = "a test ends where its world is not as it should be")]

use camino::Utf8Path;
use stereocal::files::OutDir;
use stereocal::formats::calibration;
use stereocal::imaging::input::corners_csv;
use stereocal::measurements::{self, Observed, Role};
use stereocal::simulate::settings::Settings;
use stereocal::simulate::truth_files;
use stereocal::simulate::world::World;

use crate::run::{Files, files_below};

fn tiny() -> Settings {
    Settings { size_px: 320, check_pairs: 2, samples: 4, verify: 4, ..Settings::small() }
}

fn written(settings: Settings, threads: usize) -> (tempfile::TempDir, Files) {
    let folder = tempfile::tempdir().unwrap();
    let path = Utf8Path::from_path(folder.path()).unwrap().to_owned();
    let world = World::new(settings, None).unwrap();
    let out = OutDir::open(&path).unwrap();
    truth_files::write(&world, &out).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| world.write_pictures(&out)).unwrap();
    // The list of what was written is in order once the folder is closed.
    drop(out);
    let files = files_below(path.as_std_path());
    (folder, files)
}

#[test]
fn one_thread_and_three_write_the_same_bytes() {
    let (_one, first) = written(tiny(), 1);
    let (_three, second) = written(tiny(), 3);
    // Seven tables and settings, the list of what was written, and the lock.
    assert_eq!(first.len(), 2 * (2 + 12) + 7 + 2);
    for ((name, a), (other, b)) in first.iter().zip(&second) {
        assert!(name == other && a == b, "{name}");
    }
    let (_other_seed, third) = written(Settings { seed: 2, ..tiny() }, 2);
    assert_ne!(first, third);
}

#[test]
fn pictures_of_another_world_are_not_mixed_with_this_one() {
    let folder = tempfile::tempdir().unwrap();
    let out = OutDir::open(Utf8Path::from_path(folder.path()).unwrap()).unwrap();
    let world = World::new(tiny(), None).unwrap();
    out.write("check/left/01.png", b"").unwrap();
    world.check_unoccupied(&out).unwrap();
    out.write("check/left/17.png", b"").unwrap();
    let message = world.check_unoccupied(&out).unwrap_err().to_string();
    assert!(message.contains("17.png"), "{message}");
}

#[test]
fn the_truth_reads_back() {
    let (folder, _) = written(tiny(), 2);
    let at = |name: &str| Utf8Path::from_path(folder.path()).unwrap().join(name);
    let world = World::new(tiny(), None).unwrap();
    let corners = corners_csv::read(&at("truth/corners.csv"), world.check_board.drawing, Some((320, 320))).unwrap();
    assert_eq!(corners.pairs, world.check_corners().pairs);
    let rig = calibration::read(&at("truth/calibration.json")).unwrap().rig;
    assert_eq!((rig.left, rig.right), (world.rig.left, world.rig.right));
    let poses = measurements::read_poses(&at("poses/poses.csv")).unwrap();
    let rows = measurements::read(&at("truth/measurements.csv")).unwrap();
    assert_eq!(rows.iter().map(|r| r.at.clone()).collect::<Vec<_>>(), poses);
    assert_eq!(poses.iter().filter(|p| p.role == Role::Center).count(), 4);
    for pose in &poses {
        for side in ["left", "right"] {
            assert!(at(&format!("poses/{side}/{}.png", pose.pose)).is_file());
        }
    }
    let (nominal, truth) = ("robot.toml", "truth/robot.toml");
    let read = |name| stereocal::robot::file::read(&at(name)).unwrap();
    assert_eq!(read(nominal).joints.len(), read(truth).joints.len());
    assert_ne!(read(nominal), read(truth));
}

#[test]
fn points_only_scatter_as_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = Utf8Path::from_path(folder.path()).unwrap();
    let settings = Settings { point_noise_mm: 0.05, ..Settings::paper() };
    let world = World::new(settings, None).unwrap();
    truth_files::write_points_only(&world, &OutDir::open(path).unwrap()).unwrap();
    let rows = measurements::read(&path.join("measurements.csv")).unwrap();
    let mut sum = 0.0;
    for (row, pose) in rows.iter().zip(&world.poses) {
        let Observed::Position { point_mm, covariance_mm2: Some(covariance), .. } = &row.observed else {
            panic!("{row:?} has no position");
        };
        assert!((covariance[(0, 0)] - 0.0025).abs() < 1e-12);
        sum += (point_mm - World::mark_point(pose).0).norm_squared();
    }
    let sigma = (sum / (3 * rows.len()) as f64).sqrt();
    // 948 draws give their standard deviation to 2.3 %; four times that.
    assert!((sigma / 0.05 - 1.0).abs() < 0.1, "{sigma}");
    assert!(!path.join("check").exists());
}
