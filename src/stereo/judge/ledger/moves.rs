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
    let line = |value, allows, detail| Evidence {
        what: KNOWN_MOVE,
        remedy: "slide the board farther, or by a length that is known better, without turning it",
        value,
        limit: Some(case.facts.tolerance_mm),
        unit: "mm",
        allows,
        detail,
    };
    let length_mm = case.facts.volume.length_mm;
    // Moves that contradict each other are no proof against the rig.
    let told = case.facts.standards.moves.causes();
    let measured = |known: &KnownMove| {
        let mut allows = known.verdict(length_mm, case.facts.tolerance_mm);
        if allows == Verdict::Fail && told == [Cause::KnownMove] {
            allows = Verdict::Undecided;
        }
        let detail = format!(
            "{}. The value is what the scale error with its uncertainty does to a length of {length_mm:.0} mm",
            known.statement()
        );
        line(Some((known.scale_error.abs() + known.expanded()) * length_mm), allows, detail)
    };
    let missing = |reason: &String| line(None, Verdict::Undecided, reason.clone());
    case.facts
        .standards
        .moves
        .measured
        .iter()
        .map(measured)
        .chain(case.facts.standards.moves.missing.iter().map(missing))
        .collect()
}
