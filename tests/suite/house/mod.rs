//! What must not be in the source and clippy cannot check (see clippy.toml and `[lints]` in Cargo.toml for the rest).

mod face;
mod modules;
mod rooms;
mod sizes;

use std::path::{Path, PathBuf};

fn source_files() -> Vec<PathBuf> {
    let mut files = rust_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    files.retain(|path| !path.ends_with("tests.rs"));
    assert!(files.len() > 10, "the source was not found");
    files
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    fn walk(folder: &Path, into: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, into);
            } else if path.extension().is_some_and(|e| e == "rs") {
                into.push(path);
            }
        }
    }
    let mut files = Vec::new();
    walk(folder, &mut files);
    files.sort();
    files
}

/// A file line by line, without comments and without what is compiled for tests alone.
fn code(path: &Path) -> Vec<(usize, String)> {
    without_tests(&std::fs::read_to_string(path).unwrap())
}

fn without_tests(text: &str) -> Vec<(usize, String)> {
    let mut kept = Vec::new();
    // Braces that are open in an item under `#[cfg(test)]`; such an item ends with the last of them, or with a
    // semicolon before any.
    let mut open: Option<i32> = None;
    for (i, line) in text.lines().enumerate() {
        let code = line.split("//").next().unwrap_or_default();
        match open {
            None if code.trim() == "#[cfg(test)]" => open = Some(0),
            None => kept.push((i + 1, code.to_owned())),
            Some(depth) => {
                let depth = depth + code.matches('{').count() as i32 - code.matches('}').count() as i32;
                let ends = depth == 0 && (code.contains('}') || code.trim_end().ends_with(';'));
                open = if ends { None } else { Some(depth) };
            }
        }
    }
    kept
}

/// Every test that `scripts/test` leaves for `.ci/run` is there, by its name.
#[test]
fn tests_that_are_called_slow_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let files = ["src", "tests/suite"].into_iter().flat_map(|folder| rust_files(&root.join(folder)));
    let text: String = files.map(|path| std::fs::read_to_string(path).unwrap()).collect();
    let slow = std::fs::read_to_string(root.join("tests/slow")).unwrap();
    for name in slow.lines() {
        let function = name.rsplit("::").next().unwrap();
        assert!(text.contains(&format!("fn {function}()")), "{name}");
    }
}

#[test]
fn code_after_a_test_item_is_looked_at() {
    let text = "a\n#[cfg(test)]\nmod t;\nb\n#[cfg(test)]\nmod t {\n  fn f() { x }\n}\nc // d\n";
    let lines: Vec<(usize, String)> = without_tests(text);
    let kept: Vec<(usize, &str)> = lines.iter().map(|(i, line)| (*i, line.trim())).collect();
    assert_eq!(kept, [(1, "a"), (4, "b"), (9, "c")]);
}

fn offenders(pattern: &str, allowed: &[&str]) -> Vec<String> {
    let mut found = Vec::new();
    for path in source_files() {
        if allowed.iter().any(|a| path.ends_with(a)) {
            continue;
        }
        for (number, line) in code(&path) {
            if line.contains(pattern) {
                found.push(format!("{}:{number}: {}", path.display(), line.trim()));
            }
        }
    }
    found
}

#[test]
fn one_file_names_opencv() {
    // `crate::opencv` is that file; the bindings themselves start with a bare `opencv::`.
    let found: Vec<String> =
        offenders("opencv::", &["src/opencv.rs"]).into_iter().filter(|l| !l.contains("crate::opencv::")).collect();
    assert!(found.is_empty(), "{found:#?}");
}
