//! What the best rigid transform leaves of the points of a placement, as one number: a swarm asks for it a million
//! times.
//!
//! In: the points of a placement, and where the robot has the target at their poses. Out: the sum of the squares of
//! their white residuals, as [`super::eliminate`] has it. Eight points are worked on together (see `crate::widest`). The
//! transform is Kabsch's (1976) for points that weigh alike in all directions; others go on from there by Gauss and
//! Newton's steps, about the middle of the points. Goes wrong: where a step does not lower the sum, as of points on a
//! line, there is no number, and the longer way has to be gone.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::eliminate::{Block, COST_GAIN};
use super::points::Points;
use super::rows::Rows;
use crate::geometry::{nearest_rotation, nearest_rotation_from, rotation_matrix, transform};
use crate::identify::sensor::Spot;
use crate::robot::lanes::{LANES, Lane};
use crate::widest::widest;

/// Steps at the most; two or three are usual.
const STEPS: usize = 10;

/// Numbers of a symmetric matrix of three rows, and their places.
const UPPER: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// The points of a placement, number by number; what fills the lanes up weighs nothing.
pub struct PointCost {
    poses: Vec<[usize; LANES]>,
    /// Weights of the first transform, and their sum.
    weights: Vec<Lane>,
    whole: f64,
    /// From their middle, mm.
    measured_mm: [Vec<Lane>; 3],
    /// Inverse covariances, 1/mm^2, in the order of [`UPPER`].
    precisions: [Vec<Lane>; 6],
    /// Whether the first transform is the best.
    closed: bool,
    /// `sensor_from_base` of the nominal robot, which is near that of any other.
    nominal: Matrix3<f64>,
}

/// Sum of squares, half its gradient and half its second derivatives over a small turn and a shift.
struct Sums {
    cost: f64,
    gradient: SVector<f64, 6>,
    matrix: SMatrix<f64, 6, 6>,
}

impl PointCost {
    /// Of each placement; `None` where there are other readings than points of the mark point, or other unknowns.
    pub fn of_rows(rows: &Rows) -> Option<Vec<PointCost>> {
        if !rows.extras.is_empty() {
            return None;
        }
        let of_mark = |points: &Points| points.spots.iter().all(|spot| spot.on_body_mm.is_none());
        let form = |block: &Block| match block {
            Block::Points(points) if !points.oriented && points.field.is_none() && of_mark(points) => {
                PointCost::new(points)
            }
            _ => None,
        };
        let mut costs: Vec<PointCost> = rows.blocks.iter().map(form).collect::<Option<_>>()?;
        let target_mm = rows.kinematics.targets_mm(&vec![0.0; rows.offset_count()]);
        for cost in &mut costs {
            cost.nominal = nearest_rotation(&cost.products(&cost.of_poses(&target_mm)).1);
        }
        Some(costs)
    }

    /// `None` where nothing weighs anything.
    fn new(points: &Points) -> Option<PointCost> {
        let spots = &points.spots;
        let weight = |spot: &Spot| spot.weight * spot.weight;
        let whole: f64 = spots.iter().map(weight).sum();
        let middle = spots.iter().map(|spot| weight(spot) * spot.point_mm.coords).sum::<Vector3<f64>>() / whole;
        let lanes = |of: &dyn Fn(&Spot) -> f64| -> Vec<Lane> {
            spots.chunks(LANES).map(|spots| std::array::from_fn(|l| spots.get(l).map_or(0.0, of))).collect()
        };
        let pose = |spots: &[Spot], l: usize| spots.get(l).unwrap_or(&spots[0]).pose;
        (whole > 0.0).then(|| PointCost {
            poses: spots.chunks(LANES).map(|spots| std::array::from_fn(|l| pose(spots, l))).collect(),
            weights: lanes(&weight),
            whole,
            measured_mm: [0, 1, 2].map(|axis| lanes(&|spot| spot.point_mm[axis] - middle[axis])),
            precisions: UPPER.map(|(i, j)| lanes(&|spot| spot.whitener.column(i).dot(&spot.whitener.column(j)))),
            closed: points.start_is_best(),
            nominal: Matrix3::identity(),
        })
    }

    fn of_poses(&self, target_mm: &[Vec<f64>; 3]) -> [Vec<Lane>; 3] {
        [0, 1, 2].map(|axis| self.poses.iter().map(|poses| poses.map(|pose| target_mm[axis][pose])).collect())
    }

    /// Sum of the squares of the white residuals, with the target at each pose here, base frame, mm, axis by axis.
    pub fn at(&self, target_mm: &[Vec<f64>; 3]) -> Option<f64> {
        let target_mm = self.of_poses(target_mm);
        let (middle, products) = widest(
            #[inline(always)]
            || self.products(&target_mm),
        );
        let mut rotation = nearest_rotation_from(&self.nominal, &products);
        let mut shift = Vector3::zeros();
        let sums = |rotation: &Matrix3<f64>, shift: &Vector3<f64>| {
            widest(
                #[inline(always)]
                || self.sums(&target_mm, &middle, rotation, shift),
            )
        };
        if self.closed {
            let squares = widest(
                #[inline(always)]
                || self.squares(&target_mm, &middle, &rotation),
            );
            return Some(squares);
        }
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let Sums { cost, gradient, matrix } = sums(&rotation, &shift);
            let step = -matrix.cholesky()?.solve(&gradient);
            let gain = -gradient.dot(&step);
            if cost > last {
                return None;
            }
            if gain <= COST_GAIN * cost {
                return Some(cost - gain);
            }
            last = cost;
            let turn = rotation_matrix(&transform(step.fixed_rows::<3>(0).into(), Vector3::zeros()));
            (rotation, shift) = (turn * rotation, shift + step.fixed_rows::<3>(3));
        }
        None
    }

    /// The middle of the target's places, and the sum of their products with the measured points.
    #[inline(always)]
    fn products(&self, target_mm: &[Vec<Lane>; 3]) -> (Vector3<f64>, Matrix3<f64>) {
        let (mut sums, mut products) = ([[0.0; LANES]; 3], [[[0.0; LANES]; 3]; 3]);
        let ([x, y, z], [at_x, at_y, at_z]) = (&self.measured_mm, target_mm);
        for k in 0..self.weights.len() {
            let measured: [&Lane; 3] = [&x[k], &y[k], &z[k]];
            for (j, target) in [&at_x[k], &at_y[k], &at_z[k]].into_iter().enumerate() {
                for l in 0..LANES {
                    let weighed = self.weights[k][l] * target[l];
                    sums[j][l] += weighed;
                    for i in 0..3 {
                        products[i][j][l] += measured[i][l] * weighed;
                    }
                }
            }
        }
        // The measured points are from their own middle: that of the others adds nothing.
        (Vector3::from_fn(|j, _| total(&sums[j])) / self.whole, Matrix3::from_fn(|i, j| total(&products[i][j])))
    }

    /// Some of the target's places, from their middle and turned.
    #[inline(always)]
    fn turned(target_mm: [&Lane; 3], middle: &Vector3<f64>, rotation: &Matrix3<f64>) -> [Lane; 3] {
        let mut turned = [[0.0; LANES]; 3];
        for (i, turned) in turned.iter_mut().enumerate() {
            for l in 0..LANES {
                turned[l] = rotation[(i, 0)] * (target_mm[0][l] - middle.x)
                    + rotation[(i, 1)] * (target_mm[1][l] - middle.y)
                    + rotation[(i, 2)] * (target_mm[2][l] - middle.z);
            }
        }
        turned
    }

    /// Sum of squares of points that weigh alike in all directions.
    #[inline(always)]
    fn squares(&self, target_mm: &[Vec<Lane>; 3], middle: &Vector3<f64>, rotation: &Matrix3<f64>) -> f64 {
        let ([x, y, z], [at_x, at_y, at_z]) = (&self.measured_mm, target_mm);
        let mut squares = [0.0; LANES];
        for k in 0..self.weights.len() {
            let turned = PointCost::turned([&at_x[k], &at_y[k], &at_z[k]], middle, rotation);
            for (turned, measured) in turned.iter().zip([&x[k], &y[k], &z[k]]) {
                for l in 0..LANES {
                    let left = turned[l] - measured[l];
                    squares[l] += self.precisions[0][k][l] * left * left;
                }
            }
        }
        total(&squares)
    }

    #[inline(always)]
    fn sums(
        &self,
        target_mm: &[Vec<Lane>; 3],
        middle: &Vector3<f64>,
        rotation: &Matrix3<f64>,
        shift: &Vector3<f64>,
    ) -> Sums {
        let ([x, y, z], [at_x, at_y, at_z]) = (&self.measured_mm, target_mm);
        let (mut cost, mut gradient, mut matrix) = ([0.0; LANES], [[0.0; LANES]; 6], [[[0.0; LANES]; 6]; 6]);
        for k in 0..self.weights.len() {
            let [ux, uy, uz] = PointCost::turned([&at_x[k], &at_y[k], &at_z[k]], middle, rotation);
            let [xx, xy, xz, yy, yz, zz] = [0, 1, 2, 3, 4, 5].map(|n| &self.precisions[n][k]);
            for l in 0..LANES {
                let [ux, uy, uz] = [ux[l], uy[l], uz[l]];
                let [xx, xy, xz, yy, yz, zz] = [xx[l], xy[l], xz[l], yy[l], yz[l], zz[l]];
                let left = [ux + shift.x - x[k][l], uy + shift.y - y[k][l], uz + shift.z - z[k][l]];
                let precision = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
                let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
                // With a turn about an axis the point moves by the cross product of the axis with where it is: what a
                // vector says along that is the cross product of the point with the vector.
                let across = |v: [f64; 3]| [uy * v[2] - uz * v[1], uz * v[0] - ux * v[2], ux * v[1] - uy * v[0]];
                let pull = [dot(precision[0], left), dot(precision[1], left), dot(precision[2], left)];
                let turn_shift = [across(precision[0]), across(precision[1]), across(precision[2])];
                let of_turn = across(pull);
                cost[l] += dot(left, pull);
                for a in 0..3 {
                    gradient[a][l] += of_turn[a];
                    gradient[3 + a][l] += pull[a];
                    let turn_turn = across([turn_shift[0][a], turn_shift[1][a], turn_shift[2][a]]);
                    for b in 0..3 {
                        matrix[a][3 + b][l] += turn_shift[b][a];
                    }
                    for b in a..3 {
                        matrix[a][b][l] += turn_turn[b];
                        matrix[3 + a][3 + b][l] += precision[a][b];
                    }
                }
            }
        }
        let matrix = SMatrix::from_fn(|a, b| total(&matrix[a.min(b)][a.max(b)]));
        Sums { cost: total(&cost), gradient: SVector::from_fn(|a, _| total(&gradient[a])), matrix }
    }
}

fn total(lane: &Lane) -> f64 {
    lane.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::sensor::Scatter;
    use crate::identify::settings::Settings;
    use crate::identify::solve::task::Task;
    use crate::identify::synthetic;
    use crate::measurements::Observed;

    /// The same as by the residuals one by one: with groups that do not fill the lanes, weights, rows without any, and
    /// covariances that are longer along one axis.
    #[test]
    fn the_sum_is_that_of_the_residuals() {
        let mut world = synthetic::planned(37, 0, 25.0, 0.05, 3, &|_| {});
        for deep in [1.0, 9.0, 400.0] {
            world.rows.iter_mut().enumerate().for_each(|(k, row)| {
                if let Observed::Position { covariance_mm2, .. } = &mut row.observed {
                    let along = Vector3::new(0.3, -0.2 * (k as f64).sin(), 0.9).normalize();
                    *covariance_mm2 = Some(1e-4 * (Matrix3::identity() + (deep - 1.0) * along * along.transpose()));
                }
            });
            let (set, settings) = (Dataset::new(&world.rows).unwrap(), Settings::default());
            let (fitted, parameters) = (set.fit_rows(), world.nominal.mdh_parameters());
            let task = Task::plain(&set, &world.nominal, &parameters, &fitted, &settings);
            let mut weights: Vec<f64> = (0..set.poses.len()).map(|i| (0.7 * i as f64).sin().abs()).collect();
            weights[5] = 0.0;
            let rows = Rows::new(&task, Scatter::of_point(0.03), &weights, &world.nominal);
            let costs = PointCost::of_rows(&rows).unwrap();
            assert_eq!(costs.len(), set.groups.len());
            assert!(costs.iter().all(|cost| cost.closed == (deep == 1.0)));
            for size in [0.0, 0.1, 3.0] {
                let offsets: Vec<f64> = (0..rows.offset_count()).map(|k| size * (1.9 * k as f64).cos()).collect();
                let target_mm = rows.kinematics.targets_mm(&offsets);
                let found: f64 = costs.iter().map(|cost| cost.at(&target_mm).unwrap()).sum();
                let expected = rows.evaluate(&offsets, false).0.norm_squared();
                assert!((found / expected - 1.0).abs() < 1e-9, "{deep} {size}: {found} for {expected}");
            }
        }
    }
}
