//! Poses that come as pictures, joint angles that belong to other pictures, and cameras on the hand.

use std::path::Path;

use camino::Utf8Path;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde_json::Value;
use stereocal::robot;

use crate::run::{stderr, stdout, stereocal, workplace};

/// A world of few pictures, with what was sent to the robot and what is true.
fn pictures() -> tempfile::TempDir {
    let folder = workplace();
    let world = ["simulate", "--preset", "small", "--size", "640", "--check-pairs", "0", "--seed", "6", "--out", "."];
    let made = stereocal(folder.path(), &[&world[..], &["--samples", "32", "--verify", "0"]].concat());
    assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
    folder
}

/// Poses whose joint angles are, from a row on, those of a row so much further down; the pictures keep their names.
fn shifted(text: &str, from: usize, by: isize) -> String {
    let rows: Vec<(&str, &str)> = text.lines().map(|line| line.split_once(',').unwrap()).collect();
    let of = |(i, (pose, own)): (usize, &(&str, &str))| {
        let told = if i < from { Some(*own) } else { i.checked_add_signed(by).and_then(|k| Some(rows.get(k)?.1)) };
        told.map(|told| format!("{pose},{told}\n"))
    };
    rows.iter().enumerate().filter_map(of).collect()
}

#[test]
fn pictures_that_belong_to_other_rows_are_said_with_where_and_by_how_much() {
    let folder = pictures();
    let at = folder.path();
    let list = at.join("poses/poses.csv");
    let text = std::fs::read_to_string(&list).unwrap();
    let measure = |text: &str, status: i32| {
        std::fs::write(&list, text).unwrap();
        let measured = stereocal(at, &["measure", "poses", "--calibration", "truth/calibration.json", "--force"]);
        assert_eq!(measured.status.code(), Some(status), "{}", stderr(&measured));
        stderr(&measured)
    };
    let clean = measure(&text, 0);
    assert!(!clean.contains("do not belong together"), "{clean}");
    let names: Vec<&str> = text.lines().map(|line| line.split(',').next().unwrap()).collect();
    for (from, by, words) in [(14, 1, "1 row further up"), (14, 2, "2 rows further up"), (24, -1, "1 row further down")]
    {
        let said = measure(&shifted(&text, from, by), 1);
        assert!(said.contains("points and joint angles do not belong together"), "{from} {by}: {said}");
        // The first point whose joint angles stand in another row; a neighbouring pose may be as near.
        let first = from.saturating_add_signed(by.max(0));
        let near = [first - 1, first, first + 1].map(|i| format!("from pose {} on", names[i]));
        assert!(near.iter().any(|place| said.contains(place)), "{from} {by}: {said}");
        assert!(said.contains(&format!("is of the pose {words} in the file")), "{from} {by}: {said}");
        assert!(said.contains("mend poses.csv or the pictures' names"), "{said}");
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

fn placement(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path.join("placement.json")).unwrap()).unwrap()
}

#[test]
fn locate_measures_pictures_first() {
    let folder = pictures();
    let at = folder.path();
    let robot = ["--robot", "truth/robot.toml"];
    let rig = ["--calibration", "truth/calibration.json", "--out", "seen"];
    let seen = stereocal(at, &[&["locate", "poses"], &robot[..], &rig].concat());
    assert_eq!(seen.status.code(), Some(0), "{}{}", stdout(&seen), stderr(&seen));
    assert!(stdout(&seen).starts_with("base from rig"), "{}", stdout(&seen));
    assert!(at.join("seen/measurements.csv").is_file());
    let exact = stereocal(at, &[&["locate", "truth/measurements.csv"], &robot[..], &["--out", "exact"]].concat());
    assert_eq!(exact.status.code(), Some(0), "{}{}", stdout(&exact), stderr(&exact));
    let [seen, exact] = ["seen", "exact"].map(|out| placement(&at.join(out)));
    let [a, b] = [&seen, &exact].map(|p| p["groups"].as_array().unwrap());
    assert!(a.len() == b.len() && a.len() > 1);
    for (a, b) in a.iter().zip(b) {
        let off = |key: &str| {
            let [a, b] = [a, b].map(|group| numbers(&group["base_from_rig"][key]));
            a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
        };
        assert!(off("translation_mm") < 0.1 && off("rotation") < 2e-4, "{a} {b}");
    }
    let nothing = stereocal(at, &[&["locate", "poses"], &robot[..], &["--out", "none"]].concat());
    assert_eq!(nothing.status.code(), Some(2));
    assert!(stderr(&nothing).contains("calibration.json"), "{}", stderr(&nothing));
}

/// A table of a target before cameras on the hand, as they see it, or the other way round as the hint says.
fn on_hand(at: &Path, hand: &Isometry3<f64>, inverted: bool) -> String {
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let robot = robot::file::read(Utf8Path::from_path(&at.join("truth/robot.toml")).unwrap()).unwrap();
    let board = Isometry3::from_parts(
        Translation3::new(420.0, -150.0, 20.0),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.2, 0.1, -0.7)),
    );
    let mut out = "pose,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad\n".to_owned();
    for line in text.lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let joints: Vec<f64> = fields[3..9].iter().map(|j| j.parse::<f64>().unwrap().to_radians()).collect();
        let seen = (robot.base_from_flange(&joints) * hand).inverse() * board;
        let told = if inverted { seen.inverse() } else { seen };
        let (p, r) = (told.translation.vector, told.rotation.scaled_axis());
        let joints = fields[3..9].join(",");
        out += &format!("{},{joints},{},{},{},{},{},{}\n", fields[0], p.x, p.y, p.z, r.x, r.y, r.z);
    }
    out
}

#[test]
fn cameras_on_the_hand_are_refused_and_what_the_hint_says_works() {
    let folder = workplace();
    let at = folder.path();
    let made = ["simulate", "--points-only", "--samples", "40", "--verify", "0", "--seed", "9", "--out", "."];
    assert_eq!(stereocal(at, &made).status.code(), Some(0));
    let hand = Isometry3::from_parts(
        Translation3::new(30.0, -60.0, 80.0),
        UnitQuaternion::from_scaled_axis(Vector3::new(0.2, -0.4, 0.1)),
    );
    std::fs::write(at.join("hand.csv"), on_hand(at, &hand, false)).unwrap();
    std::fs::write(at.join("inverse.csv"), on_hand(at, &hand, true)).unwrap();
    let commands: [&[&str]; 2] = [
        &["identify", "--measurements", "hand.csv", "--robot", "robot.toml", "--method", "trust-region"],
        &["locate", "hand.csv", "--robot", "truth/robot.toml"],
    ];
    for command in commands {
        let refused = stereocal(at, command);
        let said = stderr(&refused);
        assert_eq!(refused.status.code(), Some(2), "{command:?}: {}{said}", stdout(&refused));
        assert!(
            said.contains("the points move as those of cameras on the flange before a target that stands still"),
            "{said}"
        );
        assert!(said.contains("hint: with orientations, give each row the inverse of its pose"), "{said}");
        assert!(!at.join("out/placement.json").exists() && !at.join("out/identified.toml").exists());
    }
    let located = stereocal(at, &["locate", "inverse.csv", "--robot", "truth/robot.toml"]);
    assert_eq!(located.status.code(), Some(0), "{}{}", stdout(&located), stderr(&located));
    let target = &placement(&at.join("out"))["flange_from_target"];
    let off =
        numbers(&target["translation_mm"]).into_iter().zip(hand.translation.vector.iter()).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 0.2, "{target}");
    let turn = hand.rotation.to_rotation_matrix();
    // Three rows of three.
    let rows = numbers(&target["rotation"]);
    assert!(rows.iter().enumerate().all(|(k, v)| (v - turn[(k / 3, k % 3)]).abs() < 1e-3), "{target}");
}
