//! Which way a grid of corners is numbered, as far as its colours tell.

use nalgebra::Vector2;

use crate::imaging::Board;
use crate::imaging::image::Grey8;
use crate::imaging::lattice::Places;

/// Numbers the rows so that columns, rows and the viewing direction are right-handed.
pub fn right_handed(grid: Places) -> Places {
    let mut sum = 0.0;
    for (col, row, p) in grid.iter() {
        if let (Some(x), Some(y)) = (grid.get(col + 1, row), grid.get(col, row + 1)) {
            sum += (x - p).perp(&(y - p));
        }
    }
    if sum < 0.0 { grid.flip_rows() } else { grid }
}

/// Turns the grid so that the square beyond corner (0, 0) is dark, where turning can change that.
pub(super) fn turn_by_colours(small: &Grey8, grid: Places, board: Board) -> Places {
    if first_square_is_dark(small, &grid) {
        return grid;
    }
    match board.symmetry() {
        None => grid.half_turn(),
        Some(2) if board.columns() == board.rows() => grid.quarter_turn(),
        Some(_) => grid,
    }
}

/// True where the squares of the colour of square (0, 0) are the darker ones. Each cell is compared with its
/// neighbours, so that uneven light does not matter.
fn first_square_is_dark(small: &Grey8, grid: &Places) -> bool {
    let centre = |col: usize, row: usize| {
        let [a, b, d, c] = grid.square(col, row)?;
        let sum = [a, b, c, d].iter().fold(Vector2::zeros(), |sum, p| sum + p.coords) / 4.0;
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
