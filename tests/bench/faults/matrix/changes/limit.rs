//! From which size on a fault can be seen: the gain of chi-squared that it brings at the minimum of the faultless set,
//! every shared number and pose solved again, against what chance brings.

use super::super::series::ExposedPair;
use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use stereocal::imaging::Corners;
use stereocal::statistics::chi_square_quantile;
use stereocal::stereo::Rig;
use stereocal::stereo::calibrate::calibrate;
use stereocal::stereo::model::parameters::Layout;
use stereocal::stereo::select::options::Options;
use stereocal::stereo::solve::uncertainty::invert;

use super::super::set::Set;

/// One number over all pairs, or a place of the right camera in each of some pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    Series,
    Pairs,
}

/// Chance of seeing what is not there, all looks together, and as a quantile of the normal distribution.
const FALSE_ALARM: f64 = 1e-3;
const FALSE_ALARM_SIGMAS: f64 = 3.09;

/// Causes that are looked for at each place of the series, and numbers that the board's place takes away.
const CAUSES: f64 = 10.0;
const NUISANCE: f64 = 3.0;

/// Numbers of a place.
const PLACE: f64 = 6.0;

/// The normal equations of a faultless set, poses eliminated.
pub struct Linear {
    layout: Layout,
    matrices: Vec<DMatrix<f64>>,
    inverse: DMatrix<f64>,
}

impl Linear {
    pub fn new(corners: &Corners) -> Linear {
        let found = calibrate(corners, &Options::default()).expect("a faultless set can be calibrated");
        let equations = found.problem().equations(&found.layout).expect("a minimum");
        let matrices: Vec<DMatrix<f64>> =
            equations.blocks.iter().map(|block| block.reduced(0.0).expect("a pose").0).collect();
        let sum = matrices.iter().fold(equations.prior.matrix.clone(), |sum, m| sum + m);
        Linear { layout: found.layout, matrices, inverse: invert(&sum).expect("a rig") }
    }

    /// The planted size over the one from which it can be seen.
    pub fn share_of_limit(&self, clean: &Set, planted: &Set, spread: Spread) -> f64 {
        let changes: Vec<DVector<f64>> =
            planted.pairs.iter().map(|pair| self.change(&clean.rig, &rig_of(clean, pair))).collect();
        let mut shared = DVector::zeros(self.layout.count());
        let mut own = 0.0;
        for (matrix, change) in self.matrices.iter().zip(&changes) {
            let product = matrix * change;
            own += change.dot(&product);
            shared += product;
        }
        let gain: f64 = own - shared.dot(&(&self.inverse * &shared));
        let changed = changes.iter().filter(|change| change.norm() > 0.0).count() as f64;
        (gain.max(0.0) / self.needed(spread, changed)).sqrt()
    }

    fn needed(&self, spread: Spread, changed: f64) -> f64 {
        let count = self.matrices.len() as f64;
        match spread {
            Spread::Series => {
                let looks = CAUSES * (count - 2.0);
                let f = FisherSnedecor::new(1.0, count - 2.0 - NUISANCE).expect("more pairs than numbers");
                f.inverse_cdf(1.0 - FALSE_ALARM / looks)
            }
            Spread::Pairs => {
                let freedom = PLACE * changed.clamp(1.0, count - 1.0);
                chi_square_quantile(freedom, FALSE_ALARM_SIGMAS) - freedom
            }
        }
    }

    fn change(&self, from: &Rig, to: &Rig) -> DVector<f64> {
        let mut change = DVector::zeros(self.layout.count());
        for side in stereocal::imaging::Side::BOTH {
            let (a, b, at) = (from.camera(side), to.camera(side), self.layout.camera_start(side));
            let numbers = [b.fx - a.fx, b.fy - a.fy, b.cx - a.cx, b.cy - a.cy];
            change.rows_mut(at, 4).copy_from_slice(&numbers);
        }
        let at = self.layout.transform_start();
        let (a, b) = (&from.right_from_left, &to.right_from_left);
        change.rows_mut(at, 3).copy_from(&(b.rotation * a.rotation.inverse()).scaled_axis());
        change.rows_mut(at + 3, 3).copy_from(&(b.translation.vector - a.translation.vector));
        change
    }
}

/// The rig as it was for one pair: where its right picture was taken from, in units of the squares of the usual board.
pub fn rig_of(clean: &Set, pair: &ExposedPair) -> Rig {
    let [left, right] = &pair.sides;
    let mut right_from_left = right.camera_from_board * left.camera_from_board.inverse();
    let usual = clean.pairs[0].sides[0].board.workmanship.scale_ppm;
    right_from_left.translation.vector /= 1.0 + (left.board.workmanship.scale_ppm - usual) * 1e-6;
    Rig { left: left.camera, right: right.camera, right_from_left, covariance: None }
}
