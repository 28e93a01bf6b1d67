//! The command line as typed. What it means is decided in [`crate::commands`].

use camino::Utf8PathBuf;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::imaging::Squares;
use crate::simulate::settings::Orientation;
use crate::stereo::Lens;

/// Robot calibration with two cameras and a checkerboard.
#[derive(Debug, Parser)]
#[command(name = "stereocal", version, about, max_term_width = 100)]
pub struct Cli {
    /// Settings file [default: stereocal.toml in the working directory, if there]
    #[arg(long, global = true, value_name = "FILE")]
    pub config: Option<Utf8PathBuf>,
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
    /// Make pictures and measurements whose truth is known
    Simulate(Simulate),
    /// Write a calibration for other programs
    Export(Export),
}

/// Where results go and how they are shown.
#[derive(Debug, Args)]
pub struct Output {
    /// Folder for results [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
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
    /// Squares of the check board, not inner corners [default: 20x20]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Side of a square, mm [default: 10]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub square_mm: Option<f64>,
    /// Largest length error that passes, mm [default: 0.05]
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
    #[arg(long, value_name = "C", requires = "expansion_ppm_per_k", allow_negative_numbers = true)]
    pub board_temperature_c: Option<f64>,
    /// The board's coefficient of thermal expansion, 1e-6/K (alumina 7, glass 8, aluminium 23)
    #[arg(long, value_name = "PPM", requires = "board_temperature_c")]
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
    /// Width and height of the pictures that --corners come from, px [default: from the corners' extent]
    #[arg(long, value_name = "WxH", requires = "corners", value_parser = picture_size)]
    pub picture_size: Option<(u32, u32)>,
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
    /// The rig [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Squares of the target, not inner corners [default: 7x6]
    #[arg(long, value_name = "CxR")]
    pub squares: Option<Squares>,
    /// Side of a square, mm [default: 10]
    #[arg(long, value_name = "MM", allow_negative_numbers = true)]
    pub square_mm: Option<f64>,
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
    /// Solver; `auto` runs all and keeps the best on samples held out [default: auto]
    #[arg(long, value_name = "NAME", value_parser = ["auto", "trust-region", "stapso", "pso", "cpso", "apso", "arpso"])]
    pub method: Option<String>,
    /// Residual model [default: chosen on samples held out]
    #[arg(long, value_name = "NAME")]
    pub model: Option<crate::identify::Model>,
    /// Terms beyond MDH: parallel axes, gravity, harmonics [default: auto]
    #[arg(long, value_name = "NAME")]
    pub extensions: Option<crate::identify::settings::Extensions>,
    /// Constants of the swarms [default: those of the settings file]
    #[arg(long, value_name = "NAME")]
    pub constants: Option<crate::identify::settings::Constants>,
    /// Seed of every random draw
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
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

/// What `export` can write.
#[derive(Debug, Subcommand)]
pub enum ExportWhat {
    /// The stereo calibration
    Calibration(ExportCalibration),
}

/// `stereocal export calibration`
#[derive(Debug, Args)]
pub struct ExportCalibration {
    /// For which program
    #[arg(long)]
    pub format: CalibrationFormat,
    /// The rig [default: calibration.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub calibration: Option<Utf8PathBuf>,
    /// Folder for results [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
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
    #[arg(long, value_name = "N")]
    pub check_pairs: Option<usize>,
    /// Robot poses to identify from, besides the centres [default: the preset's]
    #[arg(long, value_name = "N")]
    pub samples: Option<usize>,
    /// Robot poses to verify with [default: the preset's]
    #[arg(long, value_name = "N")]
    pub verify: Option<usize>,
    /// No pictures: measurements.csv with noise
    #[arg(long)]
    pub points_only: bool,
    /// Noise of each coordinate with --points-only, mm [default: 0.01]
    #[arg(long, value_name = "MM", value_parser = not_negative, requires = "points_only")]
    pub point_noise_mm: Option<f64>,
    /// What the lens does to a point
    #[arg(long, value_enum, default_value = "gaussian")]
    pub lens_blur: LensBlur,
    /// Bits a pixel, 8 to 16; more than 8 are stored as the high bits of 16 [default: 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(8..=16))]
    pub bits: Option<u8>,
    /// How far the check board's middle stands out, um [default: 0]
    #[arg(long, value_name = "UM", allow_negative_numbers = true, value_parser = finite)]
    pub bow_um: Option<f64>,
    /// Standard deviation of the check board's crossings, um [default: 1]
    #[arg(long, value_name = "UM", value_parser = not_negative)]
    pub pitch_um: Option<f64>,
    /// How far black runs over each edge of both boards, um [default: 0]
    #[arg(long, value_name = "UM", value_parser = not_negative)]
    pub ink_um: Option<f64>,
    /// Stretch of both boards against their certificates, parts per million [default: 0]
    #[arg(long, value_name = "PPM", allow_negative_numbers = true, value_parser = finite)]
    pub thermal_ppm: Option<f64>,
    /// The true robot, instead of one drawn from the seed: a robot file, or `table-2` for what the paper identified; the
    /// effects below are added to it
    #[arg(long, value_name = "FILE|table-2")]
    pub true_robot: Option<Utf8PathBuf>,
    /// Largest misalignment of parallel axes, deg [default: 0]
    #[arg(long, value_name = "DEG", value_parser = not_negative)]
    pub beta_deg: Option<f64>,
    /// Sag of joints 2 and 3 under a unit weight, mrad a metre of lever [default: 0]
    #[arg(long, value_name = "MRAD", value_parser = not_negative)]
    pub gravity_mrad: Option<f64>,
    /// Amplitude of the drives' periodic errors, mrad [default: 0]
    #[arg(long, value_name = "MRAD", value_parser = not_negative)]
    pub harmonics_mrad: Option<f64>,
    /// Pose repeatability (ISO 9283 RP) [default: 0.02]
    #[arg(long, value_name = "MM", value_parser = not_negative)]
    pub repeatability_mm: Option<f64>,
    /// Folder for the simulated world [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
}

fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("a finite number is needed".to_owned()),
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    finite(text).and_then(|value| if value < 0.0 { Err("it must not be negative".to_owned()) } else { Ok(value) })
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
    let parse = |side: &str| side.trim().parse::<u32>().ok().filter(|n| *n > 0);
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((parse(w)?, parse(h)?)))
        .ok_or_else(|| "a picture's size is WIDTHxHEIGHT in px, as in 2448x2048".to_owned())
}
