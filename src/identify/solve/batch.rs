//! The cost alone, for the swarms: points from the [`Kernel`], then sums in a fixed order without building matrices.
//!
//! Distances to a centre have no unknowns; a rigid transform has a closed form (Kabsch) where each point's weight is equal
//! in all directions, and so have touched points of which two at the most are tied by a known distance; other unknowns are found as
//! `placement` does. Pairwise distances go the long way.

use nalgebra::{Matrix3, Vector3};

use super::kernel::{Kernel, LANES, Points as Computed};
use super::placement::Placement;
use crate::geometry::nearest_rotation;
use crate::geometry::{Transform, rotation_matrix, transform_from_matrix};
use crate::identify::residuals::eliminate::Block;
use crate::identify::residuals::points::Points;
use crate::identify::residuals::rows::Rows;
use crate::identify::residuals::touch::{Known, Touch};
use crate::identify::sensor::{Scatter, Spot};

/// Blocks whose cost needs no matrices.
#[derive(Debug, Clone)]
pub struct BatchCost {
    kernel: Kernel,
    blocks: Vec<BatchBlock>,
}

#[derive(Debug, Clone)]
enum BatchBlock {
    Center { center: usize, pose: Vec<usize>, length_mm: Vec<f64>, weight: Vec<f64> },
    Frame(Frame),
    Touch(Sockets),
    Placement(Placement),
}

/// A placement whose points have each a weight that is equal in all directions.
#[derive(Debug, Clone)]
struct Frame {
    pose: Vec<usize>,
    measured: Vec<Vector3<f64>>,
    weight: Vec<f64>,
    center: Vector3<f64>,
    total: f64,
}

/// Touched points, each with its poses and their weights.
#[derive(Debug, Clone)]
struct Sockets {
    touched: Vec<Vec<(usize, f64)>>,
    known: Option<Known>,
}

impl BatchCost {
    /// `None` where a block is of another kind.
    pub fn new(rows: &Rows) -> Option<BatchCost> {
        let scatter = &rows.scatter;
        let kinematics = &rows.kinematics;
        let mut places = None;
        let mut blocks = Vec::new();
        for block in &rows.blocks {
            blocks.push(match block {
                Block::Points(Points { field: Some(_), .. }) => return None,
                Block::Points(p) if p.spots.iter().any(|spot| spot.on_body_mm.is_some()) => return None,
                Block::Center(c) => BatchBlock::Center {
                    center: c.center,
                    pose: c.lengths.iter().map(|l| l.pose).collect(),
                    length_mm: c.lengths.iter().map(|l| l.length_mm).collect(),
                    weight: c.lengths.iter().map(|l| (l.weight / scatter.sd(l, 2.0)).powi(2)).collect(),
                },
                Block::Points(p) if !p.oriented && p.spots.iter().all(|spot| is_isotropic(spot, scatter)) => {
                    BatchBlock::Frame(Frame::new(p, scatter))
                }
                Block::Touch(touch) => BatchBlock::Touch(Sockets::new(touch, scatter)?),
                _ => {
                    let places = places
                        .get_or_insert_with(|| kinematics.places(&vec![0.0; kinematics.parameters().len()], true));
                    BatchBlock::Placement(Placement::new(block, places, scatter)?)
                }
            });
        }
        Some(BatchCost { kernel: Kernel::new(kinematics), blocks })
    }

    /// The sum of the squared white residuals at these offsets (mm, mrad).
    pub fn sum_of_squares(&self, offsets: &[f64]) -> f64 {
        let mut points = Computed::default();
        self.kernel.points(offsets, &mut points);
        let oriented = self.blocks.iter().any(|b| matches!(b, BatchBlock::Placement(p) if p.is_oriented()));
        let rotations = if oriented { self.kernel.rotations(offsets) } else { Vec::new() };
        self.blocks.iter().map(|b| b.sum_of_squares(offsets, &points, &rotations)).sum()
    }
}

impl BatchBlock {
    fn sum_of_squares(&self, offsets: &[f64], points: &Computed, rotations: &[Matrix3<f64>]) -> f64 {
        match self {
            BatchBlock::Center { center, pose, length_mm, weight } => {
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
            BatchBlock::Frame(frame) => frame.sum_of_squares(points),
            BatchBlock::Touch(sockets) => sockets.sum_of_squares(points),
            BatchBlock::Placement(placement) => placement.sum_of_squares(offsets, points, rotations),
        }
    }
}

fn is_isotropic(spot: &Spot, scatter: &Scatter) -> bool {
    let whiten = scatter.whitener(&spot.covariance_mm2);
    let mean = whiten.trace() / 3.0;
    (whiten - Matrix3::identity() * mean).norm() < 1e-9 * mean
}

impl Sockets {
    /// `None` where more than two sockets are tied.
    fn new(touch: &Touch, scatter: &Scatter) -> Option<Sockets> {
        if touch.known.len() > 1 {
            return None;
        }
        let mut touched = vec![Vec::new(); touch.sockets.len()];
        for contact in &touch.contacts {
            let variance = contact.variance_mm2 * scatter.stated + scatter.point_mm * scatter.point_mm;
            touched[contact.socket].push((contact.pose, contact.weight * contact.weight / variance));
        }
        Some(Sockets { touched, known: touch.known.first().copied() })
    }

    fn sum_of_squares(&self, points: &Computed) -> f64 {
        let mut sum = 0.0;
        let mut means = Vec::with_capacity(self.touched.len());
        for list in &self.touched {
            let total = list.iter().map(|(_, w)| w).sum::<f64>().max(f64::MIN_POSITIVE);
            let mean = list.iter().map(|(pose, w)| points.at(*pose) * *w).sum::<Vector3<f64>>() / total;
            sum += list.iter().map(|(pose, w)| w * (points.at(*pose) - mean).norm_squared()).sum::<f64>();
            means.push((mean, total));
        }
        if let Some(k) = self.known {
            // Both sockets give way along their line, each by its own weight.
            let ((a, wa), (b, wb)) = (means[k.a], means[k.b]);
            let variance = k.sigma_mm * k.sigma_mm + 1.0 / wa + 1.0 / wb;
            sum += ((b - a).norm() - k.distance_mm).powi(2) / variance;
        }
        sum
    }
}

impl Frame {
    fn new(placement: &Points, scatter: &Scatter) -> Frame {
        let spots = &placement.spots;
        let weight: Vec<f64> =
            spots.iter().map(|s| s.weight * s.weight * 3.0 / scatter.total(&s.covariance_mm2).trace()).collect();
        let measured: Vec<Vector3<f64>> = spots.iter().map(|s| s.point_mm.coords).collect();
        let total = weight.iter().sum::<f64>();
        let center = measured.iter().zip(&weight).map(|(x, w)| *w * x).sum::<Vector3<f64>>() / total;
        Frame { pose: spots.iter().map(|s| s.pose).collect(), measured, weight, center, total }
    }

    fn sum_of_squares(&self, points: &Computed) -> f64 {
        let frame = self.closed_form(points);
        let (rotation, translation) = (rotation_matrix(&frame), frame.translation.vector);
        let residual = |i: usize| rotation * points.at(self.pose[i]) + translation - self.measured[i];
        (0..self.pose.len()).map(|i| self.weight[i] * residual(i).norm_squared()).sum()
    }

    fn closed_form(&self, points: &Computed) -> Transform {
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::residuals::rows::Recipe;
    use crate::identify::settings::Model;
    use crate::identify::synthetic;
    use crate::measurements::{Measurement, Observed, Role};
    use nalgebra::Point3;

    /// Costs of a robot that is up to a millimetre and a milliradian off everywhere, both ways.
    fn agree(rows: &[Measurement], model: Model) {
        let world = synthetic::world(40, 0.05, 3);
        let set = Dataset::new(rows).unwrap();
        let parameters = world.nominal.mdh_parameters();
        let offsets: Vec<f64> = (0..parameters.len()).map(|i| (i as f64).sin()).collect();
        let scatter = Scatter { point_mm: 0.1, rotation_rad: 1e-3, stated: 1.0, smooth: None };
        let weights: Vec<f64> = (0..set.poses.len()).map(|i| 1.0 - 0.1 * (i % 4) as f64).collect();
        let rows = Rows::new(&Recipe {
            set: &set,
            robot: &world.nominal,
            levers: &world.nominal,
            parameters: &parameters,
            extras: &[],
            rows: &set.fit_rows(),
            weights: &weights,
            model,
            scatter,
            wire_offset: true,
        });
        let long = rows.evaluate(&offsets, false).0.norm_squared();
        let fast = BatchCost::new(&rows).unwrap().sum_of_squares(&offsets);
        assert!((fast / long - 1.0).abs() < 1e-9, "{model:?}: {fast} {long}");
    }

    #[test]
    fn fast_and_long_way_agree() {
        let rows = synthetic::world(40, 0.05, 3).rows;
        agree(&rows, Model::CenterDistance);
        agree(&rows, Model::Position);
    }

    #[test]
    fn with_unequal_weights_and_orientations_too() {
        let world = synthetic::world(40, 0.05, 3);
        let mut rows = world.rows;
        for (i, row) in rows.iter_mut().enumerate() {
            let at = world.truth.base_from_flange(&row.at.joints_rad());
            let Observed::Position { covariance_mm2, rotation_rad, .. } = &mut row.observed else { continue };
            *covariance_mm2 = Some(Matrix3::from_diagonal(&Vector3::new(1e-4, 2e-4, 1e-2 * (1.0 + (i % 3) as f64))));
            *rotation_rad = Some(crate::geometry::rotation_vector(&at) + Vector3::repeat(1e-3 * (i as f64).sin()));
        }
        agree(&rows, Model::Position);
        agree(&rows, Model::Pose);
    }

    #[test]
    fn with_a_wire_to_an_unknown_point_too() {
        let world = synthetic::world(40, 0.05, 3);
        let mut rows = world.rows;
        for (i, row) in rows.iter_mut().enumerate() {
            row.at.role = Role::Sample;
            let from_anchor = world.truth.target_mm(&row.at.joints_rad()) - Point3::new(900.0, 300.0, -100.0);
            row.observed =
                Observed::Distance { distance_mm: from_anchor.norm() + 0.3 * (i as f64).sin(), sigma_mm: None };
        }
        agree(&rows, Model::CenterDistance);
    }
}
