//! `stereocal camera-check`: Pictures of the check board to a calibrated rig and a verdict.

use super::Outcome;
use crate::cli::CameraCheck;
use crate::config::Config;
use crate::error::{Result, Status};

/// Runs the command.
pub fn run(_args: &CameraCheck, _config: &Config) -> Result<Outcome> {
    Ok(Outcome { stdout: String::new(), status: Status::Done })
}
