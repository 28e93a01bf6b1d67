//! Is the board larger than what was asked for?
//!
//! A detector told to look for 9x6 squares may find them inside a board of 10x7. Where one square beyond the grid's border a
//! whole line of corners looks just like those inside, the board goes on, and which part of it was found is
//! chance: left and right would not show the same corners.

use nalgebra::{Point2, Vector2};

use super::Detected;
use crate::imaging::image::Grey8;
use crate::imaging::lattice::{Lattice, Places};
use crate::statistics::median;

/// Share of a line beyond the border that must look like corners; the board's own outer edge shows none.
const SHARE: f64 = 0.75;
/// What of a square's contrast a corner beyond the border shows at least. An edge alone shows none, the end of an edge a half.
const CONTRAST: f64 = 0.7;
/// What of the contrast of most corners one of the grid shows at least: a corner of one square shows none, one in half a shadow a half.
const END_CONTRAST: f64 = 0.25;

/// How many columns and rows of corners the board has beyond those found; counts one line on each side at the most.
pub fn lines_beyond(detected: &Detected) -> (usize, usize) {
    let (grid, copy) = (&detected.corners, &detected.copy);
    let (columns, rows) = (grid.columns as isize, grid.rows as isize);
    let inside = grid.iter().filter_map(|(col, row, _)| contrast(copy, grid, col as isize, row as isize));
    let Some(usual) = median(inside) else { return (0, 0) };
    let goes_on = |line: &mut dyn Iterator<Item = (isize, isize)>, length: isize| {
        let alike = line.filter_map(|(col, row)| contrast(copy, grid, col, row)).filter(|c| c / usual > CONTRAST);
        alike.count() as f64 >= SHARE * length as f64
    };
    let column = |col: isize| goes_on(&mut (0..rows).map(|row| (col, row)), rows);
    let row = |row: isize| goes_on(&mut (0..columns).map(|col| (col, row)), columns);
    (usize::from(column(-1)) + usize::from(column(columns)), usize::from(row(-1)) + usize::from(row(rows)))
}

/// The grid without what is no crossing of four squares: at a board's end the outer corners of its dark squares on a light margin.
pub(super) fn without_ends(copy: &Grey8, grid: Places) -> Places {
    let seen = grid.iter().filter_map(|(col, row, _)| contrast(copy, &grid, col as isize, row as isize));
    let mut seen: Vec<f64> = seen.map(f64::abs).collect();
    seen.sort_by(f64::total_cmp);
    // On a board of nine corners those at its end may be nearly as many.
    let Some(usual) = seen.get(3 * seen.len() / 4).copied() else { return grid };
    Lattice::from_fn(grid.columns, grid.rows, |col, row| {
        let crosses = contrast(copy, &grid, col as isize, row as isize).is_none_or(|c| c.abs() > END_CONTRAST * usual);
        grid.get(col, row).copied().filter(|_| crosses)
    })
}

/// Contrast of the four squares round a corner of the grid, or round a place one square beyond it, with the sign that
/// the order of colours gives it: the lesser of both differences between neighbours across an edge and their
/// neighbours across the other. `None` outside of the picture.
fn contrast(copy: &Grey8, grid: &Places, col: isize, row: isize) -> Option<f64> {
    let (place, along, across) = local(grid, col, row)?;
    let at = |a: f64, b: f64| copy.mean_at(place + (along * a + across * b) * 0.4);
    let (pp, pm, mp, mm) = (at(1.0, 1.0)?, at(1.0, -1.0)?, at(-1.0, 1.0)?, at(-1.0, -1.0)?);
    let sign = if (col + row).rem_euclid(2) == 0 { 1.0 } else { -1.0 };
    let differences = [pp - pm, pp - mp, mm - pm, mm - mp].map(|d| sign * d);
    let mean = differences.iter().sum::<f64>() / 4.0;
    let least = differences.into_iter().fold(f64::MAX, f64::min);
    let most = differences.into_iter().fold(f64::MIN, f64::max);
    Some(if mean > 0.0 { least } else { most })
}

/// A corner of the grid or a place one square beyond it, and the steps to the next column and the next row there.
fn local(grid: &Places, col: isize, row: isize) -> Option<(Point2<f64>, Vector2<f64>, Vector2<f64>)> {
    let (columns, rows) = (grid.columns as isize, grid.rows as isize);
    let inward = |at: isize, size: isize| isize::from(at < 0) - isize::from(at >= size);
    let (dc, dr) = (inward(col, columns), inward(row, rows));
    let place =
        if (dc, dr) == (0, 0) { *grid.around(col, row)? } else { grid.next((col + dc, row + dr), (-dc, -dr))?.0 };
    let (c, r) = (col.clamp(0, columns - 1), row.clamp(0, rows - 1));
    let step = |dc: isize, dr: isize| {
        let here = grid.around(c, r)?;
        let next = grid.around(c + dc, r + dr).map(|p| p - here);
        next.or_else(|| grid.around(c - dc, r - dr).map(|p| here - p))
    };
    Some((place, step(1, 0)?, step(0, 1)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::pyramid::Level;

    /// A board of 7x6 squares of 12 px in a light margin, of which the inner corners in the given ranges were found.
    fn found(cols: std::ops::Range<usize>, rows: std::ops::Range<usize>) -> Detected {
        let colour = |x: usize, y: usize| {
            let (i, j) = (x as isize / 12 - 1, y as isize / 12 - 1);
            let black = (0..7).contains(&i) && (0..6).contains(&j) && (i + j) % 2 == 0;
            if black { 40 } else { 200 }
        };
        let pixels = (0..108 * 96).map(|k| colour(k % 108, k / 108)).collect();
        let copy = Grey8 { width: 108, height: 96, pixels };
        let corners = Lattice::from_fn(cols.len(), rows.len(), |col, row| {
            let (x, y) = ((cols.start + col + 2) * 12, (rows.start + row + 2) * 12);
            Some(Point2::new(x as f64 - 0.5, y as f64 - 0.5))
        });
        Detected { corners, copy, level: Level::Reduced(1) }
    }

    #[test]
    fn a_whole_board_ends_where_its_corners_end() {
        assert_eq!(lines_beyond(&found(0..6, 0..5)), (0, 0));
    }

    #[test]
    fn a_part_goes_on_where_it_was_cut() {
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

    #[test]
    fn nothing_is_known_beyond_the_picture() {
        let mut detected = found(0..5, 0..5);
        detected.copy.width = 0;
        assert_eq!(lines_beyond(&detected), (0, 0));
    }
}
