//! Fuzzing of every reader on stable Rust: files made by the program's own writers, mutated by a seeded stream, read in
//! this process. A run that panics, takes longer than [`MOST_TIME`] or lets the process grow beyond [`MOST_BYTES`] is a
//! failure; its input is kept.

pub mod corpus;
pub mod mutate;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use camino::{Utf8Path, Utf8PathBuf};
use image::ImageFormat;
use stereocal::config::Config;
use stereocal::formats::calibration;
use stereocal::imaging::Board;
use stereocal::imaging::image as pictures;
use stereocal::imaging::input::corners_csv;
use stereocal::{measurements, robot};

use corpus::{Files, Written};
use mutate::Mutator;

/// The longest that reading a file of some kilobytes may take.
pub const MOST_TIME: Duration = Duration::from_secs(2);

/// The most memory that the process may ever hold.
pub const MOST_BYTES: u64 = 500 << 20;

/// A reader and what it is fed with.
pub struct Target {
    /// Its name on the command line.
    pub name: &'static str,
    corpus: Files,
    /// The file's name, where the reader looks at it.
    file: &'static str,
    read: fn(&Utf8Path),
}

/// All readers.
pub fn targets(folder: &Utf8Path) -> Vec<Target> {
    let written = Written::new(folder);
    let calibration: fn(&Utf8Path) = |path| drop(calibration::read(path));
    let picture: fn(&Utf8Path) = |path| drop(std::fs::read(path).map(|bytes| pictures::decode(&bytes, path, None)));
    let target = |name, file, corpus, read| Target { name, corpus, file, read };
    vec![
        target("poses", "poses.csv", written.named("poses.csv"), |path| drop(measurements::read_poses(path))),
        target("measurements", "measurements.csv", written.named("measurements.csv"), |path| {
            drop(measurements::read(path))
        }),
        target("corners", "corners.csv", written.named("corners.csv"), |path| {
            let board = Board::checker("20x20".parse().expect("a board"), 10.0);
            drop(corners_csv::read(path, board, None));
        }),
        target("robot", "robot.toml", written.named("robot.toml"), |path| drop(robot::file::read(path))),
        target("calibration", "calibration.json", written.named("calibration.json"), calibration),
        target("opencv", "stereo_opencv.yml", corpus::exported("opencv"), calibration),
        target("ros", "left.yaml", corpus::exported("ros"), calibration),
        target("kalibr", "camchain.yaml", corpus::exported("kalibr"), calibration),
        target("mrcal", "left.cameramodel", corpus::exported("mrcal"), calibration),
        target("settings", "stereocal.toml", corpus::settings(), |path| drop(Config::load(Some(path)))),
        target("png", "a.png", corpus::pictures(ImageFormat::Png), picture),
        target("tiff", "a.tiff", corpus::pictures(ImageFormat::Tiff), picture),
        target("bmp", "a.bmp", corpus::pictures(ImageFormat::Bmp), picture),
        target("jpeg", "a.jpg", corpus::pictures(ImageFormat::Jpeg), picture),
        target("pgm", "a.pgm", corpus::pictures(ImageFormat::Pnm), picture),
    ]
}

/// What a number of runs of a target came to.
pub struct Outcome {
    /// The longest run.
    pub longest: Duration,
    /// The most memory that the process held so far, bytes.
    pub most_bytes: u64,
    /// What failed, and the file that made it fail.
    pub failures: Vec<(String, Utf8PathBuf)>,
}

impl Target {
    /// Feeds the reader `runs` mutated files; what fails is kept in `folder`.
    pub fn run(&self, runs: usize, seed: u64, folder: &Utf8Path) -> Outcome {
        let name_hash = self.name.bytes().fold(0u64, |hash, b| hash.wrapping_mul(31).wrapping_add(u64::from(b)));
        let mut mutator = Mutator::new(seed ^ name_hash);
        let place = folder.join(self.name);
        std::fs::create_dir_all(&place).expect("a folder");
        let path = place.join(self.file);
        // The right camera's file stands beside the left one's.
        if let Some(right) = self.corpus.get(1).filter(|_| self.file.starts_with("left")) {
            std::fs::write(place.join(self.file.replacen("left", "right", 1)), right).expect("written");
        }
        for whole in &self.corpus {
            std::fs::write(&path, whole).expect("written");
            (self.read)(&path);
        }
        let mut outcome = Outcome { longest: Duration::ZERO, most_bytes: peak_bytes(), failures: Vec::new() };
        for run in 0..runs {
            let bytes = mutator.next(&self.corpus);
            std::fs::write(&path, &bytes).expect("written");
            let start = Instant::now();
            let ended = catch_unwind(AssertUnwindSafe(|| (self.read)(&path)));
            let time = start.elapsed();
            outcome.longest = outcome.longest.max(time);
            let before = outcome.most_bytes;
            outcome.most_bytes = peak_bytes().max(before);
            let failure = match ended {
                Err(_) => Some("panic".to_owned()),
                Ok(()) if time > MOST_TIME => Some(format!("{:.1} s", time.as_secs_f64())),
                Ok(()) if outcome.most_bytes > MOST_BYTES && outcome.most_bytes > before => {
                    Some(format!("{} MB", outcome.most_bytes >> 20))
                }
                Ok(()) => None,
            };
            if let Some(failure) = failure {
                let kept = place.join(format!("{run}-{}", self.file));
                std::fs::write(&kept, &bytes).expect("written");
                outcome.failures.push((failure, kept));
            }
        }
        outcome
    }
}

/// The most memory that this process has ever held, bytes; 0 where the system does not say.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|rest| rest.trim().trim_end_matches("kB").trim().parse::<u64>().ok()).unwrap_or(0) << 10
}
