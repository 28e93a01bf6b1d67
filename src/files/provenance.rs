//! Where a result came from: program, date, command line, and the files it was made of, with their hashes.
//!
//! The hashes are SHA-256, so that `sha256sum` checks them. Pictures, of which there may be gigabytes, are listed by
//! 128 bits of XXH3, as `xxh128sum` prints them, and the list is hashed: SHA-256 of a picture takes a sixth of the time
//! of decoding it. Everything but the date and the command line is the same for the same inputs; the date is that of
//! `SOURCE_DATE_EPOCH` (reproducible-builds.org) where that is set.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, SystemTime};

use camino::{Utf8Path, Utf8PathBuf};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use xxhash_rust::xxh3::xxh3_128;

/// The key of a JSON file that holds its provenance.
pub const KEY: &str = "provenance";

/// Extensions of pictures, in small letters; those that lose nothing first. Of a folder that is read, these files count
/// as read.
const PICTURES: [&str; 8] = ["png", "tif", "tiff", "bmp", "pgm", "pnm", "jpg", "jpeg"];

/// Digits of a picture's hash that are kept: 64 bits tell any two of a million pictures apart.
const HASH_KEPT: usize = 16;

/// What was typed, when, and what may be overwritten.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// The command line as typed, `None` where no provenance is wanted.
    pub command: Option<String>,
    /// Whether foreign files may be replaced.
    pub force: bool,
    /// What every command reads: the settings file, where there is one.
    pub inputs: Vec<Utf8PathBuf>,
}

/// The content of `provenance` in a JSON file.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Provenance {
    /// "stereocal" and its version.
    pub program: String,
    /// UTC, to the second.
    pub date: String,
    /// The command line.
    pub command: String,
    /// What was read, in the order of the command's stages.
    pub inputs: Vec<Digested>,
    /// What the same run wrote before this file.
    pub outputs: Vec<Digested>,
    /// How the measurements came about that a robot was identified from, where `measure.json` stands beside them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_by: Option<Box<Provenance>>,
}

impl Provenance {
    /// That of a run which has read and written nothing yet.
    pub fn new(command: String) -> Provenance {
        Provenance { program: program(), date: date(), command, ..Provenance::default() }
    }

    /// That which a JSON file holds, if it is one and holds any.
    pub fn of_json(path: &Utf8Path) -> Option<Provenance> {
        let value: serde_json::Value = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
        serde_json::from_value(value.get(KEY)?.clone()).ok()
    }

    /// The hashes of the pictures that the JSON file there was made of.
    pub fn pictures_of(file: &Utf8Path) -> BTreeSet<String> {
        let inputs = Provenance::of_json(file).map(|made| made.inputs).unwrap_or_default();
        inputs.into_iter().flat_map(|input| input.picture_hashes).collect()
    }

    /// What this run read that the JSON file there was made of, too, a folder where it is some of its pictures: of that
    /// it is no test.
    pub fn shares(&self, file: &Utf8Path) -> Option<&str> {
        let made_of = Provenance::of_json(file)?.inputs;
        let of = |input: &Digested, read: &Digested| {
            input.sha256 == read.sha256 || input.picture_hashes.iter().any(|hash| read.picture_hashes.contains(hash))
        };
        let same = |read: &&Digested| made_of.iter().any(|input| of(input, read));
        self.inputs.iter().find(same).map(|read| read.file.as_str())
    }
}

/// Name and version.
pub fn program() -> String {
    format!("stereocal {}", env!("CARGO_PKG_VERSION"))
}

/// The date that results carry, UTC.
fn date() -> String {
    let given = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.trim().parse::<u32>().ok());
    #[expect(
        clippy::disallowed_methods,
        reason = "the date of a run is part of its provenance; nothing is computed from it"
    )]
    let time = given.map_or_else(SystemTime::now, |s| SystemTime::UNIX_EPOCH + Duration::from_secs(s.into()));
    humantime::format_rfc3339_seconds(time).to_string()
}

/// A file or a folder of pictures, with its hash.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Digested {
    /// Its name: as typed if read, below the results folder if written.
    pub file: String,
    /// Of a file, of its bytes; of a folder, of what `xxh128sum` prints for its pictures in the order of their names.
    pub sha256: String,
    /// Pictures in the folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pictures: Option<usize>,
    /// The first half of what `xxh128sum` prints for each, in the order of their names: some of them are known again in
    /// another folder.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub picture_hashes: Vec<String>,
    /// Of a JSON file with a provenance, what its bytes would hash to without: equal for equal results of two dates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub content_sha256: Option<String>,
}

impl Digested {
    pub fn written(name: &str, bytes: &[u8]) -> Digested {
        let (sha256, content_sha256) = rayon::join(|| sha256(bytes), || content_sha256(name, bytes));
        Digested { file: name.to_owned(), sha256, content_sha256, ..Digested::default() }
    }

    /// The pictures of a folder; `known` are the hashes of those that were read. `None` where one of the others cannot
    /// be read.
    pub fn folder(path: &Utf8Path, known: &BTreeMap<Utf8PathBuf, String>) -> Option<Digested> {
        let mut files = pictures(path);
        // Pictures that lie elsewhere below it.
        if !files.iter().any(|file| known.contains_key(file)) {
            files.extend(known.keys().filter(|file| file.starts_with(path)).cloned());
            files.sort();
        }
        let hash = |file: &Utf8PathBuf| known.get(file).cloned().or_else(|| hash_of_picture(file));
        let hashes: Vec<String> = files.par_iter().map(hash).collect::<Option<_>>()?;
        let line =
            |(hash, file): (&String, &Utf8PathBuf)| format!("{hash}  {}\n", file.strip_prefix(path).unwrap_or(file));
        let lines: String = hashes.iter().zip(&files).map(line).collect();
        Some(Digested {
            file: path.to_string(),
            sha256: sha256(lines.as_bytes()),
            pictures: Some(files.len()),
            picture_hashes: hashes.iter().map(|hash| kept(hash)).collect(),
            content_sha256: None,
        })
    }

    /// A file that is read; `None` where it cannot be: its reader will say why.
    pub fn read(path: &Utf8Path) -> Option<Digested> {
        if !path.is_file() {
            return None;
        }
        let content_sha256 = match path.extension() {
            Some("json") => content_sha256(path.as_str(), &std::fs::read(path).ok()?),
            _ => None,
        };
        let sha256 = sha256_of_file(path)?;
        Some(Digested { file: path.to_string(), sha256, content_sha256, ..Digested::default() })
    }

    /// Whether something else stands where this was read; what is there no more, or lies elsewhere below a folder, says
    /// nothing.
    pub fn is_other_now(&self) -> bool {
        let path = Utf8Path::new(&self.file);
        let now = match self.pictures {
            Some(_) if pictures(path).is_empty() => None,
            Some(_) => Digested::folder(path, &BTreeMap::new()),
            None => Digested::read(path),
        };
        now.is_some_and(|now| !self.same_content(&now))
    }

    /// Whether both were made of the same content, whatever their names and dates.
    pub fn same_content(&self, other: &Digested) -> bool {
        match (&self.content_sha256, &other.content_sha256) {
            (Some(a), Some(b)) => a == b,
            _ => self.sha256 == other.sha256,
        }
    }
}

/// The pictures of a folder and of its `left/` and `right/`, in the order of their names.
pub fn pictures(folder: &Utf8Path) -> Vec<Utf8PathBuf> {
    let folders = [folder.to_owned(), folder.join("left"), folder.join("right")];
    let entries = folders.iter().flat_map(|folder| folder.read_dir_utf8()).flatten().flatten();
    let is_picture = |path: &Utf8PathBuf| picture_format(path).is_some() && path.is_file();
    let mut found: Vec<Utf8PathBuf> = entries.map(|entry| entry.into_path()).filter(is_picture).collect();
    found.sort();
    found
}

/// Which format of picture a file is by its name, those that lose nothing first; `None` where it is none.
pub fn picture_format(path: &Utf8Path) -> Option<usize> {
    let extension = path.extension()?.to_ascii_lowercase();
    PICTURES.iter().position(|known| *known == extension)
}

/// SHA-256 in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    format!("{:x}", Sha256::digest(bytes))
}

/// XXH3 of a picture's bytes, 128 bits in hexadecimal digits: enough to tell any two pictures apart, no proof against
/// forgery.
pub fn picture_hash(bytes: &[u8]) -> String {
    format!("{:032x}", xxh3_128(bytes))
}

/// Whether one of these pictures is one of those whose hashes a result holds.
pub fn are_among<const N: usize>(pictures: &BTreeSet<String>, paths: [&Utf8Path; N]) -> bool {
    let is_among = |path| hash_of_picture(path).is_some_and(|hash| pictures.contains(&kept(&hash)));
    !pictures.is_empty() && paths.into_iter().any(is_among)
}

/// What a result holds of a picture's hash.
fn kept(hash: &str) -> String {
    hash.chars().take(HASH_KEPT).collect()
}

/// What `xxh128sum` prints for a picture; `None` where it cannot be read.
pub fn hash_of_picture(path: &Utf8Path) -> Option<String> {
    Some(picture_hash(&std::fs::read(path).ok()?))
}

fn sha256_of_file(path: &Utf8Path) -> Option<String> {
    let mut hash = Sha256::new();
    std::io::copy(&mut std::fs::File::open(path).ok()?, &mut hash).ok()?;
    Some(format!("{:x}", hash.finalize()))
}

fn content_sha256(name: &str, bytes: &[u8]) -> Option<String> {
    if !name.ends_with(".json") {
        return None;
    }
    let mut value: serde_json::Value = serde_json::from_slice(bytes).ok()?;
    value.as_object_mut()?.shift_remove(KEY)?;
    Some(sha256(value.to_string().as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::temporary_folder;

    #[test]
    fn content_is_what_is_left_without_provenance() {
        let a = Digested::written("a.json", br#"{"fx": 1.5, "provenance": {"date": "then"}}"#);
        let b = Digested::written("b.json", br#"{"fx": 1.5, "provenance": {"date": "now"}}"#);
        let c = Digested::written("c.json", br#"{"fx": 1.6, "provenance": {"date": "now"}}"#);
        assert!(a.same_content(&b) && a.sha256 != b.sha256 && !b.same_content(&c));
        let bare = Digested::written("d.json", br#"{"fx": 1.5}"#);
        assert!(bare.content_sha256.is_none() && !bare.same_content(&a));
    }

    #[test]
    fn what_a_result_was_made_of_is_known_again() {
        let (_keep, root) = temporary_folder();
        let (old, new, result) = (root.join("old.csv"), root.join("new.csv"), root.join("calibration.json"));
        std::fs::write(&old, "1").unwrap();
        std::fs::write(&new, "2").unwrap();
        let of = |inputs: &[&Utf8PathBuf]| Provenance {
            inputs: inputs.iter().filter_map(|path| Digested::read(path)).collect(),
            ..Provenance::new(String::new())
        };
        std::fs::write(&result, serde_json::json!({ KEY: of(&[&old]) }).to_string()).unwrap();
        assert_eq!(of(&[&new, &old]).shares(&result), Some(old.as_str()));
        assert_eq!(of(&[&new, &result]).shares(&result), None);
        assert_eq!(of(&[&old]).shares(&new), None);
    }

    #[test]
    fn some_of_the_pictures_are_known_again_under_other_names() {
        let (_keep, root) = temporary_folder();
        let folder = |name: &str, pictures: &[(&str, &str)]| {
            let folder = root.join(name);
            std::fs::create_dir(&folder).unwrap();
            pictures.iter().for_each(|(file, bytes)| std::fs::write(folder.join(file), bytes).unwrap());
            Provenance {
                inputs: vec![Digested::folder(&folder, &BTreeMap::new()).unwrap()],
                ..Provenance::new(String::new())
            }
        };
        let result = root.join("calibration.json");
        let made_of = folder("all", &[("1.png", "a"), ("2.png", "b"), ("3.png", "c")]);
        std::fs::write(&result, serde_json::json!({ KEY: made_of }).to_string()).unwrap();
        let some = folder("some", &[("new.png", "d"), ("copy.png", "b")]);
        assert_eq!(some.shares(&result), Some(root.join("some").as_str()));
        assert_eq!(folder("others", &[("1.png", "d"), ("2.png", "e")]).shares(&result), None);
    }

    #[test]
    fn a_picture_has_the_hash_that_xxh128sum_prints() {
        assert_eq!(picture_hash(b""), "99aa06d3014798d86001c324468d497f");
    }

    #[test]
    fn a_folder_is_its_pictures() {
        let (_keep, root) = temporary_folder();
        std::fs::create_dir(root.join("left")).unwrap();
        std::fs::write(root.join("left/b.png"), "b").unwrap();
        std::fs::write(root.join("a.JPG"), "a").unwrap();
        std::fs::write(root.join("poses.csv"), "x").unwrap();
        let read = || Digested::folder(&root, &BTreeMap::new()).unwrap();
        let first = read();
        assert_eq!(first.pictures, Some(2));
        assert_eq!(
            first.sha256,
            sha256(format!("{}  a.JPG\n{}  left/b.png\n", picture_hash(b"a"), picture_hash(b"b")).as_bytes())
        );
        std::fs::write(root.join("poses.csv"), "y").unwrap();
        assert_eq!(read(), first);
        std::fs::write(root.join("left/b.png"), "c").unwrap();
        assert_ne!(read().sha256, first.sha256);
        assert!(first.is_other_now() && !read().is_other_now());
        // What counts is what was read, whatever stands there since.
        let known = BTreeMap::from([(root.join("left/b.png"), picture_hash(b"b"))]);
        assert_eq!(Digested::folder(&root, &known).unwrap(), first);
    }
}
