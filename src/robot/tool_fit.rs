//! Where the target stands on the flange, and where the sensor: what a nominal chain leaves of measured points once both are solved.
//!
//! In: readings and points of one placement of the sensor. Out: the tool and what is left. Levenberg and Marquardt's method on the placement's
//! six numbers and the tool's three, from the placement that fits best with the tool of the file (Kabsch, 1976).
//! What goes wrong: a tool that the poses do not determine (one orientation) stays where the damping leaves it, which costs nothing.

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use super::Robot;
use crate::geometry::{Transform, fitted_frame, perturb, rigid_columns};
use crate::statistics::median;

/// Poses that are enough.
const POSES: usize = 60;

/// Fewest poses that have more numbers than unknowns.
const FEWEST: usize = 4;

/// Steps at the most.
const STEPS: usize = 40;

/// What a nominal chain leaves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToolFit {
    /// The target in the last frame, mm.
    pub tool_mm: Vector3<f64>,
    /// Middle distance of a predicted point from the measured one, mm.
    pub left_mm: f64,
    /// Root mean square distance of the measured points from their centre, mm.
    pub spread_mm: f64,
}

impl Robot {
    /// Middle distance of the points that this robot predicts from the measured ones, mm, once the sensor is placed.
    pub fn left_mm(&self, joints_rad: &[Vec<f64>], points_mm: &[Point3<f64>]) -> Option<f64> {
        let predicted: Vec<Vector3<f64>> = joints_rad.iter().map(|q| self.target_mm(q).coords).collect();
        let measured: Vec<Vector3<f64>> = points_mm.iter().map(|p| p.coords).collect();
        let frame = nearest(&predicted, &measured);
        median(predicted.iter().zip(&measured).map(|(p, m)| (frame * Point3::from(*p) - m).coords.norm()))
    }

    /// The tool with which this chain comes nearest to the points; `None` for fewer than four poses.
    pub fn fit_tool(&self, joints_rad: &[Vec<f64>], points_mm: &[Point3<f64>]) -> Option<ToolFit> {
        let count = joints_rad.len().min(points_mm.len());
        if count < FEWEST {
            return None;
        }
        let step = count.div_ceil(POSES);
        let rows: Vec<usize> = (0..count).step_by(step).collect();
        let flanges: Vec<_> = rows.iter().map(|&i| self.base_from_flange(&joints_rad[i])).collect();
        let measured: Vec<Vector3<f64>> = rows.iter().map(|&i| points_mm[i].coords).collect();
        let mut tool = self.tool_mm;
        let predicted: Vec<Vector3<f64>> = flanges.iter().map(|f| (f * Point3::from(tool)).coords).collect();
        let mut frame = nearest(&predicted, &measured);
        let residuals = |frame: &Transform, tool: &Vector3<f64>| -> Vec<Vector3<f64>> {
            let off = |(f, m): (&Transform, &Vector3<f64>)| (frame * (f * Point3::from(*tool))).coords - m;
            flanges.iter().zip(&measured).map(off).collect()
        };
        let cost = |r: &[Vector3<f64>]| r.iter().map(Vector3::norm_squared).sum::<f64>();
        let (mut now, mut damping) = (residuals(&frame, &tool), 1e-6);
        for _ in 0..STEPS {
            let (mut normal, mut gradient) = (SMatrix::<f64, 9, 9>::zeros(), SVector::<f64, 9>::zeros());
            for (flange, residual) in flanges.iter().zip(&now) {
                let turned = frame.rotation * (flange * Point3::from(tool)).coords;
                let mut jacobian = SMatrix::<f64, 3, 9>::zeros();
                jacobian.fixed_view_mut::<3, 6>(0, 0).copy_from(&rigid_columns(&turned));
                let of_tool = (frame.rotation * flange.rotation).to_rotation_matrix().into_inner();
                jacobian.fixed_view_mut::<3, 3>(0, 6).copy_from(&of_tool);
                normal += jacobian.transpose() * jacobian;
                gradient += jacobian.transpose() * residual;
            }
            for i in 0..9 {
                normal[(i, i)] *= 1.0 + damping;
                normal[(i, i)] += f64::MIN_POSITIVE;
            }
            let Some(step) = normal.cholesky().map(|c| c.solve(&-gradient)) else {
                damping *= 10.0;
                continue;
            };
            let next = perturb(&frame, step.as_slice());
            let moved = tool + step.fixed_rows::<3>(6);
            let then = residuals(&next, &moved);
            let (before, after) = (cost(&now), cost(&then));
            if after < before {
                (frame, tool, now, damping) = (next, moved, then, (damping / 10.0).max(1e-12));
                if after > before * (1.0 - 1e-6) {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        let left_mm = median(now.iter().map(Vector3::norm))?;
        let centre = measured.iter().sum::<Vector3<f64>>() / measured.len() as f64;
        let spread_mm = (cost(&measured.iter().map(|m| m - centre).collect::<Vec<_>>()) / measured.len() as f64).sqrt();
        left_mm.is_finite().then_some(ToolFit { tool_mm: tool, left_mm, spread_mm })
    }
}

/// The transform that takes `from` nearest to `to`.
fn nearest(from: &[Vector3<f64>], to: &[Vector3<f64>]) -> Transform {
    fitted_frame(from.iter().zip(to).map(|(a, b)| (Point3::from(*a), Point3::from(*b), 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;

    #[test]
    fn a_tool_that_the_file_lacks_is_found() {
        for size in [0.0, 50.0, 400.0] {
            let mut truth = Robot::paper();
            truth.tool_mm = Vector3::new(0.4, -0.3, 0.86) * size;
            let sensor = transform(Vector3::new(0.4, 2.0, -0.7), Vector3::new(900.0, -2000.0, 300.0));
            let joints: Vec<Vec<f64>> =
                (0..20).map(|i| (0..6).map(|j| ((7 * i + 3 * j * j) as f64).sin() * 1.4).collect()).collect();
            let points: Vec<Point3<f64>> = joints.iter().map(|q| sensor * truth.target_mm(q)).collect();
            let found = Robot::paper().fit_tool(&joints, &points).unwrap();
            assert!((found.tool_mm - truth.tool_mm).norm() < 1e-3 && found.left_mm < 1e-3, "{size}: {found:?}");
            // Metres taken for mm leave about as much as the points are apart.
            let small: Vec<Point3<f64>> = points.iter().map(|p| p / 1000.0).collect();
            assert!(Robot::paper().fit_tool(&joints, &small).unwrap().left_mm > 10.0);
        }
    }
}
