//! `camera-check --known-move`: pictures of a board before and after a slide, as the simulator takes them.

use std::path::Path;

use camino::Utf8Path;
use nalgebra::Vector3;
use serde_json::Value;
use stereocal::files::OutDir;
use stereocal::simulate::settings::Settings;
use stereocal::simulate::world::World;

use crate::run::{stderr, stdout, stereocal, workplace};

/// Pictures of ten pairs and of two more: the board of pair 10 after slides by 5 and 15 mm.
fn pictures() -> tempfile::TempDir {
    let settings = Settings { size_px: 800, check_pairs: 10, samples: 4, verify: 0, ..Settings::small() };
    let mut world = World::new(settings, None).unwrap();
    world.poses.clear();
    let along = Vector3::new(0.6, 0.2, -0.77).normalize();
    for mm in [5.0, 15.0] {
        let mut slid = world.check_poses[world.check_poses.len() - 1];
        slid.translation.vector += along * mm;
        world.check_poses.push(slid);
    }
    let folder = workplace();
    world.write_pictures(&OutDir::open(Utf8Path::from_path(folder.path()).unwrap()).unwrap()).unwrap();
    folder
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_slide_confirms_the_scale_or_shows_squares_that_are_not_as_said() {
    let folder = pictures();
    let at = folder.path();
    let check = |more: &[&str]| stereocal(at, &[&["camera-check", "check", "--lens", "brown4"], more].concat());
    let nowhere = check(&["--known-move", "5mm:10,77"]);
    assert_eq!(nowhere.status.code(), Some(2), "{}", stderr(&nowhere));
    assert!(stderr(&nowhere).contains("there is no pair 77"), "{}", stderr(&nowhere));
    assert!(!at.join("out/corners.csv").exists());
    let same = check(&["--known-move", "5mm:10,10"]);
    assert_eq!(same.status.code(), Some(2));
    assert!(stderr(&same).contains("pair 10 is named twice"), "{}", stderr(&same));

    let agrees = check(&["--known-move", "5mm"]);
    let said = stdout(&agrees);
    assert_eq!(agrees.status.code(), Some(0), "{said}{}", stderr(&agrees));
    assert!(said.contains("the move of 5 +- 0.002 mm from pair 10 to 11 is measured as"), "{said}");
    assert!(said.contains("it agrees with the scale"), "{said}");
    let known = json(&at.join("out/calibration.json"))["known_moves"][0].clone();
    assert!((known["measured_mm"].as_f64().unwrap() - 5.0).abs() < 0.003, "{known}");
    assert!(std::fs::read_to_string(at.join("out/camera-check.html")).unwrap().contains("The move of 5 +- 0.002 mm"));
    // What reads the calibration takes no offence. The pairs are its own, which prove nothing.
    let again = stereocal(at, &["camera-check", "check", "--against", "out/calibration.json"]);
    assert!(stdout(&again).starts_with("UNDECIDED, ITS OWN DATA"), "{}{}", stdout(&again), stderr(&again));
    assert_eq!(again.status.code(), Some(1));
    // It stands on the page, too.
    let page = std::fs::read_to_string(at.join("out/recheck.html")).unwrap();
    assert!(
        page.contains("check holds what this calibration was made of") && !page.contains("new pairs against"),
        "{page}"
    );

    let turned = check(&["--known-move", "5mm:05,06", "--force"]);
    let said = stdout(&turned);
    assert!(said.contains("is not measured: the board turned by") && said.contains("it must only slide"), "{said}");
    assert_eq!(turned.status.code(), Some(1), "{said}{}", stderr(&turned));

    let wrong = check(&["--square-mm", "10.03", "--known-move", "5mm:10,11", "--known-move", "15mm:11,12"]);
    let said = stdout(&wrong);
    assert_eq!(wrong.status.code(), Some(1), "{said}{}", stderr(&wrong));
    assert!(said.starts_with("FAIL") && said.contains("deciding check: known move"), "{said}");
    assert!(said.contains("all moves show one scale: the board's pitch is not as said"), "{said}");
    let file = json(&at.join("out/camera-check.json"));
    let finding = file["findings"].as_array().unwrap().iter().find(|f| f["cause"] == "other-board").unwrap();
    assert!((finding["size"].as_f64().unwrap() - 0.3).abs() < 0.05, "{finding}");
    let square_mm = file["known_moves"][1]["square_mm"].as_f64().unwrap();
    assert!((square_mm - 10.0).abs() < 0.003, "{square_mm}");

    let unsettled = check(&["--known-move", "9mm"]);
    assert_eq!(unsettled.status.code(), Some(2), "{}", stdout(&unsettled));
    assert!(
        stderr(&unsettled).contains("hint: name the pairs before and after it: `--known-move 9mm:BEFORE,AFTER`"),
        "{}",
        stderr(&unsettled)
    );
}
