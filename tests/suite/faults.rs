//! What goes wrong around the program: a stderr or stdout that cannot be written, a full disk, folders and files
//! without permission, a writer that is killed, two runs in one folder. No result is lost, none is half written, and it
//! is said.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::run::{program, stderr, stdout, stereocal, workplace};

/// A small world of points, quick to write and to identify from.
const POINTS: [&str; 8] = ["simulate", "--points-only", "--preset", "small", "--out", ".", "--seed", "3"];

/// Files below a folder by their relative names; the program's own bookkeeping aside.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fn walk(root: &Path, folder: &Path, into: &mut BTreeMap<String, Vec<u8>>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(root).unwrap().display().to_string();
            if path.is_dir() {
                if name != ".stereocal" {
                    walk(root, &path, into);
                }
            } else {
                into.insert(name, std::fs::read(&path).unwrap());
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(folder, folder, &mut found);
    found
}

/// Runs a shell line in which `$P` is the program.
fn shell(folder: &Path, line: &str) -> std::process::Output {
    Command::new("bash")
        .args(["-c", line])
        .current_dir(folder)
        .env("P", program())
        .env("SOURCE_DATE_EPOCH", "0")
        .output()
        .expect("a shell")
}

#[test]
fn results_outlive_a_stderr_that_cannot_be_written() {
    let folder = workplace();
    assert_eq!(stereocal(folder.path(), &POINTS).status.code(), Some(0));
    let identify = "$P identify --measurements measurements.csv --method trust-region --json";
    let output = shell(folder.path(), &format!("{identify} --out full 2>/dev/full"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_str::<serde_json::Value>(&stdout(&output)).expect("stdout is the JSON");
    let output = shell(folder.path(), &format!("{identify} --out head 2>&1 | head -1"));
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for out in ["full", "head"] {
        for name in ["identification.json", "identified.toml", "identify.html"] {
            assert!(folder.path().join(out).join(name).is_file(), "{out}/{name}");
        }
    }
}

#[test]
fn a_result_that_cannot_be_printed_is_an_error() {
    let folder = workplace();
    let output = shell(folder.path(), "$P simulate --points-only --out . >/dev/full");
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("cannot print the result"), "{}", stderr(&output));
    assert!(folder.path().join("measurements.csv").is_file());
    assert_eq!(shell(folder.path(), "$P --help >/dev/full").status.code(), Some(2));
    assert_eq!(shell(folder.path(), "set -o pipefail; $P --help | head -1").status.code(), Some(0));
}

/// A quota that is hit in the middle of a file, once with the signal ignored and once with the process ended by it.
#[test]
fn a_full_disk_leaves_no_half_file() {
    for trap in ["trap '' XFSZ;", ""] {
        let folder = workplace();
        assert_eq!(stereocal(folder.path(), &POINTS).status.code(), Some(0));
        let before = files(folder.path());
        assert!(before["measurements.csv"].len() > 8 * 1024, "the quota would not be hit");
        let output = shell(folder.path(), &format!("{trap} ulimit -f 8; $P {} --seed 4", POINTS[..6].join(" ")));
        if trap.is_empty() {
            assert_ne!(output.status.code(), Some(0));
        } else {
            assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
            assert!(stderr(&output).contains("cannot write"), "{}", stderr(&output));
        }
        let after = files(folder.path());
        for (name, bytes) in &before {
            let whole = after[name] == *bytes || bytes.len() < 8 * 1024;
            assert!(whole, "{name} is neither the old file nor a new one");
        }
        // The next run sweeps away what the killed one left, and needs no --force.
        let output = stereocal(folder.path(), &[&POINTS[..6], &["--seed", "4"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_eq!(files(folder.path()).keys().collect::<Vec<_>>(), before.keys().collect::<Vec<_>>());
    }
}

/// As a user who is not root: root may read and write everything.
#[test]
fn folders_and_files_without_permission_are_named() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::os::unix::process::CommandExt;
    /// `nobody` of Linux.
    const NOBODY: u32 = 65534;
    let folder = workplace();
    let path = folder.path();
    assert_eq!(stereocal(path, &POINTS).status.code(), Some(0));
    let mode =
        |name: &str, mode| std::fs::set_permissions(path.join(name), std::fs::Permissions::from_mode(mode)).unwrap();
    std::fs::create_dir(path.join("closed")).unwrap();
    std::fs::copy(program(), path.join("program")).unwrap();
    mode(".", 0o755);
    mode("program", 0o755);
    mode("closed", 0o555);
    let root = std::fs::metadata(path).unwrap().uid() == 0;
    let refused = |arguments: &[&str], parts: &[&str]| {
        let mut command = Command::new(path.join("program"));
        command.current_dir(path).args(arguments);
        if root {
            command.uid(NOBODY).gid(NOBODY);
        }
        let output = command.output().expect("it starts");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        for part in parts {
            assert!(stderr(&output).contains(part), "{arguments:?}: {}", stderr(&output));
        }
    };
    let points = ["simulate", "--points-only", "--out", "closed"];
    refused(&points, &["cannot write into closed", "ermission denied"]);
    refused(&["simulate", "--points-only", "--out", "robot.toml/x"], &["cannot create robot.toml/x"]);
    mode("measurements.csv", 0o000);
    refused(&["identify", "--measurements", "measurements.csv", "--out", "closed"], &["cannot read measurements.csv"]);
    mode("robot.toml", 0o000);
    refused(&["identify", "--measurements", "measurements.csv"], &["cannot read"]);
    refused(&["identify", "--measurements", "."], &["cannot read"]);
    mode("measurements.csv", 0o644);
    refused(&["identify", "--measurements", "measurements.csv", "--out", "closed"], &["cannot read robot.toml"]);
}

#[test]
fn a_writer_killed_at_any_moment_leaves_whole_files_and_the_next_run_ends_the_work() {
    /// Half a pair of pictures to the whole world, ms.
    const MOMENTS: [u64; 8] = [5, 20, 40, 70, 110, 160, 250, 400];
    let simulate = [
        "simulate",
        "--preset",
        "small",
        "--size",
        "320",
        "--check-pairs",
        "3",
        "--samples",
        "8",
        "--verify",
        "4",
        "--out",
        ".",
    ];
    let command = |folder: &Path| {
        let mut command = Command::new(program());
        command
            .current_dir(folder)
            .args(simulate)
            .env("SOURCE_DATE_EPOCH", "0")
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        command
    };
    let whole = workplace();
    assert!(command(whole.path()).status().expect("it runs").success());
    let expected = files(whole.path());
    let folder = workplace();
    for moment in MOMENTS {
        let mut child = command(folder.path()).spawn().expect("it starts");
        std::thread::sleep(Duration::from_millis(moment));
        child.kill().expect("killed");
        child.wait().expect("ended");
        for (name, bytes) in files(folder.path()) {
            let temporary = name.rsplit('/').next().is_some_and(|file| file.starts_with(".stereocal-"));
            assert!(temporary || expected.get(&name) == Some(&bytes), "{name} is not whole after {moment} ms");
        }
    }
    assert!(command(folder.path()).status().expect("it runs").success());
    assert!(files(folder.path()) == expected, "the last run left other files");
}

#[test]
fn two_runs_in_one_folder_write_one_after_the_other() {
    let start = |folder: &Path, seed: &str| {
        let mut command = Command::new(program());
        command
            .args(["simulate", "--points-only", "--out", ".", "--no-provenance", "--seed", seed])
            .current_dir(folder);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts")
    };
    let alone = ["1", "2"].map(|seed| {
        let folder = workplace();
        assert!(start(folder.path(), seed).wait().expect("it ends").success());
        files(folder.path())
    });
    for _ in 0..3 {
        let folder = workplace();
        let mut both = ["1", "2", "1", "2"].map(|seed| start(folder.path(), seed));
        for run in &mut both {
            assert!(run.wait().expect("it ends").success());
        }
        assert!(alone.contains(&files(folder.path())), "the files of two runs are mixed");
    }
}
