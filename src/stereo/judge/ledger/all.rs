//! All lines of the ledger, in the order in which they are read.

use super::facts::Case;
use super::{lengths, moves, pairs};
use crate::stereo::judge::evidence::Evidence;

/// The ledger.
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
