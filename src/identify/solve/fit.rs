//! The identification as a least-squares problem: rows, base parameters, a box and a prior.
//!
//! A [`Problem`] whose vector holds the base parameters (mm, mrad), then the extra unknowns of the sensor, and whose
//! residuals are white, the prior's rows below. Base parameters are spread over all parameters of the robot. Costs are
//! scaled back to mm^2, so that unweighted data give eq. (12).

use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::linearised::Linearised;
use super::problem::Problem;
use crate::identify::model::base::Base;
use crate::identify::residuals::cost::PointCost;
use crate::identify::residuals::eliminate::Block;
use crate::identify::residuals::rows::Rows;
use crate::linear_algebra::product;

/// What the solvers minimise.
#[derive(Debug, Clone)]
pub struct Fit<'a> {
    pub rows: std::borrow::Cow<'a, Rows>,
    pub base: &'a Base,
    /// All parameters of the robot from the base parameters.
    spread: DMatrix<f64>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Rows of the prior: `prior * (x - x0)` is white; a constant is added where the extras are fixed.
    prior: DMatrix<f64>,
    /// Root of the unit variance: residuals come out in mm.
    unit_mm: f64,
}

impl<'a> Fit<'a> {
    /// `bounds` are half-widths of the box, one an unknown; `prior` has a column an unknown.
    pub fn new(
        rows: std::borrow::Cow<'a, Rows>,
        base: &'a Base,
        spread: DMatrix<f64>,
        bounds: &[f64],
        prior: DMatrix<f64>,
    ) -> Fit<'a> {
        let lower = bounds.iter().map(|b| -b).collect();
        let unit_mm = rows.unit_variance_mm2().sqrt();
        Fit { rows, base, spread, lower, upper: bounds.to_vec(), prior, unit_mm }
    }

    /// Without a box.
    pub fn free(rows: &'a Rows, base: &'a Base, spread: DMatrix<f64>, prior: DMatrix<f64>) -> Fit<'a> {
        let bounds = vec![f64::INFINITY; prior.ncols()];
        Fit::new(std::borrow::Cow::Borrowed(rows), base, spread, &bounds, prior)
    }

    /// Offsets of all parameters of the robot, then of the extras.
    pub fn offsets(&self, x: &[f64]) -> Vec<f64> {
        let (of_base, extras) = x.split_at(self.base.rank());
        let mut offsets: Vec<f64> = vec![0.0; self.spread.nrows()];
        // The columns as slices, which a swarm's million calls are worth.
        for (value, column) in of_base.iter().zip(self.spread.as_slice().chunks_exact(offsets.len().max(1))) {
            for (offset, share) in offsets.iter_mut().zip(column) {
                *offset += share * value;
            }
        }
        offsets.extend_from_slice(extras);
        offsets
    }

    /// White residuals and Jacobian of the unknowns at `x`, without the prior.
    pub fn white(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (residuals, jacobian) = self.rows.evaluate(&self.offsets(x), true);
        (residuals, self.of_unknowns(&jacobian))
    }

    /// The columns of the unknowns from those of all offsets.
    fn of_unknowns(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let (robot, rank) = (self.spread.nrows(), self.base.rank());
        let extras = jacobian.ncols() - robot;
        let mut columns = (jacobian.columns(0, robot) * &self.spread).resize_horizontally(rank + extras, 0.0);
        columns.columns_mut(rank, extras).copy_from(&jacobian.columns(robot, extras));
        columns
    }

    /// Product of the white Jacobian with itself and with the residuals at offset zero, to first order from `x`.
    pub fn normal(&self, x: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let (residuals, jacobian) = self.white(x);
        let at_zero = residuals - &jacobian * DVector::from_column_slice(x);
        (product(&jacobian, &jacobian), jacobian.tr_mul(&at_zero))
    }

    /// How many numbers of points and of orientations its unknowns and placements have followed at `x` (the trace of
    /// the hat matrix over the rows of either). Points that are known to a hundredth of a millimetre determine a robot
    /// nearly alone where orientations are known to a third of a mrad: all that is lost is theirs. `None` where
    /// placements are not determined by their rows.
    pub(super) fn lost(&self, x: &[f64]) -> Option<[f64; 2]> {
        let linear = Linearised::new(&self.rows, &self.offsets(x));
        let own: usize = linear.placements.iter().map(|p| p.linear.design.ncols()).sum();
        let count = x.len() + own;
        let mut normals = [DMatrix::zeros(count, count), DMatrix::zeros(count, count)];
        let mut at = x.len();
        for (block, placement) in self.rows.blocks.iter().zip(&linear.placements) {
            let part = &placement.linear;
            let mut columns = self.of_unknowns(&part.jacobian).resize_horizontally(count, 0.0);
            columns.columns_mut(at, part.design.ncols()).copy_from(&part.design);
            at += part.design.ncols();
            let is_turn = |row: usize| matches!(block, Block::Points(points) if row % points.rows_a_spot() >= 3);
            for (turns, normal) in normals.iter_mut().enumerate() {
                let rows: Vec<usize> = (0..columns.nrows()).filter(|row| is_turn(*row) == (turns == 1)).collect();
                let of_kind = columns.select_rows(&rows);
                *normal += product(&of_kind, &of_kind);
            }
        }
        let mut total = &normals[0] + &normals[1];
        let mut of_prior = total.view_mut((0, 0), (x.len(), x.len()));
        of_prior += self.prior.tr_mul(&self.prior);
        let total = Cholesky::new(total)?;
        Some(normals.map(|normal| total.solve(&normal).trace()))
    }

    /// Number of unknowns that the data, and not the prior, have determined.
    pub(super) fn determined(&self, x: &[f64]) -> f64 {
        let (_, jacobian) = self.white(x);
        let normal = product(&jacobian, &jacobian);
        match Cholesky::new(&normal + self.prior.tr_mul(&self.prior)) {
            Some(total) => total.solve(&normal).trace(),
            None => x.len() as f64,
        }
    }

    fn with_prior(&self, residuals: DVector<f64>, x: &[f64]) -> DVector<f64> {
        let count = residuals.len();
        let mut all = residuals.resize_vertically(count + self.prior.nrows(), 0.0);
        all.rows_mut(count, self.prior.nrows()).copy_from(&(&self.prior * DVector::from_column_slice(x)));
        all * self.unit_mm
    }
}

impl Problem for Fit<'_> {
    fn lower(&self) -> &[f64] {
        &self.lower
    }

    fn upper(&self) -> &[f64] {
        &self.upper
    }

    fn residuals(&self, x: &[f64]) -> DVector<f64> {
        let (residuals, _) = self.rows.evaluate(&self.offsets(x), false);
        self.with_prior(residuals, x)
    }

    fn costs(&self, xs: &[f64]) -> Vec<f64> {
        let of_points = PointCost::of_rows(&self.rows);
        let quickly = |offsets: &[f64]| {
            let of_points = of_points.as_ref()?;
            let target_mm = self.rows.kinematics.targets_mm(offsets);
            of_points.iter().map(|cost| cost.at(&target_mm)).sum::<Option<f64>>()
        };
        let cost = |x: &[f64]| {
            let offsets = self.offsets(x);
            let of_rows = quickly(&offsets).unwrap_or_else(|| self.rows.cost(&offsets));
            let of_prior = (&self.prior * DVector::from_column_slice(x)).norm_squared();
            0.5 * self.unit_mm * self.unit_mm * (of_rows + of_prior)
        };
        xs.par_chunks(self.dimension().max(1)).map(cost).collect()
    }

    fn linearised(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (residuals, jacobian) = self.white(x);
        let count = residuals.len();
        let mut all = jacobian.resize_vertically(count + self.prior.nrows(), 0.0);
        all.rows_mut(count, self.prior.nrows()).copy_from(&self.prior);
        (self.with_prior(residuals, x), all * self.unit_mm)
    }
}
