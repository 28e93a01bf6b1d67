//! Stray light: what a glossy board reflects, or a lens scatters, beside the light that its print sends back.
//!
//! In: slopes of stray light that a board's corners were fitted with. Out: the variance of the slopes, a prior for fits
//! that hold them. The light on a board is reflected by dark and bright squares in proportion to their reflectance,
//! stray light adds to both alike. Taken for the former its slope bends the profile of the edges, each arm to another
//! side. Goes wrong: a highlight's own edge, which is no slope.

use nalgebra::{DMatrix, Matrix2, Point2, Vector2};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::statistics::median;

/// A variance of slopes that bounds nothing: all of the range of 16 bits within a px.
pub const UNBOUND: f64 = 4e9;
/// Standard errors beyond which a variance is none by chance.
const BEYOND_CHANCE: f64 = 3.0;
/// The same of slopes that follow each other over the board, as a probability.
const BY_CHANCE: f64 = 1e-3;
/// A slope that is known so many times less well than the usual one tells nothing, in variances.
const UNKNOWN: f64 = 10.0;

/// The slope of stray light at a corner.
#[derive(Debug, Clone, Copy)]
pub struct Slope {
    /// The corner, px.
    pub px: Point2<f64>,
    /// Grey values per px.
    pub slope: Vector2<f64>,
    /// Its covariance.
    pub own: Matrix2<f64>,
}

/// Variance of the slopes along an axis beyond their own; `None` where they are none but for chance.
pub fn variance(slopes: &[Slope]) -> Option<f64> {
    let usual = median(slopes.iter().map(|s| s.own.trace()))?;
    let known: Vec<Slope> = slopes.iter().filter(|s| s.own.trace() < UNKNOWN * usual).copied().collect();
    let beyond: Vec<f64> = known.iter().map(|s| (s.slope.norm_squared() - s.own.trace()) / 2.0).collect();
    let count = beyond.len() as f64;
    let mean = beyond.iter().sum::<f64>() / count;
    let error = (beyond.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count * (count - 1.0))).sqrt();
    let of_each = (mean > BEYOND_CHANCE * error).then_some(mean);
    of_each.or_else(|| common_variance(&known))
}

/// The same of what the slopes have in common: a plane over the board, which shows where each slope alone is lost in
/// its noise.
fn common_variance(slopes: &[Slope]) -> Option<f64> {
    /// Terms of a plane.
    const TERMS: usize = 3;
    if slopes.len() < 2 * TERMS {
        return None;
    }
    let middle = slopes.iter().map(|s| s.px.coords).sum::<Vector2<f64>>() / slopes.len() as f64;
    let plane = DMatrix::from_fn(slopes.len(), TERMS, |i, k| match k {
        0 => 1.0,
        _ => (slopes[i].px.coords - middle)[k - 1],
    });
    let given = DMatrix::from_fn(slopes.len(), 2, |i, axis| slopes[i].slope[axis]);
    let in_common = (plane.qr().q().transpose() * given).norm_squared();
    let own = slopes.iter().map(|s| s.own.trace()).sum::<f64>() / (2.0 * slopes.len() as f64);
    let freedom = 2.0 * TERMS as f64;
    let by_chance = 1.0 - ChiSquared::new(freedom).ok()?.cdf(in_common / own);
    (by_chance < BY_CHANCE).then_some((in_common - freedom * own) / (2.0 * slopes.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::draws::{Draws, Purpose};

    fn slopes(seed: u64, of: impl Fn(usize) -> f64) -> Vec<Slope> {
        let mut draws = Draws::new(seed, Purpose::Clutter, 0);
        let mut normal = |sigma: f64| sigma * draws.normal();
        let px = |k: usize| Point2::new(100.0 + 40.0 * (k % 8) as f64, 50.0 + 38.0 * (k / 8) as f64);
        let mut slope = |k: usize| Vector2::new(normal(0.1) + of(k), normal(0.1) - of(k));
        (0..48).map(|k| Slope { px: px(k), slope: slope(k), own: Matrix2::identity() * 0.01 }).collect()
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

    #[test]
    fn a_slope_that_all_corners_share_is_seen_below_the_noise_of_each() {
        let mean =
            |of: &dyn Fn(usize) -> f64| (0..20).map(|seed| variance(&slopes(seed, of)).unwrap()).sum::<f64>() / 20.0;
        let even = mean(&|_| 0.09);
        assert!((even / 0.0081 - 1.0).abs() < 0.3, "{even}");
        let turning = mean(&|k| 0.05 * ((k % 8) as f64 - 3.5));
        assert!((turning / 0.0131 - 1.0).abs() < 0.3, "{turning}");
    }
}
