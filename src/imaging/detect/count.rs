//! How many squares a plain board has, by a picture that shows all of it.
//!
//! In: a picture. Out: the count, where all corners of a grid are there and the board is seen to end on all four sides,
//! or where at least the next line of corners would be in view. Goes wrong: a board that is cut, hidden or in glare
//! gives none, or too few of the second kind.

use super::extent;
use super::plain::{Way, grown, ladder, whole_squares};
use crate::imaging::Squares;
use crate::imaging::image::Picture;

/// The squares that a picture shows, and whether the board is seen to end behind them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    pub squares: Squares,
    /// True where a margin follows on all four sides; else more corners would be in view, and none is found.
    pub ends: bool,
}

/// The squares of the whole board that a picture shows.
pub fn squares_of(picture: &Picture) -> Option<Seen> {
    let mut most: Option<Seen> = None;
    for (level, _) in ladder(picture).into_iter().filter(|(_, way)| *way == Way::Grow) {
        let small = level.copy(picture);
        let Some(grid) = grown(&small, usize::MAX) else { continue };
        let Some(squares) = whole_squares(&grid) else { continue };
        if extent::ends_on_all_sides(&small, &grid) {
            return Some(Seen { squares, ends: true });
        }
        let is_more = most.is_none_or(|most| squares.columns * squares.rows > most.squares.columns * most.squares.rows);
        if is_more && extent::is_in_view(&small, &grid) {
            most = Some(Seen { squares, ends: false });
        }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::shot::{Shot, with_pixels};

    #[test]
    fn whole_boards_are_counted_and_others_are_not() {
        for (board, z) in [("checker:9x7:20", 560.0), ("checker:10x7:16", 560.0), ("checker:6x6:20", 420.0)] {
            for turn in [[0.3, -0.25, 0.2], [-0.2, 0.3, 1.7]] {
                let (picture, truth) = Shot::of(board, turn, [3.0, -2.0, z]).taken();
                let squares = board.split(':').nth(1).unwrap().parse().unwrap();
                assert_eq!(squares_of(&picture), Some(Seen { squares, ends: true }), "{board}");
                // From some column of corners on it is hidden.
                let (first, second) = (truth[0], truth[1]);
                for (columns, grey) in [(1.5, 90), (2.5, 200), (0.6, 30)] {
                    let hidden = with_pixels(&picture, |image, x, y| {
                        let at = nalgebra::Point2::new(x as f64, y as f64) - first;
                        let along = at.dot(&(second - first)) / (second - first).norm_squared();
                        if along < columns { grey } else { image.pixels[y * image.width + x] }
                    });
                    assert!(!squares_of(&hidden).is_some_and(|seen| seen.ends), "{board} {columns} {grey}");
                }
                // Cut by the border.
                let (cut, _) = Shot::of(board, turn, [-90.0, 40.0, z - 160.0]).taken();
                assert_eq!(squares_of(&cut), None, "{board}");
            }
        }
    }
}
