//! The truth that everything else is tested against: a rig, boards, a robot with hidden errors, and their pictures.

pub mod coverage;
pub mod draws;
pub mod outline;
pub mod physical_board;
pub mod psf;
pub mod render;
pub mod scene;
pub mod sensor;

use crate::error::Explain;

/// What can go wrong in a simulation.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {}

impl Explain for Error {}
