//! What a command ends with: its outcome, or one of all that can go wrong.

use camino::Utf8PathBuf;

use crate::diagnostic::{Explain, Status};

/// Result of a command.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What a command leaves for `main` to print, and how it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The result: a short table, or JSON.
    pub stdout: String,
    /// The exit status.
    pub status: Status,
}

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
    /// One of these, in a folder that holds the result of an earlier run.
    #[error(transparent)]
    BesideEarlier(Box<BesideEarlier>),
}

/// What ended a command, and what stands in its results folder from before.
#[derive(Debug, thiserror::Error)]
#[error("{error}")]
pub struct BesideEarlier {
    #[source]
    pub(super) error: Error,
    pub(super) earlier: Earlier,
}

/// The result of an earlier run.
#[derive(Debug, Clone, PartialEq)]
pub struct Earlier {
    pub(super) file: Utf8PathBuf,
    pub(super) date: String,
    pub(super) written: Option<std::time::SystemTime>,
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
            Error::BesideEarlier(beside) => beside.error.explain(),
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
    fn note(&self) -> Option<String> {
        let Error::BesideEarlier(beside) = self else { return None };
        let Earlier { file, date, .. } = &beside.earlier;
        Some(format!("{file} and what stands beside it are of an earlier run ({date})"))
    }
}
