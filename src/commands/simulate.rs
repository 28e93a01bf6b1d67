//! `stereocal simulate`: A world whose truth is known, as files.

use super::Outcome;
use crate::cli::Simulate;
use crate::config::Config;
use crate::error::{Result, Status};

/// Runs the command.
pub fn run(_args: &Simulate, _config: &Config) -> Result<Outcome> {
    Ok(Outcome { stdout: String::new(), status: Status::Done })
}
