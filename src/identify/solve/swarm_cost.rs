//! The cost alone, for the swarms: the robot's points, then sums in a fixed order without building matrices.
//!
//! Distances to a centre have no unknowns; touched points have a closed form where two at the most are tied by a known distance; other
//! unknowns are found as `placement` does. Pairwise distances go the long way.

use nalgebra::{Matrix3, Vector3};

use super::placement::Placement;
use crate::identify::model::kinematics::Kinematics;
use crate::identify::model::kinematics::points::Points as Computed;
use crate::identify::residuals::eliminate::Block;
use crate::identify::residuals::points::Points;
use crate::identify::residuals::rows::Rows;
use crate::identify::residuals::touch::{Known, Touch};
use crate::identify::sensor::Scatter;

/// Blocks whose cost needs no matrices.
#[derive(Debug, Clone)]
pub struct SwarmCost {
    kinematics: Kinematics,
    blocks: Vec<BlockCost>,
}

#[derive(Debug, Clone)]
enum BlockCost {
    /// The centre's pose; pose, length and weight of each distance.
    Center(usize, Vec<(usize, f64, f64)>),
    Touch(Sockets),
    Placement(Placement),
}

/// Touched points, each with its poses and their weights.
#[derive(Debug, Clone)]
struct Sockets {
    touched: Vec<Vec<(usize, f64)>>,
    known: Option<Known>,
}

impl SwarmCost {
    /// `None` where a block is of another kind.
    pub fn new(rows: &Rows) -> Option<SwarmCost> {
        let scatter = &rows.scatter;
        let kinematics = &rows.kinematics;
        let mut places = None;
        let mut blocks = Vec::new();
        for block in &rows.blocks {
            blocks.push(match block {
                Block::Points(Points { field: Some(_), .. }) => return None,
                Block::Points(p) if p.spots.iter().any(|spot| spot.on_body_mm.is_some()) => return None,
                Block::Center(c) => {
                    let weighted =
                        c.lengths.iter().map(|l| (l.pose, l.length_mm, (l.weight / scatter.sd(l, 2.0)).powi(2)));
                    BlockCost::Center(c.center, weighted.collect())
                }
                Block::Touch(touch) => BlockCost::Touch(Sockets::new(touch, scatter)?),
                _ => {
                    let places = places
                        .get_or_insert_with(|| kinematics.places(&vec![0.0; kinematics.parameters().len()], true));
                    BlockCost::Placement(Placement::new(block, places, scatter)?)
                }
            });
        }
        Some(SwarmCost { kinematics: kinematics.clone(), blocks })
    }

    /// The sum of the squared white residuals at these offsets (mm, mrad).
    pub fn sum_of_squares(&self, offsets: &[f64]) -> f64 {
        let points = self.kinematics.points(offsets);
        let oriented = self.blocks.iter().any(|b| matches!(b, BlockCost::Placement(p) if p.is_oriented()));
        let rotations = if oriented { self.kinematics.rotations(offsets) } else { Vec::new() };
        self.blocks.iter().map(|b| b.sum_of_squares(offsets, &points, &rotations)).sum()
    }
}

impl BlockCost {
    fn sum_of_squares(&self, offsets: &[f64], points: &Computed, rotations: &[Matrix3<f64>]) -> f64 {
        match self {
            BlockCost::Center(center, lengths) => {
                let square = |&(pose, length_mm, weight): &(usize, f64, f64)| {
                    weight * ((points.at(pose) - points.at(*center)).norm() - length_mm).powi(2)
                };
                lengths.iter().map(square).sum()
            }
            BlockCost::Touch(sockets) => sockets.sum_of_squares(points),
            BlockCost::Placement(placement) => placement.sum_of_squares(offsets, points, rotations),
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::data::dataset::Dataset;
    use crate::identify::residuals::rows::RowSpec;
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
        let rows = Rows::new(&RowSpec {
            set: &set,
            robot: &world.nominal,
            load_chain: &world.nominal,
            parameters: &parameters,
            extras: &[],
            rows: &set.fit_rows(),
            weights: &weights,
            model,
            scatter,
            wire_offset: true,
        });
        let long = rows.evaluate(&offsets, false).0.norm_squared();
        let fast = SwarmCost::new(&rows).unwrap().sum_of_squares(&offsets);
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
