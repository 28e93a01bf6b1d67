//! Whether what a fit leaves follows the joints, or scatters.
//!
//! In: a fit and its data set. Out: whether further columns, the sine and the cosine of each joint for each number of a
//! reading, explain more of the residuals than chance does (an F test: the fit is nested in the one with these
//! columns). Readings that scatter, however much, know nothing of the joints; a robot that is not the file's leaves
//! errors that turn with them. Goes wrong: with few rows a pattern is not told from scatter.

use std::iter;

use nalgebra::DMatrix;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::identify::data::dataset::Dataset;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::linear_algebra::{Eliminated, rank};

/// Chance that readings that only scatter are said to follow the joints.
const FALSE_ALARM: f64 = 0.01;

/// Whether enough is left of a fit to tell, and it follows no joint.
pub fn is_scatter(formulation: &Formulation, set: &Dataset) -> bool {
    let linear = Linearised::new(&formulation.rows, &formulation.offsets_of());
    let numbers = linear.placements.iter().flat_map(Placement::by_pose).map(|(_, at)| at.len()).max().unwrap_or(0);
    let (fresh, shared) = (2 * set.joint_count() * numbers, linear.shared);
    // Of the residual, the fresh columns and the shared ones, in that order.
    let mut normal = DMatrix::zeros(1 + fresh + shared, 1 + fresh + shared);
    let mut left = 0.0;
    for placement in &linear.placements {
        let columns = columns(placement, formulation, set, fresh);
        normal += eliminated(placement, &columns, shared);
        left += placement.poses.len() as f64 - placement.linear.design.ncols() as f64;
    }
    left -= rank(&normal.view((1 + fresh, 1 + fresh), (shared, shared)).into_owned()) as f64;
    let normal = Eliminated::new(&normal, 1 + fresh).normal;
    let explaining = rank(&normal.view((1, 1), (fresh, fresh)).into_owned()) as f64;
    left -= explaining;
    // With fewer numbers left than the columns take, little would be noticed.
    if explaining < 1.0 || left < explaining {
        return false;
    }
    let unexplained = Eliminated::new(&normal, 1).normal[(0, 0)];
    let gain = (normal[(0, 0)] - unexplained) / explaining / (unexplained / left);
    FisherSnedecor::new(explaining, left).is_ok_and(|law| law.cdf(gain) < 1.0 - FALSE_ALARM)
}

/// Sine and cosine of each joint (of one that slides its way and the square of it), for each number of a pose's
/// reading.
fn columns(placement: &Placement, formulation: &Formulation, set: &Dataset, count: usize) -> DMatrix<f64> {
    let mut columns = DMatrix::zeros(placement.poses.len(), count);
    for (place, at) in placement.by_pose() {
        let joints = &set.poses[formulation.rows.rows[place]].joints_rad;
        for (number, row) in at.enumerate() {
            for (joint, &angle) in joints.iter().enumerate() {
                let column = 2 * (number * joints.len() + joint);
                (columns[(row, column)], columns[(row, column + 1)]) =
                    if set.is_sliding(joint) { (angle, angle * angle) } else { angle.sin_cos() };
            }
        }
    }
    columns
}

/// Product of [residual, fresh columns, shared unknowns] with itself, the placement's own unknowns eliminated.
fn eliminated(placement: &Placement, fresh: &DMatrix<f64>, shared: usize) -> DMatrix<f64> {
    let all: Vec<usize> = (0..placement.poses.len()).collect();
    let normal = placement.normal(&all, Some(fresh));
    let of_fresh = shared + 1 + placement.linear.design.ncols()..normal.nrows();
    let order: Vec<usize> =
        iter::once(shared).chain(of_fresh.clone()).chain(0..shared).chain(shared + 1..of_fresh.start).collect();
    let normal = DMatrix::from_fn(order.len(), order.len(), |r, c| normal[(order[r], order[c])]);
    Eliminated::new(&normal, 1 + fresh.ncols() + shared).normal
}

#[cfg(test)]
mod tests;
