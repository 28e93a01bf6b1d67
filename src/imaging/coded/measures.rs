//! What is printed in another size than the board's name says: its markers, or the gaps between its tags.
//!
//! In: the corners of a board with their numbers. Out: the reason why it is another board, for a person. Goes wrong: markers too small for their outline
//! to be seen, and no two tags side by side: nothing is said.

use nalgebra::Point2;

use super::marker::{Fields, grey_at, mapped, square_map};
use crate::imaging::board::{Board, Kind, Layout};
use crate::imaging::image::Picture;
use crate::imaging::lattice::Places;
use crate::statistics::median;

/// How far the marker's size may be from the board's, as a share of a square.
const MOST_OFF: f64 = 0.05;
/// How far the gaps between tags may be from the board's, as a share of theirs: printers stretch tags and gaps alike, and what a fisheye bends between two
/// tags of six is less than half of it.
const MOST_GAP_OFF: f64 = 0.015;
/// How many standard deviations of the median of all gaps in a picture that must be.
const SURE: f64 = 5.0;

/// The size of the markers, where it is seen to be another than the board's name says.
pub fn other_markers(
    picture: &Picture,
    board: &Board,
    merged: &Places,
    layout: Layout,
    fields: Fields,
) -> Option<String> {
    let Kind::Charuco { marker_mm, .. } = board.kind else { return None };
    let share = seen_share(picture, merged, layout, fields).filter(|s| (s - fields.share).abs() > MOST_OFF)?;
    let (seen_mm, square_mm) = (share * board.square_mm, board.square_mm);
    Some(format!("shows markers of {seen_mm:.3} mm in squares of {square_mm} mm; --board says {marker_mm} mm"))
}

/// The width of the gaps between tags, where measured corners show it to be another than the board's name says.
pub fn other_gaps(board: &Board, corners: &Places) -> Option<String> {
    let Kind::Tags { gap_mm, .. } = board.kind else { return None };
    let (gap, sigma) = seen_gap(corners)?;
    let (seen_mm, square_mm) = (gap * board.square_mm, board.square_mm);
    let named = gap_mm / square_mm;
    ((gap - named).abs() > (MOST_GAP_OFF * named).max(SURE * sigma))
        .then(|| format!("shows gaps of {seen_mm:.3} mm between tags of {square_mm} mm; --board says {gap_mm} mm"))
}

/// Width of the gaps between tags as they are seen, in sides of a tag, and its standard deviation: from the cross-ratio of two tags' four corners on a
/// line, which perspective leaves as it is. `None` where no three neighbouring tags are seen.
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

/// Side of the markers as they are seen, as a share of a square: where their outline has the most contrast. `None` where no whole square with a
/// marker is seen well enough.
fn seen_share(picture: &Picture, corners: &Places, layout: Layout, fields: Fields) -> Option<f64> {
    /// Least side of a bit, px.
    const LEAST_FIELD_PX: f64 = 3.0;
    const STEPS: i32 = 20;
    let field = fields.share / (fields.bits + 2) as f64;
    if corners.step_px()? * field < LEAST_FIELD_PX {
        return None;
    }
    let maps: Vec<_> = corners
        .iter()
        .filter(|(col, row, _)| layout.holds_marker(*col as isize + 1, *row as isize + 1))
        .filter_map(|(col, row, _)| square_map(&corners.square(col, row)?.map(|p| *p)))
        .collect();
    let contrast = |share: f64| {
        let (outside, inside) = ((1.0 - share) / 2.0 - 0.25 * field, (1.0 - share) / 2.0 + 0.25 * field);
        let mut sum = 0.0;
        for map in &maps {
            for k in 0..24 {
                let (along, side) = (0.25 + 0.1 * f64::from(k % 6), k / 6);
                let at = |depth: f64| {
                    let (x, y) =
                        [(along, depth), (along, 1.0 - depth), (depth, along), (1.0 - depth, along)][side as usize];
                    grey_at(picture, &mapped(map, x, y))
                };
                sum += at(outside)? - at(inside)?;
            }
        }
        Some(sum.abs())
    };
    if maps.is_empty() {
        return None;
    }
    let shares = (-STEPS..=STEPS).map(|k| fields.share + 0.01 * f64::from(k)).filter(|s| (0.2..0.97).contains(s));
    let seen = shares.filter_map(|share| Some((contrast(share)?, share)));
    seen.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, share)| share)
}
