//! `report`: one page of what the commands wrote, and what it says of parts that do not belong together.

use std::path::Path;

use crate::run::{stderr, stdout, stereocal, workplace};

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = stereocal(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output)
}

#[test]
fn what_happened_over_the_pairs_stands_before_the_checks() {
    let folder = workplace();
    let world = folder.path();
    let simulate =
        ["simulate", "--preset", "small", "--size", "800", "--check-pairs", "10", "--samples", "0", "--out", "."];
    done(world, &[&simulate[..], &["--verify", "0"]].concat());
    let page_of = |from: &[&str], board: &str, out: &str| {
        let output = stereocal(world, &[&["camera-check", "--board", board, "--out", out], from].concat());
        let page = std::fs::read_to_string(world.join(out).join("camera-check.html")).unwrap();
        (stdout(&output), page)
    };
    let (said, page) = page_of(&["check/"], "checker:20x20:10", "as-it-is");
    let headings = ["What happened during the series", "What was found of the board"];
    assert!(!said.contains("during the series") && headings.iter().all(|heading| !page.contains(heading)), "{said}");
    for (side, ratio) in [("10x9.94", "not 1.0060 times"), ("10x9.8", "not 1.0204 times")] {
        let (said, page) = page_of(&["--corners", "as-it-is/corners.csv"], &format!("checker:20x20:{side}"), side);
        assert!(said.contains("1.0000 times as wide as high") && said.contains(ratio), "{said}");
        let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("{side}: no `{text}`"));
        assert!(at(headings[1]) < at("Checks that are not passed") && !page.contains(headings[0]), "{side}");
        let to_do = || &page[at("What to do next")..at(headings[1])];
        assert!(said.starts_with("PASS") || to_do().contains("easure the board along and across"), "{side}: {said}");
        // The board is as good as it was, and nothing of it is in the rig.
        assert!(
            !page.contains("places on the board scatter") && !page.contains("included in the uncertainty"),
            "{side}"
        );
    }
}

/// Error and uncertainty are those of one length, in the record, on the page to sign and on that of the check; the rig
/// comes first there.
fn what_is_judged_adds_up(world: &Path, report: &str) {
    let check: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(world.join("out/camera-check.json")).unwrap()).unwrap();
    let of = |pointer: &str| check.pointer(pointer).and_then(serde_json::Value::as_f64).unwrap();
    let judged = ["error_mm", "uncertainty_mm", "at_most_mm"].map(|key| of(&format!("/judged_length/{key}")));
    assert!((judged[0] + judged[1] - judged[2]).abs() < 1e-12 && judged[2] == of("/evidence/0/value"), "{judged:?}");
    let page = std::fs::read_to_string(world.join("out/camera-check.html")).unwrap();
    let (before, after) = page.split_once(" mm, the uncertainty being that of").unwrap();
    assert!(after.starts_with(" calibration and board"));
    let sum: Vec<&str> = before.rsplit(": ").next().unwrap().split([' ', '+', '=']).filter(|n| !n.is_empty()).collect();
    let numbers: Vec<f64> = sum.iter().map(|n| n.parse().unwrap()).collect();
    assert!((numbers[0] + numbers[1] - numbers[2]).abs() < 1e-9, "{sum:?}");
    for (number, value) in numbers.iter().zip(judged) {
        assert!((number - value).abs() <= 0.1 * value, "{sum:?} {judged:?}");
    }
    assert!(sum.iter().all(|number| report.contains(&format!("<td>{number}</td>"))), "{sum:?}");
    assert!(!page.contains("0 mm along"), "a length along the line of sight that is not there");
    let at = |text: &str| page.find(text).unwrap_or_else(|| panic!("no {text}"));
    assert!(at("right_from_left.tx_mm") < at("left.fx"));
}

#[test]
fn one_page_of_the_day() {
    let folder = workplace();
    let world = folder.path();
    let output = stereocal(world, &["report"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("results not found"), "{}", stderr(&output));
    assert!(!world.join("out").exists());

    done(
        world,
        &[
            "simulate",
            "--preset",
            "small",
            "--size",
            "720",
            "--check-pairs",
            "10",
            "--samples",
            "16",
            "--verify",
            "4",
            "--out",
            ".",
        ],
    );
    done(world, &["camera-check", "check/", "--tolerance-mm", "0.5"]);
    done(world, &["measure", "poses/"]);
    // Covariances of so few poses are a doubt, which is not the matter here.
    std::fs::write(world.join("stereocal.toml"), "[identify]\nexamine = false\n").unwrap();
    done(world, &["identify", "--method", "trust-region"]);
    let said = done(world, &["report"]);
    assert!(said.starts_with("rig: PASS") && said.contains("before,"), "{said}");
    for name in ["report", "camera-check", "measure", "identify"] {
        let page = std::fs::read_to_string(world.join(format!("out/{name}.html"))).unwrap();
        // No page asks for anything outside of itself.
        for request in ["src=\"http", "href=\"http", "url(", "@import", "<link"] {
            assert!(!page.contains(request), "{name}: {request}");
        }
        assert!(page.contains("Content-Security-Policy"));
        assert!(page.len() < 1_000_000, "{name}: {} bytes", page.len());
        assert_eq!(page.contains("svg class=\"scene\""), name != "report", "{name}");
    }
    let page = std::fs::read_to_string(world.join("out/report.html")).unwrap();
    for part in ["ISO 9283", "VDI/VDE 2634", "Signatures", "camera-check.json"] {
        assert!(page.contains(part), "{part}");
    }
    what_is_judged_adds_up(world, &page);

    // A robot that is to be checked before use is no clean day.
    let path = world.join("out/identification.json");
    let clean = std::fs::read_to_string(&path).unwrap();
    let mut robot: serde_json::Value = serde_json::from_str(&clean).unwrap();
    (robot["advice"], robot["reason"]) = ("check".into(), "the floor shook".into());
    std::fs::write(&path, robot.to_string()).unwrap();
    let output = stereocal(world, &["report"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).contains("check before you use the identified robot: the floor shook"));
    std::fs::write(&path, clean).unwrap();

    // The same measurements with another calibration beside them.
    done(world, &["camera-check", "check/", "--tolerance-mm", "0.5", "--lens", "brown5"]);
    let output = stereocal(world, &["report"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("measure.json was made with another calibration.json"), "{}", stderr(&output));
}
