//! The ledger of evidence: every fact that speaks for or against a rig, its limit with the reason, and the best verdict
//! that it allows.
//!
//! In: what was asked of a calibration. Out: one line a fact. Wherever it can be computed a fact is what it could do to
//! a length, in mm, and its limit is the tolerance. No verdict is better than its worst line.

mod facts;
mod lengths;
mod moves;
mod pairs;

pub use facts::{Case, Facts, LensPairs, Standards};
pub use lengths::{RAYS, TOLERANCE};
pub use moves::KNOWN_MOVE;
pub use pairs::KNOWN_LENSES;

use crate::stereo::judge::evidence::Evidence;

/// All lines, in the order in which they are read.
pub fn ledger(case: &Case) -> Vec<Evidence> {
    let mut lines = vec![
        lengths::held_out_lengths(case),
        lengths::any_length(case),
        lengths::models(case),
        lengths::residuals(case),
        pairs::pair_scatter(case),
        lengths::folds(case),
        lengths::rays(case),
        lengths::epipolar(case),
        pairs::pairs_discarded(case),
        pairs::findings(case),
        pairs::standing(case),
        pairs::poses(case),
        pairs::tilts(case),
    ];
    lines.extend(lengths::along_sight(case));
    lines.extend(pairs::focal_lengths(case));
    lines.extend(pairs::baseline(case));
    lines.extend(lengths::tolerance(case));
    lines.extend(pairs::reach(case));
    lines.extend(pairs::known_lenses(case));
    lines.extend(pairs::lenses_of_these_pairs(case));
    lines.push(lengths::second_board(case));
    lines.extend(moves::known_moves(case));
    lines
}
