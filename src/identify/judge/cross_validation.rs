//! Cross-validation of a whole ladder of models from one linearisation.
//!
//! In: rows linearised where a rich model fits them, for all parameters that any model has. The rows of each placement
//! are cut into regions of joint space; a cell is a region of a placement. Whole placements are held out where there
//! are three or more, else regions: a model is judged where it was not fitted, not between its own rows. Poses that
//! turn one axis after the other leave a region that is held out to pure extrapolation; so rows are also held out here
//! and there (see [`super::folds`]), and what is worth it by either counts. Each cell keeps the product of its white
//! columns (parameters, placement, residual) with themselves; every model on every fold is then algebra on small
//! matrices, so that the ladder costs next to nothing and is linear in rows and placements. No draw is made: the choice
//! depends on no seed. What goes wrong: a model whose parameters move the target by so much that a linear model does
//! not hold; nominal errors of 5 mm on a metre leave some hundredths.

use std::collections::BTreeSet;

use nalgebra::{Cholesky, DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

use super::folds::FOLDS;
use crate::identify::data::dataset::Dataset;
use crate::identify::model::prior::Tolerance;
use crate::identify::residuals::rows::Rows;
use crate::identify::sensor::Extra;
use crate::identify::solve::linearised::Linearised;
use crate::linear_algebra::{Eliminated, solution};
use crate::robot::Parameter;

/// Cells in all, about.
const CELLS: usize = 12;

/// The fold of rows that are always fitted.
const SKIPPED: usize = usize::MAX / 2;

/// Placements from which on whole placements are held out.
const WHOLE: usize = 3;

/// Held-out errors of one model: of each cell the mean square of its numbers, mm^2, and how many there are.
pub type HeldOut = Vec<(f64, f64)>;

/// Chance with which a model that is no better may seem so: several are tried on every rung.
const CHANCE: f64 = 0.01;

/// A region of a placement.
#[derive(Debug, Clone)]
struct Cell {
    block: usize,
    fold: usize,
    numbers: f64,
    /// Product of [parameters and extras, residual at offset zero, placement] with itself.
    normal: DMatrix<f64>,
}

#[derive(Debug, Clone)]
struct Fold {
    normal: DMatrix<f64>,
    gradient: DVector<f64>,
    /// How the unknowns of each placement follow the parameters and the constant one behind them, from what is fitted
    /// of it.
    follows: Vec<Option<DMatrix<f64>>>,
}

/// The cells of a set of rows.
#[derive(Debug, Clone)]
pub struct CrossValidation {
    parameters: Vec<Parameter>,
    extras: Vec<Extra>,
    cells: Vec<Cell>,
    folds: Vec<Fold>,
    /// All cells fitted.
    whole: Fold,
    /// Whether whole placements are held out, not regions of them.
    pub whole_placements: bool,
    /// Root of the variance that stands for one, mm.
    unit_mm: f64,
}

/// A label for each row of a placement by the poses that its rows are of; `None` for a row that is left aside.
type LabelsOfPoses<'a> = dyn Fn(&[Option<usize>]) -> Vec<Option<usize>> + 'a;

impl CrossValidation {
    /// By these labels, one a residual of each placement; `fold` is that of a placement's label.
    fn new(
        problem: &Linearised,
        rows: &Rows,
        labels: &LabelsOfPoses<'_>,
        fold: &dyn Fn(usize, usize) -> usize,
        whole_placements: bool,
    ) -> CrossValidation {
        let mut cells = Vec::new();
        for (b, placement) in problem.placements.iter().enumerate() {
            let labels = labels(&placement.poses);
            let used = labels.iter().flatten().max().map_or(0, |m| m + 1);
            for region in 0..used {
                let of_region: Vec<usize> =
                    (0..labels.len()).filter(|&i| labels[i].map_or(region == 0, |l| l == region)).collect();
                let normal = placement.normal(&of_region, None);
                cells.push(Cell { block: b, fold: fold(b, region), numbers: of_region.len() as f64, normal });
            }
        }
        if !whole_placements {
            // A placement of few rows has fewer regions than there are numbers for.
            let used: BTreeSet<usize> = cells.iter().map(|c: &Cell| c.fold).filter(|f| *f < SKIPPED).collect();
            for cell in cells.iter_mut().filter(|c| c.fold < SKIPPED) {
                cell.fold = used.range(..cell.fold).count();
            }
        }
        let folds = cells.iter().map(|c| c.fold + 1).filter(|f| *f < SKIPPED).max().unwrap_or(0);
        let make = |f: Option<usize>| Fold::new(&cells, problem.placements.len(), problem.shared, f);
        CrossValidation {
            parameters: rows.kinematics.parameters.clone(),
            extras: rows.extras.clone(),
            folds: (0..folds).map(|f| make(Some(f))).collect(),
            whole: make(None),
            whole_placements,
            cells,
            unit_mm: rows.unit_variance_mm2().sqrt(),
        }
    }

    /// Regions of joint space, or whole placements where there are three; `most` is the largest number of folds.
    pub fn by_regions(problem: &Linearised, rows: &Rows, set: &Dataset, most: usize) -> CrossValidation {
        let count = problem.placements.len();
        let whole = count >= WHOLE;
        let regions = if whole { CELLS.div_ceil(count).min(3) } else { most / count.max(1) };
        let labels = |poses: &[Option<usize>]| labels(set, rows, poses, regions);
        let fold = |block: usize, region: usize| if whole { block % most } else { block * regions + region };
        CrossValidation::new(problem, rows, &labels, &fold, whole)
    }

    /// Rows here and there: `of_row` is the fold of each row of the data set.
    pub fn by_folds(problem: &Linearised, rows: &Rows, of_row: &[Option<usize>]) -> CrossValidation {
        let label = |poses: &[Option<usize>]| {
            // What is in no fold is always fitted: its label is one more than the last fold.
            poses.iter().map(|p| p.map(|p| of_row[rows.rows[p]].unwrap_or(FOLDS))).collect()
        };
        CrossValidation::new(problem, rows, &label, &|_, region| if region < FOLDS { region } else { SKIPPED }, false)
    }

    /// What the most probable values of these parameters change by where each fold is left out, beside those of all; mm
    /// and mrad, one a parameter, and behind them one an unknown of the sensor.
    pub fn deletions(&self, parameters: &[Parameter], tolerance: &Tolerance) -> Vec<Option<Vec<f64>>> {
        let columns = self.columns(parameters);
        let sds = tolerance.standard_deviations(parameters, &self.extras);
        let whole = self.whole.solve(&columns, &sds);
        let change = |fold: &Fold| {
            let change = fold.solve(&columns, &sds)? - whole.as_ref()?;
            Some(columns.iter().map(|&c| change[c]).collect())
        };
        self.folds.iter().map(change).collect()
    }

    fn columns(&self, parameters: &[Parameter]) -> Vec<usize> {
        let of_robot = parameters.iter().filter_map(|p| self.parameters.iter().position(|q| q == p));
        of_robot.chain(self.parameters.len()..self.parameters.len() + self.extras.len()).collect()
    }

    /// Standard deviations of the model's parameters that make the data most probable, and the logarithm of that
    /// probability.
    pub fn tolerance(&self, parameters: &[Parameter]) -> (Tolerance, f64) {
        let columns = self.columns(parameters);
        let normal = self.whole.normal.select_rows(&columns).select_columns(&columns);
        let gradient = self.whole.gradient.select_rows(&columns);
        Tolerance::from_evidence_of_all(parameters, &self.extras, &normal, &gradient)
    }

    /// How many times larger the variances of the model's parameters are than errors that are independent of each other
    /// would make them: by how much the pulls of the folds (placements, or regions of joint space) on the parameters
    /// differ, against what their residuals' sizes let expect. Errors that many rows share, a placement's or a model's
    /// that is not quite right, pull all one way. One where it could be chance. Source: the cluster-robust covariance
    /// of Liang and Zeger (Biometrika 73, 1986), of which this is the mean factor.
    pub fn common_factor(&self, parameters: &[Parameter]) -> f64 {
        let columns = self.columns(parameters);
        let sds = self.tolerance(parameters).0.standard_deviations(parameters, &self.extras);
        let Some(x) = self.whole.solve(&columns, &sds).filter(|_| self.folds.len() > 1) else { return 1.0 };
        // In units of the tolerance, so that the prior is the identity.
        let n = columns.len();
        let data = DMatrix::from_fn(n, n, |r, c| sds[r] * sds[c] * self.whole.normal[(columns[r], columns[c])]);
        let Some(inverse) = Cholesky::new(&data + DMatrix::<f64>::identity(n, n)).map(|c| c.inverse()) else {
            return 1.0;
        };
        let mut pulls = vec![DVector::<f64>::zeros(n); self.folds.len()];
        let mut informations = vec![DMatrix::<f64>::zeros(n, n); self.folds.len()];
        for cell in self.cells.iter().filter(|cell| cell.fold < SKIPPED) {
            let Some(follow) = &self.whole.follows[cell.block] else { continue };
            // The parameters' columns with the placement following them, and the residuals at the solution.
            let all = x.len();
            let mut kept = DMatrix::zeros(all + 1, n + 1);
            for (k, &c) in columns.iter().enumerate() {
                kept[(c, k)] = sds[k];
            }
            kept.view_mut((0, n), (all, 1)).copy_from(&x);
            kept[(all, n)] = 1.0;
            let mut moves = DMatrix::zeros(cell.normal.nrows(), n + 1);
            moves.rows_mut(0, all + 1).copy_from(&kept);
            moves.rows_mut(all + 1, follow.nrows()).copy_from(&-(follow * kept));
            let products = moves.transpose() * &cell.normal * &moves;
            pulls[cell.fold] += products.view((0, n), (n, 1)).column(0);
            informations[cell.fold] += products.view((0, 0), (n, n));
        }
        let size: f64 = pulls.iter().map(|p| p.dot(&(&inverse * p))).sum();
        // What independent errors let expect at the fit, which has followed every fold a part of the way.
        let whole = &inverse * &data;
        let expected = |information: &DMatrix<f64>| {
            let part = &inverse * information;
            let twice = &part * &part;
            part.trace() - 2.0 * twice.trace() + (twice * &whole).trace()
        };
        let expected: f64 = informations.iter().map(expected).sum();
        // A sum of squares of unlike weights has the spread of so many of like ones (Satterthwaite, 1946).
        let freedom = whole.trace().powi(2) / (&whole * &whole).trace() * (self.folds.len() - 1) as f64;
        let Ok(chance) = ChiSquared::new(freedom) else { return 1.0 };
        let factor = size / expected;
        if factor > chance.inverse_cdf(1.0 - CHANCE) / freedom { factor } else { 1.0 }
    }

    /// Held-out errors of the model with these parameters, whose tolerance all rows tell; `None` where there is but one
    /// fold.
    pub fn held_out(&self, parameters: &[Parameter], tolerance: &Tolerance) -> Option<HeldOut> {
        if self.folds.len() < 2 {
            return None;
        }
        let columns = self.columns(parameters);
        let sds = tolerance.standard_deviations(parameters, &self.extras);
        let mut list = vec![(0.0, 0.0); self.cells.len()];
        for (f, fold) in self.folds.iter().enumerate() {
            let x = fold.solve(&columns, &sds)?;
            for (slot, cell) in list.iter_mut().zip(&self.cells).filter(|(_, c)| c.fold == f) {
                let Some(follow) = &fold.follows[cell.block] else { continue };
                let kept = x.push(1.0);
                let unknowns = -(follow * &kept);
                let z = DVector::from_iterator(cell.normal.nrows(), kept.iter().chain(&unknowns).copied());
                let square = z.dot(&(&cell.normal * &z)).max(0.0);
                *slot = (self.unit_mm * self.unit_mm * square / cell.numbers.max(1.0), cell.numbers);
            }
        }
        Some(list)
    }
}

impl Fold {
    fn new(cells: &[Cell], blocks: usize, columns: usize, held: Option<usize>) -> Fold {
        let mut fold = Fold {
            normal: DMatrix::zeros(columns, columns),
            gradient: DVector::zeros(columns),
            follows: Vec::with_capacity(blocks),
        };
        for b in 0..blocks {
            let of_block = || cells.iter().filter(|c| c.block == b);
            let is_held = |c: &Cell| held.is_some_and(|f| c.fold == f);
            let fitted = sum(of_block().filter(|c| !is_held(c)));
            // A placement that is held out wholly is placed by its own rows.
            let placing = fitted.clone().or_else(|| sum(of_block()));
            let Some(placing) = placing else {
                fold.follows.push(None);
                continue;
            };
            let Eliminated { normal, follow, .. } = Eliminated::new(&placing, columns + 1);
            if fitted.is_some() {
                fold.normal += normal.view((0, 0), (columns, columns));
                fold.gradient += normal.view((0, columns), (columns, 1));
            }
            fold.follows.push(Some(follow));
        }
        fold
    }

    /// The most probable values of these columns, the others zero.
    fn solve(&self, columns: &[usize], sds: &[f64]) -> Option<DVector<f64>> {
        let n = columns.len();
        if n == 0 {
            return Some(DVector::zeros(self.gradient.len()));
        }
        let scaled = DMatrix::from_fn(n, n, |r, c| {
            sds[r] * sds[c] * self.normal[(columns[r], columns[c])] + if r == c { 1.0 } else { 0.0 }
        });
        let rhs = DVector::from_fn(n, |r, _| -sds[r] * self.gradient[columns[r]]);
        let solved = solution(&scaled, &rhs);
        let mut x = DVector::zeros(self.gradient.len());
        for (k, &c) in columns.iter().enumerate() {
            x[c] = sds[k] * solved[k];
        }
        Some(x)
    }
}

fn sum<'a>(cells: impl Iterator<Item = &'a Cell>) -> Option<DMatrix<f64>> {
    cells.map(|cell| cell.normal.clone()).reduce(|sum, normal| sum + normal)
}

/// The region of each residual; `None` for what belongs to no pose.
fn labels(set: &Dataset, rows: &Rows, poses: &[Option<usize>], regions: usize) -> Vec<Option<usize>> {
    let present: BTreeSet<usize> = poses.iter().flatten().copied().collect();
    let mut label = vec![0; rows.rows.len()];
    let mut next = 0;
    let regions = regions.min(present.len()).max(1);
    divide(set, rows, present.into_iter().collect(), regions, &mut next, &mut label);
    poses.iter().map(|p| p.map(|p| label[p])).collect()
}

/// Cuts poses across the joint that varies most until there are so many regions.
fn divide(set: &Dataset, rows: &Rows, mut poses: Vec<usize>, regions: usize, next: &mut usize, label: &mut [usize]) {
    if regions <= 1 || poses.len() <= 1 {
        poses.iter().for_each(|&p| label[p] = *next);
        *next += 1;
        return;
    }
    let joints = |p: usize| &set.poses[rows.rows[p]].joints_rad;
    let variance = |j: usize| {
        let mean = poses.iter().map(|&p| joints(p)[j]).sum::<f64>() / poses.len() as f64;
        poses.iter().map(|&p| (joints(p)[j] - mean).powi(2)).sum::<f64>()
    };
    let widest = (0..joints(poses[0]).len()).max_by(|a, b| variance(*a).total_cmp(&variance(*b))).unwrap_or(0);
    poses.sort_by(|a, b| joints(*a)[widest].total_cmp(&joints(*b)[widest]));
    let first = regions / 2;
    let right = poses.split_off((poses.len() * first).div_ceil(regions));
    divide(set, rows, poses, first, next, label);
    divide(set, rows, right, regions - first, next, label);
}

/// Whether `new` is clearly below `old`: its mean square is less, and by Student's test of the paired cells either the
/// squares fall or their logarithms do. Squares say what a few bad regions gain; logarithms see that all regions gain
/// where the old errors are of very different size.
pub fn clearly_less(new: &HeldOut, old: &HeldOut) -> bool {
    let pairs: Vec<(f64, f64)> = new.iter().zip(old).filter(|((_, n), _)| *n > 0.0).map(|(n, o)| (n.0, o.0)).collect();
    if pairs.len() < 2 || new.len() != old.len() || root_mean(new) >= root_mean(old) {
        return false;
    }
    let squares = pairs.iter().map(|(n, o)| o - n).collect();
    let logarithms = pairs.iter().map(|(n, o)| (o.max(f64::MIN_POSITIVE) / n.max(f64::MIN_POSITIVE)).ln()).collect();
    clearly_positive(squares) || clearly_positive(logarithms)
}

/// Whether the mean of these gains is more than chance.
fn clearly_positive(gains: Vec<f64>) -> bool {
    let gains = DVector::from_vec(gains);
    let freedom = (gains.len() - 1) as f64;
    let standard_error = (gains.variance() / freedom).sqrt();
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else { return false };
    gains.mean() > student.inverse_cdf(1.0 - CHANCE) * standard_error
}

/// Root mean square of held-out errors, mm a number.
pub fn root_mean(held_out: &HeldOut) -> Option<f64> {
    let numbers: f64 = held_out.iter().map(|(_, n)| n).sum();
    let squares: f64 = held_out.iter().map(|(s, n)| s * n).sum();
    (numbers > 0.0).then(|| (squares / numbers).sqrt())
}

#[cfg(test)]
mod tests;
