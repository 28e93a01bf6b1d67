//! Manufacturing tolerance as a prior, its size taken from the evidence of the data.
//!
//! In: the whitened Jacobian and residuals of a linearised fit. Out: rows that pull the base parameters towards
//! nominal. Each parameter's offset is Gaussian with the standard deviation of its kind; a base parameter that stands
//! for others has the variance of their combination, and its correction is spread over them as their tolerances say.
//! The factors maximise the probability of the data (type II maximum likelihood: MacKay, "Bayesian interpolation",
//! 1992) over a grid, one kind after the other.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, LU};

use super::base::Base;
use crate::identify::sensor::Extra;
use crate::linear_algebra::product;
use crate::robot::Parameter;

/// Standard deviations that are tried for every kind, mm, mrad or thousandths.
const GRID: [f64; 13] = [1e-3, 3e-3, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

/// Largest of them by kind (lengths, angles, target, gravity, harmonics, couplings, zero, warps): what no workshop gets
/// wrong.
const LARGEST: [f64; KINDS] = [30.0, 30.0, 1000.0, 30.0, 10.0, 30.0, 100.0, 30.0];

/// Logarithm of the evidence that a standard deviation may lack: one in three.
const DOUBT: f64 = 1.0;

/// Rounds over the kinds; the evidence is nearly separable.
const ROUNDS: usize = 2;

/// A turn of the target that was mounted by hand, mrad: no information.
const TARGET_TURN_MRAD: f64 = 3000.0;

const KINDS: usize = 8;

/// Index of the kind of lengths.
const LENGTHS: usize = 0;

/// Index of the kind of zeros, and standard deviations that the search starts from, mm.
const ZERO: usize = 6;
const ZERO_STARTS: [f64; 4] = [0.03, 0.3, 1.0, 3.0];

/// Standard deviations by kind.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// Of the lengths of links and joints, mm.
    pub lengths_mm: f64,
    /// Of twists and joint offsets, mrad.
    pub angles_mrad: f64,
    /// Of the target point, mm.
    pub target_mm: f64,
    /// Of compliances, mrad a metre of lever.
    pub gravity_mrad_per_m: f64,
    /// Of periodic errors, mrad.
    pub harmonics_mrad: f64,
    /// Of scale and coupling of joints, thousandths.
    pub couplings_per_mille: f64,
    /// Of the zero of distances, mm.
    pub zero_mm: f64,
    /// Of the sensor's warps, thousandths.
    pub warps_per_mille: f64,
}

fn kind(parameter: Parameter) -> usize {
    match parameter {
        Parameter::A(_) | Parameter::D(_) => 0,
        Parameter::Alpha(_) | Parameter::Theta(_) | Parameter::Beta(_) => 1,
        Parameter::V(_) => 2,
        Parameter::Gravity(..) | Parameter::Bending(..) => 3,
        Parameter::Harmonic(..) | Parameter::Wobble(..) => 4,
        Parameter::Coupling(..) => 5,
    }
}

fn extra_kind(extra: Extra) -> Option<usize> {
    match extra {
        Extra::Zero => Some(6),
        Extra::Warp(_) => Some(7),
        Extra::Target(_) | Extra::Shared(_) => None,
    }
}

impl Tolerance {
    /// Loose: a start for the search.
    pub const START: Tolerance = Tolerance {
        lengths_mm: 10.0,
        angles_mrad: 10.0,
        target_mm: 1000.0,
        gravity_mrad_per_m: 1.0,
        harmonics_mrad: 1.0,
        couplings_per_mille: 1.0,
        zero_mm: 1.0,
        warps_per_mille: 1.0,
    };

    fn kinds(&mut self) -> [&mut f64; KINDS] {
        [
            &mut self.lengths_mm,
            &mut self.angles_mrad,
            &mut self.target_mm,
            &mut self.gravity_mrad_per_m,
            &mut self.harmonics_mrad,
            &mut self.couplings_per_mille,
            &mut self.zero_mm,
            &mut self.warps_per_mille,
        ]
    }

    fn values(mut self) -> [f64; KINDS] {
        self.kinds().map(|value| *value)
    }

    fn with(mut self, kind: usize, value: f64) -> Tolerance {
        *self.kinds()[kind] = value;
        self
    }

    /// Standard deviation of a parameter, mm or mrad.
    pub fn of(&self, parameter: Parameter) -> f64 {
        self.values()[kind(parameter)]
    }

    fn of_extra(&self, extra: Extra) -> f64 {
        match (extra, extra_kind(extra)) {
            (_, Some(kind)) => self.values()[kind],
            (Extra::Target(_), _) => TARGET_TURN_MRAD,
            _ => 1.0,
        }
    }

    /// Covariance of the base parameters, their own and what they stand for, and of the extra unknowns after them.
    pub fn covariance(&self, base: &Base, parameters: &[Parameter], extras: &[Extra]) -> DMatrix<f64> {
        let variance = |i: &usize| self.of(parameters[*i]).powi(2);
        let (rank, count) = (base.free.len(), base.free.len() + extras.len());
        let mut covariance = DMatrix::zeros(count, count);
        let others = DMatrix::from_fn(rank, base.dependent.len(), |r, c| {
            base.coefficients[(r, c)] * self.of(parameters[base.dependent[c]])
        });
        covariance.view_mut((0, 0), (rank, rank)).copy_from(&product(&others.transpose(), &others.transpose()));
        for (k, i) in base.free.iter().enumerate() {
            covariance[(k, k)] += variance(i);
        }
        for (k, &extra) in extras.iter().enumerate() {
            covariance[(rank + k, rank + k)] = self.of_extra(extra).powi(2);
        }
        covariance
    }

    /// Rows W with W' W the inverse of the covariance.
    pub fn rows(&self, base: &Base, parameters: &[Parameter], extras: &[Extra]) -> DMatrix<f64> {
        let covariance = self.covariance(base, parameters, extras);
        let count = covariance.nrows();
        let inverse = Cholesky::new(covariance).and_then(|c| c.l().try_inverse());
        inverse.unwrap_or_else(|| DMatrix::zeros(0, count))
    }

    /// How a vector of base parameters is spread over all parameters: the most probable offsets that amount to it.
    pub fn spread(&self, base: &Base, parameters: &[Parameter]) -> DMatrix<f64> {
        let rank = base.free.len();
        // Base parameters as sums of all parameters, each in units of its tolerance.
        let mut sums = DMatrix::zeros(rank, parameters.len());
        for (k, &i) in base.free.iter().enumerate() {
            sums[(k, i)] = self.of(parameters[i]);
        }
        for (c, &i) in base.dependent.iter().enumerate() {
            for k in 0..rank {
                sums[(k, i)] = base.coefficients[(k, c)] * self.of(parameters[i]);
            }
        }
        let inverse = Cholesky::new(&sums * sums.transpose()).map(|c| c.inverse());
        let inverse = inverse.unwrap_or_else(|| DMatrix::identity(rank, rank));
        let mut spread = sums.transpose() * inverse;
        for (i, mut row) in spread.row_iter_mut().enumerate() {
            row *= self.of(parameters[i]);
        }
        spread
    }

    /// The tolerance of greatest evidence for all parameters as they are, whether or not the data tell them apart; with
    /// the evidence. `normal` and `gradient` as in [`Likelihood`].
    pub fn from_evidence_of_all(
        parameters: &[Parameter],
        extras: &[Extra],
        normal: &DMatrix<f64>,
        gradient: &DVector<f64>,
    ) -> (Tolerance, f64) {
        let score = |t: &Tolerance| evidence_of_all(&t.standard_deviations(parameters, extras), normal, gradient);
        best_of_grid(parameters, extras, &LARGEST, &score)
    }

    /// One a parameter, then one an extra.
    pub fn standard_deviations(&self, parameters: &[Parameter], extras: &[Extra]) -> Vec<f64> {
        parameters.iter().map(|&p| self.of(p)).chain(extras.iter().map(|&e| self.of_extra(e))).collect()
    }
}

/// Data that are linear in the base parameters and extras.
#[derive(Debug, Clone, Copy)]
pub struct Likelihood<'a> {
    pub base: &'a Base,
    pub parameters: &'a [Parameter],
    pub extras: &'a [Extra],
    /// The product of the white Jacobian with itself.
    pub normal: &'a DMatrix<f64>,
    /// Its product with the white residuals at offset zero.
    pub gradient: &'a DVector<f64>,
}

impl Likelihood<'_> {
    fn evidence(&self, tolerance: &Tolerance) -> f64 {
        evidence(&tolerance.covariance(self.base, self.parameters, self.extras), self.normal, self.gradient)
    }

    /// The parameters that base parameters are of, or stand for: their tolerances are what the data tell.
    fn seen(&self) -> Vec<Parameter> {
        (0..self.parameters.len()).filter(|i| !self.base.zero.contains(i)).map(|i| self.parameters[i]).collect()
    }

    /// The tolerance of greatest evidence.
    pub fn most_probable(&self) -> Tolerance {
        best_of_grid(&self.seen(), self.extras, &LARGEST, &|t| self.evidence(t)).0
    }

    /// Logarithm of how much more probable the data are with this tolerance than with any that has lengths off by at
    /// most so much, mm.
    pub fn odds_of_lengths_beyond(&self, most_mm: f64, tolerance: &Tolerance) -> f64 {
        let largest = std::array::from_fn(|k| if k == LENGTHS { most_mm } else { LARGEST[k] });
        self.evidence(tolerance) - best_of_grid(&self.seen(), self.extras, &largest, &|t| self.evidence(t)).1
    }

    /// The largest standard deviations, kind by kind, that the data make next to as probable as these: few poses say
    /// little of how well a robot was made, and what they leave open is as uncertain as it may be.
    pub fn at_most(&self, tolerance: &Tolerance) -> Tolerance {
        let least = self.evidence(tolerance) - DOUBT;
        let present = presence(&self.seen(), self.extras);
        let mut most = *tolerance;
        for kind in (0..KINDS).filter(|&k| present[k]) {
            let larger = GRID.iter().filter(|v| **v > tolerance.values()[kind] && **v <= LARGEST[kind]);
            for &value in larger.take_while(|v| self.evidence(&tolerance.with(kind, **v)) > least) {
                most = most.with(kind, value);
            }
        }
        most
    }
}

fn presence(parameters: &[Parameter], extras: &[Extra]) -> [bool; KINDS] {
    let mut present = [false; KINDS];
    for kind in parameters.iter().map(|&p| kind(p)).chain(extras.iter().filter_map(|&e| extra_kind(e))) {
        present[kind] = true;
    }
    present
}

/// The tolerance of greatest score of which no kind is larger than these.
fn best_of_grid(
    parameters: &[Parameter],
    extras: &[Extra],
    largest: &[f64; KINDS],
    score: &dyn Fn(&Tolerance) -> f64,
) -> (Tolerance, f64) {
    let present = presence(parameters, extras);
    let start = Tolerance { lengths_mm: 1.0, angles_mrad: 1.0, target_mm: 10.0, ..Tolerance::START };
    let from = |start: Tolerance| {
        let mut best = (start, score(&start));
        for _ in 0..ROUNDS {
            for kind in (0..KINDS).filter(|&k| present[k]) {
                for &value in GRID.iter().filter(|v| **v <= largest[kind]) {
                    let trial = best.0.with(kind, value);
                    let score = score(&trial);
                    if score > best.1 {
                        best = (trial, score);
                    }
                }
            }
        }
        best
    };
    if !present[ZERO] {
        return from(start);
    }
    // A zero and the robot's size can look the same: what the one takes the other need not, and one kind after the
    // other does not get from here to there.
    let rest = |best: (Tolerance, f64), next: (Tolerance, f64)| if next.1 > best.1 { next } else { best };
    ZERO_STARTS.iter().map(|&zero_mm| from(Tolerance { zero_mm, lengths_mm: 0.3, ..start })).fold(from(start), rest)
}

/// Logarithm of the data's probability up to what the prior does not touch, for unknowns that are independent before
/// the data: of these standard deviations. `normal` and `gradient` as in [`Likelihood`].
pub fn evidence_of_all(sds: &[f64], normal: &DMatrix<f64>, gradient: &DVector<f64>) -> f64 {
    let n = sds.len();
    let inner = DMatrix::from_fn(n, n, |r, c| sds[r] * sds[c] * normal[(r, c)] + if r == c { 1.0 } else { 0.0 });
    let pulled = DVector::from_fn(n, |r, _| sds[r] * gradient[r]);
    if let Some(inner) = Cholesky::new(inner.clone()) {
        let log_determinant = 2.0 * inner.l_dirty().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        return 0.5 * (pulled.dot(&inner.solve(&pulled)) - log_determinant);
    }
    // Data without noise weigh so much that the one of the prior is lost in rounding where they tell nothing: there it
    // is put back.
    let eigen = inner.symmetric_eigen();
    let along = eigen.eigenvectors.tr_mul(&pulled);
    let of_each =
        eigen.eigenvalues.iter().zip(&along).map(|(value, pull)| pull * pull / value.max(1.0) - value.max(1.0).ln());
    0.5 * of_each.sum::<f64>()
}

/// I + N C of a product N of the white Jacobian with itself and a covariance C before the data, and the logarithm of
/// its determinant.
pub fn weighed(normal: &DMatrix<f64>, covariance: &DMatrix<f64>) -> (LU<f64, Dyn, Dyn>, f64) {
    let mut inner = normal * covariance;
    for i in 0..inner.nrows() {
        inner[(i, i)] += 1.0;
    }
    let lu = inner.lu();
    let log_determinant = lu.u().diagonal().iter().map(|d| d.abs().ln()).sum();
    (lu, log_determinant)
}

/// Logarithm of the data's probability up to what the prior does not touch.
fn evidence(covariance: &DMatrix<f64>, normal: &DMatrix<f64>, gradient: &DVector<f64>) -> f64 {
    if normal.is_empty() {
        return 0.0;
    }
    // log N = (g' C (I + N C)^-1 g - log det(I + N C)) / 2
    let (lu, log_determinant) = weighed(normal, covariance);
    match lu.solve(gradient) {
        Some(solved) => 0.5 * (gradient.dot(&(covariance * solved)) - log_determinant),
        None => f64::NEG_INFINITY,
    }
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
        let (normal, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residuals));
        let data =
            Likelihood { base: &base, parameters: &parameters, extras: &[], normal: &normal, gradient: &gradient };
        assert_eq!(data.most_probable().lengths_mm, 3.0);
    }

    #[test]
    fn lengths_that_are_off_by_more_than_a_limit_are_told_from_angles() {
        // Ten lengths, each seen with an angle that acts alike but for its size.
        let parameters: Vec<Parameter> = (0..10).flat_map(|i| [Parameter::A(i), Parameter::Theta(i)]).collect();
        let jacobian = DMatrix::<f64>::identity(20, 20);
        let base = Base::new(&jacobian, 1e-9);
        let odds = |mm: f64| {
            let sign = |i: usize| if i % 4 < 2 { 1.0 } else { -1.0 };
            let residuals = DVector::from_fn(20, |i, _| sign(i) * if i % 2 == 0 { mm } else { 1.0 });
            let (normal, gradient) = (jacobian.tr_mul(&jacobian), jacobian.tr_mul(&residuals));
            let data =
                Likelihood { base: &base, parameters: &parameters, extras: &[], normal: &normal, gradient: &gradient };
            data.odds_of_lengths_beyond(3.0, &data.most_probable())
        };
        assert_eq!(odds(2.0), 0.0);
        assert!(odds(30.0) > 10.0, "{}", odds(30.0));
    }

    #[test]
    fn a_group_has_the_variance_of_its_sum() {
        let parameters = [Parameter::D(1), Parameter::D(2), Parameter::D(3)];
        let base = Base::new(&DMatrix::from_element(2, 3, 1.0), 1e-9);
        let tolerance = Tolerance { lengths_mm: 2.0, ..Tolerance::START };
        assert!((tolerance.covariance(&base, &parameters, &[])[(0, 0)] - 12.0).abs() < 1e-12);
        // Equal tolerances share a correction equally.
        let spread = tolerance.spread(&base, &parameters);
        assert!(spread.iter().all(|s| (s - 1.0 / 3.0).abs() < 1e-12), "{spread}");
    }
}
