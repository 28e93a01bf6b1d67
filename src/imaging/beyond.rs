//! Is the board larger than what was asked for?
//!
//! A detector told to look for 9x6 squares may find them inside a board of 10x7. Where one square beyond the grid's border a
//! whole line of corners looks just like those inside, the board goes on, and which part of it was found is
//! chance: left and right would not show the same corners.

use nalgebra::Point2;

use super::detect::Detected;
use super::grid::Places;
use super::refine::{Measured, measure_at};

/// Share of a line beyond the border that must look like corners; the board's own outer edge shows none.
const SHARE: f64 = 0.75;

/// How many columns and rows of corners the board has beyond those found; counts one line on each side at the most.
pub fn lines_beyond(detected: &Detected) -> (usize, usize) {
    let grid = &detected.corners;
    let (columns, rows) = (grid.columns as isize, grid.rows as isize);
    let inside: Vec<Measured> = grid
        .iter()
        .step_by((grid.count() / 16).max(1))
        .filter_map(|(col, row, _)| measure_at(detected, &local(grid, col as isize, row as isize)?))
        .collect();
    let mut contrasts: Vec<f64> = inside.iter().map(|m| m.fit.model.half_contrast.abs()).collect();
    contrasts.sort_by(f64::total_cmp);
    let Some(&usual) = contrasts.get(contrasts.len() / 2) else { return (0, 0) };
    let goes_on = |line: Vec<(isize, isize)>| {
        let alike = line.iter().filter(|&&(col, row)| {
            local(grid, col, row).and_then(|cell| measure_at(detected, &cell)).is_some_and(|m| {
                let contrast = m.fit.model.half_contrast.abs();
                // An edge alone, or a T of edges, fits with half the contrast and a residual of that order.
                contrast > 0.6 * usual && m.fit.residual < 0.25 * contrast
            })
        });
        alike.count() as f64 >= SHARE * line.len() as f64
    };
    let column = |col: isize| goes_on((0..rows).map(|row| (col, row)).collect());
    let row = |row: isize| goes_on((0..columns).map(|col| (col, row)).collect());
    (usize::from(column(-1)) + usize::from(column(columns)), usize::from(row(-1)) + usize::from(row(rows)))
}

/// A corner of the grid, or one square beyond it, with its neighbours towards the middle: place, next column, next row.
fn local(grid: &Places, col: isize, row: isize) -> Option<[Point2<f64>; 3]> {
    let (columns, rows) = (grid.columns as isize, grid.rows as isize);
    // Steps of perspective change evenly enough from one square to the next.
    let beyond = |at: isize, size: isize| {
        if at < 0 {
            1
        } else if at >= size {
            -1
        } else {
            0
        }
    };
    let (dc, dr) = (beyond(col, columns), beyond(row, rows));
    let place = match (dc, dr) {
        (0, 0) => *grid.around(col, row)?,
        _ => {
            let near = grid.around(col + dc, row + dr)?;
            let step = grid.around(col + dc, row + dr)? - grid.around(col + 2 * dc, row + 2 * dr)?;
            let before = grid.around(col + 2 * dc, row + 2 * dr)? - grid.around(col + 3 * dc, row + 3 * dr)?;
            near + step + (step - before)
        }
    };
    let inner = |at: isize, size: isize| at.clamp(0, size - 1);
    let (c, r) = (inner(col, columns), inner(row, rows));
    let toward = |at: isize, size: isize| if at + 1 < size { 1 } else { -1 };
    let (tc, tr) = (toward(c, columns), toward(r, rows));
    let edge =
        |dc: isize, dr: isize, sign: isize| Some((grid.around(c + dc, r + dr)? - grid.around(c, r)?) * sign as f64);
    Some([place, place + edge(tc, 0, tc)?, place + edge(0, tr, tr)?])
}
