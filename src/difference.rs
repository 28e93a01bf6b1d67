//! Numbers that are known twice: do both agree, and which change explains where they do not.
//!
//! In: the difference of two estimates of the same numbers with its covariance, and from how many pairs that is known.
//! Out: tests of all numbers together (Hotelling) and of a change along one direction (Student), and what is left where
//! some directions may take what they like. Goes wrong: a covariance that follows from fewer pairs than there are
//! numbers; then all numbers together are not tested.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};

/// Causes are told apart where the logarithm of one's likelihood is larger by this: 150 to 1.
pub const TOLD_APART: f64 = 5.0;

/// Quantile of the normal distribution for the share of changes that a test sees at the size that is stated: nineteen
/// in twenty.
pub const SEEN: f64 = 1.645;

/// Degrees of freedom from which on a covariance is as good as known.
const KNOWN: f64 = 1e4;

/// Two standard deviations of a variance that one pair tells, as a share; of many it is that over the root of their
/// number.
const HIDDEN: f64 = 1.5;

/// The difference of two estimates.
pub struct Difference {
    /// Second minus first.
    pub off: DVector<f64>,
    joint: Joint,
    freedom: f64,
    /// Whether the covariance is known but for its size.
    is_sized: bool,
}

/// A covariance, ready to be divided by.
enum Joint {
    Whole(Cholesky<f64, Dyn>),
    /// A unit matrix and the product of columns with themselves, of which there are few: these, and what they leave in
    /// their own coordinates (Woodbury).
    Beyond(DMatrix<f64>, Cholesky<f64, Dyn>),
}

impl Joint {
    fn solve(&self, v: &DVector<f64>) -> DVector<f64> {
        match self {
            Joint::Whole(whole) => whole.solve(v),
            Joint::Beyond(columns, inner) => v - columns * inner.solve(&columns.tr_mul(v)),
        }
    }
}

/// Degrees of freedom of a variance of which `scatter` is over that by the readings' noise, as so many units tell.
fn freedom(pairs: usize, scatter: f64) -> f64 {
    let hidden = 1.0 + HIDDEN / (pairs.max(1) as f64).sqrt();
    let share = 1.0 - 1.0 / scatter.max(hidden);
    (pairs.saturating_sub(1).max(1) as f64 / (share * share)).min(KNOWN)
}

impl Difference {
    /// `scatter` is the variance in the covariance over that by the readings' noise, as so many units (pairs, poses)
    /// tell: of the part beyond one they know as little as they are few, and of the rest much (Welch and
    /// Satterthwaite). Where no scatter was seen, as much as chance hides may be there. `None` where the covariance is
    /// singular.
    pub fn new(off: DVector<f64>, joint: &DMatrix<f64>, pairs: usize, scatter: f64) -> Option<Difference> {
        let joint = Joint::Whole((0.5 * (joint + joint.transpose())).cholesky()?);
        Some(Difference { off, joint, freedom: freedom(pairs, scatter), is_sized: false })
    }

    /// The same of numbers that are known to a unit each, and beside that to the product of these columns with
    /// themselves. How large that unit is, so many degrees of freedom tell.
    pub fn of_white(off: DVector<f64>, columns: DMatrix<f64>, freedom: f64) -> Option<Difference> {
        let (numbers, count) = columns.shape();
        if numbers <= count {
            let whole = DMatrix::identity(numbers, numbers) + &columns * columns.transpose();
            return Some(Difference { off, joint: Joint::Whole(whole.cholesky()?), freedom, is_sized: true });
        }
        let inner = (DMatrix::identity(count, count) + columns.transpose() * &columns).cholesky()?;
        Some(Difference { off, joint: Joint::Beyond(columns, inner), freedom, is_sized: true })
    }

    /// Squared difference in units of its covariance.
    pub fn chi_square(&self) -> f64 {
        self.off.dot(&self.joint.solve(&self.off))
    }

    /// Product of two vectors in units of the covariance.
    pub fn product(&self, a: &DVector<f64>, b: &DVector<f64>) -> f64 {
        a.dot(&self.joint.solve(b))
    }

    /// What it stays within but for this chance, where so many numbers are free to differ; infinite where too few pairs
    /// tell.
    pub fn limit(&self, numbers: usize, chance: f64) -> f64 {
        let (p, n) = (numbers as f64, self.freedom);
        let inner = if self.is_sized { n } else { n - p + 1.0 };
        if inner <= 1.0 {
            return f64::INFINITY;
        }
        FisherSnedecor::new(p, inner).map_or(f64::INFINITY, |f| f.inverse_cdf(1.0 - chance) * n * p / inner)
    }

    /// Standard deviations that a single number stays within but for this chance, on both sides.
    pub fn level(&self, chance: f64) -> f64 {
        StudentsT::new(0.0, 1.0, self.freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - chance / 2.0))
    }

    /// Amount of a direction and its standard deviation, if it alone changed. `None` where nothing is known of it.
    pub fn along(&self, direction: &DVector<f64>) -> Option<(f64, f64)> {
        let weighted = self.joint.solve(direction);
        let information = direction.dot(&weighted);
        (information > 0.0).then(|| (weighted.dot(&self.off) / information, 1.0 / information.sqrt()))
    }

    /// The squared difference that is left where these directions may take what they like.
    pub fn left_by(&self, directions: &[DVector<f64>]) -> Option<f64> {
        let (amounts, right) = self.taken(directions)?;
        Some((self.chi_square() - right.dot(&amounts)).max(0.0))
    }

    /// What each of these directions takes then.
    pub fn amounts(&self, directions: &[DVector<f64>]) -> Option<DVector<f64>> {
        Some(self.taken(directions)?.0)
    }

    fn taken(&self, directions: &[DVector<f64>]) -> Option<(DVector<f64>, DVector<f64>)> {
        let weighted: Vec<DVector<f64>> = directions.iter().map(|d| self.joint.solve(d)).collect();
        let n = directions.len();
        let matrix = DMatrix::from_fn(n, n, |i, j| directions[i].dot(&weighted[j]));
        let right = DVector::from_fn(n, |i, _| weighted[i].dot(&self.off));
        Some((matrix.cholesky()?.solve(&right), right))
    }

    /// Logarithm of the likelihood, but for a constant, of a change that leaves so much (the multivariate distribution
    /// of Student).
    pub fn log_likelihood(&self, left: f64) -> f64 {
        -0.5 * (self.freedom + self.off.len() as f64) * (left / self.freedom).ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_those_of_the_tables() {
        let known = Difference::new(DVector::zeros(2), &DMatrix::identity(2, 2), 1000, 1.0).unwrap();
        // Chi-square of two and the normal distribution at one in a hundred; Student's of five and Fisher's of 2 and 4.
        assert!((known.limit(2, 0.01) / 9.21 - 1.0).abs() < 5e-3 && (known.level(0.01) - 2.576).abs() < 5e-3);
        let six = Difference::new(DVector::zeros(2), &DMatrix::identity(2, 2), 6, 1e12).unwrap();
        assert!((six.level(0.01) - 4.032).abs() < 5e-3);
        assert!((six.limit(2, 0.01) / (18.0 * 5.0 * 2.0 / 4.0) - 1.0).abs() < 5e-3);
        assert_eq!(six.limit(6, 0.01), f64::INFINITY);
        // Fisher's of 2 and 5 where the covariance is known but for its size.
        let sized = Difference::of_white(DVector::zeros(2), DMatrix::zeros(2, 1), 5.0).unwrap();
        assert!((sized.limit(2, 0.01) / (2.0 * 13.274) - 1.0).abs() < 5e-3, "{}", sized.limit(2, 0.01));
    }

    #[test]
    fn a_direction_takes_what_lies_along_it() {
        let joint = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let along = DVector::from_column_slice(&[1.0, 3.0]);
        let difference = Difference::new(&along * 0.7, &joint, 12, 1.0).unwrap();
        let (amount, _) = difference.along(&along).unwrap();
        assert!((amount - 0.7).abs() < 1e-12 && difference.left_by(&[along]).unwrap() < 1e-12);
        assert!(difference.log_likelihood(0.0) > difference.log_likelihood(difference.chi_square()));
    }

    #[test]
    fn few_columns_beside_a_unit_are_the_covariance_that_they_make() {
        for (numbers, count) in [(5, 8), (40, 8), (300, 3)] {
            let columns = DMatrix::from_fn(numbers, count, |r, c| 100.0 * ((1 + 7 * r + 13 * c * c) as f64).sin());
            let off = DVector::from_fn(numbers, |r, _| ((3 * r) as f64).cos());
            let along = DVector::from_fn(numbers, |r, _| ((r * r) as f64).sin());
            let whole = DMatrix::identity(numbers, numbers) + &columns * columns.transpose();
            let known = freedom(60, 1.0);
            let whole = Difference { is_sized: true, ..Difference::new(off.clone(), &whole, 60, 1.0).unwrap() };
            let few = Difference::of_white(off, columns, known).unwrap();
            assert!((whole.chi_square() / few.chi_square() - 1.0).abs() < 1e-8);
            let [(a, of_a), (b, of_b)] = [&whole, &few].map(|difference| difference.along(&along).unwrap());
            assert!((a - b).abs() < 1e-8 * of_a && (of_a / of_b - 1.0).abs() < 1e-8, "{a} {b} {of_a} {of_b}");
            let [a, b] = [&whole, &few].map(|difference| difference.left_by(std::slice::from_ref(&along)).unwrap());
            assert!((a / b - 1.0).abs() < 1e-8 && whole.limit(3, 0.01) == few.limit(3, 0.01));
        }
    }
}
