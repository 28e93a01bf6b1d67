//! How far corners scatter: the refinement's own covariances, corrected by what the residuals say.
//!
//! `Sigma_i = s C_i + tau^2 I`: `C_i` is the refinement's covariance (zero where it gave none), `tau` covers what it
//! does not know (blur, print, lens), `s < 1` shrinks covariances that were too large. One of the two is fitted, so
//! that the reduced chi-square is one; then the covariance of every result needs no further factor.

use nalgebra::{Matrix2, Vector2};

use crate::crossing::crossing;
use crate::statistics::median;
use crate::stereo::data::{Observation, View, in_use};
use crate::stereo::solve::Loss;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// Factor on the refinement's covariances, at most 1.
    pub factor: f64,
    /// Standard deviation added to each coordinate, px.
    pub added_px: f64,
    /// Reduced chi-square with the refinement's covariances alone; `None` where there were none.
    pub reduced_chi_square: Option<f64>,
}

/// Median of chi-square with two degrees of freedom, the squared length of a whitened 2-D residual.
const MEDIAN_CHI_SQUARE_2: f64 = 2.0 * std::f64::consts::LN_2;

/// Residuals below this are exact: synthetic corners without noise. It keeps weights finite.
const FLOOR_PX: f64 = 1e-9;

/// Added variances that differ by this share of the plain scatter are one.
const SAME: f64 = 1e-10;

impl Noise {
    /// Every corner alike, one px.
    pub const UNIT: Noise = Noise { factor: 0.0, added_px: 1.0, reduced_chi_square: None };

    /// Covariance of a corner, px^2.
    pub fn covariance(&self, o: &Observation) -> Matrix2<f64> {
        o.covariance_px2 * self.factor + Matrix2::identity() * (self.added_px * self.added_px)
    }

    /// Share of the active corners' variance that the refinement's covariances are. The whiteners are this noise's.
    pub fn stated_share(&self, views: &[View]) -> f64 {
        let stated = |o: &Observation| (o.whitener * o.covariance_px2 * o.whitener.transpose()).trace() / 2.0;
        self.factor * in_use(views).map(stated).sum::<f64>() / in_use(views).count().max(1) as f64
    }

    /// The noise of corners of whose variance only this share is their own: what was added gives way first. `stated` is
    /// the share of the refinement's covariances.
    pub fn of_share(&self, own: f64, stated: f64) -> Noise {
        if own < stated {
            return Noise { factor: self.factor * own / stated, added_px: 0.0, ..*self };
        }
        let added = if stated < 1.0 { (own - stated) / (1.0 - stated) } else { 0.0 };
        Noise { added_px: self.added_px * added.max(0.0).sqrt(), ..*self }
    }

    /// Sets the whiteners of all corners.
    pub fn apply(&self, views: &mut [View]) {
        for o in views.iter_mut().flat_map(|view| &mut view.observations) {
            o.whitener = whitener(&self.covariance(o));
        }
    }

    /// Fitted to the median, so that up to half of the corners may be wrong. `residuals` are the active corners' in px.
    pub fn from_median(residuals: &[(Observation, Vector2<f64>)]) -> Noise {
        fit(&aligned(residuals), |chi| {
            let middle = chi.len() / 2;
            *chi.select_nth_unstable_by(middle, f64::total_cmp).1 / MEDIAN_CHI_SQUARE_2
        })
    }

    /// Fitted to the mean, with `unknowns` numbers fitted to the same residuals.
    pub fn from_mean(residuals: &[(Observation, Vector2<f64>)], unknowns: usize) -> Noise {
        let freedom = (2 * residuals.len()).saturating_sub(unknowns).max(1) as f64;
        fit(&aligned(residuals), |chi| chi.iter().sum::<f64>() / freedom)
    }

    /// The likeliest noise with the loss that belongs to it, `unknowns` numbers being fitted to the same residuals:
    /// Gaussian, or Student's distribution where its tails are more than chance (Bayes' criterion for one number more).
    /// Pictures that nobody triggered have heavy tails, and some of their corners are simply wrong.
    pub fn likeliest(residuals: &[(Observation, Vector2<f64>)], unknowns: usize) -> (Noise, Loss) {
        /// Degrees of freedom that are tried; with fewer the tails of a pair that moved would be taken for the
        /// corners'.
        const FREEDOMS: [f64; 9] = [4.0, 5.0, 6.0, 8.0, 11.0, 16.0, 24.0, 36.0, 64.0];
        let freedom = (2 * residuals.len()).saturating_sub(unknowns).max(1) as f64;
        let aligned = aligned(residuals);
        let with = |loss: Loss| {
            let noise = fit(&aligned, |chi| chi.iter().map(|c| loss.weight(*c) * c).sum::<f64>() / freedom);
            (noise, loss, noise.log_likelihood_of(&aligned, loss))
        };
        let gaussian = with(Loss::Squared);
        let least = gaussian.2 + 0.5 * (residuals.len().max(1) as f64).ln();
        let likeliest = FREEDOMS.map(|freedom| with(Loss::Student(freedom))).into_iter();
        let likeliest = likeliest.filter(|student| student.2 > least).max_by(|a, b| a.2.total_cmp(&b.2));
        let (noise, loss, _) = likeliest.unwrap_or(gaussian);
        (noise, loss)
    }

    /// Logarithm of the likelihood of residuals, but for a constant.
    pub fn log_likelihood(&self, residuals: &[(Observation, Vector2<f64>)], loss: Loss) -> f64 {
        self.log_likelihood_of(&aligned(residuals), loss)
    }

    fn log_likelihood_of(&self, residuals: &[Aligned], loss: Loss) -> f64 {
        let added = self.added_px * self.added_px;
        let of = |aligned: &Aligned| {
            let [a, b] = aligned.map(|(_, own)| (self.factor * own + added).max(FLOOR_PX * FLOOR_PX));
            let squared = aligned[0].0 / a + aligned[1].0 / b;
            -0.5 * (a * b).ln() - loss.cost_and_weight(squared).0
        };
        residuals.iter().map(of).sum()
    }

    /// Median over the corners of the standard deviation of a coordinate, px.
    pub fn typical_px(&self, views: &[View]) -> f64 {
        median(in_use(views).map(|o| (self.covariance(o).trace() / 2.0).sqrt())).unwrap_or(self.added_px)
    }
}

/// The factor on the covariances after which the `reduced` chi-square of the corners is one; `first` is that with a
/// factor of one.
fn shrunk(chi: &[f64], first: f64, reduced: &impl Fn(&mut [f64]) -> f64) -> f64 {
    let mut factor = first.max(f64::MIN_POSITIVE.sqrt());
    // Where the reduced chi-square is a mean or a median, the first is right; weights that fall with chi-square need
    // some rounds.
    for _ in 0..100 {
        let ratio = reduced(&mut chi.iter().map(|c| c / factor).collect::<Vec<f64>>());
        if (ratio - 1.0).abs() < 1e-9 || !ratio.is_finite() || ratio <= 0.0 {
            break;
        }
        factor *= ratio;
    }
    factor
}

/// A residual along the axes of its corner's own covariance: squares, px^2, each with the variance it comes with.
type Aligned = [(f64, f64); 2];

fn aligned(residuals: &[(Observation, Vector2<f64>)]) -> Vec<Aligned> {
    let one = |(o, residual): &(Observation, Vector2<f64>)| {
        let eigen = o.covariance_px2.symmetric_eigen();
        let along = eigen.eigenvectors.tr_mul(residual);
        [0, 1].map(|k| (along[k] * along[k], eigen.eigenvalues[k]))
    };
    residuals.iter().map(one).collect()
}

/// Squared lengths in units of the covariances with `added` to both variances.
fn chi_squares(residuals: &[Aligned], added: f64) -> Vec<f64> {
    let part = |(square, variance): (f64, f64)| square / (variance + added).max(FLOOR_PX * FLOOR_PX);
    residuals.iter().map(|[a, b]| part(*a) + part(*b)).collect()
}

/// Finds the model whose `reduced` chi-square is one.
fn fit(residuals: &[Aligned], reduced: impl Fn(&mut [f64]) -> f64) -> Noise {
    if residuals.is_empty() {
        return Noise::UNIT;
    }
    let mut plain: Vec<f64> = residuals.iter().map(|[a, b]| a.0 + b.0).collect();
    let plain = reduced(&mut plain).max(FLOOR_PX * FLOOR_PX);
    let is_known = |[a, b]: &Aligned| a.1.max(b.1) > 0.0;
    if !residuals.iter().any(is_known) {
        return Noise { factor: 1.0, added_px: plain.sqrt(), reduced_chi_square: None };
    }
    let with = |added: f64| reduced(&mut chi_squares(residuals, added));
    let known = residuals.iter().all(is_known);
    let own = known.then(|| with(0.0));
    if let Some(own) = own.filter(|own| *own <= 1.0) {
        let factor = shrunk(&chi_squares(residuals, 0.0), own, &reduced);
        return Noise { factor, added_px: 0.0, reduced_chi_square: Some(own) };
    }
    // With the covariances in, less than the plain scatter is missing: it lies between zero and that. The inverse of
    // the reduced chi-square is nearly a straight line in the added variance.
    let missing = |added: f64| if added > 0.0 || known { 1.0 - 1.0 / with(added) } else { 1.0 };
    let added = crossing(0.0, plain, SAME * plain, missing);
    Noise { factor: 1.0, added_px: added.sqrt().max(FLOOR_PX), reduced_chi_square: own }
}

/// `W` with `W' W = Sigma^-1`, from the Cholesky factor.
pub fn whitener(covariance: &Matrix2<f64>) -> Matrix2<f64> {
    let l11 = covariance.m11.sqrt();
    let l21 = covariance.m12 / l11;
    let l22 = (covariance.m22 - l21 * l21).max(0.0).sqrt();
    let w = Matrix2::new(1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22);
    if w.iter().all(|v| v.is_finite()) { w } else { Matrix2::identity() / FLOOR_PX }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_added_gives_way_to_the_print_first() {
        let noise = Noise { factor: 1.0, added_px: 0.03, reduced_chi_square: None };
        // A tenth of the variance is the refinement's.
        assert_eq!(noise.of_share(1.0, 0.1), noise);
        assert_eq!(noise.of_share(0.1, 0.1), Noise { added_px: 0.0, ..noise });
        let half = noise.of_share(0.55, 0.1);
        assert!(half.factor == 1.0 && (half.added_px.powi(2) - 0.5 * 0.0009).abs() < 1e-12);
        // Where nothing is known of the corners, all of it is shared out.
        let unknown = noise.of_share(0.25, 0.0);
        assert!((unknown.added_px - 0.015).abs() < 1e-12);
        assert!((noise.of_share(0.05, 0.1).factor - 0.5).abs() < 1e-12);
    }
}
