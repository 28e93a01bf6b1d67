//! What a fit takes of the degrees of freedom: of points and of orientations apart.
//!
//! In: a fit and where it ended. Out: how many numbers its unknowns and placements have followed of either kind (the trace of the hat matrix over
//! their rows). Points that are known to a hundredth of a millimetre determine a robot nearly alone where orientations are known to a third of a
//! mrad: all that is lost is theirs. Goes wrong: placements that their rows do not determine; then there is no answer.

use nalgebra::{Cholesky, DMatrix};

use super::fit::Fit;
use crate::identify::residuals::eliminate::Block;
use crate::identify::solve::linearised::Linearised;
use crate::linear_algebra::product;

/// Numbers lost of points and of orientations.
pub(super) fn lost(fit: &Fit, x: &[f64], prior: &DMatrix<f64>) -> Option<[f64; 2]> {
    let linear = Linearised::new(&fit.rows, &fit.offsets(x));
    let own: usize = linear.placements.iter().map(|p| p.linear.design.ncols()).sum();
    let count = x.len() + own;
    let mut normals = [DMatrix::zeros(count, count), DMatrix::zeros(count, count)];
    let mut at = x.len();
    for (block, placement) in fit.rows.blocks.iter().zip(&linear.placements) {
        let part = &placement.linear;
        let mut columns = fit.of_unknowns(&part.jacobian).resize_horizontally(count, 0.0);
        columns.columns_mut(at, part.design.ncols()).copy_from(&part.design);
        at += part.design.ncols();
        for (turns, normal) in normals.iter_mut().enumerate() {
            let rows: Vec<usize> = (0..columns.nrows()).filter(|row| is_turn(block, *row) == (turns == 1)).collect();
            let of_kind = columns.select_rows(&rows);
            *normal += product(&of_kind, &of_kind);
        }
    }
    let mut total = &normals[0] + &normals[1];
    let mut of_prior = total.view_mut((0, 0), (x.len(), x.len()));
    of_prior += prior.tr_mul(prior);
    let total = Cholesky::new(total)?;
    Some(normals.map(|normal| total.solve(&normal).trace()))
}

/// Whether a residual of a block is an orientation's.
fn is_turn(block: &Block, row: usize) -> bool {
    matches!(block, Block::Points(points) if row % points.rows_a_spot() >= 3)
}
