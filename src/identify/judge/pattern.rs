//! Whether what a fit leaves follows the joints, or scatters.
//!
//! In: a fit and its data set. Out: whether further columns, the sine and the cosine of each joint for each number of a
//! reading, explain more of the residuals than chance does (an F test: the fit is nested in the one with these
//! columns). Readings that scatter, however much, know nothing of the joints; a robot that is not the file's leaves
//! errors that turn with them. Goes wrong: with few rows a pattern is not told from scatter.

use std::iter;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::identify::data::dataset::Dataset;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::linear_algebra::{Eliminated, rank};

/// Chance that readings that only scatter are said to follow the joints.
const FALSE_ALARM: f64 = 0.01;

/// What further columns explain of what a fit leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Share of the sum of squares beyond what as many columns that mean nothing take.
    pub share: f64,
    /// How often columns that mean nothing explain as much.
    pub chance: f64,
    /// Their factors, and how well each is known (standard deviation).
    pub factors: DVector<f64>,
    pub sds: DVector<f64>,
}

/// What the first `tested` of these columns of each placement explain, everything else that is fitted and the other
/// columns at their best. `None` where too little is left to tell: with fewer numbers left than the columns take,
/// little would be noticed, and of points that were computed nothing is left at all.
pub fn explained(
    linear: &Linearised,
    tested: usize,
    columns: impl Fn(&Placement) -> DMatrix<f64>,
) -> Option<Explained> {
    let all: Vec<DMatrix<f64>> = linear.placements.iter().map(columns).collect();
    let kept = 1 + all.first()?.ncols() + linear.shared;
    // Of the residual, the fresh columns and the shared ones, in that order.
    let mut normal = DMatrix::zeros(kept, kept);
    let mut left = 0.0;
    for (placement, columns) in linear.placements.iter().zip(&all) {
        normal += eliminated(placement, columns, linear.shared);
        left += placement.poses.len() as f64 - placement.linear.design.ncols() as f64;
    }
    let others = kept - 1 - tested;
    left -= rank(&normal.view((1 + tested, 1 + tested), (others, others)).into_owned()) as f64;
    let normal = Eliminated::new(&normal, 1 + tested).normal;
    let explaining = rank(&normal.view((1, 1), (tested, tested)).into_owned()) as f64;
    left -= explaining;
    if explaining < 1.0 || left < explaining {
        return None;
    }
    let Eliminated { normal: of_residual, follow, inverse } = Eliminated::new(&normal, 1);
    let (whole, unexplained) = (normal[(0, 0)], of_residual[(0, 0)]);
    let scatter = unexplained / left;
    let law = FisherSnedecor::new(explaining, left).ok().filter(|_| scatter > 0.0)?;
    Some(Explained {
        share: (whole - unexplained - explaining * scatter) / whole,
        chance: law.sf((whole - unexplained) / explaining / scatter),
        factors: -follow.column(0),
        sds: inverse.diagonal().map(|variance| (variance * scatter).sqrt()),
    })
}

/// Whether enough is left of a fit to tell, and it follows no joint.
pub fn is_scatter(formulation: &Formulation, set: &Dataset) -> bool {
    let linear = Linearised::new(&formulation.rows, &formulation.offsets_of());
    let numbers = linear.placements.iter().flat_map(Placement::by_pose).map(|(_, at)| at.len()).max().unwrap_or(0);
    let count = 2 * set.joint_count() * numbers;
    explained(&linear, count, |placement| columns(placement, formulation, set, count))
        .is_some_and(|explained| explained.chance > FALSE_ALARM)
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
