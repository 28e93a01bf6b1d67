//! 40 pairs of 26 Mpx: the program beside decoding alone, its memory, and what a pair costs as the run grows.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use rayon::prelude::*;
use stereocal::files::OutDir;
use stereocal::imaging::image;
use stereocal::simulate::settings::Settings;
use stereocal::simulate::truth_files;
use stereocal::simulate::world::World;

/// Robot poses besides the four centres.
const SAMPLES: usize = 36;

/// Each is run this often, the fastest counts.
const RUNS: usize = 7;

/// Pairs of the longest run: links to the same pictures would be the same poses, so it repeats the corners instead.
const LONG: usize = 1000;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("measure-26-mpx")
}

/// Renders the pictures unless a former run left them.
fn pictures() -> PathBuf {
    let folder = folder();
    if !folder.join("done").is_file() {
        let settings = Settings { check_pairs: 8, samples: SAMPLES, verify: 0, ..Settings::paper() };
        let world = World::new(settings, None).expect("the preset is possible");
        let out = OutDir::open(camino::Utf8Path::from_path(&folder).unwrap()).expect("a folder");
        truth_files::write(&world, &out).expect("the truth");
        world.write_pictures(&out).expect("the pictures");
        run(&folder, &["camera-check", "check", "--out", "rig"]);
        std::fs::write(folder.join("done"), b"").expect("a file");
    }
    folder
}

/// Runs the program; wall time in seconds and the largest memory in MB.
pub fn run(folder: &Path, args: &[&str]) -> (f64, f64) {
    let start = Instant::now();
    let wall_s = std::sync::OnceLock::new();
    let mut child = Command::new(env!("CARGO_BIN_EXE_stereocal"))
        .args(args)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program");
    let status = PathBuf::from(format!("/proc/{}/status", child.id()));
    let mut peak_kb: f64 = 0.0;
    std::thread::scope(|scope| {
        // Its end is waited for, not looked for from time to time.
        scope.spawn(|| {
            child.wait().expect("a child");
            wall_s.set(start.elapsed().as_secs_f64()).expect("one end");
        });
        while wall_s.get().is_none() {
            if let Ok(text) = std::fs::read_to_string(&status) {
                let line = text.lines().find(|line| line.starts_with("VmHWM"));
                let kb = line.and_then(|line| line.split_whitespace().nth(1)).and_then(|kb| kb.parse().ok());
                peak_kb = peak_kb.max(kb.unwrap_or(0.0));
            }
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
    });
    (*wall_s.get().expect("an end"), peak_kb / 1024.0)
}

/// Reads every picture and hands its bytes to a decoder, with the program's threads, and does nothing with what it
/// gives.
fn decode_s(folder: &Path, decode: impl Fn(&[u8], &camino::Utf8Path) + Sync) -> f64 {
    let paths: Vec<camino::Utf8PathBuf> = ["left", "right"]
        .iter()
        .flat_map(|side| std::fs::read_dir(folder.join("poses").join(side)).expect("pictures"))
        .map(|entry| camino::Utf8PathBuf::from_path_buf(entry.expect("an entry").path()).expect("a name"))
        .collect();
    let start = Instant::now();
    paths.par_iter().for_each(|path| decode(&std::fs::read(path).expect("a picture"), path));
    start.elapsed().as_secs_f64()
}

fn run_speed() {
    let folder = pictures();
    let pairs = (SAMPLES + 4) as f64;
    let program = |bytes: &[u8], path: &camino::Utf8Path| drop(image::decode(bytes, path, None).expect("a picture"));
    let bare = |bytes: &[u8], _: &camino::Utf8Path| drop(::image::load_from_memory(bytes).expect("a picture"));
    let (mut decoding, mut without_checks, mut wall) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    let mut memory: f64 = 0.0;
    // Kept to the end: a file system is slow to make files where many were deleted just before.
    let mut results = Vec::new();
    // In turn, so that what else the machine does meets all of them.
    for _ in 0..RUNS {
        decoding = decoding.min(decode_s(&folder, program));
        without_checks = without_checks.min(decode_s(&folder, bare));
        let fresh = tempfile::tempdir().expect("a folder");
        let out = fresh.path().to_str().unwrap();
        let (s, mb) = self::run(&folder, &["measure", "poses", "--calibration", "rig/calibration.json", "--out", out]);
        wall = wall.min(s);
        memory = memory.max(mb);
        results.push(fresh);
    }
    println!(
        "\n{pairs} pairs of 26 Mpx: measure {:.3} s a pair, decoding alone {:.3}, ratio {:.2} (without the checks of the file {:.3}, ratio {:.2}); memory {memory:.0} MB",
        wall / pairs,
        decoding / pairs,
        wall / decoding,
        without_checks / pairs,
        wall / without_checks
    );
    for python in [concat!(env!("CARGO_MANIFEST_DIR"), "/target/peers/venv/bin/python"), "python3"] {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/bench_measure.py");
        let ran = ["sb", "classic"].map(|way| {
            Command::new(python).args([script, "poses", "rig/calibration.json", way, "6"]).current_dir(&folder).output()
        });
        if ran.iter().all(|out| out.as_ref().is_ok_and(|o| o.status.success())) {
            for out in ran.iter().flatten() {
                print!("plain OpenCV script, {}", String::from_utf8_lossy(&out.stdout));
            }
            return;
        }
    }
    println!("no python with cv2: scripts/peers installs one");
}

/// What a pair costs beyond its pictures as the run grows: the solver alone, from corners.
fn growth() {
    for samples in [36, 146, LONG - 4] {
        let world = crate::worlds::world(1280, 10.0, samples, 7);
        let (known, seen) = (crate::worlds::knowledge(&world), crate::worlds::run(&world));
        let count = seen.len() as f64;
        let start = Instant::now();
        let series = stereocal::stereo::board_pose::series::measure(&known, seen);
        let ok = series.poses.iter().filter(|p| p.target.is_ok()).count();
        println!(
            "solver, {count:5} pairs: {:.2} ms a pair, {ok} measured",
            1e3 * start.elapsed().as_secs_f64() / count
        );
    }
}

pub fn run_all() {
    growth();
    run_speed();
}
