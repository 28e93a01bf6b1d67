//! The target's place on the flange by touches, with the nominal chain as it is.
//!
//! In: touches of points that stand still, and the nominal robot. Out: the place at which the chain predicts the
//! touches of each point nearest to each other, and how near. That is linear in the place; rows that are far off lose
//! influence by reweighting (least sum of distances). What goes wrong: one orientation of the flange within each point,
//! which says nothing of the place; then there is no answer.

use nalgebra::{Matrix3, Vector3};

use crate::geometry::rotation_matrix;
use crate::identify::data::dataset::Dataset;
use crate::robot::Robot;
use crate::statistics::median;

/// Rounds of reweighting.
const ROUNDS: usize = 20;

/// Eigenvalue of the normal matrix over the number of rows below which a direction of the place is not determined:
/// turns of a mrad.
const LEAST_TURN: f64 = 1e-6;

/// Where the target stands, and what is left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Touched {
    pub tool_mm: Vector3<f64>,
    /// Middle distance of a touch from the middle of its point's touches, mm, with the tool of the file and with this
    /// one.
    pub before_mm: f64,
    pub left_mm: f64,
}

/// The last frame at a touch.
struct Touch {
    point: usize,
    rotation: Matrix3<f64>,
    origin_mm: Vector3<f64>,
    weight: f64,
}

impl Touched {
    /// `None` where nothing was touched, or where the touches do not determine the place.
    pub(super) fn new(set: &Dataset, nominal: &Robot) -> Option<Touched> {
        let touch = |row: usize| {
            let flange = nominal.base_from_flange(&set.poses[row].joints_rad);
            let (rotation, origin_mm) = (rotation_matrix(&flange), flange.translation.vector);
            Touch { point: set.poses[row].group, rotation, origin_mm, weight: 1.0 }
        };
        let mut touches: Vec<Touch> = (0..set.poses.len()).filter(|&row| set.touches(row)).map(touch).collect();
        let before_mm = median(errors_mm(&touches, &nominal.tool_mm))?;
        let (mut tool_mm, mut left_mm) = (nominal.tool_mm, before_mm);
        for _ in 0..ROUNDS {
            tool_mm = solved(&touches)?;
            let errors = errors_mm(&touches, &tool_mm);
            left_mm = median(errors.iter().copied())?;
            let floor = (0.1 * left_mm).max(f64::MIN_POSITIVE);
            touches.iter_mut().zip(errors).for_each(|(touch, error)| touch.weight = left_mm / error.max(floor));
        }
        Some(Touched { tool_mm, before_mm, left_mm })
    }
}

/// Mean rotation and origin of each point's touches, by its index.
fn means(touches: &[Touch]) -> Vec<(Matrix3<f64>, Vector3<f64>)> {
    let points = touches.iter().map(|touch| touch.point + 1).max().unwrap_or(0);
    let mut sums = vec![(Matrix3::zeros(), Vector3::zeros(), 0.0); points];
    for touch in touches {
        let (rotation, origin, weight) = &mut sums[touch.point];
        *rotation += touch.weight * touch.rotation;
        *origin += touch.weight * touch.origin_mm;
        *weight += touch.weight;
    }
    sums.into_iter()
        .map(|(rotation, origin, w)| (rotation / w.max(f64::MIN_POSITIVE), origin / w.max(f64::MIN_POSITIVE)))
        .collect()
}

/// Distances of the touches from the middle of their point's.
fn errors_mm(touches: &[Touch], tool_mm: &Vector3<f64>) -> Vec<f64> {
    let means = means(touches);
    let error = |touch: &Touch| {
        let (rotation, origin) = &means[touch.point];
        ((touch.rotation - rotation) * tool_mm + touch.origin_mm - origin).norm()
    };
    touches.iter().map(error).collect()
}

/// The place that brings the touches of each point together best.
fn solved(touches: &[Touch]) -> Option<Vector3<f64>> {
    let means = means(touches);
    let (mut normal, mut pull) = (Matrix3::zeros(), Vector3::zeros());
    for touch in touches {
        let (rotation, origin) = &means[touch.point];
        let turn = touch.rotation - rotation;
        normal += touch.weight * turn.transpose() * turn;
        pull -= touch.weight * turn.transpose() * (touch.origin_mm - origin);
    }
    let weight: f64 = touches.iter().map(|touch| touch.weight).sum();
    let is_determined = normal.symmetric_eigenvalues().min() > LEAST_TURN * weight;
    is_determined.then(|| normal.cholesky().map(|c| c.solve(&pull))).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;

    #[test]
    fn a_tool_that_the_file_has_elsewhere_is_found_by_touches() {
        for seed in 1..4 {
            let (world, _) = synthetic::touched(0.0, seed);
            let set = Dataset::new(&world.rows).unwrap();
            let as_is = Touched::new(&set, &world.nominal).unwrap();
            for off_mm in [1.0, 20.0, 200.0] {
                let mut nominal = world.nominal.clone();
                nominal.tool_mm += Vector3::new(off_mm, -off_mm, 0.5 * off_mm);
                let found = Touched::new(&set, &nominal).unwrap();
                assert!((found.tool_mm - as_is.tool_mm).norm() < 1e-6 && (found.left_mm - as_is.left_mm).abs() < 1e-6);
                assert!(off_mm < 20.0 || found.before_mm > 5.0 * found.left_mm, "{off_mm}: {found:?}");
            }
            // One orientation tells nothing.
            let (mut one, joints_deg) = (world.rows.clone(), &world.rows[0].at.joints_deg);
            one.iter_mut().for_each(|row| row.at.joints_deg.clone_from(joints_deg));
            let set = Dataset::new(&one).unwrap();
            assert_eq!(Touched::new(&set, &world.nominal), None);
        }
    }
}
