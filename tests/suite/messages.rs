//! Bad usage and bad input: what is said, and the exit status it ends in.

use crate::run::{stderr, stdout, stereocal, workplace};

/// Runs the program, expects it to refuse with `status` and to say every one of `parts`, and to leave stdout empty.
fn refused(arguments: &[&str], files: &[(&str, &str)], status: i32, parts: &[&str]) {
    let folder = workplace();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    let output = stereocal(folder.path(), arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(status), "{arguments:?} said: {said}");
    assert_eq!(stdout(&output), "", "{arguments:?}");
    for part in parts {
        assert!(said.contains(part), "{arguments:?} did not say `{part}` but: {said}");
    }
}

#[test]
fn no_command_is_bad_usage() {
    refused(&[], &[], 2, &["Usage"]);
    refused(&["camera-check"], &[], 2, &["required"]);
    refused(&["calibrate"], &[], 2, &["unrecognized subcommand"]);
}

#[test]
fn a_board_that_is_none() {
    refused(&["camera-check", "x", "--squares", "20"], &[], 2, &["COLUMNSxROWS", "`20`"]);
    refused(&["camera-check", "x", "--square-mm", "-3"], &[("x/a.txt", "")], 2, &["square_mm is -3", "above zero"]);
}

#[test]
fn settings_that_are_none() {
    let toml = [("stereocal.toml", "tolerance_mm = 0.0\n[target_board]\nsquares = \"7x6\"\nsquare_mm = -1.0\n")];
    refused(&["identify"], &toml, 2, &["tolerance_mm is 0", "target_board.square_mm is -1"]);
    refused(&["identify", "--config", "none.toml"], &[], 2, &["not found", "none.toml"]);
    let unknown = [("stereocal.toml", "\ntolerance = 1.0\n")];
    refused(&["identify"], &unknown, 2, &["unknown field `tolerance`", "stereocal.toml:2"]);
}
