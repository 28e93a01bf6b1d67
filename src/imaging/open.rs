//! Corners whose numbers one picture leaves open: of a plain board that is cut or hidden, where it is not seen how many lines are missing on which
//! side.
//!
//! In: what pictures show. Out: pairs with all numberings that their corners may have. How the cameras stand, which other pairs tell, decides
//! between them later (`crate::stereo::pairs::open_numbers`); a pair for which that is not done counts as one without a board.

use super::corners::{Corner, OpenPair, Skipped};
use super::input::cache::Sighting;
use super::lattice::{Lattice, Renumbering};

/// A pair with what its pictures leave open, and why; `None` where they leave nothing open. `before`: how many such pairs were before it.
pub fn open_pair(pair: &str, sides: &[&Sighting; 2], before: usize) -> Option<(OpenPair, Skipped)> {
    let reason = |side: usize| sides[side].open.as_ref().map(|open| open.refusal.reason.clone());
    let reason = match [reason(0), reason(1)] {
        [None, None] => return None,
        [Some(left), None] => format!("left picture: {left}"),
        [None, Some(right)] => format!("right picture: {right}"),
        [Some(left), Some(right)] if left == right => format!("both pictures: {left}"),
        [Some(left), Some(right)] => format!("left picture: {left}; right picture: {right}"),
    };
    let open = OpenPair { pair: pair.to_owned(), sides: sides.map(numberings), before };
    Some((open, Skipped { pair: pair.to_owned(), reason }))
}

/// The corners of a picture in all ways of numbering them.
fn numberings(seen: &Sighting) -> Vec<Vec<Corner>> {
    let lattice = &seen.corners;
    let others = seen.open.iter().flat_map(|open| &open.others);
    let renumbered = |numbering: &Renumbering| {
        let corners = lattice.renumbered(numbering, (lattice.columns, lattice.rows))?;
        Some(listed(&corners, numbering.quarters))
    };
    std::iter::once(listed(lattice, 0)).chain(others.filter_map(renumbered)).collect()
}

/// The corners of a lattice that was turned, with their numbers in it.
pub fn listed(lattice: &Lattice<Corner>, quarters: usize) -> Vec<Corner> {
    let reach =
        |c: &Corner| c.reach.map(|[rows, columns]| if quarters % 2 == 1 { [columns, rows] } else { [rows, columns] });
    lattice.iter().map(|(col, row, c)| Corner { col, row, reach: reach(c), ..*c }).collect()
}
