//! Whether a robot that was identified earlier is still the one that takes these poses.
//!
//! In: the robot with the covariance of its parameters and its scatter, points of some ten new poses, with orientations where both have them, and
//! where the sensor stood. Out: whether it changed, by what, how far that moves the target, and the smallest change of each kind that the poses
//! would have shown. Method: the residuals at the old robot, placements (and the target's turn) eliminated, are normal with the covariance of
//! readings, scatter and old parameters; a zero of one joint, another tool and another scale are directions of theirs
//! ([`crate::difference`]), all looks together at one level. Where the robot did not change, each placement is compared with the old one.
//! Rows that fit far worse than the rest are named and left out. Goes wrong: what a placement takes up (the first joint's zero) is only seen as a sensor that moved; two joints at once are a cause unknown.

mod compare;
mod compared;
mod comparison;
mod found;
mod looks;
mod moves;
mod strays;
mod suspects;
#[cfg(test)]
mod tests;

pub use compare::recheck;
pub use comparison::Stood;
pub use found::{Before, CauseSeen, Moved, Recheck};
