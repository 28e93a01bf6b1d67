//! Whether every pose fits what all of them share, and from where on they no longer do.
//!
//! A pose whose two pictures were taken at two moments, and a rig that moved or creeps during the run, look alike: at
//! some poses `right_from_left` is not the one of the others. Six numbers of such a change are tested by Rao's score at
//! the common minimum, for every pose by itself, for all poses from one on, and for a change that grows from pose to
//! pose; nothing is fitted again for it. Chi-square falls by the score, with six degrees of freedom where nothing is
//! wrong. How far poses scatter is not known before: pictures that were not taken at one moment scatter more than their
//! corners. A change along the run is therefore told by how much it takes off what the poses leave together, whatever
//! the common fit made of their noise.

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use rayon::prelude::*;

use crate::statistics::median;
use crate::stereo::board_pose::solve::bundle::Normal;
use crate::stereo::board_pose::solve::pose_block::Eliminated;
use crate::stereo::solve::normal_equations::inverse6;

/// Median of chi-square with six degrees of freedom.
pub const MEDIAN_CHI_SQUARE_6: f64 = 5.348;

/// Numbers of a change.
pub const NUMBERS: f64 = 6.0;

/// A change of `right_from_left`, rotation (rad) and translation (mm), and by how much it would lower chi-square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    pub change: Vector6<f64>,
    pub fall: f64,
}

/// A change that comes with the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Along {
    /// The change where it is whole.
    pub change: Change,
    /// Which share of it there is at each pose.
    pub shares: Vec<f64>,
    /// First pose with a part of it.
    pub from: usize,
    /// True where it grows from pose to pose.
    pub creeps: bool,
    /// How much of the fall a change before the whole run does not bring as well.
    pub gain: f64,
    /// Twice the logarithm of how much likelier it makes the poses, whose scatter is not known before.
    pub evidence: f64,
}

/// What a change at each pose alone would gain, beside one that all have.
pub fn at_each(normal: &Normal, covariance: &DMatrix<f64>) -> Vec<Option<Change>> {
    let whole = vec![1.0; normal.poses.len()];
    let common = Sums::of(normal, &whole).score(covariance).map_or(Vector6::zeros(), |change| change.change);
    left(normal, covariance, &common, &whole)
}

/// What a change at a pose alone would gain where the minimum, in which it has its part, left all shared values free.
pub fn of_member(part: &Eliminated, covariance: &DMatrix<f64>) -> Option<Change> {
    score(&part.change, &part.change_shared, &part.change_gradient, covariance)
}

/// What a change would gain at a pose that had no part in the minimum.
pub fn of_outsider(part: &Eliminated, covariance: &DMatrix<f64>) -> Option<Change> {
    // The gradient scatters with the pose's own corners and with the shared values, which its corners did not help to
    // find.
    score(&part.change, &part.change_shared, &part.change_gradient, &-covariance)
}

/// The change along the run that gains most: from one pose on, or growing from the first to the last.
pub fn along(normal: &Normal, covariance: &DMatrix<f64>) -> Option<Along> {
    let first = normal.poses.iter().position(Option::is_some)?;
    let growing = shares_that_grow(normal)?;
    let whole = Sums::of(normal, &vec![1.0; normal.poses.len()]).score(covariance)?.fall;
    let creep = Sums::of(normal, &growing).score(covariance);
    let (from, step) = from_one_on(normal, covariance, first)?;
    let (change, shares, creeps) = match creep {
        Some(creep) if creep.fall > step.fall => (creep, growing, true),
        _ => (step, (0..normal.poses.len()).map(|i| f64::from(u8::from(i >= from))).collect(), false),
    };
    let gain = change.fall - whole;
    let rest: f64 = left(normal, covariance, &change.change, &shares).iter().flatten().map(|c| c.fall).sum();
    let freedom = (NUMBERS * (normal.poses.iter().flatten().count() as f64 - 2.0)).max(1.0);
    let evidence = freedom * (1.0 + gain.max(0.0) / rest.max(f64::MIN_POSITIVE)).ln();
    let from = if creeps { first } else { from };
    Some(Along { change, shares, from, creeps, gain, evidence })
}

/// Which share each pose has of a change that grows evenly from the first that takes part to the last. `None` where
/// there are no two.
pub fn shares_that_grow(normal: &Normal) -> Option<Vec<f64>> {
    let first = normal.poses.iter().position(Option::is_some)?;
    let last = normal.poses.iter().rposition(Option::is_some).filter(|last| *last > first)?;
    Some((0..normal.poses.len()).map(|i| i.saturating_sub(first) as f64 / (last - first) as f64).collect())
}

/// Where a change from one pose on gains most, and what: the index of its first pose.
fn from_one_on(normal: &Normal, covariance: &DMatrix<f64>, first: usize) -> Option<(usize, Change)> {
    let mut sums = Sums::zeros(covariance.nrows());
    let mut through = DMatrix::zeros(6, covariance.nrows());
    let mut best: Option<(usize, Change)> = None;
    // From the last pose on, so that each adds only its own part.
    let with_covariance: Vec<_> =
        normal.poses.par_iter().map(|part| Some(&part.as_ref()?.change_shared * covariance)).collect();
    for (i, (part, part_through)) in normal.poses.iter().zip(with_covariance).enumerate().skip(first + 1).rev() {
        let (Some(part), Some(part_through)) = (part, part_through) else { continue };
        sums.add(part, 1.0);
        through += part_through;
        let change = score_through(&sums.own, &(&through * sums.shared.transpose()), &sums.gradient);
        if let Some(change) = change
            && best.is_none_or(|(_, b)| change.fall > b.fall)
        {
            best = Some((i, change));
        }
    }
    best
}

/// What a change at each pose alone would gain after one of which each has its share.
fn left(normal: &Normal, covariance: &DMatrix<f64>, change: &Vector6<f64>, shares: &[f64]) -> Vec<Option<Change>> {
    let shared: DVector<f64> = -(covariance * Sums::of(normal, shares).shared.tr_mul(change));
    let of = |(part, share): (&Option<Eliminated>, &f64)| {
        let part = part.as_ref()?;
        let gradient = part.change_gradient + part.change * change * *share + &part.change_shared * &shared;
        score(&part.change, &part.change_shared, &gradient, covariance)
    };
    normal.poses.par_iter().zip(shares).map(of).collect()
}

/// How much larger the usual score of a pose is than chance, after [`at_each`]: one where the model holds.
pub fn usual_excess(each: &[Option<Change>]) -> f64 {
    let poses = each.iter().flatten().count() as f64;
    // One change that all have was taken off.
    let freed = if poses > 1.0 { poses / (poses - 1.0) } else { 1.0 };
    freed * of_usual(each)
}

/// The usual score over what chance makes of it.
pub fn of_usual(each: &[Option<Change>]) -> f64 {
    median(each.iter().flatten().map(|c| c.fall)).map_or(1.0, |m| m / MEDIAN_CHI_SQUARE_6)
}

/// Sums over poses of what they say of a change.
struct Sums {
    own: Matrix6<f64>,
    shared: DMatrix<f64>,
    gradient: Vector6<f64>,
}

impl Sums {
    fn zeros(shared: usize) -> Sums {
        Sums { own: Matrix6::zeros(), shared: DMatrix::zeros(6, shared), gradient: Vector6::zeros() }
    }

    /// Over all poses, of which each has a share of the change.
    fn of(normal: &Normal, shares: &[f64]) -> Sums {
        let mut sums = Sums::zeros(normal.told.matrix.nrows());
        for (part, share) in normal.poses.iter().zip(shares) {
            if let Some(part) = part {
                sums.add(part, *share);
            }
        }
        sums
    }

    fn add(&mut self, part: &Eliminated, share: f64) {
        self.own += part.change * share.powi(2);
        self.shared += &part.change_shared * share;
        self.gradient += part.change_gradient * share;
    }

    fn score(&self, covariance: &DMatrix<f64>) -> Option<Change> {
        score(&self.own, &self.shared, &self.gradient, covariance)
    }
}

fn score(
    own: &Matrix6<f64>,
    shared: &DMatrix<f64>,
    gradient: &Vector6<f64>,
    covariance: &DMatrix<f64>,
) -> Option<Change> {
    score_through(own, &(shared * covariance * shared.transpose()), gradient)
}

/// The same where it is known how the shared values' covariance comes through to the change.
fn score_through(own: &Matrix6<f64>, through: &DMatrix<f64>, gradient: &Vector6<f64>) -> Option<Change> {
    let curvature = own - Matrix6::from_fn(|i, j| 0.5 * (through[(i, j)] + through[(j, i)]));
    let change = -(inverse6(&curvature)? * gradient);
    Some(Change { change, fall: -gradient.dot(&change) })
}
