//! Whether the rig is the one that was calibrated and the target the one that was described; what changed if not, and
//! how far that reaches into the points.
//!
//! Every [`Cause`] is fitted with nothing known of it beforehand; the most likely one is named with its equals. A
//! change that moves the points by less than the tolerance, or than their own uncertainty allows, goes into their
//! covariance: the calibration is believed only as far as the change reaches. A larger one ends the run.

use nalgebra::Vector3;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::geometry::Transform;
use crate::statistics::median;
use crate::stereo::board_pose::rig_change::cause::{Cause, Explanation, explanations, growing, shifts_mm, stretch};
use crate::stereo::board_pose::solve::bundle::{Bundle, Values};
use crate::stereo::board_pose::solve::estimate::{Estimate, Usual, estimate};
use crate::stereo::board_pose::solve::prior::{bent_modes, stretch_length_mm};
use crate::stereo::data::residuals::root_mean_square;

/// A cause that lowers chi-square by less than this is chance, where the scatter of the poses is known before: four
/// standard deviations.
const CHANCE: f64 = 16.0;

/// The probability of that.
const CHANCE_PROBABILITY: f64 = 6.3e-5;

/// Causes whose score reaches this share of the best one's are fitted.
const COMPETES: f64 = 0.05;

/// Causes whose likelihood is this near to the best one's (twice its logarithm) explain as well.
const AS_LIKELY: f64 = 9.0;

/// Poses on which causes are compared: enough for any, and cheap.
const COMPARED_ON: usize = 48;

/// Whitened squares beyond this count as this much in the likelihood: outliers.
const MOST_SQUARE: f64 = 28.0;

/// Chi-square of three degrees of freedom that 95 % of all points stay below: a shift beyond it is more than a point's
/// uncertainty allows.
pub(in crate::stereo::board_pose) const ALLOWED: f64 = 7.815;

/// What is found of the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Changed {
    /// What explains it, the most likely first; the others are as likely.
    pub explanations: Vec<Explanation>,
    /// By how much the points move with it, root mean square, mm.
    pub moves_mm: f64,
    /// By how much that exceeds their uncertainty: chi-square with three degrees of freedom, the median over the poses.
    pub beyond: f64,
    /// By how much the points are off if it is the rig that is scaled and not the target, mm, where that is more and
    /// their covariance does not allow for it.
    pub scaled_mm: Option<f64>,
}

/// Names what changed, where more than chance did; and the estimate to go on with, in which the change is allowed for.
pub(in crate::stereo::board_pose) fn judge<'a>(found: Estimate<'a>, usual: Usual) -> (Estimate<'a>, Option<Changed>) {
    let scores = explanations(&found);
    let best = scores.iter().map(|e| e.fall).fold(0.0, f64::max);
    if best <= chance(&found, usual) {
        return (found, None);
    }
    let some = subset(&found);
    let fit = |score: &Explanation| {
        let fit = with_cause(&some, score, f64::INFINITY, usual)?;
        let amount = match score.cause {
            Cause::Pitch => stretch(&fit)[0],
            _ => *fit.values.rig.as_slice().last()?,
        };
        Some((deviance(&fit), Explanation { amount, ..*score }))
    };
    let mut fitted: Vec<(f64, Explanation)> =
        scores.iter().filter(|e| e.fall >= COMPETES * best).filter_map(fit).collect();
    fitted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(&(least, first)) = fitted.first() else { return (found, None) };
    let equals = fitted.iter().filter(|(d, _)| d - least <= AS_LIKELY).map(|(_, e)| *e).collect();
    let equals = with_growing(&found, best, equals);
    // The change is allowed for as something of the rig: with a pitch that is off instead, the points stay where they
    // are.
    let on_rig = fitted.iter().map(|(_, e)| e).find(|e| e.cause != Cause::Pitch).unwrap_or(&first);
    let known = on_rig.amount.powi(2).max(f64::MIN_POSITIVE);
    let Some(free) = with_cause(&found, on_rig, f64::INFINITY, usual) else { return (found, None) };
    let by = |shifts_mm: &[Option<Vector3<f64>>]| {
        let moves_mm = root_mean_square(shifts_mm.iter().flatten().map(|shift| shift.norm_squared())).unwrap_or(0.0);
        (moves_mm, beyond(&found, &free, shifts_mm))
    };
    let (moves_mm, beyond) = by(&shifts_mm(&found, &free));
    // A target that is larger and a rig that is smaller by one share look the same, whatever became of the fit with the
    // latter.
    let if_scaled = || {
        let scaled = |pose: &Transform| pose.translation.vector * (first.amount / (1.0 + first.amount));
        by(&found.values.poses.iter().map(|pose| pose.as_ref().map(scaled)).collect::<Vec<_>>())
    };
    let scaled = (first.cause == Cause::Pitch).then(if_scaled);
    let scaled_mm = scaled.filter(|(mm, beyond)| *beyond > ALLOWED && *mm > 2.0 * moves_mm).map(|(mm, _)| mm);
    let changed = Changed { explanations: equals, moves_mm, beyond, scaled_mm };
    match with_cause(&found, on_rig, known, usual) {
        Some(allowed) => (allowed, Some(changed)),
        None => (free, Some(changed)),
    }
}

/// The causes with those that grow along the run before them, where one of those explains more than any that the whole
/// run has: `best` is by how much the best of these lowers chi-square.
fn with_growing(found: &Estimate<'_>, best: f64, equals: Vec<Explanation>) -> Vec<Explanation> {
    let mut growing = growing(found).unwrap_or_default();
    growing.sort_by(|a, b| b.fall.total_cmp(&a.fall));
    let Some(most) = growing.first().map(|e| e.fall).filter(|most| *most > best) else { return equals };
    growing.retain(|e| most - e.fall <= AS_LIKELY);
    growing.extend(equals.into_iter().filter(|_| most - best <= AS_LIKELY));
    growing
}

/// By how much chance alone lowers chi-square. Where the poses scatter more than the pairs of the calibration did, by
/// how much is known from as many poses as there are: the limit is then that of F.
fn chance(found: &Estimate<'_>, usual: Usual) -> f64 {
    let poses = found.values.poses.iter().flatten().count() as f64;
    let own = found.excess > usual.excess_here(&found.noise, &found.bundle.views).max(1.0);
    let limit = FisherSnedecor::new(1.0, poses - 1.0).map(|f| f.inverse_cdf(1.0 - CHANCE_PROBABILITY));
    limit.ok().filter(|_| own).map_or(CHANCE, |limit| limit.max(CHANCE))
}

/// By how much the points move between two minima, in units of what the second leaves open of each and the first of
/// what they share.
fn beyond(known: &Estimate<'_>, free: &Estimate<'_>, shifts_mm: &[Option<Vector3<f64>>]) -> f64 {
    let each = shifts_mm.iter().enumerate().filter_map(|(i, shift_mm)| free.beyond(known, i, shift_mm.as_ref()?));
    median(each).unwrap_or(0.0)
}

/// Some of the poses, evenly spread.
fn subset<'a>(found: &Estimate<'a>) -> Estimate<'a> {
    let present: Vec<usize> = (0..found.values.poses.len()).filter(|&i| found.values.poses[i].is_some()).collect();
    if present.len() <= COMPARED_ON {
        return found.clone();
    }
    let mut some = found.clone();
    some.values.poses.iter_mut().for_each(|pose| *pose = None);
    for k in 0..COMPARED_ON {
        let i = present[k * present.len() / COMPARED_ON];
        some.values.poses[i] = found.values.poses[i];
    }
    some
}

/// The minimum with a cause that has this variance before.
fn with_cause<'a>(found: &Estimate<'a>, cause: &Explanation, variance: f64, usual: Usual) -> Option<Estimate<'a>> {
    let mut bundle = found.bundle.clone();
    let mut values = found.values.clone();
    // From the rig that was calibrated: what a fit without the cause made of the rig is far off where a lens leaves
    // much open.
    values.rig.fill(0.0);
    match cause.cause.direction(&bundle.rig.rig_at(&values.rig)) {
        Some(direction) => {
            bundle.rig = bundle.rig.with_change(&direction, variance);
            let n = values.rig.len();
            values.rig = values.rig.insert_row(n, 0.0);
        }
        None => {
            bundle.shape.stretch_mm = bundle.shape.stretch_mm.hypot(variance.sqrt() * stretch_length_mm(bundle.board));
        }
    }
    estimate(bundle, values, usual, Some(found.excess))
}

/// Minus twice the logarithm of the likelihood, but for a constant: corners and what was known before.
fn deviance(fit: &Estimate<'_>) -> f64 {
    let scene = fit.bundle.scene(&fit.values);
    let mut sum = 0.0;
    for (view, pose) in fit.bundle.views.iter().zip(&fit.values.poses) {
        let Some(pose) = pose else { continue };
        for o in &view.observations {
            let square = scene.residual(pose, o).map_or(MOST_SQUARE, |r| o.whiten(r).norm_squared());
            sum += square.min(MOST_SQUARE) - 2.0 * o.whitener.determinant().abs().ln();
        }
    }
    let shared = Bundle::shared(&fit.values);
    sum + shared.dot(&(&fit.normal.weights * &shared)) + shape_evidence(fit)
}

/// What the width of the crossings' prior costs: without it a print that is assumed to be rough would explain anything.
fn shape_evidence(fit: &Estimate<'_>) -> f64 {
    let (n, m) = (fit.values.rig.len(), 3 * fit.values.deviations_mm.len());
    let block = (&fit.normal.told.matrix + &fit.normal.weights).view((n, n), (m, m)).into_owned();
    let mut values: Vec<f64> = block.symmetric_eigenvalues().iter().copied().collect();
    values.sort_by(f64::total_cmp);
    // The largest six hold the frame.
    let told: f64 = values[..m.saturating_sub(6)].iter().map(|v| v.max(f64::MIN_POSITIVE).ln()).sum();
    let (flat, deep) = (fit.bundle.shape.in_plane_mm, fit.bundle.shape.out_of_plane_mm);
    let bent = bent_modes(fit.bundle.board).len() as f64 * (fit.bundle.shape.bent_mm / deep).ln();
    told + 2.0 * ((2.0 * flat.ln() + deep.ln()) * (m as f64 / 3.0) + bent)
}

/// Values for a target whose size is off by a large factor: every pose scaled with it.
pub(in crate::stereo::board_pose) fn scaled(values: &Values, bundle: &Bundle<'_>, factor: f64) -> Values {
    let mut next = values.clone();
    for (deviation, at) in next.deviations_mm.iter_mut().zip(bundle.board.corners_mm()) {
        *deviation = at.coords * (factor - 1.0);
    }
    for pose in next.poses.iter_mut().flatten() {
        pose.translation.vector *= factor;
    }
    next
}
