//! Rows held against what the other rows predict for them.
//!
//! In: a robust fit. Out: the rows that are gross errors, those that are doubtful, and the verify rows that are as far
//! off. A row far from all others pulls the fit towards itself, and a fit that lets it go may leave it by more than its
//! own error: the variance of the prediction counts as well as the row's own ("deletion residuals": Cook and Weisberg,
//! "Residuals and influence in regression", 1982). What the others say of a row far from them is extrapolated, and what
//! the model lacks grows with it as noise does: where the prediction is less certain than the reading, a row must be as
//! many times further off, in its variance: up to the count of the numbers that predict it, for a prediction is a
//! weighted sum of them, and where all that they scatter by is what the model lacks, pulling one way, its square is at
//! most as many times the variance that independent errors would give it (Cauchy and Schwarz). A row is named against
//! most of the others: where more than half of all would be left out, none is. A row that was left out goes back where
//! the others predict it: within two thirds of the standard deviations that it was left out for, their size that of the
//! other rows' residuals. A row that was kept is doubtful where the others are so far from it as one set in a thousand
//! would have such a row by chance.

use std::collections::BTreeSet;
use std::ops::Range;

use nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, StudentsT};

use super::linearised::Placement;
use super::robust::{LEAST_FREEDOM, Robust};
use super::scatter::as_one_number;
use super::task::Task;
use crate::identify::residuals::eliminate::Block;
use crate::linear_algebra::{Eliminated, pseudo_inverse};

/// Root of the weight of a row that must not count, but has to have residuals and derivatives.
const NEGLIGIBLE: f64 = 1e-5;

/// Share of the standard deviations that a row is left out for, within which it goes back.
const READMITTED_WITHIN: f64 = 2.0 / 3.0;

/// Times that rows may go back.
const ROUNDS: usize = 4;

/// Steps of the trust region after a change of the rows.
const STEPS: usize = 6;

/// Share of a row that the others must say for it to be held against them.
const LEAST_OTHERS: f64 = 0.05;

/// Probability that a set without any gross error has a doubtful row.
const DOUBT: f64 = 1e-3;

/// Rows of a placement that tell which of them is off with none of them fitted: twice its own unknowns.
const LEAST_ALONE: usize = 12;

/// A row against what the others predict.
#[derive(Debug, Clone, Copy, Default)]
pub struct Deleted {
    /// Its white square, the variance of the prediction counted, and less where that is an extrapolation.
    pub square: f64,
    /// The same, extrapolated or not.
    pub whole_square: f64,
    /// Numbers of which it is the sum.
    pub numbers: usize,
    /// Degrees of freedom of the other rows, and their white sum of squares over them.
    freedom: f64,
    variance: f64,
}

impl Deleted {
    /// Degrees of freedom of all rows, of those of the fit.
    pub fn freedom_of_all(&self) -> f64 {
        self.freedom + self.numbers as f64
    }

    /// In standard deviations of the others, as of one normal number.
    fn size(&self) -> f64 {
        let square = self.square / self.variance.max(f64::MIN_POSITIVE);
        match self.numbers {
            0 | 1 => square.sqrt(),
            n => as_one_number(square * 3.0 / n as f64).sqrt(),
        }
    }
}

impl Robust<'_> {
    /// The rows that are so many standard deviations of reading and prediction off; the fit is then one without them.
    pub fn gross_errors(&mut self, sigmas: f64) -> Vec<usize> {
        let mut out: Vec<usize> = self.task.rows.iter().copied().filter(|&r| self.scores[r] > sigmas).collect();
        if 2 * out.len() > self.task.rows.len() {
            out.clear();
        }
        self.still_gross(out, sigmas)
    }

    /// Which of the rows that were left out stay so: the others go back where the rest predict them. The fit is then
    /// one without those that stay.
    pub fn still_gross(&mut self, mut out: Vec<usize>, sigmas: f64) -> Vec<usize> {
        for _ in 0..ROUNDS {
            for &row in self.task.rows {
                self.weights[row] = if out.contains(&row) { NEGLIGIBLE } else { 1.0 };
            }
            self.step(STEPS);
            if out.is_empty() {
                break;
            }
            let (deleted, _) = self.deleted();
            let still: Vec<usize> =
                out.iter().copied().filter(|&r| deleted[r].size() > READMITTED_WITHIN * sigmas).collect();
            if still.len() == out.len() {
                break;
            }
            out = still;
        }
        out
    }

    /// The rows of the fit that are further off than chance allows, without those that were left out.
    pub fn doubtful(&self, out: &[usize]) -> Vec<usize> {
        let (deleted, _) = self.deleted();
        let rows: Vec<usize> = self.task.rows.iter().copied().filter(|r| !out.contains(r)).collect();
        let share = DOUBT / (2 * rows.len().max(1)) as f64;
        let far = |row: &usize| {
            let d = &deleted[*row];
            StudentsT::new(0.0, 1.0, d.freedom.max(1.0)).is_ok_and(|t| d.size() > t.inverse_cdf(1.0 - share))
        };
        rows.into_iter().filter(far).collect()
    }

    /// Of other rows those that are so many standard deviations of reading and prediction off.
    pub fn far_off(&self, others: &[usize], sigmas: f64) -> Vec<usize> {
        let rows: BTreeSet<usize> = self.task.rows.iter().chain(others).copied().collect();
        let rows: Vec<usize> = rows.into_iter().collect();
        let mut weights = self.weights.clone();
        others.iter().for_each(|&row| weights[row] = NEGLIGIBLE);
        let task = Task { rows: &rows, ..self.task };
        let with = Robust { task, weights, unweighted: task.rows_at(self.scatter, &self.robot), ..self.clone() };
        let (deleted, _) = with.deleted();
        let far = others.iter().copied().filter(|&r| deleted[r].size() > sigmas);
        let far: BTreeSet<usize> = far.chain(self.far_off_alone(others, sigmas)).collect();
        far.into_iter().collect()
    }

    /// The same of placements of which no row is fitted: nothing says where they are but their own rows, of which most
    /// are right.
    fn far_off_alone(&self, others: &[usize], sigmas: f64) -> Vec<usize> {
        let set = self.task.set;
        let mut far = Vec::new();
        for group in 0..set.groups.len() {
            let rows = set.of_group(others, group);
            if rows.len() < LEAST_ALONE || !set.of_group(self.task.rows, group).is_empty() {
                continue;
            }
            let alone = Task { rows: &rows, robot: &self.robot, parameters: &[], extras: &[], ..self.task };
            let sizes = alone.unfitted_sizes(self.scatter);
            far.extend(rows.iter().copied().filter(|&row| sizes[row] > sigmas));
        }
        far
    }

    /// Of rows that were left out of this fit those that it does not find near enough to go back.
    pub fn not_near(&self, out: &[usize], sigmas: f64) -> Vec<usize> {
        self.far_off(out, READMITTED_WITHIN * sigmas)
    }

    /// All rows of the data set against what the others predict for them, of those that are not in the fit nothing; and
    /// the known distances of the data set against what everything else says of them, in their own standard deviations.
    pub fn deleted(&self) -> (Vec<Deleted>, Vec<f64>) {
        let (rows, problem, prior) = self.linearised();
        let of_placement = |placement: &Placement| {
            let Eliminated { normal, follow, inverse } = placement.eliminated();
            (normal, (inverse, &placement.linear.jacobian - &placement.linear.design * follow))
        };
        let (normals, parts): (Vec<DMatrix<f64>>, Vec<_>) = problem.placements.iter().map(of_placement).unzip();
        let covariance = pseudo_inverse(normals.iter().fold(prior.clone(), |sum, normal| sum + normal));
        let weight = |row: usize| self.weights.get(row).copied().unwrap_or(1.0);
        let predicting = problem.placements.iter().flat_map(|placement| placement.poses.iter().flatten());
        let most = predicting.filter(|&&pose| weight(rows.rows[pose]) > NEGLIGIBLE).count().max(1) as f64;
        let (mut squares, mut numbers, mut unknowns) = (0.0, 0usize, 0);
        let mut deleted = vec![Deleted::default(); self.task.set.poses.len()];
        let mut of_known = vec![0.0; self.task.set.known.len()];
        for ((block, placement), (own, jacobian)) in rows.blocks.iter().zip(&problem.placements).zip(&parts) {
            let known = if let Block::Touch(touch) = block { touch.known.as_slice() } else { &[] };
            unknowns += own.nrows();
            let linear = &placement.linear;
            let held = |at: &Range<usize>| {
                let residual = linear.residuals.rows(at.start, at.len()).into_owned();
                let (columns, design) = (jacobian.rows(at.start, at.len()), linear.design.rows(at.start, at.len()));
                let leverage = columns * &covariance * columns.transpose() + design * own * design.transpose();
                (residual, leverage)
            };
            // The known distances stand behind the touches.
            let count = placement.poses.len();
            for (at, (index, _)) in (count - known.len()..count).zip(known) {
                let (residual, leverage) = held(&(at..at + 1));
                of_known[*index] = square_of_deleted(&residual, leverage, 1.0).map_or(0.0, |(square, _)| square.sqrt());
            }
            for (pose, at) in placement.by_pose() {
                let row = rows.rows[pose];
                let (residual, leverage) = held(&at);
                if weight(row) > NEGLIGIBLE {
                    squares += residual.norm_squared();
                    numbers += at.len();
                }
                let square = square_by_others(&residual, leverage, weight(row), most);
                if let Some((square, whole_square)) = square.filter(|(square, _)| *square > deleted[row].square) {
                    deleted[row] = Deleted { square, whole_square, numbers: at.len(), ..deleted[row] };
                }
            }
        }
        // What the prior holds costs the data nothing.
        let determined = problem.shared as f64 - (&covariance * prior).trace();
        let freedom =
            (numbers as f64 - unknowns as f64 - determined).max(numbers.div_ceil(LEAST_FREEDOM).max(1) as f64);
        for (row, d) in deleted.iter_mut().enumerate() {
            // Where the row is in the fit its own share comes off.
            let own = if weight(row) > NEGLIGIBLE { (d.square, d.numbers as f64) } else { (0.0, 0.0) };
            d.freedom = (freedom - own.1).max(1.0);
            d.variance = (squares - own.0).max(0.0) / d.freedom;
        }
        (deleted, of_known)
    }
}

/// White square of a row's residual against what the others predict, extrapolation counted up to `most` times, and
/// without counting it; `None` where hardly anything but the row itself says what it should be: rounding then decides
/// what the others say.
fn square_by_others(fitted: &DVector<f64>, leverage: DMatrix<f64>, weight: f64, most: f64) -> Option<(f64, f64)> {
    let by_others = DMatrix::identity(fitted.len(), fitted.len()) - &leverage;
    if by_others.symmetric_eigenvalues().min() < LEAST_OTHERS {
        return None;
    }
    let (square, odds) = square_of_deleted(fitted, leverage, weight).unwrap_or((0.0, 1.0));
    Some((square / odds.clamp(1.0, most), square))
}

/// White square of a residual that was fitted with this leverage and root of a weight, held against the fit without it,
/// and the largest variance of the prediction over that of the reading.
fn square_of_deleted(fitted: &DVector<f64>, leverage: DMatrix<f64>, weight: f64) -> Option<(f64, f64)> {
    let identity = DMatrix::identity(fitted.len(), fitted.len());
    // Deleted residuals are (I - H)^-1 e, and the others predict with a variance of H (I - H)^-1, both times the
    // weight.
    let grown = Cholesky::new(&identity - &leverage)?;
    let residual = grown.solve(fitted);
    let predicted = grown.solve(&leverage);
    let odds = ((&predicted + predicted.transpose()) / 2.0).symmetric_eigenvalues().max() / (weight * weight);
    let variance = predicted + identity * (weight * weight);
    Some((residual.dot(&Cholesky::new((&variance + variance.transpose()) / 2.0)?.solve(&residual)), odds))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::settings::Settings;
    use crate::identify::solve::robust::Loss;
    use crate::identify::synthetic;
    use crate::measurements::Role;

    /// Verify rows of a placement of their own have nothing to be held against but each other.
    #[test]
    fn a_row_that_is_off_is_found_in_a_placement_of_which_no_row_is_fitted() {
        let mut world = synthetic::planned(80, 0, 25.0, 0.02, 5, &|_| {});
        world.rows.iter_mut().filter(|row| row.at.group == "g3").for_each(|row| row.at.role = Role::Verify);
        let bad = world.rows.iter().rposition(|row| row.at.group == "g3").unwrap();
        synthetic::point(&mut world.rows[bad]).z += 5.0;
        let (set, settings) = (Dataset::new(&world.rows).unwrap(), Settings::default());
        let (fitted, parameters) = (set.fit_rows(), world.nominal.mdh_parameters());
        let others = set.verify_rows();
        assert!(others.len() >= LEAST_ALONE && set.of_group(&fitted, set.poses[bad].group).is_empty());
        let robust = Task::plain(&set, &world.nominal, &parameters, &fitted, &settings).robust(Loss::Biweight).unwrap();
        assert_eq!(robust.far_off(&others, settings.outlier_sigmas), [bad]);
    }
}
