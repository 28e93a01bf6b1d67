//! How far the link of the two pictures is off the common rig from pair to pair, what that does to the shared numbers,
//! and the rig of a few pairs whose motion is known.
//!
//! In: the normal equations of all pairs at their minimum. Out: the variances of that motion, and the covariance of the
//! shared numbers by it alone. Method: of a board that is held by hand before cameras that are not triggered together,
//! or of a right camera that is not clamped, each pair has a small motion of its own, drawn with a variance for each of
//! the six numbers of `right_from_left`; the variances are the likeliest ones (expectation and maximisation, Dempster,
//! Laird and Rubin 1977), and reach the shared numbers through the normal equations of the pairs. Many pairs tell them,
//! a few do not; where an earlier calibration of the cameras did, a few pairs are weighed by them (generalised least
//! squares), so that what the board's motion hides of a pair does not count as if the corners told it. Goes wrong:
//! pairs that do not tell the motion from their noise; its variances are then small.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::stereo::init::board_pose;
use crate::stereo::model::{Layout, Values};
use crate::stereo::solve::Problem;
use crate::stereo::solve::normal_equations::{Block, Equations};
use crate::stereo::solve::uncertainty::invert;

/// Rounds at the most, and the share of a variance and the noise beside it that is no change any more: variances that
/// are there have settled then, and those that are not have fallen to a few hundredths of what the noise hides.
const ROUNDS: usize = 100;
const STILL: f64 = 3e-4;

/// Chance that pairs which move as is known are said not to.
const CHANCE: f64 = 1e-3;

/// Steps of the weighed rig: the equations are nearly straight over what pairs move by.
const STEPS: usize = 2;

/// Variances of the six numbers of `right_from_left` from pair to pair, rad^2 and mm^2, as so many pairs of an earlier
/// calibration told them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KnownMotion {
    pub variances: Vector6<f64>,
    pub pairs: usize,
}

/// What a pair tells of the shared numbers and of its own motion, in units of the noise: the information of the shared
/// ones and their gradient.
struct Told {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Covariance of the shared numbers by the pairs' motions. `own` is the inverse of the normal equations, `inflation`
/// the variance of the whitened residuals. `None` where the transform is not among the shared numbers or the pairs do
/// not determine them.
pub fn covariance(equations: &Equations, layout: &Layout, own: &DMatrix<f64>, inflation: f64) -> Option<DMatrix<f64>> {
    let (pairs, variances) = told(equations, layout, inflation)?;
    let (at, variances) = (layout.transform_start(), Matrix6::from_diagonal(&variances));
    let own = own * inflation;
    let by_motion = pairs.iter().fold(DMatrix::zeros(own.nrows(), own.nrows()), |sum, pair| {
        let pull = pair.matrix.columns(at, 6);
        sum + pull * variances * pull.transpose()
    });
    Some(&own * by_motion * &own)
}

/// Variances of the six numbers from pair to pair, and those by which a pair usually tells them. `inflation` is as for
/// [`covariance`].
pub fn of_pairs(equations: &Equations, layout: &Layout, inflation: f64) -> Option<[Vector6<f64>; 2]> {
    let (pairs, variances) = told(equations, layout, inflation)?;
    Some([variances, by_noise(&pairs, layout.transform_start())])
}

/// What each pair tells, and the variances of the six numbers.
fn told(equations: &Equations, layout: &Layout, inflation: f64) -> Option<(Vec<Told>, Vector6<f64>)> {
    let at = layout.transform.then(|| layout.transform_start())?;
    let (pairs, prior) = in_units_of_noise(equations, inflation)?;
    let variances = variances(&pairs, &prior, at)?;
    Some((pairs, variances))
}

/// What each pair tells, and what is expected.
fn in_units_of_noise(equations: &Equations, inflation: f64) -> Option<(Vec<Told>, Told)> {
    let told = |block: &Block| {
        let (matrix, gradient) = block.reduced(0.0)?;
        Some(Told { matrix: matrix / inflation, gradient: gradient / inflation })
    };
    let pairs = equations.blocks.iter().map(told).collect::<Option<Vec<Told>>>()?;
    let prior = Told { matrix: &equations.prior.matrix / inflation, gradient: &equations.prior.gradient / inflation };
    Some((pairs, prior))
}

/// What the motions of the pairs pull at the shared numbers, six columns a pair, and what all pairs tell.
struct Pulls {
    columns: DMatrix<f64>,
    all: Told,
}

impl Pulls {
    fn new(pairs: &[Told], at: usize) -> Option<Pulls> {
        let n = pairs.first()?.gradient.len();
        let mut all = Told { matrix: DMatrix::zeros(n, n), gradient: DVector::zeros(n) };
        let mut columns = DMatrix::zeros(n, 6 * pairs.len());
        for (i, pair) in pairs.iter().enumerate() {
            columns.columns_mut(6 * i, 6).copy_from(&pair.matrix.columns(at, 6));
            all.matrix += &pair.matrix;
            all.gradient += &pair.gradient;
        }
        Some(Pulls { columns, all })
    }
}

/// What the pairs tell of the shared numbers where each has a motion of its own with these variances.
struct Weighed {
    /// Of each pair's motion, where the shared numbers are known.
    spreads: Vec<Matrix6<f64>>,
    /// How each pair's motion follows the shared numbers, six columns a pair.
    through: DMatrix<f64>,
    told: Told,
}

impl Weighed {
    fn new(pairs: &[Told], pulls: &Pulls, at: usize, variances: &Vector6<f64>) -> Option<Weighed> {
        let drawn = Matrix6::from_diagonal(&variances.map(|v| 1.0 / v));
        let spreads = pairs.iter().map(|pair| (link(pair, at) + drawn).try_inverse()).collect::<Option<Vec<_>>>()?;
        let mut through = pulls.columns.clone();
        let mut gradient = pulls.all.gradient.clone();
        for (i, (pair, spread)) in pairs.iter().zip(&spreads).enumerate() {
            let own = pulls.columns.fixed_columns::<6>(6 * i) * spread;
            gradient -= &own * pair.gradient.fixed_rows::<6>(at);
            through.fixed_columns_mut::<6>(6 * i).copy_from(&own);
        }
        let matrix = &pulls.all.matrix - &through * pulls.columns.transpose();
        Some(Weighed { spreads, through, told: Told { matrix, gradient } })
    }
}

/// The values that pairs with a known motion give, and the covariance of the shared numbers there. `problem` stands at
/// its minimum without a motion, where its covariance is `stated`; what is expected counts in it `lenses` times as much
/// as it is known to; `inflation` is as for [`covariance`]. `None` where the pairs move otherwise than is known, by
/// more than chance: then nothing is known of how to weigh them.
pub fn weighed(
    problem: &Problem,
    layout: &Layout,
    inflation: f64,
    lenses: f64,
    known: &KnownMotion,
    stated: &DMatrix<f64>,
) -> Option<(Values, DMatrix<f64>)> {
    let at = layout.transform.then(|| layout.transform_start())?;
    let mut problem = problem.clone();
    let mut covariance = None;
    for _ in 0..STEPS {
        let (pairs, prior) = in_units_of_noise(&problem.equations(layout)?, inflation)?;
        let by_pairs = Weighed::new(&pairs, &Pulls::new(&pairs, at)?, at, &known.variances)?.told;
        let shared = invert(&(&by_pairs.matrix + &prior.matrix))?;
        let step = -&shared * (&by_pairs.gradient + &prior.gradient);
        if !moves_as_known(&pairs, at, &step, known) {
            return None;
        }
        board_pose::move_shared(&mut problem.values, &problem.views, layout, &step);
        let excess = excess(&pairs, &prior, at, &known.variances, lenses, stated)?;
        covariance = Some(&shared * (by_pairs.matrix * excess + prior.matrix * lenses) * &shared);
    }
    Some((problem.values, covariance?))
}

/// By how much the covariance of `right_from_left` that is stated of pairs without a motion is larger than what noise
/// and the motions let expect, at least one: pairs scatter by more than a motion with six variances says.
fn excess(
    pairs: &[Told],
    prior: &Told,
    at: usize,
    variances: &Vector6<f64>,
    lenses: f64,
    stated: &DMatrix<f64>,
) -> Option<f64> {
    let own = invert(&pairs.iter().fold(prior.matrix.clone(), |sum, pair| sum + &pair.matrix))?;
    let drawn = Matrix6::from_diagonal(variances);
    let scatter = pairs.iter().fold(&prior.matrix * lenses, |sum, pair| {
        let pull = pair.matrix.columns(at, 6);
        sum + &pair.matrix + pull * drawn * pull.transpose()
    });
    let link = |covariance: &DMatrix<f64>| covariance.view((at, at), (6, 6)).into_owned();
    let expected = link(&(&own * scatter * &own));
    Some(((invert(&expected)? * link(stated)).trace() / 6.0).max(1.0))
}

/// Whether what the pairs leave of the link behind the step is chance where each moves as is known.
fn moves_as_known(pairs: &[Told], at: usize, step: &DVector<f64>, known: &KnownMotion) -> bool {
    let drawn = Matrix6::from_diagonal(&known.variances);
    let of_pair = |pair: &Told| {
        let link = link(pair, at);
        let left = pair.gradient.fixed_rows::<6>(at) + pair.matrix.rows(at, 6) * step;
        Some(left.dot(&((link + link * drawn * link).try_inverse()? * left)))
    };
    // The common link takes up the six numbers of one pair.
    let [own, earlier] = [pairs.len(), known.pairs].map(|pairs| 6.0 * pairs.saturating_sub(1) as f64);
    let chi_square: f64 = pairs.iter().map(|pair| of_pair(pair).unwrap_or(f64::INFINITY)).sum();
    FisherSnedecor::new(own, earlier).map_or(true, |f| chi_square <= own * f.inverse_cdf(1.0 - CHANCE))
}

fn link(pair: &Told, at: usize) -> Matrix6<f64> {
    pair.matrix.fixed_view::<6, 6>(at, at).into_owned()
}

/// Variances of the six numbers by the noise of a usual pair, each with the others known.
fn by_noise(pairs: &[Told], at: usize) -> Vector6<f64> {
    let known = pairs.iter().fold(Vector6::zeros(), |sum, pair| sum + link(pair, at).diagonal());
    known.map(|known| pairs.len() as f64 / known)
}

/// The likeliest variances of the six numbers from pair to pair, what the shared numbers take up of the motions allowed
/// for (restricted likelihood). The six begin with number `at` of the shared ones.
fn variances(pairs: &[Told], prior: &Told, at: usize) -> Option<Vector6<f64>> {
    let count = pairs.len() as f64;
    let pulls = Pulls::new(pairs, at)?;
    let noise = by_noise(pairs, at);
    let mut variances = noise;
    for _ in 0..ROUNDS {
        let Weighed { spreads, through, told } = Weighed::new(pairs, &pulls, at, &variances)?;
        let shared = invert(&(told.matrix + &prior.matrix))?;
        let step = -&shared * (told.gradient + &prior.gradient);
        let (followed, open) = (through.tr_mul(&step), (&shared * &through).component_mul(&through).row_sum());
        let mut sum = Vector6::zeros();
        for (i, (pair, spread)) in pairs.iter().zip(&spreads).enumerate() {
            let motion = spread * pair.gradient.fixed_rows::<6>(at) + followed.fixed_rows::<6>(6 * i);
            let open = spread.diagonal() + open.fixed_columns::<6>(6 * i).transpose();
            sum += motion.component_mul(&motion) + open;
        }
        let before = std::mem::replace(&mut variances, sum / count);
        if (variances - before).component_div(&(variances + noise)).amax() < STILL {
            break;
        }
    }
    Some(variances)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::draws::{Draws, Purpose};

    #[test]
    fn the_variance_of_a_motion_is_found_and_that_of_none_is_small() {
        let mut draws = Draws::new(3, Purpose::Points, 0);
        // A seventh shared number pulls as the second does; all but the motions is known before.
        let told: DMatrix<f64> = DMatrix::from_diagonal(&DVector::from_vec(vec![4e6, 1e6, 1e6, 1.0, 4.0, 0.1, 0.0]));
        let truth: [f64; 7] = [0.0, 5e-3, 0.0, 0.0, 0.0, 20.0, 0.0];
        let pairs: Vec<Told> = (0..200)
            .map(|_| {
                let motion = DVector::from_fn(7, |k, _| truth[k] * draws.normal());
                let noise = DVector::from_fn(7, |k, _| told[(k, k)].sqrt() * draws.normal());
                Told { matrix: told.clone(), gradient: &told * motion + noise }
            })
            .collect();
        let prior = Told { matrix: DMatrix::identity(7, 7), gradient: DVector::zeros(7) };
        let found = variances(&pairs, &prior, 0).unwrap().map(f64::sqrt);
        for k in 0..6 {
            let noise = 1.0 / told[(k, k)].sqrt();
            if truth[k] > 0.0 {
                assert!((found[k] / truth[k] - 1.0).abs() < 0.15, "{k}: {} for {}", found[k], truth[k]);
            } else {
                assert!(found[k] < 0.5 * noise, "{k}: {} beside noise of {noise}", found[k]);
            }
        }
    }

    #[test]
    fn what_the_shared_numbers_take_up_is_no_smaller_motion() {
        // Ten pairs, of whose turns four shared numbers take up their shares.
        let (pairs_of_each, rounds) = (10, 200);
        let mut mean: f64 = 0.0;
        let mut draws = Draws::new(5, Purpose::Points, 0);
        for _ in 0..rounds {
            let mut all: Vec<Told> = (0..pairs_of_each)
                .map(|_| {
                    // Each pair sees the turn and the four numbers as one sum, and the rest well.
                    let mut row = DVector::zeros(10);
                    row[0] = 1.0;
                    (6..10).for_each(|k| row[k] = draws.normal());
                    let turn = draws.normal();
                    let mut matrix = &row * row.transpose() * 1e6;
                    (1..6).for_each(|k| matrix[(k, k)] += 1e6);
                    Told { matrix, gradient: row * (1e6 * turn) }
                })
                .collect();
            let prior = Told { matrix: DMatrix::identity(10, 10) * 1e-6, gradient: DVector::zeros(10) };
            // The gradient at the minimum of all.
            let sum = all.iter().fold(prior.matrix.clone(), |sum, pair| sum + &pair.matrix);
            let pull = all.iter().fold(DVector::zeros(10), |sum, pair| sum + &pair.gradient);
            let step = -invert(&sum).unwrap() * pull;
            all.iter_mut().for_each(|pair| pair.gradient += &pair.matrix * &step);
            mean += variances(&all, &prior, 0).unwrap()[0] / f64::from(rounds);
        }
        assert!((mean - 1.0).abs() < 0.15, "{mean}");
    }
}
