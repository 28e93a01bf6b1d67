//! Commands about a robot: from nominal parameters over poses and measurements to corrected targets.

use camino::Utf8PathBuf;
use clap::{Args, Subcommand, ValueEnum};

use super::board::Target;
use super::output::{Files, Output};
use super::values::{between, number, whole, whole_between};

/// `stereocal identify`
#[derive(Debug, Args)]
pub struct Identify {
    /// Measurements: CSV with any delimiter, xlsx, xls, ods (FILE#SHEET), program lines; repeat for files that complete
    /// each other or are stacked [default: measurements.csv in the results folder]
    #[arg(long, value_name = "FILE")]
    pub measurements: Vec<Utf8PathBuf>,
    #[command(flatten)]
    pub table: TableFlags,
    /// The nominal robot [default: robot.toml in the working directory if there, else Table 1 of the paper]
    #[arg(long, value_name = "FILE")]
    pub robot: Option<Utf8PathBuf>,
    /// Distances between touched points: two columns of groups, and their distance; optionally sigma_mm
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
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    pub seed: u64,
    #[command(flatten)]
    pub output: Output,
}

/// What is known of a table that people have.
#[derive(Debug, Clone, Args)]
pub struct TableFlags {
    /// What the columns are, in their order, those of all files side by side: j1,j2,...,-,x,y,z; `-` skips one; key
    /// `measurements.columns`
    #[arg(long, value_name = "NAME,NAME,...", allow_hyphen_values = true)]
    pub columns: Option<String>,
    /// Units of joints and lengths: deg or rad, mm, cm, m, um or in; key `measurements.units` [default: what the names
    /// say, else what fits the nominal robot]
    #[arg(long, value_name = "UNIT,UNIT", value_parser = units)]
    pub units: Option<String>,
}

/// `stereocal verify`
#[derive(Debug, Args)]
pub struct Verify {
    /// Measurements, in any form that `identify` reads; without verify rows all of them are judged
    #[arg(long, value_name = "FILE", required = true)]
    pub measurements: Vec<Utf8PathBuf>,
    #[command(flatten)]
    pub table: TableFlags,
    /// A robot to judge; repeat for more
    #[arg(long, value_name = "FILE", required_unless_present = "against")]
    pub robot: Vec<Utf8PathBuf>,
    /// Is this robot, with its identification.json beside it, still the one of some ten new poses? Nothing else is
    /// judged
    #[arg(long, value_name = "IDENTIFIED", conflicts_with_all = ["robot", "known_distances"])]
    pub against: Option<Utf8PathBuf>,
    /// With --against: how far the target may move, mm [default: key `tolerance_mm`, or what 95 % of the errors were
    /// stated to be below, where that is more]
    #[arg(long, value_name = "MM", requires = "against", allow_negative_numbers = true, value_parser = between(1e-4, 1e3))]
    pub tolerance_mm: Option<f64>,
    /// With --against: where the sensor stands by now, as `locate` found it [default: placement.json beside the robot]
    #[arg(long, value_name = "FILE", requires = "against")]
    pub placement: Option<Utf8PathBuf>,
    /// With --against: folder for results; key `out` [default: out]
    #[arg(long, value_name = "DIR", requires = "against")]
    pub out: Option<Utf8PathBuf>,
    /// With --against: replace files that stereocal did not write, or that were changed since
    #[arg(long, requires = "against")]
    pub force: bool,
    /// Distances between touched points: two columns of groups, and their distance; optionally sigma_mm
    #[arg(long, value_name = "FILE")]
    pub known_distances: Option<Utf8PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
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
    #[arg(long, value_name = "N", value_parser = whole_between::<usize>(4, 2000))]
    pub poses: Option<usize>,
    /// Poses to verify with [default: 20; 50 with --plan paper]
    #[arg(long, value_name = "N", value_parser = whole_between::<usize>(0, 2000))]
    pub verify: Option<usize>,
    /// Which plan
    #[arg(long, value_enum, default_value = "optimal")]
    pub plan: PlanKind,
    /// Only so many poses a placement, near its middle, to find out where the cameras stand
    #[arg(long, value_name = "N", value_parser = whole_between::<usize>(2, 50), conflicts_with = "after")]
    pub first: Option<usize>,
    /// measurements.csv of the first poses: says where the cameras stand and what is known already
    #[arg(long, value_name = "MEASUREMENTS")]
    pub after: Option<Utf8PathBuf>,
    /// Seed of the candidates
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>)]
    pub seed: u64,
    /// Candidates to choose from
    #[arg(long, value_name = "N", default_value_t = 20_000, value_parser = whole_between::<usize>(200, 200_000))]
    pub pool: usize,
    /// Middle of a sphere, base frame, mm; repeat for more [default: the paper's four, scaled by the robot's reach]
    #[arg(long, value_name = "X,Y,Z", allow_negative_numbers = true, value_parser = point)]
    pub center: Vec<[f64; 3]>,
    /// Radius of the spheres, mm
    #[arg(long, value_name = "MM", default_value_t = 100.0, allow_negative_numbers = true, value_parser = between(1.0, 1e4))]
    pub radius_mm: f64,
    /// Largest tilt of the target out of the field's plane, deg
    #[arg(long, value_name = "DEG", default_value_t = 35.0, allow_negative_numbers = true, value_parser = between(0.0, 70.0))]
    pub tilt_deg: f64,
    /// Depth of field: largest distance of the target before or behind the field's middle, mm
    #[arg(long, value_name = "MM", default_value_t = 120.0, allow_negative_numbers = true, value_parser = between(1.0, 1e4))]
    pub depth_mm: f64,
    /// How far off its place the target may be and still be seen whole, mm
    #[arg(long, value_name = "MM", default_value_t = 8.0, allow_negative_numbers = true, value_parser = between(0.0, 1e3))]
    pub margin_mm: f64,
    /// Standard deviation of a coordinate of the measured point, mm [default: from the rig's corners and the
    /// repeatability]
    #[arg(long, value_name = "MM", allow_negative_numbers = true, value_parser = between(1e-6, 100.0))]
    pub noise_mm: Option<f64>,
    /// Pose repeatability (ISO 9283 RP), mm
    #[arg(long, value_name = "MM", default_value_t = 0.02, allow_negative_numbers = true, value_parser = between(0.0, 100.0))]
    pub repeatability_mm: f64,
    #[command(flatten)]
    pub target: Target,
    /// Speed of the programs, per cent of the joints' own
    #[arg(long, value_name = "PERCENT", default_value_t = 20.0, allow_negative_numbers = true, value_parser = between(1.0, 100.0))]
    pub speed_percent: f64,
    /// Rest before the pictures, s
    #[arg(long, value_name = "S", default_value_t = 1.5, allow_negative_numbers = true, value_parser = between(0.0, 60.0))]
    pub dwell_s: f64,
    /// Pulses a degree of each joint: the Yaskawa job is then in pulses
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', allow_negative_numbers = true, value_parser = number)]
    pub pulses_per_deg: Vec<f64>,
    /// Which joint of the robot file each number of a program's target is, as in 1,2,4,5,6,7,3 where the seventh is the
    /// third joint; with more than six joints it is needed for programs in makers' languages with six axes and then
    /// external ones
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', value_parser = whole::<usize>)]
    pub joint_order: Vec<usize>,
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
    /// Targets written for the nominal robot: a CSV of name and j1_deg.. or x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad
    /// (root_from_tool), or a program (.script, .mod, .src, .dat, .ls, .jbi)
    pub targets: Utf8PathBuf,
    /// The nominal robot that the targets were written for
    #[arg(long, value_name = "FILE")]
    pub robot: Utf8PathBuf,
    /// The robot as `identify` found it
    #[arg(long, value_name = "FILE")]
    pub identified: Utf8PathBuf,
    /// The tool in the last frame, mm, instead of both files' `[tool]`
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_negative_numbers = true, value_parser = number)]
    pub tool: Vec<f64>,
    /// Pulses a degree of each joint, for Yaskawa jobs in pulses
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', allow_negative_numbers = true, value_parser = number)]
    pub pulses_per_deg: Vec<f64>,
    /// Which joint of the robot file each number of a program's target is, as in 1,2,4,5,6,7,3 where the seventh is the
    /// third joint; needed with more than six, as makers' languages have six axes and then external ones
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', value_parser = whole::<usize>)]
    pub joint_order: Vec<usize>,
    /// Correct a program's joint targets although other motions stay as they are; these are named, and the exit status
    /// is 1
    #[arg(long)]
    pub joint_targets_only: bool,
    #[command(flatten)]
    pub output: Output,
}

/// What `stereocal robot` can do.
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
    /// A URDF (.urdf, .xml); the kinematics file of ROS (ur_description); a table of any form, columns alpha, a, theta,
    /// d in any order; or a program's or settings' text with such parameters
    pub file: Utf8PathBuf,
    /// Link of a URDF that carries the target [default: the end of the chain]
    #[arg(long, value_name = "LINK")]
    pub tip: Option<String>,
    /// Where alpha and a of a table's row stand: behind the joint (classic) or before it [default: what fits
    /// --measurements, else what names and words say, else what the first and last rows show]
    #[arg(long, value_enum)]
    pub dh: Option<DhConvention>,
    /// Measurements of the robot, which tell what a table leaves open; repeat as for `identify`
    #[arg(long, value_name = "FILE")]
    pub measurements: Vec<Utf8PathBuf>,
    /// What a table's columns are, in their order: alpha,a,d,theta; `-` skips one
    #[arg(long, value_name = "NAME,NAME,...", allow_hyphen_values = true)]
    pub columns: Option<String>,
    /// Units of a table's angles and lengths: deg or rad, mm, cm, m, um or in [default: what the names say, else what
    /// the numbers and words around them show]
    #[arg(long, value_name = "UNIT,UNIT", value_parser = units)]
    pub units: Option<String>,
    #[command(flatten)]
    pub place: RobotPlace,
}

/// `stereocal robot new`
#[derive(Debug, Args)]
pub struct RobotNew {
    /// One of `stereocal robot list`, or a part that only one of them has: irb120, "IRB 120"
    pub name: String,
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
    #[arg(long, value_name = "DEG,DEG,...", value_delimiter = ',', allow_hyphen_values = true, value_parser = number)]
    pub joints: Vec<f64>,
}

/// Conventions of Denavit-Hartenberg tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DhConvention {
    /// alpha and a of the link behind the joint (Denavit and Hartenberg, Paul), also `standard`
    #[value(alias = "standard")]
    Classic,
    /// alpha and a of the link before the joint (Craig)
    Modified,
}

/// `stereocal export robot`
#[derive(Debug, Args)]
pub struct ExportRobot {
    /// The robot file, as `identify` wrote it [default: identified.toml in the results folder]
    #[arg(long, value_name = "FILE")]
    pub robot: Option<Utf8PathBuf>,
    /// For which program
    #[arg(long)]
    pub format: RobotFormat,
    /// The maker's URDF: its links, meshes and names are kept, joint origins corrected (--format urdf)
    #[arg(long, value_name = "FILE")]
    pub nominal_urdf: Option<Utf8PathBuf>,
    /// Link of that URDF that is the flange [default: the end of the chain]
    #[arg(long, value_name = "LINK", requires = "nominal_urdf")]
    pub tip: Option<String>,
    /// The nominal robot that deviations are counted from (--format ur-calibration) [default: the common arm of the
    /// same name]
    #[arg(long, value_name = "FILE")]
    pub nominal: Option<Utf8PathBuf>,
    #[command(flatten)]
    pub files: Files,
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

/// Reads a point.
fn point(text: &str) -> Result<[f64; 3], String> {
    let numbers: Vec<f64> =
        text.split(',').filter_map(|v| v.trim().parse().ok()).filter(|v: &f64| v.is_finite()).collect();
    <[f64; 3]>::try_from(numbers).map_err(|_| "three numbers X,Y,Z in mm are needed".to_owned())
}

/// Reads units.
fn units(text: &str) -> Result<String, String> {
    match text.split(',').all(|word| crate::tables::names::Unit::of(word).is_some()) {
        true => Ok(text.to_owned()),
        false => Err("deg or rad, mm, cm, m, um or in, or one of each with a comma between are needed".to_owned()),
    }
}
