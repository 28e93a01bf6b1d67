//! Where the right camera stands, from the poses that each camera alone gives the boards.

use crate::geometry::{Transform, rotation_vector};

/// How far two rigs are apart: the angle between the rotations plus the distance of the translations in units of the
/// boards' distance.
pub fn deviation(a: &Transform, b: &Transform, distance_mm: f64) -> f64 {
    rotation_vector(&(a.inverse() * b)).norm()
        + (a.translation.vector - b.translation.vector).norm() / distance_mm.max(f64::MIN_POSITIVE)
}

/// The `right_from_left` that the pairs agree on: the one whose deviation from all pairs is smallest in the median. A pair may
/// offer several (a board that looks the same after a half turn); its nearest counts.
pub fn agreed_transform(choices: &[Vec<Transform>], distance_mm: f64) -> Option<Transform> {
    let median = |a: &Transform| {
        let nearest = |pair: &Vec<Transform>| {
            pair.iter().map(|b| deviation(a, b, distance_mm)).min_by(f64::total_cmp).unwrap_or(f64::INFINITY)
        };
        let mut all: Vec<f64> = choices.iter().map(nearest).collect();
        all.sort_by(f64::total_cmp);
        // Boards that are all seen alike leave two equal answers: cameras side by side are rolled less than a half turn.
        all[all.len() / 2] + 1e-3 * rotation_vector(a).norm()
    };
    choices.iter().flatten().min_by(|a, b| median(a).total_cmp(&median(b))).copied()
}
