//! Where the board is, to about a pixel of a small copy.
//!
//! In: a picture and the board's size. Out: a reduced copy and a grid of coarse corners on it, right-handed, columns along
//! the longer side, turned as far as the colours tell. The copy is an area average of about [`COARSE_PX`] pixels: the board is seen there
//! as well as on 26 Mpx, in a twentieth of the time; a ladder of attempts on finer and coarser copies follows where the
//! first fails. Its work is bounded by the pixels of the copies, whatever they show: no clock decides what is found, and OpenCV's
//! classic detector is not among the attempts, because fine texture keeps it busy for minutes (and what it finds is found without
//! it). Goes wrong: no board, another board, or a board of which too little is in view; each is a reason in words.

use nalgebra::{Point2, Vector2};

use super::cut;
use super::grid::{Grid, Places};
use super::grow::largest_grid;
use super::picture::{Grey8, Picture, Pixels};
use super::{Board, Squares};
use crate::opencv::find_board;

/// Pixels of the copy on which the board is looked for first.
pub const COARSE_PX: usize = 1_000_000;

/// Grids of fewer corners than this are chance.
const LEAST_SEEN: usize = 12;
/// A board found in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Detected {
    /// Coarse places of the inner corners on the copy, px, to about half a pixel.
    pub corners: Places,
    /// The reduced copy.
    pub copy: Picture,
    /// How many pixels of the picture one pixel of the copy was.
    pub factor: usize,
}

impl Detected {
    /// A place on the copy as one in the picture, px.
    pub fn at_full_size(&self, p: &Point2<f64>) -> Point2<f64> {
        let k = self.factor as f64;
        Point2::new((p.x + 0.5) * k - 0.5, (p.y + 0.5) * k - 0.5)
    }
}

/// Why a picture gave no corners.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    /// For a person.
    pub reason: String,
    /// The board of another size that the picture shows instead.
    pub seen: Option<Squares>,
}

impl From<String> for Refusal {
    fn from(reason: String) -> Refusal {
        Refusal { reason, seen: None }
    }
}

/// One attempt: on which copy, in which way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Attempt {
    copy: Copy,
    way: Way,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Copy {
    /// Reduced by a factor.
    Reduced(usize),
    /// Enlarged to twice the size, for squares of a few pixels.
    Doubled,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    /// Corner by corner, for boards that need not be wholly there.
    Grow,
    /// OpenCV's sector-based detector: slower, sees through more blur and noise.
    Sectors,
}

/// Looks for the board; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    let (mut partial, mut seen) = (None::<Detected>, None::<Places>);
    let mut last: Option<(Copy, Grey8)> = None;
    for attempt in ladder(picture) {
        // All of it was looked at corner by corner: more looking would only find a part of what is there.
        if attempt.way == Way::Sectors && (partial.is_some() || seen.as_ref().is_some_and(|grid| tells(grid).0)) {
            break;
        }
        let small = match last.take() {
            Some((copy, small)) if copy == attempt.copy => small,
            _ => match attempt.copy {
                Copy::Reduced(factor) => picture.reduced(factor),
                Copy::Doubled => doubled(&picture.reduced(1)),
            },
        };
        let found = match attempt.way {
            Way::Sectors => find_board(&small, board.columns(), board.rows())
                .map_err(|e| e.to_string())?
                .map(|corners| whole(board, corners)),
            Way::Grow => grown(&small).and_then(|grid| {
                let fitting = of_size(&small, &grid, board);
                if fitting.is_none() && seen.as_ref().is_none_or(|s| tells(&grid) > tells(s)) {
                    seen = Some(grid);
                }
                fitting
            }),
        };
        if let Some(grid) = found {
            let complete = grid.count() == board.corner_count();
            // The whole of a board is not less than what else hangs together in the picture; what was grown ends where the board ends.
            let less = |seen: &Places| match attempt.way {
                Way::Grow => tells(seen) > tells(&grid),
                Way::Sectors => seen.count() > grid.count(),
            };
            if complete && seen.as_ref().is_some_and(less) {
                break;
            }
            let grid = turn_by_colours(&small, right_handed(grid), board);
            let detected = on_a_copy(picture, attempt.copy, &small, grid);
            if complete {
                return Ok(detected);
            }
            if detected.corners.count() > partial.as_ref().map_or(0, |p| p.corners.count()) {
                partial = Some(detected);
            }
        }
        // Another board, seen whole, that this one could be a part of.
        if seen.as_ref().is_some_and(|grid| tells(grid).0 && holds(grid, board)) {
            break;
        }
        last = Some((attempt.copy, small));
    }
    // A part of a larger grid is not the board with corners missing.
    let larger = seen.as_ref().map_or(0, Grid::count);
    partial.filter(|p| p.corners.count() > larger).ok_or_else(|| refusal(seen, board))
}

/// How much a grid tells of the size of its board: first whether all its corners are there, then how many they are.
fn tells(grid: &Places) -> (bool, usize) {
    (grid.count() == grid.columns * grid.rows && grid.count() >= LEAST_SEEN, grid.count())
}

/// True where the board could be a part of the grid.
fn holds(grid: &Places, board: Board) -> bool {
    grid.columns.max(grid.rows) >= board.columns() && grid.columns.min(grid.rows) >= board.rows()
}

/// Attempts in their order. Finer copies see small boards far away, coarser ones see through blur and noise.
fn ladder(picture: &Picture) -> Vec<Attempt> {
    let first = factor_for(picture, COARSE_PX);
    let finer = if first == 1 { Copy::Doubled } else { Copy::Reduced(first.div_ceil(2)) };
    let (first, coarser) = (Copy::Reduced(first), Copy::Reduced(2 * first));
    let grown = [first, coarser, finer].map(|copy| Attempt { copy, way: Way::Grow });
    let sectors = [first, coarser].map(|copy| Attempt { copy, way: Way::Sectors });
    grown.into_iter().chain(sectors).collect()
}

fn grown(small: &Grey8) -> Option<Places> {
    Some(cut::without_chance_lines(small, largest_grid(small)?))
}

fn whole(board: Board, corners: Vec<Point2<f64>>) -> Places {
    Grid { columns: board.columns(), rows: board.rows(), cells: corners.into_iter().map(Some).collect() }
}

/// A grid as the board's, where it is known which of the board's corners are missing: it is as long and as wide as the board, or
/// what it lacks can only lie beyond the picture's border.
fn of_size(small: &Grey8, grid: &Places, board: Board) -> Option<Places> {
    /// Share of the board's corners that makes a grid the board.
    const LEAST: f64 = 0.5;
    if (grid.count() as f64) < LEAST * board.corner_count() as f64 {
        return None;
    }
    let quarter = grid.quarter_turn();
    let ways = [Some(grid), (board.columns() != board.rows()).then_some(&quarter)];
    let mut fitting = ways.into_iter().flatten().filter_map(|grid| cut::completed(small, grid, board));
    let first = fitting.next()?;
    fitting.next().is_none().then_some(first)
}

/// What was found on a copy, on one that is no finer than the picture.
fn on_a_copy(picture: &Picture, copy: Copy, small: &Grey8, grid: Places) -> Detected {
    let of = |small: Grey8| Picture { width: small.width, height: small.height, pixels: Pixels::Eight(small.pixels) };
    match copy {
        Copy::Reduced(factor) => Detected { corners: grid, copy: of(small.clone()), factor },
        Copy::Doubled => {
            let corners = grid.map(|p| Point2::new((p.x + 0.5) / 2.0 - 0.5, (p.y + 0.5) / 2.0 - 0.5));
            Detected { corners, copy: of(picture.reduced(1)), factor: 1 }
        }
    }
}

fn refusal(seen: Option<Places>, board: Board) -> Refusal {
    let Some(grid) = seen.filter(|grid| grid.count() >= LEAST_SEEN) else { return "no board found".to_owned().into() };
    let (long, short) = (grid.columns.max(grid.rows), grid.columns.min(grid.rows));
    let (columns, rows) = (board.columns(), board.rows());
    let shows = format!("shows {} corners in {long} columns and {short} rows", grid.count());
    // A corner or two are lost easily; the size is but a hint.
    let complete = 10 * grid.count() >= 9 * long * short;
    let seen = complete.then_some(Squares { columns: long + 1, rows: short + 1 });
    let reason = if long <= columns && short <= rows {
        format!("{shows}: which of the board's {columns}x{rows} they are cannot be told")
    } else {
        format!("{shows}, the board has {columns}x{rows}")
    };
    Refusal { reason, seen }
}

/// The board that a picture shows, whatever was asked for, where all its corners are there.
pub fn size_seen(detected: &Detected) -> Option<Squares> {
    let Pixels::Eight(pixels) = &detected.copy.pixels else { return None };
    let small = Grey8 { width: detected.copy.width, height: detected.copy.height, pixels: pixels.clone() };
    let grid = grown(&small)?;
    let (columns, rows) = (grid.columns.max(grid.rows) + 1, grid.columns.min(grid.rows) + 1);
    (grid.count() == grid.columns * grid.rows).then_some(Squares { columns, rows })
}

/// A copy of twice the size, linear between pixels. Pixel centres map by `x_double = (x + 0.5) * 2 - 0.5`.
fn doubled(small: &Grey8) -> Grey8 {
    let (w, h) = (small.width, small.height);
    // A quarter of a pixel from its own pixel's centre towards the next one's.
    let near = |i: usize, size: usize| {
        let other = if i.is_multiple_of(2) { (i / 2).saturating_sub(1) } else { (i / 2 + 1).min(size - 1) };
        [(i / 2, 3u32), (other, 1u32)]
    };
    let mut pixels = Vec::with_capacity(4 * w * h);
    for y in 0..2 * h {
        let lines = near(y, h);
        for x in 0..2 * w {
            let columns = near(x, w);
            let weigh = |(row, a): (usize, u32)| {
                columns.iter().map(|&(col, b)| a * b * u32::from(small.pixels[row * w + col])).sum::<u32>()
            };
            pixels.push(((lines.into_iter().map(weigh).sum::<u32>() + 8) / 16) as u8);
        }
    }
    Grey8 { width: 2 * w, height: 2 * h, pixels }
}

/// The whole factor that brings a picture closest to `pixels` from above.
fn factor_for(picture: &Picture, pixels: usize) -> usize {
    let ratio = (picture.width * picture.height) as f64 / pixels as f64;
    ratio.sqrt().floor().max(1.0) as usize
}

/// Numbers the rows so that columns, rows and the viewing direction are right-handed.
pub fn right_handed(grid: Places) -> Places {
    let mut sum = 0.0;
    for (col, row, p) in grid.iter() {
        if let (Some(x), Some(y)) = (grid.get(col + 1, row), grid.get(col, row + 1)) {
            sum += cross(x - p, y - p);
        }
    }
    if sum < 0.0 { grid.flip_rows() } else { grid }
}

fn cross(a: Vector2<f64>, b: Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Turns the grid so that the square beyond corner (0, 0) is dark, where turning can change that.
pub fn turn_by_colours(small: &Grey8, grid: Places, board: Board) -> Places {
    if first_square_is_dark(small, &grid) {
        return grid;
    }
    if !board.looks_the_same_after_half_turn() {
        return grid.half_turn();
    }
    if board.columns() == board.rows() && board.squares.columns.is_multiple_of(2) {
        return grid.quarter_turn();
    }
    grid
}

/// True where the squares of the colour of square (0, 0) are the darker ones. Each cell is compared with its neighbours, so
/// that uneven light does not matter.
fn first_square_is_dark(small: &Grey8, grid: &Places) -> bool {
    let centre = |col: usize, row: usize| {
        let p = [grid.get(col, row)?, grid.get(col + 1, row)?, grid.get(col, row + 1)?, grid.get(col + 1, row + 1)?];
        let sum = p.iter().fold(Vector2::zeros(), |sum, p| sum + p.coords) / 4.0;
        let (x, y) = (sum.x.round(), sum.y.round());
        let inside = x >= 0.0 && y >= 0.0 && x < small.width as f64 && y < small.height as f64;
        inside.then(|| f64::from(small.pixels[y as usize * small.width + x as usize]))
    };
    let mut sum = 0.0;
    for row in 0..grid.rows {
        for col in 0..grid.columns {
            let Some(here) = centre(col, row) else { continue };
            let sign = if (col + row) % 2 == 0 { 1.0 } else { -1.0 };
            for next in [centre(col + 1, row), centre(col, row + 1)].into_iter().flatten() {
                sum += sign * (next - here);
            }
        }
    }
    sum > 0.0
}
