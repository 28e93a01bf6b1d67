//! Which pairs belong to one rig, how their corners are numbered, and what happened to the others.

pub mod candidates;
mod changes;
pub mod consensus;
mod consistency;
mod diagnosis;
pub mod discarded;
pub mod numbering;
mod screening;
mod single_pictures;
#[cfg(test)]
mod tests;

pub use discarded::{Cause, Discarded, DiscardedPair, PictureCorners, Standing};

/// Fewest pairs for a calibration whose accuracy can be held out: three calibrate, the fourth judges.
pub const FEWEST_PAIRS: usize = 4;
