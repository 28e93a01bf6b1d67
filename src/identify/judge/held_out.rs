//! Held-out errors of two models compared.

use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Held-out errors of one model: of each cell the mean square of its numbers, mm^2, and how many there are.
pub type HeldOut = Vec<(f64, f64)>;

/// Chance with which a model that is no better may seem so: several are tried on every rung.
pub const CHANCE: f64 = 0.01;

/// Whether `new` is clearly below `old`: its mean square is less, and by Student's test of the paired cells either the squares fall or
/// their logarithms do. Squares say what a few bad regions gain; logarithms see that all regions gain where the old errors are of very
/// different size.
pub fn clearly_less(new: &HeldOut, old: &HeldOut) -> bool {
    let pairs: Vec<(f64, f64)> = new.iter().zip(old).filter(|((_, n), _)| *n > 0.0).map(|(n, o)| (n.0, o.0)).collect();
    if pairs.len() < 2 || new.len() != old.len() || root_mean(new) >= root_mean(old) {
        return false;
    }
    let squares = pairs.iter().map(|(n, o)| o - n).collect();
    let logarithms = pairs.iter().map(|(n, o)| (o.max(f64::MIN_POSITIVE) / n.max(f64::MIN_POSITIVE)).ln()).collect();
    clearly_positive(squares) || clearly_positive(logarithms)
}

/// Whether the mean of these gains is more than chance.
fn clearly_positive(gains: Vec<f64>) -> bool {
    let gains = DVector::from_vec(gains);
    let freedom = (gains.len() - 1) as f64;
    let standard_error = (gains.variance() / freedom).sqrt();
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else { return false };
    gains.mean() > student.inverse_cdf(1.0 - CHANCE) * standard_error
}

/// Root mean square of held-out errors, mm a number.
pub fn root_mean(held_out: &HeldOut) -> Option<f64> {
    let numbers: f64 = held_out.iter().map(|(_, n)| n).sum();
    let squares: f64 = held_out.iter().map(|(s, n)| s * n).sum();
    (numbers > 0.0).then(|| (squares / numbers).sqrt())
}
