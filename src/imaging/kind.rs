//! Whether the pictures in which a plain board was found show one with markers.
//!
//! The corners of a ChArUco board are those of a plain one, whose ends and whose turn they do not tell: pairs that are
//! numbered so contradict each other, and nothing in their corners says why. In: pictures, and the plain board that
//! was looked for. Out: the error with the markers that most of some pictures show.

use rayon::prelude::*;

use super::coded::of_other_kind;
use super::image::{self, Claim};
use super::input::pairs::{PairFiles, Pairing};
use super::{Board, Error, Mosaic, Skipped};

/// Pairs that are looked at, spread over all.
const LOOKS: usize = 6;

/// The error of a plain board of which `needed` pairs were asked for, where most pictures show one with markers.
pub fn with_markers(pairing: &Pairing, board: &Board, needed: usize, mosaic: Option<Mosaic>) -> Option<Error> {
    if board.is_coded() {
        return None;
    }
    let step = pairing.pairs.len().div_ceil(LOOKS).max(1);
    let looked_at: Vec<&PairFiles> = pairing.pairs.iter().step_by(step).collect();
    let shown = |files: &&PairFiles| {
        let header = image::header(&files.left).ok()?;
        let _claim = Claim::wait(&header);
        let picture = image::decode(&image::read(&files.left, &header).ok()?, &files.left, mosaic).ok()?;
        let reason = format!("left picture: {}", of_other_kind(&picture, board)?);
        Some(Skipped { pair: files.pair.clone(), reason })
    };
    let skipped: Vec<Skipped> = looked_at.par_iter().filter_map(shown).collect();
    let total = looked_at.len();
    (2 * skipped.len() > total).then(|| Error::TooFewPairs {
        found: 0,
        total,
        not_searched: pairing.pairs.len() - total,
        needed,
        board: Box::new(*board),
        path: pairing.place.clone(),
        skipped,
        other: None,
    })
}
