//! Which pairs belong to one rig, how their corners are numbered, and what happened to the others.

pub mod candidates;
pub mod discarded;
pub mod misfit;
mod mixups;
pub mod numbering;
pub mod series;

pub use discarded::{Cause, Discarded, DiscardedPair, PictureCorners, Standing};

/// Fewest pairs for a calibration whose accuracy can be held out: three calibrate, the fourth judges.
pub const FEWEST_PAIRS: usize = 4;
