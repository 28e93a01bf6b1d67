//! Lines on known moves, where some were asked for.

use super::facts::Case;
use crate::stereo::judge::evidence::Evidence;
use crate::stereo::judge::moves::KnownMove;
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::pairs::Cause;

/// What the lines are called.
pub const KNOWN_MOVE: &str = "known move";

/// A line a move.
pub(super) fn known_moves(case: &Case) -> Vec<Evidence> {
    let moves = &case.facts.standards.moves;
    let told = moves.causes();
    let remedy = match told[..] {
        [] => "slide the board farther, or by a length that is known better, without turning it",
        [Cause::OtherBoard] => "give the squares the side that the moves tell, `--square-mm`",
        [Cause::KnownMove] => "look up what the moves were: one of them at least is not as stated",
        _ => "state a move of another length as well: it tells a wrong side of the squares from a wrong move",
    };
    let line =
        |value, allows, detail| Evidence { allows, ..Evidence::of_length(KNOWN_MOVE, remedy, value, case, detail) };
    let length_mm = case.facts.volume.length_mm;
    let of_move = |known: &KnownMove| known.verdict(length_mm, case.facts.tolerance_mm);
    let is_confirmed = told.is_empty() && moves.measured.iter().any(|known| of_move(known) == Verdict::Pass);
    let measured = |known: &KnownMove| {
        let allows = match of_move(known) {
            // Moves that contradict each other are no proof against the rig.
            Verdict::Fail if told == [Cause::KnownMove] => Verdict::Undecided,
            // One that agrees and tells less takes nothing from one that tells enough.
            Verdict::Undecided if is_confirmed => Verdict::Pass,
            allows => allows,
        };
        let detail = format!(
            "{}. The value is what the scale error with its uncertainty does to a length of {length_mm:.0} mm",
            known.statement()
        );
        line(Some((known.scale_error.abs() + known.expanded()) * length_mm), allows, detail)
    };
    let missing = |reason: &String| line(None, Verdict::Undecided, reason.clone());
    moves.measured.iter().map(measured).chain(moves.missing.iter().map(missing)).collect()
}
