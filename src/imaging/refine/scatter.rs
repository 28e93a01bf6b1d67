//! Do a board's corners scatter as the noise in their windows says?
//!
//! In: the fits of a board's corners. Out: by what factors their covariances are to be larger or smaller. A covariance
//! by the residuals' variance holds for noise that is independent from pixel to pixel and even over the window.
//! Compression leaves noise that is alike over blocks, clipping leaves dark pixels that are quieter than the edges,
//! sharpening an overshoot that is none, stray light a gradient that is not the model's. What all of these do to a
//! corner is seen in its arms: each tells a step and a turn of its own, by pixels of its own, and how far the arms miss
//! the common model beyond what their covariance allows is how far the corner scatters beyond it. What scatters a
//! corner shows both in how edges bend at the crossing and in how far their arms are apart there. Edges that bend but
//! are not apart are those of a print whose crossings are off their places: that is alike in all its pictures, and no
//! scatter.
//!
//! Method: the ratio of chi-squared to its mean under noise, pooled over the board; where corners differ in it by more
//! than chance each has a ratio of its own, drawn to the board's by an inverse chi-squared prior whose degrees of
//! freedom come from the logarithms' scatter (Smyth 2004). A board whose ratio is one within its error is left as it
//! is, to the bit. Goes wrong: what moves all arms of a corner alike.

use std::f64::consts::LN_2;

use statrs::function::gamma::digamma;

use super::Measured;
use super::saddle_fit::{Fit, Misfit};
use crate::imaging::lattice::Lattice;

/// Standard errors by which a board is another than noise makes it. Of 20 000 boards one is by chance.
const BEYOND_CHANCE: f64 = 4.0;
/// The same for arms that are apart, where all together are beyond chance.
const CONFIRMED: f64 = 3.0;
/// Fewest corners that tell.
const FEWEST: usize = 9;
/// Degrees of freedom that a corner's arms have at the least to tell of it by themselves.
const LEAST_FREEDOM: f64 = 1.0;

/// How the corners of a board scatter, in units of what their windows say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Scatter {
    /// Variance of the usual corner.
    usual: f64,
    /// Degrees of freedom of the prior: how alike corners are; infinite where they are.
    alike: f64,
}

impl Scatter {
    /// What noise does.
    const NOISE: Scatter = Scatter { usual: 1.0, alike: f64::INFINITY };

    /// Of the corners that a board's fits found.
    pub(super) fn of(corners: &Lattice<Measured>) -> Scatter {
        let apart_as_noise = || Scatter::by(corners, |fit| fit.misfits[1], CONFIRMED).is_noise();
        if miss_the_model(corners) && !apart_as_noise() {
            Scatter::by(corners, both, BEYOND_CHANCE)
        } else {
            Scatter::NOISE
        }
    }

    /// By what `misfit` says of each fit, if that is beyond chance by so many standard errors.
    fn by(corners: &Lattice<Measured>, misfit: impl Fn(&Fit) -> Misfit, beyond: f64) -> Scatter {
        let told: Vec<Misfit> = corners
            .iter()
            .map(|(_, _, corner)| misfit(&corner.fit))
            .filter(|misfit| misfit.freedom > LEAST_FREEDOM && misfit.chi_square > 0.0)
            .collect();
        if told.len() < FEWEST {
            return Scatter::NOISE;
        }
        let freedom: f64 = told.iter().map(|misfit| misfit.freedom).sum();
        let pooled = told.iter().map(|misfit| misfit.chi_square).sum::<f64>() / freedom;
        match alike(&told, beyond) {
            Some(alike) => {
                let mean = told.iter().map(centred_log).sum::<f64>() / told.len() as f64;
                Scatter { usual: (mean + digamma(alike / 2.0) - (alike / 2.0).ln()).exp(), alike }
            }
            None if (pooled - 1.0).abs() < beyond * (2.0 / freedom).sqrt() => Scatter::NOISE,
            None => Scatter { usual: pooled, alike: f64::INFINITY },
        }
    }

    /// True where the corners scatter as the noise says.
    fn is_noise(&self) -> bool {
        *self == Scatter::NOISE
    }

    /// By what factor a corner's covariance is too small, by the board and by its own arms.
    fn factor(&self, fit: &Fit) -> f64 {
        let Misfit { chi_square, freedom } = both(fit);
        if self.alike.is_infinite() || freedom < LEAST_FREEDOM {
            return self.usual;
        }
        // The mean of the inverse chi-squared distribution that is left.
        (self.alike * self.usual + chi_square) / (self.alike + freedom - 2.0).max(1.0)
    }

    /// The same for a corner that is unlike the others: by all that its own arms miss, if that is more.
    pub(super) fn alone(&self, corner: Measured) -> Measured {
        let Misfit { chi_square, freedom } = both(&corner.fit);
        let own = chi_square / (freedom - 2.0).max(1.0);
        Measured { fit: corner.fit.scattering(self.factor(&corner.fit).max(own)), ..corner }
    }

    /// Gives a board's corners the covariances that they have.
    pub(super) fn carry(&self, corners: &mut Lattice<Measured>) {
        if !self.is_noise() {
            for corner in corners.cells.iter_mut().flatten() {
                corner.fit = corner.fit.scattering(self.factor(&corner.fit));
            }
        }
    }
}

/// True where the corners' arms miss their models by more than noise lets them, whatever it is that they show.
pub(super) fn miss_the_model(corners: &Lattice<Measured>) -> bool {
    !Scatter::by(corners, both, BEYOND_CHANCE).is_noise()
}

/// All that a corner's arms miss.
fn both(fit: &Fit) -> Misfit {
    let [bent, apart] = fit.misfits;
    Misfit { chi_square: bent.chi_square + apart.chi_square, freedom: bent.freedom + apart.freedom }
}

/// Logarithm of a ratio of chi-squared to its degrees of freedom, less what it is in the mean for noise.
fn centred_log(Misfit { chi_square, freedom }: &Misfit) -> f64 {
    (chi_square / freedom).ln() - digamma(freedom / 2.0) + (freedom / 2.0).ln()
}

/// The prior's degrees of freedom; `None` where the corners are alike within chance.
fn alike(told: &[Misfit], beyond: f64) -> Option<f64> {
    let count = told.len() as f64;
    let logs: Vec<f64> = told.iter().map(centred_log).collect();
    let mean = logs.iter().sum::<f64>() / count;
    let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (count - 1.0);
    let by_noise = told.iter().map(|misfit| trigamma(misfit.freedom / 2.0)).sum::<f64>() / count;
    // The logarithm of a chi-squared of four degrees has a kurtosis of 4.2: its variance is known to sqrt(3.2 / n).
    let excess = variance - by_noise;
    if excess < beyond * by_noise * (3.2 / count).sqrt() {
        return None;
    }
    // The trigamma function falls all the way.
    let (mut low, mut high) = (-10.0 * LN_2, 10.0 * LN_2);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if trigamma(f64::exp(middle)) > excess {
            low = middle;
        } else {
            high = middle;
        }
    }
    Some(2.0 * f64::exp(low))
}

/// The derivative of [`digamma`]: by its recurrence to where its asymptotic series is good.
fn trigamma(x: f64) -> f64 {
    let (mut x, mut sum) = (x, 0.0);
    while x < 8.0 {
        sum += 1.0 / (x * x);
        x += 1.0;
    }
    let square = 1.0 / (x * x);
    sum + 1.0 / x + square / 2.0 + square / x * (1.0 / 6.0 - square * (1.0 / 30.0 - square / 42.0))
}

#[cfg(test)]
mod tests {
    use nalgebra::Point2;

    use super::*;
    use crate::simulate::draws::{Draws, Purpose};

    /// A board whose arms scatter by `variance` times what noise does, corner by corner.
    fn board(columns: usize, seed: u64, variance: impl Fn(usize, &mut Draws) -> f64) -> Lattice<Measured> {
        let mut draws = Draws::new(seed, Purpose::Clutter, 0);
        Lattice::from_fn(columns, columns, |col, row| {
            let factor = variance(row * columns + col, &mut draws);
            let mut arm = || factor * draws.normal().powi(2);
            let misfits = [(); 2].map(|()| Misfit { chi_square: arm() + arm(), freedom: 2.0 });
            let fit = Fit { misfits, ..Fit::example() };
            Some(Measured { px: Point2::new(col as f64, row as f64), fit, reach: [0.5; 2] })
        })
    }

    #[test]
    fn noise_is_left_alone() {
        for seed in 0..300 {
            assert!(Scatter::of(&board(7, seed, |_, _| 1.0)).is_noise(), "{seed}");
        }
        assert!(Scatter::of(&board(2, 1, |_, _| 50.0)).is_noise());
    }

    #[test]
    fn a_board_that_scatters_more_or_less_is_known_to_be() {
        for (seed, truth) in (1..).zip([0.2, 0.4, 2.0, 5.0, 30.0]) {
            let mut corners = board(8, seed, |_, _| truth);
            let scatter = Scatter::of(&corners);
            assert!((scatter.usual / truth - 1.0).abs() < 0.5, "{truth}: {scatter:?}");
            scatter.carry(&mut corners);
            assert!(corners.iter().all(|(_, _, c)| c.fit.covariance_px2[(0, 0)] / truth > 0.5));
        }
    }

    #[test]
    fn edges_that_bend_at_the_crossings_scatter_no_corner() {
        for (seed, times) in (1..).zip([2.0, 5.0, 30.0, 1000.0]) {
            let mut corners = board(8, seed, |_, _| 1.0);
            corners.cells.iter_mut().flatten().for_each(|corner| corner.fit.misfits[0].chi_square *= times);
            assert!(miss_the_model(&corners), "{times}");
            assert!(Scatter::of(&corners).is_noise(), "{times}");
        }
    }

    #[test]
    fn corners_that_scatter_unalike_are_right_in_the_mean() {
        // Every third corner lies in the glare.
        let (mut sum, mut count) = (0.0, 0.0);
        for seed in 0..40 {
            let truth = |k: usize| if k.is_multiple_of(3) { 25.0 } else { 1.0 };
            let mut corners = board(7, seed, |k, _| truth(k));
            let scatter = Scatter::of(&corners);
            scatter.carry(&mut corners);
            for (k, (_, _, corner)) in corners.iter().enumerate() {
                (sum, count) = (sum + truth(k) / corner.fit.covariance_px2[(0, 0)], count + 1.0);
            }
        }
        assert!((0.7..1.4).contains(&(sum / count)), "{}", sum / count);
    }

    #[test]
    fn the_trigamma_function_has_its_known_values() {
        use std::f64::consts::PI;
        for (x, value) in [(1.0, PI * PI / 6.0), (0.5, PI * PI / 2.0), (2.0, PI * PI / 6.0 - 1.0)] {
            assert!((trigamma(x) - value).abs() < 1e-9, "{x}");
        }
    }
}
