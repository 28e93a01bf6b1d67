//! What a fit's equations tell at its end: place, covariance, misfits.
//!
//! In: a model that has settled, and its equations. Out: the fit. Stray light and bends of a window's own edges are
//! parameters beyond the model's; a fit is linear near its end, so that one step takes them there.

use nalgebra::{SMatrix, SVector, Vector2};

use super::evaluation::{Arm, Column, Evaluation, Misfit, STRAY_COLUMNS, misfits};
use super::fit::Fit;
use super::model::{COLUMNS, LEAST_BLUR_PX, Model, N};
use super::window::Window;

/// Rounding to whole grey values alone leaves this variance.
const LEAST_VARIANCE: f64 = 1.0 / 12.0;

/// The end of a fit of `P` parameters.
pub(super) struct End<const C: usize, const P: usize> {
    /// Sum of squared residuals.
    pub(super) cost: f64,
    /// Pixels beyond the parameters.
    pub(super) freedom: f64,
    pub(super) arms: [[Arm<C>; 2]; 2],
    /// The columns of the parameters.
    pub(super) parameters: [usize; P],
    /// The step that the parameters have taken from where the arms were seen.
    pub(super) step: SVector<f64, P>,
    /// Covariance of the parameters over the residuals' variance.
    pub(super) inverse: SMatrix<f64, P, P>,
    /// By how much the edges bend more than they were thought to, 1/px, where that is the window's own.
    pub(super) bends: [Option<f64>; 2],
}

/// Squared residuals that tell the noise of the edges, and their degrees of freedom. Where markers hide the middles of
/// the light squares most pixels away from the edges are dark, and quieter than the edges as light itself is.
fn noise_by(window: &Window, cost: f64, near_cost: f64) -> (f64, f64) {
    if window.hides { (near_cost, (window.near() - N) as f64) } else { (cost, (window.count() - N) as f64) }
}

/// What the equations at the end of a fit tell of it. The model has taken their step already.
pub(super) fn plain(model: &Model, last: &Evaluation<COLUMNS>, window: &Window, own: [bool; 2]) -> Option<Fit> {
    const PARAMETERS: [usize; N] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9];
    // A blur at its bound is not known the better for it.
    let (matrix, gradient) = last.equations();
    let inverse = matrix.cholesky()?.inverse();
    let (parameters, bends) = (PARAMETERS, [None; 2]);
    let (cost, freedom) = noise_by(window, last.cost(), last.near_cost);
    if own == [false; 2] {
        let end = End { cost, freedom, arms: last.arms, parameters, step: Column::zeros(), inverse, bends };
        return Some(end.fit(*model));
    }
    let step = inverse * gradient;
    let cost = cost - step.dot(&gradient);
    let end = End { cost, freedom, arms: last.arms, parameters, step, inverse, bends }.with_own_bends(own)?;
    Some(end.fit(model.add(&(end.step - step), LEAST_BLUR_PX)))
}

/// Parameters of a fit that holds stray light, too: light that does not come from the board but from a reflection on
/// it, and adds to dark and bright alike. Taken as light on the board its slope would move the edges.
pub(super) fn with_stray(model: &Model, window: &Window, (slope_variance, own): (f64, [bool; 2])) -> Option<Fit> {
    const PARAMETERS: [usize; N + 2] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, COLUMNS, COLUMNS + 1];
    let Evaluation { sums, near_cost, arms } = model.evaluate_with_stray(window);
    let mut matrix = SMatrix::<f64, { N + 2 }, { N + 2 }>::from_fn(|i, k| sums[(PARAMETERS[i], PARAMETERS[k])]);
    let gradient = SVector::<f64, { N + 2 }>::from_fn(|i, _| sums[(PARAMETERS[i], N)]);
    let (cost, freedom) = noise_by(window, sums[(N, N)], near_cost);
    let weight = (cost / freedom).max(LEAST_VARIANCE) / slope_variance;
    (matrix[(N, N)], matrix[(N + 1, N + 1)]) = (matrix[(N, N)] + weight, matrix[(N + 1, N + 1)] + weight);
    let cholesky = matrix.cholesky()?;
    let (step, inverse) = (cholesky.solve(&gradient), cholesky.inverse());
    let cost = cost - step.dot(&gradient);
    let end: End<STRAY_COLUMNS, { N + 2 }> =
        End { cost, freedom, arms, parameters: PARAMETERS, step, inverse, bends: [None; 2] };
    let end = end.with_own_bends(own)?;
    let model = model.add(&end.step.fixed_rows::<N>(0).into_owned(), LEAST_BLUR_PX);
    let own_covariance = end.inverse.fixed_view::<2, 2>(N, N) * end.variance();
    let slope = (Vector2::new(end.step[N], end.step[N + 1]), own_covariance);
    Some(Fit { stray: Some(slope), ..end.fit(model) })
}

impl<const C: usize, const P: usize> End<C, P> {
    fn variance(&self) -> f64 {
        (self.cost / self.freedom).max(LEAST_VARIANCE)
    }

    /// The fit whose parameters are these.
    fn fit(&self, model: Model) -> Fit {
        let variance = self.variance();
        let part = |row: usize, column: usize| self.inverse.fixed_view::<2, 2>(row, column) * variance;
        let gain = |arm: Arm<C>| arm.gain(&self.parameters, self.step.as_slice()) / variance;
        Fit {
            model: Model { bend: [0, 1].map(|k| model.bend[k] + self.bends[k].unwrap_or(0.0)), ..model },
            covariance_px2: part(0, 0),
            residual: variance.sqrt(),
            place_by_light: part(0, 8),
            light_covariance: part(8, 8),
            arm_misfit: self.arms.map(|sides| sides.map(gain)),
            misfits: self.misfits(variance),
            stray: None,
            pixels: 0,
            left_out: 0,
            steps: 0,
        }
    }

    /// The misfits of both edges together, in units of the residuals' variance.
    fn misfits(&self, variance: f64) -> [Misfit; 2] {
        let mut sum = [Misfit::default(); 2];
        for (sides, own) in self.arms.iter().zip(self.bends) {
            let taken = (&self.parameters, self.step.as_slice());
            let Some([bent, apart]) = misfits(sides, taken, &self.inverse) else { continue };
            // That its arms are bent against each other is what an edge's own bend was found from.
            let bent = if own.is_some() { Misfit::default() } else { bent };
            for (sum, edge) in sum.iter_mut().zip([bent, apart]) {
                sum.chi_square += edge.chi_square / variance;
                sum.freedom += edge.freedom;
            }
        }
        sum
    }
}
