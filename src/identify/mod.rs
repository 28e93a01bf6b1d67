//! From measurements and joint angles to the robot's kinematic parameters.
//!
//! ```text
//!  dataset    rows by group and role; what is left out and why
//!  sessions   rows of one wire cut where its anchor moved
//!  kinematics the robot at those poses, with derivatives
//!  blocks     residual models, the placement's own unknowns eliminated   pairwise
//!  base       what the poses determine
//!  prior      manufacturing tolerance, sized by the data
//!  prepare    weights, prior, box: the problem that all solvers get      estimate, problem
//!  trust_region, swarm                                                   the solvers; kernel, fast and placement are their hot loop
//!  verify     errors on rows that were not fitted
//!  choose     models, terms and methods judged on samples held out
//! ```

pub mod base;
pub mod blocks;
pub mod choose;
pub mod dataset;
pub mod estimate;
pub mod fast;
pub mod kernel;
pub mod kinematics;
pub mod pairwise;
pub mod placement;
pub mod prepare;
pub mod prior;
pub mod problem;
pub mod record;
pub mod sessions;
pub mod settings;
pub mod swarm;
#[cfg(test)]
pub mod synthetic;
pub mod terms;
#[cfg(test)]
mod tests;
pub mod trust_region;
pub mod verify;

use crate::error::{Explain, Status};

pub use settings::{Method, Model, Settings};

/// What can go wrong in an identification.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// No row can be fitted.
    #[error(
        "none of the {rows} rows can be fitted ({skipped} have no usable reading); rows of role `sample` are needed"
    )]
    NoSamples {
        /// Rows in the file.
        rows: usize,
        /// Rows without a reading.
        skipped: usize,
    },
    /// Robot and measurements are not about the same machine.
    #[error("the robot has {robot} joints, the measurements have {measurements}")]
    JointCount {
        /// Of the robot.
        robot: usize,
        /// Of the measurements.
        measurements: usize,
        /// The measurements' file.
        place: String,
    },
    /// Moving any parameter changes nothing that was measured.
    #[error("the {poses} poses determine no parameter: moving any of them changes nothing that was measured")]
    NothingDetermined {
        /// Poses to fit.
        poses: usize,
    },
    /// No more numbers than parameters.
    #[error(
        "{poses} poses give {numbers} independent numbers for {parameters} parameters; more numbers than parameters are needed"
    )]
    TooFew {
        /// Independent numbers.
        numbers: usize,
        /// Base parameters.
        parameters: usize,
        /// Poses to fit.
        poses: usize,
    },
    /// The chosen model needs what the data lack.
    #[error("model `{model}` needs {needed}, which the measurements don't have")]
    ModelNeeds {
        /// The model.
        model: &'static str,
        /// What it needs.
        needed: &'static str,
    },
    /// A solver started from numbers that are no numbers.
    #[error("the residuals at the nominal robot are not finite")]
    NotFinite,
}

impl Explain for Error {
    fn status(&self) -> Status {
        match self {
            Error::NothingDetermined { .. } | Error::TooFew { .. } | Error::NotFinite => Status::Undetermined,
            _ => Status::BadInput,
        }
    }

    fn place(&self) -> Option<String> {
        match self {
            Error::JointCount { place, .. } => Some(place.clone()),
            _ => None,
        }
    }

    fn hint(&self) -> Option<String> {
        match self {
            Error::JointCount { .. } => Some("`--robot FILE` names the robot that was measured".to_owned()),
            Error::NothingDetermined { .. } | Error::TooFew { .. } => {
                Some("measure more poses, spread over the workspace and with varied orientation".to_owned())
            }
            Error::ModelNeeds { .. } => Some("leave `--model` out and the model is chosen by the data".to_owned()),
            _ => None,
        }
    }
}
