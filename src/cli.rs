//! The command line as typed. What it means is decided in [`crate::commands`].

use camino::Utf8PathBuf;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::imaging::{Mosaic, Squares};
use crate::simulate::settings::Orientation;
use crate::stereo::Lens;

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
    /// Settings file, with the keys that the flags name; `stereocal init` writes one [default: stereocal.toml in the working directory, if there]
    #[arg(long, global = true, value_name = "FILE")]
    pub config: Option<Utf8PathBuf>,
    /// Warnings and errors only on stderr: no progress, no notes
    #[arg(long, global = true)]
    pub quiet: bool,
    /// Threads to compute with, 1 to 1024; results don't depend on it [default: one a core]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Leave program, date, command line and inputs out of the files that are written
    #[arg(long, global = true)]
    pub no_provenance: bool,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The commands, in the order of the data.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Calibrate both cameras from pictures of the check board, and judge the rig's accuracy
    CameraCheck(CameraCheck),
    /// Measure the target's point and orientation for each robot pose
    Measure(Measure),
    /// Identify the robot's kinematic parameters from measurements and joint angles
    Identify(Identify),
    /// Judge robots by the verify rows of measurements, without fitting any
    Verify(Verify),
    /// Join camera check, measurements and robot into one page to sign
    Report(Report),
    /// Undistort and rectify pairs of pictures, for eyes and for dense stereo
    Rectify(Rectify),
    /// Make pictures and measurements whose truth is known
    Simulate(Simulate),
    /// Choose the poses that determine the robot best, and write them as poses.csv and robot programs
    Plan(Plan),
    /// Readings that bring the real robot where targets were meant: CSV, or joint targets of a robot program
    Compensate(Compensate),
    /// Write a calibration or a robot for other programs
    Export(Export),
    /// Make a nominal robot file: from a URDF, a table, or a common arm's published numbers
    Robot(RobotCommand),
    /// Write a commented stereocal.toml, a robot.toml and a poses.csv to start from
    Init(Init),
    /// Print a page of the guide: boards, cameras, pictures, poses, a day in the cell, a robot's way, warnings
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
    /// Which page [default: the list of them]
    pub topic: Option<String>,
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

/// `stereocal camera-check`
#[derive(Debug, Args)]
pub struct CameraCheck {
    /// Folder with left/ and right/ pictures, or with left*/right* names
    #[arg(required_unless_present = "corners", conflicts_with = "corners")]
    pub images: Option<Utf8PathBuf>,
    /// Corners from a CSV file instead of pictures
    #[arg(long, value_name = "FILE")]
    pub corners: Option<Utf8PathBuf>,
    /// Squares of the check board, not inner corners; key `check_board.squares` [default: 20x20]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Side of a square, mm; key `check_board.square_mm` [default: 10]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub square_mm: Option<f64>,
    /// Largest length error that passes, mm; key `tolerance_mm` [default: 0.05]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub tolerance_mm: Option<f64>,
    /// Expanded uncertainty (k = 2) of the board's lengths, from its certificate, mm: widens the guard band of the verdict
    #[arg(long, value_name = "MM")]
    pub board_uncertainty_mm: Option<f64>,
    /// Lens model: radial2, brown4, brown5, rational8, thin-prism12 or tilted14 [default: chosen by held-out pairs]
    #[arg(long, value_name = "NAME", value_parser = lens)]
    pub lens: Option<Lens>,
    /// Whether the board may be bowed [default: as held-out pairs say; flat where --lens is given]
    #[arg(long, value_name = "SHAPE")]
    pub board_shape: Option<BoardShape>,
    /// The board's temperature, deg C; with --expansion-ppm-per-k its squares grow from their size at 20 deg C
    #[arg(long, value_name = "C", requires = "expansion_ppm_per_k", allow_negative_numbers = true, value_parser = between(-273.15, 1000.0))]
    pub board_temperature_c: Option<f64>,
    /// The board's coefficient of thermal expansion, 1e-6/K (alumina 7, glass 8, aluminium 23)
    #[arg(long, value_name = "PPM", allow_negative_numbers = true, requires = "board_temperature_c", value_parser = between(-100.0, 1000.0))]
    pub expansion_ppm_per_k: Option<f64>,
    /// Pictures of a second, independent board: shows the scale
    #[arg(long, value_name = "DIR")]
    pub check_images: Option<Utf8PathBuf>,
    /// Squares of the second board [default: as the first]
    #[arg(long, value_name = "CxR", requires = "check_images")]
    pub check_squares: Option<Squares>,
    /// Side of the second board's squares, mm [default: as the first]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, requires = "check_images")]
    pub check_square_mm: Option<f64>,
    /// Width and height of the pictures that --corners come from, px, where the file does not hold them
    #[arg(long, value_name = "WxH", requires = "corners", value_parser = picture_size)]
    pub picture_size: Option<(u32, u32)>,
    /// Filters of pictures that are raw colour mosaics: RGGB, BGGR, GRBG or GBRG
    #[arg(long, value_name = "PATTERN")]
    pub bayer: Option<Mosaic>,
    /// Draw the corners found over each pair, into overlays/ in the results folder
    #[arg(long)]
    pub draw: bool,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}

/// `stereocal measure`
#[derive(Debug, Args)]
pub struct Measure {
    /// Folder with left/ and right/ pictures and poses.csv
    pub poses: Utf8PathBuf,
    /// The rig, or the folder it was exported to [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Squares of the target, not inner corners; key `target_board.squares` [default: 7x6]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Side of a square, mm; key `target_board.square_mm` [default: 10]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub square_mm: Option<f64>,
    /// Filters of pictures that are raw colour mosaics: RGGB, BGGR, GRBG or GBRG
    #[arg(long, value_name = "PATTERN")]
    pub bayer: Option<Mosaic>,
    /// Measure pictures as they arrive; ends when all of poses.csv are there, or on Ctrl-C
    #[arg(long)]
    pub watch: bool,
    /// Draw the corners found over each pair, into overlays/ in the results folder
    #[arg(long)]
    pub draw: bool,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}

/// `stereocal identify`
#[derive(Debug, Args)]
pub struct Identify {
    /// Measurements [default: measurements.csv in the results folder]
    #[arg(long, value_name = "FILE")]
    pub measurements: Option<Utf8PathBuf>,
    /// The nominal robot [default: robot.toml in the working directory if there, else Table 1 of the paper]
    #[arg(long, value_name = "FILE")]
    pub robot: Option<Utf8PathBuf>,
    /// Distances between touched points: group_a,group_b,distance_mm and optionally sigma_mm
    #[arg(long, value_name = "FILE")]
    pub known_distances: Option<Utf8PathBuf>,
    /// Solver; `auto` runs all and keeps the best; key `identify.method` [default: auto]
    #[arg(long, value_name = "NAME", value_parser = ["auto", "trust-region", "stapso", "pso", "cpso", "apso", "arpso"])]
    pub method: Option<String>,
    /// Residual model; key `identify.model` [default: chosen on samples held out]
    #[arg(long, value_name = "NAME")]
    pub model: Option<crate::identify::Model>,
    /// Terms beyond MDH: parallel axes, gravity, harmonics; key `identify.extensions` [default: auto]
    #[arg(long, value_name = "NAME")]
    pub extensions: Option<crate::identify::settings::Extensions>,
    /// Constants of the swarms; key `identify.constants` [default: those of the settings file]
    #[arg(long, value_name = "NAME")]
    pub constants: Option<crate::identify::settings::Constants>,
    /// Seed of every random draw
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}

/// `stereocal verify`
#[derive(Debug, Args)]
pub struct Verify {
    /// Measurements with verify rows (without any, a fifth of the samples is judged)
    #[arg(long, value_name = "FILE")]
    pub measurements: Utf8PathBuf,
    /// A robot to judge; repeat for more
    #[arg(long, value_name = "FILE", required = true)]
    pub robot: Vec<Utf8PathBuf>,
    /// Distances between touched points: group_a,group_b,distance_mm and optionally sigma_mm
    #[arg(long, value_name = "FILE")]
    pub known_distances: Option<Utf8PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
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

/// `stereocal rectify`
#[derive(Debug, Args)]
pub struct Rectify {
    /// Folder with left/ and right/ pictures, or with left*/right* names
    pub images: Utf8PathBuf,
    /// The rig, or the folder it was exported to [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Straighten each picture by itself, in its own camera matrix; do not turn the cameras
    #[arg(long, conflicts_with_all = ["alpha", "zero_disparity"])]
    pub undistort_only: bool,
    /// How much is kept: 0 only what both lenses saw, 1 every raw pixel [default: OpenCV's own choice between]
    #[arg(long, value_name = "A", value_parser = between(0.0, 1.0))]
    pub alpha: Option<f64>,
    /// Give both pictures one principal point: points at infinity then have no disparity, but cameras that are turned towards
    /// each other lose what is near from view
    #[arg(long)]
    pub zero_disparity: bool,
    /// Squares of the board that shows how well rows agree; keys `check_board.squares`, `target_board.squares` [default: both are tried]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Filters of pictures that are raw colour mosaics: RGGB, BGGR, GRBG or GBRG
    #[arg(long, value_name = "PATTERN")]
    pub bayer: Option<Mosaic>,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}

/// `stereocal plan`
#[derive(Debug, Args)]
pub struct Plan {
    /// The nominal robot [default: robot.toml in the working directory if there, else the paper's]
    #[arg(long, value_name = "FILE")]
    pub robot: Option<Utf8PathBuf>,
    /// The rig [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Poses to identify from; centres come on top [default: 60; 262 with --plan paper]
    #[arg(long, value_name = "N", value_parser = count(4, 2000))]
    pub poses: Option<usize>,
    /// Poses to verify with [default: 20; 50 with --plan paper]
    #[arg(long, value_name = "N", value_parser = count(0, 2000))]
    pub verify: Option<usize>,
    /// Which plan
    #[arg(long, value_enum, default_value = "optimal")]
    pub plan: PlanKind,
    /// Only so many poses a placement, near its middle, to find out where the cameras stand
    #[arg(long, value_name = "N", value_parser = count(2, 50), conflicts_with = "after")]
    pub first: Option<usize>,
    /// measurements.csv of the first poses: says where the cameras stand and what is known already
    #[arg(long, value_name = "MEASUREMENTS")]
    pub after: Option<Utf8PathBuf>,
    /// Seed of the candidates
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Candidates to choose from
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = count(200, 200_000))]
    pub pool: usize,
    /// Middle of a sphere, base frame, mm; repeat for more [default: the paper's four, scaled by the robot's reach]
    #[arg(long, value_name = "X,Y,Z", allow_negative_numbers = true, value_parser = point)]
    pub center: Vec<[f64; 3]>,
    /// Radius of the spheres, mm
    #[arg(long, value_name = "MM", default_value_t = 100.0, value_parser = between(1.0, 1e4))]
    pub radius_mm: f64,
    /// Largest tilt of the target out of the field's plane, deg
    #[arg(long, value_name = "DEG", default_value_t = 35.0, value_parser = between(0.0, 70.0))]
    pub tilt_deg: f64,
    /// Depth of field: largest distance of the target before or behind the field's middle, mm
    #[arg(long, value_name = "MM", default_value_t = 120.0, value_parser = between(1.0, 1e4))]
    pub depth_mm: f64,
    /// How far off its place the target may be and still be seen whole, mm
    #[arg(long, value_name = "MM", default_value_t = 8.0, value_parser = between(0.0, 1e3))]
    pub margin_mm: f64,
    /// Standard deviation of a coordinate of the measured point, mm [default: from the rig's corners and the repeatability]
    #[arg(long, value_name = "MM", value_parser = between(1e-6, 100.0))]
    pub noise_mm: Option<f64>,
    /// Pose repeatability (ISO 9283 RP), mm
    #[arg(long, value_name = "MM", default_value_t = 0.02, value_parser = between(0.0, 100.0))]
    pub repeatability_mm: f64,
    /// Squares of the target, not inner corners; key `target_board.squares` [default: 7x6]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Side of a square, mm; key `target_board.square_mm` [default: 10]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub square_mm: Option<f64>,
    /// Speed of the programs, per cent of the joints' own
    #[arg(long, value_name = "PERCENT", default_value_t = 20.0, value_parser = between(1.0, 100.0))]
    pub speed_percent: f64,
    /// Rest before the pictures, s
    #[arg(long, value_name = "S", default_value_t = 1.5, value_parser = between(0.0, 60.0))]
    pub dwell_s: f64,
    /// Pulses a degree of each joint: the Yaskawa job is then in pulses
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', allow_negative_numbers = true)]
    pub pulses_per_deg: Vec<f64>,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}

/// Kinds of plans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PlanKind {
    /// The poses that make the target's place over the spheres most certain
    Optimal,
    /// Section 4.2 of the paper: points on the spheres, one orientation of the flange
    Paper,
}

/// `stereocal compensate`
#[derive(Debug, Args)]
pub struct Compensate {
    /// Targets written for the nominal robot: a CSV of name and j1_deg.. or x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad (root_from_tool), or a
    /// program (.script, .mod, .src, .dat, .ls, .jbi)
    pub targets: Utf8PathBuf,
    /// The nominal robot that the targets were written for
    #[arg(long, value_name = "FILE")]
    pub robot: Utf8PathBuf,
    /// The robot as `identify` found it
    #[arg(long, value_name = "FILE")]
    pub identified: Utf8PathBuf,
    /// The tool in the last frame, mm, instead of both files' `[tool]`
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_negative_numbers = true)]
    pub tool: Vec<f64>,
    /// Pulses a degree of each joint, for Yaskawa jobs in pulses
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', allow_negative_numbers = true)]
    pub pulses_per_deg: Vec<f64>,
    /// Results.
    #[command(flatten)]
    pub output: Output,
}

/// `stereocal export`
#[derive(Debug, Args)]
pub struct Export {
    /// What to write.
    #[command(subcommand)]
    pub what: ExportWhat,
}

/// `stereocal robot`
#[derive(Debug, Args)]
pub struct RobotCommand {
    /// What to do.
    #[command(subcommand)]
    pub what: RobotWhat,
}

/// What `robot` can do.
#[derive(Debug, Subcommand)]
pub enum RobotWhat {
    /// A robot file from a URDF, or from a table in CSV (alpha_deg,a_mm,theta_deg,d_mm a joint)
    Import(RobotImport),
    /// A robot file of a common arm
    New(RobotNew),
    /// Names of the common arms
    List,
    /// A robot in words, and its pose at given joint angles: hold it against the pendant
    Show(RobotShow),
}

/// `stereocal robot import`
#[derive(Debug, Args)]
pub struct RobotImport {
    /// A URDF (.urdf, .xml) or a table (.csv)
    pub file: Utf8PathBuf,
    /// Link of a URDF that carries the target [default: the end of the chain]
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// Where alpha and a of a table's row stand: behind the joint (classic) or before it
    #[arg(long, value_enum, default_value = "modified")]
    pub dh: DhConvention,
    /// Where it goes.
    #[command(flatten)]
    pub place: RobotPlace,
}

/// `stereocal robot new`
#[derive(Debug, Args)]
pub struct RobotNew {
    /// One of `stereocal robot list`
    pub name: String,
    /// Where it goes.
    #[command(flatten)]
    pub place: RobotPlace,
}

/// Where `robot.toml` goes.
#[derive(Debug, Args)]
pub struct RobotPlace {
    /// Folder for robot.toml [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Overwrite a robot.toml that is there
    #[arg(long)]
    pub force: bool,
}

/// `stereocal robot show`
#[derive(Debug, Args)]
pub struct RobotShow {
    /// The robot file
    pub file: Utf8PathBuf,
    /// Joint angles, deg, with commas [default: all zero]
    #[arg(long, value_name = "DEG,DEG,...", value_delimiter = ',', allow_negative_numbers = true)]
    pub joints: Vec<f64>,
}

/// Conventions of Denavit-Hartenberg tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DhConvention {
    /// alpha and a of the link behind the joint (Denavit and Hartenberg, Paul)
    Classic,
    /// alpha and a of the link before the joint (Craig)
    Modified,
}

/// What `export` can write.
#[derive(Debug, Subcommand)]
pub enum ExportWhat {
    /// The stereo calibration
    Calibration(ExportCalibration),
    /// The robot
    Robot(ExportRobot),
}

/// `stereocal export robot`
#[derive(Debug, Args)]
pub struct ExportRobot {
    /// The robot file, as `identify` wrote it
    #[arg(long, value_name = "FILE")]
    pub robot: Utf8PathBuf,
    /// For which program
    #[arg(long)]
    pub format: RobotFormat,
    /// The maker's URDF: its links, meshes and names are kept, joint origins corrected (--format urdf)
    #[arg(long, value_name = "FILE")]
    pub nominal_urdf: Option<Utf8PathBuf>,
    /// Link of that URDF that is the flange [default: the end of the chain]
    #[arg(long, value_name = "LINK", requires = "nominal_urdf")]
    pub tip: Option<String>,
    /// The nominal robot that deviations are counted from (--format ur-calibration) [default: the common arm of the same name]
    #[arg(long, value_name = "FILE")]
    pub nominal: Option<Utf8PathBuf>,
    /// Folder for results; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// Programs that a robot can be written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RobotFormat {
    /// A URDF: the maker's own with corrected joint origins, or one built from the parameters
    Urdf,
    /// A table of modified Denavit-Hartenberg parameters
    DhCsv,
    /// stereocal's own file, all terms in it
    Toml,
    /// The kinematics file of ROS's ur_description and its like
    RosKinematicsYaml,
    /// Universal Robots' calibration.conf
    UrCalibration,
}

/// `stereocal export calibration`
#[derive(Debug, Args)]
pub struct ExportCalibration {
    /// For which program
    #[arg(long)]
    pub format: CalibrationFormat,
    /// The rig, or the folder it was exported to [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Folder for results; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// Programs that a calibration can be written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum CalibrationFormat {
    /// OpenCV's FileStorage (YAML)
    Opencv,
    /// ROS camera_info, one file a camera
    Ros,
    /// Kalibr's camchain
    Kalibr,
    /// mrcal's cameramodel, one file a camera
    Mrcal,
}

/// `stereocal simulate`
#[derive(Debug, Args)]
pub struct Simulate {
    /// The world to start from
    #[arg(long, value_enum, default_value = "small")]
    pub preset: Preset,
    /// Width and height of the pictures, px [default: the preset's]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(320..=16384))]
    pub size: Option<u32>,
    /// Seed of every random draw
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// How the flange is turned along a group's poses [default: the preset's]
    #[arg(long, value_enum)]
    pub orientation: Option<Orientation>,
    /// Pairs of pictures of the check board [default: the preset's]
    #[arg(long, value_name = "N", value_parser = count(0, 10_000))]
    pub check_pairs: Option<usize>,
    /// Robot poses to identify from, besides the centres [default: the preset's]
    #[arg(long, value_name = "N", value_parser = count(0, 100_000))]
    pub samples: Option<usize>,
    /// Robot poses to verify with [default: the preset's]
    #[arg(long, value_name = "N", value_parser = count(0, 100_000))]
    pub verify: Option<usize>,
    /// No pictures: measurements.csv with noise
    #[arg(long)]
    pub points_only: bool,
    /// Noise of each coordinate with --points-only, mm [default: 0.01]
    #[arg(long, value_name = "MM", value_parser = between(0.0, 1e3), requires = "points_only")]
    pub point_noise_mm: Option<f64>,
    /// What the lens does to a point
    #[arg(long, value_enum, default_value = "gaussian")]
    pub lens_blur: LensBlur,
    /// Bits a pixel, 8 to 16; more than 8 are stored as the high bits of 16 [default: 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(8..=16))]
    pub bits: Option<u8>,
    /// How far the check board's middle stands out, um [default: 0]
    #[arg(long, value_name = "UM", allow_negative_numbers = true, value_parser = between(-1e5, 1e5))]
    pub bow_um: Option<f64>,
    /// Standard deviation of the check board's crossings, um [default: 1]
    #[arg(long, value_name = "UM", value_parser = between(0.0, 1e3))]
    pub pitch_um: Option<f64>,
    /// How far black runs over each edge of both boards, um [default: 0]
    #[arg(long, value_name = "UM", value_parser = between(0.0, 1e3))]
    pub ink_um: Option<f64>,
    /// Stretch of both boards against their certificates, parts per million [default: 0]
    #[arg(long, value_name = "PPM", allow_negative_numbers = true, value_parser = between(-1e5, 1e5))]
    pub thermal_ppm: Option<f64>,
    /// The true robot, instead of one drawn from the seed: a robot file, or `table-2` for what the paper identified; the
    /// effects below are added to it
    #[arg(long, value_name = "FILE|table-2")]
    pub true_robot: Option<Utf8PathBuf>,
    /// Largest misalignment of parallel axes, deg [default: 0]
    #[arg(long, value_name = "DEG", value_parser = between(0.0, 10.0))]
    pub beta_deg: Option<f64>,
    /// Sag of joints 2 and 3 under a unit weight, mrad a metre of lever [default: 0]
    #[arg(long, value_name = "MRAD", value_parser = between(0.0, 100.0))]
    pub gravity_mrad: Option<f64>,
    /// Amplitude of the drives' periodic errors, mrad [default: 0]
    #[arg(long, value_name = "MRAD", value_parser = between(0.0, 100.0))]
    pub harmonics_mrad: Option<f64>,
    /// Pose repeatability (ISO 9283 RP) [default: 0.02]
    #[arg(long, value_name = "MM", value_parser = between(0.0, 100.0))]
    pub repeatability_mm: Option<f64>,
    /// Folder for the simulated world; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
}

/// Reads a number of a range.
fn between(least: f64, most: f64) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number from {least} to {most} is needed")),
    }
}

/// Reads a point.
fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|v| v.trim().parse().ok()).filter(|v: &f64| v.is_finite()).collect();
    <[f64; 3]>::try_from(numbers).map_err(|_| "three numbers X,Y,Z in mm are needed".to_owned())
}

/// Reads a count of a range.
fn count(least: usize, most: usize) -> impl Fn(&str) -> Result<usize, String> + Clone {
    move |text| match text.parse::<usize>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a whole number from {least} to {most} is needed")),
    }
}

/// Kinds of blur.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LensBlur {
    /// The same Gaussian everywhere
    Gaussian,
    /// A Gaussian, and a disc by the distance from the focal plane (f/16)
    Defocus,
    /// A Gaussian, and a comatic flare that grows with the field (1 px at the corners)
    Coma,
}

/// The worlds that come with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Preset {
    /// The paper's: 5120x5120, 30 check pairs, 262 poses, 50 to verify
    Paper,
    /// The same shape at 1280x1280 with fewer poses
    Small,
}

/// What is assumed about the check board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BoardShape {
    /// A plane
    Flat,
    /// Paraboloids along both axes, found with the rig
    Bowed,
}

fn lens(name: &str) -> Result<Lens, String> {
    Lens::from_name(name).ok_or_else(|| {
        let names = Lens::LADDER.map(Lens::name).join(", ");
        format!("no lens of this name; there are {names}")
    })
}

fn picture_size(text: &str) -> Result<(u32, u32), String> {
    let parse = |side: &str| side.trim().parse::<u32>().ok().filter(|n| (1..=100_000).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((parse(w)?, parse(h)?)))
        .ok_or_else(|| "a picture's size is WIDTHxHEIGHT in px, each from 1 to 100000, as in 2448x2048".to_owned())
}
