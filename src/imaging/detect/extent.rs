//! Boards that reach beyond the picture's border.
//!
//! In: a grid of corners and the board. Out: the grid with the board's size, the lines that are out of view empty; `None` where it
//! is not known where the missing lines are. Method: outer lines with few corners are chance, unless the others are out of view.
//! Missing lines lie on the side where the next line of corners would be out of view, if the
//! board is seen to end on the other side: a line of squares, then the margin. Something that hides part of the board looks otherwise.

use nalgebra::{Point2, Vector2};

use crate::imaging::Board;
use crate::imaging::image::Grey8;
use crate::imaging::lattice::{Lattice, Places};

/// A corner nearer to the picture's border is not seen, px of the copy: the ring that is looked at has a radius of 5.
const CLOSE_PX: f64 = 8.0;
/// Where the margin is looked at, steps beyond the last corners.
const IN_MARGIN: f64 = 1.3;
/// How far the margin's grey may be from that of the squares of its colour, as a share of their contrast.
const UNEVEN: f64 = 0.35;
/// Share of the margin in view that must look as it should.
const MOST: f64 = 0.8;
/// Share of the margin that must be in view.
const LEAST_MARGIN: f64 = 0.3;
/// A line with fewer of its corners is a chance find beside the board.
const FEW: f64 = 0.5;

/// On a line of at least so many corners one may be lost next to the border.
const LONG: usize = 6;

/// How a grid ends on one side.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    /// More corners could only be out of view.
    OutOfView,
    /// Where the board ends.
    Board,
    /// Where something hides it, or for another reason.
    Unknown,
}

/// The grid as the whole board's. Columns stay columns.
pub fn completed(small: &Grey8, grid: &Places, board: Board) -> Option<Places> {
    let columns = board.columns().checked_sub(grid.columns)?;
    let rows = board.rows().checked_sub(grid.rows)?;
    let turned = grid.quarter_turn();
    let left = missing_before(columns, || [end(small, grid), end(small, &grid.half_turn())])?;
    // A quarter turn brings the last row to the left.
    let top = missing_before(rows, || [end(small, &turned.half_turn()), end(small, &turned)])?;
    Some(Lattice::from_fn(board.columns(), board.rows(), |col, row| {
        grid.get(col.checked_sub(left)?, row.checked_sub(top)?).copied()
    }))
}

/// How many of the missing lines lie before the first one seen, by both ends; `None` where they do not tell.
fn missing_before(missing: usize, ends: impl Fn() -> [End; 2]) -> Option<usize> {
    if missing == 0 {
        return Some(0);
    }
    match ends() {
        [End::OutOfView, End::Board] => Some(missing),
        [End::Board, End::OutOfView] => Some(0),
        _ => None,
    }
}

/// The grid without outer lines that are chance finds beside the board, in a numbering from any of its ends.
pub fn without_chance_lines(small: &Grey8, grid: Places) -> Places {
    let filled =
        |grid: &Places| (0..grid.rows).filter(|&row| grid.get(0, row).is_some()).count() as f64 / grid.rows as f64;
    let mut grid = grid;
    loop {
        let is_chance = |turned: &Places| {
            let lacks = next_places(turned, 1).into_iter().enumerate().filter(|(row, _)| turned.get(0, *row).is_none());
            filled(turned) == 0.0
                || filled(turned) < FEW
                    && lacks.filter(|(_, place)| !place.is_some_and(|place| is_outside(small, &place))).count()
                        > usize::from(turned.rows >= LONG)
        };
        // The sparsest first: without it, lines across it are less sparse.
        let sides =
            (0..4).map(|quarters| grid.turned(quarters)).filter(|turned| turned.columns > 0 && is_chance(turned));
        let Some(sparsest) = sides.min_by(|a, b| filled(a).total_cmp(&filled(b))) else { return grid };
        grid = Lattice::from_fn(sparsest.columns - 1, sparsest.rows, |col, row| sparsest.get(col + 1, row).copied());
    }
}

/// Where the corners of the line before a column are, as far as the grid goes on evenly; each with the step that leads there.
fn next_places(grid: &Places, column: usize) -> Vec<Option<(Point2<f64>, Vector2<f64>)>> {
    (0..grid.rows).map(|row| grid.next((column as isize, row as isize), (-1, 0))).collect()
}

/// True for a place so near to the picture's border, or beyond it, that a corner there is not seen.
fn is_outside(small: &Grey8, (place, _): &(Point2<f64>, Vector2<f64>)) -> bool {
    let (x, y) = (small.width as f64 - 1.0 - CLOSE_PX, small.height as f64 - 1.0 - CLOSE_PX);
    !(place.x >= CLOSE_PX && place.y >= CLOSE_PX && place.x <= x && place.y <= y)
}

/// True for a place less than a square from being outside.
fn is_near_border(small: &Grey8, (place, step): &(Point2<f64>, Vector2<f64>)) -> bool {
    is_outside(small, &(place + step, *step))
}

/// How the grid ends before its first column.
fn end(small: &Grey8, grid: &Places) -> End {
    let next = next_places(grid, 0);
    let known: Vec<_> = next.iter().flatten().collect();
    let outside = known.iter().filter(|place| is_outside(small, place)).count();
    // An oblique line leaves the view bit by bit, and next to the border a corner is easily lost.
    if outside > 0 && 2 * outside >= known.len() && known.iter().all(|place| is_near_border(small, place)) {
        return End::OutOfView;
    }
    // Beyond the middle between two corners: the square's grey and the margin's.
    let greys: Vec<Option<[f64; 2]>> = next
        .windows(2)
        .map(|two| {
            let [Some((a, step_a)), Some((b, step_b))] = *two else { return None };
            let (middle, step) = (nalgebra::center(&a, &b), (step_a + step_b) / 2.0);
            Some([small.mean_at(middle - step * 0.5)?, small.mean_at(middle + step * (IN_MARGIN - 1.0))?])
        })
        .collect();
    if is_board_end(&greys) { End::Board } else { End::Unknown }
}

/// True for squares that alternate, with a margin that is all of one of their colours.
fn is_board_end(greys: &[Option<[f64; 2]>]) -> bool {
    let colour = |parity: usize| {
        let squares: Vec<f64> = greys.iter().skip(parity).step_by(2).flatten().map(|g| g[0]).collect();
        (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
    };
    let (Some(even), Some(odd)) = (colour(0), colour(1)) else { return false };
    let near = |grey: f64, colour: f64| (grey - colour).abs() < UNEVEN * (even - odd).abs();
    let fitting = |margin: f64| {
        let fits = |(k, g): (usize, &Option<[f64; 2]>)| {
            g.is_some_and(|[square, beyond]| near(square, if k % 2 == 0 { even } else { odd }) && near(beyond, margin))
        };
        greys.iter().enumerate().filter(|&at| fits(at)).count() as f64
    };
    let in_view = greys.iter().flatten().count() as f64;
    in_view >= LEAST_MARGIN * greys.len() as f64 && fitting(even).max(fitting(odd)) >= MOST * in_view
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Side of a square, px.
    const SIDE: f64 = 10.0;

    /// What is in view of a board whose first inner corner lies at a place, completed; the count of its corners, all at their places.
    fn seen(squares: &str, at: (f64, f64), hidden: impl Fn(f64, f64) -> bool) -> Option<usize> {
        let board = Board::checker(squares.parse().unwrap(), 1.0);
        let (w, h) = (120, 100);
        let colour = |x: f64, y: f64| {
            let (i, j) = (((x - at.0) / SIDE).floor() as isize + 1, ((y - at.1) / SIDE).floor() as isize + 1);
            let (wide, high) = (board.squares.columns as isize, board.squares.rows as isize);
            let black = (0..wide).contains(&i) && (0..high).contains(&j) && (i + j) % 2 == 0;
            let paper = (-1..=wide).contains(&i) && (-1..=high).contains(&j);
            if hidden(x, y) || !paper {
                120
            } else if black {
                30
            } else {
                220
            }
        };
        let small =
            Grey8 { width: w, height: h, pixels: (0..w * h).map(|k| colour((k % w) as f64, (k / w) as f64)).collect() };
        let place = |col: usize, row: usize| Point2::new(at.0 + SIDE * col as f64, at.1 + SIDE * row as f64);
        let is = |col: usize, row: usize| {
            let p = place(col, row);
            p.x > 6.0 && p.y > 6.0 && p.x < w as f64 - 7.0 && p.y < h as f64 - 7.0 && !hidden(p.x, p.y)
        };
        let columns: Vec<usize> = (0..board.columns()).filter(|&c| (0..board.rows()).any(|r| is(c, r))).collect();
        let rows: Vec<usize> = (0..board.rows()).filter(|&r| (0..board.columns()).any(|c| is(c, r))).collect();
        // With a chance find beside the board.
        let grid = Lattice::from_fn(columns.len() + 1, rows.len(), |col, row| {
            if col == columns.len() {
                let p = place(columns[col - 1] + 1, rows[row]);
                return (row == 1 && p.x < w as f64 - 7.0).then_some(p);
            }
            is(columns[col], rows[row]).then(|| place(columns[col], rows[row]))
        });
        let grid = without_chance_lines(&small, grid);
        let grid = (0..4)
            .map(|quarters| grid.turned(quarters))
            .find(|turned| turned.get(0, 0).zip(turned.get(1, 0)).is_some_and(|(a, b)| b.x > a.x))?;
        let completed = completed(&small, &grid, board)?;
        assert!(completed.iter().all(|(col, row, p)| *p == place(col, row)), "{completed:?}");
        Some(completed.count())
    }

    #[test]
    fn lines_beyond_one_border_are_known() {
        let cases =
            [((-5.0, 25.0), 35), ((-15.0, 25.0), 30), ((45.0, 25.0), 35), ((25.0, -5.0), 27), ((-5.0, 65.0), 21)];
        for (at, count) in cases {
            assert_eq!(seen("10x6", at, |_, _| false), Some(count), "{at:?}");
        }
    }

    #[test]
    fn hidden_lines_and_lines_beyond_both_borders_are_not() {
        assert_eq!(seen("10x6", (15.0, 25.0), |x, _| x > 85.0), None);
        assert_eq!(seen("16x6", (-15.0, 25.0), |_, _| false), None);
        // Cut off on the left and hidden on the right, wherever what hides it begins.
        for from in 50..70 {
            assert_eq!(seen("10x6", (-5.0, 25.0), |x, _| x > f64::from(from)), None, "{from}");
        }
    }

    #[test]
    fn a_board_in_view_needs_nothing() {
        assert_eq!(seen("9x6", (20.0, 25.0), |_, _| false), Some(40));
    }
}
