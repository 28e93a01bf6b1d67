//! Slides of the board by known lengths: the scale of the rig against something that is not the board.
//!
//! In: a calibration, and moves that are stated, each with its uncertainty and perhaps the pairs before and after. Out: how far the board moved as the
//! rig measures it, the scale error, and what explains it. Method: the displacement of the board's middle between both poses, with the poses' own
//! covariance and that of the rig which both share; the print moves with the board and cancels. Goes wrong: a board that also turns moves
//! each corner by another length; how far these differ is part of the uncertainty.

mod chosen;
mod judged;
mod slide;
mod stated;

#[cfg(test)]
mod tests;

pub use judged::{KnownMove, KnownMoves};
pub use stated::StatedMove;

use self::slide::Places;
use crate::stereo::Error;
use crate::stereo::calibrate::Calibration;

/// Refuses moves between pairs that are not there, before pictures are read.
pub fn check_names(stated: &[StatedMove], pairs: &[String]) -> Result<(), Error> {
    let named = stated.iter().filter_map(|stated| stated.between.as_ref()).flatten();
    match named.into_iter().find(|name| !pairs.contains(name)) {
        Some(name) => Err(Error::NoSuchPair { pair: name.clone(), pairs: pairs.to_vec() }),
        None => Ok(()),
    }
}

/// Measures moves that are stated. An error where it is not settled which pairs are meant, or a move is stated twice; a pair that is there and
/// was not used is said in the result.
pub fn measure(calibration: &Calibration, stated: &[StatedMove]) -> Result<KnownMoves, Error> {
    if stated.is_empty() {
        return Ok(KnownMoves::default());
    }
    let places = Places::new(calibration).ok_or_else(Error::undetermined)?;
    let mut moves = KnownMoves::default();
    let mut all: Vec<[usize; 2]> = Vec::new();
    for stated in stated {
        match chosen::pairs(&places, stated)? {
            Ok(ends) => {
                if all.contains(&ends) || all.contains(&[ends[1], ends[0]]) {
                    return Err(Error::MoveTwice { pairs: places.names(ends) });
                }
                all.push(ends);
                moves.measured.push(KnownMove::new(stated, &places, &places.slide(ends)));
            }
            Err(reason) => moves.missing.push(reason),
        }
    }
    Ok(moves)
}
