//! `export robot` as a command: the maker's description corrected, the formats, and what is said of terms that they
//! cannot carry.

use std::path::Path;

use camino::Utf8Path;
use stereocal::formats::robots::urdf::Urdf;
use stereocal::robot::refit::Residual;
use stereocal::robot::{Robot, file};

use crate::run::{stderr, stdout, stereocal, workplace};

fn run(folder: &Path, arguments: &[&str], status: i32) -> String {
    let output = stereocal(folder, arguments);
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output) + &stderr(&output)
}

fn read(folder: &Path, name: &str) -> Robot {
    file::read(Utf8Path::from_path(&folder.join(name)).unwrap()).unwrap()
}

fn chain(folder: &Path, name: &str, tip: Option<&str>) -> Robot {
    let path = folder.join(name);
    let urdf = Urdf::read(Utf8Path::from_path(&path).unwrap()).unwrap();
    urdf.chain(tip).unwrap().robot("read back")
}

/// A robot file with deviations in every number and, where wanted, terms that only this program's own format has.
fn deviated(folder: &Path, from: &str, to: &str, terms: bool) {
    let mut robot = read(folder, from);
    for (k, joint) in robot.joints.iter_mut().enumerate().skip(1) {
        joint.alpha_rad += 1e-3 * (k as f64).sin();
        joint.theta_rad += 2e-3 * (k as f64).cos();
        joint.d_mm += 0.4;
    }
    let mut text = file::to_toml(&robot);
    if terms {
        text += "\n[gravity]\nterms = [{ joint = 2, point = \"joint_3\", k_mrad_per_m = 1.0 }]\n";
    }
    std::fs::write(folder.join(to), text).unwrap();
}

#[test]
fn a_description_goes_in_and_comes_out_corrected() {
    let folder = workplace();
    let at = folder.path();
    run(at, &["robot", "new", "kuka-iiwa14", "--out", "new"], 0);
    run(at, &["export", "robot", "--robot", "new/robot.toml", "--format", "urdf", "--out", "maker"], 0);
    run(at, &["robot", "import", "maker/robot.urdf", "--out", "."], 0);
    deviated(at, "robot.toml", "identified.toml", false);
    let arguments =
        ["export", "robot", "--robot", "identified.toml", "--format", "urdf", "--nominal-urdf", "maker/robot.urdf"];
    let said = run(at, &arguments, 0);
    assert!(said.contains("flange poses equal to") && said.contains("7 joint origins"), "{said}");
    let (identified, corrected) = (read(at, "identified.toml"), chain(at, "out/robot.urdf", None));
    let off = Residual::between(&identified, &corrected);
    assert!(off.max_mm < 1e-9, "{off:?}");
    assert!(Residual::between(&identified, &read(at, "robot.toml")).mean_mm > 0.1);
    // Another arm's description is not this robot's.
    run(at, &["robot", "new", "franka-panda", "--out", "panda"], 0);
    run(at, &["export", "robot", "--robot", "panda/robot.toml", "--format", "urdf", "--out", "panda"], 0);
    let arguments = [
        "export",
        "robot",
        "--robot",
        "identified.toml",
        "--format",
        "urdf",
        "--nominal-urdf",
        "panda/robot.urdf",
        "--out",
        "x",
    ];
    let said = run(at, &arguments, 2);
    assert!(said.contains("off joint") && said.contains("robot import panda/robot.urdf"), "{said}");
}

#[test]
fn what_a_format_cannot_carry_is_said_in_mm() {
    let folder = workplace();
    let at = folder.path();
    run(at, &["robot", "new", "ur5e", "--out", "."], 0);
    deviated(at, "robot.toml", "plain.toml", false);
    deviated(at, "robot.toml", "sagging.toml", true);
    for (format, file) in [
        ("urdf", "robot.urdf"),
        ("dh-csv", "robot.csv"),
        ("ros-kinematics-yaml", "kinematics.yaml"),
        ("ur-calibration", "calibration.conf"),
        ("toml", "robot.toml"),
    ] {
        let export = |robot: &str, out: &str| {
            run(at, &["export", "robot", "--robot", robot, "--format", format, "--out", out], 0)
        };
        let plain = export("plain.toml", &format!("plain-{format}"));
        assert!(plain.contains(file) && plain.contains("flange poses equal to"), "{plain}");
        let sagging = export("sagging.toml", &format!("sagging-{format}"));
        let lost = sagging.contains("no place for gravity: refitted") && sagging.contains("mm on average");
        assert_eq!(lost, format != "toml", "{sagging}");
    }
    // The residual that is printed is that of the file.
    let back = chain(at, "sagging-urdf/robot.urdf", None);
    let off = Residual::between(&read(at, "sagging.toml"), &back);
    let said = run(at, &["export", "robot", "--robot", "sagging.toml", "--format", "urdf", "--out", "again"], 0);
    assert!(said.contains(&format!("{:.4} mm on average", off.mean_mm)), "{said} {off:?}");
    // Where it is known over which ranges the robot was measured, it is met there.
    let ranges = vec![[20.0, 60.0]; 6];
    let expected = serde_json::json!({ "mean_mm": 0.05, "p95_mm": 0.1, "map": [], "joint_ranges": ranges });
    std::fs::write(at.join("identification.json"), serde_json::json!({ "expected": expected }).to_string()).unwrap();
    let said = run(at, &["export", "robot", "--robot", "sagging.toml", "--format", "urdf", "--out", "near"], 0);
    assert!(
        said.contains("refitted over the ranges that were measured") && said.contains("--extensions none"),
        "{said}"
    );
    let there = read(at, "sagging.toml").within(&[(20f64.to_radians(), 60f64.to_radians()); 6]);
    let [near, far] = ["near", "again"]
        .map(|folder| Residual::between(&there, &chain(at, &format!("{folder}/robot.urdf"), None)).mean_mm);
    assert!(near < 0.3 * far, "{near} {far}");
    for (file, out) in [("plain-dh-csv/robot.csv", "table"), ("plain-ros-kinematics-yaml/kinematics.yaml", "frames")] {
        run(at, &["robot", "import", file, "--out", out], 0);
        let off = Residual::between(&read(at, "plain.toml"), &read(at, &format!("{out}/robot.toml")));
        assert!(off.max_mm < 1e-9, "{off:?}");
    }
    let said = run(at, &["robot", "import", "plain-ur-calibration/calibration.conf", "--out", "none"], 2);
    assert!(said.contains("these are deviations") && said.contains("ur_calibration"), "{said}");
}

#[test]
fn an_export_spares_the_nominal_robot() {
    let folder = workplace();
    let at = folder.path();
    run(at, &["robot", "new", "ur5e", "--out", "."], 0);
    deviated(at, "robot.toml", "identified.toml", false);
    let nominal = std::fs::read_to_string(at.join("robot.toml")).unwrap();
    let export = ["export", "robot", "--robot", "identified.toml", "--format", "toml", "--out", "."];
    let said = run(at, &export, 2);
    assert!(said.contains("robot.toml is there already and is no export") && said.contains("--force"), "{said}");
    assert_eq!(std::fs::read_to_string(at.join("robot.toml")).unwrap(), nominal);
    run(at, &[&export[..], &["--force"]].concat(), 0);
    // Its own export it replaces.
    deviated(at, "robot.toml", "again.toml", false);
    run(at, &["export", "robot", "--robot", "again.toml", "--format", "toml", "--out", "."], 0);
    assert_ne!(std::fs::read_to_string(at.join("robot.toml")).unwrap(), nominal);
}

#[test]
fn robots_that_a_format_is_not_for_are_refused() {
    let folder = workplace();
    let at = folder.path();
    run(at, &["robot", "new", "ur5e", "--out", "."], 0);
    let text = std::fs::read_to_string(at.join("robot.toml")).unwrap();
    std::fs::write(at.join("own.toml"), text.replacen("Universal Robots UR5e", "our arm", 1)).unwrap();
    let said = run(at, &["export", "robot", "--robot", "own.toml", "--format", "ur-calibration"], 2);
    assert!(said.contains("no common arm is called `our arm`") && said.contains("--nominal FILE"), "{said}");
    let sliding = text.replacen("[[joint]]", "[[joint]]\ntype = \"prismatic\"", 1);
    let lines: Vec<&str> = sliding.lines().collect();
    let first_limits = lines.iter().position(|l| l.starts_with("limits_deg")).unwrap();
    let kept: Vec<&str> = lines.iter().enumerate().filter(|(i, _)| *i != first_limits).map(|(_, l)| *l).collect();
    std::fs::write(at.join("sliding.toml"), kept.join("\n")).unwrap();
    let said = run(at, &["export", "robot", "--robot", "sliding.toml", "--format", "ros-kinematics-yaml"], 2);
    assert!(said.contains("joint 1 slides") && said.contains("--format urdf"), "{said}");
    run(at, &["export", "robot", "--robot", "sliding.toml", "--format", "urdf", "--out", "sliding"], 0);
}

#[test]
fn what_a_table_leaves_open_is_asked_with_the_flag_that_says_it() {
    let folder = workplace();
    let at = folder.path();
    std::fs::write(at.join("arm.csv"), "theta,d,a,alpha\n1.3,0,12,0\n0.2,0,11,0\n-0.4,0,9,0\n").unwrap();
    let import = |flags: &[&str], status| {
        run(at, &[&["robot", "import", "arm.csv", "--out", "arm", "--force"], flags].concat(), status)
    };
    assert!(import(&[], 2).contains("--dh modified"));
    assert!(import(&["--dh", "classic"], 2).contains("`--units deg` or `--units rad`"));
    assert!(import(&["--dh", "classic", "--units", "rad"], 2).contains("--units cm"));
    let said = import(&["--dh", "classic", "--units", "rad,cm"], 0);
    assert!(said.contains("angles in radians, lengths in cm, classic convention (--dh says so)"), "{said}");
    let robot = read(at, "arm/robot.toml");
    assert!((robot.joints[1].a_mm - 120.0).abs() < 1e-9 && (robot.joints[0].theta_rad - 1.3).abs() < 1e-9);
    // A limit that a macro left in a description.
    run(at, &["export", "robot", "--robot", "arm/robot.toml", "--format", "urdf", "--out", "maker"], 0);
    let text = std::fs::read_to_string(at.join("maker/robot.urdf")).unwrap();
    let joint = text.replacen("type=\"continuous\"", "type=\"revolute\"", 1);
    let joint = joint.replacen("<limit effort", "<limit lower=\"${-pi}\" upper=\"${pi}\" effort", 1);
    std::fs::write(at.join("limited.urdf"), joint).unwrap();
    run(at, &["robot", "import", "limited.urdf", "--out", "limited"], 0);
    let limits = read(at, "limited/robot.toml").joints[0].limits_rad;
    assert!(limits.is_some_and(|(low, high)| (low + high).abs() < 1e-9 && (high - std::f64::consts::PI).abs() < 1e-9));
}
