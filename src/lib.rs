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
//! # Example
//!
//! A robot that is off by half a millimetre and half a degree, measured at forty poses by a sensor that stands
//! somewhere, and found again:
//!
//! ```
//! use stereocal::measurements::{Measurement, Observed, RobotPose, Role};
//! use stereocal::{Dataset, Method, Robot, Settings, geometry, identify};
//!
//! let nominal = Robot::paper();
//! let mut truth = nominal.clone();
//! truth.joints[1].theta_rad += 0.5_f64.to_radians();
//! truth.joints[2].a_mm += 0.5;
//! let sensor = geometry::transform([0.3, -0.7, 1.1].into(), [900.0, 150.0, 400.0].into());
//! let row = |i: usize| {
//!     let joints_deg: Vec<f64> = (0..6).map(|j| 40.0 * ((1 + i * (2 * j + 3)) as f64).sin()).collect();
//!     let joints_rad: Vec<f64> = joints_deg.iter().map(|q| q.to_radians()).collect();
//!     let role = if i % 4 == 3 { Role::Verify } else { Role::Sample };
//!     let at = RobotPose { pose: i.to_string(), group: "1".into(), role, joints_deg, slides: Vec::new() };
//!     let point_mm = sensor * truth.target_mm(&joints_rad);
//!     let observed = Observed::Position { point_mm, covariance_mm2: None, rotation_rad: None };
//!     Measurement { at, target: String::new(), observed }
//! };
//! let rows: Vec<Measurement> = (0..40).map(row).collect();
//! let settings = Settings { method: Some(Method::TrustRegion), ..Settings::default() };
//! let found = identify(&Dataset::new(&rows)?, &nominal, &settings, 1, &|_| {})?;
//! let robot = &found.candidates[found.chosen].robot;
//! assert!((robot.joints[2].a_mm - truth.joints[2].a_mm).abs() < 1e-3);
//! # Ok::<(), stereocal::Error>(())
//! ```
//!
//! What stands below is what other programs may use. Everything else that is public is so for the command and for the
//! tests of this repository, is not documented here, and may change with any version.
#![doc = include_str!("CONVENTIONS.md")]

#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod commands;
#[doc(hidden)]
pub mod config;
mod crossing;
#[doc(hidden)]
pub mod csv_table;
#[doc(hidden)]
pub mod diagnostic;
#[doc(hidden)]
pub mod difference;
#[doc(hidden)]
pub mod files;
#[doc(hidden)]
pub mod geometry;
#[doc(hidden)]
pub mod linear_algebra;
#[doc(hidden)]
pub mod progress;
#[doc(hidden)]
pub mod ranges;
#[doc(hidden)]
pub mod statistics;
#[doc(hidden)]
pub mod tables;
mod widest;

#[doc(hidden)]
pub mod imaging;
#[doc(hidden)]
pub mod opencv;
#[doc(hidden)]
pub mod stereo;

#[doc(hidden)]
pub mod formats;

#[doc(hidden)]
pub mod measurements;
#[doc(hidden)]
pub mod robot;

#[doc(hidden)]
pub mod identify;

#[doc(hidden)]
pub mod compensate;
#[doc(hidden)]
pub mod plan;
#[doc(hidden)]
pub mod programs;

#[doc(hidden)]
pub mod simulate;

#[doc(hidden)]
pub mod report;

#[doc(hidden)]
pub mod guide;

pub use commands::{Error, Result};
pub use compensate::{Compensated, Compensator};
pub use identify::data::dataset::Dataset;
pub use identify::run::{Identification, identify};
pub use identify::{Method, Model, Settings};
pub use imaging::{Board, Corners, find_corners};
pub use measurements::Measurement;
pub use plan::{Plan, plan};
pub use robot::Robot;
pub use simulate::world::World;
pub use stereo::Rig;
pub use stereo::calibrate::{Calibration, calibrate};
pub use stereo::judge::verdict::Verdict;
