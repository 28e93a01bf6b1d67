//! Where the board is, to about a pixel of a small copy.
//!
//! In: a picture and the board's size. Out: a grid of coarse corners at the picture's full size, right-handed, columns along
//! the longer side, turned as far as the colours tell. The board is looked for on an area-averaged copy of about
//! [`COARSE_PX`] pixels, because OpenCV's detectors need seconds and gigabytes on 26 Mpx; a ladder of attempts follows where the
//! first fails. Goes wrong: no board, another board, or a board that is partly hidden; each is a reason in words.

use nalgebra::{Point2, Vector2};

use super::Board;
use super::grid::{Grid, Places};
use super::picture::{Grey8, Picture, Pixels};
use crate::opencv::{Detector, find_board};

/// Pixels of the copy on which the board is looked for first.
pub const COARSE_PX: usize = 1_000_000;

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

/// Looks for the board; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, String> {
    let first = factor_for(picture, COARSE_PX);
    // Finer copies see small boards far away, coarser ones see through blur and noise.
    let ladder = [
        (first, Detector::Classic),
        (first, Detector::ClassicEqualised),
        (first, Detector::Sectors),
        (first * 2, Detector::Classic),
        (first * 2, Detector::Sectors),
        (first.div_ceil(2), Detector::Classic),
        (first.div_ceil(2), Detector::Sectors),
    ];
    let mut copy: Option<(usize, Grey8)> = None;
    for (i, &(factor, detector)) in ladder.iter().enumerate() {
        if ladder[..i].contains(&(factor, detector)) {
            continue;
        }
        let small = match copy.take() {
            Some((f, small)) if f == factor => small,
            _ => picture.reduced(factor),
        };
        let found = find_board(&small, board.columns(), board.rows(), detector).map_err(|e| e.to_string())?;
        if let Some(corners) = found {
            let grid =
                Grid { columns: board.columns(), rows: board.rows(), cells: corners.into_iter().map(Some).collect() };
            let grid = turn_by_colours(&small, right_handed(grid), board);
            let copy = Picture { width: small.width, height: small.height, pixels: Pixels::Eight(small.pixels) };
            return Ok(Detected { corners: grid, copy, factor });
        }
        copy = Some((factor, small));
    }
    Err("no board found".to_owned())
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
