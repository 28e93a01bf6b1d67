//! The pose of the target on a rig that is known, with what makes it uncertain.
//!
//! In: a rig and the corners of every robot pose. Out: `cam_from_board`, its covariance, and the residual, or why there is none.
//! Method: each pose by a robust two-view bundle; the scatter of the corners pooled over all poses; then least squares without
//! outliers. The covariance is the corners' plus the calibration's share, carried through the rig's covariance where that is known.
//! Goes wrong: few corners, a calibration that does not suit the pictures (large residuals in all poses).

use nalgebra::{DMatrix, Matrix6, Vector2, Vector3};
use rayon::prelude::*;

use super::Rig;
use super::layout::{Layout, Shared};
use super::neighbours::NeighbourCorrelation;
use super::noise::Noise;
use super::observations::{Observation, Side, View};
use super::pose;
use super::residuals::{of_view, residual_px, root_mean_square};
use super::rig::Covariance;
use super::robust::Loss;
use super::schur;
use super::start::CAUCHY_WIDTH;
use super::triangulate::{common, triangulate};
use crate::geometry::{Transform, transform};
use crate::imaging::{Board, PairCorners};

/// Whitened residuals beyond this are outliers.
const OUTLIER: f64 = 5.3;

/// Fewest corners in each picture for six unknowns with something to spare.
pub const FEWEST_CORNERS: usize = 6;

/// The target at one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct TargetPose {
    /// `cam_from_board`: the left camera is the camera.
    pub cam_from_board: Transform,
    /// Covariance: rotation (rad), then translation (mm).
    pub covariance: Matrix6<f64>,
    /// Root mean square distance of the triangulated corners from the fitted board, mm.
    pub fit_rms_mm: f64,
    /// Root mean square of the length of the 2-D residuals, px.
    pub rms_px: f64,
    /// Corners used, both pictures together.
    pub corners: usize,
}

/// Measures the target at every pose; the answer has one entry a pair, in the same order.
pub fn measure(rig: &Rig, board: &Board, pairs: &[PairCorners]) -> Vec<Result<TargetPose, String>> {
    let shared = Shared { rig: rig.clone(), shape_mm: [0.0; 2] };
    let mut views: Vec<View> = pairs.iter().map(|pair| View::new(board, pair, FEWEST_CORNERS)).collect();
    let robust = |view: &View| pose::fit(&shared, view, Loss::Cauchy(CAUCHY_WIDTH)).map(|fit| fit.left_from_board);
    let mut starts: Vec<Option<Transform>> = Vec::new();
    // Twice: the scatter is known only after the first fit.
    for _ in 0..2 {
        starts = views.par_iter().map(|view| if enough(view) { robust(view) } else { None }).collect();
        let left: Vec<(Observation, Vector2<f64>)> = views
            .iter()
            .zip(&starts)
            .filter_map(|(view, pose)| Some((view, (*pose)?)))
            .flat_map(|(view, pose)| of_view(&shared, view, &pose))
            .collect();
        Noise::from_median(&left).apply(&mut views);
    }
    let inflation = neighbours(&shared, board, &views, &starts).inflation();
    views.par_iter().zip(&starts).map(|(view, start)| finish(&shared, view, start.as_ref(), inflation)).collect()
}

/// How neighbouring corners hang together over all poses, outliers left out.
fn neighbours(shared: &Shared, board: &Board, views: &[View], starts: &[Option<Transform>]) -> NeighbourCorrelation {
    let inliers = |(view, start): (&View, &Option<Transform>)| {
        let all = start.map_or_else(Vec::new, |pose| of_view(shared, view, &pose));
        all.into_iter().filter(|(o, r)| o.whiten(*r).norm() <= OUTLIER).collect()
    };
    NeighbourCorrelation::of(board, views.iter().zip(starts).map(inliers))
}

fn enough(view: &View) -> bool {
    Side::BOTH.iter().all(|side| view.active(*side).count() >= FEWEST_CORNERS)
}

/// Least squares without outliers, and the covariance. `inflation` allows for what neighbouring corners share.
fn finish(shared: &Shared, view: &View, start: Option<&Transform>, inflation: f64) -> Result<TargetPose, String> {
    let [left, right] = Side::BOTH.map(|side| view.active(side).count());
    if !enough(view) {
        return Err(format!("too few corners: {left} left, {right} right, at least {FEWEST_CORNERS} each"));
    }
    let singular = || "the corners do not determine a pose".to_owned();
    let mut pose = *start.ok_or_else(singular)?;
    let mut view = view.clone();
    for _ in 0..3 {
        for o in &mut view.observations {
            o.active = residual_px(shared, &pose, o).is_some_and(|r| o.whiten(r).norm() <= OUTLIER);
        }
        if !enough(&view) {
            return Err("left and right do not show the same board: most corners miss the rig's prediction".to_owned());
        }
        pose = pose::refine(shared, &view, pose, Loss::Squared).ok_or_else(singular)?.left_from_board;
    }
    let left = of_view(shared, &view, &pose);
    let chi: f64 = left.iter().map(|(o, r)| o.whiten(*r).norm_squared()).sum();
    let reduced = chi / (2.0 * left.len() as f64 - 6.0).max(1.0);
    let own = pose::covariance(shared, &view, &pose).ok_or_else(singular)?;
    // A pose that fits worse than the others (blurred, far away) is worth less; one that fits better by chance is not worth more.
    let covariance =
        own * (inflation * reduced.max(1.0)) + calibration_share(shared, &view, &pose).unwrap_or_else(Matrix6::zeros);
    let squares: Vec<f64> = left.iter().map(|(_, r)| r.norm_squared()).collect();
    Ok(TargetPose {
        cam_from_board: pose,
        covariance,
        fit_rms_mm: fit_rms_mm(&shared.rig, &view, &pose).unwrap_or(f64::NAN),
        rms_px: root_mean_square(&squares).unwrap_or(0.0),
        corners: left.len(),
    })
}

/// Root mean square distance of the triangulated corners from their places on the fitted board, mm.
fn fit_rms_mm(rig: &Rig, view: &View, pose: &Transform) -> Option<f64> {
    let squares: Vec<f64> = common(view)
        .into_iter()
        .filter_map(|(l, r)| Some((triangulate(rig, l, r)?.point_mm - pose * l.board_mm).norm_squared()))
        .collect();
    root_mean_square(&squares)
}

/// What the rig's own uncertainty does to the pose: `S Cov S'` with `S = -C^-1 B'` of the normal equations.
/// `None` where the rig carries no covariance.
fn calibration_share(shared: &Shared, view: &View, pose: &Transform) -> Option<Matrix6<f64>> {
    let rig = &shared.rig;
    let layout = Layout { left: Some(rig.left.lens), right: Some(rig.right.lens), transform: true, shape: false };
    let covariance = ordered(rig.covariance.as_ref()?, &layout.names());
    let block = schur::block(shared, &layout, pose, view, Loss::Squared)?;
    let by_rig = -(block.pose_inverse(0.0)? * block.mixed.transpose());
    let share = &by_rig * covariance * by_rig.transpose();
    Some(Matrix6::from_fn(|i, j| share[(i, j)]))
}

/// The covariance of these names; a name it does not know was not free and has none.
fn ordered(covariance: &Covariance, names: &[String]) -> DMatrix<f64> {
    let at: Vec<Option<usize>> = names.iter().map(|n| covariance.order.iter().position(|o| o == n)).collect();
    DMatrix::from_fn(names.len(), names.len(), |i, j| match (at[i], at[j]) {
        (Some(i), Some(j)) => covariance.matrix[(i, j)],
        _ => 0.0,
    })
}

/// Turns a pose by 180 degrees in the board's plane where that brings its x axis nearer to a reference's: a board that looks the same
/// after a half turn leaves it open, and neighbouring poses of a robot do not differ by it.
pub fn nearest_half_turn(board: &Board, reference: &Transform, pose: &TargetPose) -> TargetPose {
    let axis = |t: &Transform| t.rotation * Vector3::x();
    let mut turned = pose.clone();
    if board.looks_the_same_after_half_turn() && axis(reference).dot(&axis(&pose.cam_from_board)) < 0.0 {
        turned.cam_from_board *= transform(Vector3::z() * std::f64::consts::PI, Vector3::zeros());
    }
    turned
}
