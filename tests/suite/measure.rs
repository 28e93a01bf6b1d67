//! `measure` as its users meet it: what it says of a rig or a target that is another, of bad poses, and of pictures
//! that arrive late.

use std::path::Path;
use std::sync::LazyLock;
use std::time::Duration;

use predicates::prelude::*;
use serde_json::Value;

use crate::run::{Files, files_below, stderr, stereocal, with_files, workplace};

/// A small world, calibrated.
fn calibrated() -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| {
        let folder = workplace();
        let at = folder.path();
        let world = ["simulate", "--preset", "small", "--size", "640", "--seed", "3", "--out", "."];
        let few = ["--samples", "12", "--verify", "0", "--check-pairs", "10"];
        let made = stereocal(at, &[&world[..], &few].concat());
        assert_eq!(made.status.code(), Some(0), "{}", stderr(&made));
        // What so few pairs allow to say of the rig is not the matter here.
        stereocal(at, &["camera-check", "check/", "--lens", "brown4", "--tolerance-mm", "0.5"]);
        assert!(at.join("out/calibration.json").is_file());
        files_below(at)
    });
    with_files(&MADE)
}

fn json(path: &Path) -> Value {
    let mut value: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
    // It holds the date and the command line.
    value.as_object_mut().unwrap().remove("provenance");
    value
}

fn column(path: &Path, name: &str) -> Vec<String> {
    let mut rows = csv::Reader::from_path(path).unwrap();
    let at = rows.headers().unwrap().iter().position(|c| c == name).unwrap();
    rows.records().map(|row| row.unwrap()[at].to_owned()).collect()
}

#[test]
fn another_size_of_squares_and_exchanged_pictures_end_the_run() {
    let folder = calibrated();
    let world = folder.path();
    let good = stereocal(world, &["measure", "poses/"]);
    assert_eq!(good.status.code(), Some(0), "{}", stderr(&good));
    assert!(!stderr(&good).contains("warning"), "{}", stderr(&good));
    let found = json(&world.join("out/measure.json"));
    assert_eq!(found.pointer("/rig/state").and_then(Value::as_str), Some("agrees"));
    let parameters = found.pointer("/shared/parameters").and_then(Value::as_array).unwrap().len();
    let rows = found.pointer("/shared/poses/0/sensitivity").and_then(Value::as_array).unwrap();
    assert!(rows.len() == 6 && rows.iter().all(|row| row.as_array().unwrap().len() == parameters));
    assert!(column(&world.join("out/measurements.csv"), "status").iter().all(|s| s == "ok"));
    let page = |out: &str| std::fs::read_to_string(world.join(out).join("measure.html")).unwrap();
    assert!(page("out").contains("<div class=\"verdict good\">"));

    // A rig that did not pass, and one of which it is not known to what its lengths can be trusted.
    for trusted_mm in [serde_json::json!(0.2), Value::Null] {
        let mut rig = json(&world.join("out/calibration.json"));
        rig["check"] = serde_json::json!({"verdict": "fail", "tolerance_mm": 0.05, "trusted_mm": trusted_mm});
        std::fs::write(world.join("doubted.json"), rig.to_string()).unwrap();
        let doubted =
            stereocal(world, &["measure", "poses/", "--calibration", "doubted.json", "--out", "doubted", "--force"]);
        assert_eq!(doubted.status.code(), Some(0), "{}", stderr(&doubted));
        assert!(page("doubted").contains("<div class=\"verdict doubtful\">"));
        assert!(page("doubted").contains("this rig did not pass its check (FAIL at a tolerance of 0.05 mm)"));
    }

    let large = stereocal(
        world,
        &["measure", "poses/", "--square-mm", "12", "--calibration", "out/calibration.json", "--out", "large"],
    );
    assert_eq!(large.status.code(), Some(3));
    let said = predicate::str::is_match(r"squares are (9\.99|10\.00)\d* mm, not 12 mm").unwrap();
    assert!(said.eval(&stderr(&large)), "{}", stderr(&large));
    assert!(column(&world.join("large/measurements.csv"), "status").iter().all(|s| s.contains("rig changed")));

    for (from, to) in [("left", "aside"), ("right", "left"), ("aside", "right")] {
        std::fs::rename(world.join("poses").join(from), world.join("poses").join(to)).unwrap();
    }
    let exchanged =
        stereocal(world, &["measure", "poses/", "--calibration", "out/calibration.json", "--out", "exchanged"]);
    assert_eq!(exchanged.status.code(), Some(3));
    assert!(stderr(&exchanged).contains("exchanged"), "{}", stderr(&exchanged));
}

#[test]
fn names_that_a_spreadsheet_took_zeros_from_find_their_pictures() {
    let folder = calibrated();
    let world = folder.path();
    assert_eq!(stereocal(world, &["measure", "poses/"]).status.code(), Some(0));
    let list = world.join("poses/poses.csv");
    let names = column(&list, "pose");
    let points = column(&world.join("out/measurements.csv"), "x_mm");
    // Pictures 001, 002, ...; the list has 1, 2, ... as a spreadsheet writes them, and one pose that nobody
    // photographed.
    for (k, name) in names.iter().enumerate() {
        for side in ["left", "right"] {
            let at = |name: &str| world.join(format!("poses/{side}/{name}.png"));
            std::fs::rename(at(name), at(&format!("of-{:03}", k + 1))).unwrap();
        }
    }
    for k in 1..=names.len() {
        for side in ["left", "right"] {
            let at = |prefix: &str| world.join(format!("poses/{side}/{prefix}{k:03}.png"));
            std::fs::rename(at("of-"), at("")).unwrap();
        }
    }
    let text = std::fs::read_to_string(&list).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (k, line) in lines.iter_mut().skip(1).enumerate() {
        *line = format!("{},{}", k + 1, line.split_once(',').unwrap().1);
    }
    lines.push(lines.last().unwrap().replacen(&format!("{},", names.len()), "77,", 1));
    lines.push(lines.last().unwrap().replacen("77,", "78,", 1));
    std::fs::write(&list, lines.join("\n") + "\n").unwrap();
    std::fs::copy(world.join("poses/left/001.png"), world.join("poses/left/stray.png")).unwrap();
    let again = stereocal(world, &["measure", "poses/", "--force"]);
    let said = stderr(&again);
    assert_eq!(said.matches("left out: 1 picture without a partner (stray.png)").count(), 1, "{said}");
    assert_eq!(again.status.code(), Some(0), "{said}");
    assert!(said.contains("`1` of poses.csv is picture `001`"), "{said}");
    assert!(said.contains("poses 77, 78 are not measured: no pictures of this name"), "{said}");
    assert_eq!(column(&world.join("out/measurements.csv"), "x_mm")[..names.len()], points);
}

#[test]
fn poses_beyond_the_depth_of_the_boards_are_named() {
    let folder = calibrated();
    let world = folder.path();
    let path = world.join("out/calibration.json");
    let rig: Value = serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let depth = |end: usize| rig.pointer(&format!("/volume/depth_mm/{end}")).and_then(Value::as_f64).unwrap();
    let (nearest, farthest) = (depth(0), depth(1));
    assert!(nearest > 100.0 && farthest > nearest && farthest < 2000.0, "{nearest} {farthest}");
    // Boards that stood elsewhere, by shares of their depth.
    for (share, named) in [(1.0, false), (1.05, false), (1.6, true), (0.5, true)] {
        let mut other = rig.clone();
        other["volume"]["depth_mm"] = serde_json::json!([share * nearest, share * farthest]);
        std::fs::write(world.join("rig.json"), other.to_string()).unwrap();
        let measured =
            stereocal(world, &["measure", "poses/", "--calibration", "rig.json", "--out", "other", "--force"]);
        assert_eq!(measured.status.code(), Some(0), "{}", stderr(&measured));
        let said = stderr(&measured);
        assert_eq!(said.contains("outside of where the boards were"), named, "{share}: {said}");
        assert!(!named || said.contains(" more;"), "{said}");
    }
}

#[test]
fn pictures_that_arrive_late_give_the_same_bytes() {
    let folder = calibrated();
    let world = folder.path().to_owned();
    let late = world.join("late");
    for side in ["left", "right"] {
        std::fs::create_dir_all(late.join(side)).unwrap();
    }
    std::fs::copy(world.join("poses/poses.csv"), late.join("poses.csv")).unwrap();
    let arrive = {
        let (world, late) = (world.clone(), late.clone());
        std::thread::spawn(move || {
            let names = column(&late.join("poses.csv"), "pose");
            // Backwards, the right one first, and every third in two parts.
            for (k, name) in names.iter().rev().enumerate() {
                for side in ["right", "left"] {
                    let file = format!("{side}/{name}.png");
                    let bytes = std::fs::read(world.join("poses").join(&file)).unwrap();
                    if k % 3 == 0 {
                        std::fs::write(late.join(&file), &bytes[..bytes.len() / 2]).unwrap();
                        std::thread::sleep(Duration::from_millis(150));
                    }
                    std::fs::write(late.join(&file), &bytes).unwrap();
                }
                std::thread::sleep(Duration::from_millis(40));
            }
        })
    };
    let rig = ["--calibration", "out/calibration.json", "--out"];
    let watched = stereocal(&world, &[&["measure", "late", "--watch"], &rig[..], &["watched"]].concat());
    arrive.join().unwrap();
    assert_eq!(watched.status.code(), Some(0), "{}", stderr(&watched));
    let after = stereocal(&world, &[&["measure", "late"], &rig[..], &["after"]].concat());
    assert_eq!(after.status.code(), Some(0), "{}", stderr(&after));
    let bytes = |out: &str| std::fs::read(world.join(out).join("measurements.csv")).unwrap();
    assert!(bytes("watched") == bytes("after"));
    assert_eq!(json(&world.join("watched/measure.json")), json(&world.join("after/measure.json")));
    // The page's pictures are the same from the copies that were kept and from the files.
    let again = || {
        let run = stereocal(&world, &[&["measure", "late", "--no-provenance"], &rig[..], &["after"]].concat());
        assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
        std::fs::read(world.join("after/measure.html")).unwrap()
    };
    let kept = again();
    std::fs::remove_dir_all(world.join("after/.stereocal/thumbnails")).unwrap();
    assert!(again() == kept);
}
