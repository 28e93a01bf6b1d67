//! Where the unknowns of a placement may be, before anything is fitted: a frame, how a body is turned on the flange, the anchor of a wire.
//!
//! In: what was measured, and the robot's places. Out: a start that gross errors hardly move, by reweighted least squares. What goes wrong: places on
//! a line leave a turn about it, which stays where the decomposition puts it.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};

use crate::geometry::{Transform, fitted_frame, nearest_rotation};
use crate::identify::model::kinematics::Place;
use crate::identify::sensor::{Length, Spot};
use crate::linear_algebra::pseudo_inverse;
use crate::statistics::median;

/// Rounds of reweighting a first frame.
const FRAME_ROUNDS: usize = 15;

/// The distance below which rows count as if they were as far off: a tenth of the middle one.
fn least_weighed(misses: &[f64]) -> f64 {
    (0.1 * median(misses.iter().copied()).unwrap_or(0.0)).max(1e-9)
}

/// A frame that gross errors hardly move: least sum of distances, by reweighting (Weiszfeld's way).
pub(super) fn robust_frame(spots: &[Spot], places: &[Place]) -> Transform {
    // How a body of several targets is turned on the flange is not known yet: its mark points come first.
    let whole: Vec<&Spot> = spots.iter().filter(|spot| spot.on_body_mm.is_none()).collect();
    let spots = if whole.len() >= 3 { whole } else { spots.iter().collect() };
    let mut weights: Vec<f64> = spots.iter().map(|s| s.weight * s.weight).collect();
    let mut frame = Transform::identity();
    for _ in 0..FRAME_ROUNDS {
        frame = fitted_frame(spots.iter().zip(&weights).map(|(s, w)| (places[s.pose].point_mm, s.point_mm, *w)));
        let misses: Vec<f64> = spots.iter().map(|s| (frame * places[s.pose].point_mm - s.point_mm).norm()).collect();
        let floor = least_weighed(&misses);
        weights = misses.iter().zip(&spots).map(|(m, s)| s.weight * s.weight / m.max(floor)).collect();
    }
    frame
}

/// Coordinate by coordinate the median.
pub(super) fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    Vector3::from_fn(|axis, _| median(points.iter().map(|p| p[axis])).unwrap_or(0.0))
}

/// Mean of `flange_from_target` over all poses: of those with an orientation, and of those that show a part of the body, which stands in some
/// direction from the mark point.
pub(super) fn mean_target(lists: &[Vec<Spot>], frames: &[Transform], places: &[Place]) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    for (spots, frame) in lists.iter().zip(frames) {
        let rotation = crate::geometry::rotation_matrix(frame);
        for spot in spots {
            if let Some(measured) = &spot.rotation {
                sum += (rotation * places[spot.pose].rotation).transpose() * measured;
            }
            if let Some(part) = spot.on_body_mm {
                let from_mark = spot.point_mm - frame * places[spot.pose].point_mm;
                let on_flange = (rotation * places[spot.pose].rotation).transpose() * from_mark;
                sum += on_flange * part.transpose() / part.norm_squared().max(f64::MIN_POSITIVE);
            }
        }
    }
    Rotation3::from_matrix_unchecked(nearest_rotation(&sum)).into_inner()
}

/// Rounds of reweighting a first anchor.
const ANCHOR_ROUNDS: usize = 10;

/// Where a wire's anchor may be: |p|^2 - 2 p.c + |c|^2 = L^2 is linear in c and |c|^2; reweighted against gross errors.
pub(super) fn first_anchor(places: &[Place], lengths: &[Length]) -> Vector3<f64> {
    let n = lengths.len();
    let mean = lengths.iter().map(|l| places[l.pose].point_mm.coords).sum::<Vector3<f64>>() / n.max(1) as f64;
    let arm = |l: &Length| places[l.pose].point_mm.coords - mean;
    let mut weights: Vec<f64> = lengths.iter().map(|l| l.weight).collect();
    let mut anchor = mean;
    for _ in 0..ANCHOR_ROUNDS {
        let entry = |r: usize, c: usize| weights[r] * if c < 3 { 2.0 * arm(&lengths[r])[c] } else { 1.0 };
        let design = DMatrix::from_fn(n, 4, entry);
        let rhs =
            DVector::from_fn(n, |r, _| weights[r] * (arm(&lengths[r]).norm_squared() - lengths[r].length_mm.powi(2)));
        let solution = pseudo_inverse(design.tr_mul(&design)) * design.tr_mul(&rhs);
        anchor = mean + solution.fixed_rows::<3>(0);
        let misses: Vec<f64> =
            lengths.iter().map(|l| ((places[l.pose].point_mm.coords - anchor).norm() - l.length_mm).abs()).collect();
        let floor = least_weighed(&misses);
        weights = misses.iter().zip(lengths).map(|(m, l)| l.weight / m.max(floor).sqrt()).collect();
    }
    anchor
}
