//! How many squares a plain board has, by a picture that shows all of it.
//!
//! In: a picture. Out: the count, where all corners of a grid are there and the board is seen to end on all four sides. Goes wrong: a board that is
//! cut, hidden, without a margin, or in glare gives none.

use super::extent;
use super::plain::{Attempt, Way, grown, ladder};
use crate::imaging::Squares;
use crate::imaging::image::Picture;

/// The squares of the whole board that a picture shows.
pub fn squares_of(picture: &Picture) -> Option<Squares> {
    let levels = ladder(picture).into_iter().filter_map(|Attempt { level, way }| (way == Way::Grow).then_some(level));
    levels.into_iter().find_map(|level| {
        let small = level.copy(picture);
        let grid = grown(&small, usize::MAX)?;
        let is_whole = grid.count() == grid.columns * grid.rows && extent::ends_on_all_sides(&small, &grid);
        let (columns, rows) = (grid.columns.max(grid.rows) + 1, grid.columns.min(grid.rows) + 1);
        is_whole.then_some(Squares { columns, rows })
    })
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
                assert_eq!(squares_of(&picture), Some(squares), "{board}");
                // From some column of corners on it is hidden.
                let (first, second) = (truth[0], truth[1]);
                for (columns, grey) in [(1.5, 90), (2.5, 200), (0.6, 30)] {
                    let hidden = with_pixels(&picture, |image, x, y| {
                        let at = nalgebra::Point2::new(x as f64, y as f64) - first;
                        let along = at.dot(&(second - first)) / (second - first).norm_squared();
                        if along < columns { grey } else { image.pixels[y * image.width + x] }
                    });
                    assert_eq!(squares_of(&hidden), None, "{board} {columns} {grey}");
                }
                // Cut by the border.
                let (cut, _) = Shot::of(board, turn, [-90.0, 40.0, z - 160.0]).taken();
                assert_eq!(squares_of(&cut), None, "{board}");
            }
        }
    }
}
