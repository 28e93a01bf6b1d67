//! `rectify`: rows of rectified pairs, depth, colour and names kept, pictures of another size refused.

use std::path::Path;
use std::sync::LazyLock;

use image::{DynamicImage, GenericImageView};
use serde_json::Value;

use crate::run::{Files, files_below, stderr, stdout, stereocal, with_files, workplace};

/// The project's acceptance: rows of corresponding corners over the simulated board pairs, px RMS.
const ROWS_PX: f64 = 0.05;

/// Squares of the simulated board, 20 x 20, have this many corners.
const CORNERS: u64 = 19 * 19;

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = stereocal(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output)
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer}"))
}

/// A world of six pairs and its calibration, which is the truth; the first pair also stands alone in `one`.
fn world() -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| {
        let folder = workplace();
        let few = ["--check-pairs", "6", "--samples", "0", "--verify", "0"];
        done(folder.path(), &[&["simulate", "--preset", "small", "--out", "."], &few[..]].concat());
        for side in ["left", "right"] {
            let name = format!("{side}/{}", first(folder.path()));
            std::fs::create_dir_all(folder.path().join("one").join(side)).unwrap();
            std::fs::copy(folder.path().join("check").join(&name), folder.path().join("one").join(&name)).unwrap();
        }
        files_below(folder.path())
    });
    with_files(&MADE)
}

const TRUTH: [&str; 2] = ["--calibration", "truth/calibration.json"];

fn rectify(folder: &Path, more: &[&str]) -> std::process::Output {
    stereocal(folder, &[&["rectify", "check"], &TRUTH[..], more].concat())
}

#[test]
fn corresponding_corners_stand_on_one_row() {
    let folder = world();
    done(folder.path(), &[&["rectify", "check"], &TRUTH[..]].concat());
    let file = json(&folder.path().join("out/rectified.json"));
    let pairs = file["pairs"].as_array().unwrap();
    assert_eq!(pairs.len(), 6);
    // Nearly every corner of every board is still in view.
    let corners = number(&file, "/residual/corners");
    assert!(corners > 0.98 * (6 * CORNERS) as f64, "{corners}");
    let rms = number(&file, "/residual/rms_px");
    assert!(rms < ROWS_PX, "{rms}");
    let row = |key: &str, i: usize| file[key][i].as_array().unwrap().len();
    assert_eq!((row("P1", 0), row("P2", 2), row("Q", 3), row("R1", 0)), (4, 4, 4, 3));
    for pair in pairs {
        for side in ["left", "right"] {
            assert!(folder.path().join("out").join(pair[side].as_str().unwrap()).is_file());
        }
    }
    let page = std::fs::read_to_string(folder.path().join("out/rectify.html")).unwrap();
    assert!(page.contains("Epipolar lines") && page.contains("data:image/jpeg;base64,"));

    // A rig that is not the pictures' own: its right camera is turned by 0.1 degrees about its x axis.
    let truth = folder.path().join("truth/calibration.json");
    let mut turned = json(&truth);
    let (sin, cos) = 0.1_f64.to_radians().sin_cos();
    let r = |i: usize, j: usize| number(&turned, &format!("/right_from_left/rotation/{i}/{j}"));
    let rotation: Vec<Vec<f64>> = (0..3)
        .map(|i| {
            let of = |j| match i {
                0 => r(0, j),
                1 => cos * r(1, j) - sin * r(2, j),
                _ => sin * r(1, j) + cos * r(2, j),
            };
            (0..3).map(of).collect()
        })
        .collect();
    turned["right_from_left"]["rotation"] = rotation.into();
    turned.as_object_mut().unwrap().remove("covariance");
    std::fs::write(folder.path().join("turned.json"), turned.to_string()).unwrap();
    let turned = ["rectify", "one", "--calibration", "turned.json", "--out", "turned"];
    let turned = stereocal(folder.path(), &turned);
    assert_eq!(turned.status.code(), Some(1), "{}", stderr(&turned));
    assert!(stderr(&turned).contains("too much for dense stereo"), "{}", stderr(&turned));
    let page = |out: &str| std::fs::read_to_string(folder.path().join(out).join("rectify.html")).unwrap();
    assert!(page("turned").contains("<div class=\"verdict bad\"><strong>The rows do not agree"));
    // The true rig, with and without a check that it did not pass.
    let mut doubted: Value = json(&folder.path().join("truth/calibration.json"));
    doubted["check"] = serde_json::json!({"verdict": "undecided", "tolerance_mm": 0.05, "trusted_mm": 0.2});
    std::fs::write(folder.path().join("doubted.json"), doubted.to_string()).unwrap();
    done(folder.path(), &["rectify", "one", "--calibration", "doubted.json", "--out", "doubted"]);
    assert!(page("doubted").contains("<div class=\"verdict doubtful\"><strong>Rectified by a doubtful rig"));
    doubted["check"].as_object_mut().unwrap().remove("trusted_mm");
    std::fs::write(folder.path().join("doubted.json"), doubted.to_string()).unwrap();
    let untrusted =
        stereocal(folder.path(), &["export", "calibration", "--format", "ros", "--calibration", "doubted.json"]);
    assert!(
        untrusted.status.code() == Some(0)
            && stderr(&untrusted).contains("to what its lengths can be trusted is not known")
    );
    // What is out of tolerance, whatever the uncertainty, makes nothing that states no uncertainty without a word in
    // the status.
    doubted["check"]["verdict"] = "fail".into();
    std::fs::write(folder.path().join("failed.json"), doubted.to_string()).unwrap();
    for made in [&["rectify", "one"][..], &["export", "calibration", "--format", "ros"]] {
        let made = stereocal(folder.path(), &[made, &["--calibration", "failed.json", "--out", "failed"]].concat());
        assert_eq!(made.status.code(), Some(1), "{}", stderr(&made));
        assert!(stderr(&made).contains("did not pass its check (FAIL"), "{}", stderr(&made));
    }
    assert!(page("out").contains("<div class=\"verdict good\"><strong>Rectified<"));
    let rms = number(&json(&folder.path().join("turned/rectified.json")), "/residual/rms_px");
    assert!(rms > 20.0 * ROWS_PX, "{rms}");
}

#[test]
fn the_board_is_the_one_that_the_pictures_show_and_its_size_tells_disparities_that_are_off() {
    let folder = world();
    let at = |name: &str| folder.path().join(name);
    // The settings know other boards than that of the pictures, and of the files one knows it.
    let settings = "[check_board]\nsquares = \"9x7\"\nsquare_mm = 25.0\n";
    std::fs::write(at("other.toml"), settings).unwrap();
    let rectified = |rig: &Value, pictures: &str| {
        std::fs::write(at("rig.json"), rig.to_string()).unwrap();
        let given = ["--calibration", "rig.json", "--config", "other.toml", "--out", "known", "--force"];
        stereocal(folder.path(), &[&["rectify", pictures], &given[..]].concat())
    };
    let mut rig = json(&at("truth/calibration.json"));
    for (board, is_another) in [(None, true), (Some("checker:11x8:25"), true), (Some("checker:20x20:10"), false)] {
        if let Some(board) = board {
            rig["board"] = board.into();
        }
        let done = rectified(&rig, "one");
        assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
        assert!(stdout(&done).contains("corners of the 20x20 board"), "{board:?}: {}", stdout(&done));
        assert_eq!(stderr(&done).contains("those of one of 20x20 squares"), is_another, "{board:?}: {}", stderr(&done));
        let size = &json(&at("known/rectified.json"))["size"];
        assert_eq!(size.is_null(), is_another, "{board:?}: {size}");
    }
    let is_off = |rig: &Value| {
        let done = rectified(rig, "one");
        let said = stderr(&done).contains("the disparities are off by");
        assert!(!said || done.status.code() == Some(1), "{}", stderr(&done));
        said
    };
    // The right picture moved along its rows, by what lengths show and by what they leave open.
    rig["right"]["cx"] = (number(&rig, "/right/cx") + 4.0).into();
    rig.as_object_mut().unwrap().remove("covariance");
    let check =
        |trusted_mm: f64| serde_json::json!({"verdict": "pass", "tolerance_mm": 0.05, "trusted_mm": trusted_mm});
    rig["check"] = check(0.02);
    assert!(is_off(&rig));
    let page = std::fs::read_to_string(at("known/rectify.html")).unwrap();
    assert!(page.contains("The disparities are off") || page.contains("The rows do not agree"));
    let off_px = number(&json(&at("known/rectified.json")), "/size/disparity_px");
    assert!((2.0..8.0).contains(&off_px.abs()), "{off_px}");
    rig["check"] = check(100.0);
    assert!(!is_off(&rig));

    // Nothing is seen: what was looked for is said.
    for side in ["left", "right"] {
        std::fs::create_dir_all(at("blank").join(side)).unwrap();
        let file = at("check").join(side).join(first(folder.path()));
        let raw = image::open(file).unwrap();
        image::GrayImage::from_pixel(raw.width(), raw.height(), image::Luma([90]))
            .save(at("blank").join(side).join("1.png"))
            .unwrap();
    }
    let blank = stdout(&rectified(&rig, "blank"));
    assert!(
        blank.contains("no board was seen in the rectified pictures (looked for: 20x20, 9x7, 7x6 squares)"),
        "{blank}"
    );
}

#[test]
fn depth_colour_and_names_stay_and_other_sizes_are_refused() {
    let folder = world();
    let path = folder.path();
    let raw = image::open(path.join("check/left").join(first(path))).unwrap();
    let sixteen = DynamicImage::ImageLuma16(raw.to_luma16());
    let colour = DynamicImage::ImageRgb8(image::RgbImage::from_fn(raw.width(), raw.height(), |x, y| {
        let grey = raw.get_pixel(x, y)[0];
        image::Rgb([grey, grey / 2, 255 - grey])
    }));
    for (name, picture) in [("mixed/left01.png", &sixteen), ("mixed/right01.png", &colour)] {
        std::fs::create_dir_all(path.join("mixed")).unwrap();
        picture.save(path.join(name)).unwrap();
    }
    for (more, out) in [(&["--undistort-only"][..], "straight"), (&["--alpha", "1"], "turned")] {
        // One picture for both sides: its rows do not agree, which is said where rows are common.
        let mixed = stereocal(path, &[&["rectify", "mixed", "--out", out], &TRUTH[..], more].concat());
        assert_eq!(mixed.status.code(), Some(i32::from(out == "turned")), "{}", stderr(&mixed));
        let left = image::open(path.join(out).join("rectified/left/left01.png")).unwrap();
        let right = image::open(path.join(out).join("rectified/right/right01.png")).unwrap();
        assert_eq!(left.color(), image::ColorType::L16);
        assert_eq!(right.color(), image::ColorType::Rgb8);
        assert_eq!(left.dimensions(), raw.dimensions());
        // Each colour went through the same map: blue stays what red was turned into.
        let middle = right.get_pixel(raw.width() / 2, raw.height() / 2);
        assert!((i32::from(middle[0]) + i32::from(middle[2]) - 255).abs() <= 2, "{middle:?}");
    }
    let straight = json(&path.join("straight/rectified.json"));
    assert_eq!((&straight["mode"], &straight["residual"]), (&"undistort".into(), &Value::Null));
    assert!(straight.get("Q").is_none());

    // One picture of another size: nothing is written, whatever the others are.
    raw.resize_exact(640, 640, image::imageops::FilterType::Triangle)
        .save(path.join("check/right").join(first(path)))
        .unwrap();
    let output = rectify(path, &["--out", "refused"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("the right pictures are 640x640 px"), "{}", stderr(&output));
    assert!(!path.join("refused/rectified").exists() && !path.join("refused/rectified.json").exists());

    // One that is cut: that pair is left out by name. All cut: an error.
    for side in ["left", "right"] {
        for entry in std::fs::read_dir(path.join("check").join(side)).unwrap() {
            let file = entry.unwrap().path();
            let bytes = std::fs::read(&file).unwrap();
            std::fs::write(&file, &bytes[..bytes.len() / 2]).unwrap();
        }
        raw.save(path.join("check").join(side).join("whole.png")).unwrap();
    }
    std::fs::remove_file(path.join("check/right").join(first(path))).unwrap();
    // The pair that is left is one picture for both sides.
    assert_eq!(rectify(path, &["--out", "cut"]).status.code(), Some(1));
    let cut = json(&path.join("cut/rectified.json"));
    assert_eq!(cut["pairs"].as_array().unwrap().len(), 1);
    assert_eq!(cut["pairs_skipped"].as_array().unwrap().len(), 5);
    for side in ["left", "right"] {
        std::fs::remove_file(path.join("check").join(side).join("whole.png")).unwrap();
    }
    let output = rectify(path, &["--out", "none"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("not one pair of pictures can be read"), "{}", stderr(&output));
}

fn first(folder: &Path) -> String {
    let mut names: Vec<String> = std::fs::read_dir(folder.join("check/left"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "whole.png")
        .collect();
    names.sort();
    names.remove(0)
}
