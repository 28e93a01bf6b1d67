//! The robot: its kinematic parameters, where they put the target, and the file they live in.

pub mod chain;
pub mod corrections;
pub mod file;
pub mod inverse;
pub mod jacobian;
pub mod parameters;

use crate::error::{Explain, Place};

pub use chain::{Joint, Robot};
pub use corrections::Corrections;
pub use parameters::{Parameter, Unit};

/// What can go wrong with a robot.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file says something that is no robot.
    #[error("{message}")]
    File {
        /// What was found and what was needed.
        message: String,
        /// Where.
        place: Place,
    },
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        match self {
            Error::File { place, .. } => Some(place.to_string()),
        }
    }
}
