//! From folders to pairs of picture files.
//!
//! In: a folder, or one for each side. `left/` and `right/`, two folders of any name, also deeper, or names that say the side. Out: pairs in
//! natural order (`2` before `10`), what was taken, and what was left out and why. `listing` finds the pictures, `names` the words for a
//! side, `readings` what could be meant, `matching` which pictures belong together.
//! Goes wrong: no pictures, one side only, two files that claim the same place, more than one reading; the error shows what was found
//! and the call that would do.

mod explain;
mod halves;
#[cfg(test)]
mod layouts;
mod listing;
mod matching;
mod names;
mod readings;
#[cfg(test)]
mod tests;

use camino::{Utf8Path, Utf8PathBuf};

pub use matching::PairBy;
pub use names::natural_order;

use self::listing::{Folder, list, tree};
use self::readings::{Reading, Told};
use crate::files::OutDir;
use crate::imaging::{Error, Result};

/// The two picture files of a pair.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PairFiles {
    /// Name of the pair: the pictures' common stem, what is left of both without the word for the side, or their number.
    pub pair: String,
    /// The left picture.
    pub left: Utf8PathBuf,
    /// The right picture.
    pub right: Utf8PathBuf,
}

/// Where pictures are, and how they are to be read.
#[derive(Debug, Clone, Copy)]
pub struct Source<'a> {
    /// The command that asks, for the calls in messages.
    pub command: &'a str,
    /// The folder of all pictures, or of the left ones.
    pub images: &'a Utf8Path,
    /// The folder of the right ones.
    pub right: Option<&'a Utf8Path>,
    /// How they are paired; `None` is by name, else by number.
    pub by: Option<PairBy>,
    /// Whether each picture holds both halves.
    pub side_by_side: bool,
}

/// A folder understood.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pairing {
    /// The folder, as messages name it.
    pub place: Utf8PathBuf,
    /// Pairs in natural order of their names.
    pub pairs: Vec<PairFiles>,
    /// What was taken, in a line.
    pub taken: String,
    /// Pictures of one side without the other.
    pub single: Vec<Utf8PathBuf>,
    /// Pictures whose names tell no side.
    pub sideless: usize,
    /// Files that are no pictures.
    pub other: usize,
}

impl<'a> Source<'a> {
    /// One folder, read as it is.
    pub fn folder(command: &'a str, images: &'a Utf8Path) -> Source<'a> {
        Source { command, images, right: None, by: None, side_by_side: false }
    }

    /// The folders that were named.
    pub fn places(&self) -> Vec<&'a Utf8Path> {
        std::iter::once(self.images).chain(self.right).collect()
    }

    /// Finds the pairs. At least one, else an error that says what was there. Halves of pictures are written among the program's own
    /// files in `out`.
    pub fn pairs(&self, out: &OutDir) -> Result<Pairing> {
        if self.side_by_side { halves::split(self, out) } else { self.whole_pictures() }
    }

    fn whole_pictures(&self) -> Result<Pairing> {
        let top = list(self.images).map_err(|e| self.beside(e))?;
        if let Some(right) = self.right {
            let (left, right) =
                (the_pictures(self, top)?, the_pictures(self, list(right).map_err(|e| self.beside(e))?)?);
            if left.path.canonicalize().is_ok_and(|path| right.path.canonicalize().is_ok_and(|other| path == other)) {
                return Err(explain::same(self));
            }
            let reading = readings::two_folders(&left, &right, Told::Given, self.by)?;
            return self.one(reading, &[left, right]);
        }
        if let Some([left, right]) = left_and_right(&top)? {
            let reading = readings::two_folders(&left, &right, Told::Words, self.by)?;
            return self.one(reading, &[top, left, right]);
        }
        let folders = tree(top);
        let mut tried = Vec::new();
        let mut refused = None;
        for reading in readings::all(&folders, self.by) {
            match reading {
                Ok(reading) => tried.push(reading),
                Err(e) => refused = refused.or(Some(e)),
            }
        }
        let mut best = readings::choose(tried.clone());
        match (best.len(), refused) {
            (0, Some(e)) => Err(e),
            (0, None) => Err(explain::none(self, &folders, &tried)),
            (1, _) => self.one(best.remove(0), &folders),
            _ => Err(explain::several(self, &best)),
        }
    }

    /// A reading without a rival.
    fn one(&self, reading: Reading, folders: &[Folder]) -> Result<Pairing> {
        if reading.count() == 0 {
            return Err(explain::none(self, folders, &[reading]));
        }
        let mut taken = explain::taken(&reading, self.images);
        if let Some(others) = explain::not_taken(&reading, folders) {
            taken = format!("{taken}; {others}");
        }
        let Reading { matched, sideless, other, .. } = reading;
        let place = self.places().iter().map(|p| p.as_str()).collect::<Vec<_>>().join(" and ").into();
        Ok(Pairing { place, pairs: matched.pairs, taken, single: matched.single, sideless, other })
    }

    /// A second place that is no folder of pictures was perhaps meant for a flag.
    fn beside(&self, error: Error) -> Error {
        match (error, self.right) {
            (Error::NoFolder { path } | Error::NotAFolder { path }, Some(right)) if path == right => {
                Error::NotRight { found: path.exists(), path }
            }
            (error, _) => error,
        }
    }
}

/// `left/` and `right/` that hold pictures themselves, whatever else lies beside them.
fn left_and_right(top: &Folder) -> Result<Option<[Folder; 2]>> {
    let sub = |name: &str| -> Option<Result<Folder>> {
        top.folders.iter().find(|f| f.file_name().is_some_and(|n| n.eq_ignore_ascii_case(name))).map(|path| {
            let below = path.strip_prefix(&top.path).unwrap_or(path).to_string();
            Ok(Folder { below, depth: 1, ..list(path)? })
        })
    };
    let (Some(left), Some(right)) = (sub("left"), sub("right")) else { return Ok(None) };
    let (left, right) = (left?, right?);
    let both = !left.pictures.is_empty() && !right.pictures.is_empty();
    Ok(both.then_some([left, right]))
}

/// The folder that holds the pictures of a side: the one that was named, or the only one below that has any.
fn the_pictures(source: &Source<'_>, named: Folder) -> Result<Folder> {
    if !named.pictures.is_empty() {
        return Ok(named);
    }
    let path = named.path.clone();
    let folders = tree(named);
    let mut holding = folders.iter().filter(|folder| !folder.pictures.is_empty());
    match (holding.next(), holding.next()) {
        (Some(only), None) => Ok(only.clone()),
        _ => Err(explain::none(&Source { images: &path, right: None, ..*source }, &folders, &[])),
    }
}
