//! `stereocal camera-check`: Pictures of the check board to a calibrated rig and a verdict.

use super::Outcome;
use crate::cli::CameraCheck;
use crate::config::{self, Config};
use crate::error::{Result, Status};
use crate::files::{OutDir, to_json};
use crate::imaging::{Board, Corners, Wanted, corners_file, find_corners};
use crate::progress;
use crate::report;
use crate::stereo;
use crate::stereo::accuracy::{self, Verdict};
use crate::stereo::calibrate::{FEWEST_PAIRS, Options, calibrate};
use crate::stereo::calibration_file::CalibrationFile;
use crate::stereo::check_file::CameraCheckFile;

/// Runs the command.
pub fn run(args: &CameraCheck, config: &Config) -> Result<Outcome> {
    let board = config.check_board.board(args.squares, args.square_mm)?;
    let tolerance_mm = args.tolerance_mm.unwrap_or(config.tolerance_mm);
    let mut problems = Vec::new();
    config::positive(&mut problems, "tolerance_mm", tolerance_mm);
    config::reject(problems)?;
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;

    let corners = corners(args, board)?;
    corners.notes.iter().for_each(progress::note);
    let calibration = calibrate(&corners, &Options { lens: args.lens, shape: None })?;
    for skipped in &calibration.skipped {
        progress::warn(format!("pair {} is not used: {}", skipped.pair, skipped.reason));
    }
    let accuracy = accuracy::hold_out(&calibration).ok_or(stereo::Error::Undetermined { focal_sigma: None })?;
    let verdict = accuracy.verdict(tolerance_mm);

    let file = CameraCheckFile::new(&calibration, &accuracy, tolerance_mm);
    out.write_json("calibration.json", &CalibrationFile::from(calibration.rig()))?;
    out.write("corners.csv", corners_file::to_csv(&calibration.mark(&corners)).as_bytes())?;
    out.write_json("camera-check.json", &file)?;
    let html = report::camera_check::page(&calibration, &accuracy, tolerance_mm)?;
    out.write("camera-check.html", html.as_bytes())?;

    let stdout = if args.output.json {
        to_json(&file)
    } else {
        report::camera_check::summary(&calibration, &accuracy, tolerance_mm, &out)
    };
    let status = if verdict == Verdict::Pass { Status::Done } else { Status::OutOfTolerance };
    Ok(Outcome { stdout, status })
}

fn corners(args: &CameraCheck, board: Board) -> Result<Corners> {
    match (&args.corners, &args.images) {
        (Some(file), _) => corners_file::read(file, board, args.picture_size),
        (None, Some(images)) => find_corners(images, &Wanted { board, needed: FEWEST_PAIRS }),
        // The command line asks for one of the two.
        (None, None) => {
            Err(config::Error::Invalid { problems: vec!["neither pictures nor --corners given".into()] }.into())
        }
    }
}
