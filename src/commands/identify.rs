//! `stereocal identify`: Measurements to kinematic parameters.

use super::Outcome;
use crate::cli::Identify;
use crate::config::Config;
use crate::error::{Result, Status};

/// Runs the command.
pub fn run(_args: &Identify, _config: &Config) -> Result<Outcome> {
    Ok(Outcome { stdout: String::new(), status: Status::Done })
}
