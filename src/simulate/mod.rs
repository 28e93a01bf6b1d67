//! The truth that everything else is tested against: a rig, boards, a robot with hidden errors, and their pictures.

use crate::error::Explain;

/// What can go wrong in a simulation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {}

impl Explain for Error {}
