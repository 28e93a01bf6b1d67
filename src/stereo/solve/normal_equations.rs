//! The normal equations of the bundle, with each board's pose eliminated.
//!
//! The matrix is an arrow: every pair touches the shared numbers and its own pose, never another's. With `H = [A B; B'
//! C]` a pair contributes `A - B C^-1 B'` to the shared system (Triggs et al. 2000, section 6.1), so that a dense
//! system of some forty unknowns remains however many pairs there are.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};

use crate::geometry::Transform;
use crate::imaging::Side;
use crate::linear_algebra::to_unit_diagonal;
use crate::stereo::data::View;
use crate::stereo::model::{Layout, Shared};
use crate::stereo::solve::Loss;
use crate::stereo::solve::gram_matrix::Products;
use crate::stereo::solve::jacobian::{Packing, Way, weigh};
use crate::stereo::solve::priors::Information;

/// One pair's share of the normal equations.
#[derive(Debug, Clone)]
pub struct Block {
    pub shared: DMatrix<f64>,
    /// Shared by pose.
    pub mixed: DMatrix<f64>,
    pub pose: Matrix6<f64>,
    /// Gradient of the shared numbers, `J' r`.
    pub shared_gradient: DVector<f64>,
    pub pose_gradient: Vector6<f64>,
    /// Half the robust sum of squares.
    pub cost: f64,
}

/// One pair's share at these values. `None` where a corner would lie behind its camera.
pub fn block(shared: &Shared, layout: &Layout, left_from_board: &Transform, view: &View, loss: Loss) -> Option<Block> {
    let n = layout.count();
    let mut block = Block {
        shared: DMatrix::zeros(n, n),
        mixed: DMatrix::zeros(n, 6),
        pose: Matrix6::zeros(),
        shared_gradient: DVector::zeros(n),
        pose_gradient: Vector6::zeros(),
        cost: 0.0,
    };
    for side in Side::BOTH {
        let packing = Packing::new(layout, side);
        let way = Way::new(&shared.rig, left_from_board, side);
        let mut products = Products::new(packing.width());
        for o in view.active(side) {
            let rows = products.next_two();
            let residual = way.rows(&packing, &shared.shape_mm, o, rows)?;
            let (cost, weight) = loss.cost_and_weight(residual.norm_squared());
            block.cost += cost;
            if weight != 1.0 {
                weigh(rows, packing.shared.len() + 6, &residual, weight, loss);
            }
        }
        products.finish();
        block.unpack(&packing, &products);
    }
    Some(block)
}

impl Block {
    fn unpack(&mut self, packing: &Packing, products: &Products) {
        let pose = packing.shared.len();
        let residual = pose + 6;
        for (i, &to) in packing.shared.iter().enumerate() {
            self.shared_gradient[to] += products.upper(i, residual);
            for (j, &to_j) in packing.shared.iter().enumerate().skip(i) {
                self.shared[(to, to_j)] += products.upper(i, j);
                if i != j {
                    self.shared[(to_j, to)] += products.upper(i, j);
                }
            }
            for j in 0..6 {
                self.mixed[(to, j)] += products.upper(i, pose + j);
            }
        }
        for i in 0..6 {
            self.pose_gradient[i] += products.upper(pose + i, residual);
            for j in i..6 {
                let product = products.upper(pose + i, pose + j);
                self.pose[(i, j)] += product;
                if i != j {
                    self.pose[(j, i)] += product;
                }
            }
        }
    }

    /// What the pair says about the shared numbers with its own pose eliminated: `A - B C^-1 B'` and the gradient that
    /// goes with it.
    pub fn reduced(&self, damping: f64) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let through = &self.mixed * self.pose_inverse(damping)?;
        Some((&self.shared - &through * self.mixed.transpose(), &self.shared_gradient - &through * self.pose_gradient))
    }

    /// The pose's own Gauss-Newton step where the shared numbers take this one. `None` where the corners do not
    /// determine the pose.
    pub fn pose_step(&self, shared: &DVector<f64>) -> Option<Vector6<f64>> {
        Some(-(self.pose_inverse(0.0)? * (self.pose_gradient + self.mixed.tr_mul(shared))))
    }

    /// `C^-1`, the pose's own diagonal stretched by `1 + damping`. `None` where the corners do not determine the pose.
    pub fn pose_inverse(&self, damping: f64) -> Option<Matrix6<f64>> {
        let mut damped = self.pose;
        for i in 0..6 {
            damped[(i, i)] *= 1.0 + damping;
        }
        inverse6(&damped)
    }
}

/// Inverse of a positive definite matrix whose rows have different units: scaled to a unit diagonal first.
pub fn inverse6(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let scaled = Matrix6::from_fn(|i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(Matrix6::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

/// The normal equations of all pairs, with what is expected of the shared numbers before any picture.
#[derive(Debug, Clone)]
pub struct Equations {
    /// Each pair's share, in their order.
    pub blocks: Vec<Block>,
    /// What is expected.
    pub prior: Information,
}

impl Equations {
    /// Half the robust sum of squares, expectations included.
    pub fn cost(&self) -> f64 {
        self.blocks.iter().map(|block| block.cost).sum::<f64>() + self.prior.cost
    }

    /// Number of shared unknowns.
    pub fn count(&self) -> usize {
        self.prior.gradient.len()
    }
}

/// The shared system with all poses eliminated: matrix and right-hand side. Summed in the order of the pairs.
pub fn eliminate(equations: &Equations, damping: f64) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let count = equations.count();
    let mut matrix = equations.prior.matrix.clone();
    let mut gradient = equations.prior.gradient.clone();
    let mut diagonal = matrix.diagonal();
    for block in &equations.blocks {
        let (own, own_gradient) = block.reduced(damping)?;
        matrix += own;
        gradient += own_gradient;
        diagonal += block.shared.diagonal();
    }
    for i in 0..count {
        matrix[(i, i)] += damping * diagonal[i];
    }
    Some((matrix, gradient))
}

/// Solves a symmetric positive definite system after scaling it to a unit diagonal.
pub fn solve_scaled(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let (scaled, scale) = to_unit_diagonal(matrix)?;
    let solution = scaled.cholesky()?.solve(&right.component_mul(&scale));
    Some(solution.component_mul(&scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::perturb;
    use crate::stereo::Lens;
    use crate::stereo::solve::Priors;
    use crate::stereo::synthetic::World;

    #[test]
    fn gradients_equal_central_differences() {
        [Loss::Squared, Loss::Cauchy, Loss::Student(4.0)].into_iter().for_each(gradient_equals_central_differences);
    }

    fn gradient_equals_central_differences(loss: Loss) {
        let cost = |shared: &Shared, layout: &Layout, pose: &Transform, view: &View| {
            block(shared, layout, pose, view, loss).unwrap().cost
        };
        let world = World::new(1, 3);
        let layout = Layout::rig(Lens::Brown4, true);
        let mut view = View::new(&world.board, &world.corners(4).pairs[0], 0);
        for o in &mut view.observations {
            o.whitener = nalgebra::Matrix2::new(9.0, 0.0, 2.0, 11.0);
        }
        let shared = Shared { rig: world.rig.clone(), shape_mm: [0.1, -0.2, 0.15] };
        let pose = &world.poses[0];
        let analytic = block(&shared, &layout, pose, &view, loss).unwrap();
        // A cost of some thousands is known to 1e-12; halved by steps that move pixels by about 1e-4.
        let close = |numeric: f64, analytic: f64, what: &str| {
            assert!((numeric - analytic).abs() < 1e-4 * (1.0 + analytic.abs()), "{what}: {numeric} and {analytic}");
        };
        for (i, name) in layout.names().iter().enumerate() {
            let h = if name.contains('k') || name.contains(".p") || name.contains("rad") { 1e-6 } else { 1e-4 };
            let mut step = vec![0.0; layout.count()];
            step[i] = h;
            let plus = cost(&layout.step(&shared, &step), &layout, pose, &view);
            step[i] = -h;
            let minus = cost(&layout.step(&shared, &step), &layout, pose, &view);
            close((plus - minus) / (2.0 * h), analytic.shared_gradient[i], name);
        }
        for i in 0..6 {
            let at = |h: f64| {
                let mut step = Vector6::<f64>::zeros();
                step[i] = h;
                cost(&shared, &layout, &perturb(pose, step.as_slice()), &view)
            };
            let h = if i < 3 { 1e-6 } else { 1e-4 };
            close((at(h) - at(-h)) / (2.0 * h), analytic.pose_gradient[i], "pose");
        }
    }

    #[test]
    fn elimination_solves_the_whole_system() {
        let world = World::new(3, 3);
        let layout = Layout::rig(Lens::Radial2, false);
        let shared = Shared { rig: world.rig.clone(), shape_mm: [0.0; 3] };
        let blocks: Vec<Block> = world
            .corners(4)
            .pairs
            .iter()
            .zip(&world.poses)
            .map(|(pair, pose)| {
                block(&shared, &layout, pose, &View::new(&world.board, pair, 0), Loss::Squared).unwrap()
            })
            .collect();
        let n = layout.count();
        let size = n + 6 * blocks.len();
        let (mut whole, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
        for (i, b) in blocks.iter().enumerate() {
            let at = n + 6 * i;
            let mut add = |row: usize, col: usize, value: f64| whole[(row, col)] += value;
            for r in 0..n {
                (0..n).for_each(|c| add(r, c, b.shared[(r, c)]));
                for c in 0..6 {
                    add(r, at + c, b.mixed[(r, c)]);
                    add(at + c, r, b.mixed[(r, c)]);
                }
                right[r] += b.shared_gradient[r];
            }
            for r in 0..6 {
                (0..6).for_each(|c| add(at + r, at + c, b.pose[(r, c)]));
                right[at + r] += b.pose_gradient[r];
            }
        }
        let prior = Priors::NONE.information(&layout, &shared);
        let (matrix, gradient) = eliminate(&Equations { blocks, prior }, 0.0).unwrap();
        let eliminated = solve_scaled(&matrix, &gradient).unwrap();
        let direct = solve_scaled(&whole, &right).unwrap();
        for i in 0..n {
            // Both solve a system whose condition is about 1e8.
            assert!((eliminated[i] - direct[i]).abs() <= 1e-6 * direct[i].abs().max(1e-9), "{i}");
        }
    }
}
