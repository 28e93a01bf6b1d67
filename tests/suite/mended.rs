//! Tables that are not what they seem to be, judged by a robot that is known: what is said of them, with which figures
//! and which status.

use std::path::Path;
use std::sync::LazyLock;

use camino::Utf8Path;
use stereocal::robot::{Robot, file};

use crate::run::{Files, files_below, stderr, stdout, stereocal, with_files, workplace};

/// A robot with points of 60 poses, identified into `out`.
fn identified() -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| files_below(made().path()));
    with_files(&MADE)
}

fn made() -> tempfile::TempDir {
    let folder = workplace();
    let at = folder.path();
    let made = ["simulate", "--points-only", "--samples", "48", "--verify", "12", "--seed", "7", "--out", "."];
    assert_eq!(stereocal(at, &made).status.code(), Some(0));
    identify(at, 0);
    folder
}

fn identify(at: &Path, status: i32) -> String {
    let found = ["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region"];
    let found = stereocal(at, &[&found[..], &["--robot", "robot.toml", "--force"]].concat());
    let said = stdout(&found) + &stderr(&found);
    assert_eq!(found.status.code(), Some(status), "{said}");
    said
}

/// The verify rows alone, changed, and their names; the columns are those of the contract.
fn rows(at: &Path, change: impl Fn(&mut Vec<Vec<String>>)) -> Vec<String> {
    rows_of(at, ",verify,", change)
}

/// The same of the rows that hold this.
fn rows_of(at: &Path, held: &str, change: impl Fn(&mut Vec<Vec<String>>)) -> Vec<String> {
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let mut lines = text.lines();
    let header = lines.next().unwrap();
    let kept = lines.filter(|line| line.contains(held));
    let mut rows: Vec<Vec<String>> = kept.map(|line| line.split(',').map(str::to_owned).collect()).collect();
    change(&mut rows);
    let body: Vec<String> = rows.iter().map(|row| row.join(",")).collect();
    std::fs::write(at.join("new.csv"), format!("{header}\n{}\n", body.join("\n"))).unwrap();
    rows.into_iter().map(|row| row[0].clone()).collect()
}

/// Column of joint `j1_deg`, and of `x_mm`.
const JOINT: usize = 3;
const POINT: usize = 9;

fn scaled(rows: &mut [Vec<String>], columns: std::ops::Range<usize>, factor: f64) {
    for row in rows {
        for column in columns.clone() {
            row[column] = (factor * row[column].parse::<f64>().unwrap()).to_string();
        }
    }
}

fn exchanged(rows: &mut [Vec<String>], a: usize, b: usize) {
    let points = POINT..POINT + 3;
    let of_a = rows[a][points.clone()].to_vec();
    let of_b = rows[b][points.clone()].to_vec();
    rows[a][points.clone()].clone_from_slice(&of_b);
    rows[b][points].clone_from_slice(&of_a);
}

fn verify(at: &Path) -> (i32, serde_json::Value, String) {
    let arguments = ["verify", "--measurements", "new.csv", "--robot", "robot.toml", "--robot", "out/identified.toml"];
    let told = stereocal(at, &[&arguments[..], &["--json"]].concat());
    let said = stereocal(at, &arguments);
    assert_eq!(told.status.code(), said.status.code());
    let json = serde_json::from_slice(told.stdout.as_slice()).unwrap();
    (said.status.code().unwrap(), json, stdout(&said) + &stderr(&said))
}

/// Mean error of points of the identified robot.
fn mean(json: &serde_json::Value, figures: &str) -> f64 {
    json["robots"][1][figures]["point"]["mean_abs_mm"].as_f64().unwrap()
}

#[test]
fn verify_says_what_its_figures_are_of() {
    let folder = identified();
    let at = folder.path();
    // Of the first placement all rows: those of few poses do not tell who strays.
    rows_of(at, ",1,", |_| ());
    let (status, clean, said) = verify(at);
    assert!(status == 0 && clean.get("strays").is_none() && !said.contains("without"), "{said}");
    let right_mm = mean(&clean, "verify");
    let names = rows_of(at, ",1,", |rows| exchanged(rows, 2, 7));
    let (status, json, said) = verify(at);
    assert_eq!(status, 1, "{said}");
    let told = format!("the readings of rows {} and {}, or their joints, are exchanged", names[2], names[7]);
    assert!(said.contains(&told) && said.contains(&format!("without {}, {}:", names[2], names[7])), "{said}");
    assert_eq!(json["strays"], serde_json::json!([names[2], names[7]]));
    assert!(mean(&json, "verify_without_strays") < 2.0 * right_mm, "{json}");
    // What is mended is in the figures.
    rows_of(at, ",1,", |rows| scaled(rows, JOINT + 2..JOINT + 3, -1.0));
    let (status, json, said) = verify(at);
    assert!(
        status == 1 && said.contains("joint 3 is counted the other way round") && said.contains("mended"),
        "{said}"
    );
    assert!((mean(&json, "verify") - right_mm).abs() < 1e-6, "{json}");
}

#[test]
fn each_robot_is_judged_by_the_rows_as_it_counts_its_joints() {
    let folder = identified();
    let at = folder.path();
    rows_of(at, ",1,", |_| ());
    let right_mm = mean(&verify(at).1, "verify");
    rows_of(at, ",1,", |rows| scaled(rows, JOINT + 2..JOINT + 3, -1.0));
    // As `identify` finds it from such rows, and one that is off however the rows are read.
    let mut counted = file::read(&Utf8Path::from_path(at).unwrap().join("out/identified.toml")).unwrap();
    counted.joints[2].sign = -1.0;
    std::fs::write(at.join("counted.toml"), file::to_toml(&counted)).unwrap();
    counted.joints[1].sign = -1.0;
    std::fs::write(at.join("off.toml"), file::to_toml(&counted)).unwrap();
    let files = ["robot.toml", "counted.toml", "out/identified.toml", "off.toml"];
    let robots: Vec<&str> = files.iter().flat_map(|file| ["--robot", file]).collect();
    let told = stereocal(at, &[&["verify", "--measurements", "new.csv", "--json"], &robots[..]].concat());
    let json: serde_json::Value = serde_json::from_slice(told.stdout.as_slice()).unwrap();
    let mean = |k: usize| json["robots"][k]["verify"]["point"]["mean_abs_mm"].as_f64().unwrap();
    assert!(mean(1) < 2.0 * right_mm && mean(2) < 2.0 * right_mm && mean(3) > 20.0 * right_mm, "{json}");
    let said = stderr(&told);
    assert!(told.status.code() == Some(1) && said.contains("counted.toml counts its joints as the rows do"), "{said}");
    assert!(!said.contains("out/identified.toml counts its joints"), "{said}");
}

#[test]
fn rows_outside_the_ranges_that_terms_were_identified_in_are_said() {
    let folder = identified();
    let at = folder.path();
    let path = Utf8Path::from_path(at).unwrap().join("out/identified.toml");
    // Without provenance nothing but the place says that record and robot belong together.
    let found =
        ["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--robot", "robot.toml"];
    assert_eq!(stereocal(at, &[&found[..], &["--force", "--no-provenance"]].concat()).status.code(), Some(0));
    let record = at.join("out/identification.json");
    let mut json: serde_json::Value = serde_json::from_slice(&std::fs::read(&record).unwrap()).unwrap();
    let of_joint = json["expected"]["joint_ranges"][1].clone();
    let (low, high) = (of_joint[0].as_f64().unwrap(), of_joint[1].as_f64().unwrap());
    let said = |json: &serde_json::Value, robot: &Robot| {
        std::fs::write(&record, json.to_string()).unwrap();
        std::fs::write(&path, file::to_toml(robot)).unwrap();
        rows(at, |_| ());
        verify(at).2
    };
    let mut robot = file::read(&path).unwrap();
    let term = stereocal::robot::corrections::HarmonicTerm {
        joint: 1,
        wave: stereocal::robot::corrections::Wave::Cos,
        amplitude_rad: 1e-9,
    };
    robot.corrections.harmonics = vec![term];
    assert!(!said(&json, &robot).contains("are outside"), "{}", said(&json, &robot));
    json["expected"]["joint_ranges"][1] = serde_json::json!([low, low + 0.3 * (high - low)]);
    let told = said(&json, &robot);
    assert!(told.contains("are outside: joint 2 in ") && told.contains("`identify --extensions none`"), "{told}");
    robot.corrections = stereocal::robot::corrections::Corrections {
        gravity_direction: robot.corrections.gravity_direction,
        ..Default::default()
    };
    assert!(!said(&json, &robot).contains("are outside"), "{}", said(&json, &robot));
}

#[test]
fn a_check_of_rows_in_metres_or_with_a_sign_flipped_names_that() {
    let folder = identified();
    let at = folder.path();
    let against = || {
        let arguments =
            ["verify", "--measurements", "new.csv", "--against", "out/identified.toml", "--out", "checks", "--force"];
        let told = stereocal(at, &arguments);
        (told.status.code().unwrap(), stdout(&told) + &stderr(&told))
    };
    rows(at, |_| ());
    let (_, said) = against();
    assert!(!said.contains("mended for this run") && !said.contains("CHANGED"), "{said}");
    assert!(!said.contains("rows mended"), "{said}");
    rows(at, |rows| scaled(rows, POINT..POINT + 3, 0.001));
    let (status, said) = against();
    assert!(status == 1 && said.contains("the readings are in m, not in mm"), "{said}");
    assert!(said.contains("whether these rows are new, or rows of the identification in another form"), "{said}");
    assert!(!said.contains("CHANGED"), "{said}");
    rows(at, |rows| scaled(rows, JOINT + 2..JOINT + 3, -1.0));
    let (status, said) = against();
    assert!(
        status != 0 && said.contains("joint 3 is counted the other way round") && !said.contains("CHANGED"),
        "{said}"
    );
    // Why the status is 1 although the robot holds.
    assert!(said.contains("with the rows mended: ") && !said.contains("go on with this robot"), "{said}");
}

#[test]
fn points_that_are_all_one_are_no_measurement() {
    let folder = identified();
    let at = folder.path();
    rows_of(at, ",sample,", |rows| scaled(rows, POINT..POINT + 3, 0.0));
    let told = stereocal(at, &["identify", "--measurements", "new.csv", "--robot", "robot.toml", "--out", "one"]);
    assert_eq!(told.status.code(), Some(2), "{}", stdout(&told));
    assert!(stderr(&told).contains("all 48 points are one, 0.000, 0.000, 0.000 mm"), "{}", stderr(&told));
}

#[test]
fn angles_that_were_rounded_are_the_reason() {
    let folder = identified();
    let at = folder.path();
    let path = at.join("truth/measurements.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let rounded = |(k, line): (usize, &str)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if k > 0 {
            fields[JOINT..JOINT + 6].iter_mut().for_each(|q| *q = format!("{:.0}", q.parse::<f64>().unwrap()));
        }
        fields.join(",") + "\n"
    };
    std::fs::write(&path, text.lines().enumerate().map(rounded).collect::<String>()).unwrap();
    let said = identify(at, 1);
    assert!(said.contains("do not use the identified robot: the joint angles are rounded to 1 deg"), "{said}");
}

#[test]
fn a_robot_whose_last_link_holds_the_tool_is_compensated() {
    let folder = identified();
    let at = folder.path();
    let path = Utf8Path::from_path(at).unwrap();
    let mut nominal = file::read(&path.join("robot.toml")).unwrap();
    let mut long = file::read(&path.join("out/identified.toml")).unwrap();
    nominal.tool_mm = nalgebra::Vector3::zeros();
    long.tool_mm = nalgebra::Vector3::zeros();
    long.joints[5].d_mm += 93.0;
    std::fs::write(at.join("bare.toml"), file::to_toml(&nominal)).unwrap();
    std::fs::write(at.join("long.toml"), file::to_toml(&long)).unwrap();
    let short = Robot {
        joints: {
            let mut joints = long.joints.clone();
            joints[5].d_mm -= 93.0;
            joints
        },
        ..long.clone()
    };
    std::fs::write(
        at.join("short.toml"),
        file::to_toml(&Robot { tool_mm: nalgebra::Vector3::new(0.0, 0.0, 93.0), ..short }),
    )
    .unwrap();
    std::fs::write(at.join("t.csv"), "name,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\na,10,20,-15,5,40,30\n").unwrap();
    let readings = |identified: &str, out: &str| {
        let told =
            stereocal(at, &["compensate", "t.csv", "--robot", "bare.toml", "--identified", identified, "--out", out]);
        let said = stdout(&told) + &stderr(&told);
        assert_eq!(told.status.code(), Some(0), "{identified}: {said}");
        let text = std::fs::read_to_string(at.join(out).join("compensated.csv")).unwrap();
        let joints: Vec<f64> =
            text.lines().nth(1).unwrap().split(',').skip(1).take(6).map(|q| q.parse().unwrap()).collect();
        (joints, said)
    };
    let ((of_long, said), (of_short, _)) = (readings("long.toml", "a"), readings("short.toml", "b"));
    assert!(said.contains("what it has more is the tool's"), "{said}");
    // But for what the identified last link differs from the nominal one by, which is the tool's as well.
    assert!(of_long.iter().zip(&of_short).all(|(a, b)| (a - b).abs() < 0.1), "{of_long:?} {of_short:?}");
}

#[test]
fn a_tool_that_moved_is_the_only_reason_that_is_given() {
    let folder = workplace();
    let at = folder.path();
    let made = stereocal(at, &["robot", "new", "abb-irb120", "--out", "."]);
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    let path = Utf8Path::from_path(at).unwrap().join("robot.toml");
    let mut built = file::read(&path).unwrap();
    built.joints[1].a_mm += 0.3;
    let tools = [nalgebra::Vector3::new(30.0, 0.0, 80.0), nalgebra::Vector3::new(30.0, 12.0, 96.0)];
    let mut state = 5u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1u32 << 24) - 0.5
    };
    let mut text = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm\n".to_owned();
    for row in 0..100 {
        let joints: Vec<f64> = (0..6).map(|_| 90.0 * uniform()).collect();
        built.tool_mm = tools[usize::from(row >= 50)];
        let point = built.target_mm(&joints.iter().map(|q| q.to_radians()).collect::<Vec<_>>());
        let numbers: Vec<String> = joints
            .iter()
            .copied()
            .chain(point.iter().map(|v| v + 0.05 * uniform()))
            .map(|v| format!("{v:.6}"))
            .collect();
        text += &format!("{}\n", numbers.join(","));
    }
    std::fs::write(at.join("rows.csv"), text).unwrap();
    let identify = ["identify", "--measurements", "rows.csv", "--robot", "robot.toml", "--method", "trust-region"];
    // Without its steps, one of which is called as one of the causes.
    let told = stereocal(at, &[&identify[..], &["--quiet"]].concat());
    let (said, warned) = (stdout(&told), stderr(&told));
    assert_eq!(told.status.code(), Some(1), "{said}{warned}");
    assert!(said.contains("the tool moved on the flange by 20.0 mm from row"), "{said}");
    for other in ["too few rows", "sensor distortion", "sessions", "robot file is not of the robot"] {
        assert!(!warned.contains(other) && !said.contains(other), "{other}: {said}{warned}");
    }
}

#[test]
fn a_change_where_the_robot_was_not_identified_is_one_only_where_it_is_large() {
    let folder = identified();
    let at = folder.path();
    let found =
        ["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--robot", "robot.toml"];
    assert_eq!(stereocal(at, &[&found[..], &["--force", "--no-provenance"]].concat()).status.code(), Some(0));
    let record = at.join("out/identification.json");
    let of_all: serde_json::Value = serde_json::from_slice(&std::fs::read(&record).unwrap()).unwrap();
    let mut elsewhere = of_all.clone();
    let low = of_all["expected"]["joint_ranges"][3][0].as_f64().unwrap();
    elsewhere["expected"]["joint_ranges"][3] = serde_json::json!([low - 20.0, low - 10.0]);
    let said = |json: &serde_json::Value, by_deg: f64| {
        std::fs::write(&record, json.to_string()).unwrap();
        rows(at, |rows| {
            for row in rows {
                row[JOINT + 3] = (row[JOINT + 3].parse::<f64>().unwrap() + by_deg).to_string();
            }
        });
        let against =
            ["verify", "--measurements", "new.csv", "--against", "out/identified.toml", "--out", "checks", "--force"];
        let output = stereocal(at, &against);
        (stdout(&output), stderr(&output))
    };
    for (json, by_deg, standing, word) in [
        (&of_all, 0.2, "CHANGED", "the zero of joint 4"),
        (&elsewhere, 0.2, "UNDECIDED", "these poses stand where the robot was not identified (joint 4 in 12 rows"),
        (&elsewhere, 5.0, "CHANGED", "the zero of joint 4"),
    ] {
        let (told, _) = said(json, by_deg);
        assert!(told.starts_with(standing) && told.contains(word), "{by_deg}: {told}");
    }
    let (told, warned) = said(&elsewhere, 0.0);
    assert!(!told.contains("CHANGED"));
    // As `verify` without `--against` says it, of a robot that has such terms.
    let has_terms = std::fs::read_to_string(at.join("out/identified.toml")).unwrap().contains("terms =");
    assert_eq!(warned.contains("are outside: joint 4 in 12 rows"), has_terms, "{warned}");
    let (_, warned) = said(&of_all, 0.0);
    assert!(!warned.contains("are outside"), "{warned}");
}
