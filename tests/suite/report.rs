//! `report`: one page of what the commands wrote, and what it says of parts that do not belong together.

use std::path::Path;

use crate::run::{stderr, stdout, stereocal, workplace};

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = stereocal(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}{}", stdout(&output), stderr(&output));
    stdout(&output)
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
            "960",
            "--check-pairs",
            "10",
            "--samples",
            "24",
            "--verify",
            "6",
            "--out",
            ".",
        ],
    );
    done(world, &["camera-check", "check/", "--tolerance-mm", "0.5"]);
    done(world, &["measure", "poses/"]);
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

    // The same measurements with another calibration beside them.
    done(world, &["camera-check", "check/", "--tolerance-mm", "0.5", "--lens", "brown5"]);
    let output = stereocal(world, &["report"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("measure.json was made with another calibration.json"), "{}", stderr(&output));
}
