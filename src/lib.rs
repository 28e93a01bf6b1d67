//! Robot calibration with two cameras and a checkerboard: from raw pictures to corrected kinematics.
//!
//! ```text
//!  pictures of the check board                pictures of the target on the robot, joint angles
//!        |                                                   |
//!    imaging  folder -> pairs -> pictures -> coarse board -> refined corners -> agreed order
//!        |                                                   |
//!    stereo   bundle -> rig (calibration.json) ------->  target pose per robot pose
//!        |    triangulation -> verdict against 0.05 mm       |  measurements.csv
//!        v                                                   v
//!    report                                     identify  base parameters -> solvers -> verification
//!                                                            |  identified.toml
//!                                                            v
//!                                                        robot    corrected kinematics
//!    simulate: the truth all of this is tested against (rig, boards, robot, pictures)
//! ```
//!
//! The modules are listed in the order of the data.
#![doc = include_str!("CONVENTIONS.md")]

pub mod cli;
pub mod commands;
pub mod config;
pub mod csv_table;
pub mod diagnostic;
pub mod files;
pub mod geometry;
pub mod linear_algebra;
pub mod progress;
pub mod ranges;
pub mod statistics;
pub mod tables;

pub mod imaging;
pub mod opencv;
pub mod stereo;

pub mod formats;

pub mod measurements;
pub mod robot;

pub mod identify;

pub mod compensate;
pub mod plan;
pub mod programs;

pub mod simulate;

pub mod report;

pub mod guide;

pub use commands::{Error, Result};
