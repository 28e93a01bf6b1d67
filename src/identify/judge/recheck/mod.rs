//! Whether a robot that was identified earlier is still the one that takes these poses.
//!
//! In: the robot with the covariance of its parameters and its scatter, points of some ten new poses, with orientations
//! where both have them, and where the sensor stood. Out: whether it changed, by what, how far that moves the target,
//! and the smallest change of each kind that the poses would have shown. Method: the residuals at the old robot,
//! placements (and the target's turn) eliminated, are normal with the covariance of readings, scatter and old
//! parameters; a zero of one joint, another tool and another scale are directions of theirs ([`crate::difference`]),
//! all looks together at one level. Where the robot did not change, each placement is compared with the old one. Rows
//! that fit far worse than the rest are named and left out; readings that only scatter more are said to. Goes wrong:
//! what a placement takes up (the first joint's zero) is only seen as a sensor that moved; two joints at once are a
//! cause unknown.

mod compared;
mod comparison;
mod found;
mod looks;
mod moves;
mod scatter;
mod strays;
mod suspects;
#[cfg(test)]
mod tests;

pub use found::{Before, CauseSeen, Moved, Recheck, Stood};
pub use suspects::{variances_along, zero};

use self::comparison::Comparison;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::judge::locate::FEWEST_POSES;
use crate::robot::{Parameter, Robot};

/// Compares. A few rows that fit far worse than the rest are named and left out where the rest is then of one piece.
pub fn recheck(set: &Dataset, robot: &Robot, before: &Before, stood: Stood) -> Result<Recheck, Error> {
    let used = set.placing_rows(FEWEST_POSES)?;
    let mut parameters = before.parameters.clone();
    let others = (0..robot.joints.len()).map(zero(robot)).chain((0..3).map(Parameter::V));
    parameters.extend(others.filter(|p| !before.parameters.contains(p)));
    let oriented = set.has_rotations() && before.trust.rotation_rad.is_some();
    let comparison = Comparison { set, robot, before, stood, parameters, oriented };
    let whole = comparison.said(&used)?;
    let by_rows =
        || strays::left_out(&comparison, &used, &whole).or_else(|| scatter::larger(&comparison, &used, &whole));
    Ok(by_rows().unwrap_or(whole.recheck))
}
