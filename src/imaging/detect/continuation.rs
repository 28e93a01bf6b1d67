//! Where does a board end?
//!
//! A detector told to look for 9x6 squares may find them inside a board of 10x7. Where one square beyond the grid's
//! border a whole line of corners looks just like those inside, the board goes on, and which part of it was found is
//! chance: left and right would not show the same corners. But squares that were cut, with the paper or by it, are not
//! counted by whoever counts a board's squares: a line of corners beyond which there are only parts of squares, or
//! none, is no line of the board's if the board has none left for it.

use nalgebra::{Point2, Vector2};

use super::Detected;
use crate::imaging::Board;
use crate::imaging::image::Grey8;
use crate::imaging::lattice::Places;
use crate::statistics::median;

/// Share of a line beyond the border that must look like corners; the board's own outer edge shows none.
const SHARE: f64 = 0.75;
/// What of a square's contrast a corner beyond the border shows at least. An edge alone shows none, the end of an edge
/// a half.
const CONTRAST: f64 = 0.7;
/// What of the contrast of most corners one of the grid shows at least: a corner of one square shows none, one in half
/// a shadow a half.
const END_CONTRAST: f64 = 0.25;
/// Where the four squares of a corner are looked at, in steps along both edges; where squares are cut, nearer.
const IN_SQUARES: f64 = 0.4;
const NEARER: [f64; 3] = [IN_SQUARES, 0.25, 0.15];
/// Where a whole square still is, in steps from the corner, and what of the usual contrast it shows there.
const WHOLE: f64 = 0.85;
const WHOLE_CONTRAST: f64 = 0.5;
/// Of so many corners of a line one may seem to have a whole square beyond it by chance.
const BY_CHANCE: usize = 4;

/// How many columns and rows of corners the board has beyond those found; counts one line on each side at the most.
pub fn lines_beyond(detected: &Detected) -> (usize, usize) {
    let (grid, copy) = (&detected.corners, &detected.copy);
    // Each turn brings another side to the front.
    let [left, bottom, right, top] = [0, 1, 2, 3].map(|quarters| beyond(copy, &grid.turned(quarters)));
    let count = |a: End, b: End| match (a, b) {
        // Which of the two lines of cut squares is the board's cannot be told.
        (End::CutLine, End::CutSquares) | (End::CutSquares, End::CutLine) => 1,
        _ => usize::from(a == End::Line) + usize::from(b == End::Line),
    };
    (count(left, right), count(bottom, top))
}

/// What lies before the first column of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// Another line of corners, with whole squares before it.
    Line,
    /// Another line of corners, with parts of squares before it.
    CutLine,
    /// Parts of squares.
    CutSquares,
    /// Whole squares, or what is not in view.
    Squares,
}

fn beyond(copy: &Grey8, grid: &Places) -> End {
    let Some(usual) = usual(copy, grid) else { return End::Squares };
    let goes_on = |steps: f64| {
        let seen = (0..grid.rows).filter_map(|row| contrast(copy, grid, (-1, row), steps, None));
        seen.filter(|c| c / usual > CONTRAST).count() as f64 >= SHARE * grid.rows as f64
    };
    match is_cut(copy, grid, -1) {
        false if goes_on(IN_SQUARES) => End::Line,
        true if NEARER.into_iter().any(goes_on) => End::CutLine,
        _ if is_cut(copy, grid, 0) => End::CutSquares,
        _ => End::Squares,
    }
}

/// The grid without outer lines of which the board, which is smaller, can have none: only parts of squares lie beyond
/// them, or none. `None` where it is not known which lines those are, or where there are whole squares.
pub(super) fn without_cut_lines(copy: &Grey8, grid: &Places, board: Board) -> Option<Places> {
    let (columns, rows) = (board.columns(), board.rows());
    let ways = [(columns, rows), (rows, columns)];
    let mut fitting = ways.into_iter().take(if columns == rows { 1 } else { 2 }).filter_map(|(columns, rows)| {
        let (narrower, is_chosen) = without_cut_columns(copy, grid.clone(), columns)?;
        let (lower, is_chosen_too) = without_cut_columns(copy, narrower.quarter_turn(), rows)?;
        Some((lower, is_chosen || is_chosen_too))
    });
    let (first, is_chosen) = fitting.next()?;
    (fitting.next().is_none() && !is_chosen).then_some(first)
}

/// The grid with so many columns at the most, and whether one of two that are alike was left out.
fn without_cut_columns(copy: &Grey8, mut grid: Places, columns: usize) -> Option<(Places, bool)> {
    let filled = |grid: &Places| grid.rows_at_front().count();
    let mut is_chosen = false;
    while grid.columns > columns {
        let turned = grid.half_turn();
        let (first, last) = (is_cut(copy, &grid, 0), is_cut(copy, &turned, 0));
        if !first && !last {
            return None;
        }
        is_chosen |= first && last && grid.columns == columns + 1 && filled(&grid) == filled(&turned);
        let from_first = first && (!last || filled(&grid) <= filled(&turned));
        grid = if from_first { grid } else { turned }.without_front();
    }
    Some((grid, is_chosen))
}

/// True where before a column, the first or one further out, there are parts of squares at the most.
fn is_cut(copy: &Grey8, grid: &Places, column: isize) -> bool {
    let Some(usual) = usual(copy, grid) else { return false };
    let before = |row: usize| contrast(copy, grid, (column, row), IN_SQUARES, Some(WHOLE));
    let known: Vec<f64> = (0..grid.rows).filter_map(before).collect();
    let whole = known.iter().filter(|c| **c / usual > WHOLE_CONTRAST).count();
    !known.is_empty() && whole * BY_CHANCE <= known.len()
}

/// Whether a corner of the grid has four squares of the contrast that most have, in their order of colours.
pub(super) fn is_crossing(copy: &Grey8, grid: &Places, (col, row): (usize, usize)) -> bool {
    let here = contrast(copy, grid, (col as isize, row), IN_SQUARES, None);
    usual(copy, grid).zip(here).is_some_and(|(usual, here)| here / usual > CONTRAST)
}

/// Contrast of most corners, with the sign that the order of colours gives it.
fn usual(copy: &Grey8, grid: &Places) -> Option<f64> {
    median(grid.iter().filter_map(|(col, row, _)| contrast(copy, grid, (col as isize, row), IN_SQUARES, None)))
}

/// The grid without what is no crossing of four squares: at a board's end the outer corners of its dark squares on a
/// light margin.
pub(super) fn without_ends(copy: &Grey8, grid: Places) -> Places {
    let at = |col: usize, row: usize, steps: f64| contrast(copy, &grid, (col as isize, row), steps, None);
    let mut seen: Vec<f64> = grid.iter().filter_map(|(col, row, _)| at(col, row, IN_SQUARES)).map(f64::abs).collect();
    seen.sort_by(f64::total_cmp);
    // On a board of nine corners those at its end may be nearly as many.
    let Some(usual) = seen.get(3 * seen.len() / 4).copied() else { return grid };
    grid.filter_map(|col, row, place| {
        let mut seen = NEARER.into_iter().filter_map(|steps| at(col, row, steps)).peekable();
        let crosses = seen.peek().is_none() || seen.any(|c| c.abs() > END_CONTRAST * usual);
        crosses.then_some(*place)
    })
}

/// Contrast of the four squares round a corner of the grid, or round a place one square before its first column, so
/// many steps along both edges from it, with the sign that the order of colours gives it: the lesser of both
/// differences between neighbours across an edge and their neighbours across the other, and none where they have two
/// signs, as across the board's outer edge. `before`: how many steps against the columns' order. `None` outside of the
/// picture.
fn contrast(copy: &Grey8, grid: &Places, (col, row): (isize, usize), steps: f64, before: Option<f64>) -> Option<f64> {
    let row = row as isize;
    let (place, along, across) = local(grid, col, row)?;
    let before = before.unwrap_or(steps);
    let at = |a: f64, b: f64| {
        copy.mean_at(place + along * if a < 0.0 { a * before } else { a * steps } + across * b * steps)
    };
    let (pp, pm, mp, mm) = (at(1.0, 1.0)?, at(1.0, -1.0)?, at(-1.0, 1.0)?, at(-1.0, -1.0)?);
    let sign = if (col + row).rem_euclid(2) == 0 { 1.0 } else { -1.0 };
    let differences = [pp - pm, pp - mp, mm - pm, mm - mp].map(|d| sign * d);
    let mean = differences.iter().sum::<f64>() / 4.0;
    let least = differences.into_iter().fold(f64::MAX, f64::min);
    let most = differences.into_iter().fold(f64::MIN, f64::max);
    Some(if mean > 0.0 { least.max(0.0) } else { most.min(0.0) })
}

/// A corner of the grid or a place one square before its first column, and the steps to the next column and the next
/// row there.
fn local(grid: &Places, col: isize, row: isize) -> Option<(Point2<f64>, Vector2<f64>, Vector2<f64>)> {
    let place = if col < 0 { grid.next((0, row), (-1, 0))?.0 } else { *grid.around(col, row)? };
    let col = col.max(0);
    let step = |dc: isize, dr: isize| {
        let here = grid.around(col, row)?;
        let next = grid.around(col + dc, row + dr).map(|p| p - here);
        next.or_else(|| grid.around(col - dc, row - dr).map(|p| here - p))
    };
    Some((place, step(1, 0)?, step(0, 1)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::image::pyramid::Level;
    use crate::imaging::lattice::Lattice;

    /// A board of 7x6 squares of 12 px in a light margin, of which the inner corners in the given ranges were found.
    fn found(cols: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Detected {
        let copy = Grey8::from_fn(108, 96, |x, y| {
            let (i, j) = (x as isize / 12 - 1, y as isize / 12 - 1);
            let black = (0..7).contains(&i) && (0..6).contains(&j) && (i + j) % 2 == 0;
            if black { 40 } else { 200 }
        });
        let corners = Lattice::from_fn(cols.len(), rows.len(), |col, row| {
            let (x, y) = ((cols.start + col + 2) * 12, (rows.start + row + 2) * 12);
            Some(Point2::new(x as f64 - 0.5, y as f64 - 0.5))
        });
        Detected::plain(corners, copy, Level::Reduced(1))
    }

    #[test]
    fn a_whole_board_ends_where_its_corners_end_and_a_part_goes_on_where_it_was_cut() {
        assert_eq!(lines_beyond(&found(0..6, 0..5)), (0, 0));
        assert_eq!(lines_beyond(&found(0..5, 0..5)), (1, 0));
        assert_eq!(lines_beyond(&found(1..5, 0..5)), (2, 0));
        assert_eq!(lines_beyond(&found(1..6, 1..4)), (1, 2));
    }

    #[test]
    fn corners_of_single_squares_are_no_crossings() {
        let Detected { corners, copy, .. } = found(0..8, 0..7);
        // The same board with the outline of its squares taken for corners, too.
        let outline = Lattice::from_fn(8, 7, |c, r| corners.get(c, r).map(|p| Point2::new(p.x - 12.0, p.y - 12.0)));
        let kept = without_ends(&copy, outline);
        let inner = |col: usize, row: usize| (1..7).contains(&col) && (1..6).contains(&row);
        assert!(kept.iter().all(|(col, row, _)| inner(col, row)));
        assert_eq!(kept.count(), 30);
    }

    /// What is left of a board of 9x8 squares of 12 px before a dark wall where its outer squares are cut to a share,
    /// with its whole grid of corners.
    fn cut(share: f64) -> (Grey8, Places) {
        let (left, right) = (24.0 - 12.0 * share, 24.0 + 7.0 * 12.0 + 12.0 * share);
        let bottom = 24.0 + 6.0 * 12.0 + 12.0 * share;
        let copy = Grey8::from_fn(144, 132, |x, y| {
            let inside = |v: usize, to: f64| v as f64 >= left && (v as f64) < to;
            let grey = if (x / 12 + y / 12).is_multiple_of(2) { 40 } else { 200 };
            if inside(x, right) && inside(y, bottom) { grey } else { 70 }
        });
        let place = |v: usize| (24 + 12 * v) as f64 - 0.5;
        (copy, Lattice::from_fn(8, 7, |col, row| Some(Point2::new(place(col), place(row)))))
    }

    #[test]
    fn lines_of_cut_squares_are_left_out_where_the_board_has_none_for_them() {
        let board = |squares: &str| Board::checker(squares.parse().unwrap(), 1.0);
        for share in [0.3, 0.5, 0.7] {
            let (copy, grid) = cut(share);
            let kept = without_cut_lines(&copy, &grid, board("7x6")).unwrap();
            assert_eq!((kept.columns.max(kept.rows), kept.columns.min(kept.rows), kept.count()), (6, 5, 30), "{share}");
            assert!(kept.iter().all(|(_, _, p)| (30.0..110.0).contains(&p.x) && (30.0..100.0).contains(&p.y)));
            // Which of two lines that are alike is not the board's cannot be told; and there are no more of them.
            assert_eq!(without_cut_lines(&copy, &grid, board("8x7")), None);
            assert_eq!(without_cut_lines(&copy, &grid, board("6x5")), None);
            let detected = |corners: Places| Detected::plain(corners, copy.clone(), Level::Reduced(1));
            let inner = Lattice::from_fn(6, 5, |col, row| grid.get(col + 1, row + 1).copied());
            assert_eq!(lines_beyond(&detected(inner)), (0, 0));
            let part = Lattice::from_fn(7, 7, |col, row| grid.get(col, row).copied());
            assert_eq!(lines_beyond(&detected(part)), (1, 0));
            assert_eq!(lines_beyond(&detected(grid)), (0, 0));
        }
    }

    #[test]
    fn the_edge_of_the_margin_is_no_line_of_corners() {
        // Squares cut to a half, a light margin, and a dark wall whose edge lies where the next line of corners would
        // be, or near it.
        for margin in [0.2, 0.35, 0.45, 0.5, 0.55, 0.7, 1.0] {
            let (board, grid) = cut(0.5);
            let copy = Grey8::from_fn(board.width, board.height, |x, y| {
                let outside = |v: usize, to: f64| (18.0 - v as f64).max(v as f64 - to);
                let beyond = outside(x, 113.0).max(outside(y, 101.0)) / 12.0;
                let wall = if beyond < margin { 200 } else { 40 };
                if beyond > 0.0 { wall } else { board.pixels[y * board.width + x] }
            });
            assert_eq!(lines_beyond(&Detected::plain(grid, copy, Level::Reduced(1))), (0, 0), "{margin}");
        }
    }

    #[test]
    fn lines_of_whole_squares_are_the_boards() {
        let (copy, grid) = cut(1.0);
        for squares in ["7x6", "8x7", "8x8", "9x7"] {
            let board = Board::checker(squares.parse().unwrap(), 1.0);
            assert_eq!(without_cut_lines(&copy, &grid, board), None, "{squares}");
        }
    }

    #[test]
    fn a_line_with_one_corner_that_is_none_is_left_out() {
        // A few chance corners beyond the board's last squares, as a clip makes them.
        let Detected { corners, copy, .. } = found(0..6, 0..5);
        let grid = Lattice::from_fn(7, 5, |col, row| match corners.get(col, row) {
            Some(p) => Some(*p),
            None => Some(Point2::new(95.5, 23.5 + 12.0 * row as f64)).filter(|_| row < 3),
        });
        let board = Board::checker("7x6".parse().unwrap(), 1.0);
        assert_eq!(without_cut_lines(&copy, &grid, board).map(|grid| grid.count()), Some(30));
    }

    #[test]
    fn nothing_is_known_beyond_the_picture() {
        let mut detected = found(0..5, 0..5);
        detected.copy.width = 0;
        assert_eq!(lines_beyond(&detected), (0, 0));
    }
}
