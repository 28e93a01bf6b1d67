//! The median, quantiles of the distributions that tests compare with, and what a repeatability is in standard
//! deviations.

/// The middle one of the numbers, the upper of two; `None` where there is none.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (middle < values.len()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Quantile of the normal distribution that one draw in a thousand exceeds.
pub const NORMAL_999: f64 = 3.0902;

/// ISO 9283: RP is the mean distance from the barycentre plus three standard deviations. For three equal
/// normal coordinates of standard deviation s that is (1.596 + 3 * 0.673) s.
pub const RP_OVER_SIGMA: f64 = 3.616;

/// Quantile of chi-square at the level of a quantile of the normal distribution (Wilson and Hilferty 1931; 3 % too
/// large at one degree of freedom and 99.9 %, less elsewhere).
pub fn chi_square_quantile(freedom: f64, normal: f64) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    freedom * (1.0 - spread + normal * spread.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_chi_square_are_those_of_the_tables() {
        for (freedom, normal, table) in
            [(1.0, NORMAL_999, 10.83), (2.0, NORMAL_999, 13.82), (20.0, NORMAL_999, 45.31), (2.0, 1.6449, 5.99)]
        {
            let found = chi_square_quantile(freedom, normal);
            assert!((found / table - 1.0).abs() < 0.04, "{freedom}: {found}");
        }
    }

    #[test]
    fn half_of_the_numbers_are_below() {
        assert_eq!(median([3.0, f64::NAN, 1.0, 2.0, -4.0]), Some(2.0));
        assert_eq!(median([2.0, 1.0]), Some(2.0));
        assert_eq!(median([]), None);
    }
}
