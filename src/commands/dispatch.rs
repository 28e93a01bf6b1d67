//! From the command line to the command that it names.

use super::error::Result;
use super::outcome::Outcome;
use super::{
    board, camera_check, compensate, export, identify, locate, measure, plan, rectify, report, robot, simulate, start,
    verify,
};
use crate::cli::{Cli, Command};
use crate::config::{self, Config};
use crate::files::provenance::Run;
use crate::progress;

/// Runs what was typed.
pub fn run(cli: Cli) -> Result<Outcome> {
    if cli.quiet {
        progress::be_quiet();
    }
    if let Some(threads) = cli.threads {
        start_threads(threads)?;
    }
    let config = Config::load(cli.config.as_deref())?;
    let run = Run {
        command: (!cli.no_provenance).then(|| command_line(std::env::args_os().skip(1))),
        force: false,
        inputs: Config::file(cli.config.as_deref()).into_iter().collect(),
    };
    match cli.command {
        Command::CameraCheck(args) => camera_check::run(&args, &config, run),
        Command::Measure(args) => measure::run(&args, &config, run),
        Command::Identify(args) => identify::run(&args, &config, run),
        Command::Verify(args) => verify::run(&args, &config, run),
        Command::Locate(args) => locate::run(&args, &config, run),
        Command::Board(args) => board::run(&args, &config, run),
        Command::Rectify(args) => rectify::run(&args, &config, run),
        Command::Report(args) => report::run(&args, &config, run),
        Command::Simulate(args) => simulate::run(&args, &config, run),
        Command::Plan(args) => plan::run(&args, &config, run),
        Command::Compensate(args) => compensate::run(&args, &config, run),
        Command::Export(args) => export::run(&args, &config, run),
        Command::Init(args) => start::init::run(&args, run),
        Command::Guide(args) => start::guide::run(&args, run),
        Command::Completions(args) => Ok(start::shell::completions(&args)),
        Command::Man(args) => start::shell::man(&args, run),
        Command::Robot(args) => robot::run(&args, &config, run),
    }
}

/// All work that is shared between threads runs on so many.
fn start_threads(threads: u16) -> Result<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global();
    pool.map_err(|e| config::Error::Invalid { problems: vec![format!("--threads {threads}: {e}")] })?;
    Ok(())
}

/// The command line as a shell would take it again.
fn command_line(arguments: impl Iterator<Item = std::ffi::OsString>) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%".contains(c);
    let mut text = String::from("stereocal");
    for argument in arguments {
        let argument = argument.to_string_lossy();
        if !argument.is_empty() && argument.chars().all(plain) {
            text.push_str(&format!(" {argument}"));
        } else {
            text.push_str(&format!(" '{}'", argument.replace('\'', "'\\''")));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_line_reads_as_typed() {
        let typed = ["identify", "--out", "my folder", "it's", ""].map(std::ffi::OsString::from);
        assert_eq!(command_line(typed.into_iter()), r"stereocal identify --out 'my folder' 'it'\''s' ''");
    }
}
