//! What was found in a folder's pictures, sorted by pairs: those of use, those that are not and why, those whose numbers stay open.
//!
//! In: what each picture shows. Out: pairs whose corners are numbered alike in left and right.

use super::board::Board;
use super::corners::{OpenPair, PairCorners, Skipped};
use super::detect::Refusal;
use super::input::cache::Look;
use super::input::pairs::PairFiles;
use super::lattice::{Lattice, Places};
use super::open::{listed, open_pair};
use super::{Corner, order};

/// A pair's name and the corners of its left and right picture.
pub type Found = (String, Lattice<Corner>, Lattice<Corner>);

/// The board that most of the refused pictures show instead.
pub fn other_board(seen: &[[Look; 2]]) -> Option<Board> {
    let refusal = |look: &'_ Look| match look {
        Ok(seen) => seen.open.as_ref().map(|open| open.refusal.clone()),
        Err(refusal) => Some(refusal.clone()),
    };
    let refused: Vec<Refusal> = seen.iter().flatten().filter_map(refusal).collect();
    let boards: Vec<Board> = refused.iter().filter_map(|refusal| refusal.seen).collect();
    // Where the markers of one picture are of a small dictionary and those of another of a larger one that begins with it, it is the larger.
    let shown = |board: &Board| boards.iter().filter(|other| board.has_all_of(other)).count();
    let board = boards.iter().max_by_key(|board| shown(board))?;
    (2 * shown(board) > refused.len()).then_some(*board)
}

/// The board that each of some pictures shows instead of the one that is looked for.
pub fn shown_by_all<'a>(seen: impl Iterator<Item = &'a [Look; 2]>) -> Option<Board> {
    let mut others = seen.flatten().map(|look| look.as_ref().err().and_then(|refusal| refusal.seen));
    let first = others.next()??;
    others.all(|other| other == Some(first)).then_some(first)
}

/// Pairs by what they show.
pub struct Sorted {
    /// Those with the board in both pictures.
    pub found: Vec<Found>,
    /// The others, with the reason.
    pub skipped: Vec<Skipped>,
    /// Those of the skipped ones whose corners could be numbered in several ways.
    pub open: Vec<OpenPair>,
}

/// What was found in both pictures of a pair, or of a board with markers in one of them.
pub fn sort_out(files: &[PairFiles], seen: Vec<[Look; 2]>, board: Board) -> Sorted {
    let nothing = || Lattice::from_fn(board.columns(), board.rows(), |_, _| None);
    let (mut found, mut skipped, mut open) = (Vec::new(), Vec::new(), Vec::new());
    for (files, sides) in files.iter().zip(seen) {
        let pair = files.pair.clone();
        let reason = match sides.map(|look| look.map_err(|refusal| refusal.reason)) {
            [Ok(left), Ok(right)] => {
                match open_pair(&pair, &[&left, &right], found.len()) {
                    None => found.push((pair, left.corners, right.corners)),
                    Some((pair, reason)) => {
                        open.push(pair);
                        skipped.push(reason);
                    }
                }
                continue;
            }
            [Ok(left), Err(_)] if board.is_coded() => {
                found.push((pair, left.corners, nothing()));
                continue;
            }
            [Err(_), Ok(right)] if board.is_coded() => {
                found.push((pair, nothing(), right.corners));
                continue;
            }
            [Err(left), Err(right)] if left == right => format!("both pictures: {left}"),
            [Err(left), Err(right)] => format!("left picture: {left}; right picture: {right}"),
            [Err(left), Ok(_)] => format!("left picture: {left}"),
            [Ok(_), Err(right)] => format!("right picture: {right}"),
        };
        skipped.push(Skipped { pair, reason });
    }
    Sorted { found, skipped, open }
}

/// The corners of pairs, numbered alike in left and right.
pub fn number_alike(found: Vec<Found>, board: Board) -> Vec<PairCorners> {
    let places = |grid: &Lattice<Corner>| -> Places { grid.map(|c| c.px) };
    let pairs: Vec<_> = found.iter().map(|(_, left, right)| (places(left), places(right))).collect();
    let turns = order::agreed_turns(&pairs, board);
    found
        .into_iter()
        .zip(turns)
        .map(|((pair, left, right), (turn_left, turn_right))| PairCorners {
            pair,
            left: listed(&left.turned(turn_left), turn_left),
            right: listed(&right.turned(turn_right), turn_right),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_board_is_the_folders_only_where_every_picture_shows_it() {
        let of = |seen: Option<&str>| -> Look {
            let seen = seen.map(|name| name.parse().unwrap());
            Err(Refusal { reason: "another".to_owned(), seen })
        };
        let small = Some("checker:10x7:25");
        let pair = |left, right| [of(left), of(right)];
        let agreed = [pair(small, small), pair(small, small)];
        assert_eq!(shown_by_all(agreed.iter()), Some("checker:10x7:25".parse().unwrap()));
        let differ = [pair(small, small), pair(small, Some("checker:9x7:25"))];
        assert_eq!(shown_by_all(differ.iter()), None);
        let unseen = [pair(small, small), pair(None, small)];
        assert_eq!(shown_by_all(unseen.iter()), None);
        assert_eq!(shown_by_all([].iter()), None);
    }
}
