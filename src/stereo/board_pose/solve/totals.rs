//! Sums over all poses for what they share, with every pose eliminated.
//!
//! In: the poses' blocks. Out: the normal equations of the shared unknowns, and of the rig's raw numbers beside them.
//! Method: blocks are made in parallel and summed in the order of the poses, so that the bytes do not depend on the
//! threads; what the poses' freedom takes off is one product of large matrices for several poses at a time.

use nalgebra::{DMatrix, DMatrixViewMut, DVector};
use rayon::prelude::*;

use crate::stereo::board_pose::solve::pose_block::{CornerSums, Eliminated, PoseBlock};
use crate::stereo::triangulate::RIG_NUMBERS;

/// Poses whose sums are held at a time.
const AT_ONCE: usize = 16;

/// Sums over poses for what they share, with every pose eliminated.
struct SharedSums<'a> {
    basis: &'a DMatrix<f64>,
    corners: CornerSums,
    /// What the poses' freedom takes off, by the rig's raw numbers and by the shared unknowns together; below the
    /// diagonal and on it.
    taken: DMatrix<f64>,
    taken_gradient: DVector<f64>,
}

/// Sums over all poses for what they share, with every pose eliminated.
#[derive(Debug, Clone)]
pub struct Totals {
    /// Shared by shared.
    pub matrix: DMatrix<f64>,
    /// Of the shared unknowns.
    pub gradient: DVector<f64>,
    /// The rig's raw numbers, whether or not anything of them is an unknown.
    pub rig: DMatrix<f64>,
    /// The rig's raw numbers by the shared unknowns.
    pub rig_shared: DMatrix<f64>,
    pub rig_gradient: DVector<f64>,
}

/// Columns that a thread works on at a time.
const COLUMNS: usize = 48;

impl Totals {
    /// Adds up the blocks of `poses`, worked on in parallel and summed in their order; `each` gets every pose's parts,
    /// with its number. `basis` is that of [`PoseBlock::eliminate`]. `None` where one has no block or its corners do
    /// not determine it.
    pub fn of<P: Sync>(
        poses: &[P],
        (basis, crossings): (&DMatrix<f64>, usize),
        block: impl Fn(&P) -> Option<PoseBlock> + Sync,
        mut each: impl FnMut(usize, PoseBlock, Eliminated),
    ) -> Option<Totals> {
        let parts = |pose: &P| {
            let block = block(pose)?;
            let part = block.eliminate(basis)?;
            Some((block, part))
        };
        let mut sums = SharedSums::new(basis, crossings);
        let mut number = 0;
        for some in poses.chunks(AT_ONCE) {
            let blocks: Vec<Option<(PoseBlock, Eliminated)>> = some.par_iter().map(parts).collect();
            let blocks = blocks.into_iter().collect::<Option<Vec<_>>>()?;
            sums.add(&blocks);
            for (block, part) in blocks {
                each(number, block, part);
                number += 1;
            }
        }
        Some(sums.totals())
    }
}

impl<'a> SharedSums<'a> {
    fn new(basis: &'a DMatrix<f64>, crossings: usize) -> SharedSums<'a> {
        let size = RIG_NUMBERS + basis.ncols() + 3 * crossings;
        SharedSums {
            basis,
            corners: CornerSums::zeros(crossings),
            taken: DMatrix::zeros(size, size),
            taken_gradient: DVector::zeros(size),
        }
    }

    /// Adds poses, in their order. All at once, since one product of large matrices costs less than many of small ones.
    fn add(&mut self, blocks: &[(PoseBlock, Eliminated)]) {
        let size = self.taken.nrows();
        let mut mixed = DMatrix::zeros(size, 6 * blocks.len());
        let mut through = mixed.clone();
        for (i, (block, part)) in blocks.iter().enumerate() {
            self.corners.add(&block.shared);
            mixed.view_mut((0, 6 * i), (RIG_NUMBERS, 6)).copy_from(&part.rig_mixed);
            mixed.view_mut((RIG_NUMBERS, 6 * i), part.mixed.shape()).copy_from(&part.mixed);
            let mut through = through.columns_mut(6 * i, 6);
            mixed.columns(6 * i, 6).mul_to(&part.pose_inverse, &mut through);
            self.taken_gradient.gemv(1.0, &through, &part.pose_gradient, 1.0);
        }
        let mixed = mixed.transpose();
        self.taken.as_mut_slice().par_chunks_mut(COLUMNS * size).enumerate().for_each(|(k, columns)| {
            let (from, count) = (k * COLUMNS, columns.len() / size);
            let mut columns = DMatrixViewMut::from_slice(columns, size, count);
            let rows = size - from;
            columns.rows_mut(from, rows).gemm(1.0, &through.rows(from, rows), &mixed.columns(from, count), 1.0);
        });
    }

    fn totals(mut self) -> Totals {
        let (n, m) = (self.basis.ncols(), 3 * self.corners.crossings.len());
        self.taken.fill_upper_triangle_with_lower_triangle();
        let own = self.corners.rig();
        let mut rig_shared = DMatrix::zeros(RIG_NUMBERS, n + m);
        let mut gradient = DVector::zeros(n + m);
        rig_shared.columns_mut(0, n).copy_from(&(own * self.basis));
        gradient.rows_mut(0, n).copy_from(&self.basis.tr_mul(&self.corners.rig_gradient));
        for (k, crossing) in self.corners.crossings.iter().enumerate() {
            rig_shared.columns_mut(n + 3 * k, 3).copy_from(&crossing.rig);
            gradient.rows_mut(n + 3 * k, 3).copy_from(&crossing.gradient);
        }
        let mut matrix = DMatrix::zeros(n + m, n + m);
        let by_basis = self.basis.tr_mul(&rig_shared);
        matrix.rows_mut(0, n).copy_from(&by_basis);
        matrix.columns_mut(0, n).copy_from(&by_basis.transpose());
        matrix.view_mut((0, 0), (n, n)).copy_from(&by_basis.columns(0, n));
        for (k, crossing) in self.corners.crossings.iter().enumerate() {
            matrix.view_mut((n + 3 * k, n + 3 * k), (3, 3)).copy_from(&crossing.own);
        }
        matrix -= self.taken.view((RIG_NUMBERS, RIG_NUMBERS), (n + m, n + m));
        rig_shared -= self.taken.view((0, RIG_NUMBERS), (RIG_NUMBERS, n + m));
        gradient -= self.taken_gradient.rows(RIG_NUMBERS, n + m);
        let rig = DMatrix::from_fn(RIG_NUMBERS, RIG_NUMBERS, |i, j| own[(i, j)] - self.taken[(i, j)]);
        let rig_gradient = DVector::from_fn(RIG_NUMBERS, |i, _| self.corners.rig_gradient[i] - self.taken_gradient[i]);
        Totals { matrix, gradient, rig, rig_shared, rig_gradient }
    }
}
