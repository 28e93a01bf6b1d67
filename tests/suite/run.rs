//! How the tests run the program, and where they find pictures and measurements that are not in the repository.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of the test's own, removed at its end.
pub fn workplace() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Where the program is.
pub fn program() -> &'static str {
    env!("CARGO_BIN_EXE_stereocal")
}

/// Runs the program in `folder` and returns what it said and how it ended.
pub fn stereocal(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program()).current_dir(folder).args(arguments).output().expect("the program starts")
}

/// What the program wrote to stderr.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Files by their paths below a folder.
pub type Files = Vec<(String, Vec<u8>)>;

/// All files below a folder, in the order of their paths.
pub fn files_below(folder: &Path) -> Files {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in std::fs::read_dir(&next).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("it lies below").display().to_string();
                found.push((name, std::fs::read(&path).expect("a file")));
            }
        }
    }
    found.sort();
    found
}

/// A folder of a test's own with these files: several tests begin with what was made once.
pub fn with_files(files: &Files) -> tempfile::TempDir {
    let folder = workplace();
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }
    folder
}

/// What the program wrote to stdout.
pub fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A folder or file of the shared real data, or `None` with a message where this machine does not have it.
pub fn shared(path: &str) -> Option<PathBuf> {
    let root = match std::env::var_os("STEREOCAL_SHARED") {
        Some(root) => PathBuf::from(root),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"),
    };
    let found = root.join("data").join(path);
    if found.exists() {
        return Some(found);
    }
    eprintln!("skipped: {} is not here", found.display());
    None
}

/// Whether files of the repository that a test compares are to be written anew: `STEREOCAL_REFRESH=1`.
pub fn refreshes() -> bool {
    std::env::var_os("STEREOCAL_REFRESH").is_some_and(|value| value == "1")
}
