//! How large residuals are: the size of a row as that of one normal number, and the scatter that explains them.
//!
//! In: residuals before whitening. Out: sizes of rows, their robust standard deviation, and the scatter at which the
//! white sum of squares equals the degrees of freedom. The covariance of a row is `stated * C + point^2 I`, C the one
//! of the file. Of all pairs with the right sum of squares the one of least determinant is the most probable; where the
//! data do not tell the two apart, C is taken at its word, though it leave a smaller sum of squares than expected.

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

use crate::crossing::crossing;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::{EVIDENCE, Raw, Scatter};
use crate::statistics::median;

/// Least scatter, mm and rad: below any instrument that reads a robot. Exact data would weigh so much that what decides
/// between models and tolerances, a difference of sums of squares of all offsets, is lost in rounding.
pub(super) const LEAST_MM: f64 = 1e-5;
const LEAST_RAD: f64 = 1e-7;

/// Largest scatter, mm, and largest scale.
const LARGEST_MM: f64 = 1e5;
const LARGEST_SCALE: f64 = 1e12;

/// Scatters and scales that differ by this share are one.
const SAME: f64 = 1e-12;

/// Factors of the stated covariances that are tried.
const STATED: [f64; 10] = [1e-4, 1e-3, 0.01, 0.03, 0.1, 0.3, 3.0, 10.0, 30.0, 100.0];

/// Stated covariances count as too large where the residuals ask for less than this share of them; a little less is
/// what errors common to many rows look like, which scatter does not show.
const OVERSTATED: f64 = 0.4;

/// How many standard deviations below nothing a variance is taken to be at the most.
const FARTHEST: f64 = -6.0;

/// One number of a residual, along an axis of its covariance.
#[derive(Debug, Clone, Copy, Default)]
struct Number {
    square: f64,
    variance: f64,
    /// How many times the scatter enters.
    times: f64,
}

/// The residual of a row: a length, or a point along the axes of its covariance.
#[derive(Debug, Clone, Copy)]
pub(super) struct Residual {
    /// Of the data set.
    pub(super) row: usize,
    weight: f64,
    numbers: [Number; 3],
    pub(super) count: usize,
}

impl Number {
    fn variance(&self, scatter: &Scatter) -> f64 {
        self.variance * scatter.stated + self.times * scatter.point_mm * scatter.point_mm
    }
}

impl Residual {
    /// Of all rows; orientations are left out.
    pub(super) fn all(raw: &[(usize, f64, Raw)]) -> Vec<Residual> {
        raw.iter().filter_map(|(row, weight, raw)| Residual::new(*row, *weight, raw)).collect()
    }

    fn new(row: usize, weight: f64, raw: &Raw) -> Option<Residual> {
        let mut numbers = [Number::default(); 3];
        let count = match raw {
            Raw::Length(r, variance, times) => {
                numbers[0] = Number { square: r * r, variance: *variance, times: *times };
                1
            }
            Raw::Point(r, covariance) => {
                let eigen = covariance.symmetric_eigen();
                for (k, number) in numbers.iter_mut().enumerate() {
                    let square = eigen.eigenvectors.column(k).dot(r).powi(2);
                    *number = Number { square, variance: eigen.eigenvalues[k].max(0.0), times: 1.0 };
                }
                3
            }
            Raw::Turn(_) => return None,
        };
        Some(Residual { row, weight, numbers, count })
    }

    /// Root mean square of its numbers, mm.
    pub(super) fn size_mm(&self) -> f64 {
        (self.numbers().iter().map(|n| n.square).sum::<f64>() / self.count as f64).sqrt()
    }

    fn numbers(&self) -> &[Number] {
        &self.numbers[..self.count]
    }

    fn white_square(&self, scatter: &Scatter) -> f64 {
        self.numbers().iter().map(|n| n.square / n.variance(scatter)).sum()
    }
}

/// White size of each row's residual in so many standard deviations, brought to the size of one normal number; zero for
/// rows without one.
pub(super) fn sizes(residuals: &[Residual], scatter: &Scatter, scale: f64, count: usize) -> Vec<f64> {
    let white: Vec<f64> = residuals.iter().map(|residual| residual.white_square(scatter)).collect();
    sizes_of(residuals, &white, scale, count)
}

/// The same of white squares that are known.
fn sizes_of(residuals: &[Residual], white: &[f64], scale: f64, count: usize) -> Vec<f64> {
    let mut squares = vec![0.0; count];
    for (residual, white) in residuals.iter().zip(white) {
        let white = white / (scale * scale);
        let square = if residual.count == 1 { white } else { as_one_number(white) };
        squares[residual.row] = f64::max(squares[residual.row], square);
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// A chi-squared of three degrees of freedom as one of a single degree that is exceeded as often (Wilson and Hilferty,
/// 1931).
pub(super) fn as_one_number(square: f64) -> f64 {
    let (three, one) = (2.0 / 27.0, 2.0 / 9.0);
    let z = ((square / 3.0).cbrt() - (1.0 - three)) / f64::sqrt(three);
    // Not zero: a residual that is very small is still one.
    (1.0 - one + z * f64::sqrt(one)).max(1e-3).powi(3)
}

/// The standard deviation in which the median of these rows' sizes is what it should be, `freedom` times what the fit
/// left.
pub(super) fn robust_scale(
    residuals: &[Residual],
    rows: &[usize],
    count: usize,
    freedom: f64,
    scatter: &Scatter,
) -> f64 {
    // Of data without noise rounding is left, which is no scale for what is left after the next step.
    let sds = residuals.iter().flat_map(Residual::numbers).map(|n| n.variance(scatter).sqrt());
    let (low, high) = (LEAST_MM / median(sds).unwrap_or(1.0).max(LEAST_MM), LARGEST_SCALE);
    let white: Vec<f64> = residuals.iter().map(|residual| residual.white_square(scatter)).collect();
    in_logarithms(low, high, |scale| freedom * median_size(&sizes_of(residuals, &white, scale, count), rows))
}

/// Where a positive function of a positive number falls below one.
fn in_logarithms(low: f64, high: f64, of: impl Fn(f64) -> f64) -> f64 {
    crossing(low.ln(), high.ln(), SAME, |x| of(x.exp()).ln()).exp()
}

/// Robust standard deviation of the sizes of these rows: their median over that of a normal number's absolute value.
fn median_size(sizes: &[f64], rows: &[usize]) -> f64 {
    median(rows.iter().map(|&r| sizes[r]).filter(|s| *s > 0.0)).map_or(0.0, |middle| middle / 0.6745)
}

/// The scatter at which the median residual of these rows has the size that it should have, `freedom` times what the
/// fit left. With `both` the factor of the stated covariances is looked for as well.
pub(super) fn robust_scatter(
    residuals: &[Residual],
    rows: &[usize],
    count: usize,
    freedom: f64,
    before: Scatter,
    both: bool,
) -> Scatter {
    let excess = |scatter: &Scatter| (freedom * median_size(&sizes(residuals, scatter, 1.0, count), rows)).powi(2);
    match both {
        true => most_probable(residuals, before, 1.0 / (freedom * freedom), &excess),
        false => with_point(before, &excess),
    }
}

/// The scatter at which the white sum of squares equals the degrees of freedom (Pearson's equation); for points and
/// orientations apart. `lost` is what the fit took of either; where it is not known, each number loses the same share
/// to parameters and placements.
pub(super) fn estimate_scatter(
    rows: &Rows,
    offsets: &[f64],
    effective: f64,
    lost: Option<[f64; 2]>,
    before: Scatter,
) -> Scatter {
    let raw = rows.raw(offsets);
    let turns: Vec<f64> =
        raw.iter().filter_map(|(_, _, r)| if let Raw::Turn(t) = r { Some(t.norm_squared()) } else { None }).collect();
    let residuals = Residual::all(&raw);
    let of_points: f64 = residuals.iter().map(|r| r.count as f64).sum();
    let of_turns = 3.0 * turns.len() as f64;
    let total = (of_points + of_turns).max(1.0);
    let alike = (rows.count() as f64 - rows.lost_to_smooth() - effective) / total;
    let [points_left, turns_left] = match lost {
        Some([points, turns]) => [of_points - rows.lost_to_smooth() - points, of_turns - turns],
        None => [alike * of_points, alike * of_turns],
    };
    let turn_square = turns.iter().sum::<f64>() / turns_left.max(of_turns / total).max(f64::MIN_POSITIVE);
    let rotation_rad = if turns.is_empty() { before.rotation_rad } else { turn_square.sqrt().max(LEAST_RAD) };
    let wanted = points_left.max(of_points / total);
    let excess = |scatter: &Scatter| {
        let sum: f64 = residuals.iter().map(|r| r.weight * r.weight * r.white_square(scatter)).sum();
        sum / wanted.max(f64::MIN_POSITIVE)
    };
    let left = wanted / of_points.max(1.0);
    let scatter = Scatter { rotation_rad, ..most_probable(&residuals, before, left, &excess) };
    let (hidden_mm2, fresh_sd_mm2) = hidden(&residuals, left, &scatter);
    Scatter { hidden_mm2, fresh_sd_mm2, freedom: wanted, ..scatter }
}

/// By how much the expectation of the scatter's variance is above the one that was found, and its standard deviation,
/// mm^2: residuals tell it to within one that the readings' own noise makes, and it is not negative. `left` is the
/// share of the numbers that the fit left.
fn hidden(residuals: &[Residual], left: f64, scatter: &Scatter) -> (f64, f64) {
    let (mut score, mut information) = (0.0, 0.0);
    for residual in residuals {
        for number in residual.numbers() {
            let variance = number.variance(scatter);
            let of_square = residual.weight.powi(2) * number.square - left * variance;
            score += 0.5 * of_square * number.times / variance.powi(2);
            information += 0.5 * left * (number.times / variance).powi(2);
        }
    }
    let (found, sd) = (scatter.point_mm.powi(2), information.sqrt().recip());
    // Where none was found, residuals that are smaller than the readings' noise ask for less than none.
    let most_probable = if scatter.point_mm > LEAST_MM { found } else { (score / information).min(0.0) };
    let z = (most_probable / sd).max(FARTHEST);
    let law = Normal::standard();
    // Mean and variance of a normal number that is known not to be negative.
    let cut = law.pdf(z) / law.cdf(z);
    let above = sd * (z + cut) - found;
    let sd = sd * (1.0 - cut * (z + cut)).max(0.0).sqrt();
    if above.is_finite() { (above.max(0.0), sd) } else { (0.0, 0.0) }
}

/// The scatter of a coordinate at which the excess is one, the factor of the stated covariances held.
fn with_point(before: Scatter, excess: &dyn Fn(&Scatter) -> f64) -> Scatter {
    let at = |point_mm: f64| Scatter { point_mm, ..before };
    at(in_logarithms(LEAST_MM, LARGEST_MM, |point_mm| excess(&at(point_mm))))
}

/// Of the pairs of factor and scatter at which the excess, the residuals' squares over what they should be, is one, the
/// most probable, where it is clearly more so than covariances taken at their word, and than these made smaller by what
/// the residuals leave; `left` is the share of the numbers that the fit left.
fn most_probable(residuals: &[Residual], before: Scatter, left: f64, excess: &dyn Fn(&Scatter) -> f64) -> Scatter {
    let at = |stated: f64| Scatter { point_mm: LEAST_MM, stated, ..before };
    if residuals.iter().all(|r| r.numbers().iter().all(|n| n.variance <= 0.0)) {
        return with_point(at(1.0), excess);
    }
    let numbers = || residuals.iter().flat_map(Residual::numbers);
    // Minus the logarithm of the restricted likelihood, but for what all have.
    let cost = |scatter: &Scatter, excess: f64| -> f64 {
        0.5 * left * (numbers().map(|n| n.variance(scatter).ln()).sum::<f64>() + numbers().count() as f64 * excess)
    };
    let word = match excess(&at(1.0)) {
        there if there > 1.0 => with_point(at(1.0), excess),
        there if there < OVERSTATED => at(there.max(1e-12)),
        _ => at(1.0),
    };
    let tried = STATED.iter().filter(|s| excess(&at(**s)) > 1.0).map(|&s| with_point(at(s), excess));
    let best = tried.map(|s| (cost(&s, 0.0), s)).min_by(|a, b| a.0.total_cmp(&b.0));
    let there = excess(&word).min(1.0);
    let smaller = Scatter { stated: word.stated * there.max(1e-12), ..word };
    match best {
        Some((least, scatter)) if least < cost(&word, there - 1.0).min(cost(&smaller, 0.0)) - EVIDENCE => scatter,
        _ => word,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    /// Residuals of unit directions in turn, as large as `sd` of the stated standard deviations along x, y, z.
    fn points(stated: Vector3<f64>, sd: Vector3<f64>) -> Vec<Residual> {
        let raw: Vec<(usize, f64, Raw)> = (0..200)
            .map(|i| {
                let sign = |k: usize| if (i >> k) & 1 == 0 { 1.0 } else { -1.0 };
                let r = Vector3::new(sign(0) * sd.x, sign(1) * sd.y, sign(2) * sd.z);
                (i, 1.0, Raw::Point(r, Matrix3::from_diagonal(&stated.component_mul(&stated))))
            })
            .collect();
        Residual::all(&raw)
    }

    fn found(residuals: &[Residual]) -> Scatter {
        let wanted = 3.0 * residuals.len() as f64;
        let excess = |s: &Scatter| residuals.iter().map(|r| r.white_square(s)).sum::<f64>() / wanted;
        most_probable(residuals, Scatter::of_point(1.0), 1.0, &excess)
    }

    #[test]
    fn covariances_that_are_right_are_taken_at_their_word() {
        let sd = Vector3::new(0.05, 0.04, 0.3);
        let scatter = found(&points(sd, sd));
        assert_eq!(scatter.stated, 1.0);
    }

    /// Residuals that are all a little smaller than their covariances say were taken for scatter, and the covariances
    /// for nothing.
    #[test]
    fn residuals_a_little_too_small_leave_covariances_at_their_word() {
        for stated in [Vector3::repeat(0.02), Vector3::new(0.05, 0.04, 0.3)] {
            for share in [1.0, 0.95, 0.9, 0.8, 0.7] {
                let scatter = found(&points(stated, share * stated));
                assert!(scatter.stated == 1.0 && scatter.point_mm <= LEAST_MM, "{share}: {scatter:?}");
            }
        }
    }

    #[test]
    fn covariances_too_small_by_one_factor_are_multiplied() {
        let sd = Vector3::new(0.05, 0.04, 0.3);
        let scatter = found(&points(sd, 3.2 * sd));
        assert!((3.0..=10.5).contains(&scatter.stated) && scatter.point_mm < 0.1, "{scatter:?}");
    }

    #[test]
    fn scatter_alike_in_all_directions_is_not_the_instruments() {
        let scatter = found(&points(Vector3::new(0.006, 0.004, 0.001), Vector3::repeat(0.006)));
        assert!(scatter.stated <= 0.1 && (scatter.point_mm - 0.006).abs() < 1e-3, "{scatter:?}");
    }

    #[test]
    fn sizes_do_not_depend_on_the_unit_of_the_covariances() {
        let sd = Vector3::new(0.05, 0.04, 0.3);
        let rows: Vec<usize> = (0..200).collect();
        let of = |times: f64| {
            let mut residuals = points(times * sd, sd);
            residuals.truncate(199);
            residuals.extend(points(times * sd, 5.0 * sd).into_iter().skip(199));
            let scatter = Scatter::of_point(1e-7);
            let scale = robust_scale(&residuals, &rows, 200, 1.0, &scatter);
            sizes(&residuals, &scatter, scale, 200)[199]
        };
        for times in [0.3, 1.5, 3.0, 30.0] {
            assert!((of(times) / of(1.0) - 1.0).abs() < 1e-6, "{times}: {} against {}", of(times), of(1.0));
        }
    }
}
