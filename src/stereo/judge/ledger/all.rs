//! All lines of the ledger, in the order in which they are read.

use super::facts::Facts;
use super::{lengths, moves, pairs};
use crate::stereo::judge::evidence::Evidence;

/// The ledger.
pub fn ledger(facts: &Facts) -> Vec<Evidence> {
    let mut lines = vec![
        lengths::held_out_lengths(facts),
        lengths::any_length(facts),
        lengths::models(facts),
        lengths::residuals(facts),
        pairs::pair_scatter(facts),
        lengths::folds(facts),
        lengths::rays(facts),
        lengths::epipolar(facts),
        pairs::pairs_discarded(facts),
        pairs::findings(facts),
        pairs::standing(facts),
        pairs::poses(facts),
        pairs::tilts(facts),
    ];
    lines.extend(pairs::focal_lengths(facts));
    lines.extend(pairs::reach(facts));
    lines.extend(pairs::known_lenses(facts));
    lines.push(lengths::second_board(facts));
    lines.extend(moves::known_moves(facts));
    lines
}
