//! Placements of rows that are not what they seem to be, and the instrument that stands elsewhere on another day.

use std::path::Path;
use std::sync::LazyLock;

use serde_json::Value;

use crate::run::{Files, files_below, stderr, stdout, stereocal, with_files, workplace};

/// Points of 120 poses of four placements, and of a robot that is known.
fn simulated() -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| {
        let folder = workplace();
        let made = ["simulate", "--points-only", "--samples", "120", "--verify", "0", "--seed", "4", "--out", "."];
        assert_eq!(stereocal(folder.path(), &made).status.code(), Some(0));
        files_below(folder.path())
    });
    with_files(&MADE)
}

/// Six joints, deg, and a point, mm, of each row of the first placement.
fn rows(at: &Path) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let lines: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let of_first = lines.iter().filter(|fields| fields[1] == lines[0][1]);
    of_first.map(|fields| fields[3..12].iter().map(|v| v.parse().unwrap()).collect()).collect()
}

/// A table without orientations, as a tracker writes it.
fn write(at: &Path, rows: &[Vec<f64>]) {
    let line = |row: &Vec<f64>| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",") + "\n";
    let body: String = rows.iter().map(line).collect();
    std::fs::write(at.join("new.csv"), format!("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg,x_mm,y_mm,z_mm\n{body}"))
        .unwrap();
}

/// Status, words and placement.
fn located(at: &Path, rows: &[Vec<f64>], robot: &str) -> (i32, String, Value) {
    write(at, rows);
    let told = stereocal(at, &["locate", "new.csv", "--robot", robot, "--out", "there", "--force"]);
    let said = stdout(&told) + &stderr(&told);
    let placement = std::fs::read_to_string(at.join("there/placement.json")).unwrap_or_else(|_| panic!("{said}"));
    (told.status.code().unwrap(), said, serde_json::from_str(&placement).unwrap())
}

fn exported(at: &Path) -> (i32, String) {
    let told = stereocal(
        at,
        &["export", "placement", "--placement", "there/placement.json", "--format", "opencv", "--out", "e", "--force"],
    );
    (told.status.code().unwrap(), stdout(&told) + &stderr(&told))
}

#[test]
fn a_placement_of_mended_rows_is_to_be_checked_and_one_of_mirrored_points_stays_here() {
    let folder = simulated();
    let at = folder.path();
    let clean = rows(at);
    let changed = |change: &dyn Fn(&mut [f64])| {
        let mut rows = clean.clone();
        rows.iter_mut().for_each(|row| change(&mut row[6..]));
        located(at, &rows, "truth/robot.toml")
    };
    let (status, said, placement) = changed(&|_| {});
    assert!(status == 0 && !said.contains("check before"), "{said}");
    assert!(placement.get("check").is_none() && placement.get("mirrored").is_none(), "{placement}");
    assert_eq!(exported(at).0, 0);
    let shift = |placement: &Value| placement["groups"][0]["base_from_rig"]["translation_mm"][0].as_f64().unwrap();
    let right = shift(&placement);
    // Of inches the place is right all the same.
    let (status, said, placement) = changed(&|point| point.iter_mut().for_each(|v| *v /= 25.4));
    assert!(status == 1 && said.contains("check before you use this placement: the warnings say"), "{said}");
    assert!(placement["check"]["reason"].as_str().unwrap().contains("in inches, not in mm"), "{placement}");
    assert!((shift(&placement) - right).abs() < 0.1, "{placement}");
    let (status, said) = exported(at);
    assert!(status == 0 && said.contains("check before you use there/placement.json"), "{said}");
    for axis in 0..3 {
        let (status, said, placement) = changed(&|point| point[axis] *= -1.0);
        assert!(status == 1 && said.contains("of points whose x is negated"), "{axis}: {said}");
        assert_eq!(placement["mirrored"], true);
        assert!(placement["check"]["reason"].as_str().unwrap().contains("whether x, y or z"), "{placement}");
        let (status, said) = exported(at);
        assert!(status == 2 && said.contains("left-handed") && said.contains("stereocal locate"), "{axis}: {said}");
    }
    // Two axes are half a turn.
    let (status, said, placement) = changed(&|point| point[..2].iter_mut().for_each(|v| *v *= -1.0));
    assert!(status == 0 && placement.get("mirrored").is_none(), "{said}");
}

#[test]
fn several_places_of_one_group_have_their_rows_and_files() {
    let folder = simulated();
    let at = folder.path();
    let mut moved = rows(at);
    let (half, count) = (moved.len() / 2, moved.len());
    moved[half..].iter_mut().for_each(|row| row[6] += 5.0);
    let (_, said, placement) = located(at, &moved, "truth/robot.toml");
    assert!(said.contains("the rows fall into 2 sessions, between which the sensor, the robot's base or"), "{said}");
    let names = [format!("rows 1 to {half}"), format!("rows {} to {count}", half + 1)];
    assert!(names.iter().all(|name| said.contains(&format!("base from instrument, 1, {name}: "))), "{said}");
    assert_eq!(placement["groups"][1]["rows"], serde_json::json!([(half + 1).to_string(), count.to_string()]));
    let (status, said) = exported(at);
    let file = |first: usize, last: usize| at.join(format!("e/placement_opencv_1_{first}_to_{last}.yml"));
    let [before, after] = [file(1, half), file(half + 1, count)].map(|file| std::fs::read_to_string(file).unwrap());
    assert!(status == 0 && before != after, "{said}");
}

#[test]
fn rows_that_contradict_the_robot_or_each_other_are_no_success() {
    let folder = simulated();
    let at = folder.path();
    let all = rows(at);
    for count in [4, 8, 31] {
        let mut few = all[..count].to_vec();
        assert_eq!(located(at, &few, "truth/robot.toml").0, 0, "{count}");
        // Of two points that were misread nothing tells which rows are wrong.
        few[1][6] += 4.0;
        few[2][7] -= 4.0;
        let (status, said, placement) = located(at, &few, "truth/robot.toml");
        assert!(status == 1 && said.contains("use this placement: "), "{count}: {said}");
        assert!(placement["check"]["reason"].is_string(), "{placement}");
        let (status, said, _) = located(at, &all[..count], "robot.toml");
        assert_eq!(status, 1, "{count}: {said}");
    }
}

#[test]
fn an_instrument_that_stands_elsewhere_is_taken_from_its_new_placement_on() {
    let folder = simulated();
    let at = folder.path();
    let found =
        ["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--extensions", "none"];
    let found = stereocal(at, &[&found[..], &["--robot", "robot.toml", "--force"]].concat());
    assert_eq!(found.status.code(), Some(0), "{}{}", stdout(&found), stderr(&found));
    // New points of the first placement, which differ from those of the identification by some micrometres, turned and
    // shifted.
    let mut day = rows(at)[..20].to_vec();
    for (k, row) in day.iter_mut().enumerate() {
        let (x, y) = (row[6] + 0.003 * (k as f64).sin(), row[7] + 0.003 * (1.7 * k as f64).cos());
        (row[6], row[7], row[8]) = (400.0 - y, x - 250.0, row[8] + 30.0);
    }
    let (status, said, _) = located(at, &day, "out/identified.toml");
    assert_eq!(status, 0, "{said}");
    let check = |more: &[&str]| {
        let against = ["verify", "--measurements", "new.csv", "--against", "out/identified.toml", "--out", "v"];
        let told = stereocal(at, &[&against[..], &["--tolerance-mm", "2", "--force"], more].concat());
        (told.status.code().unwrap(), stdout(&told) + &stderr(&told))
    };
    let (status, said) = check(&[]);
    assert!(status == 3 && said.contains("the instrument stands elsewhere"), "{said}");
    assert!(said.contains("`--placement DIR/placement.json` then checks with it"), "{said}");
    let (status, said) = check(&["--placement", "there/placement.json"]);
    assert!(status == 0 && said.contains("STILL VALID") && said.contains("next: go on with this robot"), "{said}");
    // A robot that is to be checked is not simply gone on with.
    let path = at.join("out/identified.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let record = at.join("out/identification.json");
    let mut json: Value = serde_json::from_slice(&std::fs::read(&record).unwrap()).unwrap();
    json.as_object_mut().unwrap().remove("provenance");
    std::fs::write(&record, json.to_string()).unwrap();
    let (before, after) = text.split_once("[check]\n").unwrap();
    let after = after.split_once("\n\n").unwrap().1;
    let doubted = format!("{before}[check]\nadvice = \"check\"\nreason = \"the floor shook\"\n\n{after}");
    std::fs::write(&path, doubted).unwrap();
    let (status, said) = check(&["--placement", "there/placement.json"]);
    assert!(status == 0 && !said.contains("go on with this robot"), "{said}");
    assert!(said.contains("what its own `check` says of it stands"), "{said}");
    // One in another frame is not compared with, and one of other groups is none of these rows.
    let other = std::fs::read_to_string(at.join("there/placement.json")).unwrap();
    let mut mirrored: Value = serde_json::from_str(&other).unwrap();
    mirrored["mirrored"] = true.into();
    std::fs::write(at.join("mirrored.json"), mirrored.to_string()).unwrap();
    let (status, said) = check(&["--placement", "mirrored.json"]);
    assert!(status == 0 && said.contains("where the sensor stands is not compared"), "{said}");
    std::fs::write(at.join("other.json"), other.replacen("\"group\": \"1\"", "\"group\": \"far\"", 1)).unwrap();
    let (status, said) = check(&["--placement", "other.json"]);
    assert!(status == 2 && said.contains("other.json is of group far, and the rows are of 1"), "{said}");
}
