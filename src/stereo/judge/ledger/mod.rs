//! The ledger of evidence: every fact that speaks for or against a rig, its limit with the reason, and the best verdict that it allows.
//!
//! In: what was asked of a calibration. Out: one line a fact. Wherever it can be computed a fact is what it could do to a length, in mm,
//! and its limit is the tolerance. No verdict is better than its worst line.

mod all;
mod facts;
mod lengths;
mod moves;
mod pairs;

pub use all::ledger;
pub use facts::{Case, Facts, LensPairs, Standards};
pub use lengths::{RAYS, TOLERANCE};
pub use moves::KNOWN_MOVE;
pub use pairs::KNOWN_LENSES;
