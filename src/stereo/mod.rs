//! From corners to a calibrated rig, and from a rig to points in space.

pub mod calibration_file;
pub mod camera;
pub mod rig;

use crate::error::Explain;

pub use camera::{Camera, Lens};
pub use rig::Rig;

/// What can go wrong between corners and points.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {}

impl Explain for Error {}
