//! The cost alone, for the swarms: points from the [`Kernel`], then sums in a fixed order without building matrices.
//!
//! Covers distances to a centre, and points under a free rigid transform (closed form of Kabsch where all weights are
//! equal in all directions; Gauss-Newton from there otherwise). Other blocks go the long way.

use nalgebra::{Matrix3, Matrix6, Point3, Vector3, Vector6};

use super::blocks::{Block, Scatter, Spot, whitener};
use super::estimate::{Estimate, nearest_rotation};
use super::kernel::{Kernel, LANES, Points};
use crate::geometry::{Transform, perturb, skew, transform_from_matrix};

/// Gauss-Newton steps from the closed form, when weights differ by direction.
const FRAME_STEPS: usize = 3;

/// Blocks whose cost needs no matrices.
#[derive(Debug, Clone)]
pub struct FastCost {
    kernel: Kernel,
    blocks: Vec<FastBlock>,
}

#[derive(Debug, Clone)]
enum FastBlock {
    Center { center: usize, pose: Vec<usize>, length_mm: Vec<f64>, weight: Vec<f64> },
    Frame(Frame),
}

#[derive(Debug, Clone)]
struct Frame {
    pose: Vec<usize>,
    measured: Vec<Vector3<f64>>,
    whiten: Vec<Matrix3<f64>>,
    /// Of the closed form: inverse mean variance.
    weight: Vec<f64>,
    isotropic: bool,
    center: Vector3<f64>,
    total: f64,
}

impl FastCost {
    /// `None` where a block is of another kind.
    pub fn new(estimate: &Estimate) -> Option<FastCost> {
        let mut blocks = Vec::new();
        for block in &estimate.blocks {
            match block {
                Block::Center { center, lengths } => blocks.push(FastBlock::Center {
                    center: *center,
                    pose: lengths.iter().map(|l| l.pose).collect(),
                    length_mm: lengths.iter().map(|l| l.length_mm).collect(),
                    weight: lengths
                        .iter()
                        .map(|l| {
                            1.0 / (l.variance_mm2 + 2.0 * estimate.scatter.point_mm.powi(2)).max(f64::MIN_POSITIVE)
                        })
                        .collect(),
                }),
                Block::Frames { placements, oriented: false, .. } => {
                    blocks.extend(placements.iter().map(|p| FastBlock::Frame(Frame::new(p, &estimate.scatter))));
                }
                _ => return None,
            }
        }
        Some(FastCost { kernel: Kernel::new(&estimate.kinematics), blocks })
    }

    /// The sum of the squared whitened residuals at these offsets (mm, mrad).
    pub fn sum_of_squares(&self, offsets: &[f64]) -> f64 {
        let mut points = Points::default();
        self.kernel.points(offsets, &mut points);
        self.blocks.iter().map(|b| b.sum_of_squares(&points)).sum()
    }
}

impl Points {
    fn at(&self, pose: usize) -> Vector3<f64> {
        Vector3::new(self.x[pose], self.y[pose], self.z[pose])
    }
}

impl FastBlock {
    fn sum_of_squares(&self, points: &Points) -> f64 {
        match self {
            FastBlock::Center { center, pose, length_mm, weight } => {
                let from = points.at(*center);
                // Lanes of partial sums, added up in their order at the end.
                let mut sums = [0.0; LANES];
                let lanes = pose.chunks(LANES).zip(length_mm.chunks(LANES)).zip(weight.chunks(LANES));
                for ((pose, length), weight) in lanes {
                    for l in 0..pose.len() {
                        let at = pose[l];
                        let (dx, dy, dz) = (points.x[at] - from.x, points.y[at] - from.y, points.z[at] - from.z);
                        let residual = (dx * dx + dy * dy + dz * dz).sqrt() - length[l];
                        sums[l] += weight[l] * residual * residual;
                    }
                }
                sums.iter().sum()
            }
            FastBlock::Frame(frame) => frame.sum_of_squares(points),
        }
    }
}

impl Frame {
    fn new(spots: &[Spot], scatter: &Scatter) -> Frame {
        let whiten: Vec<Matrix3<f64>> = spots.iter().map(|s| whitener(&s.covariance_mm2, scatter)).collect();
        let weight: Vec<f64> =
            spots.iter().map(|s| 1.0 / (s.covariance_mm2.trace() / 3.0 + scatter.point_mm.powi(2))).collect();
        let measured: Vec<Vector3<f64>> = spots.iter().map(|s| s.point_mm.coords).collect();
        let isotropic =
            whiten.iter().zip(&weight).all(|(w, v)| (w - Matrix3::identity() * v.sqrt()).norm() < 1e-9 * v.sqrt());
        let total = weight.iter().sum::<f64>();
        let center = measured.iter().zip(&weight).map(|(x, w)| *w * x).sum::<Vector3<f64>>() / total;
        Frame { pose: spots.iter().map(|s| s.pose).collect(), measured, whiten, weight, isotropic, center, total }
    }

    fn sum_of_squares(&self, points: &Points) -> f64 {
        let mut frame = self.closed_form(points);
        if !self.isotropic {
            for _ in 0..FRAME_STEPS {
                frame = self.step(points, &frame);
            }
        }
        let rotation = crate::geometry::rotation_matrix(&frame);
        let translation = frame.translation.vector;
        let residual = |i: usize| rotation * points.at(self.pose[i]) + translation - self.measured[i];
        if self.isotropic {
            (0..self.pose.len()).map(|i| self.weight[i] * residual(i).norm_squared()).sum()
        } else {
            (0..self.pose.len()).map(|i| (self.whiten[i] * residual(i)).norm_squared()).sum()
        }
    }

    fn closed_form(&self, points: &Points) -> Transform {
        let mean =
            (0..self.pose.len()).map(|i| self.weight[i] * points.at(self.pose[i])).sum::<Vector3<f64>>() / self.total;
        let mut covariance = Matrix3::zeros();
        for i in 0..self.pose.len() {
            covariance +=
                (self.weight[i] * (self.measured[i] - self.center)) * (points.at(self.pose[i]) - mean).transpose();
        }
        let rotation = nearest_rotation(&covariance);
        transform_from_matrix(rotation, self.center - rotation * mean)
    }

    fn step(&self, points: &Points, frame: &Transform) -> Transform {
        let (mut normal, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        for i in 0..self.pose.len() {
            let turned = frame.rotation * Point3::from(points.at(self.pose[i]));
            let whiten = self.whiten[i];
            let residual = whiten * (turned.coords + frame.translation.vector - self.measured[i]);
            let mut design = nalgebra::Matrix3x6::zeros();
            design.fixed_columns_mut::<3>(0).copy_from(&(-whiten * skew(&turned.coords)));
            design.fixed_columns_mut::<3>(3).copy_from(&whiten);
            normal += design.tr_mul(&design);
            gradient += design.tr_mul(&residual);
        }
        match normal.cholesky() {
            Some(factor) => {
                let step = factor.solve(&gradient);
                perturb(frame, -step.fixed_rows::<3>(0), -step.fixed_rows::<3>(3))
            }
            None => *frame,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::dataset::Dataset;
    use crate::identify::settings::Model;
    use crate::identify::synthetic;

    #[test]
    fn fast_and_long_way_agree() {
        let world = synthetic::world(40, 0.05, 3);
        let set = Dataset::new(&world.rows, 1).unwrap();
        let parameters = world.nominal.mdh_parameters();
        let offsets: Vec<f64> = (0..parameters.len()).map(|i| (i as f64).sin()).collect();
        for model in [Model::CenterDistance, Model::Position] {
            let scatter = Scatter { point_mm: 0.1, rotation_rad: 1e-3 };
            let estimate = Estimate::new(&set, &world.nominal, &parameters, &set.fit_rows(), model, scatter, true);
            let long = estimate.evaluate(&offsets, false).0.norm_squared();
            let fast = FastCost::new(&estimate).unwrap().sum_of_squares(&offsets);
            assert!((fast / long - 1.0).abs() < 1e-9, "{model:?}: {fast} {long}");
        }
    }
}
