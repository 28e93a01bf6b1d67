//! Stray light: what a glossy board reflects, or a lens scatters, beside the light that its print sends back.
//!
//! In: slopes of stray light that a board's corners were fitted with. Out: the variance of the slopes, a prior for fits that hold them. The
//! light on a board is reflected by dark and bright squares in proportion to their reflectance, stray light adds to both alike. Taken for the
//! former its slope bends the profile of the edges, each arm to another side. Goes wrong: a highlight's own edge, which is no slope.

use nalgebra::{Matrix2, Vector2};

use crate::statistics::median;

/// A variance of slopes that bounds nothing: all of the range of 16 bits within a px.
pub const UNBOUND: f64 = 4e9;
/// Standard errors beyond which a variance is none by chance.
const BEYOND_CHANCE: f64 = 3.0;
/// A slope that is known so many times less well than the usual one tells nothing, in variances.
const UNKNOWN: f64 = 10.0;

/// Variance of the slopes along an axis beyond their own; `None` where they are none but for chance.
pub fn variance(slopes: &[(Vector2<f64>, Matrix2<f64>)]) -> Option<f64> {
    let usual = median(slopes.iter().map(|(_, own)| own.trace()))?;
    let known = slopes.iter().filter(|(_, own)| own.trace() < UNKNOWN * usual);
    let beyond: Vec<f64> = known.map(|(slope, own)| (slope.norm_squared() - own.trace()) / 2.0).collect();
    let count = beyond.len() as f64;
    let mean = beyond.iter().sum::<f64>() / count;
    let error = (beyond.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count * (count - 1.0))).sqrt();
    (mean > BEYOND_CHANCE * error).then_some(mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::draws::{Draws, Purpose};

    fn slopes(seed: u64, of: impl Fn(usize) -> f64) -> Vec<(Vector2<f64>, Matrix2<f64>)> {
        let mut draws = Draws::new(seed, Purpose::Clutter, 0);
        let mut normal = |sigma: f64| sigma * draws.normal();
        (0..48).map(|k| (Vector2::new(normal(0.1) + of(k), normal(0.1) - of(k)), Matrix2::identity() * 0.01)).collect()
    }

    #[test]
    fn slopes_are_stray_light_where_they_are_more_than_noise() {
        let by_chance = (0..200).filter(|&seed| variance(&slopes(seed, |_| 0.0)).is_some()).count();
        assert!(by_chance <= 2, "{by_chance}");
        // A highlight on a third of the board.
        let glare = variance(&slopes(1, |k| if k < 16 { 0.6 } else { 0.0 })).unwrap();
        assert!((glare / 0.12 - 1.0).abs() < 0.3, "{glare}");
        assert_eq!(variance(&[]), None);
    }
}
