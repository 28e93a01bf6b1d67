//! `stereocal completions` and `stereocal man`: what the shell and `man` read, made of the command line's own
//! description.

use clap::CommandFactory;

use super::super::{Outcome, Result};
use crate::cli::{Cli, Completions, Man};
use crate::diagnostic::Status;
use crate::files::provenance::Run;
use crate::files::{self, OutDir};

/// Prints the completions of a shell.
pub fn completions(args: &Completions) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "stereocal", &mut script);
    Outcome { stdout: String::from_utf8_lossy(&script).into_owned(), status: Status::Done }
}

/// Writes a page for the program and one for each command.
pub fn man(args: &Man, run: Run) -> Result<Outcome> {
    let run = Run { force: args.force, ..run };
    let out = OutDir::open(&args.out)?.for_run(&run, &[]);
    let io = |source| files::Error::Io { action: "write", path: args.out.clone(), source };
    let made = tempfile::tempdir().map_err(io)?;
    clap_mangen::generate_to(Cli::command(), made.path()).map_err(io)?;
    let mut pages = Vec::new();
    for entry in std::fs::read_dir(made.path()).map_err(io)? {
        let entry = entry.map_err(io)?;
        pages.push((entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).map_err(io)?));
    }
    pages.sort();
    let mut stdout = String::new();
    for (name, page) in pages {
        out.write(&name, &page)?;
        stdout.push_str(&format!("{}\n", out.join(&name)));
    }
    Ok(Outcome { stdout, status: Status::Done })
}
