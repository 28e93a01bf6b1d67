//! How far corners scatter: the refinement's own covariances, corrected by what the residuals say.
//!
//! `Sigma_i = s C_i + tau^2 I`: `C_i` is the refinement's covariance (zero where it gave none), `tau` covers what it does not
//! know (blur, print, lens), `s < 1` shrinks covariances that were too large. One of the two is fitted, so that the
//! reduced chi-square is one; then the covariance of every result needs no further factor.

use nalgebra::{Matrix2, Vector2};

use super::observations::{Observation, View};

/// The noise model of all corners.
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

impl Noise {
    /// Every corner alike, one px.
    pub const UNIT: Noise = Noise { factor: 0.0, added_px: 1.0, reduced_chi_square: None };

    /// Covariance of a corner, px^2.
    pub fn covariance(&self, o: &Observation) -> Matrix2<f64> {
        o.covariance_px2 * self.factor + Matrix2::identity() * (self.added_px * self.added_px)
    }

    /// Sets the whiteners of all corners.
    pub fn apply(&self, views: &mut [View]) {
        for o in views.iter_mut().flat_map(|view| &mut view.observations) {
            o.whitener = whitener(&self.covariance(o));
        }
    }

    /// Fitted to the median, so that up to half of the corners may be wrong. `residuals` are the active corners' in px.
    pub fn from_median(residuals: &[(Observation, Vector2<f64>)]) -> Noise {
        fit(residuals, |chi| {
            let mut sorted = chi.to_vec();
            sorted.sort_by(f64::total_cmp);
            sorted[sorted.len() / 2] / MEDIAN_CHI_SQUARE_2
        })
    }

    /// Fitted to the mean, with `unknowns` numbers fitted to the same residuals.
    pub fn from_mean(residuals: &[(Observation, Vector2<f64>)], unknowns: usize) -> Noise {
        let freedom = (2 * residuals.len()).saturating_sub(unknowns).max(1) as f64;
        fit(residuals, |chi| chi.iter().sum::<f64>() / freedom)
    }

    /// Median over the corners of the standard deviation of a coordinate, px.
    pub fn typical_px(&self, views: &[View]) -> f64 {
        let mut all: Vec<f64> = views
            .iter()
            .flat_map(|view| view.observations.iter().filter(|o| o.active))
            .map(|o| (self.covariance(o).trace() / 2.0).sqrt())
            .collect();
        all.sort_by(f64::total_cmp);
        all.get(all.len() / 2).copied().unwrap_or(self.added_px)
    }
}

/// Finds the model whose `reduced` chi-square is one.
fn fit(residuals: &[(Observation, Vector2<f64>)], reduced: impl Fn(&[f64]) -> f64) -> Noise {
    if residuals.is_empty() {
        return Noise::UNIT;
    }
    let chi = |noise: &Noise| -> Vec<f64> {
        residuals.iter().map(|(o, r)| (whitener(&noise.covariance(o)) * r).norm_squared()).collect()
    };
    let plain = reduced(&chi(&Noise::UNIT)).sqrt().max(FLOOR_PX);
    let known = residuals.iter().all(|(o, _)| o.covariance_px2.m11 > 0.0);
    let own = known.then(|| reduced(&chi(&Noise { factor: 1.0, added_px: 0.0, reduced_chi_square: None })));
    if let Some(own) = own.filter(|own| *own <= 1.0) {
        let factor = own.max(f64::MIN_POSITIVE.sqrt());
        return Noise { factor, added_px: 0.0, reduced_chi_square: Some(own) };
    }
    // With the covariances in, less than the plain scatter is missing: the root lies between zero and it.
    let (mut low, mut high) = (0.0, plain);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        let noise = Noise { factor: 1.0, added_px: middle, reduced_chi_square: own };
        if middle > 0.0 && reduced(&chi(&noise)) > 1.0 { low = middle } else { high = middle }
    }
    Noise { factor: 1.0, added_px: high.max(FLOOR_PX), reduced_chi_square: own }
}

/// `W` with `W' W = Sigma^-1`, from the Cholesky factor.
fn whitener(covariance: &Matrix2<f64>) -> Matrix2<f64> {
    let l11 = covariance.m11.sqrt();
    let l21 = covariance.m12 / l11;
    let l22 = (covariance.m22 - l21 * l21).max(0.0).sqrt();
    let w = Matrix2::new(1.0 / l11, 0.0, -l21 / (l11 * l22), 1.0 / l22);
    if w.iter().all(|v| v.is_finite()) { w } else { Matrix2::identity() / FLOOR_PX }
}
