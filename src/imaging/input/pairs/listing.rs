//! What lies in a folder: pictures, other files, and the folders below that hold pictures.
//!
//! Hidden files and folders are passed over, and so are folders that this program wrote its results into: a run inside
//! the folder of pictures must not find what it wrote the last time.

use camino::{Utf8Path, Utf8PathBuf};

use super::names::natural_order;
use crate::files::provenance::picture_format;
use crate::files::{self, OutDir};
use crate::imaging::{Error, Result};

/// Levels below a folder, and folders there, that are looked into: enough for any set of pictures, and an end where the
/// folder that was named is a whole disk.
const DEEPEST: usize = 5;
const MOST_FOLDERS: usize = 2000;

/// A folder and what lies directly in it.
#[derive(Debug, Clone, Default)]
pub struct Folder {
    /// Where it is.
    pub path: Utf8PathBuf,
    /// Its path below the folder that was named; empty for that folder itself.
    pub below: String,
    /// Levels below that folder.
    pub depth: usize,
    /// Its pictures, sorted.
    pub pictures: Vec<Utf8PathBuf>,
    /// Its folders, sorted.
    pub folders: Vec<Utf8PathBuf>,
    /// Files that are no pictures, as they come.
    pub others: Vec<Utf8PathBuf>,
    /// How many of them, and what else there is.
    pub aside: Aside,
}

/// Files of a folder that are passed over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Aside {
    /// Files that are no pictures.
    pub other: usize,
    /// Pictures that lie there once more under the same name, in a format that comes before theirs.
    pub again: usize,
}

impl std::iter::Sum for Aside {
    fn sum<I: Iterator<Item = Aside>>(all: I) -> Aside {
        all.fold(Aside::default(), |sum, one| Aside { other: sum.other + one.other, again: sum.again + one.again })
    }
}

/// Lists one folder.
pub fn list(folder: &Utf8Path) -> Result<Folder> {
    let failed = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => Error::NoFolder { path: folder.to_owned() },
        std::io::ErrorKind::NotADirectory => Error::NotAFolder { path: folder.to_owned() },
        _ => files::Error::Io { action: "read", path: folder.to_owned(), source }.into(),
    };
    let mut entries = Folder { path: folder.to_owned(), ..Folder::default() };
    for entry in folder.read_dir_utf8().map_err(failed)? {
        // A name that is not UTF-8 is a file we can't name; the system's reason says so.
        let Ok(entry) = entry else {
            entries.aside.other += 1;
            continue;
        };
        let path = entry.into_path();
        if path.file_name().is_some_and(|name| name.starts_with('.')) {
            continue;
        }
        if path.is_dir() {
            entries.folders.push(path);
        } else if picture_format(&path).is_some() {
            entries.pictures.push(path);
        } else {
            entries.aside.other += 1;
            entries.others.push(path);
        }
    }
    entries.others.sort();
    entries.pictures.sort();
    entries.folders.sort();
    entries.aside.again = once(&mut entries.pictures);
    Ok(entries)
}

/// Keeps one picture of those of one name, the first in the format that loses least; how many went.
fn once(pictures: &mut Vec<Utf8PathBuf>) -> usize {
    let before = pictures.len();
    pictures.sort_by_key(|path| (path.with_extension(""), picture_format(path)));
    pictures.dedup_by_key(|path| path.with_extension(""));
    pictures.sort();
    before - pictures.len()
}

/// The folder itself, then the folders below it that hold pictures, level by level in natural order. One that can't be
/// read is none.
pub fn tree(root: Folder) -> Vec<Folder> {
    let top = root.path.clone();
    let mut all = Vec::new();
    let mut level = vec![root];
    let mut looked_into = 0;
    for depth in 1..=DEEPEST {
        let mut next = Vec::new();
        for path in level.iter().flat_map(|folder| &folder.folders).filter(|path| !OutDir::is_at(path)) {
            looked_into += 1;
            if looked_into > MOST_FOLDERS {
                break;
            }
            let Ok(listed) = list(path) else { continue };
            let below = path.strip_prefix(&top).unwrap_or(path).to_string();
            next.push(Folder { below, depth, ..listed });
        }
        next.sort_by(|a, b| natural_order(&a.below, &b.below));
        all.append(&mut level);
        level = next;
    }
    all.append(&mut level);
    all.retain(|folder| folder.depth == 0 || !folder.pictures.is_empty());
    all
}
