//! `stereocal guide`: the pages for the practitioner, without a network.

use camino::Utf8Path;

use super::super::{Outcome, Result};
use crate::cli::Guide;
use crate::config;
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::guide::{PAGES, PICTURES, page};
use crate::report::book;

/// Prints a page, or the list of them where none was asked for; with `--html` makes one HTML file of all.
pub fn run(args: &Guide, run: Run) -> Result<Outcome> {
    let stdout = match (&args.topic, &args.html) {
        (_, Some(folder)) => write(folder, Run { force: args.force, ..run })?,
        (Some(topic), None) => page(topic).ok_or_else(|| unknown(topic))?.plain(),
        (None, None) => list(),
    };
    Ok(Outcome { stdout, status: Status::Done })
}

fn list() -> String {
    let pages: String = PAGES.iter().map(|page| format!("{:<12} {}\n", page.topic, page.title())).collect();
    pages
        + "\n`stereocal guide TOPIC` prints a page, `stereocal guide --html DIR` makes one HTML file of all, with pictures\n"
}

fn write(folder: &Utf8Path, run: Run) -> Result<String> {
    let out = OutDir::open(folder)?.for_run(&run, &[]);
    out.check_free(&["guide.html"])?;
    out.write("guide.html", book::book(&PAGES, &PICTURES).as_bytes())?;
    Ok(format!("{}\n", out.join("guide.html")))
}

fn unknown(topic: &str) -> config::Error {
    let topics = PAGES.map(|page| page.topic).join(", ");
    config::Error::Usage { message: format!("the guide has no page `{topic}`"), hint: format!("there are {topics}") }
}
