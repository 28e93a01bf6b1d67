//! One file a command; each reads as the list of its stages, and nothing else knows their order.

pub mod camera_check;
pub mod export;
pub mod identify;
pub mod measure;
pub mod simulate;

use crate::cli::{Cli, Command};
use crate::config::Config;
use crate::error::{Result, Status};

/// What a command leaves for `main` to print, and how it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The result: a short table, or JSON.
    pub stdout: String,
    /// The exit status.
    pub status: Status,
}

/// Runs what was typed.
pub fn run(cli: Cli) -> Result<Outcome> {
    let config = Config::load(cli.config.as_deref())?;
    match cli.command {
        Command::CameraCheck(args) => camera_check::run(&args, &config),
        Command::Measure(args) => measure::run(&args, &config),
        Command::Identify(args) => identify::run(&args, &config),
        Command::Simulate(args) => simulate::run(&args, &config),
        Command::Export(args) => export::run(&args, &config),
    }
}
