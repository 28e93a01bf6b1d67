//! The bundle with its weights: how far corners scatter and how far the target's crossings deviate are found with the
//! values.
//!
//! In: a bundle and a start. Out: the minimum with weights that its own residuals bear out. Method: robust rounds
//! first; then least squares without outliers, in turn with the corners' noise (reduced chi-square one) and with the
//! variance components of the crossings (MacKay's fixed point, the same as restricted maximum likelihood at its end).
//! Goes wrong: one or two poses cannot tell print from noise; then the calibration's noise is taken.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};
use rayon::prelude::*;

use crate::geometry::Transform;
use crate::statistics::median;
use crate::stereo::board_pose::rig_change::consistency::{at_each, usual_excess};
use crate::stereo::board_pose::solve::bundle::{Bundle, Normal, Promise, Values};
use crate::stereo::board_pose::solve::edge_bend::edge_bends_mm;
use crate::stereo::board_pose::solve::pose_block::OUTLIER;
use crate::stereo::board_pose::solve::prior::{bent_modes, stretch_mode, weights};
use crate::stereo::board_pose::start::enough;
use crate::stereo::data::corner_noise::whitener;
use crate::stereo::data::{NeighbourCorrelation, Noise, Observation, View};
use crate::stereo::solve::Loss;
use crate::stereo::solve::uncertainty::invert;

/// Rounds of least squares with new weights.
const ROUNDS: usize = 6;

/// Weights that change by less than this share have settled.
const SETTLED: f64 = 0.01;

/// Fewest poses that tell a target's print from noise.
pub const TELLING_POSES: usize = 3;

/// The certificate counts as much as this many crossings' worth of evidence on how far crossings deviate.
const CERTIFICATE_COUNT: f64 = 0.1;

/// Smallest deviation that is told from none, mm.
const SMALLEST_MM: f64 = 1e-6;

/// Median length of a corner's whitened residual.
const MEDIAN_MISS: f64 = 1.177;

/// Steps of the fixed point.
const FIXED_POINT_STEPS: usize = 30;

/// A minimum with its weights.
#[derive(Debug, Clone)]
pub struct Estimate<'a> {
    /// The problem with the whiteners, the outliers and the shape's prior that were found.
    pub bundle: Bundle<'a>,
    pub values: Values,
    /// The normal equations there.
    pub normal: Normal,
    /// Covariance of the shared unknowns.
    pub covariance: DMatrix<f64>,
    pub noise: Noise,
    /// How much larger the usual disagreement of a pose with the common rig is than its corners' scatter allows, as a
    /// variance.
    pub excess: f64,
    /// Factor on covariances for the information that neighbouring corners share, and the poses' excess; the whiteners
    /// hold it.
    pub inflation: f64,
}

/// What pictures of the rig did at its calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Usual {
    /// How corners scattered, where that is known.
    pub noise: Option<Noise>,
    /// How far pairs scattered about the rig beyond that, as [`Estimate::excess`]; one where that is not known.
    pub excess: f64,
}

impl Usual {
    /// The excess in units of the noise that is found here.
    pub fn excess_here(&self, here: &Noise, views: &[View]) -> f64 {
        self.noise.map_or(1.0, |noise| self.excess * (noise.typical_px(views) / here.typical_px(views)).powi(2))
    }
}

/// The minimum roughly, by a loss that gross corners hardly move. The size of the board is free meanwhile: a target of
/// quite another size, held to its own, would be seen as one whose edges all bend.
fn roughly(bundle: &mut Bundle, mut values: Values) -> Option<Values> {
    let stretch_mm = std::mem::replace(&mut bundle.shape.stretch_mm, f64::INFINITY);
    for _ in 0..2 {
        let noise = Noise::from_median(&residuals(bundle, &values, |_| true).concat());
        bundle.weigh(&values, &noise);
        values = bundle.solve(values, Loss::Cauchy, Promise::ROUGH)?.0;
    }
    bundle.shape.stretch_mm = stretch_mm;
    Some(values)
}

/// Finds the minimum. `usual` is what counts at least; `excess` is held where it is known. `None` where the
/// corners do not determine the poses.
pub fn estimate<'a>(
    mut bundle: Bundle<'a>,
    start: Values,
    usual: Usual,
    known_excess: Option<f64>,
) -> Option<Estimate<'a>> {
    let certificate = bundle.shape;
    let mut values = roughly(&mut bundle, start)?;
    let poses = values.poses.iter().flatten().count();
    let mut noise = at_least(usual.noise, Noise::from_median(&residuals(&bundle, &values, |_| true).concat()));
    let usual_excess_here = usual.excess_here(&noise, &bundle.views).max(1.0);
    let (mut inflation, mut excess) = (1.0, known_excess.unwrap_or(usual_excess_here));
    let mut normal = bundle.normal(&values, Loss::Squared)?;
    let mut covariance = DMatrix::zeros(0, 0);
    for round in 0..ROUNDS {
        if round > 0 && poses >= TELLING_POSES {
            let told = told_of_crossings(&normal, &covariance, values.rig.len());
            bundle.unbend(&mut values, &told);
        }
        bundle.weigh(&values, &noise);
        bundle.mark_outliers(&mut values, excess);
        let by = 1.0 / (inflation * excess).sqrt();
        bundle.views.iter_mut().flat_map(|view| &mut view.observations).for_each(|o| o.whitener *= by);
        (values, normal) = bundle.solve(values, Loss::Squared, Promise::RESULT)?;
        covariance = invert(&(&normal.told.matrix + &normal.weights))?;
        let before = (noise, bundle.shape.in_plane_mm, bundle.shape.out_of_plane_mm, excess);
        if known_excess.is_none() {
            excess = (excess * usual_excess(&at_each(&normal, &covariance)))
                .max(usual.excess_here(&noise, &bundle.views))
                .max(1.0);
        }
        if poses >= TELLING_POSES {
            settle_shape(&mut bundle, &values, (&normal, &covariance), certificate.in_plane_mm)?;
            bundle.edge_bends_mm = edge_bends_mm(&bundle, &values, &noise);
        }
        // How many of the shared unknowns the corners determine rather than what was known before.
        let told = covariance.component_mul(&normal.told.matrix).sum();
        let active = residuals(&bundle, &values, |o| o.active);
        noise = match usual.noise {
            Some(usual) if poses < TELLING_POSES => usual,
            _ => {
                let unknowns = (told + 6.0 * poses as f64).round() as usize;
                at_least(usual.noise, Noise::from_mean(&active.concat(), unknowns))
            }
        };
        inflation = NeighbourCorrelation::of(active.into_iter()).inflation();
        let close = |a: f64, b: f64| (a - b).abs() <= SETTLED * b.abs().max(1e-5);
        let settled = close(before.0.added_px, noise.added_px)
            && close(before.0.factor, noise.factor)
            && close(before.1, bundle.shape.in_plane_mm)
            && close(before.2, bundle.shape.out_of_plane_mm)
            && close(before.3, excess);
        if settled && round > 0 {
            break;
        }
    }
    Some(Estimate { bundle, values, normal, covariance, noise, excess, inflation: inflation * excess })
}

impl Estimate<'_> {
    /// Covariance of a pose's point without what all poses share, mm^2.
    fn own_point_mm2(&self, i: usize) -> Option<Matrix3<f64>> {
        let own = self.normal.poses[i].as_ref()?.own_covariance(self.excess);
        Some(own.fixed_view::<3, 3>(3, 3).into_owned())
    }

    /// Standard deviation of that along its longest axis, mm.
    pub fn own_sigma_mm(&self, i: usize) -> Option<f64> {
        Some(self.own_point_mm2(i)?.symmetric_eigenvalues().max().max(0.0).sqrt())
    }

    /// By how much a shift of a pose's point exceeds its uncertainty, as chi-square with three degrees of freedom: its
    /// own, and what `known` leaves open of all that the poses share.
    pub fn beyond(&self, known: &Estimate<'_>, i: usize, shift_mm: &Vector3<f64>) -> Option<f64> {
        let by_shared = known.normal.poses[i].as_ref()?.by_shared().fixed_rows::<3>(3).into_owned();
        let covariance = self.own_point_mm2(i)? + &by_shared * &known.covariance * by_shared.transpose();
        Some(shift_mm.dot(&(covariance.try_inverse()? * shift_mm)))
    }
}

/// Leaves out the corners of a pose that miss their prediction by more than chance allows; `miss` is in standard
/// deviations of their noise. A pose that misses the rig as a whole, as the usual one does with this
/// [`Estimate::excess`], has no more outliers for it.
pub fn leave_outliers_out(view: &mut View, miss: impl Fn(&Observation) -> Option<f64>, excess: f64) {
    let misses: Vec<Option<f64>> = view.observations.iter().map(miss).collect();
    let whole = median(misses.iter().flatten().copied()).unwrap_or(0.0) / MEDIAN_MISS;
    let allowed = OUTLIER * whole.clamp(1.0, excess.max(1.0).sqrt());
    for (o, miss) in view.observations.iter_mut().zip(misses) {
        o.active = miss.is_some_and(|miss| miss <= allowed);
    }
}

/// How much of each crossing's place, which are the shared unknowns from `first` on, its corners determine rather than
/// what was known before, from none to one.
fn told_of_crossings(normal: &Normal, covariance: &DMatrix<f64>, first: usize) -> Vec<Vector3<f64>> {
    let told = covariance.component_mul(&normal.told.matrix).column_sum();
    told.as_slice()[first..]
        .chunks_exact(3)
        .map(|d| Vector3::new(d[0], d[1], d[2]).map(|t| t.clamp(0.0, 1.0)))
        .collect()
}

/// Residuals in px of the corners that are wanted, where they can be predicted, by pose.
fn residuals(
    bundle: &Bundle<'_>,
    values: &Values,
    wanted: impl Fn(&Observation) -> bool + Sync,
) -> Vec<Vec<(Observation, Vector2<f64>)>> {
    let scene = bundle.scene(values);
    let of = |(view, pose): (&View, &Option<Transform>)| -> Vec<_> {
        let Some(pose) = pose else { return Vec::new() };
        let wanted = view.observations.iter().filter(|o| wanted(o));
        let with_residual = |o: &Observation| {
            let depth_mm = (pose * scene.crossing(o)).z;
            Some((bundle.with_edge_bend(&scene.rig, depth_mm, o), scene.residual(pose, o)?))
        };
        wanted.filter_map(with_residual).collect()
    };
    bundle.views.par_iter().zip(&values.poses).map(of).collect()
}

/// What corners scatter here, but not less than at the calibration: what its lenses and its board left over is not the
/// noise of pictures, and the target's crossings would be taken for it.
fn at_least(usual: Option<Noise>, here: Noise) -> Noise {
    let added_px = usual.map_or(0.0, |usual| usual.added_px).max(here.added_px);
    Noise { added_px, ..here }
}

impl Bundle<'_> {
    /// Sets the whiteners of all corners: their noise and what bent edges add.
    fn weigh(&mut self, values: &Values, noise: &Noise) {
        let scene = self.scene(values);
        // A pose that takes no part is about as far away as the others.
        let usual_mm =
            median(values.poses.iter().flatten().map(|pose| pose.translation.vector.z)).unwrap_or(f64::INFINITY);
        let mut views = std::mem::take(&mut self.views);
        views.par_iter_mut().zip(&values.poses).for_each(|(view, pose)| {
            for o in &mut view.observations {
                let depth_mm = pose.map_or(usual_mm, |pose| (pose * scene.crossing(o)).z);
                o.whitener = whitener(&noise.covariance(&self.with_edge_bend(&scene.rig, depth_mm, o)));
            }
        });
        self.views = views;
    }

    /// Corners that miss their prediction by more than chance allows are out; the whiteners hold the noise alone.
    /// A pose with too few left takes no part.
    fn mark_outliers(&mut self, values: &mut Values, excess: f64) {
        let scene = self.scene(values);
        self.views.par_iter_mut().zip(&mut values.poses).for_each(|(view, place)| {
            let Some(pose) = place else { return };
            let miss = |o: &Observation| Some(o.whiten(scene.residual(pose, o)?).norm());
            leave_outliers_out(view, miss, excess);
            if !enough(view) {
                *place = None;
            }
        });
    }
}

/// Finds how far the crossings deviate in the plane and out of it, and how far the target as a whole is bent,
/// everything else as linearised; with the covariance of the shared unknowns as the deviations were thought to be
/// before.
fn settle_shape(
    bundle: &mut Bundle<'_>,
    values: &Values,
    (normal, covariance): (&Normal, &DMatrix<f64>),
    certificate_mm: f64,
) -> Option<()> {
    let n = values.rig.len();
    let m = 3 * values.deviations_mm.len();
    let stretch = stretch_mode(bundle.board);
    let crossings = values.deviations_mm.len() as f64;
    // Shifts, turns, tilts and the stretch are not the print's.
    let bent = bent_modes(bundle.board);
    let ways = bent.len() as f64;
    let free = [2.0 * crossings - 4.0, crossings - 3.0 - ways, ways];
    let right = &normal.told.matrix * Bundle::shared(values) - &normal.told.gradient;
    let mut covariance = Cow::Borrowed(covariance);
    for _ in 0..FIXED_POINT_STEPS {
        let before = [bundle.shape.in_plane_mm, bundle.shape.out_of_plane_mm, bundle.shape.bent_mm];
        let shape: DVector<f64> = (covariance.as_ref() * &right).rows(n, m).into_owned();
        let block = covariance.view((n, n), (m, m));
        let along = stretch.dot(&shape);
        let square: f64 = bent.iter().map(|way| way.dot(&shape).powi(2)).sum();
        let trace: f64 = bent.iter().map(|way| way.dot(&(block * way))).sum();
        let mut squares = [-along * along, -square, square];
        let mut traces = [-stretch.dot(&(block * &stretch)), -trace, trace];
        for i in 0..m {
            squares[usize::from(i % 3 == 2)] += shape[i] * shape[i];
            traces[usize::from(i % 3 == 2)] += block[(i, i)];
        }
        let settle = |k: usize| {
            let told = (free[k] - traces[k] / before[k].powi(2)).clamp(0.0, free[k].max(0.0));
            let sum = squares[k].max(0.0) + CERTIFICATE_COUNT * certificate_mm.powi(2);
            (sum / (told + CERTIFICATE_COUNT)).sqrt().max(SMALLEST_MM)
        };
        let next = [settle(0), settle(1), settle(2)];
        [bundle.shape.in_plane_mm, bundle.shape.out_of_plane_mm, bundle.shape.bent_mm] = next;
        if next.iter().zip(before).all(|(next, before)| (next / before - 1.0).abs() < SETTLED) {
            break;
        }
        let weights = weights(&bundle.rig, &bundle.shape, bundle.board, &normal.told.matrix);
        covariance = Cow::Owned(invert(&(&normal.told.matrix + weights))?);
    }
    Some(())
}
