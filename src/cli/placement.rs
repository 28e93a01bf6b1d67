//! `stereocal export placement`: where the cameras stand, for other programs.

use camino::Utf8PathBuf;
use clap::{Args, ValueEnum};

use super::output::Files;

/// `stereocal export placement`
#[derive(Debug, Args)]
pub struct ExportPlacement {
    /// For which program
    #[arg(long)]
    pub format: PlacementFormat,
    /// The placement, as `identify` or `locate` wrote it [default: placement.json in the results folder]
    #[arg(long, value_name = "FILE")]
    pub placement: Option<Utf8PathBuf>,
    /// Which group of several [default: each, in a file of its own]
    #[arg(long, value_name = "NAME")]
    pub group: Option<String>,
    /// Name of the frame that the robot file starts from (a UR's in ROS is `base`, half a turn from `base_link`)
    #[arg(long, value_name = "NAME", default_value = "base_link")]
    pub base_frame: String,
    /// Name of the flange's frame
    #[arg(long, value_name = "NAME", default_value = "tool0")]
    pub flange_frame: String,
    /// Name of the left camera's optical frame [default: left_camera_optical_frame; instrument where no cameras
    /// measured]
    #[arg(long, value_name = "NAME")]
    pub camera_frame: Option<String>,
    /// Name of the target's frame
    #[arg(long, value_name = "NAME", default_value = "target")]
    pub target_frame: String,
    #[command(flatten)]
    pub files: Files,
}

/// Programs that a placement can be written for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PlacementFormat {
    /// A ROS 2 launch file with static_transform_publisher, in m
    RosStaticTf,
    /// OpenCV's FileStorage (YAML) with calibrateHandEye's names, in mm
    Opencv,
    /// easy_handeye's calibration file (ROS 1), in m
    #[value(alias = "easy_handeye")]
    EasyHandeye,
}
