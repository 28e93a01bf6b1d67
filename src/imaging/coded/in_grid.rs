//! What is in the squares in and round a grid of corners.

use super::faint::Faint;
use super::local_map;
use super::marker::{self, Fields, read};
use super::numbering::Read;
use crate::imaging::Board;
use crate::imaging::board::{Layout, Pitch};
use crate::imaging::image::Picture;
use crate::imaging::lattice::Places;

/// What of the usual contrast a marker has at least: light falls off over a board, but not so far.
const LEAST_CONTRAST: f64 = 0.35;

/// The squares in and round a grid that may hold markers, by the corner before each.
fn squares_of(grid: &Places, pitch: Pitch) -> impl Iterator<Item = (isize, isize)> {
    let (columns, rows) = (grid.columns as isize, grid.rows as isize);
    let all = (-1..rows).flat_map(move |row| (-1..columns).map(move |col| (col, row)));
    // A lattice of tags begins with one.
    let may_hold = move |at: &(isize, isize)| pitch == Pitch::Even || Layout::Tags.holds_marker(at.0 + 1, at.1 + 1);
    let is_near = |&(col, row): &(isize, isize)| {
        [(0, 0), (1, 0), (1, 1), (0, 1)].iter().any(|(c, r)| grid.around(col + c, row + r).is_some())
    };
    all.filter(may_hold).filter(is_near)
}

/// What the markers in and round a grid are.
pub fn markers_in(picture: &Picture, grid: &Places, pitch: Pitch, fields: Fields) -> Vec<Read> {
    let one = |(col, row)| {
        let corners = local_map::square(grid, pitch, (col, row))?;
        Some(Read { col, row, marker: read(picture, &corners, fields)? })
    };
    let mut reads: Vec<Read> = squares_of(grid, pitch).filter_map(one).collect();
    // A plain square whose neighbours blur into it looks like a marker of hardly any contrast.
    let mut contrasts: Vec<f64> = reads.iter().map(|read| read.marker.contrast).collect();
    contrasts.sort_by(f64::total_cmp);
    let usual = contrasts.get(3 * contrasts.len() / 4).copied().unwrap_or(0.0);
    reads.retain(|read| read.marker.contrast > LEAST_CONTRAST * usual);
    reads
}

/// How dark the bits are in the squares in and round a grid.
pub fn faint_in(picture: &Picture, grid: &Places, board: &Board, fields: Fields) -> Vec<Faint> {
    let one = |square| {
        let corners = local_map::square(grid, board.pitch(), square)?;
        Some(Faint { square, darkness: marker::darkness(picture, &corners, fields)? })
    };
    squares_of(grid, board.pitch()).filter_map(one).collect()
}
