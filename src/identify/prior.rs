//! Manufacturing tolerance as a prior, its size taken from the evidence of the data.
//!
//! In: the whitened Jacobian and residuals of a linearised fit. Out: rows that pull the base parameters towards nominal.
//! Each parameter's offset is Gaussian, 1 mm or 1 mrad times a factor of its kind; a base parameter that stands for others
//! has the variance of their combination. The factors maximise the probability of the data (type II maximum likelihood:
//! MacKay, "Bayesian interpolation", 1992) over a grid, one kind after the other.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::base::Base;
use super::blocks::product;
use crate::robot::Parameter;

/// Factors that are tried for every kind.
const GRID: [f64; 11] = [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

/// Rounds over the kinds; the evidence is nearly separable.
const ROUNDS: usize = 3;

/// Standard deviations in mm and mrad, by kind.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// Of links and joints: mm and mrad.
    pub links: f64,
    /// Of the target point: mm.
    pub target: f64,
    /// Of gravity and harmonics: mrad.
    pub corrections: f64,
}

impl Default for Tolerance {
    /// Loose: a start for the search.
    fn default() -> Tolerance {
        Tolerance { links: 10.0, target: 1000.0, corrections: 1.0 }
    }
}

impl Tolerance {
    fn of(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::V(_) => self.target,
            Parameter::Gravity(..) | Parameter::Harmonic(..) => self.corrections,
            _ => self.links,
        }
    }

    fn with(&self, kind: usize, value: f64) -> Tolerance {
        let mut changed = *self;
        *[&mut changed.links, &mut changed.target, &mut changed.corrections][kind] = value;
        changed
    }

    /// Covariance of the base parameters: their own, and what they stand for.
    pub fn covariance(&self, base: &Base, parameters: &[Parameter]) -> DMatrix<f64> {
        let variance = |i: &usize| self.of(parameters[*i]).powi(2);
        let mut covariance =
            DMatrix::from_diagonal(&DVector::from_iterator(base.free.len(), base.free.iter().map(variance)));
        let others = DVector::from_iterator(base.dependent.len(), base.dependent.iter().map(variance));
        covariance += &base.coefficients * DMatrix::from_diagonal(&others) * base.coefficients.transpose();
        covariance
    }

    /// Rows W with W' W the inverse of the covariance.
    pub fn rows(&self, base: &Base, parameters: &[Parameter]) -> DMatrix<f64> {
        let covariance = self.covariance(base, parameters);
        let inverse = Cholesky::new(covariance).and_then(|c| c.l().try_inverse());
        inverse.unwrap_or_else(|| DMatrix::zeros(0, base.free.len()))
    }

    /// The tolerance of greatest evidence for data that are linear in the base parameters: `residuals` at offset zero and
    /// `jacobian`, both white.
    pub fn from_evidence(
        base: &Base,
        parameters: &[Parameter],
        residuals: &DVector<f64>,
        jacobian: &DMatrix<f64>,
    ) -> Tolerance {
        let normal = product(jacobian, jacobian);
        let gradient = jacobian.tr_mul(residuals);
        let score = |t: &Tolerance| evidence(&t.covariance(base, parameters), &normal, &gradient);
        let present = |kind: usize| {
            let marked = Tolerance { links: 0.0, target: 0.0, corrections: 0.0 }.with(kind, 1.0);
            base.free.iter().any(|&i| marked.of(parameters[i]) > 0.0)
        };
        let mut best = (f64::NEG_INFINITY, Tolerance { links: 1.0, target: 10.0, corrections: 0.1 });
        for _ in 0..ROUNDS {
            for kind in (0..3).filter(|&k| present(k)) {
                for &value in &GRID {
                    let trial = best.1.with(kind, value);
                    let score = score(&trial);
                    if score > best.0 {
                        best = (score, trial);
                    }
                }
            }
        }
        best.1
    }
}

/// Logarithm of the data's probability up to what the prior does not touch.
fn evidence(covariance: &DMatrix<f64>, normal: &DMatrix<f64>, gradient: &DVector<f64>) -> f64 {
    let Some(root) = Cholesky::new(covariance.clone()).map(|c| c.l()) else { return f64::NEG_INFINITY };
    let inner = DMatrix::identity(normal.nrows(), normal.ncols()) + root.transpose() * normal * &root;
    let Some(inner) = Cholesky::new(inner) else { return f64::NEG_INFINITY };
    let pulled = root.transpose() * gradient;
    let log_determinant = 2.0 * inner.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    0.5 * (pulled.dot(&inner.solve(&pulled)) - log_determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_evidence_finds_the_size_that_made_the_data() {
        // Offsets of 3 mm seen through noise of 1: the factor 3 must beat 0.3 and 30.
        let n = 12;
        let parameters: Vec<Parameter> = (0..n).map(Parameter::A).collect();
        let jacobian = DMatrix::<f64>::identity(n, n) * 10.0;
        let base = Base::new(&jacobian, 1e-9);
        let residuals = DVector::from_fn(n, |i, _| if i % 2 == 0 { 30.0 } else { -30.0 });
        assert_eq!(Tolerance::from_evidence(&base, &parameters, &residuals, &jacobian).links, 3.0);
    }

    #[test]
    fn a_group_has_the_variance_of_its_sum() {
        let parameters = [Parameter::D(1), Parameter::D(2), Parameter::D(3)];
        let base = Base::new(&DMatrix::from_element(2, 3, 1.0), 1e-9);
        let tolerance = Tolerance { links: 2.0, ..Tolerance::default() };
        assert!((tolerance.covariance(&base, &parameters)[(0, 0)] - 12.0).abs() < 1e-12);
    }
}
