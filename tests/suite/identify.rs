//! `stereocal identify` as a person runs it: what it refuses and with which status, and what it makes of real data.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;

fn identify(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("stereocal").expect("the program is built");
    command.current_dir(folder).args(["identify", "--measurements", "m.csv"]);
    command
}

/// Distances to a centre for poses whose joints `angle` gives, deg.
fn folder_with(rows: usize, joints: usize, angle: impl Fn(usize, usize) -> f64) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let mut text = String::from("pose,group,role");
    for j in 1..=joints {
        let _ = write!(text, ",j{j}_deg");
    }
    text.push_str(",x_mm,y_mm,z_mm\n");
    for i in 0..rows {
        let _ = write!(text, "p{i},g,{}", if i == 0 { "center" } else { "sample" });
        for j in 0..joints {
            let _ = write!(text, ",{}", angle(i, j));
        }
        let _ = writeln!(text, ",{},{},{}", 10 * i, (7 * i) % 5, (3 * i) % 11);
    }
    std::fs::write(folder.path().join("m.csv"), text).expect("written");
    folder
}

#[test]
fn five_poses_determine_nothing_useful() {
    let folder = folder_with(6, 6, |i, j| ((5 * i + 3 * j) as f64).sin() * 60.0);
    identify(folder.path()).assert().code(3).stdout("").stderr(
        contains("more numbers than parameters are needed: at least ").and(contains("hint: measure more poses")),
    );
}

#[test]
fn the_same_pose_again_and_again_determines_nothing() {
    let folder = folder_with(60, 6, |_, j| 10.0 * j as f64);
    identify(folder.path()).assert().code(3).stderr(contains("determine no parameter"));
}

#[test]
fn a_robot_of_another_joint_count_is_refused_with_both_counts() {
    let folder = folder_with(30, 5, |i, j| (i * j) as f64);
    identify(folder.path()).assert().code(2).stderr(
        contains("the robot has 6 joints, the measurements have 5; there is no column `j6_deg`")
            .and(contains("Table 1 of the paper")),
    );
}

#[test]
fn a_model_that_needs_more_is_refused() {
    let folder = folder_with(30, 6, |i, j| ((5 * i + 3 * j) as f64).sin() * 60.0);
    identify(folder.path()).args(["--model", "pose"]).assert().code(2).stderr(contains("needs orientations"));
}

/// A folder of real robot data, where the shared data are at hand.
fn shared(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared");
    let root = std::env::var_os("STEREOCAL_SHARED").map_or(beside, PathBuf::from);
    let folder = root.join("data/robot").join(name);
    if !folder.is_dir() {
        println!("skipped: no {}", folder.display());
        return None;
    }
    Some(folder)
}

/// What a run has written that found a robot, whatever it advises.
fn identified_with(output: &std::process::Output) -> serde_json::Value {
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(i32::from(record["advice"] == "do-not-use")), "{said}");
    record
}

fn record(data: &Path, arguments: &[&str]) -> serde_json::Value {
    let out = tempfile::tempdir().expect("a folder");
    let output = Command::cargo_bin("stereocal")
        .expect("the program is built")
        .current_dir(out.path())
        .args(["identify", "--json", "--out", "."])
        .arg("--measurements")
        .arg(data.join("measurements.csv"))
        .arg("--robot")
        .arg(data.join("robot.toml"))
        .args(arguments)
        .output()
        .expect("it runs");
    identified_with(&output)
}

fn mean(quality: &serde_json::Value) -> f64 {
    quality["verify"]["mean_abs_mm"].as_f64().expect("a mean")
}

#[test]
fn irb_120_with_the_papers_model_beats_the_paper() {
    let Some(data) = shared("irb120-tracker-a") else { return };
    let arguments = ["--method", "trust-region", "--model", "center-distance", "--extensions", "none"];
    let record = record(&data, &arguments);
    assert!(mean(&record["before"]) > 0.5);
    // The issue asks for 0.10 mm; the paper reached 0.226 on its robot.
    assert!(mean(&record["methods"][0]) <= 0.10, "{}", record["methods"][0]["verify"]);
}

#[test]
fn robotcali_is_seen_to_be_several_sessions() {
    let Some(data) = shared("robotcali-120") else { return };
    let record = record(&data, &["--method", "trust-region", "--extensions", "none"]);
    assert!(record["sessions"].as_array().is_some_and(|s| s.len() > 1), "{}", record["sessions"]);
    let verify = &record["methods"][0]["verify"];
    let (mean, std) = (verify["mean_abs_mm"].as_f64().unwrap_or(9.0), verify["std_mm"].as_f64().unwrap_or(9.0));
    // Published: 0.62 mm root mean square.
    assert!(mean.hypot(std) < 0.62, "{verify}");
}

/// A small world without pictures: `measurements.csv` and `robot.toml` in a folder.
fn simulated() -> tempfile::TempDir {
    simulated_with(&[])
}

/// The same with more flags.
fn simulated_with(flags: &[&str]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = [&["simulate", "--points-only", "--preset", "small", "--seed", "3", "--out", "."], flags].concat();
    Command::cargo_bin("stereocal")
        .expect("the program is built")
        .current_dir(folder.path())
        .args(arguments)
        .assert()
        .success();
    folder
}

/// What `identify` writes for the measurements after `change`, line by line (the header is line 0).
fn identified(folder: &Path, change: impl Fn(usize, Vec<String>) -> Vec<String>) -> serde_json::Value {
    let text = std::fs::read_to_string(folder.join("measurements.csv")).expect("measurements");
    let lines =
        text.lines().enumerate().map(|(i, line)| change(i, line.split(',').map(str::to_owned).collect()).join(","));
    std::fs::write(folder.join("m.csv"), lines.collect::<Vec<_>>().join("\n")).expect("written");
    let output = identify(folder)
        .args(["--robot", "robot.toml", "--method", "trust-region", "--json", "--out", "out", "--force"])
        .output()
        .expect("it runs");
    identified_with(&output)
}

/// That `verify` says of the nominal and the written robot what `identify` said.
fn assert_verified(folder: &Path, record: &serde_json::Value) {
    let arguments =
        ["verify", "--json", "--measurements", "m.csv", "--robot", "robot.toml", "--robot", "out/identified.toml"];
    let output =
        Command::cargo_bin("stereocal").expect("built").current_dir(folder).args(arguments).output().expect("it runs");
    let verified: serde_json::Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON");
    for (k, said) in [(0, &record["before"]), (1, &record["methods"][0])] {
        let again = verified["robots"][k]["verify"]["mean_abs_mm"].as_f64().expect("a mean");
        assert!((again - mean(said)).abs() < 1e-9, "{again} {}", mean(said));
    }
}

#[test]
fn verify_says_of_the_written_robot_what_identify_said() {
    let folder = simulated();
    let record = identified(folder.path(), |_, fields| fields);
    assert!(
        record["outliers"].is_null() && record["sessions"].is_null(),
        "{} {}",
        record["outliers"],
        record["doctor"]
    );
    assert_verified(folder.path(), &record);
    // The robot file, the page and the record say how far to trust it, and where.
    let read = |name: &str| std::fs::read_to_string(folder.path().join("out").join(name)).expect("it was written");
    let figure = |name: &str| format!("{:.4}", record["expected"][name].as_f64().expect("a number"));
    let (robot, page) = (read("identified.toml"), read("identify.html"));
    let shown: Vec<f64> = page.split(['<', '>']).filter_map(|text| text.parse().ok()).collect();
    for name in ["mean_mm", "p95_mm", "max_mm"] {
        assert!(robot.contains(&figure(name)), "{name}: {robot:.2000}");
        // The page has two digits.
        let mm = record["expected"][name].as_f64().expect("a number");
        assert!(shown.iter().any(|value| (value - mm).abs() <= 0.05 * mm), "{name}: {mm}");
    }
    for text in [robot, page] {
        assert!(text.contains(record["expected"]["poses"].as_str().expect("a region")), "{text:.2000}");
    }
}

#[test]
fn verify_reads_measurements_as_identify_does() {
    let folder = simulated_with(&["--samples", "96"]);
    let joints = |fields: &[String]| fields.iter().position(|f| f == "center" || f == "sample" || f == "verify");
    let radians = |_: usize, mut fields: Vec<String>| {
        if let Some(role) = joints(&fields) {
            for angle in &mut fields[role + 1..=role + 6] {
                *angle = angle.parse::<f64>().expect("an angle").to_radians().to_string();
            }
        }
        fields
    };
    let record = identified(folder.path(), radians);
    assert!(record["doctor"].to_string().contains("radians"), "{}", record["doctor"]);
    assert_verified(folder.path(), &record);
    // Everything was moved in the middle of a group.
    let moved = |i: usize, mut fields: Vec<String>| {
        if let Some(role) = joints(&fields).filter(|_| i > 12) {
            let x: f64 = fields[role + 7].parse().expect("a coordinate");
            fields[role + 7] = (x + 3.0).to_string();
        }
        fields
    };
    let record = identified(folder.path(), moved);
    assert!(record["sessions"].is_array(), "{}", record["doctor"]);
    assert_verified(folder.path(), &record);
}

#[test]
fn one_bad_verify_row_is_the_reason_and_in_no_figure_of_the_verdict() {
    let folder = simulated();
    for (factor, is_read) in [(1.01, true), (1000.0, true), (1e300, false)] {
        let (role, x) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
        let name = std::cell::RefCell::new(String::new());
        let spoil = |i: usize, mut fields: Vec<String>| {
            if i == 0 {
                let at = |column: &str| fields.iter().position(|field| field == column).expect("a column");
                role.set(at("role"));
                x.set(at("x_mm"));
                name.borrow_mut().clear();
            } else if fields[role.get()] == "verify" && name.borrow().is_empty() {
                name.replace(fields[0].clone());
                let value: f64 = fields[x.get()].parse().expect("a coordinate");
                fields[x.get()] = format!("{:e}", if is_read { (value.abs() + 300.0) * factor } else { factor });
            }
            fields
        };
        let record = identified(folder.path(), spoil);
        let (reason, text) = (record["reason"].as_str().expect("a sentence"), record.to_string());
        assert!(!text.contains(" inf ") && !text.contains("NaN"), "{reason}");
        if !is_read {
            assert_eq!(record["advice"], "use", "{reason}");
            assert!(text.contains("farther than anything is measured"), "{}", record["warnings"]);
            continue;
        }
        assert_eq!(record["advice"], "check", "{factor}: {reason}");
        assert!(
            reason.starts_with("1 verify row fits far worse than the rest") && !reason.contains("too few rows"),
            "{reason}"
        );
        assert_eq!(record["strays"], serde_json::json!([*name.borrow()]));
        let kept = &record["methods"][0];
        let [all, judged] =
            ["verify", "verify_without_strays"].map(|k| kept[k]["point"]["mean_abs_mm"].as_f64().expect("a mean"));
        assert!(judged < 0.5 && all > 2.0 * judged, "{judged} {all}");
        let page = std::fs::read_to_string(folder.path().join("out/identify.html")).expect("a page");
        assert!(page.contains(&format!("rows that took no part in the fit, without {}", name.borrow())), "{reason}");
    }
}

/// `verify` on a file of these rows of the simulated measurements.
fn verify_only(folder: &Path, robots: &[&str], keep: impl Fn(&str) -> bool) -> std::process::Output {
    let table = std::fs::read_to_string(folder.join("measurements.csv")).expect("it was simulated");
    let kept: Vec<&str> = table.lines().enumerate().filter(|(i, line)| *i == 0 || keep(line)).map(|(_, l)| l).collect();
    std::fs::write(folder.join("fresh.csv"), kept.join("\n")).expect("it is written");
    let robots = robots.iter().flat_map(|robot| ["--robot", robot]);
    let arguments = ["verify", "--json", "--measurements", "fresh.csv"].into_iter().chain(robots);
    Command::cargo_bin("stereocal").expect("built").current_dir(folder).args(arguments).output().expect("it runs")
}

#[test]
fn verify_takes_a_file_of_fresh_poses_alone() {
    let folder = simulated();
    let record = identified(folder.path(), |_, fields| fields);
    let robots = ["robot.toml", "out/identified.toml"];
    let output = verify_only(folder.path(), &robots, |line| !line.contains(",sample,"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("no row of role `sample`"), "{said}");
    let verified: serde_json::Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON");
    for (k, said) in [(0, &record["before"]), (1, &record["methods"][0])] {
        // With the centres in the file the distances are those that `identify` judged by.
        let again = &verified["robots"][k]["verify"];
        assert!((again["mean_abs_mm"].as_f64().expect("a mean") - mean(said)).abs() < 1e-9, "{again} {said}");
        let point = again["point"]["mean_abs_mm"].as_f64().expect("a mean");
        assert!(point > 0.3 * said["verify"]["point"]["mean_abs_mm"].as_f64().expect("a mean"), "{again} {said}");
    }
    // One row has nothing to be measured from.
    let first = std::cell::Cell::new(true);
    let output = verify_only(folder.path(), &robots, |line| line.contains(",verify,") && first.replace(false));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(3) && said.contains("can be judged"), "{said}");
}

/// The row with its distance to the group's centre in place of its point, too long by the zero.
fn to_center(fields: &[String], center: &mut [f64; 3], zero_mm: f64) -> Vec<String> {
    let role = fields.iter().position(|f| f == "center" || f == "sample" || f == "verify").expect("a role");
    let mut row = fields[..=role + 6].to_vec();
    let point: Vec<f64> = fields[role + 7..role + 10].iter().map(|f| f.parse().expect("a coordinate")).collect();
    if row[role] == "center" {
        center.copy_from_slice(&point);
        row.push(String::new());
    } else {
        let square: f64 = point.iter().zip(center.iter()).map(|(p, c)| (p - c).powi(2)).sum();
        row.push((square.sqrt() + zero_mm).to_string());
    }
    row
}

#[test]
fn distances_on_one_sphere_leave_their_zero_open_and_are_verified_as_they_were_read() {
    let folder = simulated();
    for zero_mm in [0.0, 0.5, 5.0] {
        let center = std::cell::Cell::new([0.0; 3]);
        let distances = |i: usize, fields: Vec<String>| {
            if i == 0 {
                let role = fields.iter().position(|f| f == "role").expect("a role");
                return [&fields[..=role + 6], &["distance_mm".to_owned()]].concat();
            }
            let mut at = center.get();
            let row = to_center(&fields, &mut at, zero_mm);
            center.set(at);
            row
        };
        let record = identified(folder.path(), distances);
        let said = record["doctor"].to_string() + &record["warnings"].to_string();
        let (off, open) = ("the zero of the readings is off", "too similar to separate an offset");
        // On spheres of one radius a robot of another size has such a zero, as long as no workshop gets it so wrong.
        assert!(said.contains(if zero_mm > 1.0 { off } else { open }), "{zero_mm}: {said}");
        assert_verified(folder.path(), &record);
    }
}

#[test]
fn a_centre_that_is_off_is_named() {
    let folder = simulated();
    let off = |i: usize, mut fields: Vec<String>| {
        if i == 1 {
            let x = fields
                .iter()
                .position(|f| f.parse::<f64>().is_err() && f == "center")
                .map(|c| c + 7)
                .expect("a centre");
            fields[x] = (fields[x].parse::<f64>().expect("a number") + 5.0).to_string();
        }
        fields
    };
    let record = identified(folder.path(), off);
    assert_eq!(record["outliers"], serde_json::json!(["g1_000"]), "{}", record["doctor"]);
}

#[test]
fn exchanged_columns_are_named_as_that() {
    let folder = simulated();
    let exchanged = |i: usize, mut fields: Vec<String>| {
        if i > 0 {
            fields.swap(4, 5);
        }
        fields
    };
    let record = identified(folder.path(), exchanged);
    let said = record["doctor"].to_string();
    assert!(said.contains("joints 2 and 3 are exchanged"), "{said}");
    assert!(record["scatter_mm"].as_f64().is_some_and(|s| s < 0.1), "{}", record["scatter_mm"]);
}

/// `cam_from_board` by pose.
type Turns = std::collections::BTreeMap<String, nalgebra::Rotation3<f64>>;

fn true_turns(folder: &Path) -> Turns {
    let text = std::fs::read_to_string(folder.join("truth/measurements.csv")).expect("the truth");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let at = header.iter().position(|name| *name == "rx_rad").expect("orientations");
    let turn = |fields: &[&str]| nalgebra::Vector3::from_fn(|k, _| fields[at + k].parse().expect("a number"));
    lines.map(|fields| (fields[0].to_owned(), nalgebra::Rotation3::new(turn(&fields)))).collect()
}

/// Three targets round the mark point, mm, and what a reading of each is off by at a pose.
const TARGETS_MM: [[f64; 3]; 3] = [[50.0, 0.0, 0.0], [-20.0, 40.0, 10.0], [-30.0, -40.0, -10.0]];

/// A row for each of the targets instead of one for their mean, with neither covariances nor orientations; `turns` are
/// the target's by pose.
fn of_targets(fields: &[String], names: [&str; 3], line: usize, turns: &Turns) -> Vec<String> {
    let role = fields.iter().position(|f| f == "center" || f == "sample" || f == "verify").expect("a role");
    let number = |k: usize| fields[role + 7 + k].parse::<f64>().expect("a number");
    let mark = nalgebra::Vector3::new(number(0), number(1), number(2));
    let turn = turns[&fields[0]];
    let row = |k: usize| {
        let off = nalgebra::Vector3::from_fn(|axis, _| 0.01 * ((7 * line + 3 * k + axis) as f64 * 2.1).sin());
        let at = mark + turn * nalgebra::Vector3::from(TARGETS_MM[k]) + off;
        format!("{},{},{},{},{}", fields[..=role + 6].join(","), names[k], at.x, at.y, at.z)
    };
    vec![(0..3).map(row).collect::<Vec<_>>().join("\n")]
}

#[test]
fn several_targets_a_pose_count_as_one_that_turns() {
    let folder = simulated_with(&["--samples", "60"]);
    let turns = true_turns(folder.path());
    let turns = &turns;
    let rows = |spoil: usize| {
        move |i: usize, fields: Vec<String>| match i {
            0 => vec!["pose,group,role,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,target,x_mm,y_mm,z_mm".to_owned()],
            _ if i == spoil => of_targets(&fields, ["left", "low", "right"], i, turns),
            _ => of_targets(&fields, ["left", "right", "low"], i, turns),
        }
    };
    let one = identified(folder.path(), |_, fields| fields);
    let clean = identified(folder.path(), rows(usize::MAX));
    assert_eq!(clean["targets"]["names"], serde_json::json!(["left", "right", "low"]));
    assert_eq!((&clean["targets"]["oriented"], &clean["doctor"]), (&serde_json::json!(true), &serde_json::json!([])));
    assert_eq!(clean["methods"][0]["model"], "pose");
    // Their mark point is the one whose rows they replace.
    assert!(
        mean(&clean["methods"][0]) < 1.5 * mean(&one["methods"][0]),
        "{} {}",
        clean["methods"][0],
        one["methods"][0]
    );
    assert_verified(folder.path(), &clean);
    let page = std::fs::read_to_string(folder.path().join("out/identify.html")).expect("a page");
    assert!(page.contains("the targets of a pose (left, right, low)"));
    let spoiled = identified(folder.path(), rows(20));
    let doctor = spoiled["doctor"].to_string();
    assert!(doctor.contains("the names of targets right and low are exchanged"), "{doctor}");
    assert!((mean(&spoiled["methods"][0]) - mean(&clean["methods"][0])).abs() < 1e-3);
}

#[test]
fn targets_that_cannot_be_made_one_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let header = "pose,group,role,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,target,";
    for (columns, second, said) in [
        ("x_mm,y_mm,z_mm", "p1,g,sample,1,2,3,4,5,6,b,1,2,3", "no pose shows two of them"),
        ("distance_mm", "p0,g,sample,0,0,0,0,0,0,b,5", "distances of 2 targets (a, b)"),
        ("x_mm,y_mm,z_mm", "p0,g,sample,0,0,0,0,9,0,b,1,2,3", "another group, role or joints"),
    ] {
        let first = if columns == "distance_mm" { "5" } else { "1,2,3" };
        let text = format!("{header}{columns}\np0,g,sample,0,0,0,0,0,0,a,{first}\n{second}\n");
        std::fs::write(folder.path().join("m.csv"), text).expect("written");
        identify(folder.path())
            .assert()
            .code(2)
            .stdout("")
            .stderr(contains(said).and(contains("hint:").or(contains("m.csv:3"))));
    }
}

/// The first lines say whether to use the result, and a robot of another make is not to be used.
#[test]
fn another_arms_file_is_advised_against() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| {
        let mut command = Command::cargo_bin("stereocal").expect("the program is built");
        command.current_dir(folder.path()).args(arguments).output().expect("it runs")
    };
    let said = |output: &std::process::Output| {
        (String::from_utf8_lossy(&output.stdout).into_owned(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    run(&["simulate", "--points-only", "--samples", "40", "--verify", "12", "--out", "."]);
    let measurements = "measurements.csv";
    let arm = "ur5e";
    run(&["robot", "new", arm, "--out", arm]);
    let file = format!("{arm}/robot.toml");
    let output =
        run(&["identify", "--method", "trust-region", "--measurements", measurements, "--robot", &file, "--out", arm]);
    let (out, err) = said(&output);
    assert_eq!(output.status.code(), Some(1), "{arm}: {out}{err}");
    // On a screen the verdict and what to do come first, and the warnings below.
    let (screen, path) = tempfile::NamedTempFile::new().expect("a file").into_parts();
    let again =
        ["identify", "--method", "trust-region", "--measurements", measurements, "--robot", &file, "--out", arm];
    let both = [screen.try_clone().expect("the same file"), screen];
    let [stdout, stderr] = both.map(std::process::Stdio::from);
    let mut command = std::process::Command::new(crate::run::program());
    command.current_dir(folder.path()).args(again).stdout(stdout).stderr(stderr).status().expect("it runs");
    let screen = std::fs::read_to_string(&path).expect("what it said");
    let at = |text: &str| screen.find(text).unwrap_or_else(|| panic!("no `{text}`: {screen}"));
    assert!(at("do not use the identified") < at("\nnext: ") && at("\nnext: ") < at("\nkept: "), "{screen}");
    assert!(at("\nwritten: ") < at("warning: "), "{screen}");
    assert!(out.starts_with("do not use the identified robot: "), "{arm}: {out}");
    let warnings: Vec<&str> = err.lines().filter(|line| line.starts_with("warning: ")).collect();
    // What the verdict says is not said before it as well.
    let again = |warning: &&str| out.contains(&warning["warning: ".len()..]);
    assert!(warnings.len() <= 5 && !warnings.iter().any(again), "{arm}: {out}{err}");
    let json = std::fs::read_to_string(folder.path().join(arm).join("identification.json")).expect("written");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["advice"], "do-not-use");
    let robot = std::fs::read_to_string(folder.path().join(arm).join("identified.toml")).expect("written");
    assert!(robot.contains("# Do not use this robot"), "{robot}");
    let page = std::fs::read_to_string(folder.path().join(arm).join("identify.html")).expect("written");
    assert!(page.contains("Do not use"), "{arm}");
    let output =
        run(&["identify", "--method", "trust-region", "--measurements", measurements, "--robot", "robot.toml"]);
    let (out, err) = said(&output);
    assert_eq!(output.status.code(), Some(0), "{out}{err}");
    assert!(out.starts_with("use the identified robot\nbefore: "), "{out}");
    assert!(out.lines().nth(2).is_some_and(|line| line.starts_with("after: ")), "{out}");
    assert!(!err.contains("do not use"), "{err}");
}

#[test]
fn with_the_file_of_another_arm_only_one_method_is_run_and_the_screen_says_why() {
    let folder = simulated();
    std::fs::copy(folder.path().join("measurements.csv"), folder.path().join("m.csv")).expect("copied");
    Command::cargo_bin("stereocal")
        .expect("built")
        .current_dir(folder.path())
        .args(["robot", "new", "ur10e", "--out", "other"])
        .assert()
        .success();
    let output =
        identify(folder.path()).args(["--robot", "other/robot.toml", "--out", "out"]).output().expect("it runs");
    let text = std::fs::read_to_string(folder.path().join("out/identification.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let methods = record["methods"].as_array().map_or(0, Vec::len);
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!((output.status.code(), methods), (Some(1), 1), "{said}");
    assert!(said.contains("only trust-region was run") && record["not_run"].is_string(), "{said}");
}
