//! The whole way of the data on a simulated world: `simulate`, `camera-check`, `measure`, `identify`, and the files of
//! the contract read back. [`crate::guide`] runs the commands.

use std::path::Path;

use serde_json::Value;

use crate::run::{files_below, stderr, stdout, stereocal, workplace};

/// Runs the program and expects success.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = stereocal(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output)
}

fn json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A number of a JSON file, by its path of keys.
fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer} in {value}"))
}

fn header(path: &Path) -> String {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    text.lines().next().unwrap_or_default().to_owned()
}

/// What the commands of the guide's page `day` wrote: pictures of a simulated world to corrected kinematics, all
/// methods, no flags.
pub fn as_in_the_contract(world: &Path) {
    let check = json(&world.join("out/camera-check.json"));
    assert_eq!(check.pointer("/passed"), Some(&Value::Bool(true)));
    assert!(number(&check, "/max_abs_error_mm") <= 0.05);
    assert!(number(&check, "/reprojection_rms_px") < 0.1);
    for key in ["/ranges/0/axis", "/ranges/0/nominal_mm", "/ranges/0/count", "/ranges/0/mean_error_mm"] {
        assert!(check.pointer(key).is_some(), "{key}");
    }
    for key in ["pair", "mean_error_x10_mm", "mean_error_y10_mm", "mean_error_x70_mm", "mean_error_y70_mm"] {
        assert!(check.pointer(&format!("/pairs/0/{key}")).is_some(), "{key}");
    }
    let columns = "pair,side,col,row,x_px,y_px,sxx_px2,sxy_px2,syy_px2,used,blur_px,width_px,height_px";
    assert_eq!(header(&world.join("out/corners.csv")), columns);

    let columns = "pose,group,role,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm,\
                   sxx_mm2,sxy_mm2,sxz_mm2,syy_mm2,syz_mm2,szz_mm2,rx_rad,ry_rad,rz_rad,fit_rms_mm,corners,status,\
                   srxrx_rad2,srxry_rad2,srxrz_rad2,sryry_rad2,sryrz_rad2,srzrz_rad2";
    assert_eq!(header(&world.join("out/measurements.csv")), columns);

    let found = json(&world.join("out/identification.json"));
    let before = number(&found, "/before/verify/mean_abs_mm");
    let chosen = found.pointer("/chosen").and_then(Value::as_str).expect("a chosen method").to_owned();
    let methods = found.pointer("/methods").and_then(Value::as_array).expect("methods");
    let method = methods
        .iter()
        .find(|m| format!("{}/{}", m["name"].as_str().unwrap_or(""), m["model"].as_str().unwrap_or("")) == chosen)
        .expect("the chosen method is one of the methods");
    assert!(methods.len() > 5 && found["not_run"].is_null(), "{}", methods.len());
    let after = number(method, "/verify/mean_abs_mm");
    assert!(before > 0.5, "the hidden errors are too small to show anything: {before} mm");
    assert!(after < before / 10.0, "before {before} mm, after {after} mm");
    for file in ["camera-check.html", "measure.html", "identify.html", "identified.toml", "measure.json"] {
        assert!(world.join("out").join(file).is_file(), "{file}");
    }
    exported_rigs_measure_the_same_points(world);
    another_calibration_is_noticed(world);
}

/// The robot's file says which calibration it came from, and measurements that were made with another one are warned
/// of.
fn another_calibration_is_noticed(world: &Path) {
    let identified = json(&world.join("out/identification.json"));
    let inputs = identified.pointer("/provenance/measured_by/inputs").and_then(Value::as_array).expect("inputs");
    assert!(inputs.iter().any(|input| input["file"] == "out/calibration.json"), "{inputs:?}");
    let said = || {
        let output = stereocal(world, &["identify", "--method", "trust-region", "--extensions", "none"]);
        (output.status.code(), stdout(&output) + &stderr(&output))
    };
    // The same rig of another day is the same rig.
    let path = world.join("out/calibration.json");
    let mut rig = json(&path);
    rig["provenance"]["date"] = "1999-01-01T00:00:00Z".into();
    std::fs::write(&path, rig.to_string()).unwrap();
    let (status, words) = said();
    assert!(status == Some(0) && !words.contains("another calibration"), "{words}");
    rig["left"]["fx"] = (number(&rig, "/left/fx") + 0.001).into();
    std::fs::write(&path, rig.to_string()).unwrap();
    let (status, words) = said();
    let doubt = "check before you use the identified robot: the measurements were made with another calibration than out/calibration.json";
    assert!(status == Some(0) && words.starts_with(doubt), "{words}");
}

/// So many of the poses in the folder `few`.
fn first_poses(world: &Path, count: usize) {
    let list = std::fs::read_to_string(world.join("poses/poses.csv")).expect("a list");
    let lines: Vec<&str> = list.lines().take(1 + count).collect();
    for side in ["left", "right"] {
        std::fs::create_dir_all(world.join("few").join(side)).expect("a folder");
        for line in &lines[1..] {
            let name = format!("{side}/{}.png", line.split(',').next().unwrap_or_default());
            std::fs::copy(world.join("poses").join(&name), world.join("few").join(&name)).expect("a picture");
        }
    }
    std::fs::write(world.join("few/poses.csv"), lines.join("\n") + "\n").expect("a list");
}

/// Each export is read back and measures the same points; that it holds no covariance is said.
fn exported_rigs_measure_the_same_points(world: &Path) {
    /// Digits that a rig loses on its way through a file are far below this, mm.
    const SAME_MM: f64 = 1e-6;
    let points = |out: &str| -> Vec<[f64; 3]> {
        let mut rows = csv::Reader::from_path(world.join(out).join("measurements.csv")).expect("measurements");
        let columns = rows.headers().expect("a header").clone();
        let x = columns.iter().position(|c| c == "x_mm").expect("x_mm");
        let number = |row: &csv::StringRecord, i: usize| row[i].parse::<f64>().expect("a measured pose");
        rows.records().map(|row| row.expect("a row")).map(|row| [0, 1, 2].map(|k| number(&row, x + k))).collect()
    };
    // The other formats hold neither the covariance nor the corners' scatter, which are evidence to `measure`.
    let mut plain = json(&world.join("out/calibration.json"));
    let fields = plain.as_object_mut().expect("an object");
    fields.retain(|key, _| key != "covariance" && key != "corner_noise");
    std::fs::create_dir_all(world.join("plain")).expect("a folder");
    std::fs::write(world.join("plain/rig.json"), plain.to_string()).expect("a file");
    first_poses(world, 12);
    done(world, &["measure", "few/", "--calibration", "plain/rig.json", "--out", "plain"]);
    let own = points("plain");
    for (format, file) in [
        ("opencv", "stereo_opencv.yml"),
        ("ros", "left.yaml"),
        ("ros", ""),
        ("kalibr", "camchain.yaml"),
        ("mrcal", "left.cameramodel"),
    ] {
        let rig = format!("{format}/{file}");
        done(
            world,
            &["export", "calibration", "--format", format, "--calibration", "out/calibration.json", "--out", format],
        );
        let output = stereocal(world, &["measure", "few/", "--calibration", &rig, "--out", format]);
        assert_eq!(output.status.code(), Some(0), "{rig}: {}", stderr(&output));
        assert!(stderr(&output).contains("holds no covariance"), "{}", stderr(&output));
        let theirs = points(format);
        assert_eq!(own.len(), theirs.len());
        for (a, b) in own.iter().flatten().zip(theirs.iter().flatten()) {
            assert!((a - b).abs() < SAME_MM, "{format}: {a} {b}");
        }
    }
}

#[test]
fn one_thread_and_two_give_the_same_bytes() {
    let folder = workplace();
    let few = ["--check-pairs", "8", "--samples", "16", "--verify", "4"];
    for (name, threads) in [("one", "1"), ("two", "2")] {
        let world = folder.path().join(name);
        std::fs::create_dir(&world).unwrap();
        for arguments in [
            &[&["simulate", "--preset", "small", "--size", "480", "--out", "."][..], &few].concat()[..],
            &["camera-check", "check/", "--tolerance-mm", "0.5"],
            &["measure", "poses/"],
            // The swarm has a test of its own beside its code.
            &["identify", "--method", "trust-region"],
        ] {
            let output = std::process::Command::new(env!("CARGO_BIN_EXE_stereocal"))
                .current_dir(&world)
                .env("RAYON_NUM_THREADS", threads)
                .env("SOURCE_DATE_EPOCH", "1700000000")
                .args(arguments)
                .output()
                .expect("the program starts");
            // Whether half the size still passes is not the point here.
            assert!(matches!(output.status.code(), Some(0 | 1)), "{arguments:?}: {}", stderr(&output));
        }
    }
    let [one, two] = ["one", "two"].map(|name| files_below(&folder.path().join(name)));
    assert!(one.len() > 20 && one.len() == two.len());
    for ((name, bytes), (other, others)) in one.iter().zip(&two) {
        assert!(name == other && bytes == others, "{name} differs, or {other}");
    }
}
