//! Parses the command line, runs the command, prints its result or its message, sets the exit status.

use std::io::{ErrorKind, Write};
use std::process::ExitCode;

use clap::{CommandFactory, Parser};
use stereocal::cli::{Cli, unexpected};
use stereocal::commands::{self, Outcome};
use stereocal::diagnostic::{Explain, report};
use stereocal::progress;

/// Bad usage, as clap and the contract have it; also a result that could not be printed.
const BAD_USAGE: u8 = 2;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(message) if message.use_stderr() => {
            let words: Vec<String> = std::env::args_os().skip(1).map(|w| w.to_string_lossy().into_owned()).collect();
            let (message, hint) = unexpected::mended(&Cli::command(), &words, message);
            // A stderr that cannot be written leaves nowhere to complain to.
            let _ = message.print();
            if let Some(hint) = hint {
                let _ = writeln!(std::io::stderr().lock(), "  hint: {hint}");
            }
            return ExitCode::from(BAD_USAGE);
        }
        Err(help) => return printed(help.print(), 0),
    };
    match commands::run(cli) {
        Ok(Outcome { stdout, status }) => {
            #[expect(clippy::disallowed_methods, reason = "the one place that writes to stdout")]
            let mut out = std::io::stdout().lock();
            let printed = printed(out.write_all(stdout.as_bytes()).and_then(|()| out.flush()), status.code());
            progress::say_held();
            printed
        }
        Err(error) => {
            progress::say_held();
            let _ = write!(std::io::stderr().lock(), "{}", report(&error));
            ExitCode::from(error.status().code())
        }
    }
}

/// The status of a command whose files are written, given how printing its result went.
fn printed(outcome: std::io::Result<()>, status: u8) -> ExitCode {
    match outcome {
        // `stereocal ... | head` closes the pipe when it has seen enough: that is not a failure of the command.
        Err(e) if e.kind() != ErrorKind::BrokenPipe => {
            let _ = writeln!(std::io::stderr().lock(), "error: cannot print the result: {e}");
            ExitCode::from(BAD_USAGE)
        }
        _ => ExitCode::from(status),
    }
}
