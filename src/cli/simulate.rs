//! `simulate`.

use camino::Utf8PathBuf;
use clap::{Args, ValueEnum};

use super::values::{between, whole, whole_between};
use crate::formats::boards::files::named;
use crate::imaging::Board;
use crate::simulate::settings::Orientation;

/// `stereocal simulate`
#[derive(Debug, Args)]
pub struct Simulate {
    /// The world to start from
    #[arg(long, value_enum, default_value = "small")]
    pub preset: Preset,
    /// Width and height of the pictures, px [default: the preset's]
    #[arg(long, value_name = "PX", value_parser = whole_between::<u32>(320, 16384))]
    pub size: Option<u32>,
    /// Seed of every random draw
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    pub seed: u64,
    /// How the flange is turned along a group's poses [default: the preset's]
    #[arg(long, value_enum)]
    pub orientation: Option<Orientation>,
    /// The check board by its name, as for `camera-check --board`; key `check_board` [default: checker:20x20:10]
    #[arg(long, value_name = "BOARD", value_parser = named)]
    pub board: Option<Board>,
    /// The target by its name; key `target_board` [default: checker:7x6:10]
    #[arg(long, value_name = "BOARD", value_parser = named)]
    pub target_board: Option<Board>,
    /// Pairs of pictures of the check board [default: the preset's]
    #[arg(long, value_name = "N", value_parser = whole_between::<usize>(0, 10_000))]
    pub check_pairs: Option<usize>,
    /// Robot poses to identify from, besides the centres [default: the preset's]
    #[arg(long, value_name = "N", value_parser = whole_between::<usize>(0, 100_000))]
    pub samples: Option<usize>,
    /// Robot poses to verify with [default: the preset's]
    #[arg(long, value_name = "N", value_parser = whole_between::<usize>(0, 100_000))]
    pub verify: Option<usize>,
    /// No pictures: measurements.csv with noise
    #[arg(long)]
    pub points_only: bool,
    /// Noise of each coordinate with --points-only, mm [default: 0.01]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = between(0.0, 1e3), requires = "points_only")]
    pub point_noise_mm: Option<f64>,
    /// What the lens does to a point
    #[arg(long, value_enum, default_value = "gaussian")]
    pub lens_blur: LensBlur,
    /// Bits a pixel, 8 to 16; more than 8 are stored as the high bits of 16 [default: 8]
    #[arg(long, value_name = "N", value_parser = whole_between::<u8>(8, 16))]
    pub bits: Option<u8>,
    /// How far the check board's middle stands out, um [default: 0]
    #[arg(long, value_name = "UM", allow_negative_numbers = true, value_parser = between(-1e5, 1e5))]
    pub bow_um: Option<f64>,
    /// Standard deviation of the check board's crossings, um [default: 1]
    #[arg(long, value_name = "UM", allow_negative_numbers = true, value_parser = between(0.0, 1e3))]
    pub pitch_um: Option<f64>,
    /// How far black runs over each edge of both boards, um [default: 0]
    #[arg(long, value_name = "UM", allow_negative_numbers = true, value_parser = between(0.0, 1e3))]
    pub ink_um: Option<f64>,
    /// Stretch of both boards against their certificates, parts per million [default: 0]
    #[arg(long, value_name = "PPM", allow_negative_numbers = true, value_parser = between(-1e5, 1e5))]
    pub thermal_ppm: Option<f64>,
    /// The true robot, instead of one drawn from the seed: a robot file, or `table-2` for what the paper identified;
    /// the effects below are added to it
    #[arg(long, value_name = "FILE|table-2")]
    pub true_robot: Option<Utf8PathBuf>,
    /// Largest misalignment of parallel axes, deg [default: 0]
    #[arg(long, value_name = "DEG", allow_negative_numbers = true, value_parser = between(0.0, 10.0))]
    pub beta_deg: Option<f64>,
    /// Sag of joints 2 and 3 under a unit weight, mrad a metre of lever [default: 0]
    #[arg(long, value_name = "MRAD", allow_negative_numbers = true, value_parser = between(0.0, 100.0))]
    pub gravity_mrad: Option<f64>,
    /// Amplitude of the drives' periodic errors, mrad [default: 0]
    #[arg(long, value_name = "MRAD", allow_negative_numbers = true, value_parser = between(0.0, 100.0))]
    pub harmonics_mrad: Option<f64>,
    /// Pose repeatability (ISO 9283 RP) [default: 0.02]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = between(0.0, 100.0))]
    pub repeatability_mm: Option<f64>,
    /// Folder for the simulated world; key `out` [default: out]
    #[arg(long, value_name = "DIR")]
    pub out: Option<Utf8PathBuf>,
    /// Replace files that stereocal did not write, or that were changed since
    #[arg(long)]
    pub force: bool,
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
