//! `stereocal locate`: where the cameras stand and the target sits.

use camino::Utf8PathBuf;
use clap::Args;

use super::cameras::Measure;
use super::robot::TableFlags;

/// What the poses are, of which `measure` takes the pictures alone.
const POSES: &str = "A table of measurements, as `identify` reads it; or a folder with pictures and poses.csv, as \
                     `measure` does, which is measured first";

/// `stereocal locate`
#[derive(Debug, Args)]
#[command(mut_args(|arg| if arg.get_id() == "poses" { arg.help(POSES) } else { arg }))]
pub struct Locate {
    /// The poses, as `measure` takes them, or as a table.
    #[command(flatten)]
    pub measure: Measure,
    /// The robot, taken as it is: identified.toml, or a nominal one that is trusted
    #[arg(long, value_name = "FILE")]
    pub robot: Utf8PathBuf,
    #[command(flatten)]
    pub table: TableFlags,
}
