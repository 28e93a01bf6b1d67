//! How far lengths on the board come out wrong, measured by cameras that have not seen the pair (Fig. 6 of the paper).
//!
//! In: a calibration. Out: the errors of every range, a pair and in all, and the largest of them. Method: k folds over
//! the pairs; each fold's rig triangulates the corners of the pairs it was not calibrated with. The board's pitch sets
//! the scale, so that a wrong pitch is invisible here: only a second board shows it.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;
use serde::Serialize;

use crate::stereo::calibrate::Calibration;
use crate::stereo::data::View;
use crate::stereo::data::residuals::{mean, root_mean_square};
use crate::stereo::judge::doubtful_corners::{self, DoubtfulCorners};
use crate::stereo::judge::lengths::{self, Axis, Measured, Range, all_ranges, measure};
use crate::stereo::judge::verdict::{Expansion, Extremes};
use crate::stereo::model::Covariance;
use crate::stereo::select::cross_validation::{self, Without};
use crate::stereo::solve::uncertainty::{self, UNTOLD_FOCAL_SIGMA, WORST_FOCAL_SIGMA};
use crate::stereo::triangulate::{RigCovariance, common};
use crate::stereo::volume::lengths::LONG_SQUARES;
use crate::stereo::{Camera, Error, Rig};

/// The short range of Fig. 6 (b), in squares: 10 mm on the paper's board; the long one is [`LONG_SQUARES`].
const SHORT_SQUARES: usize = 1;

/// One pair as measured by cameras that have not seen it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HeldOutPair {
    pub pair: String,
    /// Mean error of the short range along x, mm; `None` where no such length was seen.
    #[serde(rename = "mean_error_x10_mm")]
    pub mean_error_x_short_mm: Option<f64>,
    /// Along y.
    #[serde(rename = "mean_error_y10_mm")]
    pub mean_error_y_short_mm: Option<f64>,
    /// Mean error of the long range along x, mm.
    #[serde(rename = "mean_error_x70_mm")]
    pub mean_error_x_long_mm: Option<f64>,
    /// Along y.
    #[serde(rename = "mean_error_y70_mm")]
    pub mean_error_y_long_mm: Option<f64>,
    /// Largest absolute error of any range, mm; `None` where both pictures show no length.
    pub max_abs_error_mm: Option<f64>,
    /// Root mean square of the distance between the two rays of a corner, mm; `None` where both show none.
    pub gap_rms_mm: Option<f64>,
    /// Errors of the long range, x then y, mm: Fig. 6 (a).
    #[serde(skip)]
    pub long_errors_mm: Vec<f64>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Accuracy {
    pub extremes: Extremes,
    /// Mean over all points of what both rays leave, chi-square with one degree of freedom: one where the pictures
    /// disagree as much as the corners scatter, less where both see the same deviations from the board.
    pub rays_chi_square: f64,
    /// Distance of corners from the epipolar lines of their partners.
    pub epipolar: EpipolarError,
    pub doubtful: DoubtfulCorners,
    pub folds: usize,
    /// Pairs without which the others do not determine the cameras: no other rig measures them, or only one that what
    /// focal lengths usually are helped to.
    pub unchecked: Vec<String>,
    /// What leaving out each fold does to the shared numbers.
    pub fold_steps: Vec<DVector<f64>>,
    /// Short range along x and y, mm.
    pub short_mm: [f64; 2],
    /// Long range along x and y, mm: as long as the board allows.
    pub long_mm: [f64; 2],
    /// Every range, x first, from the shortest.
    pub ranges: Vec<Range>,
    pub pairs: Vec<HeldOutPair>,
}

impl Accuracy {
    /// Share of the corners' variance by which both pictures disagree. The rest is the board's (its print, its bends,
    /// what of it moved with both pictures), which both see alike: it moves no point.
    pub fn disagreement_share(&self) -> f64 {
        self.rays_chi_square.clamp(f64::MIN_POSITIVE, 1.0)
    }
}

/// Distance of corners from the epipolar lines of their partners.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EpipolarError {
    pub rms_px: f64,
    pub max_px: f64,
}

/// The rigs that measured: one a fold, `None` where the other pairs do not determine one.
struct Folds {
    of_pair: Vec<usize>,
    rigs: Vec<Option<FoldRig>>,
    /// False where no fold leaves pairs that determine the cameras, and what focal lengths usually are helped these.
    determined: bool,
}

/// A rig of all pairs but those of one fold.
struct FoldRig {
    rig: Rig,
    covariance: RigCovariance,
    step: DVector<f64>,
}

impl Folds {
    /// The rig that has not seen this pair.
    fn of(&self, pair: usize) -> Option<&FoldRig> {
        self.rigs[self.of_pair[pair]].as_ref()
    }
}

/// Holds out every pair once, together with those of similar poses, and measures it. `board_mm` is the expanded
/// uncertainty of the board's lengths.
///
/// Pairs without which the others do not determine the cameras are not measured. Where that is all of them (a few
/// boards that all lie alike), rigs measure them whose focal lengths are known no better than a calibration's must be,
/// and all are told as unchecked; an error where there is not even one of those.
pub fn hold_out(calibration: &Calibration, board_mm: Option<f64>) -> Result<Accuracy, Error> {
    let undetermined = || Error::undetermined().without(&calibration.skipped);
    if calibration.views.iter().all(|view| common(view).is_empty()) {
        return Err(Error::NothingInCommon { pairs: calibration.views.len() });
    }
    check_baseline(calibration)?;
    let folds = folds(calibration).ok_or_else(undetermined)?;
    let measured =
        |(i, view)| folds.of(i).map_or_else(Measured::default, |fold| measure(&fold.rig, &calibration.board, view));
    let mut measured: Vec<Measured> = calibration.views.par_iter().enumerate().map(measured).collect();
    let names: Vec<&str> = calibration.views.iter().map(|view| view.pair.as_str()).collect();
    let usual_px = calibration.noise.typical_px(&calibration.views);
    let doubtful = doubtful_corners::leave_out(&mut measured, &names, usual_px);
    summarise(calibration, folds, &measured, doubtful, board_mm).ok_or_else(undetermined)
}

/// An error where the distance of the cameras is not told from none: because they are one, or because boards that all
/// lie alike leave focal lengths open and the distance with them, which is told once the lenses are known.
fn check_baseline(calibration: &Calibration) -> Result<(), Error> {
    /// Standard deviations by which the distance must be more than nothing.
    const FEWEST: f64 = 3.0;
    let Calibration { layout, covariance, .. } = calibration;
    let between_mm = calibration.rig().right_from_left.translation.vector;
    let at = layout.transform_start() + 3;
    let direction = between_mm.try_normalize(0.0).unwrap_or_else(Vector3::x);
    let sigma_mm = |covariance: &DMatrix<f64>, at: usize| {
        (direction.transpose() * covariance.fixed_view::<3, 3>(at, at) * direction).x.max(0.0).sqrt()
    };
    let (baseline_mm, sigma_of_both_mm) = (between_mm.norm(), sigma_mm(covariance, at));
    if baseline_mm >= FEWEST * sigma_of_both_mm {
        return Ok(());
    }
    let (first, rest) = (layout.transform_start(), layout.count() - layout.transform_start());
    let lenses_known = uncertainty::invert(covariance)
        .and_then(|told| uncertainty::invert(&told.view((first, first), (rest, rest)).into_owned()));
    let focal_sigma = uncertainty::worst_focal_sigma(covariance, layout, calibration.rig());
    if focal_sigma > WORST_FOCAL_SIGMA
        && lenses_known.is_some_and(|covariance| baseline_mm >= FEWEST * sigma_mm(&covariance, 3))
    {
        return Err(Error::Undetermined {
            one_pose: None,
            focal_sigma: Some(focal_sigma),
            skipped: calibration.skipped.clone(),
        });
    }
    Err(Error::NoBaseline { baseline_mm, sigma_mm: sigma_of_both_mm })
}

/// The rigs without each fold, with covariances that allow for the same as the final one's.
fn folds(calibration: &Calibration) -> Option<Folds> {
    let Calibration { views, values, layout, .. } = calibration;
    let equations = calibration.problem().equations(layout)?;
    let of_pair = cross_validation::folds(views, &values.poses);
    let within = |sure| cross_validation::leave_out(&equations, &equations, layout, &values.shared, &of_pair, sure);
    let mut without = within(WORST_FOCAL_SIGMA);
    let determined = without.iter().any(Option::is_some);
    if !determined {
        without = within(UNTOLD_FOCAL_SIGMA);
    }
    let inflation = calibration.inflation;
    let by_noise = uncertainty::covariance(&equations)? * inflation;
    let more = &calibration.covariance - by_noise;
    let covariance = |w: &Without| {
        let matrix = &w.covariance * inflation + &more;
        RigCovariance::new(&Covariance { order: layout.names(), matrix })
    };
    let rig = |w: Without| FoldRig { covariance: covariance(&w), rig: w.shared.rig, step: w.step };
    Some(Folds { of_pair, rigs: without.into_iter().map(|w| w.map(rig)).collect(), determined })
}

fn summarise(
    calibration: &Calibration,
    folds: Folds,
    measured: &[Measured],
    doubtful: DoubtfulCorners,
    board_mm: Option<f64>,
) -> Option<Accuracy> {
    let board = &calibration.board;
    let largest = |squares: usize, corners: usize| squares.min(corners - 1);
    let short = [SHORT_SQUARES; 2];
    let long = [largest(LONG_SQUARES, board.columns()), largest(LONG_SQUARES, board.rows())];
    let pairs = calibration.views.iter().zip(measured).map(|(view, m)| pair(view, m, short, long)).collect();
    let expansion = Expansion::new(calibration.pair_scatter.groups, board_mm);
    let rays_chi_square = mean(measured.iter().flat_map(|m| &m.points).map(|p| p.chi_square))?;
    let share = rays_chi_square.clamp(f64::MIN_POSITIVE, 1.0);
    let unchecked = calibration.views.iter().enumerate().filter(|(i, _)| !folds.determined || folds.of(*i).is_none());
    let unchecked = unchecked.map(|(_, view)| view.pair.clone()).collect();
    Some(Accuracy {
        extremes: lengths::extremes(measured, |i| Some(&folds.of(i)?.covariance), expansion, share)?,
        rays_chi_square,
        epipolar: epipolar(&folds, measured)?,
        doubtful,
        folds: folds.rigs.len(),
        unchecked,
        fold_steps: folds.rigs.into_iter().flatten().map(|fold| fold.step).collect(),
        short_mm: [0, 1].map(|axis| lengths::as_written_mm(board.spans_mm(short[axis])[axis])),
        long_mm: [0, 1].map(|axis| lengths::as_written_mm(board.spans_mm(long[axis])[axis])),
        ranges: all_ranges(board, measured),
        pairs,
    })
}

/// From the gap between two rays, as large as it looks from the left camera of the rig that measured it; doubtful
/// corners are left out.
fn epipolar(folds: &Folds, measured: &[Measured]) -> Option<EpipolarError> {
    let misses = measured.iter().enumerate().filter_map(|(i, m)| {
        let Camera { fx, fy, .. } = folds.of(i)?.rig.left;
        let focal = (fx * fy).sqrt();
        let sure = m.points.iter().zip(&m.doubtful).filter(|(_, doubtful)| !**doubtful);
        Some(sure.map(move |(p, _)| p.gap_mm.abs() * focal / p.point_mm.z))
    });
    let misses: Vec<f64> = misses.flatten().collect();
    let rms_px = root_mean_square(misses.iter().map(|px| px * px))?;
    Some(EpipolarError { rms_px, max_px: misses.into_iter().fold(0.0, f64::max) })
}

fn pair(view: &View, measured: &Measured, short: [usize; 2], long: [usize; 2]) -> HeldOutPair {
    let mean_of = |axis, squares| mean(measured.errors(axis, squares));
    HeldOutPair {
        pair: view.pair.clone(),
        mean_error_x_short_mm: mean_of(Axis::X, short[0]),
        mean_error_y_short_mm: mean_of(Axis::Y, short[1]),
        mean_error_x_long_mm: mean_of(Axis::X, long[0]),
        mean_error_y_long_mm: mean_of(Axis::Y, long[1]),
        max_abs_error_mm: measured.worst_mm(),
        gap_rms_mm: root_mean_square(measured.points.iter().map(|p| p.gap_mm * p.gap_mm)),
        long_errors_mm: measured.errors(Axis::X, long[0]).chain(measured.errors(Axis::Y, long[1])).collect(),
    }
}
