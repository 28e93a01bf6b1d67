//! `stereocal locate`: where the cameras stand and the target sits.

use camino::Utf8PathBuf;
use clap::Args;

use super::cameras::Measure;
use super::robot::TableFlags;

/// `stereocal locate`
#[derive(Debug, Args)]
pub struct Locate {
    /// Poses: a folder with pictures and poses.csv, which is measured first, or a table of measurements as `identify`
    /// reads it.
    #[command(flatten)]
    pub measure: Measure,
    /// The robot, taken as it is: identified.toml, or a nominal one that is trusted
    #[arg(long, value_name = "FILE")]
    pub robot: Utf8PathBuf,
    #[command(flatten)]
    pub table: TableFlags,
}
