//! Where results come from, and what a run must not overwrite.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use crate::run::{program, stderr, stdout, stereocal, workplace};

const POINTS: [&str; 6] = ["simulate", "--points-only", "--preset", "small", "--out", "."];
const IDENTIFY: [&str; 5] = ["identify", "--measurements", "measurements.csv", "--method", "trust-region"];

fn at_date(folder: &Path, seconds: &str, arguments: &[&str]) -> Output {
    let output = Command::new(program())
        .current_dir(folder)
        .env("SOURCE_DATE_EPOCH", seconds)
        .args(arguments)
        .output()
        .expect("it starts");
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    output
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_result_says_what_it_was_made_of() {
    let folder = workplace();
    let path = folder.path();
    at_date(path, "0", &POINTS);
    let output = at_date(path, "1700000000", &[&IDENTIFY[..], &["--json"]].concat());
    let printed: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let written = json(&path.join("out/identification.json"));
    assert_eq!(printed, written);
    let provenance = &written["provenance"];
    assert_eq!(provenance["program"], format!("stereocal {}", env!("CARGO_PKG_VERSION")));
    assert_eq!(provenance["date"], "2023-11-14T22:13:20Z");
    assert_eq!(provenance["command"], format!("stereocal {} --json", IDENTIFY.join(" ")));
    assert_eq!(provenance["inputs"][0]["file"], "measurements.csv");
    assert_eq!(provenance["inputs"][1]["file"], "robot.toml");
    // The hash is that which `sha256sum` prints.
    let sum = Command::new("sha256sum").arg(path.join("measurements.csv")).output().expect("coreutils");
    let sum = stdout(&sum);
    let hash = provenance["inputs"][0]["sha256"].as_str().unwrap();
    assert!(sum.starts_with(hash), "{sum} {hash}");
    for file in ["identify.html", "identified.toml"] {
        let text = std::fs::read_to_string(path.join("out").join(file)).unwrap();
        for part in [hash, "2023-11-14T22:13:20Z", "stereocal identify --measurements measurements.csv"] {
            assert!(text.contains(part), "{file} does not say {part}");
        }
    }
}

#[test]
fn two_runs_differ_by_their_date_alone() {
    let folder = workplace();
    let path = folder.path();
    at_date(path, "0", &POINTS);
    let run = |date: &str| {
        at_date(path, date, &IDENTIFY);
        ["identification.json", "identify.html", "identified.toml"]
            .map(|name| std::fs::read_to_string(path.join("out").join(name)).unwrap())
    };
    let (first, again, later) = (run("0"), run("0"), run("86400"));
    assert!(first == again, "the same date gives other bytes");
    for (first, later) in first.iter().zip(&later) {
        assert_ne!(first, later);
        // identified.toml holds the date too, so its hash in the others' list of outputs differs with it.
        let dateless = |text: &str| -> Vec<String> {
            let text = text.replace("1970-01-02", "1970-01-01");
            text.split_inclusive(['\n', '>', '<']).filter(|part| !is_hash(part)).map(str::to_owned).collect()
        };
        assert_eq!(dateless(first), dateless(later));
    }
}

/// Whether a line of JSON or a piece of HTML is a SHA-256.
fn is_hash(part: &str) -> bool {
    part.split(|c: char| !c.is_ascii_alphanumeric())
        .any(|word| word.len() == 64 && word.chars().all(|c| c.is_ascii_hexdigit()))
}

#[test]
fn provenance_can_be_left_out() {
    let folder = workplace();
    let path = folder.path();
    at_date(path, "0", &[&POINTS[..], &["--no-provenance"]].concat());
    at_date(path, "0", &[&IDENTIFY[..], &["--no-provenance"]].concat());
    assert!(json(&path.join("out/identification.json")).get("provenance").is_none());
    for file in ["identify.html", "identified.toml"] {
        let text = std::fs::read_to_string(path.join("out").join(file)).unwrap();
        assert!(!text.contains("1970-01-01") && !text.contains("sha256"), "{file}");
    }
}

#[test]
fn foreign_files_stay_unless_forced() {
    let folder = workplace();
    let path = folder.path();
    std::fs::write(path.join("robot.toml"), "# my own robot\n").unwrap();
    let refused = stereocal(path, &POINTS);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("robot.toml is there already") && stderr(&refused).contains("--force"),
        "{}",
        stderr(&refused)
    );
    assert_eq!(std::fs::read_to_string(path.join("robot.toml")).unwrap(), "# my own robot\n");
    assert!(!path.join("measurements.csv").exists(), "refused before the work, not in its middle");
    at_date(path, "0", &[&POINTS[..], &["--force"]].concat());
    // Its own files it replaces without asking; not so one that was edited since.
    at_date(path, "0", &[&POINTS[..], &["--seed", "2"]].concat());
    let own = std::fs::read_to_string(path.join("measurements.csv")).unwrap();
    std::fs::write(path.join("measurements.csv"), own.replace(",ok", ",bumped")).unwrap();
    assert_eq!(stereocal(path, &POINTS).status.code(), Some(2));
}

#[test]
fn an_input_is_not_overwritten_even_by_force() {
    let folder = workplace();
    let path = folder.path();
    at_date(path, "0", &POINTS);
    at_date(path, "0", &[&IDENTIFY[..], &["--out", "."]].concat());
    let before = std::fs::read(path.join("identified.toml")).unwrap();
    let again = [&IDENTIFY[..], &["--robot", "identified.toml", "--out", "./", "--force"]].concat();
    let refused = stereocal(path, &again);
    assert_eq!(refused.status.code(), Some(2));
    assert!(stderr(&refused).contains("is read by this run"), "{}", stderr(&refused));
    assert_eq!(std::fs::read(path.join("identified.toml")).unwrap(), before);
}

#[test]
fn quiet_and_plain_progress() {
    let folder = workplace();
    let path = folder.path();
    at_date(path, "0", &POINTS);
    let said = |arguments: &[&str]| stderr(&stereocal(path, &[&IDENTIFY[..], arguments].concat()));
    assert!(said(&[]).contains("nominal robot: robot.toml"));
    let quiet = said(&["--quiet"]);
    assert!(!quiet.contains("nominal robot"), "{quiet}");
    for line in said(&["--threads", "1"]).lines() {
        assert!(!line.contains('\u{1b}') && !line.contains('\r'), "{line}");
    }
}
