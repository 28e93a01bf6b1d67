//! Which pairs belong to one rig, how their corners are numbered, and what happened to the others.

pub mod candidates;
pub mod discarded;
pub mod flip;
pub mod mixups;
mod moved;
pub mod numbering;
pub mod open_numbers;
pub mod series;
pub mod shifts;

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

/// Pairs that usually miss their rig by so many times what each camera leaves of its own pictures were not taken at one
/// moment: a lens or a rig that lacks something leaves no more than about this.
pub const TIMES: f64 = 3.0;

/// From so many times on, half of what the pictures tell of the lenses is lost in the pairs: their corners' variance in
/// the rig is twice that in one camera.
const HALF_IS_LOST: f64 = std::f64::consts::SQRT_2;

/// How many times what each camera leaves of its own pictures the pairs usually miss their rig by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Missed {
    pub times: f64,
}

impl Missed {
    /// Whether the two pictures of the pairs were usually not taken at one moment.
    pub fn is_of_two_moments(&self) -> bool {
        self.times > TIMES
    }

    /// Whether each camera alone tells more of its lens than the pairs do, in which something moved between the two
    /// pictures.
    pub fn is_better_alone(&self) -> bool {
        self.times > HALF_IS_LOST
    }
}
