//! Which pairs belong to one rig, how their corners are numbered, and what happened to the others.

pub mod candidates;
pub mod discarded;
pub mod missed;
pub mod mixups;
mod moved;
pub mod numbering;
pub mod open_numbers;
pub mod series;

use crate::stereo::model::KnownLenses;

pub use discarded::{Cause, Discarded, DiscardedPair, PictureCorners, Standing};

/// Fewest pairs for a calibration whose accuracy can be held out: three calibrate, the fourth judges.
pub const FEWEST_PAIRS: usize = 4;

/// The same where the lenses of both cameras are known: two calibrate, the third judges.
const FEWEST_OF_KNOWN: usize = 3;

/// Fewest pairs for a calibration with what is known of the lenses.
pub fn fewest_pairs(known: Option<&KnownLenses>) -> usize {
    if known.is_some_and(KnownLenses::both) { FEWEST_OF_KNOWN } else { FEWEST_PAIRS }
}
