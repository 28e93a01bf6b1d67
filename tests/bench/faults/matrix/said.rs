//! Runs the command as a user does, and reads what it wrote and said.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use stereocal::imaging::Board;

use super::set::Set;

/// What a run of `camera-check` came to.
#[derive(Debug, Clone)]
pub struct Said {
    /// `pass`, `fail`, `undecided`, or `status N` of a run without a verdict.
    pub verdict: String,
    /// Largest held-out error that it gives, mm.
    pub claimed_mm: Option<f64>,
    /// Warnings, skipped pairs, lines of evidence that forbid a pass, or the message of a run that ended early.
    pub words: Vec<String>,
    /// `calibration.json`, where it was written.
    pub calibration: Option<Value>,
    /// `camera-check.json`, of a run that came to a verdict.
    pub check: Option<Value>,
}

/// Runs `camera-check` on a set's folder.
pub fn camera_check(program: &Path, folder: &Path, set: &Set) -> Said {
    let mut command = Command::new(program);
    command.current_dir(folder).args(["camera-check", "check", "--out", "out"]);
    command.args(["--squares", &set.typed.squares.to_string(), "--square-mm", &set.typed.square_mm.to_string()]);
    if let Some(second) = &set.second {
        command.args(["--check-images", "second", "--check-squares", &second.typed.squares.to_string()]);
        command.args(["--check-square-mm", &second.typed.square_mm.to_string()]);
    }
    read(command.args(&set.arguments), folder)
}

/// Runs `camera-check` on the corners in `corners.csv` of a folder.
pub fn camera_check_of_corners(program: &Path, folder: &Path, typed: &Board, tolerance_mm: f64) -> Said {
    let mut command = Command::new(program);
    command.current_dir(folder).args(["camera-check", "--corners", "corners.csv", "--out", "out"]);
    command.args(["--squares", &typed.squares.to_string(), "--square-mm", &typed.square_mm.to_string()]);
    read(command.args(["--tolerance-mm", &tolerance_mm.to_string()]), folder)
}

fn read(command: &mut Command, folder: &Path) -> Said {
    let output = command.output().expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let read = |name: &str| -> Option<Value> {
        serde_json::from_str(&std::fs::read_to_string(folder.join("out").join(name)).ok()?).ok()
    };
    let status = output.status.code();
    let check = read("camera-check.json").filter(|_| matches!(status, Some(0 | 1)));
    let mut words = Vec::new();
    match &check {
        Some(check) => words.extend(words_of(check)),
        None => words.extend(stderr.lines().filter(|line| !line.trim().is_empty()).map(str::to_owned)),
    }
    let ended = status.map_or("killed".to_owned(), |code| format!("status {code}"));
    Said {
        verdict: check.as_ref().and_then(|c| c["verdict"].as_str()).map_or(ended, str::to_owned),
        claimed_mm: check.as_ref().and_then(|c| c["max_abs_error_mm"].as_f64()),
        words,
        calibration: read("calibration.json").filter(|_| matches!(status, Some(0 | 1))),
        check,
    }
}

fn words_of(check: &Value) -> Vec<String> {
    let list = |name: &str| check[name].as_array().cloned().unwrap_or_default();
    let warnings = list("warnings").into_iter().filter_map(|w| w.as_str().map(str::to_owned));
    let skipped = list("pairs_skipped")
        .into_iter()
        .map(|s| format!("{}: {}", s["pair"].as_str().unwrap_or("?"), s["reason"].as_str().unwrap_or("?")));
    let evidence = list("evidence").into_iter().filter(|line| line["allows"] != "pass").map(|line| {
        format!(
            "[{}] {}: {}",
            line["allows"].as_str().unwrap_or("?"),
            line["what"].as_str().unwrap_or("?"),
            line["detail"].as_str().unwrap_or("")
        )
    });
    warnings.chain(skipped).chain(evidence).collect()
}
