//! How far lengths on the board come out wrong, measured by cameras that have not seen the pair (Fig. 6 of the paper).
//!
//! In: a calibration. Out: signed length errors of every range along x and y, a pair and in all, and the verdict. Method: k folds over the
//! pairs; each fold's rig triangulates the corners of the pairs it was not calibrated with. The board's pitch sets the scale, so
//! that a wrong pitch is invisible here: only a second board shows it.

use rayon::prelude::*;
use serde::Serialize;

use super::calibrate::Calibration;
use super::folds::{self, FOLDS};
use super::homography::FEWEST_CORNERS;
use super::layout::Shared;
use super::observations::View;
use super::pose;
use super::residuals::residual_px;
use super::rig::Covariance;
use super::robust::Loss;
use super::start::CAUCHY_WIDTH;
use super::triangulate::{RigCovariance, SpacePoint, common, triangulate};
use super::{Error, Rig, bundle};
use crate::imaging::{Board, Corners, Skipped};

/// The short and the long range of Fig. 6 (b), in squares: 10 and 70 mm on the paper's board.
const SHORT_SQUARES: usize = 1;
const LONG_SQUARES: usize = 7;

/// A corner that misses the rig's prediction by more than this on a second board was not found there, px.
const GROSS_PX: f64 = 2.0;

/// Coverage factor of the expanded uncertainty: 95 %.
const COVERAGE: f64 = 2.0;

/// Along the board's columns or rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
}

/// The errors of one range over all pairs; measured minus nominal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Range {
    /// Direction on the board.
    pub axis: Axis,
    /// Nominal length, mm.
    pub nominal_mm: f64,
    /// How many lengths.
    pub count: usize,
    /// Mean error, mm.
    pub mean_error_mm: f64,
    /// Standard deviation of the errors, mm.
    pub std_mm: f64,
    /// Largest absolute error, mm.
    pub max_abs_error_mm: f64,
}

/// One pair as measured by cameras that have not seen it.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOutPair {
    /// Its name.
    pub pair: String,
    /// Mean error of the short range along x, mm; `None` where no such length was seen.
    pub mean_error_x_short_mm: Option<f64>,
    /// Along y.
    pub mean_error_y_short_mm: Option<f64>,
    /// Mean error of the long range along x, mm.
    pub mean_error_x_long_mm: Option<f64>,
    /// Along y.
    pub mean_error_y_long_mm: Option<f64>,
    /// Largest absolute error of any range, mm.
    pub max_abs_error_mm: f64,
    /// Root mean square of the distance between the two rays of a corner, mm.
    pub gap_rms_mm: f64,
    /// Errors of the long range, x then y, mm: Fig. 6 (a).
    pub long_errors_mm: Vec<f64>,
}

/// What the verdict is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Within tolerance, uncertainty included.
    Pass,
    /// Out of tolerance, whatever the uncertainty.
    Fail,
    /// The uncertainty reaches across the tolerance.
    Undecided,
}

/// The accuracy of a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy {
    /// The length that comes out most wrong.
    pub worst: Worst,
    /// Mean over all points of what both rays leave, chi-square with one degree of freedom: one where the pictures disagree as
    /// much as the corners scatter, less where both see the same deviations from the board.
    pub rays_chi_square: f64,
    /// Number of folds.
    pub folds: usize,
    /// Lengths of the short and the long range, mm, along x and y alike where the board allows.
    pub short_mm: [f64; 2],
    /// Long range along x and y, mm.
    pub long_mm: [f64; 2],
    /// Every range, x first, from the shortest.
    pub ranges: Vec<Range>,
    /// Every pair.
    pub pairs: Vec<HeldOutPair>,
}

/// The length that comes out most wrong, and what makes its error uncertain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Worst {
    /// Its absolute error, mm.
    pub error_mm: f64,
    /// Standard deviation through the corners at both its ends, mm.
    pub corners_mm: f64,
    /// Through the calibration that both ends share, mm.
    pub calibration_mm: f64,
    /// Of the board's own length; zero where nothing is known of it, mm.
    pub board_mm: f64,
}

impl Worst {
    /// Expanded uncertainty (k = 2) of the error, mm.
    pub fn expanded_uncertainty_mm(&self) -> f64 {
        self.expanded_without_corners_mm().hypot(COVERAGE * self.corners_mm)
    }

    /// The share that is not the corners': calibration and board, expanded (k = 2), mm.
    pub fn expanded_without_corners_mm(&self) -> f64 {
        COVERAGE * self.calibration_mm.hypot(self.board_mm)
    }

    /// With the uncertainty of the board's lengths as a certificate states it (expanded, k = 2), mm.
    pub fn with_board(self, expanded_mm: f64) -> Worst {
        Worst { board_mm: expanded_mm / COVERAGE, ..self }
    }
}

impl Verdict {
    /// Pass only where the uncertainty fits into the tolerance as well, fail only where it cannot help (ISO 14253-1). The corners'
    /// scatter is the rig's own: it stands against a pass and does not excuse an error.
    pub fn of(worst: &Worst, tolerance_mm: f64) -> Verdict {
        if worst.error_mm + worst.expanded_uncertainty_mm() <= tolerance_mm {
            Verdict::Pass
        } else if worst.error_mm - worst.expanded_without_corners_mm() > tolerance_mm {
            Verdict::Fail
        } else {
            Verdict::Undecided
        }
    }

    /// Of two verdicts on one rig: a pass needs both.
    pub fn and(self, other: Verdict) -> Verdict {
        match (self, other) {
            (Verdict::Fail, _) | (_, Verdict::Fail) => Verdict::Fail,
            (Verdict::Undecided, _) | (_, Verdict::Undecided) => Verdict::Undecided,
            (Verdict::Pass, Verdict::Pass) => Verdict::Pass,
        }
    }
}

impl Accuracy {
    /// What the held-out pairs say.
    pub fn verdict(&self, tolerance_mm: f64) -> Verdict {
        Verdict::of(&self.worst, tolerance_mm)
    }
}

/// A length between two corners in a row or column.
struct Length {
    axis: Axis,
    squares: usize,
    error_mm: f64,
    /// Places of its two points.
    ends: (usize, usize),
}

struct Measured {
    points: Vec<SpacePoint>,
    lengths: Vec<Length>,
}

/// Holds out every pair once and measures it.
///
/// An error where a fold without some of the pairs does not determine the cameras.
pub fn hold_out(calibration: &Calibration) -> Result<Accuracy, Error> {
    let count = calibration.views.len();
    let folds = folds::assign(count, FOLDS);
    let fold_count = FOLDS.min(count);
    let problem = calibration.problem();
    let rigs: Vec<Option<Rig>> = (0..fold_count)
        .into_par_iter()
        .map(|fold| {
            let kept = problem.subset(|i| folds[i] != fold);
            let mut values = kept.refit(&calibration.layout)?;
            let matrix = bundle::uncertainty(&kept.views, &calibration.layout, &values)?.shared;
            values.shared.rig.covariance = Some(Covariance { order: calibration.layout.names(), matrix });
            Some(values.shared.rig)
        })
        .collect();
    let rigs = rigs.into_iter().collect::<Option<Vec<Rig>>>().ok_or(Error::Undetermined { focal_sigma: None })?;
    let measured: Vec<Measured> = calibration
        .views
        .par_iter()
        .enumerate()
        .map(|(i, view)| measure(&rigs[folds[i]], &calibration.board, view))
        .collect();
    summarise(calibration, &rigs, &folds, &measured).ok_or(Error::Undetermined { focal_sigma: None })
}

/// A second board, measured by the rig as it is: it helped to calibrate nothing, so that its pitch shows the scale.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SecondBoard {
    /// Pairs that were measured.
    pub pairs: usize,
    /// Pairs that were not, and why.
    pub pairs_skipped: Vec<Skipped>,
    /// The length that comes out most wrong.
    #[serde(skip)]
    pub worst: Worst,
    /// Its absolute error, mm.
    pub max_abs_error_mm: f64,
    /// Measured lengths over nominal ones, minus one; both boards' pitch errors and the rig's scale together.
    pub scale_error: f64,
    /// Its standard deviation over the pairs.
    pub scale_error_sigma: f64,
    /// Every range, x first, from the shortest.
    pub ranges: Vec<Range>,
}

/// Measures a second board. `None` where no pair shows it.
pub fn second_board(calibration: &Calibration, corners: &Corners) -> Option<SecondBoard> {
    let board = &corners.board;
    let shared = Shared { rig: calibration.rig().clone(), shape_mm: [0.0; 2] };
    let mut skipped = corners.skipped.clone();
    let mut measured = Vec::new();
    for pair in &corners.pairs {
        let mut views = [View::new(board, pair, FEWEST_CORNERS)];
        calibration.noise.apply(&mut views);
        let [mut view] = views;
        let fit = pose::fit(&shared, &view, Loss::Cauchy(CAUCHY_WIDTH));
        for o in &mut view.observations {
            let miss = fit.as_ref().and_then(|fit| residual_px(&shared, &fit.left_from_board, o));
            // The target's own print may be worse than the check board's: only gross misses are left out.
            o.active = miss.is_some_and(|r| r.norm() <= GROSS_PX);
        }
        let lengths = measure(calibration.rig(), board, &view);
        if lengths.lengths.is_empty() {
            let reason =
                "no length in it fits the rig: another board, or pictures that do not belong together".to_owned();
            skipped.push(Skipped { pair: pair.pair.clone(), reason });
        } else {
            measured.push(lengths);
        }
    }
    let scales: Vec<f64> = measured.iter().map(|m| m.scale_error(board)).collect();
    let scale_error = mean(&scales)?;
    let spread: f64 = scales.iter().map(|s| (s - scale_error) * (s - scale_error)).sum();
    let n = scales.len() as f64;
    let worst = worst(&measured, |_| calibration.rig())?;
    Some(SecondBoard {
        pairs: measured.len(),
        pairs_skipped: skipped,
        worst,
        max_abs_error_mm: worst.error_mm,
        scale_error,
        scale_error_sigma: (spread / (n - 1.0).max(1.0) / n).sqrt(),
        ranges: all_ranges(board, &measured),
    })
}

/// Triangulates the corners of a pair and measures all lengths along rows and columns.
fn measure(rig: &Rig, board: &Board, view: &View) -> Measured {
    let mut at = vec![None; board.corner_count()];
    let mut points = Vec::new();
    for (left, right) in common(view) {
        if let Some(point) = triangulate(rig, left, right) {
            at[board.index(left.col, left.row)] = Some(points.len());
            points.push(point);
        }
    }
    let mut lengths = Vec::new();
    let (columns, rows) = (board.columns(), board.rows());
    let mut add = |axis, squares: usize, a: usize, b: usize| {
        if let (Some(a), Some(b)) = (at[a], at[b]) {
            let length_mm = (points[b].point_mm - points[a].point_mm).norm();
            let error_mm = length_mm - squares as f64 * board.square_mm;
            lengths.push(Length { axis, squares, error_mm, ends: (a, b) });
        }
    };
    for row in 0..rows {
        for col in 0..columns {
            for squares in 1..columns - col {
                add(Axis::X, squares, board.index(col, row), board.index(col + squares, row));
            }
            for squares in 1..rows - row {
                add(Axis::Y, squares, board.index(col, row), board.index(col, row + squares));
            }
        }
    }
    Measured { points, lengths }
}

fn summarise(calibration: &Calibration, rigs: &[Rig], folds: &[usize], measured: &[Measured]) -> Option<Accuracy> {
    let board = &calibration.board;
    let largest = |squares: usize, corners: usize| squares.min(corners - 1);
    let short = [SHORT_SQUARES; 2];
    let long = [largest(LONG_SQUARES, board.columns()), largest(LONG_SQUARES, board.rows())];
    let ranges = all_ranges(board, measured);
    let pairs = calibration.views.iter().zip(measured).map(|(view, m)| pair(view, m, short, long)).collect();
    Some(Accuracy {
        worst: worst(measured, |i| &rigs[folds[i]])?,
        rays_chi_square: mean(&measured.iter().flat_map(|m| &m.points).map(|p| p.chi_square).collect::<Vec<_>>())?,
        folds: rigs.len(),
        short_mm: short.map(|s| s as f64 * board.square_mm),
        long_mm: long.map(|s| s as f64 * board.square_mm),
        ranges,
        pairs,
    })
}

/// The length that comes out most wrong; `rig_of` is what measured a pair.
fn worst<'a>(measured: &[Measured], rig_of: impl Fn(usize) -> &'a Rig) -> Option<Worst> {
    let (pair, length) = measured
        .iter()
        .enumerate()
        .flat_map(|(i, m)| m.lengths.iter().map(move |l| (i, l)))
        .max_by(|a, b| a.1.error_mm.abs().total_cmp(&b.1.error_mm.abs()))?;
    let points = &measured[pair].points;
    let (a, b) = (&points[length.ends.0], &points[length.ends.1]);
    let calibration = rig_of(pair).covariance.as_ref().map_or(0.0, |c| RigCovariance::new(c).length_variance_mm2(a, b));
    Some(Worst {
        error_mm: length.error_mm.abs(),
        corners_mm: a.corner_variance_mm2(b).max(0.0).sqrt(),
        calibration_mm: calibration.max(0.0).sqrt(),
        board_mm: 0.0,
    })
}

fn all_ranges(board: &Board, measured: &[Measured]) -> Vec<Range> {
    [(Axis::X, board.columns()), (Axis::Y, board.rows())]
        .into_iter()
        .flat_map(|(axis, corners)| (1..corners).map(move |squares| (axis, squares)))
        .filter_map(|(axis, squares)| range(board, measured, axis, squares))
        .collect()
}

fn range(board: &Board, measured: &[Measured], axis: Axis, squares: usize) -> Option<Range> {
    let errors: Vec<f64> = measured.iter().flat_map(|m| m.errors(axis, squares)).collect();
    let mean = mean(&errors)?;
    let spread: f64 = errors.iter().map(|e| (e - mean) * (e - mean)).sum();
    Some(Range {
        axis,
        nominal_mm: squares as f64 * board.square_mm,
        count: errors.len(),
        mean_error_mm: mean,
        std_mm: (spread / (errors.len() as f64 - 1.0).max(1.0)).sqrt(),
        max_abs_error_mm: errors.iter().fold(0.0, |max: f64, e| max.max(e.abs())),
    })
}

fn pair(view: &View, measured: &Measured, short: [usize; 2], long: [usize; 2]) -> HeldOutPair {
    let mean_of = |axis, squares| mean(&measured.errors(axis, squares).collect::<Vec<_>>());
    let gaps: Vec<f64> = measured.points.iter().map(|p| p.gap_mm * p.gap_mm).collect();
    HeldOutPair {
        pair: view.pair.clone(),
        mean_error_x_short_mm: mean_of(Axis::X, short[0]),
        mean_error_y_short_mm: mean_of(Axis::Y, short[1]),
        mean_error_x_long_mm: mean_of(Axis::X, long[0]),
        mean_error_y_long_mm: mean_of(Axis::Y, long[1]),
        max_abs_error_mm: measured.worst_mm(),
        gap_rms_mm: mean(&gaps).unwrap_or(0.0).sqrt(),
        long_errors_mm: measured.errors(Axis::X, long[0]).chain(measured.errors(Axis::Y, long[1])).collect(),
    }
}

impl Measured {
    fn worst_mm(&self) -> f64 {
        self.lengths.iter().fold(0.0, |max: f64, l| max.max(l.error_mm.abs()))
    }

    /// Sum of the measured over the sum of the nominal lengths, minus one.
    fn scale_error(&self, board: &Board) -> f64 {
        let nominal: f64 = self.lengths.iter().map(|l| l.squares as f64 * board.square_mm).sum();
        self.lengths.iter().map(|l| l.error_mm).sum::<f64>() / nominal
    }

    fn errors(&self, axis: Axis, squares: usize) -> impl Iterator<Item = f64> + '_ {
        self.lengths.iter().filter(move |l| l.axis == axis && l.squares == squares).map(|l| l.error_mm)
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}
