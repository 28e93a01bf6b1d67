//! Real pictures and real robots, where this machine has them; figures that others reach stand beside the limits.

use serde_json::Value;

use crate::run::{shared, stderr, stdout, stereocal, workplace};

fn json(folder: &std::path::Path, name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder.join("out").join(name)).unwrap()).unwrap()
}

/// `camera-check` on a set of pictures: its report, the baseline in mm, and the exit status.
fn camera_check(set: &str, squares: &str, square_mm: &str) -> Option<(Value, f64, i32)> {
    let images = shared(&format!("stereo/{set}"))?;
    let folder = workplace();
    let images = images.to_str().unwrap();
    let output = stereocal(folder.path(), &["camera-check", images, "--squares", squares, "--square-mm", square_mm]);
    let status = output.status.code().unwrap();
    assert!(status <= 1, "{}{}", stdout(&output), stderr(&output));
    let calibration = json(folder.path(), "calibration.json");
    let t = calibration["right_from_left"]["translation_mm"].as_array().unwrap();
    let baseline = t.iter().map(|v| v.as_f64().unwrap().powi(2)).sum::<f64>().sqrt();
    Some((json(folder.path(), "camera-check.json"), baseline, status))
}

fn pairs_used(check: &Value) -> u64 {
    check["pairs_used"].as_u64().unwrap_or_else(|| check["pairs_used"].as_array().map_or(0, |list| list.len() as u64))
}

#[test]
fn opencv_samples() {
    // OpenCV itself: 0.195 px, 83.17 mm.
    let Some((check, baseline, _)) = camera_check("opencv_samples", "10x7", "25") else { return };
    assert_eq!(pairs_used(&check), 13);
    assert!(check["reprojection_rms_px"].as_f64().unwrap() <= 0.22);
    assert!((baseline - 83.2).abs() <= 0.5, "{baseline}");
}

#[test]
fn a_board_that_looks_the_same_after_half_a_turn() {
    // BoofCV's own calibration: 120.04 mm; OpenCV 0.084 px. OpenCV's detector turns 6 of the 11 pairs.
    let Some((check, baseline, _)) = camera_check("boofcv_bumblebee2", "5x7", "30") else { return };
    assert_eq!(pairs_used(&check), 11);
    assert!(check["reprojection_rms_px"].as_f64().unwrap() <= 0.10);
    assert!((baseline - 120.1).abs() <= 0.4, "{baseline}");
}

#[test]
fn a_board_that_is_not_as_wide_as_said_is_named() {
    // With the ratio of width and height free, a bundle leaves two thirds of the residuals and finds square pixels in
    // both cameras (fx / fy 1.000); with the stated squares .990.
    let Some((check, _, _)) = camera_check("public/zhou2", "11x7", "25") else { return };
    let findings = check["findings"].as_array().unwrap();
    let [board] = findings.as_slice() else { panic!("{findings:?}") };
    assert!(board["action"].as_str().unwrap().contains("times as wide as high"), "{board}");
    // With the board's bow free, as here, 1.05 %; flat 1.13 %.
    assert!((board["size"].as_f64().unwrap() + 1.1).abs() < 0.15, "{board}");
}

#[test]
fn boards_that_a_quick_look_misses() {
    let Some((check, _, _)) = camera_check("aliyasineser", "10x7", "25") else { return };
    assert!(pairs_used(&check) >= 29);
}

#[test]
fn cameras_that_did_not_fire_together_are_refused() {
    let Some(images) = shared("stereo/baka") else { return };
    let folder = workplace();
    let images = images.to_str().unwrap();
    let output = stereocal(folder.path(), &["camera-check", images, "--squares", "8x11", "--square-mm", "23"]);
    let said = stderr(&output);
    assert!(matches!(output.status.code(), Some(1 | 3)), "{said}");
    assert!(said.contains("0017728") || stdout(&output).contains("in pair 0017728"), "{said}");
}

#[test]
fn a_robot_measured_by_a_laser_tracker() {
    let Some(robot) = shared("robot/irb120-tracker-a") else { return };
    let folder = workplace();
    let path = |name: &str| robot.join(name).to_str().unwrap().to_owned();
    let output = stereocal(
        folder.path(),
        &[
            "identify",
            "--method",
            "trust-region",
            "--measurements",
            &path("measurements.csv"),
            "--robot",
            &path("robot.toml"),
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let found = json(folder.path(), "identification.json");
    let before = found["before"]["verify"]["mean_abs_mm"].as_f64().unwrap();
    let chosen = found["chosen"].as_str().unwrap();
    let after = found["methods"]
        .as_array()
        .unwrap()
        .iter()
        .find(|m| format!("{}/{}", m["name"].as_str().unwrap(), m["model"].as_str().unwrap()) == chosen)
        .and_then(|m| m["verify"]["mean_abs_mm"].as_f64())
        .unwrap();
    assert!(after <= before / 3.0, "before {before} mm, after {after} mm");
}
