//! The command line as typed. What it means is decided in [`crate::commands`].

mod board;
mod cameras;
mod locate;
mod output;
mod placement;
mod robot;
mod simulate;
pub mod unexpected;
mod values;

use camino::Utf8PathBuf;
use clap::{Args, Parser, Subcommand};

pub use self::board::PrintBoard;
pub use self::cameras::{BoardShape, CalibrationFormat, CameraCheck, ExportCalibration, ExportWhat, Measure, Rectify};
pub use self::locate::Locate;
pub use self::output::{Files, Output};
pub use self::placement::{ExportPlacement, PlacementFormat};
pub use self::robot::{
    Compensate, DhConvention, ExportRobot, Identify, Plan, PlanKind, RobotFormat, RobotImport, RobotNew, RobotPlace,
    RobotShow, RobotWhat, TableFlags, Verify,
};
pub use self::simulate::{LensBlur, Preset, Simulate};
pub use self::values::AskedSquares;
use self::values::whole_between;

/// What `--version` says of the build; `-V` says the version alone.
const BUILD: &str = if cfg!(debug_assertions) {
    concat!(env!("CARGO_PKG_VERSION"), "\n", "build: debug, checks on")
} else {
    concat!(env!("CARGO_PKG_VERSION"), "\n", "build: release")
};

/// Robot calibration with two cameras and a checkerboard.
#[derive(Debug, Parser)]
#[command(name = "stereocal", version, long_version = BUILD, about, max_term_width = 100)]
pub struct Cli {
    /// Settings file; `stereocal init` writes one [default: stereocal.toml here, if there]
    #[arg(long, help_heading = "Global options", global = true, value_name = "FILE")]
    pub config: Option<Utf8PathBuf>,
    /// Warnings and errors only on stderr: no progress, no notes
    #[arg(long, help_heading = "Global options", global = true)]
    pub quiet: bool,
    /// Threads, 1 to 1024; results don't depend on it [default: one a core]
    #[arg(long, help_heading = "Global options", global = true, value_name = "N", value_parser = whole_between::<u16>(1, 1024))]
    pub threads: Option<u16>,
    /// Leave program, date, command line and inputs out of the files
    #[arg(long, help_heading = "Global options", global = true)]
    pub no_provenance: bool,
    #[command(subcommand)]
    pub command: Command,
}

/// The commands, in the order of the data.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Calibrate both cameras by pictures of the check board, and judge the rig
    #[command(after_help = "Examples:
  stereocal camera-check check/ --squares 20x20 --square-mm 10 --known-move 5mm:03,04
  stereocal camera-check remounted/ --squares 20x20 --square-mm 10 \\
      --intrinsics out/calibration.json --out new
  stereocal camera-check today/ --against out/calibration.json")]
    CameraCheck(Box<CameraCheck>),
    /// Measure the target's point and orientation for each robot pose
    #[command(after_help = "Example: stereocal measure poses/ --squares 7x6 --square-mm 10")]
    Measure(Measure),
    /// Identify the robot's kinematic parameters from measurements and joint angles
    #[command(after_help = "Examples:
  stereocal identify --robot robot.toml
  stereocal identify --measurements tracker.xlsx --robot out/robot.toml --units deg,mm")]
    Identify(Identify),
    /// Compare robot files with measurements, without fitting anything
    #[command(after_help = "Example: stereocal verify --measurements today.csv --against out/identified.toml")]
    Verify(Verify),
    /// Find where the cameras stand and the target sits, with a robot that is trusted
    #[command(after_help = "Example: stereocal locate poses/ --robot out/identified.toml")]
    Locate(Locate),
    /// Write a board to print, in true size
    Board(PrintBoard),
    /// Join camera check, measurements and robot into one file to sign
    Report(Report),
    /// Undistort and rectify pairs of pictures, for eyes and for dense stereo
    Rectify(Rectify),
    /// Simulate pictures and measurements with known true values
    #[command(after_help = "Example: stereocal simulate --board checker:9x6:25 --out world")]
    Simulate(Simulate),
    /// Choose the poses that determine the robot best, as poses.csv and robot programs
    #[command(after_help = "Example: stereocal plan --robot robot.toml --poses 40 --verify 10")]
    Plan(Plan),
    /// Correct targets for the real robot: of a CSV, or the joint targets of a program
    #[command(
        after_help = "Example: stereocal compensate program.mod --robot robot.toml --identified out/identified.toml"
    )]
    Compensate(Compensate),
    /// Write a calibration or a robot for other programs
    #[command(subcommand)]
    Export(ExportWhat),
    /// Make a nominal robot file: from a URDF, a table, or a common arm's published numbers
    #[command(subcommand)]
    Robot(RobotWhat),
    /// Write a commented stereocal.toml, a robot.toml and a poses.csv to start from
    Init(Init),
    /// Print a page of the guide, or make one HTML file of all pages
    Guide(Guide),
    /// Print a shell's completions
    Completions(Completions),
    /// Write the manual's pages
    Man(Man),
}

/// `stereocal init`
#[derive(Debug, Args)]
pub struct Init {
    /// Folder for the files
    #[arg(long, value_name = "DIR", default_value = ".")]
    pub out: Utf8PathBuf,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// `stereocal guide`
#[derive(Debug, Args)]
pub struct Guide {
    /// Which page, or a command for the page about it [default: the list of them]
    #[arg(conflicts_with = "html")]
    pub topic: Option<String>,
    /// Folder for `guide.html`: all pages in one file, with their pictures
    #[arg(long, value_name = "DIR")]
    pub html: Option<Utf8PathBuf>,
    /// Replace a guide.html that stereocal did not write, or that was changed since
    #[arg(long, requires = "html")]
    pub force: bool,
}

/// `stereocal completions`
#[derive(Debug, Args)]
pub struct Completions {
    /// Whose
    pub shell: clap_complete::Shell,
}

/// `stereocal man`
#[derive(Debug, Args)]
pub struct Man {
    /// Folder for the pages
    #[arg(long, value_name = "DIR", default_value = "man")]
    pub out: Utf8PathBuf,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// `stereocal report`
#[derive(Debug, Args)]
pub struct Report {
    /// Folder of the results, and of the page; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Replace a report.html that stereocal did not write, or that was changed since
    #[arg(long)]
    pub force: bool,
}
