//! What is printed in another size than the board's name says: its markers, or the gaps between its tags.
//!
//! In: the corners of a board with their numbers. Out: the reason why it is another board, for a person, and the board
//! with the size that is seen. Goes wrong: markers too small for their outline to be seen, or nearly as large as their
//! squares, and no two tags side by side: nothing is said.

use nalgebra::Point2;

use super::marker::{Fields, grey_at, mapped, square_map};
use crate::imaging::board::{Board, Kind, Layout};
use crate::imaging::detect::Refusal;
use crate::imaging::image::Picture;
use crate::imaging::lattice::{Lattice, Places};
use crate::imaging::{Corner, PairCorners};
use crate::statistics::median;

/// How far the marker's size may be from the board's, as a share of a square.
const MOST_OFF: f64 = 0.05;
/// How far the gaps between tags may be from the board's, as a share of theirs: printers stretch tags and gaps alike,
/// and what a fisheye bends between two tags of six is less than half of it.
const MOST_GAP_OFF: f64 = 0.015;
/// The most by which black spreads on a print, mm, and as a share of the gaps: gaps that are narrower by more are
/// others.
const MOST_SPREAD_MM: f64 = 0.3;
const MOST_SPREAD: f64 = 0.1;
/// How many standard deviations of the median of all gaps in a picture that must be.
const SURE: f64 = 5.0;

/// The board with markers of another size, where they are seen to be of another than its name says.
pub fn other_markers(
    picture: &Picture,
    board: &Board,
    merged: &Places,
    (layout, inverted): (Layout, bool),
    fields: Fields,
) -> Option<Refusal> {
    let Kind::Charuco { .. } = board.kind else { return None };
    let squares = merged.iter().map(|(col, row, _)| (col, row));
    let marked: Vec<(usize, usize)> =
        squares.filter(|(col, row)| layout.holds_marker(*col as isize + 1, *row as isize + 1)).collect();
    let share = seen_share(picture, merged, (&marked, inverted), fields)?;
    ((share - fields.share).abs() > MOST_OFF).then(|| refusal(board, share * board.square_mm))
}

/// The board with other gaps between its tags, where measured corners show them to be others than its name says.
pub fn other_gaps(board: &Board, corners: &Places) -> Option<Refusal> {
    let Kind::Tags { gap_mm, .. } = board.kind else { return None };
    let (gap, sigma) = seen_gap(corners)?;
    if board.is_grid() {
        let spread_mm = spread_mm(board, gap_mm, gap);
        let most_mm = MOST_SPREAD_MM.min(MOST_SPREAD * gap_mm) + SURE * sigma * board.square_mm;
        return (spread_mm.abs() > most_mm).then(|| refusal(board, gap * board.square_mm));
    }
    let named = gap_mm / board.square_mm;
    let is_other = (gap - named).abs() > (MOST_GAP_OFF * named).max(SURE * sigma);
    is_other.then(|| refusal(board, gap * board.square_mm))
}

/// By how much each side of a tag is printed farther out than it is drawn where a gap is seen so wide, in sides of a
/// tag, mm.
fn spread_mm(board: &Board, gap_mm: f64, gap: f64) -> f64 {
    (gap_mm - gap * board.square_mm) / (2.0 * (1.0 + gap))
}

/// How far black has spread on a grid of separate tags, by the corners of several pictures; `None` where no picture
/// shows enough of it.
fn seen_spread_mm<'a>(board: &Board, pictures: impl Iterator<Item = &'a [Corner]>) -> Option<f64> {
    let Kind::Tags { gap_mm, .. } = board.kind else { return None };
    let of = |corners: &[Corner]| {
        let mut places: Places = Lattice::from_fn(board.columns(), board.rows(), |_, _| None);
        let used = corners.iter().filter(|corner| corner.used);
        for corner in used.filter(|corner| corner.col < places.columns && corner.row < places.rows) {
            places.cells[corner.row * board.columns() + corner.col] = Some(corner.px);
        }
        Some(spread_mm(board, gap_mm, seen_gap(&places)?.0))
    };
    median(pictures.filter_map(of)).filter(|_| board.is_grid())
}

/// A grid of separate tags with the spread of black that its corners show.
pub fn with_seen_spread(board: Board, pairs: &[PairCorners]) -> Board {
    let pictures = pairs.iter().flat_map(|pair| [pair.left.as_slice(), pair.right.as_slice()]);
    seen_spread_mm(&board, pictures).map_or(board, |mm| board.with_spread_mm(mm))
}

/// Why a board is refused whose markers, or the gaps between whose tags, are seen to be of another size, mm.
pub fn refusal(board: &Board, seen_mm: f64) -> Refusal {
    let (about, square_mm) = (rounded(seen_mm), board.square_mm);
    let shows = match board.kind {
        Kind::Tags { .. } => format!("gaps of about {about} mm between tags of {square_mm} mm"),
        _ => format!("markers of about {about} mm in squares of {square_mm} mm"),
    };
    let said = board.marked_mm().map(|mm| format!("; --board says {mm} mm")).unwrap_or_default();
    Refusal { reason: format!("shows {shows}{said}"), seen: board.with_marked_mm(seen_mm) }
}

/// The size of the markers or gaps by which alone a board that is seen differs from the one that was asked for, mm.
pub fn other_size_mm(asked: &Board, seen: &Board) -> Option<f64> {
    let mm = seen.marked_mm().filter(|mm| asked.marked_mm() != Some(*mm))?;
    (asked.with_marked_mm(mm) == Some(*seen)).then_some(mm)
}

/// The size that pictures of the board show together where one of them shows `one_mm` and half of them `middle_mm` or
/// less; `None` where that is another.
pub fn common_mm(board: &Board, one_mm: f64, middle_mm: f64) -> Option<f64> {
    let most_mm = match board.kind {
        Kind::Tags { .. } => MOST_GAP_OFF * middle_mm,
        _ => MOST_OFF * board.square_mm,
    };
    ((one_mm - middle_mm).abs() <= most_mm).then(|| rounded(middle_mm))
}

/// In as many digits as are seen.
fn rounded(mm: f64) -> f64 {
    format!("{mm:.2e}").parse().unwrap_or(mm)
}

/// Width of the gaps between tags as they are seen, in sides of a tag, and its standard deviation: from the cross-ratio
/// of two tags' four corners on a line, which perspective leaves as it is. `None` where no three neighbouring tags are
/// seen.
fn seen_gap(corners: &Places) -> Option<(f64, f64)> {
    let one = |line: [Option<&Point2<f64>>; 4]| {
        let [Some(a), Some(b), Some(c), Some(d)] = line else { return None };
        let cross = ((c - a).norm() * (d - b).norm()) / ((c - b).norm() * (d - a).norm());
        // (1 + g)^2 / (g (2 + g)) with g for the gap.
        (cross > 1.0).then(|| (cross / (cross - 1.0)).sqrt() - 1.0)
    };
    let lines = corners.iter().flat_map(|(col, row, _)| {
        let across = (col % 2 == 0).then(|| one([0, 1, 2, 3].map(|k| corners.get(col + k, row)))).flatten();
        let along = (row % 2 == 0).then(|| one([0, 1, 2, 3].map(|k| corners.get(col, row + k)))).flatten();
        [across, along]
    });
    let gaps: Vec<f64> = lines.flatten().collect();
    let middle = median(gaps.iter().copied())?;
    // Of normal deviates: their spread by their median magnitude, and that of the median of so many.
    let spread = 1.483 * median(gaps.iter().map(|gap| (gap - middle).abs()))?;
    (gaps.len() > 1).then(|| (middle, 1.253 * spread / (gaps.len() as f64).sqrt()))
}

/// Side of the markers in these squares, each the one after such a corner, as a share of a square: where it is steepest
/// from the paper into their border. `None` where none of them is seen whole and well enough, and where that is at an
/// end of what is looked at.
pub fn seen_share(
    picture: &Picture,
    corners: &Places,
    (squares, inverted): (&[(usize, usize)], bool),
    fields: Fields,
) -> Option<f64> {
    /// Least side of a bit, px.
    const LEAST_FIELD_PX: f64 = 3.0;
    /// Places from a square's side to its middle, a step apart, in sides of the square: those where markers of 0.95 to
    /// 0.3 of it begin have as many on either side as the slope is taken over.
    const STEP: f64 = 0.005;
    const FIRST: usize = 5;
    const LAST: usize = 70;
    const BESIDE: usize = 4;
    /// As steep as the outline is what falls by such a part of the most: of a sharp picture there is no single steepest
    /// place.
    const AS_STEEP: f64 = 0.8;
    let field = fields.share / (fields.bits + 2) as f64;
    if corners.step_px()? * field < LEAST_FIELD_PX {
        return None;
    }
    let map = |(col, row): &(usize, usize)| square_map(&corners.square(*col, *row)?.map(|p| *p));
    let maps: Vec<_> = squares.iter().filter_map(map).collect();
    let grey = |step: usize| {
        let depth = STEP * step as f64;
        let mut sum = 0.0;
        for map in &maps {
            for along in (0..6).map(|k| 0.25 + 0.1 * f64::from(k)) {
                for (x, y) in [(along, depth), (along, 1.0 - depth), (depth, along), (1.0 - depth, along)] {
                    sum += grey_at(picture, &mapped(map, x, y))?;
                }
            }
        }
        Some(if inverted { -sum } else { sum })
    };
    let greys: Vec<f64> = (0..=LAST + BESIDE).map(grey).collect::<Option<_>>()?;
    let fall = |at: usize| greys[at - BESIDE] - greys[at + BESIDE];
    let steepest = (FIRST..=LAST).max_by(|a, b| fall(*a).total_cmp(&fall(*b)))?;
    let is_steep = |at: &usize| fall(*at) >= AS_STEEP * fall(steepest);
    let before = (FIRST..steepest).rev().take_while(is_steep).count();
    let after = (steepest + 1..=LAST).take_while(is_steep).count();
    let outline = steepest - before..=steepest + after;
    let is_seen = fall(steepest) > 0.0 && *outline.start() > FIRST && *outline.end() < LAST;
    let (sum, weights) = outline.fold((0.0, 0.0), |(sum, of), at| (sum + fall(at) * at as f64, of + fall(at)));
    is_seen.then(|| 1.0 - 2.0 * STEP * sum / weights)
}
