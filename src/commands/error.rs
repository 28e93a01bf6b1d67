//! The sum of what can end a command.

use crate::diagnostic::{Explain, Status};

/// Result of a command.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Anything that ends a command.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Reading or writing files.
    #[error(transparent)]
    Files(#[from] crate::files::Error),
    /// Settings from the command line or `stereocal.toml`.
    #[error(transparent)]
    Config(#[from] crate::config::Error),
    /// Pictures, pairs, corners.
    #[error(transparent)]
    Imaging(#[from] crate::imaging::Error),
    /// Calibration, triangulation, the target's pose.
    #[error(transparent)]
    Stereo(#[from] crate::stereo::Error),
    /// Robot files and kinematics.
    #[error(transparent)]
    Robot(#[from] crate::robot::Error),
    /// Measurements and identification.
    #[error(transparent)]
    Identify(#[from] crate::identify::Error),
    /// Planning poses.
    #[error(transparent)]
    Plan(#[from] crate::plan::Error),
    /// The simulator.
    #[error(transparent)]
    Simulate(#[from] crate::simulate::Error),
    /// Figures and pages.
    #[error(transparent)]
    Report(#[from] crate::report::Error),
}

impl Error {
    fn explain(&self) -> &dyn Explain {
        match self {
            Error::Files(e) => e,
            Error::Config(e) => e,
            Error::Imaging(e) => e,
            Error::Stereo(e) => e,
            Error::Robot(e) => e,
            Error::Identify(e) => e,
            Error::Plan(e) => e,
            Error::Simulate(e) => e,
            Error::Report(e) => e,
        }
    }
}

impl Explain for Error {
    fn status(&self) -> Status {
        self.explain().status()
    }
    fn place(&self) -> Option<String> {
        self.explain().place()
    }
    fn hint(&self) -> Option<String> {
        self.explain().hint()
    }
}
