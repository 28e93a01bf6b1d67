//! From measurements and joint angles to the robot's kinematic parameters.

use crate::error::Explain;

/// What can go wrong in an identification.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {}

impl Explain for Error {}
