//! How long errors are whose covariances are known.
//!
//! In: the covariance of the error at each pose. Out: the mean length, the one at the worst pose, and the length that
//! nineteen of twenty stay below. Method: the squared length of a vector of normal numbers is nearly a multiple of a
//! chi-squared variable of one to three degrees of freedom, with its mean and variance (Satterthwaite, 1946): an error
//! that goes one way has longer tails than one that goes all ways. Where the size of the covariances follows from few
//! residuals, the squared length over it is Fisher's instead. Over the poses the probabilities are averaged.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};
use statrs::function::gamma::ln_gamma;

/// Mean length of a vector of three equal normal numbers over the root of the mean of its square.
pub const MEAN_OVER_RMS: f64 = 0.921_317_731_923_561_3;

/// Share of the errors that are below [`Lengths::p95_mm`].
const BELOW: f64 = 0.95;

/// Degrees of freedom from which on a size is as good as known.
const KNOWN: f64 = 1e4;

/// Lengths of errors to expect over some poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Lengths {
    /// Mean over the poses of the expected length, mm.
    pub mean_mm: f64,
    /// 95 % are below, mm.
    pub p95_mm: f64,
    /// Expected length at the worst pose, mm.
    pub max_mm: f64,
}

impl Lengths {
    /// Of the covariance of the error at each pose, mm^2, whose size so many degrees of freedom tell.
    pub fn new(covariances_mm2: &[Matrix3<f64>], told: f64) -> Lengths {
        let all: Vec<Length> = covariances_mm2.iter().map(|covariance| Length::new(covariance, told)).collect();
        let count = all.len().max(1) as f64;
        let below = |mm: f64| all.iter().map(|length| length.below(mm)).sum::<f64>() / count;
        // No normal number is so far out.
        let mut range = (0.0, 10.0 * all.iter().map(|length| length.mean_square_mm2).fold(0.0, f64::max).sqrt());
        while range.1 - range.0 > 1e-9 * range.1 {
            let middle = 0.5 * (range.0 + range.1);
            if below(middle) < BELOW { range.0 = middle } else { range.1 = middle }
        }
        Lengths {
            mean_mm: all.iter().map(Length::mean_mm).sum::<f64>() / count,
            p95_mm: range.1,
            max_mm: all.iter().map(Length::mean_mm).fold(0.0, f64::max),
        }
    }
}

/// The length of one error.
#[derive(Debug, Clone, Copy)]
pub struct Length {
    mean_square_mm2: f64,
    /// Degrees of freedom, of its square over their share of the mean square.
    freedom: f64,
    /// Degrees of freedom that tell the mean square.
    told: f64,
}

impl Length {
    pub fn new(covariance_mm2: &Matrix3<f64>, told: f64) -> Length {
        let (trace, square) = (covariance_mm2.trace().max(0.0), covariance_mm2.norm_squared());
        let freedom = if square > 0.0 { (trace * trace / square).clamp(1.0, 3.0) } else { 3.0 };
        Length { mean_square_mm2: trace, freedom, told }
    }

    /// Its expectation.
    pub fn mean_mm(&self) -> f64 {
        let [half, told] = [self.freedom, self.told].map(|freedom| 0.5 * freedom);
        let known = (self.mean_square_mm2 / half).sqrt() * (ln_gamma(half + 0.5) - ln_gamma(half)).exp();
        if told < KNOWN { known * told.sqrt() * (ln_gamma(told - 0.5) - ln_gamma(told)).exp() } else { known }
    }

    /// Chance that it is below.
    fn below(&self, mm: f64) -> f64 {
        if self.mean_square_mm2 == 0.0 {
            return 1.0;
        }
        let square = mm * mm / self.mean_square_mm2;
        if self.told < KNOWN {
            return FisherSnedecor::new(self.freedom, self.told).map_or(0.0, |fisher| fisher.cdf(square));
        }
        ChiSquared::new(self.freedom).map_or(0.0, |chi_squared| chi_squared.cdf(square * self.freedom))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn errors_of_one_way_and_of_all_ways_are_as_long_as_normal_numbers_make_them() {
        let told_by = |told: f64, variances: [f64; 3]| {
            Lengths::new(&[Matrix3::from_diagonal(&Vector3::from(variances)); 4], told)
        };
        let of = |variances: [f64; 3]| told_by(f64::INFINITY, variances);
        // The tables: of one number .7979 and 1.95996, of three the Maxwell distribution's 1.5958 and 2.7955.
        for (variances, mean, p95) in [([4.0, 0.0, 0.0], 1.5958, 3.9199), ([1.0; 3], 1.5958, 2.7955)] {
            let Lengths { mean_mm, p95_mm, max_mm } = of(variances);
            assert!((mean_mm / mean - 1.0).abs() < 1e-4 && (p95_mm / p95 - 1.0).abs() < 1e-4, "{mean_mm} {p95_mm}");
            assert!((max_mm / mean - 1.0).abs() < 1e-4);
        }
        assert!((of([1.0; 3]).mean_mm / 3f64.sqrt() - MEAN_OVER_RMS).abs() < 1e-9);
        // One pose in ten that is three times worse has half of the long ones.
        let mut mixed = vec![Matrix3::identity(); 9];
        mixed.push(Matrix3::identity() * 9.0);
        let Lengths { p95_mm, max_mm, .. } = Lengths::new(&mixed, f64::INFINITY);
        assert!(p95_mm > 2.9 && p95_mm < 6.0 && (max_mm / 4.787 - 1.0).abs() < 1e-3, "{p95_mm} {max_mm}");
        // Of a size that few residuals tell: Student's of one number, the root of Fisher's of three.
        for (told, one, three) in [(2.0, 4.3027, 7.5826), (10.0, 2.2281, 3.3352), (5000.0, 1.9604, 2.7970)] {
            let [of_one, of_three] = [[1.0, 0.0, 0.0], [1.0; 3]].map(|variances| told_by(told, variances).p95_mm);
            assert!((of_one / one - 1.0).abs() < 1e-3 && (of_three / three - 1.0).abs() < 1e-3, "{of_one} {of_three}");
        }
        assert!((told_by(10.0, [1.0, 0.0, 0.0]).mean_mm - 0.8646).abs() < 1e-3);
        assert_eq!(Lengths::new(&[], f64::INFINITY).p95_mm, 0.0);
        assert_eq!(of([0.0; 3]).mean_mm, 0.0);
    }
}
