//! The normal equations of the bundle, with each board's pose eliminated.
//!
//! The matrix is an arrow: every pair touches the shared numbers and its own pose, never another's. With
//! `H = [A B; B' C]` a pair contributes `A - B C^-1 B'` to the shared system (Triggs et al. 2000, section 6.1), so that a
//! dense system of some forty unknowns remains however many pairs there are.

use nalgebra::{DMatrix, DVector, Matrix6, Vector2, Vector6};

use super::layout::{Layout, Shared};
use super::observations::{Observation, Side, View};
use super::projection::CAMERA_NUMBERS;
use super::robust::Loss;
use crate::geometry::{Transform, rotation_matrix, skew};

/// Most columns that one corner touches: its camera, the rig, the shape, the pose.
const LOCAL: usize = CAMERA_NUMBERS + 6 + 2 + 6;

/// One pair's share of the normal equations.
#[derive(Debug, Clone)]
pub struct Block {
    /// Shared by shared.
    pub shared: DMatrix<f64>,
    /// Shared by pose.
    pub mixed: DMatrix<f64>,
    /// Pose by pose.
    pub pose: Matrix6<f64>,
    /// Gradient of the shared numbers, `J' r`.
    pub shared_gradient: DVector<f64>,
    /// Gradient of the pose.
    pub pose_gradient: Vector6<f64>,
    /// Half the robust sum of squares.
    pub cost: f64,
}

/// Derivatives of one corner's whitened residual `predicted - seen`, packed: camera, rig, shape, pose.
pub struct Row {
    /// The whitened residual.
    pub residual: Vector2<f64>,
    /// Derivatives by the packed columns.
    pub columns: [Vector2<f64>; LOCAL],
}

/// Where the packed columns of a side begin, and where they go among the shared numbers.
struct Packing {
    camera: usize,
    shared: Vec<usize>,
}

impl Packing {
    fn new(layout: &Layout, side: Side) -> Packing {
        let camera = layout.camera_count(side);
        let mut shared: Vec<usize> = (0..camera).map(|i| layout.camera_start(side) + i).collect();
        if layout.transform && side == Side::Right {
            shared.extend((0..6).map(|i| layout.transform_start() + i));
        }
        if layout.shape {
            shared.extend((0..2).map(|i| layout.shape_start() + i));
        }
        Packing { camera, shared }
    }
}

/// Residual and derivatives of one corner. `None` where the corner would lie behind its camera.
fn row(
    shared: &Shared,
    layout: &Layout,
    packing: &Packing,
    left_from_board: &Transform,
    o: &Observation,
) -> Option<Row> {
    let on_board = o.board_point(&shared.shape_mm);
    let turned = left_from_board.rotation * on_board.coords;
    let in_left = left_from_board * on_board;
    let right_from_left = &shared.rig.right_from_left;
    let (projection, by_left_point) = match o.side {
        Side::Left => {
            let p = shared.rig.left.project_with_derivatives(&in_left)?;
            let by = p.by_point;
            (p, by)
        }
        Side::Right => {
            let p = shared.rig.right.project_with_derivatives(&(right_from_left * in_left))?;
            let by = p.by_point * rotation_matrix(right_from_left);
            (p, by)
        }
    };
    let residual = o.whiten(projection.px - o.px);
    // A lens model can overflow far outside the picture.
    if !(residual.x.is_finite() && residual.y.is_finite()) {
        return None;
    }
    let mut columns = [Vector2::zeros(); LOCAL];
    for (column, by) in columns.iter_mut().zip(&projection.by_camera[..packing.camera]) {
        *column = o.whitener * by;
    }
    let mut at = packing.camera;
    if layout.transform && o.side == Side::Right {
        let turn = -(projection.by_point * skew(&(right_from_left.rotation * in_left.coords)));
        for i in 0..3 {
            columns[at + i] = o.whitener * turn.column(i);
            columns[at + 3 + i] = o.whitener * projection.by_point.column(i);
        }
        at += 6;
    }
    if layout.shape {
        let normal = by_left_point * (left_from_board.rotation * nalgebra::Vector3::z());
        columns[at] = o.whitener * normal * o.lift[0];
        columns[at + 1] = o.whitener * normal * o.lift[1];
        at += 2;
    }
    let turn = -(by_left_point * skew(&turned));
    for i in 0..3 {
        columns[at + i] = o.whitener * turn.column(i);
        columns[at + 3 + i] = o.whitener * by_left_point.column(i);
    }
    Some(Row { residual, columns })
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
        let width = packing.shared.len() + 6;
        let mut products = [[0.0; LOCAL]; LOCAL];
        let mut gradient = [0.0; LOCAL];
        for o in view.active(side) {
            let row = row(shared, layout, &packing, left_from_board, o)?;
            let (cost, weight) = loss.cost_and_weight(row.residual.norm_squared());
            block.cost += cost;
            for i in 0..width {
                let weighted = row.columns[i] * weight;
                gradient[i] += weighted.dot(&row.residual);
                for (product, column) in products[i][i..width].iter_mut().zip(&row.columns[i..width]) {
                    *product += weighted.x * column.x + weighted.y * column.y;
                }
            }
        }
        block.unpack(&packing, &products, &gradient);
    }
    Some(block)
}

impl Block {
    fn unpack(&mut self, packing: &Packing, products: &[[f64; LOCAL]; LOCAL], gradient: &[f64; LOCAL]) {
        let shared_width = packing.shared.len();
        for (i, &to) in packing.shared.iter().enumerate() {
            self.shared_gradient[to] += gradient[i];
            for (j, &to_j) in packing.shared.iter().enumerate().skip(i) {
                self.shared[(to, to_j)] += products[i][j];
                if i != j {
                    self.shared[(to_j, to)] += products[i][j];
                }
            }
            for j in 0..6 {
                self.mixed[(to, j)] += products[i][shared_width + j];
            }
        }
        for i in 0..6 {
            self.pose_gradient[i] += gradient[shared_width + i];
            for j in i..6 {
                let product = products[shared_width + i][shared_width + j];
                self.pose[(i, j)] += product;
                if i != j {
                    self.pose[(j, i)] += product;
                }
            }
        }
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

/// The shared system with all poses eliminated: matrix and right-hand side. Summed in the order of the pairs.
pub fn eliminate(blocks: &[Block], damping: f64, count: usize) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let mut matrix = DMatrix::zeros(count, count);
    let mut gradient = DVector::zeros(count);
    let mut diagonal = DVector::zeros(count);
    for block in blocks {
        let inverse = block.pose_inverse(damping)?;
        let through = &block.mixed * inverse;
        matrix += &block.shared - &through * block.mixed.transpose();
        gradient += &block.shared_gradient - &through * block.pose_gradient;
        diagonal += block.shared.diagonal();
    }
    for i in 0..count {
        matrix[(i, i)] += damping * diagonal[i];
    }
    Some((matrix, gradient))
}

/// Solves a symmetric positive definite system after scaling it to a unit diagonal.
pub fn solve_scaled(matrix: &DMatrix<f64>, right: &DVector<f64>) -> Option<DVector<f64>> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    if !scale.iter().all(|s| s.is_finite()) {
        return None;
    }
    let scaled = DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let solution = scaled.cholesky()?.solve(&right.component_mul(&scale));
    Some(solution.component_mul(&scale))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::perturb;
    use crate::stereo::Lens;
    use crate::stereo::synthetic::World;
    use nalgebra::Vector3;

    fn cost(shared: &Shared, layout: &Layout, pose: &Transform, view: &View) -> f64 {
        block(shared, layout, pose, view, Loss::Cauchy(2.0)).unwrap().cost
    }

    #[test]
    fn gradients_equal_central_differences() {
        let world = World::new(1, 3);
        let layout = Layout::rig(Lens::Brown4, true);
        let mut view = View::new(&world.board, &world.corners(4).pairs[0], 0);
        for o in &mut view.observations {
            o.whitener = nalgebra::Matrix2::new(9.0, 0.0, 2.0, 11.0);
        }
        let shared = Shared { rig: world.rig.clone(), shape_mm: [0.1, -0.2] };
        let pose = &world.poses[0];
        let analytic = block(&shared, &layout, pose, &view, Loss::Cauchy(2.0)).unwrap();
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
                let mut step = Vector6::zeros();
                step[i] = h;
                let moved =
                    perturb(pose, Vector3::new(step[0], step[1], step[2]), Vector3::new(step[3], step[4], step[5]));
                cost(&shared, &layout, &moved, &view)
            };
            let h = if i < 3 { 1e-6 } else { 1e-4 };
            close((at(h) - at(-h)) / (2.0 * h), analytic.pose_gradient[i], "pose");
        }
    }

    #[test]
    fn elimination_solves_the_whole_system() {
        let world = World::new(3, 3);
        let layout = Layout::rig(Lens::Radial2, false);
        let shared = Shared { rig: world.rig.clone(), shape_mm: [0.0; 2] };
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
        let (matrix, gradient) = eliminate(&blocks, 0.0, n).unwrap();
        let eliminated = solve_scaled(&matrix, &gradient).unwrap();
        let direct = solve_scaled(&whole, &right).unwrap();
        for i in 0..n {
            // Both solve a system whose condition is about 1e8.
            assert!((eliminated[i] - direct[i]).abs() <= 1e-6 * direct[i].abs().max(1e-9), "{i}");
        }
    }
}
