//! The pairs of a calibration as a linear problem: what a change of the rig along the series would gain.
//!
//! In: a problem at its minimum. Out: for any change of the shared numbers that grows along the series by a pattern,
//! how large it is and what it gains, all shared numbers and poses solved again. Method: each pair's share of the
//! normal equations at the minimum; a change is a few columns more, solved in one elimination. Where a pair's residual
//! depends on where its board stood (a lens that lacks something), that would look like a change wherever the board was
//! moved in one direction: whether a change is there at all is asked with the same change as a function of the board's
//! place as a nuisance. Its scatter is that of the pairs after the change was taken out: what all pairs do.

use nalgebra::{DMatrix, DVector};

use crate::statistics::median;
use crate::stereo::model::Layout;
use crate::stereo::solve::Problem;
use crate::stereo::solve::normal_equations::Block;
use crate::stereo::solve::uncertainty::invert;

/// Fewest pairs for which the board's place is a nuisance: three numbers more must leave some for the scatter.
pub const PLACES_FROM: usize = 12;

/// A change and what it explains.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// In each of its directions, in units of them.
    pub amounts: DVector<f64>,
    /// Standard deviation of the first of these, as the pairs scatter.
    pub sigma: f64,
    /// What all pairs share takes up of it, so that the rig of a pair is the common one, this less, and its own part of
    /// the change.
    pub common: DVector<f64>,
    /// By how much chi-squared falls.
    pub gain: f64,
    /// Variance of the pairs' residuals about the rig, with the change, over what their corners let expect: below one
    /// where what the corners are said to scatter by has the change in it.
    pub scatter: f64,
}

/// One direction over the series: what any pattern of it gains is a quadratic form over the pairs.
pub struct Line {
    /// Slope of the gradient by the amounts of two pairs, all shared numbers and poses solved again, what goes with the
    /// board's place taken out.
    form: DMatrix<f64>,
    /// Each pair's gradient along the direction, with the same taken out.
    gradient: DVector<f64>,
    /// Each pair's weight in the scatter along it.
    weights: Vec<f64>,
    freedom: f64,
}

impl Line {
    /// F of a pattern: what it gains over the pairs' scatter with it taken out. Zero where the pairs do not determine
    /// it.
    pub fn f(&self, pattern: &DVector<f64>) -> f64 {
        /// Share of a pattern's information that rounding may be.
        const ROUNDING: f64 = 1e-12;
        let turned = &self.form * pattern;
        let information = pattern.dot(&turned);
        if information <= ROUNDING * pattern.norm_squared() * self.form.diagonal().max() {
            return 0.0;
        }
        let amount = -pattern.dot(&self.gradient) / information;
        let left = self.gradient.iter().zip(turned.iter()).map(|(g, t)| g + amount * t);
        let squares: f64 = left.zip(&self.weights).map(|(left, weight)| left * left * weight).sum();
        let f = amount * amount * information / (squares / self.freedom).max(1.0);
        if f.is_finite() { f } else { 0.0 }
    }

    /// Degrees of freedom of the pairs' scatter.
    pub fn freedom(&self) -> f64 {
        self.freedom
    }
}

/// The pairs of a calibration at its minimum.
pub struct Linear {
    matrices: Vec<DMatrix<f64>>,
    gradients: Vec<DVector<f64>>,
    inverse: DMatrix<f64>,
    /// What all pairs and what is expected say of the shared numbers.
    sum: DMatrix<f64>,
    /// Where each board stood, in units of the boards' spread; a column each.
    places: Vec<[f64; 3]>,
}

impl Linear {
    /// The pairs of a problem at its minimum. `None` where they do not determine the shared numbers.
    pub fn new(problem: &Problem, layout: &Layout) -> Option<Linear> {
        let equations = problem.equations(layout)?;
        Linear::of(&equations.blocks, &equations.prior.matrix, problem)
    }

    /// The same with pairs that follow on each other counted as one: `first` are the first ones of these.
    pub fn of_runs(&self, first: &[usize]) -> Linear {
        let ends = first.iter().skip(1).copied().chain([self.pairs()]);
        let runs: Vec<_> = first.iter().copied().zip(ends).collect();
        let middle = |&(a, b): &(usize, usize)| {
            [0, 1, 2].map(|k| self.places[a..b].iter().map(|place| place[k]).sum::<f64>() / (b - a) as f64)
        };
        Linear {
            matrices: runs.iter().map(|&(a, b)| self.matrices[a..b].iter().sum()).collect(),
            gradients: runs.iter().map(|&(a, b)| self.gradients[a..b].iter().sum()).collect(),
            places: runs.iter().map(middle).collect(),
            inverse: self.inverse.clone(),
            sum: self.sum.clone(),
        }
    }

    /// The same from the pairs' shares of the normal equations, which may have numbers beyond the shared ones: those
    /// are zero but for a change. `prior` is what is expected of the shared ones.
    pub fn of(blocks: &[Block], prior: &DMatrix<f64>, problem: &Problem) -> Option<Linear> {
        let reduced = blocks.iter().map(|block| block.reduced(0.0)).collect::<Option<Vec<_>>>()?;
        let (matrices, gradients): (Vec<DMatrix<f64>>, Vec<_>) = reduced.into_iter().unzip();
        let (known, all) = (prior.nrows(), matrices.first()?.nrows());
        let sum = matrices.iter().fold(prior.clone(), |sum, m| sum + m.view((0, 0), (known, known)));
        let mut inverse = DMatrix::zeros(all, all);
        inverse.view_mut((0, 0), (known, known)).copy_from(&invert(&sum)?);
        let centres: Vec<[f64; 3]> = problem.values.poses.iter().map(|pose| pose.translation.vector.into()).collect();
        let count = centres.len() as f64;
        let mean = |k: usize| centres.iter().map(|c| c[k]).sum::<f64>() / count;
        let spread = |k: usize| (centres.iter().map(|c| (c[k] - mean(k)).powi(2)).sum::<f64>() / count).sqrt();
        let [means, spreads] = [[0, 1, 2].map(mean), [0, 1, 2].map(spread)];
        let unit = |c: &[f64; 3]| [0, 1, 2].map(|k| (c[k] - means[k]) / spreads[k].max(f64::MIN_POSITIVE));
        let places = centres.iter().map(unit).collect();
        Some(Linear { matrices, gradients, inverse, sum, places })
    }

    /// The same without a pair, at the minimum of the others. `None` where these do not determine the shared numbers.
    pub fn without(&self, pair: usize) -> Option<Linear> {
        let (known, all) = (self.sum.nrows(), self.inverse.nrows());
        let sum = &self.sum - self.matrices[pair].view((0, 0), (known, known));
        let mut inverse = DMatrix::zeros(all, all);
        inverse.view_mut((0, 0), (known, known)).copy_from(&invert(&sum)?);
        // At the minimum of all pairs the others pull by as much as this one, the other way.
        let step = &inverse * &self.gradients[pair];
        let others = || (0..self.pairs()).filter(|i| *i != pair);
        Some(Linear {
            matrices: others().map(|i| self.matrices[i].clone()).collect(),
            gradients: others().map(|i| &self.gradients[i] + &self.matrices[i] * &step).collect(),
            places: others().map(|i| self.places[i]).collect(),
            inverse,
            sum,
        })
    }

    pub fn pairs(&self) -> usize {
        self.matrices.len()
    }

    /// One direction over the series. `None` where the pairs do not tell what goes with the board's place.
    pub fn line(&self, direction: &DVector<f64>) -> Option<Line> {
        let n = self.pairs();
        let products: Vec<DVector<f64>> = self.matrices.iter().map(|m| m * direction).collect();
        let moved: Vec<DVector<f64>> = products.iter().map(|p| &self.inverse * p).collect();
        let own: Vec<f64> = products.iter().map(|p| direction.dot(p)).collect();
        let form = DMatrix::from_fn(n, n, |i, j| if i == j { own[i] } else { 0.0 } - products[i].dot(&moved[j]));
        let gradient = DVector::from_fn(n, |i, _| direction.dot(&self.gradients[i]));
        let (weights, told) = weights(&own);
        let axes = if n >= PLACES_FROM { 3 } else { 0 };
        let freedom = (told as f64 - 2.0 - axes as f64).max(1.0);
        if axes == 0 {
            return Some(Line { form, gradient, weights, freedom });
        }
        let places = DMatrix::from_fn(n, axes, |i, k| self.places[i][k]);
        let turned = &form * &places;
        let through = &turned * invert(&places.tr_mul(&turned))?;
        let gradient = &gradient - &through * places.tr_mul(&gradient);
        Some(Line { form: form - through * turned.transpose(), gradient, weights, freedom })
    }

    /// A change along these directions that each pair has by so much as the pattern says. `None` where the pairs do not
    /// determine it.
    pub fn change(&self, directions: &[DVector<f64>], pattern: &[f64]) -> Option<Change> {
        let (n, all) = (self.pairs(), directions.len());
        // Each direction's slope of the gradient, summed over the pairs, and what the shared numbers do about it.
        let products: Vec<Vec<DVector<f64>>> =
            directions.iter().map(|d| self.matrices.iter().map(|m| m * d).collect()).collect();
        let zero = || DVector::zeros(self.inverse.nrows());
        let sum = |of: &Vec<DVector<f64>>| of.iter().zip(pattern).fold(zero(), |sum, (p, x)| sum + p * *x);
        let sums: Vec<DVector<f64>> = products.iter().map(sum).collect();
        let moved: Vec<DVector<f64>> = sums.iter().map(|sum| &self.inverse * sum).collect();
        let matrix = DMatrix::from_fn(all, all, |a, b| {
            let own: f64 = (0..n).map(|i| pattern[i].powi(2) * directions[a].dot(&products[b][i])).sum();
            own - sums[a].dot(&moved[b])
        });
        let right = DVector::from_fn(all, |a, _| {
            -(0..n).map(|i| pattern[i] * directions[a].dot(&self.gradients[i])).sum::<f64>()
        });
        let inverse = invert(&matrix)?;
        let amounts = &inverse * &right;
        let gain = amounts.dot(&right);
        let common = moved.iter().zip(amounts.iter()).fold(zero(), |sum, (m, a)| sum + m * *a);
        let scatter = self.scatter(directions, pattern, &common, &amounts);
        let sigma = (inverse[(0, 0)] * scatter.max(1.0)).sqrt();
        (gain.is_finite() && scatter.is_finite()).then_some(Change { amounts, sigma, common, gain, scatter })
    }

    /// By how much chi-squared falls where each pair has a change of its own along these directions, a number of
    /// freedom; with `places` beside what goes with where the board stood, which then is no pair's own. Pairs far off
    /// count like those that are usual. `None` where the pairs do not determine it.
    pub fn gain_of_each(&self, directions: &[DVector<f64>], places: bool) -> Option<f64> {
        /// Pairs whose change gains so many times what changes usually do are far off.
        const FAR: f64 = 9.0;
        let along = DMatrix::from_columns(directions);
        let own = self.matrices.iter().zip(&self.gradients);
        let own: Vec<_> = own.map(|(m, g)| (along.tr_mul(&(m * &along)), -along.tr_mul(g))).collect();
        let gain = |(m, g): &(DMatrix<f64>, DVector<f64>)| Some((invert(m)? * g).dot(g));
        let gains = own.iter().map(gain).collect::<Option<Vec<f64>>>()?;
        let most = FAR * median(gains.iter().copied())?;
        let (n, size) = (own.len(), directions.len());
        // A pattern a column: what all have in common, and the board's place.
        let pattern = |i: usize| [1.0, self.places[i][0], self.places[i][1], self.places[i][2]];
        let columns = if places { 4 } else { 1 };
        let (mut matrix, mut right) = (DMatrix::zeros(columns * size, columns * size), DVector::zeros(columns * size));
        let mut sum = 0.0;
        for (i, ((m, g), gain)) in own.iter().zip(&gains).enumerate() {
            let (weight, x) = ((most / gain).min(1.0), pattern(i));
            sum += weight * gain;
            for a in 0..columns {
                let mut rows = right.rows_mut(a * size, size);
                rows += g * (weight * x[a]);
                for b in 0..columns {
                    let mut block = matrix.view_mut((a * size, b * size), (size, size));
                    block += m * (weight * x[a] * x[b]);
                }
            }
        }
        let shared = (invert(&matrix)? * &right).dot(&right);
        let freedom = n.checked_sub(columns).filter(|left| *left > 0)? * size;
        Some((sum - shared) / freedom as f64)
    }

    /// The pairs' scatter along these directions with the change taken out.
    fn scatter(
        &self,
        directions: &[DVector<f64>],
        pattern: &[f64],
        common: &DVector<f64>,
        amounts: &DVector<f64>,
    ) -> f64 {
        let own = directions.iter().zip(amounts.iter()).fold(common * 0.0, |sum, (d, a)| sum + d * *a);
        let (mut sum, mut freedom) = (0.0, 0);
        for direction in directions {
            let information = |m: &DMatrix<f64>| direction.dot(&(m * direction));
            let (weights, told) = weights(&self.matrices.iter().map(information).collect::<Vec<f64>>());
            for (i, (x, weight)) in pattern.iter().zip(weights).enumerate() {
                let left = &self.gradients[i] + &self.matrices[i] * (&own * *x - common);
                sum += direction.dot(&left).powi(2) * weight;
            }
            freedom += told.saturating_sub(2);
        }
        sum / freedom.max(1) as f64
    }
}

/// Weights of what pairs leave along a direction, by each one's information on it, and how many of them tell it.
fn weights(information: &[f64]) -> (Vec<f64>, usize) {
    /// Share of the information of the pair that tells most below which a pair, such as of one picture, tells nothing:
    /// what is left there is rounding.
    const TELLS: f64 = 1e-9;
    let most = information.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let tells = |information: &f64| *information > TELLS * most;
    let weights = information.iter().map(|own| if tells(own) { 1.0 / own } else { 0.0 }).collect();
    (weights, information.iter().filter(|own| tells(own)).count())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::imaging::Side;
    use crate::stereo::calibrate::calibrate;
    use crate::stereo::findings::hypothesis::turned;
    use crate::stereo::synthetic::{BROWN4, World};

    /// A series over which the right camera turned about its vertical axis before the sixth pair, and that turn.
    fn with_step() -> (Problem, Layout, DVector<f64>) {
        let world = World { sigma_px: 0.01, ..World::new(10, 31) };
        let mut corners = world.corners(31);
        let after = world.with_camera_moved(Vector3::y() * 1e-4, Vector3::zeros()).corners(31);
        (5..10).for_each(|i| corners.pairs[i] = after.pairs[i].clone());
        let found = calibrate(&corners, &BROWN4).unwrap();
        (found.problem(), found.layout, turned(&found.layout, found.rig(), Vector3::y()))
    }

    /// What such a pair leaves along a turn of the right camera is rounding, above all where its picture is that
    /// camera's.
    #[test]
    fn a_pair_of_one_picture_says_nothing_of_the_rig() {
        let (all, layout, yaw) = with_step();
        let pattern = DVector::from_fn(10, |i, _| f64::from(i >= 5));
        let told = |problem: &Problem| {
            let linear = Linear::new(problem, &layout).unwrap();
            let change = linear.change(std::slice::from_ref(&yaw), pattern.as_slice()).unwrap();
            (change.scatter, linear.line(&yaw).unwrap().f(&pattern))
        };
        let (scatter_of_all, f_of_all) = told(&all);
        // Which way that is rounded differs from pair to pair.
        for (side, pair) in Side::BOTH.into_iter().flat_map(|side| (0..10).map(move |pair| (side, pair))) {
            let mut without = all.clone();
            without.views[pair].observations.retain(|o| o.side == side);
            without.values = without.refit(&layout).unwrap();
            let (scatter, f) = told(&without);
            assert!(scatter < 2.0 * scatter_of_all, "{side:?} {pair}: {scatter} {scatter_of_all}");
            assert!(f > 0.3 * f_of_all && f_of_all > 10.0, "{side:?} {pair}: {f} {f_of_all}");
        }
    }

    /// A pair that is left out in the linear problem is as one that was not there.
    #[test]
    fn without_a_pair_the_others_say_what_they_say_by_themselves() {
        let (problem, layout, yaw) = with_step();
        let yaw = [yaw];
        let by_pair: Vec<f64> = (0..9).map(|i| f64::from(i >= 5)).collect();
        let mut others = problem.clone();
        others.views.remove(7);
        others.values.poses.remove(7);
        others.values = others.refit(&layout).unwrap();
        let linear = Linear::new(&problem, &layout).unwrap();
        let [left_out, by_themselves] = [linear.without(7).unwrap(), Linear::new(&others, &layout).unwrap()]
            .map(|linear| linear.change(&yaw, &by_pair).unwrap());
        let all: Vec<f64> = (0..10).map(|i| f64::from(i >= 5)).collect();
        let all = linear.change(&yaw, &all).unwrap();
        let off = |change: &Change| (change.gain / by_themselves.gain - 1.0).abs();
        assert!(off(&left_out) < 0.02 && off(&left_out) < 0.3 * off(&all), "{left_out:?} {by_themselves:?}");
    }
}
