//! How much a corner that lies far off counts.

/// Width of the robust loss in standard deviations: 95 % efficient for Gaussian noise (Holland & Welsch 1977).
pub const CAUCHY_WIDTH: f64 = 2.385;

/// A function of the squared whitened residual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Loss {
    /// Plain least squares: efficient, and at the mercy of a single wrong corner.
    Squared,
    /// Cauchy's, with its width in standard deviations: corners far beyond it hardly count.
    Cauchy(f64),
}

impl Loss {
    /// Cost and weight (its slope) at a squared residual.
    pub fn cost_and_weight(self, squared: f64) -> (f64, f64) {
        match self {
            Loss::Squared => (0.5 * squared, 1.0),
            Loss::Cauchy(width) => {
                let c2 = width * width;
                (0.5 * c2 * (squared / c2).ln_1p(), 1.0 / (1.0 + squared / c2))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weight_is_twice_the_slope_of_the_cost() {
        for loss in [Loss::Squared, Loss::Cauchy(2.5)] {
            for s in [0.1, 1.0, 30.0] {
                let h = 1e-5 * s;
                let slope = (loss.cost_and_weight(s + h).0 - loss.cost_and_weight(s - h).0) / (2.0 * h);
                assert!((2.0 * slope - loss.cost_and_weight(s).1).abs() < 1e-7, "{loss:?} at {s}");
            }
        }
    }
}
