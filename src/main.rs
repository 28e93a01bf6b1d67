//! Parses the command line, runs the command, prints its result or its message, sets the exit status.

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use stereocal::cli::Cli;
use stereocal::commands::{self, Outcome};
use stereocal::error::report;

/// Bad usage, as clap and the contract have it.
const BAD_USAGE: u8 = 2;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(message) => {
            let code = if message.use_stderr() { BAD_USAGE } else { 0 };
            // A closed stdout or stderr leaves nowhere to complain to.
            let _ = message.print();
            return ExitCode::from(code);
        }
    };
    match commands::run(cli) {
        Ok(Outcome { stdout, status }) => {
            let mut out = std::io::stdout().lock();
            // `stereocal ... | head` closes the pipe: that is not a failure of the command.
            let _ = out.write_all(stdout.as_bytes()).and_then(|()| out.flush());
            ExitCode::from(status.code())
        }
        Err(error) => {
            let _ = write!(std::io::stderr().lock(), "{}", report(&error));
            ExitCode::from(error.status().code())
        }
    }
}
