//! From a folder to pairs of picture files.
//!
//! In: `left/` and `right/` with equal file stems, or one folder whose names say the side: `left*`/`right*`,
//! `*_left`/`*_right`, `*_L`/`*_R`, `*_l`/`*_r`. Out: pairs in natural order (`2` before `10`), and what was left out and why.
//! Goes wrong: no pictures, one side only, two files that claim the same place.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use camino::{Utf8Path, Utf8PathBuf};

use crate::files;
use crate::imaging::{Error, Result, Side};

/// Extensions of pictures, in small letters.
const EXTENSIONS: [&str; 8] = ["png", "tif", "tiff", "bmp", "jpg", "jpeg", "pgm", "pnm"];

/// The two picture files of a pair.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairFiles {
    /// Name of the pair: the pictures' common stem.
    pub pair: String,
    /// The left picture.
    pub left: Utf8PathBuf,
    /// The right picture.
    pub right: Utf8PathBuf,
}

/// A folder understood.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairing {
    /// Pairs in natural order of their names.
    pub pairs: Vec<PairFiles>,
    /// Pictures of one side without the other.
    pub single: Vec<Utf8PathBuf>,
    /// Pictures whose names tell no side.
    pub sideless: usize,
    /// Files that are no pictures.
    pub other: usize,
}

impl Pairing {
    /// What was left out, in a line; `None` where nothing was.
    pub fn left_out(&self) -> Option<String> {
        let mut parts = Vec::new();
        if !self.single.is_empty() {
            let names: Vec<&str> = self.single.iter().take(3).filter_map(|p| p.file_name()).collect();
            let more = if self.single.len() > names.len() { ", ..." } else { "" };
            parts.push(format!(
                "{} without a partner ({}{more})",
                count(self.single.len(), "picture"),
                names.join(", ")
            ));
        }
        if self.sideless > 0 {
            parts.push(format!("{} whose names tell neither left nor right", count(self.sideless, "picture")));
        }
        if self.other > 0 {
            parts.push(count(self.other, "other file"));
        }
        (!parts.is_empty()).then(|| format!("left out: {}", parts.join("; ")))
    }
}

fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Finds the pairs of a folder. At least one pair, else an error that says what was there.
pub fn pair_files(folder: &Utf8Path) -> Result<Pairing> {
    let entries = list(folder)?;
    let sub = |name: &str| {
        entries.folders.iter().find(|f| f.file_name().is_some_and(|n| n.eq_ignore_ascii_case(name))).cloned()
    };
    let mut pairing = match (sub("left"), sub("right")) {
        (Some(left), Some(right)) => pair_folders(&left, &right)?,
        _ => pair_names(&entries)?,
    };
    if pairing.pairs.is_empty() {
        return Err(explain_nothing(folder, &entries, &pairing));
    }
    pairing.pairs.sort_by(|a, b| natural_order(&a.pair, &b.pair));
    Ok(pairing)
}

/// Sorts digits by their value: `a2` before `a10`.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut x, mut y) = (a, b);
    while let (Some(cx), Some(cy)) = (x.chars().next(), y.chars().next()) {
        let digits = |s: &str| s.find(|c: char| !c.is_ascii_digit()).unwrap_or(s.len());
        let order = if cx.is_ascii_digit() && cy.is_ascii_digit() {
            let ((dx, rest_x), (dy, rest_y)) = (x.split_at(digits(x)), y.split_at(digits(y)));
            (x, y) = (rest_x, rest_y);
            let (dx, dy) = (dx.trim_start_matches('0'), dy.trim_start_matches('0'));
            dx.len().cmp(&dy.len()).then_with(|| dx.cmp(dy))
        } else {
            (x, y) = (&x[cx.len_utf8()..], &y[cy.len_utf8()..]);
            cx.cmp(&cy)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    x.len().cmp(&y.len()).then_with(|| a.cmp(b))
}

struct Entries {
    pictures: Vec<Utf8PathBuf>,
    folders: Vec<Utf8PathBuf>,
    other: usize,
}

fn list(folder: &Utf8Path) -> Result<Entries> {
    let failed = |source: std::io::Error| match source.kind() {
        std::io::ErrorKind::NotFound => Error::NoFolder { path: folder.to_owned() },
        std::io::ErrorKind::NotADirectory => Error::NotAFolder { path: folder.to_owned() },
        _ => files::Error::Io { action: "read", path: folder.to_owned(), source }.into(),
    };
    let mut entries = Entries { pictures: Vec::new(), folders: Vec::new(), other: 0 };
    for entry in folder.read_dir_utf8().map_err(failed)? {
        // A name that is not UTF-8 is a file we can't name; the system's reason says so.
        let Ok(entry) = entry else {
            entries.other += 1;
            continue;
        };
        let path = entry.into_path();
        if path.file_name().is_some_and(|name| name.starts_with('.')) {
            continue;
        }
        let extension = path.extension().map(str::to_ascii_lowercase);
        if path.is_dir() {
            entries.folders.push(path);
        } else if extension.is_some_and(|e| EXTENSIONS.contains(&e.as_str())) {
            entries.pictures.push(path);
        } else {
            entries.other += 1;
        }
    }
    entries.pictures.sort();
    entries.folders.sort();
    Ok(entries)
}

type Sides = BTreeMap<String, [Vec<Utf8PathBuf>; 2]>;

fn pair_folders(left: &Utf8Path, right: &Utf8Path) -> Result<Pairing> {
    let (left, right) = (list(left)?, list(right)?);
    let keyed = |key: &dyn Fn(&str) -> String| {
        let mut sides = Sides::new();
        for (side, entries) in [(Side::Left, &left), (Side::Right, &right)] {
            for path in &entries.pictures {
                let stem = path.file_stem().unwrap_or_default();
                sides.entry(key(stem)).or_default()[side as usize].push(path.clone());
            }
        }
        sides
    };
    let other = left.other + right.other;
    let by_stem = match_sides(keyed(&|stem| stem.to_owned()), other)?;
    if !by_stem.pairs.is_empty() {
        return Ok(by_stem);
    }
    // left/left01.png beside right/right01.png: the names say the side a second time.
    match_sides(keyed(&|stem| side_of(stem).map_or_else(|| stem.to_owned(), |(_, key)| key)), other)
}

fn pair_names(entries: &Entries) -> Result<Pairing> {
    let mut sides = Sides::new();
    let mut sideless = 0;
    for path in &entries.pictures {
        match side_of(path.file_stem().unwrap_or_default()) {
            Some((side, key)) => sides.entry(key).or_default()[side as usize].push(path.clone()),
            None => sideless += 1,
        }
    }
    let mut pairing = match_sides(sides, entries.other)?;
    pairing.sideless = sideless;
    Ok(pairing)
}

/// The side that a file's stem tells, and what is left of the stem.
fn side_of(stem: &str) -> Option<(Side, String)> {
    let lower = stem.to_ascii_lowercase();
    let words = [("left", Side::Left), ("right", Side::Right)];
    for (word, side) in words {
        if lower.starts_with(word) {
            return Some((side, stem[word.len()..].trim_start_matches(['_', '-', ' ']).to_owned()));
        }
    }
    for (word, side) in words.into_iter().chain([("l", Side::Left), ("r", Side::Right)]) {
        if let Some(rest) = lower.strip_suffix(word)
            && rest.len() > 1
            && rest.ends_with(['_', '-'])
        {
            return Some((side, stem[..rest.len() - 1].to_owned()));
        }
    }
    None
}

fn match_sides(sides: Sides, other: usize) -> Result<Pairing> {
    let mut pairing = Pairing { other, ..Pairing::default() };
    for (key, [left, right]) in sides {
        match (left.as_slice(), right.as_slice()) {
            ([left], [right]) => {
                // left.png beside right.png has nothing else to be called by.
                let pair = if key.is_empty() { "left-right".to_owned() } else { key };
                pairing.pairs.push(PairFiles { pair, left: left.clone(), right: right.clone() });
            }
            ([], single) | (single, []) => pairing.single.extend(single.iter().cloned()),
            ([first, second, ..], _) | (_, [first, second, ..]) => {
                return Err(Error::SameName { pair: key, first: first.clone(), second: second.clone() });
            }
        }
    }
    Ok(pairing)
}

fn explain_nothing(folder: &Utf8Path, entries: &Entries, pairing: &Pairing) -> Error {
    let path = folder.to_owned();
    // The pictures may lie one folder deeper: out/check/left, out/check/right.
    let deeper = entries.folders.iter().find(|f| f.join("left").is_dir() && f.join("right").is_dir()).cloned();
    let is_side = |f: &Utf8PathBuf, name: &str| f.file_name().is_some_and(|n| n.eq_ignore_ascii_case(name));
    let has = |name: &str| entries.folders.iter().any(|f| is_side(f, name));
    match (has("left"), has("right")) {
        (true, false) => return Error::OneSide { path, found: "left", missing: "right" },
        (false, true) => return Error::OneSide { path, found: "right", missing: "left" },
        _ => {}
    }
    Error::NoPairs { path, single: pairing.single.len(), sideless: pairing.sideless, deeper }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(names: &[&str]) -> (tempfile::TempDir, Utf8PathBuf) {
        let dir = tempfile::tempdir().unwrap();
        let path = Utf8Path::from_path(dir.path()).unwrap().to_owned();
        for name in names {
            let file = path.join(name);
            std::fs::create_dir_all(file.parent().unwrap()).unwrap();
            std::fs::write(file, "").unwrap();
        }
        (dir, path)
    }

    fn names(names: &[&str]) -> Vec<String> {
        let (_keep, path) = folder(names);
        pair_files(&path).unwrap().pairs.into_iter().map(|p| p.pair).collect()
    }

    fn complaint(of: &[&str]) -> String {
        let (_keep, path) = folder(of);
        crate::diagnostic::report(&pair_files(&path).unwrap_err())
    }

    #[test]
    fn every_way_of_naming() {
        assert_eq!(names(&["left/10.png", "right/10.PNG", "left/2.tif", "right/2.tiff"]), ["2", "10"]);
        assert_eq!(names(&["Left/left1.png", "Right/right1.png"]), ["1"]);
        assert_eq!(names(&["left01.jpg", "right01.jpg", "left_02.jpg", "right_02.jpg"]), ["01", "02"]);
        assert_eq!(names(&["a_left.png", "a_right.png"]), ["a"]);
        assert_eq!(names(&["a_L.png", "a_R.png", "b_l.png", "b_r.png"]), ["a", "b"]);
        assert_eq!(names(&["left.png", "right.png"]), ["left-right"]);
    }

    #[test]
    fn what_is_left_out_is_said() {
        let (_keep, path) = folder(&["left1.png", "right1.png", "left2.png", "board.png", "notes.txt", "signal.png"]);
        let text = pair_files(&path).unwrap().left_out().unwrap();
        assert_eq!(
            text,
            "left out: 1 picture without a partner (left2.png); 2 pictures whose names tell neither left nor right; \
             1 other file"
        );
    }

    #[test]
    fn folders_without_pairs_say_what_they_hold() {
        assert!(complaint(&[]).contains("no pictures"));
        assert!(complaint(&["left/a.png"]).contains("left/ but no right/"));
        assert!(complaint(&["left/a.png", "right/b.png"]).contains("2 pictures"));
        assert!(complaint(&["check/left/a.png", "check/right/a.png"]).contains("/check`"));
        assert!(complaint(&["left/a.png", "left/a.jpg", "right/a.png"]).contains("a.jpg and"));
        assert!(complaint(&["board.png"]).contains("neither left nor right"));
        let missing = crate::diagnostic::report(&pair_files(Utf8Path::new("/no/such/folder")).unwrap_err());
        assert!(missing.contains("not found") && missing.contains("/no/such/folder"), "{missing}");
    }

    #[test]
    fn numbers_sort_by_value() {
        let mut names = ["b1", "a10", "a2", "a02", "a", "é3", "10", "9"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["9", "10", "a", "a02", "a2", "a10", "b1", "é3"]);
    }
}
