//! What a run's own words advise against is said by every command that uses its files: a robot that `identify` said not
//! to use.

use std::path::Path;
use std::sync::LazyLock;

use stereocal::formats::calibration::CalibrationFile;
use stereocal::simulate::rig::true_rig;

use crate::run::{Files, files_below, stderr, stdout, stereocal, with_files, workplace};

/// A robot with points of 52 poses, identified into `out` as it is, or with a file of another arm.
fn identified(robot: &str) -> tempfile::TempDir {
    static MADE: LazyLock<Files> = LazyLock::new(|| files_below(made("robot.toml").path()));
    if robot == "robot.toml" { with_files(&MADE) } else { made(robot) }
}

fn made(robot: &str) -> tempfile::TempDir {
    let folder = workplace();
    let at = folder.path();
    let made = ["simulate", "--points-only", "--samples", "40", "--verify", "12", "--seed", "4", "--out", "."];
    assert_eq!(stereocal(at, &made).status.code(), Some(0));
    assert_eq!(stereocal(at, &["robot", "new", "ur5e", "--out", "ur5e"]).status.code(), Some(0));
    let found = [
        &["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--extensions", "none"][..],
        &["--robot", robot, "--no-provenance"],
    ];
    let found = stereocal(at, &found.concat());
    let [said, messages] = [stdout(&found), stderr(&found)];
    let status = if robot == "robot.toml" { 0 } else { 1 };
    assert_eq!(found.status.code(), Some(status), "{said}{messages}");
    // What was written, and one thing to do next.
    assert!(said.contains("written: out/identified.toml, out/placement.json;"), "{said}");
    assert_eq!(said.lines().filter(|line| line.starts_with("next: ")).count(), 1, "{said}");
    assert!(said.lines().count() + messages.lines().count() <= 25, "{said}{messages}");
    folder
}

/// Gives the identified robot these words, as a run with other rows would have.
fn advise(at: &Path, advice: &str) {
    let path = at.join("out/identified.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, after) = text.split_once("[check]\n").unwrap();
    let rest = after.split_once("\n\n").unwrap().1;
    std::fs::write(path, format!("{before}[check]\nadvice = \"{advice}\"\nreason = \"the floor shook\"\n\n{rest}"))
        .unwrap();
}

/// Each command that uses the robot, and the status that it has where nothing speaks against it; then what it says and
/// with which status.
fn used(at: &Path) -> Vec<(&'static str, i32, String)> {
    let rows = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let pose: Vec<&str> = rows.lines().nth(1).unwrap().split(',').collect();
    let target = format!("name,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\na,{}\n", pose[3..9].join(","));
    std::fs::write(at.join("targets.csv"), target).unwrap();
    let with_robot = ["--robot", "out/identified.toml"];
    let commands: [&[&str]; 6] = [
        &["compensate", "targets.csv", "--robot", "robot.toml", "--identified", "out/identified.toml", "--out", "c"],
        &[&["export", "robot", "--format", "urdf", "--out", "e"], &with_robot[..]].concat(),
        &[&["export", "robot", "--format", "toml", "--out", "e"], &with_robot[..]].concat(),
        &[&["export", "robot", "--format", "dh-csv", "--out", "e"], &with_robot[..]].concat(),
        &[&["locate", "truth/measurements.csv", "--out", "l"], &with_robot[..]].concat(),
        &["verify", "--measurements", "truth/measurements.csv", "--against", "out/identified.toml", "--out", "v"],
    ];
    let names = ["compensate", "urdf", "toml", "dh-csv", "locate", "verify"];
    let run = |(name, arguments): (&'static str, &&[&str])| {
        let output = stereocal(at, arguments);
        (name, output.status.code().unwrap(), stdout(&output) + &stderr(&output))
    };
    names.into_iter().zip(&commands).map(run).collect()
}

#[test]
fn a_robot_that_is_advised_against_is_used_with_its_reason_and_a_status() {
    let folder = identified("robot.toml");
    let at = folder.path();
    let clean = used(at);
    for (name, status, said) in &clean {
        assert!(!said.contains("says its own `check`"), "{name}: {said}");
        // Rows that the robot was identified from say nothing of it.
        assert_eq!(*status, i32::from(*name == "verify"), "{name}: {said}");
    }
    advise(at, "do-not-use");
    for (name, status, said) in used(at) {
        assert!(
            said.contains("do not use out/identified.toml, says its own `check`: the floor shook"),
            "{name}: {said}"
        );
        assert_eq!(status, 1, "{name}: {said}");
    }
    for file in ["c/compensated.csv", "e/robot.urdf", "e/robot.toml", "e/robot.csv", "l/placement.json"] {
        assert!(at.join(file).is_file(), "{file} was not written");
    }
    // The words go on with the files.
    let again = stereocal(at, &["export", "robot", "--robot", "e/robot.toml", "--format", "urdf", "--out", "f"]);
    assert!(again.status.code() == Some(1) && stderr(&again).contains("the floor shook"), "{}", stderr(&again));
    let placed = ["export", "placement", "--placement", "l/placement.json", "--format", "opencv", "--out", "p"];
    let placed = stereocal(at, &placed);
    assert!(placed.status.code() == Some(1) && stderr(&placed).contains("the floor shook"), "{}", stderr(&placed));
    advise(at, "check");
    for ((name, status, said), (_, before, _)) in used(at).into_iter().zip(clean) {
        assert!(
            said.contains("check before you use out/identified.toml") && said.contains("the floor shook"),
            "{said}"
        );
        assert_eq!(status, before, "{name}: {said}");
    }
}

/// A file in which one length is 7 mm off, as of a sister model, fits as well as the right one; targets that are
/// compensated from it would not.
#[test]
fn a_length_that_nobody_builds_so_is_named_by_whatever_uses_the_robot() {
    let folder = identified("robot.toml");
    let at = folder.path();
    let robot = std::fs::read_to_string(at.join("robot.toml")).unwrap();
    for (a_mm, status) in [("-263.0", 0), ("-257.0", 1)] {
        std::fs::write(at.join("robot.toml"), robot.replace("a_mm = -264.0", &format!("a_mm = {a_mm}"))).unwrap();
        let found = ["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--force"];
        let found = stereocal(at, &[&found[..], &["--extensions", "none", "--robot", "robot.toml"]].concat());
        let (said, named) =
            (stdout(&found), "links are found farther from the robot file's than makers build them (a_2 -");
        assert_eq!((found.status.code(), said.contains(named)), (Some(status), status == 1), "{a_mm}: {said}");
        let (_, of_compensate, said) = used(at).swap_remove(0);
        assert_eq!((of_compensate, said.contains(named)), (status, status == 1), "{a_mm}: {said}");
    }
}

#[test]
fn a_run_that_fails_says_that_the_results_beside_it_are_older() {
    let folder = identified("robot.toml");
    let at = folder.path();
    let failed = |out: &str| {
        let output =
            stereocal(at, &["identify", "--measurements", "nowhere.csv", "--robot", "robot.toml", "--out", out]);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        stderr(&output)
    };
    // Without provenance the result has no date.
    assert!(!failed("out").contains("earlier run"));
    let again = ["--measurements", "truth/measurements.csv", "--method", "trust-region", "--extensions", "none"];
    let done = stereocal(at, &[&["identify", "--robot", "robot.toml"], &again[..]].concat());
    assert_eq!(done.status.code(), Some(0), "{}", stderr(&done));
    assert!(!stderr(&done).contains("earlier run"));
    let date = serde_json::from_str::<serde_json::Value>(
        &std::fs::read_to_string(at.join("out/identification.json")).unwrap(),
    )
    .unwrap()["provenance"]["date"]
        .as_str()
        .unwrap()
        .to_owned();
    let note = format!("note: out/identification.json and what stands beside it are of an earlier run ({date})\n");
    assert!(failed("out").ends_with(&note), "{}", failed("out"));
    assert!(!failed("new").contains("earlier run"));
}

#[test]
fn a_robot_of_another_arms_file_carries_that_it_is_not_to_be_used() {
    let folder = identified("ur5e/robot.toml");
    let at = folder.path();
    let text = std::fs::read_to_string(at.join("out/identified.toml")).unwrap();
    assert!(text.contains("[check]\nadvice = \"do-not-use\"\nreason = "), "{text:.600}");
    let exported = stereocal(at, &["export", "robot", "--robot", "out/identified.toml", "--format", "urdf"]);
    assert_eq!(exported.status.code(), Some(1), "{}", stderr(&exported));
    let placed = stereocal(at, &["export", "placement", "--format", "opencv"]);
    assert!(placed.status.code() == Some(1), "{}", stderr(&placed));
    assert!(stderr(&placed).contains("do not use out/placement.json, says its own `check`: "), "{}", stderr(&placed));
    // A robot file as an earlier version wrote it has no such words.
    let old = text.replacen("[check]", "[old]", 1);
    let (before, after) = old.split_once("[old]").unwrap();
    std::fs::write(at.join("old.toml"), format!("{before}{}", after.split_once("\n\n").unwrap().1)).unwrap();
    let exported = stereocal(at, &["export", "robot", "--robot", "old.toml", "--format", "urdf", "--out", "o"]);
    assert_eq!(exported.status.code(), Some(0), "{}", stderr(&exported));
}

/// What is wrong with a robot that was identified from a file its `check` says, and not that it is of another file.
#[test]
fn a_robot_far_from_the_file_that_it_was_identified_from_is_compensated_with_its_reason() {
    let folder = identified("robot.toml");
    let at = folder.path();
    let path = camino::Utf8Path::from_path(at).unwrap();
    let mut robot = stereocal::robot::file::read(&path.join("robot.toml")).unwrap();
    let mut write = |name: &str, by_mm: f64| {
        robot.joints[2].a_mm += by_mm;
        std::fs::write(at.join(name), stereocal::robot::file::to_toml(&robot)).unwrap();
    };
    write("far.toml", 20.0);
    write("other.toml", 0.5);
    let rows = ["--measurements", "truth/measurements.csv", "--method", "trust-region", "--extensions", "none"];
    let found = stereocal(at, &[&["identify", "--robot", "far.toml", "--out", "far"], &rows[..]].concat());
    assert_eq!(found.status.code(), Some(1), "{}{}", stdout(&found), stderr(&found));
    std::fs::write(at.join("t.csv"), "name,j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\na,79,31,-87,-124,19,0\n")
        .unwrap();
    let compensate = |robot: &str| {
        let pair = ["--robot", robot, "--identified", "far/identified.toml", "--out", "c", "--force"];
        let told = stereocal(at, &[&["compensate", "t.csv"], &pair[..]].concat());
        (told.status.code(), stdout(&told) + &stderr(&told))
    };
    let (status, said) = compensate("far.toml");
    assert!(status == Some(1) && said.contains("do not use far/identified.toml, says its own `check`: "), "{said}");
    assert!(said.contains("1 of 1 target compensated"), "{said}");
    let (status, said) = compensate("other.toml");
    assert!(status == Some(2) && said.contains("is not the arm of `other.toml`"), "{said}");
}

/// Points of which `measure` said that they may be off are no ground for a robot that is to be used as it is.
#[test]
fn what_measure_doubts_of_its_points_is_said_of_the_robot() {
    let folder = identified("robot.toml");
    let at = folder.path();
    let again = [
        &["identify", "--measurements", "truth/measurements.csv", "--method", "trust-region", "--extensions", "none"][..],
        &["--robot", "robot.toml", "--no-provenance", "--force"],
    ];
    let doubt = "the points are off by 1.013 mm if the target is as was said";
    for (doubted, first) in
        [("null".to_owned(), "use the identified"), (format!("\"{doubt}\""), "check before you use")]
    {
        std::fs::write(at.join("truth/measure.json"), format!("{{\"rig\":{{\"doubt\":{doubted}}}}}")).unwrap();
        let found = stereocal(at, &again.concat());
        let said = stdout(&found);
        assert!(said.starts_with(first), "{said}{}", stderr(&found));
        assert_eq!(said.contains(doubt), doubted != "null", "{said}");
        assert_eq!(found.status.code(), Some(0), "{said}");
    }
}

#[test]
fn verify_says_that_a_robot_was_fitted_to_the_rows_and_what_its_columns_are() {
    let folder = identified("robot.toml");
    let at = folder.path();
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let verify = |file: &str| {
        let robots = ["--robot", "robot.toml", "--robot", "out/identified.toml"];
        let output = stereocal(at, &[&["verify", "--measurements", file], &robots[..]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        (stdout(&output), stderr(&output))
    };
    // The verify rows took no part in the fit.
    let (said, messages) = verify("truth/measurements.csv");
    assert!(
        said.contains("mean to min: errors of distances from") && said.contains("point: of points, after"),
        "{said}"
    );
    assert!(!messages.contains("was fitted to"), "{messages}");
    // The fitted rows under other names.
    let header = text.lines().next().unwrap();
    let renamed = text.lines().filter(|line| line.contains(",sample,")).take(15).enumerate();
    let rows: String = renamed.map(|(k, line)| format!("new{k},{}\n", line.split_once(',').unwrap().1)).collect();
    std::fs::write(at.join("own.csv"), format!("{header}\n{rows}").replace(",sample,", ",verify,")).unwrap();
    let (_, messages) = verify("own.csv");
    assert!(messages.contains("out/identified.toml was fitted to 15 of these 15 rows"), "{messages}");
    assert_eq!(messages.matches("was fitted to").count(), 1, "{messages}");
}

/// A table of joints, deg, and points, m, of one placement without names; a file with the rows of the first group
/// alone; a rig.
fn tables(at: &Path) {
    let made = ["simulate", "--points-only", "--samples", "40", "--verify", "12", "--seed", "4", "--out", "."];
    assert_eq!(stereocal(at, &made).status.code(), Some(0));
    let text = std::fs::read_to_string(at.join("truth/measurements.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let first: Vec<&Vec<&str>> = rows.iter().filter(|row| row[1] == rows[0][1]).collect();
    let metres = |mm: &&str| (mm.parse::<f64>().unwrap() / 1000.0).to_string();
    let plain = |row: &&Vec<&str>| {
        format!("{},{}", row[3..9].join(","), row[9..12].iter().map(metres).collect::<Vec<_>>().join(","))
    };
    std::fs::write(at.join("metres.csv"), first.iter().map(plain).collect::<Vec<_>>().join("\n")).unwrap();
    let whole: Vec<String> = first.iter().map(|row| row.join(",")).collect();
    std::fs::write(at.join("first.csv"), format!("{}\n{}\n", header.join(","), whole.join("\n"))).unwrap();
    let rig = serde_json::to_string(&CalibrationFile::from(&true_rig(1280))).unwrap();
    std::fs::write(at.join("rig.json"), rig).unwrap();
}

#[test]
fn what_is_in_the_way_or_only_assumed_is_named() {
    let folder = workplace();
    let at = folder.path();
    tables(at);
    let identify = |arguments: &[&str]| {
        let quick = ["identify", "--method", "trust-region", "--extensions", "none", "--force", "--out", "found"];
        stereocal(at, &[&quick[..], arguments].concat())
    };
    // Units that were typed, and those that fit.
    let wrong = identify(&["--measurements", "metres.csv", "--units", "deg,mm"]);
    assert_eq!(wrong.status.code(), Some(2), "{}", stderr(&wrong));
    let said = stderr(&wrong);
    assert!(
        said.contains("with `--units deg,mm` no choice") && said.contains("with `--units deg,m` it does"),
        "{said}"
    );
    assert_eq!(identify(&["--measurements", "metres.csv", "--units", "deg,m"]).status.code(), Some(0));
    // A tool three millimetres off its drawing is not far from nominal, one four centimetres off is.
    let robot = std::fs::read_to_string(at.join("robot.toml")).unwrap();
    for (x_mm, is_far) in [("9.0", false), ("15.0", false), ("52.0", true)] {
        std::fs::write(at.join("moved.toml"), robot.replace("x_mm = 12.0", &format!("x_mm = {x_mm}"))).unwrap();
        let said = stderr(&identify(&["--measurements", "truth/measurements.csv", "--robot", "moved.toml"]));
        let far = said.lines().find(|line| line.contains("far from nominal")).unwrap_or_default();
        assert_eq!(far.contains("v_x"), is_far, "{x_mm}: {said}");
    }
    // Places of the cameras that nobody measured.
    let plan =
        ["plan", "--calibration", "rig.json", "--poses", "8", "--verify", "2", "--pool", "600", "--noise-mm", "0.02"];
    for (rows, is_assumed) in [("first.csv", true), ("truth/measurements.csv", false)] {
        let planned = stereocal(at, &[&plan[..], &["--after", rows, "--out", "plan", "--force"]].concat());
        assert_eq!(planned.status.code(), Some(0), "{}", stderr(&planned));
        let said = stderr(&planned);
        assert_eq!(said.contains("is only assumed, as first.csv has no three poses there"), is_assumed, "{said}");
    }
    // No angle, and a file that is elsewhere.
    let shown = stereocal(at, &["robot", "show", "robot.toml", "--joints", "1,2,3,4,5,nan"]);
    assert_eq!(shown.status.code(), Some(2), "{}", stdout(&shown));
    let missing = stereocal(at, &["robot", "show", "nowhere.toml"]);
    assert!(
        !stderr(&missing).contains("--robot FILE") && stderr(&missing).contains("robot new"),
        "{}",
        stderr(&missing)
    );
}
