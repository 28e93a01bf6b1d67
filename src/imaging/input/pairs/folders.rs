//! Pairs of whole pictures in folders: a folder for each side that was named, `left/` and `right/`, or the one reading
//! of all that is there.

use super::explain;
use super::listing::{Folder, list, tree};
use super::matching::in_order;
use super::pairing::{Pairing, Source};
use super::readings::{self, Reading, Told};
use crate::imaging::{Error, Result};

impl Source<'_> {
    /// Finds the pairs of pictures that show one view each.
    pub(super) fn whole_pictures(&self) -> Result<Pairing> {
        let top = list(self.images).map_err(|e| self.beside(e))?;
        if let Some(right) = self.right {
            let (left, right) =
                (the_pictures(self, top)?, the_pictures(self, list(right).map_err(|e| self.beside(e))?)?);
            if left.path.canonicalize().is_ok_and(|path| right.path.canonicalize().is_ok_and(|other| path == other)) {
                return Err(explain::same(self));
            }
            let reading = readings::two_folders(&left, &right, Told::Given, self.by)?;
            let below = [left, right].into_iter().flat_map(tree);
            // Each as it was named, so that the two are told apart.
            let folders: Vec<Folder> = below.map(|f| Folder { below: f.path.to_string(), ..f }).collect();
            return self.one(reading, &folders);
        }
        if let Some([left, right]) = left_and_right(&top)? {
            let reading = readings::two_folders(&left, &right, Told::Words, self.by)?;
            return self.one(reading, &tree(top));
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
        let mut best = readings::choose(tried.clone(), self.needed);
        match (best.len(), refused) {
            (0, Some(e)) => Err(e),
            (0, None) => Err(explain::none(self, &folders, &tried)),
            (1, _) => self.one(best.remove(0), &folders),
            _ => Err(explain::several(self, &best, |reading| self.is_read_alone(reading))),
        }
    }

    /// Whether the folders of a reading, when they are named, are read as it reads them.
    fn is_read_alone(&self, reading: &Reading) -> bool {
        let (images, right) = match reading.places.as_slice() {
            [images] if images != self.images => (images, None),
            [left, right] => (left, Some(right.as_path())),
            _ => return false,
        };
        let alone = Source { images, right, ..*self }.whole_pictures();
        alone.is_ok_and(|found| found.pairs == reading.matched.pairs)
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
        let Reading { matched, sideless, aside, sides: [left, right], .. } = reading;
        let place = self.places().iter().map(|p| p.as_str()).collect::<Vec<_>>().join(" and ").into();
        let as_many = !matched.single.is_empty() && left.len() == right.len() && self.by.is_none();
        // Where the order parts pictures of one name, it is not that of the pairs.
        let could_be_in_order = as_many && {
            let ordered = in_order([&left, &right]).pairs;
            matched.pairs.iter().all(|pair| ordered.iter().any(|o| o.left == pair.left && o.right == pair.right))
        };
        let (pairs, single) = (matched.pairs, matched.single);
        Ok(Pairing { place, pairs, taken, single, could_be_in_order, sideless, aside })
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
pub fn the_pictures(source: &Source<'_>, named: Folder) -> Result<Folder> {
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
