//! Rigs without some of the pairs, a step from the minimum of all of them.
//!
//! In: a problem at its minimum and the fold of every pair. Out: for each fold the shared numbers that the other pairs alone would give.
//! Method: each pair's share of the normal equations, its pose eliminated, is taken off the sum, and one step of Gauss-Newton
//! follows; from the minimum of all pairs that step is a fraction of a standard deviation, over which the equations are straight.
//! Goes wrong: pairs that alone held a number of the rig; then the others do not determine it, and there is no rig.

use nalgebra::{DMatrix, DVector};

use super::bundle;
use super::calibrate::tells;
use super::layout::{Layout, Shared};
use super::schur::{self, Block};

/// The shared numbers without each fold. `None` where the remaining pairs do not determine them.
pub fn rigs(
    blocks: &[Block],
    layout: &Layout,
    shared: &Shared,
    fold_of: &[usize],
    folds: usize,
) -> Option<Vec<Shared>> {
    let count = layout.count();
    let reduced: Vec<(DMatrix<f64>, DVector<f64>)> =
        blocks.iter().map(|block| block.reduced(0.0)).collect::<Option<_>>()?;
    (0..folds)
        .map(|fold| {
            let (mut matrix, mut gradient) = (DMatrix::zeros(count, count), DVector::zeros(count));
            for ((own, own_gradient), _) in reduced.iter().zip(fold_of).filter(|(_, of)| **of != fold) {
                matrix += own;
                gradient += own_gradient;
            }
            if !tells(&bundle::invert(&matrix)?, layout, &shared.rig) {
                return None;
            }
            let step = -schur::solve_scaled(&matrix, &gradient)?;
            Some(layout.step(shared, step.as_slice()))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::Lens;
    use crate::stereo::calibrate::{Options, calibrate};
    use crate::stereo::folds;
    use crate::stereo::robust::Loss;
    use crate::stereo::synthetic::World;

    #[test]
    fn a_step_without_a_fold_ends_where_its_own_search_does() {
        let options = Options { lens: Some(Lens::Brown5), shape: Some(true) };
        let found = calibrate(&World::new(9, 2).corners(3), &options).unwrap();
        let layout = found.layout;
        let fold_of = folds::assign(9, 9);
        let blocks = bundle::blocks(&found.views, &layout, &found.values, Loss::Squared).unwrap();
        let rigs = rigs(&blocks, &layout, &found.values.shared, &fold_of, 9).unwrap();
        for (fold, rig) in rigs.iter().enumerate() {
            let searched = found.problem().subset(|i| fold_of[i] != fold).refit(&layout).unwrap();
            let (step, search) = (layout.numbers(rig), layout.numbers(&searched.shared));
            for (i, name) in layout.names().iter().enumerate() {
                let sigma = found.uncertainty.shared[(i, i)].sqrt();
                // What a step leaves is of second order: a twentieth of what chance leaves.
                assert!((step[i] - search[i]).abs() < 0.05 * sigma, "{name} without {fold}: {} {}", step[i], search[i]);
            }
        }
    }
}
