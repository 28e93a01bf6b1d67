//! Boards that reach beyond the picture's border.
//!
//! In: a grid of corners and the board. Out: all ways in which the grid may lie on the board, the lines that are out of
//! view empty. Method: outer lines with few corners are chance, unless the others are out of view. Missing lines lie on
//! the side where the next line of corners would be out of view, if the board is seen to end on the other side: a line
//! of squares, then the margin. Something that hides part of the board looks otherwise; then they may lie on either
//! side. A grid that is as long as the board's shorter side is not known to be the whole of that side.

use nalgebra::{Point2, Vector2};

use super::continuation;
use crate::imaging::Board;
use crate::imaging::image::Grey8;
use crate::imaging::lattice::{Lattice, Places};

/// A corner nearer to the picture's border is not seen, px of the copy: the ring that is looked at has a radius of 5.
const CLOSE_PX: f64 = 8.0;
/// Where the last squares and the margin are looked at, steps beyond the last corners. Something bright that hides a
/// board's squares from some place on looks like a margin, but hardly begins just where they end.
const BEFORE: f64 = -0.5;
const IN_SQUARE: [f64; 2] = [0.5, 0.85];
const IN_MARGIN: [f64; 2] = [1.15, 1.3];
/// How far the margin's grey may be from that of the squares of its colour, as a share of their contrast.
const UNEVEN: f64 = 0.35;
/// Share of the margin in view that must look as it should.
const MOST: f64 = 0.8;
/// Share of the margin that must be in view, and on how many squares at least: on two of them anything may look as it
/// should.
const LEAST_MARGIN: f64 = 0.3;
const LEAST_SQUARES: usize = 3;
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

/// All ways in which the grid may lie on the board, columns along columns; as lattices of the board's size.
pub fn placings(small: &Grey8, grid: &Places, board: Board) -> Vec<Places> {
    let missing = |of_board: usize, of_grid: usize| of_board.checked_sub(of_grid);
    let (Some(columns), Some(rows)) = (missing(board.columns(), grid.columns), missing(board.rows(), grid.rows)) else {
        return Vec::new();
    };
    let turned = grid.quarter_turn();
    let left = missing_before(columns, || [end(small, grid), end(small, &grid.half_turn())]);
    // A quarter turn brings the last row to the left.
    let top = missing_before(rows, || [end(small, &turned.half_turn()), end(small, &turned)]);
    let placed = |(left, top): (usize, usize)| {
        Lattice::from_fn(board.columns(), board.rows(), |col, row| {
            grid.get(col.checked_sub(left)?, row.checked_sub(top)?).copied()
        })
    };
    left.into_iter().flat_map(|left| top.iter().map(move |&top| (left, top))).map(placed).collect()
}

/// How many of the missing lines may lie before the first one seen, by both ends: none where both ends are the board's,
/// for then there are none missing, and it is another board or lies otherwise.
fn missing_before(missing: usize, ends: impl Fn() -> [End; 2]) -> Vec<usize> {
    if missing == 0 {
        return vec![0];
    }
    match ends() {
        [End::OutOfView, End::Board] => vec![missing],
        [End::Board, End::OutOfView] => vec![0],
        [End::Board, End::Board] => Vec::new(),
        // What hides a board may look like its end.
        _ => (0..=missing).collect(),
    }
}

/// The grid without outer lines that are chance finds beside the board, in a numbering from any of its ends.
pub fn without_chance_lines(small: &Grey8, mut grid: Places) -> Places {
    let filled = |grid: &Places| grid.rows_at_front().count() as f64 / grid.rows as f64;
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
        grid = sparsest.without_front();
    }
}

/// The whole board, where a line beside it has no more than half of its corners: beside a board without a margin on a
/// dark ground every other square of its border has a corner there, which is none of the board's. Whether the board
/// goes on beyond is seen later.
pub fn whole_without_sparse_line(grid: &Places, board: Board) -> Option<Places> {
    let size = [board.columns(), board.rows()];
    (0..4).map(|quarters| grid.turned(quarters)).filter(|turned| turned.columns > 1).find_map(|turned| {
        let left = turned.without_front();
        let is_whole = left.count() == board.corner_count();
        let fits = [[left.columns, left.rows], [left.rows, left.columns]].contains(&size);
        (2 * turned.rows_at_front().count() <= turned.rows && is_whole && fits).then_some(left)
    })
}

/// The grid without outer lines that are no corners but the board's own outline: without such a line the grid is seen
/// to end there as a board does. So it does where a finger lies on the dark squares beyond a line of corners; these are
/// crossings of four squares, and the outline has none.
pub fn without_outline(small: &Grey8, mut grid: Places) -> Places {
    for _ in 0..4 {
        grid = grid.quarter_turn();
        // Of chance finds alone nothing may be left.
        if grid.columns < 3 {
            continue;
        }
        let inner = grid.without_front();
        if end(small, &inner) == End::Board && !are_crossings(small, &grid) {
            grid = inner;
        }
    }
    grid
}

/// Whether most corners of the first column are crossings of four squares.
fn are_crossings(small: &Grey8, grid: &Places) -> bool {
    let crossings = grid.rows_at_front().filter(|&row| continuation::is_crossing(small, grid, (0, row))).count();
    2 * crossings > grid.rows_at_front().count()
}

/// Where the next corner of a line would be, and the step that leads there, px.
type Next = (Point2<f64>, Vector2<f64>);

/// Where the corners of the line before a column are, as far as the grid goes on evenly; each with the step that leads
/// there.
fn next_places(grid: &Places, column: usize) -> Vec<Option<Next>> {
    (0..grid.rows).map(|row| grid.next((column as isize, row as isize), (-1, 0))).collect()
}

/// True for a place so near to the picture's border, or beyond it, that a corner there is not seen.
fn is_outside(small: &Grey8, (place, _): &Next) -> bool {
    let (x, y) = (small.width as f64 - 1.0 - CLOSE_PX, small.height as f64 - 1.0 - CLOSE_PX);
    !(place.x >= CLOSE_PX && place.y >= CLOSE_PX && place.x <= x && place.y <= y)
}

/// True for a place less than a square from being outside.
fn is_near_border(small: &Grey8, (place, step): &Next) -> bool {
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
    // At the middle between two corners: the grey of the square before them, of the one beyond, and of the margin.
    let greys = |in_square: f64, in_margin: f64| -> Vec<Option<[f64; 3]>> {
        let of = |two: &[Option<Next>]| {
            let [Some((a, step_a)), Some((b, step_b))] = *two else { return None };
            let (middle, step) = (nalgebra::center(&a, &b), (step_a + step_b) / 2.0);
            let at = |steps: f64| small.mean_at(middle + step * (steps - 1.0));
            Some([at(BEFORE)?, at(in_square)?, at(in_margin)?])
        };
        next.windows(2).map(of).collect()
    };
    let both = IN_SQUARE.into_iter().zip(IN_MARGIN).all(|(square, margin)| is_board_end(&greys(square, margin)));
    if both { End::Board } else { End::Unknown }
}

/// True where the board is seen to end on all four sides of the grid.
pub fn ends_on_all_sides(small: &Grey8, grid: &Places) -> bool {
    (0..4).all(|quarters| end(small, &grid.turned(quarters)) == End::Board)
}

/// True where more corners would be in view on all four sides of the grid.
pub fn is_in_view(small: &Grey8, grid: &Places) -> bool {
    (0..4)
        .all(|quarters| next_places(&grid.turned(quarters), 0).iter().flatten().all(|place| !is_outside(small, place)))
}

/// True for squares that go on alternating as those before them do, with a margin that is all of one of their colours.
fn is_board_end(greys: &[Option<[f64; 3]>]) -> bool {
    let before = |parity: usize| {
        let squares: Vec<f64> = greys.iter().skip(parity).step_by(2).flatten().map(|g| g[0]).collect();
        (!squares.is_empty()).then(|| squares.iter().sum::<f64>() / squares.len() as f64)
    };
    let (Some(odd), Some(even)) = (before(0), before(1)) else { return false };
    let near = |grey: f64, colour: f64| (grey - colour).abs() < UNEVEN * (even - odd).abs();
    let fitting = |margin: f64| {
        let fits = |(k, g): (usize, &Option<[f64; 3]>)| {
            g.is_some_and(|[_, square, beyond]| {
                near(square, if k % 2 == 0 { even } else { odd }) && near(beyond, margin)
            })
        };
        greys.iter().enumerate().filter(|&at| fits(at)).count() as f64
    };
    let count = greys.iter().flatten().count();
    let (in_view, all) = (count as f64, greys.len());
    count >= LEAST_SQUARES.min(all)
        && in_view >= LEAST_MARGIN * all as f64
        && fitting(even).max(fitting(odd)) >= MOST * in_view
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Side of a square, px.
    const SIDE: f64 = 10.0;

    /// What is in view of a board whose first inner corner lies at a place, completed; the count of its corners, all at
    /// their places.
    fn seen(squares: &str, at: (f64, f64), hidden: impl Fn(f64, f64) -> bool) -> Option<usize> {
        let board = Board::checker(squares.parse().unwrap(), 1.0);
        let (w, h) = (120, 100);
        let colour = |x: f64, y: f64| {
            let (i, j) = (((x - at.0) / SIDE).floor() as isize + 1, ((y - at.1) / SIDE).floor() as isize + 1);
            let (wide, high) = (board.squares.columns as isize, board.squares.rows as isize);
            let black = (0..wide).contains(&i) && (0..high).contains(&j) && (i + j) % 2 == 0;
            let paper = (-1..=wide).contains(&i) && (-1..=high).contains(&j);
            let grey = if black { 30 } else { 220 };
            if hidden(x, y) || !paper { 120 } else { grey }
        };
        let small = Grey8::from_fn(w, h, |x, y| colour(x as f64, y as f64));
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
        let ways = placings(&small, &grid, board);
        let is_right = |way: &Places| way.iter().all(|(col, row, p)| *p == place(col, row));
        assert!(ways.iter().any(is_right), "{ways:?}");
        (ways.len() == 1).then(|| ways[0].count())
    }

    #[test]
    fn lines_beyond_one_border_are_known() {
        let cases =
            [((-5.0, 25.0), 35), ((-15.0, 25.0), 30), ((45.0, 25.0), 35), ((25.0, -5.0), 27), ((-5.0, 65.0), 21)];
        for (at, count) in cases {
            assert_eq!(seen("10x6", at, |_, _| false), Some(count), "{at:?}");
        }
        // A board in view needs nothing.
        assert_eq!(seen("9x6", (20.0, 25.0), |_, _| false), Some(40));
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
    fn the_outline_is_no_line_of_corners() {
        let small = |hidden: bool| {
            Grey8::from_fn(120, 100, |x, y| {
                let (i, j) = (x / 10, y / 10);
                let black = (2..10).contains(&i) && (2..8).contains(&j) && (i + j) % 2 == 0;
                let grey = if black { 30 } else { 220 };
                if hidden && x > 92 { 120 } else { grey }
            })
        };
        // From the first column on, of which 2 is the outline.
        let grid = |first: usize, last: usize| {
            Lattice::from_fn(last - first + 1, 5, |col, row| {
                Some(Point2::new((10 * (first + col)) as f64 - 0.5, (10 * (3 + row)) as f64 - 0.5))
            })
        };
        for hidden in [false, true] {
            for (first, last, kept) in [(2, 8, 6), (3, 9, 7), (4, 8, 5)] {
                let found = without_outline(&small(hidden), grid(first, last));
                assert_eq!((found.columns, found.rows), (kept, 5), "{hidden} {first}");
                assert_eq!(found.get(0, 0), Some(&Point2::new((10 * first.max(3)) as f64 - 0.5, 29.5)));
            }
        }
    }

    #[test]
    fn next_to_nothing_has_no_outline() {
        let small = Grey8 { width: 120, height: 100, pixels: vec![120; 120 * 100] };
        for (columns, rows) in [(0, 0), (0, 3), (3, 0), (1, 1), (1, 4), (2, 2)] {
            let grid =
                Lattice::from_fn(columns, rows, |col, row| Some(Point2::new(30.0 + col as f64, 40.0 + row as f64)));
            assert_eq!(without_outline(&small, grid.clone()), grid, "{columns}x{rows}");
        }
    }

    #[test]
    fn a_line_with_half_of_its_corners_is_taken_off_a_whole_board() {
        let board: Board = Board::checker("10x7".parse().unwrap(), 25.0);
        let grid = |is_there: &dyn Fn(usize, usize) -> bool| -> Places {
            Lattice::from_fn(10, 6, |col, row| {
                is_there(col, row).then(|| Point2::new(20.0 * col as f64, 20.0 * row as f64))
            })
        };
        let beside = |last: usize| grid(&|col, row| col < 9 || row < last);
        for last in 1..=3 {
            for quarters in 0..4 {
                let found = whole_without_sparse_line(&beside(last).turned(quarters), board).unwrap();
                assert_eq!(found.count(), 54, "{last} {quarters}");
            }
        }
        // Most of a line is a line, and what is left has to be the whole board.
        assert_eq!(whole_without_sparse_line(&beside(4), board), None);
        assert_eq!(
            whole_without_sparse_line(&grid(&|col, row| col < 9 && (col, row) != (4, 3) || row < 3), board),
            None
        );
        assert_eq!(whole_without_sparse_line(&beside(3), Board::checker("9x7".parse().unwrap(), 25.0)), None);
    }
}
