//! Flags of every command that writes results.

use camino::Utf8PathBuf;
use clap::Args;

/// Where files for other programs go.
#[derive(Debug, Args)]
pub struct Files {
    /// Folder for results; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// Where results go and how they are shown.
#[derive(Debug, Args)]
pub struct Output {
    /// Folder for results; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
    /// Replace files in the results folder that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}
