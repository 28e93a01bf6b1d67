//! How much a corner that lies far off counts.

/// Width of the robust loss in standard deviations: 95 % efficient for Gaussian noise (Holland & Welsch 1977).
const CAUCHY_WIDTH: f64 = 2.385;

/// A function of the squared whitened residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Plain least squares: efficient, and at the mercy of a single wrong corner.
    Squared,
    /// Cauchy's: corners far beyond its width hardly count.
    Cauchy,
    /// The likelihood of Student's distribution in two dimensions with so many degrees of freedom.
    Student(f64),
}

impl Loss {
    /// Cost and weight at a squared residual.
    pub fn cost_and_weight(self, squared: f64) -> (f64, f64) {
        let cost = match self {
            Loss::Squared => 0.5 * squared,
            Loss::Cauchy => 0.5 * CAUCHY_WIDTH * CAUCHY_WIDTH * (squared / (CAUCHY_WIDTH * CAUCHY_WIDTH)).ln_1p(),
            Loss::Student(freedom) => 0.5 * (freedom + 2.0) * (squared / freedom).ln_1p(),
        };
        (cost, self.weight(squared))
    }

    /// How much a corner counts: twice the slope of its cost.
    pub fn weight(self, squared: f64) -> f64 {
        match self {
            Loss::Squared => 1.0,
            Loss::Cauchy => 1.0 / (1.0 + squared / (CAUCHY_WIDTH * CAUCHY_WIDTH)),
            Loss::Student(freedom) => (freedom + 2.0) / (freedom + squared),
        }
    }

    /// Slope of the gradient along a residual over its weight, at least zero; `weighed` is the squared residual times
    /// the weight. Far off a corner counts less the farther off it is.
    pub fn slope_along(self, weighed: f64) -> f64 {
        match self {
            Loss::Squared => 1.0,
            Loss::Cauchy => (1.0 - 2.0 * weighed / (CAUCHY_WIDTH * CAUCHY_WIDTH)).max(0.0),
            Loss::Student(freedom) => (1.0 - 2.0 * weighed / (freedom + 2.0)).max(0.0),
        }
    }

    /// The slope along a residual over the weight by which steps of a search near the minimum bend: so they end after
    /// some, where the weight alone, which overestimates it, takes many times as many (Triggs et al. 2000, section
    /// 4.3). Cauchy's loss is for searches from afar, where the weight leads down surely.
    pub fn bend_along(self, weighed: f64) -> f64 {
        /// A step stays finite where corners far off would bend the other way.
        const LEAST: f64 = 0.1;
        match self {
            Loss::Squared | Loss::Cauchy => 1.0,
            Loss::Student(_) => self.slope_along(weighed).max(LEAST),
        }
    }

    /// Variance of an estimate over the inverse of the weighted normal equations, `J' W J` with the weights that these
    /// squared residuals have: the sandwich of an M-estimator with two-dimensional residuals (Huber 1981, section 7.6).
    /// One for least squares.
    pub fn variance_factor(self, squares: impl Iterator<Item = f64>) -> f64 {
        let Loss::Student(freedom) = self else { return 1.0 };
        let (mut count, mut weights, mut bread, mut meat) = (0.0, 0.0, 0.0, 0.0);
        for squared in squares {
            let weight = self.weight(squared);
            count += 1.0;
            weights += weight;
            bread += weight * freedom / (freedom + squared);
            meat += 0.5 * weight * weight * squared;
        }
        if count > 0.0 { weights * meat / (bread * bread) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::draws::{Draws, Purpose};

    #[test]
    fn weight_is_twice_the_slope_of_the_cost() {
        for loss in [Loss::Squared, Loss::Cauchy, Loss::Student(8.0)] {
            for s in [0.1, 1.0, 30.0] {
                let h = 1e-5 * s;
                let slope = (loss.cost_and_weight(s + h).0 - loss.cost_and_weight(s - h).0) / (2.0 * h);
                assert!((2.0 * slope - loss.cost_and_weight(s).1).abs() < 1e-7, "{loss:?} at {s}");
            }
        }
    }

    #[test]
    fn the_slope_along_a_residual_is_that_of_its_gradient() {
        for loss in [Loss::Squared, Loss::Cauchy, Loss::Student(8.0)] {
            let gradient = |r: f64| loss.cost_and_weight(r * r).1 * r;
            for r in [0.1, 0.7, 1.5, 6.0] {
                let h = 1e-6 * r;
                let weight = loss.cost_and_weight(r * r).1;
                let slope = ((gradient(r + h) - gradient(r - h)) / (2.0 * h) / weight).max(0.0);
                assert!((slope - loss.slope_along(weight * r * r)).abs() < 1e-6, "{loss:?} at {r}: {slope}");
            }
        }
    }

    #[test]
    fn the_variance_factor_is_that_of_an_estimated_mean() {
        // The mean of points in a plane with Student's distribution: its variance over many draws against the stated
        // one.
        let (freedom, points, runs) = (5.0, 60, 3000);
        let loss = Loss::Student(freedom);
        let mut draws = Draws::new(3, Purpose::Points, 0);
        let (mut found, mut stated) = (0.0, 0.0);
        for _ in 0..runs {
            let all: Vec<[f64; 2]> = (0..points)
                .map(|_| {
                    let chi: f64 = (0..5).map(|_| draws.normal().powi(2)).sum();
                    [draws.normal(), draws.normal()].map(|z| z * (freedom / chi).sqrt())
                })
                .collect();
            let mut mean = [0.0; 2];
            let squared = |p: &[f64; 2], m: &[f64; 2]| (p[0] - m[0]).powi(2) + (p[1] - m[1]).powi(2);
            let mut information = 0.0;
            for _ in 0..40 {
                let weights: Vec<f64> = all.iter().map(|p| loss.cost_and_weight(squared(p, &mean)).1).collect();
                information = weights.iter().sum();
                mean = [0, 1].map(|k| all.iter().zip(&weights).map(|(p, w)| p[k] * w).sum::<f64>() / information);
            }
            found += 0.5 * (mean[0].powi(2) + mean[1].powi(2));
            stated += loss.variance_factor(all.iter().map(|p| squared(p, &mean))) / information;
        }
        // 3000 runs of two coordinates know a variance to 1.8 %.
        assert!((found / stated - 1.0).abs() < 0.06, "{}", found / stated);
    }
}
