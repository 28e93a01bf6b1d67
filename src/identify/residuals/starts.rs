//! Where the unknowns of a placement may be, before anything is fitted: how a body is turned on the flange, the anchor
//! of a wire.
//!
//! In: what was measured, and the robot's places. Out: a start that gross errors hardly move, by reweighted least
//! squares. What goes wrong: places on a line leave a turn about it, which stays where the decomposition puts it.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Rotation3, Vector3};

use crate::geometry::{Transform, fitted_frame, nearest_rotation, rotation_matrix};
use crate::identify::model::kinematics::Place;
use crate::identify::sensor::{Length, Spot};
use crate::linear_algebra::{product, solution};
use crate::statistics::median;

/// Rounds of reweighting a first frame.
const FRAME_ROUNDS: usize = 15;

/// The distance below which rows count as if they were as far off: a tenth of the middle one.
fn least_weighed(misses: &[f64]) -> f64 {
    (0.1 * median(misses.iter().copied()).unwrap_or(0.0)).max(1e-9)
}

/// Rounds in which frames and a body's turn are found from each other; they end as soon as the turn stays.
const TURN_ROUNDS: usize = 60;

/// Change of a turn that ends the rounds, rad: a ten-thousandth of a millimetre at a metre.
const TURN_STAYS_RAD: f64 = 1e-7;

/// How the target, or a body of several, is turned on the flange, with the frame of each placement unknown. A pose that
/// shows a part of the body says where it is only once the turn is known, and the turn is known from the frames: they
/// are found from each other until neither moves.
pub(super) fn turn_on_flange(lists: &[Vec<Spot>], places: &[Place]) -> Matrix3<f64> {
    let frames_with = |turn: Option<&Matrix3<f64>>| -> Vec<Transform> {
        lists.iter().map(|spots| robust_frame(spots, places, turn)).collect()
    };
    let mut turn = mean_target(lists, &frames_with(None), places);
    if !lists.iter().flatten().any(|spot| spot.on_body_mm.is_some()) {
        return turn;
    }
    for _ in 0..TURN_ROUNDS {
        let next = mean_target(lists, &frames_with(Some(&turn)), places);
        let change = Rotation3::from_matrix_unchecked(next.transpose() * turn).angle();
        turn = next;
        if change < TURN_STAYS_RAD {
            break;
        }
    }
    turn
}

/// A frame that gross errors hardly move: least sum of distances, by reweighting (Weiszfeld's way). Without a body's
/// turn its mark points come first.
fn robust_frame(spots: &[Spot], places: &[Place], turn: Option<&Matrix3<f64>>) -> Transform {
    let whole: Vec<&Spot> = spots.iter().filter(|spot| spot.on_body_mm.is_none()).collect();
    let spots = if turn.is_none() && whole.len() >= 3 { whole } else { spots.iter().collect() };
    let point = |spot: &Spot| {
        let place = &places[spot.pose];
        let part = turn.zip(spot.on_body_mm).map(|(turn, part)| place.rotation * (turn * part));
        place.point_mm + part.unwrap_or_else(Vector3::zeros)
    };
    let points: Vec<Point3<f64>> = spots.iter().map(|spot| point(spot)).collect();
    let mut weights: Vec<f64> = spots.iter().map(|s| s.weight * s.weight).collect();
    let mut frame = Transform::identity();
    for _ in 0..FRAME_ROUNDS {
        let seen = spots.iter().zip(&points).zip(&weights);
        frame = fitted_frame(seen.map(|((s, point), w)| (*point, s.point_mm, *w)));
        let misses: Vec<f64> =
            spots.iter().zip(&points).map(|(s, point)| (frame * point - s.point_mm).norm()).collect();
        let floor = least_weighed(&misses);
        weights = misses.iter().zip(&spots).map(|(m, s)| s.weight * s.weight / m.max(floor)).collect();
    }
    frame
}

/// Mean of `flange_from_target` over all poses: of those with an orientation, and of those that show a part of the
/// body, which stands in some direction from the mark point.
fn mean_target(lists: &[Vec<Spot>], frames: &[Transform], places: &[Place]) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    for (spots, frame) in lists.iter().zip(frames) {
        let rotation = rotation_matrix(frame);
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
        let solution = solution(&product(&design, &design), &design.tr_mul(&rhs));
        anchor = mean + solution.fixed_rows::<3>(0);
        let misses: Vec<f64> =
            lengths.iter().map(|l| ((places[l.pose].point_mm.coords - anchor).norm() - l.length_mm).abs()).collect();
        let floor = least_weighed(&misses);
        weights = misses.iter().zip(lengths).map(|(m, l)| l.weight / m.max(floor).sqrt()).collect();
    }
    anchor
}
