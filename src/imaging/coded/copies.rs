//! The reduced copies of a picture that boards with markers are looked for on, and the grids of corners on each.
//!
//! In: a picture. Out: copies from coarse to fine, and on one of them grids of corners as they lie in the picture, the
//! largest first, without corners that lie elsewhere than their neighbours say.

use nalgebra::Point2;

use super::local_map;
use crate::imaging::board::Pitch;
use crate::imaging::detect::{grids, right_handed};
use crate::imaging::image::pyramid::{Level, to_full_size};
use crate::imaging::image::{Grey8, Picture};
use crate::imaging::lattice::Places;

/// Squares of so many px of a copy have a margin of so many px round their markers at least: on finer copies nothing
/// more is seen.
pub const ENOUGH_MARGIN_PX: f64 = 5.0;

/// Copies with so many pixels may be enlarged.
const MOST_DOUBLED_PX: usize = 4_000_000;

/// How far from where its neighbours have it a corner may lie, in sides of a square.
const STRAY: f64 = 0.2;

/// Copies in their order: from coarse to fine.
pub fn levels(picture: &Picture) -> impl Iterator<Item = Level> + use<> {
    let doubled = (picture.width() * picture.height() <= MOST_DOUBLED_PX).then_some(Level::Doubled);
    to_full_size(picture).chain(doubled)
}

/// The grids of corners on a copy as they lie in the picture, the largest first.
pub fn grids_on(
    (level, copy): (Level, &Grey8),
    pitch: Pitch,
    margin: f64,
    foreshortened: bool,
) -> impl Iterator<Item = Places> + use<> {
    let in_picture = move |grid: Places| without_strays(right_handed(grid.map(|p| level.to_picture(p))), pitch);
    grids(copy, pitch, margin, foreshortened).into_iter().map(in_picture)
}

/// The grid without corners that lie elsewhere than their neighbours say, the worst first.
pub fn without_strays(mut grid: Places, pitch: Pitch) -> Places {
    loop {
        let Some(step) = grid.side_px(pitch) else { return grid };
        let off = |(col, row, p): (usize, usize, &Point2<f64>)| {
            let at = local_map::predicted(&grid, pitch, (col as isize, row as isize))?;
            Some(((at - p).norm() / step, row * grid.columns + col))
        };
        let worst = grid.iter().filter_map(off).max_by(|a, b| a.0.total_cmp(&b.0));
        match worst {
            Some((off, at)) if off > STRAY => grid.cells[at] = None,
            _ => return grid,
        }
    }
}
