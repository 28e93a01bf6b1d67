//! Do the pairs scatter about the common rig as much as their corners' noise lets expect, and the covariance that
//! allows for more.
//!
//! In: the normal equations of all pairs at their minimum, the groups of pairs with nearly the same pose, and the
//! covariance by the corners' noise. Out: the ratio of the scatter found to the one expected, and the covariance.
//! Method: the jackknife over groups (the group-clustered sandwich with its small-sample correction, CR3 of Bell and
//! McCaffrey 2002) holds whatever hangs together within a pair: a lens, a board or light that the model lacks. With
//! heavy tails a group that goes also changes what the others' corners weigh; the curvature of the loss has that in it
//! (the M-estimator's sandwich, Huber 1981, section 7.6). Some ten groups know a scatter in some twenty directions
//! badly, so that it is shrunk towards what the corners' noise and a motion of each pair's own ([`pair_motion`]) would
//! give, at the scatter's own size (Ledoit and Wolf 2004), and taken only where it is larger than what these two give.
//! Goes wrong: groups without which the others do not determine the cameras; then there is no ratio, and nothing is
//! enlarged.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use crate::stereo::model::Layout;
use crate::stereo::select::cross_validation::Without;
use crate::stereo::select::pair_motion;
use crate::stereo::solve::Equations;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PairScatter {
    /// Groups of pairs with poses of their own.
    pub groups: usize,
    /// Variance of the shared numbers by the groups' scatter over the one by the corners' noise, mean over all
    /// directions; `None` where not every group can be left out.
    pub ratio: Option<f64>,
}

/// The groups of pairs, and the rig without each of them.
pub struct Jackknife<'a> {
    /// The normal equations at the minimum, with the corners' weights.
    pub equations: &'a Equations,
    /// The same with the loss's own curvature.
    pub curvature: &'a Equations,
    /// The group of every pair.
    pub group_of: &'a [usize],
    /// What is free.
    pub layout: &'a Layout,
    /// The rig without each group, by the curvature.
    pub without: &'a [Option<Without>],
    /// What the covariance is at least, over the one by the corners' noise: pairs of an earlier calibration may say so.
    pub least: f64,
    /// The same of what is expected of lenses that are known, which counts by so much more than the corners do.
    pub lenses: f64,
}

impl Jackknife<'_> {
    /// The covariance of the shared numbers that allows for how the groups scatter; `by_noise` is the one by the
    /// corners' noise, `inflation` the factor in it over the normal equations' own.
    pub fn covariance(&self, by_noise: &DMatrix<f64>, inflation: f64) -> (DMatrix<f64>, PairScatter) {
        let groups = self.without.len();
        let all: Option<Vec<&Without>> = self.without.iter().map(Option::as_ref).collect();
        match all.and_then(|all| self.enlarge(by_noise, inflation, &all)) {
            Some((covariance, ratio)) => (covariance, PairScatter { groups, ratio: Some(ratio) }),
            None => (by_noise * self.lenses, PairScatter { groups, ratio: None }),
        }
    }

    fn enlarge(&self, by_noise: &DMatrix<f64>, inflation: f64, without: &[&Without]) -> Option<(DMatrix<f64>, f64)> {
        let (n, groups) = (by_noise.nrows(), without.len());
        if groups < 2 || n == 0 {
            return None;
        }
        let (root, inverse_root) = roots(by_noise)?;
        let correction = (groups - 1) as f64 / groups as f64;
        // Of the step without a group what the others tell.
        let told: Vec<DMatrix<f64>> = without
            .iter()
            .map(|w| told_by_others(&inverse_root * &w.covariance * inverse_root.transpose() * inflation))
            .collect();
        let steps: Vec<DVector<f64>> = without
            .iter()
            .zip(&told)
            .map(|(w, told)| told * (&inverse_root * &w.step) * (groups as f64 * correction).sqrt())
            .collect();
        // What the noise alone makes of the jackknife: groups that weigh much in a direction stretch it.
        let own = by_noise / inflation;
        let (weighted, curved) = (reduced(self.equations)?, reduced(self.curvature)?);
        let sum = |all: &[DMatrix<f64>]| all.iter().fold(DMatrix::zeros(n, n), |sum, m| sum + m);
        let slope = (&own * sum(&curved)).trace() / (&own * sum(&weighted)).trace();
        let mut expected = 0.0;
        for (group, without) in without.iter().enumerate() {
            let in_group = weighted.iter().zip(self.group_of).filter(|(_, of)| **of == group);
            let information = in_group.fold(DMatrix::zeros(n, n), |sum, (m, _)| sum + m);
            let gradient = &information - &information * &own * &information;
            let step = &told[group] * &inverse_root * &without.covariance * slope;
            expected += inflation * correction * (&step * gradient).dot(&step);
        }
        let scatter = steps.iter().fold(DMatrix::zeros(n, n), |sum, x| sum + x * x.transpose()) / groups as f64;
        let stretch = (expected / n as f64).max(1.0);
        let ratio = scatter.trace() / n as f64 / stretch;
        let moved = pair_motion::covariance(self.equations, self.layout, &own, inflation);
        let by_motion = moved.map_or(DMatrix::zeros(n, n), |moved| &inverse_root * moved * inverse_root.transpose());
        // What is expected counts by the factor beside the corners, so that it is known as much worse than the
        // equations say.
        let more = (self.lenses - self.least) / inflation;
        let by_lenses = root.transpose() * &self.equations.prior.matrix * &root * more;
        let floor = DMatrix::identity(n, n) * self.least + by_lenses + &by_motion;
        let shrunk = shrunk(&scatter, &steps, DMatrix::identity(n, n) + by_motion) / stretch;
        let (floor_root, floor_inverse) = roots(&floor)?;
        let eigen = (&floor_inverse * shrunk * floor_inverse.transpose()).symmetric_eigen();
        let larger = eigen.eigenvalues.map(|v| v.max(1.0));
        let factor = &eigen.eigenvectors * DMatrix::from_diagonal(&larger) * eigen.eigenvectors.transpose();
        let factor = &floor_root * factor * floor_root.transpose();
        let covariance = &root * factor * root.transpose();
        (ratio.is_finite() && covariance.iter().all(|v| v.is_finite()))
            .then(|| (0.5 * (&covariance + covariance.transpose()), ratio))
    }
}

/// Projection on the directions that the rig without a group knows hardly worse than the one with it; `covariance` is
/// its in units of the latter's. What a group alone tells (the distortion at a border that one pair reaches) no other
/// pair checks: without it those numbers go anywhere, and a step there says nothing of how pairs scatter.
fn told_by_others(covariance: DMatrix<f64>) -> DMatrix<f64> {
    /// Most by which the variance grows in a direction that the others tell, too.
    const MOST_GROWTH: f64 = 100.0;
    let n = covariance.nrows();
    // No variance in any direction is larger than this norm.
    if covariance.norm() <= MOST_GROWTH {
        return DMatrix::identity(n, n);
    }
    let eigen = (0.5 * (&covariance + covariance.transpose())).symmetric_eigen();
    let lost = (0..n).filter(|&i| eigen.eigenvalues[i] > MOST_GROWTH).map(|i| eigen.eigenvectors.column(i));
    lost.fold(DMatrix::identity(n, n), |kept, direction| kept - direction * direction.transpose())
}

/// Each pair's share of the normal equations of the shared numbers.
fn reduced(equations: &Equations) -> Option<Vec<DMatrix<f64>>> {
    equations.blocks.iter().map(|block| Some(block.reduced(0.0)?.0)).collect()
}

/// The scatter matrix of some samples shrunk towards the multiple of `shape` with the same trace, by as much as its own
/// scatter says.
fn shrunk(scatter: &DMatrix<f64>, samples: &[DVector<f64>], shape: DMatrix<f64>) -> DMatrix<f64> {
    let target = &shape * (scatter.trace() / shape.trace());
    let distance = (scatter - &target).norm_squared();
    let count = samples.len() as f64;
    let noise = samples.iter().map(|x| (x * x.transpose() - scatter).norm_squared()).sum::<f64>() / (count * count);
    let share = if distance > 0.0 { (noise / distance).min(1.0) } else { 1.0 };
    target * share + scatter * (1.0 - share)
}

/// The symmetric square root of a covariance whose rows have different units, and its inverse: `root root'` is the
/// covariance.
fn roots(covariance: &DMatrix<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let scale = covariance.diagonal().map(f64::sqrt);
    if !scale.iter().all(|s| s.is_finite() && *s > 0.0) {
        return None;
    }
    let n = covariance.nrows();
    let unit = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (scale[i] * scale[j]));
    let eigen = unit.symmetric_eigen();
    if eigen.eigenvalues.min() <= 0.0 {
        return None;
    }
    let power = |p: f64| {
        let values = DMatrix::from_diagonal(&eigen.eigenvalues.map(|v| v.powf(p)));
        &eigen.eigenvectors * values * eigen.eigenvectors.transpose()
    };
    let root = DMatrix::from_diagonal(&scale) * power(0.5);
    let inverse = power(-0.5) * DMatrix::from_diagonal(&scale.map(|s| 1.0 / s));
    Some((root, inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_group_alone_tells_is_no_scatter() {
        // The second of these directions, a turned one, is known a thousand times less well without the group.
        let turn = DMatrix::from_row_slice(3, 3, &[0.8, -0.6, 0.0, 0.6, 0.8, 0.0, 0.0, 0.0, 1.0]);
        let kept = |growth: f64| {
            let covariance =
                &turn * DMatrix::from_diagonal(&DVector::from_vec(vec![1.2, growth, 3.0])) * turn.transpose();
            told_by_others(covariance) * DVector::from_vec(vec![1.0, 2.0, 3.0])
        };
        assert!((kept(50.0) - DVector::from_vec(vec![1.0, 2.0, 3.0])).norm() < 1e-12);
        let lost = turn.column(1) * turn.column(1).dot(&DVector::from_vec(vec![1.0, 2.0, 3.0]));
        assert!((kept(1e6) - (DVector::from_vec(vec![1.0, 2.0, 3.0]) - lost)).norm() < 1e-9);
    }
}
