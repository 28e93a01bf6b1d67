//! What all pictures together show of how a board with markers is made, for a person.
//!
//! In: what was seen in each picture. Out: its layout and colours, and the sides of it that no picture shows.

use std::collections::BTreeSet;

use super::board::{Kind, Layout, Print};
use super::input::cache::Look;
use super::{Board, Corner, PairCorners};

/// How most pictures show the board's markers, for a person.
pub fn printed(board: &Board, seen: &[[Look; 2]]) -> Option<String> {
    let prints: Vec<Print> = seen.iter().flatten().filter_map(|look| look.as_ref().ok()?.print).collect();
    let most = |is: &dyn Fn(&Print) -> bool| 2 * prints.iter().filter(|print| is(print)).count() > prints.len();
    let layout = match board.layouts().len() {
        2 if most(&|print| print.layout == Layout::Old) => Some(Layout::Old.said()),
        2 => Some(Layout::New.said()),
        _ if board.may_be_grid() && most(&|print| print.layout == Layout::Grid) => Some(Layout::Grid.said()),
        _ => None,
    };
    let inverted = most(&|print| print.inverted).then_some("printed white on black");
    let said: Vec<&str> = layout.into_iter().chain(inverted).collect();
    (!prints.is_empty() && !said.is_empty()).then(|| format!("the board's markers: {}", said.join(", ")))
}

/// The sides of a board with markers whose outermost squares or tags no picture shows: the board may have fewer than
/// its name says, and then its middle is elsewhere. Markers count from one side, so that those that are there do not
/// tell.
pub fn unseen_lines(board: &Board, pairs: &[PairCorners]) -> Option<String> {
    if !board.is_coded() {
        return None;
    }
    let seen = || pairs.iter().flat_map(|pair| pair.left.iter().chain(&pair.right));
    let ends = |of: &dyn Fn(&Corner) -> usize, count: usize| {
        let (first, last) = (seen().map(of).min()?, seen().map(of).max()?);
        Some([first, count - 1 - last])
    };
    let lines = |corners: usize| match board.kind {
        Kind::Tags { .. } => corners.div_ceil(2),
        _ => corners,
    };
    let [left, right] = ends(&|corner| corner.col, board.columns())?.map(lines);
    let [above, below] = ends(&|corner| corner.row, board.rows())?.map(lines);
    let [columns, rows] = match board.kind {
        Kind::Tags { .. } => board.tags(),
        _ => [board.squares.columns, board.squares.rows],
    };
    let sides = [(left, "left column"), (right, "right column"), (above, "upper row"), (below, "lower row")];
    let unseen: Vec<String> = sides
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, side)| match count {
            1 => format!("the {side}"),
            _ => format!("the {count} {side}s"),
        })
        .collect();
    (!unseen.is_empty()).then(|| {
        format!(
            "no picture shows all of the board's {columns}x{rows}: {} of it never. If it has {}x{}, say so with --board: the board's \
             middle depends on it",
            unseen.join(" and "),
            columns - left - right,
            rows - above - below
        )
    })
}

/// The tags of a grid of separate ones that no picture shows where it shows those beside them: others are in their
/// place, or something hides them.
pub fn missing_tags(board: &Board, pairs: &[PairCorners]) -> Option<String> {
    /// Pictures of those beside them that tell it, and so many beside them.
    const FEWEST: usize = 3;
    const BESIDE: usize = 2;
    let [columns, rows] = board.tags().map(|tags| tags as isize);
    if !board.is_grid() {
        return None;
    }
    let pictures: Vec<BTreeSet<(isize, isize)>> = pairs
        .iter()
        .flat_map(|pair| [&pair.left, &pair.right])
        .map(|corners| corners.iter().map(|corner| ((corner.col / 2) as isize, (corner.row / 2) as isize)).collect())
        .collect();
    let is_missing = |&(x, y): &(isize, isize)| {
        let beside = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
        let is_round = |seen: &&BTreeSet<_>| beside.iter().filter(|tag| seen.contains(*tag)).count() >= BESIDE;
        pictures.iter().filter(is_round).count() >= FEWEST && pictures.iter().all(|seen| !seen.contains(&(x, y)))
    };
    let all = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    let missing: Vec<String> = all.filter(is_missing).map(|(x, y)| (y * columns + x).to_string()).collect();
    (!missing.is_empty()).then(|| {
        format!(
            "no picture shows these tags of the board in their place, but those beside them: {}. Others are there, or something hides them",
            missing.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point2;

    /// A pair whose left picture shows these columns and rows of corners.
    fn pair(cols: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> PairCorners {
        let corner = |col, row| Corner::at(col, row, Point2::origin());
        let left = rows.flat_map(|row| cols.clone().map(move |col| corner(col, row))).collect();
        PairCorners { left, ..PairCorners::default() }
    }

    #[test]
    fn a_tag_that_is_never_in_its_place_is_named() {
        let grid: Board = "apriltag:3x2:tag36h11:24:7.2:opencv".parse().unwrap();
        let without = |tag: (usize, usize)| {
            let mut pair = pair(0..6, 0..4);
            pair.left.retain(|corner| (corner.col / 2, corner.row / 2) != tag);
            PairCorners { right: pair.left.clone(), ..pair }
        };
        let said = missing_tags(&grid, &[without((1, 1)), without((1, 1))]).unwrap();
        assert!(said.contains("beside them: 4."), "{said}");
        // Hidden in some pictures only, and a grid of Kalibr's, which is judged otherwise.
        assert_eq!(missing_tags(&grid, &[without((1, 1)), without((0, 1))]), None);
        let kalibr: Board = "apriltag:3x2:tag36h11:24:7.2".parse().unwrap();
        assert_eq!(missing_tags(&kalibr, &[without((1, 1)), without((1, 1))]), None);
    }

    #[test]
    fn sides_that_no_picture_shows_are_said() {
        let tags: Board = "apriltag:6x7:tag36h11:24:7.2".parse().unwrap();
        let said = unseen_lines(&tags, &[pair(0..12, 2..9), pair(4..10, 3..14)]).unwrap();
        assert!(said.contains("7: the upper row of it never") && said.contains("If it has 6x6"), "{said}");
        let charuco: Board = "charuco:8x6:20:14:DICT_4X4_50".parse().unwrap();
        let said = unseen_lines(&charuco, &[pair(0..5, 0..3), pair(1..6, 1..4)]).unwrap();
        assert!(
            said.contains("the right column and the lower row of it never") && said.contains("If it has 7x5"),
            "{said}"
        );
        // Every side in some picture, none of which shows the board whole.
        assert_eq!(unseen_lines(&charuco, &[pair(0..5, 0..3), pair(2..7, 2..5)]), None);
        assert_eq!(unseen_lines(&"checker:8x6:20".parse().unwrap(), &[pair(0..2, 0..2)]), None);
    }
}
