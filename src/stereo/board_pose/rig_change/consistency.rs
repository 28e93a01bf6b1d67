//! Whether every pose fits what all of them share, and from where on they no longer do.
//!
//! A pose whose two pictures were taken at two moments, and a rig that moved during the run, look alike: at some poses
//! `right_from_left` is not the one of the others. Six numbers of such a change are tested by Rao's score at the common minimum, for
//! every pose by itself and for all poses from one on; nothing is fitted again for it. Chi-square falls by the score, with
//! six degrees of freedom where nothing is wrong.

use nalgebra::{DMatrix, Matrix6, Vector6};
use rayon::prelude::*;

use crate::statistics::median;
use crate::stereo::board_pose::solve::bundle::{Normal, PosePart};
use crate::stereo::board_pose::solve::pose_block::Eliminated;
use crate::stereo::solve::normal_equations::inverse6;

/// Median of chi-square with six degrees of freedom.
const MEDIAN_CHI_SQUARE_6: f64 = 5.348;

/// A change of `right_from_left`, rotation (rad) and translation (mm), and by how much it would lower chi-square.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::stereo::board_pose) struct Change {
    /// The change.
    pub change: Vector6<f64>,
    /// Fall of chi-square.
    pub fall: f64,
}

/// What a change at each pose alone would gain.
pub(in crate::stereo::board_pose) fn at_each(normal: &Normal, covariance: &DMatrix<f64>) -> Vec<Option<Change>> {
    let of = |part: &PosePart| score(&part.change, &part.change_shared, &part.change_gradient, covariance);
    normal.poses.par_iter().map(|part| of(part.as_ref()?)).collect()
}

/// What a change would gain at a pose that had no part in the minimum.
pub(in crate::stereo::board_pose) fn of_outsider(part: &Eliminated, covariance: &DMatrix<f64>) -> Option<Change> {
    // The gradient scatters with the pose's own corners and with the shared values, which its corners did not help to find.
    score(&part.change, &part.change_shared, &part.change_gradient, &-covariance)
}

/// Where a change from one pose on gains most, and what: the index of its first pose, and how much of the gain a change before the
/// whole run does not have as well.
pub(in crate::stereo::board_pose) fn from_one_on(
    normal: &Normal,
    covariance: &DMatrix<f64>,
) -> Option<(usize, Change, f64)> {
    let mut own = Matrix6::zeros();
    let mut shared = DMatrix::zeros(6, covariance.nrows());
    let mut gradient = Vector6::zeros();
    let mut through = DMatrix::zeros(6, covariance.nrows());
    let mut best: Option<(usize, Change)> = None;
    let first = normal.poses.iter().position(Option::is_some)?;
    let mut whole = 0.0;
    // From the last pose on, so that each adds only its own part.
    let with_covariance: Vec<_> =
        normal.poses.par_iter().map(|part| Some(&part.as_ref()?.change_shared * covariance)).collect();
    for (i, (part, part_through)) in normal.poses.iter().zip(with_covariance).enumerate().skip(first).rev() {
        let (Some(part), Some(part_through)) = (part, part_through) else { continue };
        own += part.change;
        shared += &part.change_shared;
        through += part_through;
        gradient += part.change_gradient;
        let change = score_through(&own, &(&through * shared.transpose()), &gradient);
        if i == first {
            whole = change.map_or(0.0, |change| change.fall);
        } else if let Some(change) = change
            && best.is_none_or(|(_, b)| change.fall > b.fall)
        {
            best = Some((i, change));
        }
    }
    best.map(|(i, change)| (i, change, change.fall - whole))
}

/// How much larger the usual score of a pose is than chance: one where the model holds.
pub(in crate::stereo::board_pose) fn usual_excess(each: &[Option<Change>]) -> f64 {
    median(each.iter().flatten().map(|c| c.fall)).map_or(1.0, |m| (m / MEDIAN_CHI_SQUARE_6).max(1.0))
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
