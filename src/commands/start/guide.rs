//! `stereocal guide`: the pages for the practitioner, without a network.

use super::super::{Outcome, Result};
use crate::cli::Guide;
use crate::config;
use crate::diagnostic::Status;
use crate::guide::{PAGES, page};

/// Prints a page, or the list of them where none was asked for.
pub fn run(args: &Guide) -> Result<Outcome> {
    let stdout = match &args.topic {
        Some(topic) => page(topic).ok_or_else(|| unknown(topic))?.text.to_owned(),
        None => PAGES.iter().map(|page| format!("{:<12} {}\n", page.topic, page.title())).collect(),
    };
    Ok(Outcome { stdout, status: Status::Done })
}

fn unknown(topic: &str) -> config::Error {
    let topics = PAGES.map(|page| page.topic).join(", ");
    config::Error::Invalid { problems: vec![format!("the guide has no page {topic}; there are {topics}")] }
}
