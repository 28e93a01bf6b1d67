//! Corners found in pairs of pictures: what imaging hands to stereo, and what `corners.csv` holds.

use nalgebra::{Matrix2, Point2};

use super::Board;

/// Left or right picture of a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// The reference camera's.
    Left,
    /// The other.
    Right,
}

impl Side {
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    pub fn other(self) -> Side {
        Side::BOTH[1 - self as usize]
    }

    /// The word in files and messages.
    pub fn name(self) -> &'static str {
        ["left", "right"][self as usize]
    }
}

/// One corner of the board in one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Column on the board, along x.
    pub col: usize,
    /// Row on the board, along y.
    pub row: usize,
    /// Raw (distorted) place in the picture, px.
    pub px: Point2<f64>,
    /// Covariance of the place, px^2, where the refinement gave one.
    pub covariance_px2: Option<Matrix2<f64>>,
    /// Standard deviation of the blur across its edges, px, where the refinement gave one.
    pub blur_px: Option<f64>,
    /// How far its window reaches along the edges that run along the rows and along the columns, as a share of a
    /// square's side; known where it was measured here.
    pub reach: Option<[f64; 2]>,
    /// False for a corner that was found but is not to be relied on.
    pub used: bool,
}

impl Corner {
    /// A corner of which no more is known than its place.
    pub fn at(col: usize, row: usize, px: Point2<f64>) -> Corner {
        Corner { col, row, px, covariance_px2: None, blur_px: None, reach: None, used: true }
    }
}

/// The corners of one board in one pair of pictures. Each list is sorted by row, then column; a corner may be missing.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PairCorners {
    /// Name of the pair: the pictures' common stem.
    pub pair: String,
    pub left: Vec<Corner>,
    pub right: Vec<Corner>,
}

/// A pair that was not used, and why.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Skipped {
    /// Name of the pair.
    pub pair: String,
    /// Why, for a person.
    pub reason: String,
}

/// The first names, and how many more there are.
pub fn named(pairs: &[String]) -> String {
    const MOST: usize = 8;
    let more = pairs.len().saturating_sub(MOST);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", pairs.iter().take(MOST).cloned().collect::<Vec<_>>().join(", "))
}

/// How many of all, where they are too few.
pub fn too_few(found: usize, total: usize) -> String {
    if found == 0 { format!("none of {total}") } else { format!("only {found} of {total}") }
}

/// Why pairs were skipped, a line a reason, those of most pairs first.
pub fn reasons(skipped: &[Skipped]) -> String {
    /// More would push the message itself off the screen.
    const MOST: usize = 8;
    let mut by_reason: Vec<(&str, Vec<String>)> = Vec::new();
    for Skipped { pair, reason } in skipped {
        match by_reason.iter_mut().find(|(known, _)| known == reason) {
            Some((_, pairs)) => pairs.push(pair.clone()),
            None => by_reason.push((reason, vec![pair.clone()])),
        }
    }
    by_reason.sort_by_key(|(_, pairs)| std::cmp::Reverse(pairs.len()));
    let mut text: String =
        by_reason.iter().take(MOST).map(|(reason, pairs)| format!("\n  {}: {reason}", named(pairs))).collect();
    let others: usize = by_reason.iter().skip(MOST).map(|(_, pairs)| pairs.len()).sum();
    if others > 0 {
        text.push_str(&format!("\n  and {others} more"));
    }
    text
}

/// A pair at least one of whose pictures leaves its numbers open.
#[derive(Debug, Clone, PartialEq)]
pub struct OpenPair {
    pub pair: String,
    /// The corners of its left and of its right picture, once for each way of numbering them.
    pub sides: [Vec<Vec<Corner>>; 2],
    /// How many pairs that leave nothing open come before it.
    pub before: usize,
}

/// The corners of all pairs of a folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Corners {
    /// The board that was looked for.
    pub board: Board,
    /// Width and height of the left pictures, px.
    pub left_size: (u32, u32),
    /// Width and height of the right pictures, px.
    pub right_size: (u32, u32),
    /// Pairs in which the board was found in both pictures, sorted by name.
    pub pairs: Vec<PairCorners>,
    pub skipped: Vec<Skipped>,
    /// Pictures without a corner in pairs that are used for what the other picture shows, with the reason.
    pub blind: Vec<(Side, Skipped)>,
    /// Those of the skipped ones that could be if it were known which of the board's corners they show.
    pub open: Vec<OpenPair>,
    /// What a person should know beside that: files left out, a size that was guessed, another board that was seen.
    pub notes: Vec<String>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reason_is_said_once_with_its_pairs() {
        let pair = |name: String, reason: &str| Skipped { pair: name, reason: reason.to_owned() };
        let mut skipped = vec![pair("a".to_owned(), "no board found")];
        skipped.extend((1..=12).map(|k| pair(format!("{k:02}"), "another board")));
        skipped.extend((0..9).map(|k| pair(format!("b{k}"), &format!("reason {k}"))));
        let said = reasons(&skipped);
        assert!(
            said.starts_with("\n  01, 02, 03, 04, 05, 06, 07, 08 and 4 more: another board\n  a: no board found\n"),
            "{said}"
        );
        assert!(said.ends_with("\n  b5: reason 5\n  and 3 more"), "{said}");
        assert_eq!(reasons(&[]), "");
    }
}
