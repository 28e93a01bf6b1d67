//! Where every pose's search begins: each pose by itself on the calibrated rig, and how its corners are numbered.
//!
//! A target that looks the same after a quarter or a half turn is numbered by the picture's direction; cameras that are
//! rolled against each other make that wrong in one of them. The rig decides: of the numberings that the colours leave
//! open, the right picture gets the one that fits it best.

use nalgebra::Vector2;
use rayon::prelude::*;

use crate::geometry::Transform;
use crate::imaging::{Board, PairCorners, Side};
use crate::statistics::median;
use crate::stereo::Rig;
use crate::stereo::data::residuals::of_view;
use crate::stereo::data::{Noise, Observation, View};
use crate::stereo::init::board_pose;
use crate::stereo::model::Shared;
use crate::stereo::model::board_shape::FLAT;
use crate::stereo::pairs::numbering;

/// Fewest corners in each picture for six unknowns with something to spare.
pub const FEWEST_CORNERS: usize = 6;

/// A pose before anything is known of the others.
#[derive(Debug, Clone)]
pub(super) struct Start {
    /// Its corners, the right ones renumbered where that was needed.
    pub view: View,
    /// `left_from_board`, where the corners determine it.
    pub pose: Option<Transform>,
    /// Median length of the residuals there, px.
    pub misfit_px: f64,
}

/// A start for every pair, in the same order.
pub(super) fn starts(rig: &Rig, board: &Board, pairs: &[PairCorners]) -> Vec<Start> {
    let shared = Shared { rig: rig.clone(), shape_mm: FLAT };
    let mut views: Vec<View> =
        pairs.par_iter().map(|pair| numbering::seen_on_rig(&shared, board, pair, None)).collect();
    let mut poses: Vec<Option<Transform>> = vec![None; views.len()];
    let left = |(view, pose): (&View, &Option<Transform>)| -> Vec<(Observation, Vector2<f64>)> {
        pose.map_or_else(Vec::new, |pose| of_view(&shared, view, &pose))
    };
    // Twice: the scatter is known only after the first fit.
    for _ in 0..2 {
        let robust = |(view, known): (&View, &Option<Transform>)| match known {
            _ if !enough(view) => None,
            Some(known) => board_pose::refit(&shared, view, *known),
            None => board_pose::fit(&shared, view),
        };
        poses = views.par_iter().zip(&poses).map(robust).collect();
        let left: Vec<_> = views.iter().zip(&poses).flat_map(left).collect();
        Noise::from_median(&left).apply(&mut views);
    }
    let start = |(view, pose): (View, Option<Transform>)| {
        let misfit_px = median(left((&view, &pose)).iter().map(|(_, r)| r.norm())).unwrap_or(f64::INFINITY);
        Start { view, pose, misfit_px }
    };
    views.into_iter().zip(poses).map(start).collect()
}

/// True where both pictures show enough corners.
pub(super) fn enough(view: &View) -> bool {
    Side::BOTH.iter().all(|side| view.active(*side).count() >= FEWEST_CORNERS)
}

/// Median over the poses of the length of `right_from_left` as each camera alone sees the target, over the calibrated
/// one: what the target's size, or the baseline's unit, is off by.
pub(super) fn baseline_ratio(rig: &Rig, views: &[View]) -> Option<f64> {
    let shared = Shared { rig: rig.clone(), shape_mm: FLAT };
    let ratio = |view: &View| {
        let [left, right] = board_pose::of_each_alone(&shared, view);
        let right_from_left = rig.right_from_left * right? * left?.inverse();
        Some(right_from_left.translation.vector.norm() / rig.baseline_mm())
    };
    let ratios: Vec<Option<f64>> = views.par_iter().map(ratio).collect();
    median(ratios.into_iter().flatten())
}
