//! Rows that a robust fit gave no weight, held against what the other rows predict for them.
//!
//! In: a robust fit. Out: the rows that are gross errors. A row far from all others pulls the fit towards itself, and a fit that lets it
//! go may leave it by more than its own error: the variance of the prediction counts as well as the row's own ("deletion residuals":
//! Cook and Weisberg, "Residuals and influence in regression", 1982). A row goes back
//! where the others predict it: within two thirds of the standard deviations that it was left out for, their size that of the other rows' residuals.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::robust::{LEAST_FREEDOM, Robust};
use super::scatter::as_one_number;
use crate::identify::residuals::eliminate::{product, pseudo_inverse};

/// Root of the weight of a row that must not count, but has to have residuals and derivatives.
const UNHEARD: f64 = 1e-5;

/// Share of the standard deviations that a row is left out for, within which it goes back.
const GOES_BACK: f64 = 2.0 / 3.0;

/// Times that rows may go back.
const ROUNDS: usize = 4;

/// Steps of the trust region after a change of the rows.
const STEPS: usize = 6;

impl Robust<'_> {
    /// The rows that are so many standard deviations of reading and prediction off; the fit is then one without them.
    pub fn gross_errors(&mut self, sigmas: f64) -> Vec<usize> {
        let mut out: Vec<usize> = self.task.rows.iter().copied().filter(|&r| self.scores[r] > sigmas).collect();
        for _ in 0..ROUNDS {
            for &row in self.task.rows {
                self.weights[row] = if out.contains(&row) { UNHEARD } else { 1.0 };
            }
            if out.is_empty() {
                break;
            }
            self.step(STEPS);
            let sizes = self.deleted(&out);
            let still: Vec<usize> =
                out.iter().zip(&sizes).filter(|(_, s)| **s > GOES_BACK * sigmas).map(|(r, _)| *r).collect();
            if still.len() == out.len() {
                break;
            }
            out = still;
        }
        out
    }

    /// Sizes of these rows' residuals, as of one normal number and in standard deviations of the others, with the variance of what the others
    /// predict.
    fn deleted(&self, out: &[usize]) -> Vec<f64> {
        let (rows, offsets, prior) = self.linearised();
        let mut normal = prior.clone();
        let (of_robot, extras) = rows.split(&offsets);
        let places = rows.kinematics.places(of_robot, true);
        let mut parts = Vec::with_capacity(rows.blocks.len());
        for block in &rows.blocks {
            let linear = block.linear(&places, extras, &rows.scatter);
            let own = pseudo_inverse(product(&linear.design, &linear.design));
            let follow = &own * product(&linear.design, &linear.jacobian);
            let jacobian = &linear.jacobian - &linear.design * follow;
            normal += product(&jacobian, &jacobian);
            parts.push((block.row_poses(), linear, own, jacobian));
        }
        let covariance = pseudo_inverse(normal);
        let (mut squares, mut numbers, mut unknowns) = (0.0, 0usize, 0);
        for (poses, linear, own, _) in &parts {
            let kept = |i: &usize| poses[*i].is_some_and(|p| !out.contains(&rows.rows[p]));
            squares += (0..poses.len()).filter(kept).map(|i| linear.residuals[i].powi(2)).sum::<f64>();
            numbers += (0..poses.len()).filter(kept).count();
            unknowns += own.nrows();
        }
        // What the prior holds costs the data nothing.
        let determined = offsets.len() as f64 - (&covariance * prior).trace();
        let freedom =
            (numbers as f64 - unknowns as f64 - determined).max(numbers.div_ceil(LEAST_FREEDOM).max(1) as f64);
        let scale = (squares / freedom).sqrt().max(f64::MIN_POSITIVE);
        let mut sizes = vec![0.0; out.len()];
        for (poses, linear, own, jacobian) in &parts {
            for (size, &row) in sizes.iter_mut().zip(out) {
                let at: Vec<usize> =
                    (0..poses.len()).filter(|&i| poses[i].is_some_and(|p| rows.rows[p] == row)).collect();
                let picked = |matrix: &DMatrix<f64>| matrix.select_rows(&at) / UNHEARD;
                let (columns, design) = (picked(jacobian), picked(&linear.design));
                let residual = DVector::from_iterator(at.len(), at.iter().map(|&i| linear.residuals[i] / UNHEARD));
                let variance = &columns * &covariance * columns.transpose() + &design * own * design.transpose();
                if let Some(total) = Cholesky::new(variance + DMatrix::identity(at.len(), at.len())) {
                    let square = residual.dot(&total.solve(&residual));
                    let square =
                        if at.len() == 1 { square } else { as_one_number(square * 3.0 / at.len().max(1) as f64) };
                    *size = f64::max(*size, square.sqrt() / scale);
                }
            }
        }
        sizes
    }
}
