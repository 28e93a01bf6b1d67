//! `stereocal measure`: Pictures of the target on the robot to its point and orientation per pose.

use super::Outcome;
use crate::cli::Measure;
use crate::config::Config;
use crate::error::{Result, Status};

/// Runs the command.
pub fn run(_args: &Measure, _config: &Config) -> Result<Outcome> {
    Ok(Outcome { stdout: String::new(), status: Status::Done })
}
