//! `stereocal measure`: Pictures of the target on the robot to its point and orientation per pose.

use std::collections::BTreeMap;

use super::Outcome;
use crate::cli::Measure;
use crate::config::Config;
use crate::error::{Result, Status};
use crate::files::{OutDir, to_json};
use crate::imaging::cache::Cache;
use crate::imaging::{Board, Corners, Wanted, find_corners};
use crate::measurements::{self, RobotPose};
use crate::progress;
use crate::report;
use crate::stereo::calibration_file;
use crate::stereo::measure_file::{self, MeasureFile, MeasuredPose};
use crate::stereo::target;
use crate::stereo::{self, Rig};

/// Runs the command.
pub fn run(args: &Measure, config: &Config) -> Result<Outcome> {
    let board = config.target_board.board(args.squares, args.square_mm)?;
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;
    let calibration = args.calibration.clone().unwrap_or_else(|| out.join("calibration.json"));
    let rig = calibration_file::read(&calibration)?;
    if rig.covariance.is_none() {
        progress::warn(format!(
            "{calibration} holds no covariance: the points' uncertainties leave out that of the calibration"
        ));
    }
    let poses = measurements::read_poses(&args.poses.join("poses.csv"))?;

    let (cache, overlays) = (Some(Cache { out: &out }), args.draw.then_some(&out));
    let corners = find_corners(&args.poses, &Wanted { board, needed: 1, cache, overlays })?;
    corners.notes.iter().for_each(progress::note);
    rig.check_size(&corners)?;
    let measured = measure(&rig, &board, &corners, poses);
    for pose in &measured {
        if let Err(reason) = &pose.target {
            progress::warn(format!("pose {} is not measured: {reason}", pose.at.pose));
        }
    }
    if measured.iter().all(|pose| pose.target.is_err()) {
        return Err(stereo::Error::NothingMeasured { poses: measured.len() }.into());
    }

    let file = MeasureFile::new(&measured, &corners, &board);
    file.warnings().iter().for_each(progress::warn);
    out.write("measurements.csv", measure_file::to_csv(&measured).as_bytes())?;
    out.write_json("measure.json", &file)?;
    out.write("measure.html", report::measure::page(&measured, &file)?.as_bytes())?;
    let stdout = if args.output.json { to_json(&file) } else { report::measure::summary(&file, &out) };
    Ok(Outcome { stdout, status: Status::Done })
}

/// Every pose of the list with its target, or why there is none.
fn measure(rig: &Rig, board: &Board, corners: &Corners, poses: Vec<RobotPose>) -> Vec<MeasuredPose> {
    let targets = target::measure(rig, board, &corners.pairs);
    let mut by_name: BTreeMap<&str, Result<target::TargetPose, String>> =
        corners.pairs.iter().zip(targets).map(|(pair, target)| (pair.pair.as_str(), target)).collect();
    for skipped in &corners.skipped {
        by_name.insert(&skipped.pair, Err(skipped.reason.clone()));
    }
    let mut measured: Vec<MeasuredPose> = poses
        .into_iter()
        .map(|at| {
            let target = by_name.remove(at.pose.as_str()).unwrap_or_else(|| Err("no pictures of this name".to_owned()));
            MeasuredPose { at, target }
        })
        .collect();
    for name in by_name.keys() {
        progress::warn(format!("the pictures {name} belong to no pose of poses.csv"));
    }
    measure_file::agree_on_half_turns(board, &mut measured);
    measured
}
