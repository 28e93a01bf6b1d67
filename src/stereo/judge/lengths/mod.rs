//! Lengths between the corners of a board, triangulated by a rig.
//!
//! In: a rig and the corners of a pair. Out: signed length errors (measured minus nominal) of every range along the
//! board's rows and columns.

pub mod held_out;
pub mod model_disagreement;
pub mod second_board;

use rayon::prelude::*;
use serde::Serialize;

use crate::imaging::Board;
use crate::stereo::Rig;
use crate::stereo::data::View;
use crate::stereo::data::residuals::mean;
use crate::stereo::judge::verdict::{Expansion, Extremes, LengthError};
use crate::stereo::triangulate::{RigCovariance, SpacePoint, common, triangulate};

/// Along the board's columns or rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    X,
    Y,
}

/// The errors of one range over all pairs; measured minus nominal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Range {
    pub axis: Axis,
    pub nominal_mm: f64,
    /// How many lengths.
    pub count: usize,
    pub mean_error_mm: f64,
    /// Standard deviation of the errors, mm.
    pub std_mm: f64,
    pub max_abs_error_mm: f64,
}

/// A length between two corners in a row or column. On a grid of tags lengths of an odd number of lines begin with a
/// tag: each number of lines is one length.
pub(super) struct Length {
    axis: Axis,
    squares: usize,
    error_mm: f64,
    /// Places of its two points.
    pub(super) ends: (usize, usize),
}

/// What a rig makes of a pair; nothing where none has measured it.
#[derive(Default)]
pub(super) struct Measured {
    /// The corners that both pictures show.
    pub(super) points: Vec<SpacePoint>,
    /// Standard deviation of each, the larger of both pictures', px.
    pub(super) sigmas_px: Vec<f64>,
    /// Corners that say less about the rig than the others, see [`crate::stereo::judge::doubtful_corners`].
    pub(super) doubtful: Vec<bool>,
    /// All lengths between them along rows and columns.
    pub(super) lengths: Vec<Length>,
}

/// Triangulates the corners of a pair and measures all lengths along rows and columns.
pub(super) fn measure(rig: &Rig, board: &Board, view: &View) -> Measured {
    let mut at = vec![None; board.corner_count()];
    let (mut points, mut sigmas_px) = (Vec::new(), Vec::new());
    for (left, right) in common(view) {
        if let Some(point) = triangulate(rig, left, right) {
            at[board.index(left.col, left.row)] = Some(points.len());
            points.push(point);
            sigmas_px.push(left.sigma_px().max(right.sigma_px()));
        }
    }
    let mut lengths = Vec::new();
    let (columns, rows) = (board.columns(), board.rows());
    let pitch = board.pitch();
    let mut add = |axis, squares: usize, a: usize, b: usize| {
        if let (Some(a), Some(b)) = (at[a], at[b]) {
            let length_mm = (points[b].point_mm - points[a].point_mm).norm();
            let error_mm = length_mm - board.spans_mm(squares)[axis as usize];
            lengths.push(Length { axis, squares, error_mm, ends: (a, b) });
        }
    };
    for row in 0..rows {
        for col in 0..columns {
            for squares in (1..columns - col).filter(|squares| pitch.is_as_from_first(col, *squares)) {
                add(Axis::X, squares, board.index(col, row), board.index(col + squares, row));
            }
            for squares in (1..rows - row).filter(|squares| pitch.is_as_from_first(row, *squares)) {
                add(Axis::Y, squares, board.index(col, row), board.index(col, row + squares));
            }
        }
    }
    Measured { doubtful: vec![false; points.len()], points, sigmas_px, lengths }
}

/// The length errors that decide, each with its own uncertainty; `covariance_of` is that of the rig that measured a
/// pair, `share` that of the corners' variance by which both pictures disagree.
pub(super) fn extremes<'a>(
    measured: &[Measured],
    covariance_of: impl Fn(usize) -> Option<&'a RigCovariance> + Sync,
    expansion: Expansion,
    share: f64,
) -> Option<Extremes> {
    let of_pair = |(i, measured): (usize, &Measured)| -> Option<Extremes> {
        let of_length = |length: &Length| -> Extremes {
            let (a, b) = (&measured.points[length.ends.0], &measured.points[length.ends.1]);
            let calibration = covariance_of(i).map_or(0.0, |c| c.length_variance_mm2(a, b));
            let error = LengthError {
                pair: i,
                error_mm: length.error_mm.abs(),
                corners_mm: (share * a.corner_variance_mm2(b)).max(0.0).sqrt(),
                calibration_mm: calibration.max(0.0).sqrt(),
                expansion,
            };
            Extremes { max_abs_error_mm: error.error_mm, largest: error, surest: error, one_in_twenty_mm: 0.0 }
        };
        measured.lengths.iter().map(of_length).reduce(Extremes::and)
    };
    let by_pair: Vec<Option<Extremes>> = measured.par_iter().enumerate().map(of_pair).collect();
    let extremes = by_pair.into_iter().flatten().reduce(Extremes::and)?;
    let mut errors: Vec<f64> = measured.iter().flat_map(|m| &m.lengths).map(|length| length.error_mm.abs()).collect();
    let place = errors.len() * 19 / 20;
    let (_, one_in_twenty_mm, _) = errors.select_nth_unstable_by(place, f64::total_cmp);
    Some(Extremes { one_in_twenty_mm: *one_in_twenty_mm, ..extremes })
}

pub(super) fn all_ranges(board: &Board, measured: &[Measured]) -> Vec<Range> {
    [(Axis::X, board.columns()), (Axis::Y, board.rows())]
        .into_iter()
        .flat_map(|(axis, corners)| (1..corners).map(move |squares| (axis, squares)))
        .filter_map(|(axis, squares)| range(board, measured, axis, squares))
        .collect()
}

fn range(board: &Board, measured: &[Measured], axis: Axis, squares: usize) -> Option<Range> {
    let errors: Vec<f64> = measured.iter().flat_map(|m| m.errors(axis, squares)).collect();
    let mean = mean(errors.iter().copied())?;
    let spread: f64 = errors.iter().map(|e| (e - mean) * (e - mean)).sum();
    Some(Range {
        axis,
        nominal_mm: as_written_mm(board.spans_mm(squares)[axis as usize]),
        count: errors.len(),
        mean_error_mm: mean,
        std_mm: (spread / (errors.len() as f64 - 1.0).max(1.0)).sqrt(),
        max_abs_error_mm: errors.iter().fold(0.0, |max: f64, e| max.max(e.abs())),
    })
}

impl Measured {
    pub(super) fn worst_mm(&self) -> Option<f64> {
        self.lengths.iter().map(|l| l.error_mm.abs()).reduce(f64::max)
    }

    /// Sum of the measured over the sum of the nominal lengths, minus one.
    pub(super) fn scale_error(&self, board: &Board) -> f64 {
        let nominal: f64 = self.lengths.iter().map(|l| board.spans_mm(l.squares)[l.axis as usize]).sum();
        self.lengths.iter().map(|l| l.error_mm).sum::<f64>() / nominal
    }

    pub(super) fn errors(&self, axis: Axis, squares: usize) -> impl Iterator<Item = f64> + '_ {
        self.lengths.iter().filter(move |l| l.axis == axis && l.squares == squares).map(|l| l.error_mm)
    }
}

/// A length as a person writes it: 38.1 for three squares of 12.7.
pub(super) fn as_written_mm(length_mm: f64) -> f64 {
    (length_mm * 1e9).round() / 1e9
}
