//! The real sets by the commands themselves, defaults throughout.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

/// Folder, measurements, further arguments, what is asked of mean and max (mm).
const SETS: [(&str, &str, &[&str], &str); 6] = [
    ("irb120-tracker-a", "measurements.csv", &[], "distances <= 0.055 / 0.20"),
    ("ur5-tracker", "measurements.csv", &[], "points <= 0.088"),
    ("motoman-right", "measurements.csv", &[], "distances <= 0.036 / 0.11"),
    ("motoman-right", "measurements-stereo.csv", &[], "against the tracker <= 0.16 (nominal 0.209)"),
    ("robotcali-120", "measurements.csv", &[], "distances <= 0.20"),
    ("panda-touch", "measurements.csv", &["--known-distances", "known-distances.csv"], "consistency <= 0.70"),
];

/// One line a set.
pub fn table() {
    let root = std::env::var_os("STEREOCAL_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    println!("verification errors of real robots, mean / max, mm");
    for (folder, file, more, wanted) in SETS {
        let data = root.join("data/robot").join(folder);
        if !data.is_dir() {
            println!("skipped: no {}", data.display());
            continue;
        }
        let out = tempfile::tempdir().expect("a folder");
        let start = Instant::now();
        let mut arguments = vec!["identify".to_owned(), "--json".to_owned(), "--out".to_owned()];
        arguments.push(out.path().display().to_string());
        for (flag, name) in [("--measurements", file), ("--robot", "robot.toml")] {
            arguments.extend([flag.to_owned(), data.join(name).display().to_string()]);
        }
        for pair in more.chunks(2) {
            arguments.extend([pair[0].to_owned(), data.join(pair[1]).display().to_string()]);
        }
        let record = run(&arguments);
        let seconds = start.elapsed().as_secs_f64();
        let chosen = record["chosen"].as_str().unwrap_or("").to_owned();
        let of_chosen =
            record["methods"].as_array().into_iter().flatten().find(|m| {
                chosen == format!("{}/{}", m["name"].as_str().unwrap_or(""), m["model"].as_str().unwrap_or(""))
            });
        println!("{folder} {file}: {wanted}");
        println!("  {chosen}, {}, {seconds:.1} s", record["terms"].as_str().unwrap_or(""));
        println!("  before {}", figures(&record["before"]["verify"]));
        println!("  after  {}", figures(&of_chosen.map_or(Value::Null, |m| m["verify"].clone())));
        if file != "measurements.csv" {
            let mut arguments = vec!["verify".to_owned(), "--json".to_owned()];
            for (flag, path) in [
                ("--measurements", data.join("measurements.csv")),
                ("--robot", data.join("robot.toml")),
                ("--robot", out.path().join("identified.toml")),
            ] {
                arguments.extend([flag.to_owned(), path.display().to_string()]);
            }
            for robot in run(&arguments)["robots"].as_array().into_iter().flatten() {
                println!("  against measurements.csv: {}", figures(&robot["verify"]));
            }
        }
    }
}

fn figures(verify: &Value) -> String {
    let of = |name: &str, value: &Value| match (value["mean_abs_mm"].as_f64(), value["max_abs_mm"].as_f64()) {
        (Some(mean), Some(max)) => format!("{name} {mean:.4} / {max:.4}  "),
        _ => String::new(),
    };
    let parts = ["point", "consistency", "distortion"].map(|name| of(name, &verify[name]));
    format!("{}{}", of("distance", verify), parts.concat())
}

fn run(arguments: &[String]) -> Value {
    let output = Command::new(env!("CARGO_BIN_EXE_stereocal")).args(arguments).output().expect("it runs");
    // A robot that is to be checked before use ends with 1.
    assert!(
        output.status.code().is_some_and(|code| code <= 1),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    serde_json::from_slice(&output.stdout).expect("stdout is JSON")
}
