//! Where to send the robot so that its parameters are determined best.
//!
//! In: the nominal robot, the calibrated rig, the spheres to work on, what was measured before. Out: poses with their
//! roles, what they determine, and the accuracy to expect. Method: a pool of inverse-kinematics solutions that both
//! cameras see ([`pool`]); of these the ones that make the mean variance of the target's place over the spheres least
//! ([`choose`]), by the information that `identify` itself uses: the points' residuals with a free transform a
//! placement. What goes wrong: a place that the robot does not reach, a rig that does not see it; collisions of the arm
//! with itself, the cameras or the cell are not checked.

pub mod after;
pub mod choose;
mod error;
pub mod order;
pub mod pool;
pub mod predict;
pub mod scene;
mod settings;
mod steps;
#[cfg(test)]
mod tests;

pub use error::{Error, Result};
pub use order::Planned;
pub use settings::{COUNTS, PAPER_SAMPLES, Settings};
pub use steps::{COLLISIONS, Plan, plan};
