//! What was found in a folder's pictures, sorted by pairs: those of use, those that are not and why, those whose
//! numbers stay open.
//!
//! In: what each picture shows. Out: pairs whose corners are numbered alike in left and right. Numbers stay open of a
//! plain board that is cut or hidden, where it is not seen how many lines are missing on which side: such a pair comes
//! with all numberings that its corners may have. How the cameras stand, which other pairs tell, decides between them
//! later (`crate::stereo::pairs::open_numbers`); a pair for which that is not done counts as one without a board.

use super::board::{Board, Layout, Squares};
use super::coded::measures;
use super::corners::{OpenPair, PairCorners, Skipped};
use super::detect::Refusal;
use super::input::cache::{Look, Sighting};
use super::input::pairs::PairFiles;
use super::lattice::{Lattice, Renumbering};
use super::{Corner, Side, order};
use crate::statistics::median;

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
    // Where the markers of one picture are of a small dictionary and those of another of a larger one that begins with
    // it, it is the larger. A picture that shows a part of a board with markers tells the columns, and rows no farther
    // than it goes.
    let is_part = |board: &Board, part: &Board| {
        let cut = Board { squares: Squares { rows: part.squares.rows, ..board.squares }, ..*board };
        board.is_coded() && cut.has_all_of(part)
    };
    let is_of = |board: &Board, other: &Board| board.has_all_of(other) || is_part(board, other);
    let shown = |board: &Board| boards.iter().filter(|other| is_of(board, other)).count();
    let board = boards.iter().max_by_key(|board| (shown(board), board.squares.rows))?;
    (2 * shown(board) > refused.len()).then_some(*board)
}

/// Refusals for another size of the markers or gaps with the size that all of these pictures show together: each
/// measures it a little differently.
pub fn with_common_sizes(mut seen: Vec<[Look; 2]>, board: &Board) -> Vec<[Look; 2]> {
    let size_mm = |look: &Look| measures::other_size_mm(board, &look.as_ref().err()?.seen?);
    let Some(middle_mm) = median(seen.iter().flatten().filter_map(size_mm)) else { return seen };
    for look in seen.iter_mut().flatten() {
        if let Some(mm) = size_mm(look).and_then(|mm| measures::common_mm(board, mm, middle_mm)) {
            *look = Err(measures::refusal(board, mm));
        }
    }
    seen
}

/// A grid of tags as most of its pictures show it, where nobody said whose it is, without those that show it otherwise.
pub fn in_one_layout(board: Board, mut seen: Vec<[Look; 2]>) -> (Board, Vec<[Look; 2]>) {
    let layout = |look: &Look| look.as_ref().ok()?.print.map(|print| print.layout);
    let layouts: Vec<Layout> = seen.iter().flatten().filter_map(layout).collect();
    let separate = layouts.iter().filter(|layout| **layout == Layout::Grid).count();
    if !board.may_be_grid() || separate == 0 {
        return (board, seen);
    }
    let most = if 2 * separate > layouts.len() { Layout::Grid } else { Layout::Tags };
    for look in seen.iter_mut().flatten() {
        if let Some(other) = layout(look).filter(|other| *other != most) {
            let reason = format!("shows the tags in {}; most other pictures have another", other.said());
            *look = Err(reason.into());
        }
    }
    (if most == Layout::Grid { board.with_layout(most) } else { board }, seen)
}

/// The board that some pictures show instead of the one that is looked for: three of four show it, none this one or a
/// third.
pub fn shown_instead<'a>(seen: impl Iterator<Item = &'a [Look; 2]>) -> Option<Board> {
    let (mut pictures, mut others) = (0, Vec::new());
    for look in seen.flatten() {
        pictures += 1;
        others.extend(look.as_ref().err()?.seen);
    }
    let first = *others.first()?;
    (4 * others.len() >= 3 * pictures && others.iter().all(|other| *other == first)).then_some(first)
}

/// Pairs by what they show.
pub struct Sorted {
    /// Those with the board in both pictures.
    pub found: Vec<Found>,
    /// The others, with the reason.
    pub skipped: Vec<Skipped>,
    /// The pictures without the board of pairs that are found by the other picture, with the reason.
    pub blind: Vec<(Side, Skipped)>,
    /// Those of the skipped ones whose corners could be numbered in several ways.
    pub open: Vec<OpenPair>,
}

/// What was found in both pictures of a pair, or of a board with markers in one of them.
pub fn sort_out(files: &[PairFiles], seen: Vec<[Look; 2]>, board: Board) -> Sorted {
    let nothing = || Lattice::from_fn(board.columns(), board.rows(), |_, _| None);
    let (mut found, mut skipped, mut blind, mut open) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for (files, looks) in files.iter().zip(seen) {
        let pair = files.pair.clone();
        // Markers number the corners of one picture by itself.
        let is_enough = board.is_coded() && looks.iter().any(Result::is_ok);
        let refused = looks.each_ref().map(|look| look.as_ref().err().map(|refusal| refusal.reason.clone()));
        if !is_enough && let Some(reason) = of_sides(&refused) {
            skipped.push(Skipped { pair, reason });
            continue;
        }
        let of_one =
            |(side, reason): (Side, Option<String>)| Some((side, Skipped { pair: pair.clone(), reason: reason? }));
        blind.extend(Side::BOTH.into_iter().zip(refused).filter_map(of_one));
        let sides = looks.map(|look| look.unwrap_or_else(|_| Sighting { corners: nothing(), print: None, open: None }));
        let left_open = sides.each_ref().map(|side| side.open.as_ref().map(|open| open.refusal.reason.clone()));
        if let Some(reason) = of_sides(&left_open) {
            skipped.push(Skipped { pair: pair.clone(), reason });
            open.push(OpenPair { pair, sides: sides.each_ref().map(numberings), before: found.len() });
        } else {
            let [left, right] = sides.map(|side| side.corners);
            found.push((pair, left, right));
        }
    }
    Sorted { found, skipped, blind, open }
}

/// What is said of the left picture of a pair and of the right one; `None` where nothing is of either.
fn of_sides(said: &[Option<String>; 2]) -> Option<String> {
    match said {
        [None, None] => None,
        [Some(left), None] => Some(format!("left picture: {left}")),
        [None, Some(right)] => Some(format!("right picture: {right}")),
        [Some(left), Some(right)] if left == right => Some(format!("both pictures: {left}")),
        [Some(left), Some(right)] => Some(format!("left picture: {left}; right picture: {right}")),
    }
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
fn listed(lattice: &Lattice<Corner>, quarters: usize) -> Vec<Corner> {
    let reach =
        |c: &Corner| c.reach.map(|[rows, columns]| if quarters % 2 == 1 { [columns, rows] } else { [rows, columns] });
    lattice.iter().map(|(col, row, c)| Corner { col, row, reach: reach(c), ..*c }).collect()
}

/// The corners of pairs, numbered alike in left and right.
pub fn number_alike(found: Vec<Found>, board: Board) -> Vec<PairCorners> {
    let pairs: Vec<_> = found.iter().map(|(_, left, right)| (left.map(|c| c.px), right.map(|c| c.px))).collect();
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
    fn parts_of_one_board_with_markers_are_of_the_tallest() {
        let look = |rows: usize| {
            let seen = format!("charuco:11x{rows}:15:11:DICT_5X5_100").parse().ok();
            Look::Err(Refusal { reason: "another".to_owned(), seen })
        };
        let seen = [[look(6), look(8)], [look(7), look(8)]];
        assert_eq!(other_board(&seen), "charuco:11x8:15:11:DICT_5X5_100".parse().ok());
    }

    #[test]
    fn what_one_picture_of_a_pair_lacks_is_kept_with_the_reason() {
        let files = PairFiles { pair: "03".to_owned(), left: "l/03.png".into(), right: "r/03.png".into() };
        let sorted = |name: &str| {
            let board: Board = name.parse().unwrap();
            let corner = |col, row| Some(Corner::at(col, row, nalgebra::Point2::new(col as f64, row as f64)));
            let corners = Lattice::from_fn(board.columns(), board.rows(), corner);
            let found = Ok(Sighting { corners, print: None, open: None });
            let refused = Err("shows the board mirrored".to_owned().into());
            sort_out(std::slice::from_ref(&files), vec![[found, refused]], board)
        };
        let coded = sorted("charuco:5x4:20:14:DICT_4X4_50");
        assert_eq!((coded.found.len(), coded.skipped.len()), (1, 0));
        let why = Skipped { pair: "03".to_owned(), reason: "shows the board mirrored".to_owned() };
        assert_eq!(coded.blind, [(Side::Right, why)]);
        // Of a plain board both pictures are needed: the pair is none.
        let plain = sorted("checker:5x4:20");
        assert_eq!((plain.found.len(), plain.skipped.len(), plain.blind.len()), (0, 1, 0));
    }

    #[test]
    fn pictures_that_measure_one_size_a_little_differently_name_one_board() {
        let asked: Board = "apriltag:6x6:tag36h11:50:10".parse().unwrap();
        let gap = |mm: f64| Look::Err(measures::refusal(&asked, mm));
        let none = || Look::Err("no board found".to_owned().into());
        let seen = vec![[gap(15.01), gap(15.11)], [gap(15.03), none()], [gap(18.2), gap(15.02)]];
        let seen = with_common_sizes(seen, &asked);
        let common = Refusal {
            reason: "shows gaps of about 15 mm between tags of 50 mm; --board says 10 mm".to_owned(),
            seen: "apriltag:6x6:tag36h11:50:15".parse().ok(),
        };
        let is_common = |look: &Look| look.as_ref().is_err_and(|refusal| *refusal == common);
        assert_eq!(seen.iter().flatten().map(is_common).collect::<Vec<_>>(), [true, true, true, false, false, true]);
        assert_eq!(other_board(&seen), common.seen);
        // Two boards in half of the pictures each: neither is the folder's.
        let two = with_common_sizes(vec![[gap(15.0), gap(12.0)], [gap(15.02), gap(12.01)]], &asked);
        assert_eq!(other_board(&two), None);
    }

    #[test]
    fn another_board_is_the_folders_only_where_most_pictures_show_it_and_none_a_third() {
        let of = |seen: Option<&str>| -> Look {
            let seen = seen.map(|name| name.parse().unwrap());
            Err(Refusal { reason: "another".to_owned(), seen })
        };
        let small = Some("checker:10x7:25");
        let pair = |left, right| [of(left), of(right)];
        let agreed = [pair(small, small), pair(small, small)];
        assert_eq!(shown_instead(agreed.iter()), Some("checker:10x7:25".parse().unwrap()));
        let differ = [pair(small, small), pair(small, Some("checker:9x7:25"))];
        assert_eq!(shown_instead(differ.iter()), None);
        let one_unseen = [pair(small, small), pair(None, small)];
        assert_eq!(shown_instead(one_unseen.iter()), small.map(|name| name.parse().unwrap()));
        let half_unseen = [pair(small, None), pair(None, small)];
        assert_eq!(shown_instead(half_unseen.iter()), None);
        assert_eq!(shown_instead([].iter()), None);
    }
}
