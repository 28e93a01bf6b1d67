//! The squares of a plain board, counted in the pictures that show all of it.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::detect::count::squares_of;
use super::image::{self, Claim};
use super::input::pairs::Pairing;
use super::{Error, Mosaic, Result, Squares};
use crate::progress;

/// Pictures in which a count must be seen at least.
const FEWEST: usize = 2;
/// One picture in so many may show another count.
const AGREEING: usize = 10;

/// Squares of a board, and how many pictures show them of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counted {
    /// The squares.
    pub squares: Squares,
    /// Pictures that show so many.
    pub pictures: usize,
    /// Pictures in all.
    pub of: usize,
}

/// Counts the board's squares; an error where no picture shows the whole board, or they contradict each other.
pub fn count_squares(pairing: &Pairing, mosaic: Option<Mosaic>) -> Result<Counted> {
    let paths: Vec<_> = pairing.pairs.iter().flat_map(|files| [&files.left, &files.right]).collect();
    let bar = progress::bar("counting the board's squares", paths.len() as u64);
    let seen: Vec<Option<Squares>> = paths
        .par_iter()
        .map(|path| {
            bar.inc(1);
            let header = image::header(path).ok()?;
            let _claim = Claim::wait(&header);
            squares_of(&image::decode(&image::read(path, &header).ok()?, path, mosaic).ok()?)
        })
        .collect();
    bar.finish_and_clear();
    let mut counts: BTreeMap<(usize, usize), usize> = BTreeMap::new();
    for squares in seen.iter().flatten() {
        *counts.entry((squares.columns, squares.rows)).or_default() += 1;
    }
    decided(&counts, seen.len()).ok_or_else(|| Error::NotCounted {
        path: pairing.place.clone(),
        counts: counts.into_iter().collect(),
        of: seen.len(),
    })
}

/// The count that the pictures agree on.
fn decided(counts: &BTreeMap<(usize, usize), usize>, of: usize) -> Option<Counted> {
    let (&(columns, rows), &pictures) = counts.iter().max_by_key(|(_, pictures)| **pictures)?;
    let others = counts.values().sum::<usize>() - pictures;
    let is_clear = pictures >= FEWEST.min(of) && others * AGREEING <= pictures;
    is_clear.then_some(Counted { squares: Squares { columns, rows }, pictures, of })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_contradict_each_other_decide_nothing() {
        let of = |counts: &[((usize, usize), usize)]| {
            decided(&counts.iter().copied().collect(), 20)
                .map(|counted| (counted.squares.to_string(), counted.pictures))
        };
        assert_eq!(of(&[((9, 7), 12)]), Some(("9x7".to_owned(), 12)));
        assert_eq!(of(&[((9, 7), 10), ((5, 4), 1)]), Some(("9x7".to_owned(), 10)));
        assert_eq!(of(&[((9, 7), 9), ((5, 4), 1)]), None);
        assert_eq!(of(&[((9, 7), 6), ((8, 7), 6)]), None);
        assert_eq!(of(&[((9, 7), 1)]), None);
        assert_eq!(of(&[]), None);
    }
}
