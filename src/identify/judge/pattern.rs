//! Whether what a fit leaves follows the joints, or scatters.
//!
//! In: a fit and its data set. Out: whether further columns, the sine and the cosine of each joint for each number of a
//! reading, explain more of the residuals than chance does (an F test: the fit is nested in the one with these
//! columns). Readings that scatter, however much, know nothing of the joints; a robot that is not the file's leaves
//! errors that turn with them. Goes wrong: with few rows a pattern is not told from scatter.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use crate::identify::data::dataset::Dataset;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::linear_algebra::{product, pseudo_inverse, rank, without};

/// Chance that readings that only scatter are said to follow the joints.
const FALSE_ALARM: f64 = 0.01;

/// What further columns explain of what a fit leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Share of the sum of squares beyond what as many columns that mean nothing take.
    pub share: f64,
    /// How often columns that mean nothing explain as much.
    pub chance: f64,
    /// Their factors, as an offset of an unknown, and how well each is known (standard deviation).
    pub factors: DVector<f64>,
    pub sds: DVector<f64>,
}

impl Explained {
    /// The chance, and how well the factors are known, where the numbers of a pose err together, as by an angle that
    /// scatters: by what each pose alone says of the factors (the sandwich of clusters, Hotelling's law), which knows
    /// nothing of how what is left scatters. `None` where poses are too few for that.
    pub fn by_pose(&self, left: &Left) -> Option<Explained> {
        let inverse = pseudo_inverse(product(&left.tested, &left.tested));
        let unexplained = &left.residual + &left.tested * &self.factors;
        // A fit follows what it is fitted to: what is left is smaller than what is there, by the share of the unknowns.
        let followed = left.freedom / left.residual.len() as f64;
        let mut scores = DMatrix::zeros(self.factors.len(), left.poses.len());
        for (mut score, at) in scores.column_iter_mut().zip(&left.poses) {
            let (columns, errors) = (left.tested.rows(at.start, at.len()), unexplained.rows(at.start, at.len()));
            score.gemv_tr(1.0 / followed, &columns, &errors, 0.0);
        }
        let (poses, tested) = (left.poses.len() as f64, rank(&product(&left.tested, &left.tested)) as f64);
        let covariance = &inverse * (&scores * scores.transpose()) * &inverse;
        let squared = (self.factors.transpose() * pseudo_inverse(covariance.clone()) * &self.factors)[0];
        let law = FisherSnedecor::new(tested, poses - tested).ok()?;
        Some(Explained {
            chance: law.sf(squared * (poses - tested) / (tested * (poses - 1.0))),
            sds: covariance.diagonal().map(f64::sqrt),
            ..self.clone()
        })
    }
}

/// What a fit leaves and columns that are tested, everything else that is fitted and the other columns at their best.
#[derive(Debug, Clone)]
pub struct Left {
    residual: DVector<f64>,
    tested: DMatrix<f64>,
    /// Numbers less what is fitted to them without the tested columns.
    freedom: f64,
    /// The numbers of each pose.
    poses: Vec<Range<usize>>,
}

impl Left {
    /// Of the first `tested` of these columns of each placement.
    pub fn new(linear: &Linearised, tested: usize, columns: impl Fn(&Placement) -> DMatrix<f64>) -> Option<Left> {
        let (mut parts, mut poses, mut freedom, mut start) = (Vec::new(), Vec::new(), 0.0, 0);
        for placement in &linear.placements {
            let (fresh, of_placement) = (columns(placement), &placement.linear);
            let count = placement.poses.len();
            let all = DMatrix::from_fn(count, 1 + fresh.ncols() + linear.shared, |r, c| match c {
                0 => placement.at_zero[r],
                _ if c <= fresh.ncols() => fresh[(r, c - 1)],
                _ => of_placement.jacobian[(r, c - 1 - fresh.ncols())],
            });
            parts.push(without(&all, &of_placement.design));
            poses.extend(placement.by_pose().map(|(_, at)| start + at.start..start + at.end));
            freedom += count as f64 - of_placement.design.ncols() as f64;
            start += count;
        }
        let kept = 1 + tested;
        let mut all = DMatrix::zeros(start, parts.first()?.ncols());
        let mut at = 0;
        for part in parts {
            all.rows_mut(at, part.nrows()).copy_from(&part);
            at += part.nrows();
        }
        let others = all.columns(kept, all.ncols() - kept).into_owned();
        freedom -= rank(&product(&others, &others)) as f64;
        let left = without(&all.columns(0, kept).into_owned(), &others);
        let residual = left.column(0).into_owned();
        Some(Left { residual, tested: left.columns(1, tested).into_owned(), freedom, poses })
    }

    /// What the columns explain. `None` where too little is left to tell: with fewer numbers left than the columns take,
    /// little would be noticed, and of points that were computed nothing is left at all.
    pub fn explained(&self) -> Option<Explained> {
        let normal = product(&self.tested, &self.tested);
        let explaining = rank(&normal) as f64;
        let left = self.freedom - explaining;
        if explaining < 1.0 || left < explaining {
            return None;
        }
        let inverse = pseudo_inverse(normal);
        let factors = -&inverse * self.tested.tr_mul(&self.residual);
        let whole = self.residual.norm_squared();
        let unexplained = (&self.residual + &self.tested * &factors).norm_squared();
        let scatter = unexplained / left;
        let law = FisherSnedecor::new(explaining, left).ok().filter(|_| scatter > 0.0)?;
        Some(Explained {
            share: (whole - unexplained - explaining * scatter) / whole,
            chance: law.sf((whole - unexplained) / explaining / scatter),
            factors,
            sds: inverse.diagonal().map(|variance| (variance * scatter).sqrt()),
        })
    }
}

/// Whether enough is left of a fit to tell, and it follows no joint.
pub fn is_scatter(formulation: &Formulation, set: &Dataset) -> bool {
    let linear = Linearised::new(&formulation.rows, &formulation.offsets_of());
    let numbers = linear.placements.iter().flat_map(Placement::by_pose).map(|(_, at)| at.len()).max().unwrap_or(0);
    let count = 2 * set.joint_count() * numbers;
    Left::new(&linear, count, |placement| columns(placement, formulation, set, count))
        .and_then(|left| left.explained())
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

#[cfg(test)]
mod tests;
