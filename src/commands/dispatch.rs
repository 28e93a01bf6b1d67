//! From the command line to the command that it names.

use camino::Utf8Path;

use super::error::{BesideEarlier, Earlier, Error, Outcome, Result};
use super::{
    board, camera_check, compensate, export, identify, locate, measure, plan, rectify, report, robot, simulate, start,
    verify,
};
use crate::cli::{Cli, Command};
use crate::config::{self, Config};
use crate::files::provenance::{Provenance, Run};
use crate::progress;

/// Runs what was typed.
pub fn run(cli: Cli) -> Result<Outcome> {
    if cli.quiet {
        progress::be_quiet();
    }
    progress::hold_warnings();
    start_threads(cli.threads)?;
    let settings = Config::file(cli.config.as_deref());
    let config = Config::load(cli.config.as_deref())?;
    let uses_none =
        matches!(cli.command, Command::Init(_) | Command::Guide(_) | Command::Completions(_) | Command::Man(_));
    if let (None, Some(file), false) = (&cli.config, &settings, uses_none) {
        progress::note(format!("settings: {file} of this folder; `--config FILE` names another"));
    }
    let run = Run {
        command: (!cli.no_provenance).then(|| command_line(std::env::args_os().skip(1))),
        force: false,
        inputs: settings.into_iter().collect(),
    };
    let before = earlier(&cli.command, &config);
    let now = || before.as_ref().and_then(|earlier| Earlier::of(&earlier.file));
    // On one of the threads: a short loop would else wait longer for them to wake than for its result.
    rayon::scope(|_| command(&cli.command, &config, run)).map_err(|error| {
        match now().filter(|now| before.as_ref() == Some(now)) {
            Some(earlier) => Error::BesideEarlier(Box::new(BesideEarlier { error, earlier })),
            None => error,
        }
    })
}

fn command(command: &Command, config: &Config, run: Run) -> Result<Outcome> {
    match command {
        Command::CameraCheck(args) => camera_check::run(args, config, run),
        Command::Measure(args) => measure::run(args, config, run),
        Command::Identify(args) => identify::run(args, config, run),
        Command::Verify(args) => verify::run(args, config, run),
        Command::Locate(args) => locate::run(args, config, run),
        Command::Board(args) => board::run(args, config, run),
        Command::Rectify(args) => rectify::run(args, config, run),
        Command::Report(args) => report::run(args, config, run),
        Command::Simulate(args) => simulate::run(args, config, run),
        Command::Plan(args) => plan::run(args, config, run),
        Command::Compensate(args) => compensate::run(args, config, run),
        Command::Export(what) => export::run(what, config, run),
        Command::Init(args) => start::init::run(args, run),
        Command::Guide(args) => start::guide::run(args, run),
        Command::Completions(args) => Ok(start::shell::completions(args)),
        Command::Man(args) => start::shell::man(args, run),
        Command::Robot(what) => robot::run(what, config, run),
    }
}

/// The result that an earlier run of such a command left in the results folder.
fn earlier(command: &Command, config: &Config) -> Option<Earlier> {
    let (out, name) = match command {
        Command::CameraCheck(args) if args.against.is_some() => (&args.output.out, "recheck.json"),
        Command::CameraCheck(args) => (&args.output.out, "camera-check.json"),
        Command::Measure(args) => (&args.output.out, "measure.json"),
        Command::Identify(args) => (&args.output.out, "identification.json"),
        Command::Locate(args) => (&args.measure.output.out, "placement.json"),
        Command::Plan(args) => (&args.output.out, "plan.json"),
        Command::Compensate(args) => (&args.output.out, "compensate.json"),
        Command::Rectify(args) => (&args.output.out, "rectified.json"),
        _ => return None,
    };
    Earlier::of(&out.as_ref().unwrap_or(&config.out).join(name))
}

impl Earlier {
    /// `None` where there is none, or no date in it.
    fn of(file: &Utf8Path) -> Option<Earlier> {
        let date = Provenance::of_json(file)?.date;
        let written = file.metadata().and_then(|file| file.modified()).ok();
        Some(Earlier { file: file.to_owned(), date, written })
    }
}

/// All work runs on so many threads, as many as the processor has where none are named.
fn start_threads(threads: Option<u16>) -> Result<()> {
    /// What the first thread of a program usually has, bytes.
    const STACK: usize = 8 << 20;
    let count = threads.map_or(0, usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).stack_size(STACK).build_global();
    pool.map_err(|e| config::Error::Invalid { problems: vec![format!("--threads {count}: {e}")] })?;
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
