//! The squares of a plain board, counted in the pictures that show all of it.

use std::collections::BTreeMap;

use camino::Utf8PathBuf;
use rayon::prelude::*;

use super::detect::count::{Seen, squares_of};
use super::image::{self, Claim};
use super::input::pairs::Pairing;
use super::{Error, Mosaic, Result, Skipped, Squares};
use crate::progress;

/// Pictures in which a count must be seen at least.
const FEWEST: usize = 2;
/// One picture in so many may show another count.
const AGREEING: usize = 10;

/// Squares of a board, and how many pictures show them of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counted {
    pub squares: Squares,
    /// Pictures that show so many.
    pub pictures: usize,
    /// True where these show a margin behind them; else they show no more, and hardly any other does.
    pub ends: bool,
    /// Pictures in all.
    pub of: usize,
}

/// Counts the board's squares; an error where no picture shows the whole board, or they contradict each other.
pub fn count_squares(pairing: &Pairing, mosaic: Option<Mosaic>) -> Result<Counted> {
    let paths: Vec<_> = pairing.pairs.iter().flat_map(|files| [&files.left, &files.right]).collect();
    let bar = progress::bar("counting the board's squares", paths.len() as u64);
    let looks: Vec<Result<Option<Seen>, String>> = paths
        .par_iter()
        .map(|path| {
            bar.inc(1);
            let header = image::header(path)?;
            let _claim = Claim::wait(&header);
            Ok(squares_of(&image::decode(&image::read(path, &header)?, path, mosaic)?))
        })
        .collect();
    bar.finish_and_clear();
    let seen: Vec<Option<Seen>> = looks.iter().map(|look| *look.as_ref().ok()?).collect();
    let counts = |ends: bool| {
        let mut counts: Counts = BTreeMap::new();
        for squares in seen.iter().flatten().filter(|seen| seen.ends || !ends).map(|seen| seen.squares) {
            *counts.entry((squares.columns, squares.rows)).or_default() += 1;
        }
        counts
    };
    let (whole, of) = (counts(true), seen.len());
    decided(&whole, of, true).or_else(|| decided(&counts(false), of, false)).ok_or_else(|| Error::NotCounted {
        path: pairing.place.clone(),
        counts: whole.into_iter().collect(),
        of,
        unread: unread(&paths, &looks),
    })
}

/// The pictures that could not be read, and why.
fn unread(paths: &[&Utf8PathBuf], looks: &[Result<Option<Seen>, String>]) -> Vec<Skipped> {
    let of = |(path, look): (&&Utf8PathBuf, &Result<Option<Seen>, String>)| {
        let reason = look.as_ref().err()?.clone();
        Some(Skipped { pair: path.file_name().unwrap_or_default().to_owned(), reason })
    };
    paths.iter().zip(looks).filter_map(of).collect()
}

/// In how many pictures columns and rows of squares were counted.
type Counts = BTreeMap<(usize, usize), usize>;

/// The count that the pictures agree on, which show where the board `ends`. Of a board without a margin that is seen it
/// is what half of the pictures with a grid in full view show, and hardly any shows more: less is shown where a hand
/// covers a line.
fn decided(counts: &Counts, of: usize, ends: bool) -> Option<Counted> {
    let (&(columns, rows), &pictures) = counts.iter().max_by_key(|(_, pictures)| **pictures)?;
    let contradicts = |&(c, r): &(usize, usize)| if ends { (c, r) != (columns, rows) } else { c * r > columns * rows };
    let against: usize = counts.iter().filter(|(squares, _)| contradicts(squares)).map(|(_, pictures)| pictures).sum();
    let is_most = 2 * pictures > counts.values().sum();
    let is_clear = pictures >= FEWEST.min(of) && is_most && against * AGREEING <= pictures;
    is_clear.then_some(Counted { squares: Squares { columns, rows }, pictures, ends, of })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(counts: &[((usize, usize), usize)], ends: bool) -> Option<(String, usize)> {
        let counted = decided(&counts.iter().copied().collect(), 20, ends)?;
        Some((counted.squares.to_string(), counted.pictures))
    }

    #[test]
    fn pictures_that_contradict_each_other_decide_nothing() {
        assert_eq!(of(&[((9, 7), 12)], true), Some(("9x7".to_owned(), 12)));
        assert_eq!(of(&[((9, 7), 10), ((5, 4), 1)], true), Some(("9x7".to_owned(), 10)));
        assert_eq!(of(&[((9, 7), 9), ((5, 4), 1)], true), None);
        assert_eq!(of(&[((9, 7), 6), ((8, 7), 6)], true), None);
        assert_eq!(of(&[((9, 7), 1)], true), None);
        assert_eq!(of(&[], true), None);
        // Boards without a margin are counted where hardly any picture shows more.
        assert_eq!(of(&[((10, 7), 8), ((9, 7), 4), ((8, 7), 1)], false), Some(("10x7".to_owned(), 8)));
        // Hidden in most: the larger count is the board's, and is not told from a chance find.
        assert_eq!(of(&[((9, 7), 12), ((10, 7), 2)], false), None);
        assert_eq!(of(&[((9, 7), 5), ((8, 7), 5)], false), None);
        assert_eq!(of(&[((9, 7), 1)], false), None);
    }
}
