//! `stereocal camera-check`: Pictures of the check board to a calibrated rig and a verdict.

use super::Outcome;
use crate::cli::{BoardShape, CameraCheck};
use crate::config::{self, Config};
use crate::error::{Result, Status};
use crate::files::{OutDir, to_json};
use crate::imaging::cache::Cache;
use crate::imaging::{Board, Corners, Wanted, corners_file, find_corners};
use crate::progress;
use crate::report;
use crate::stereo::accuracy::{self, SecondBoard, Verdict};
use crate::stereo::calibrate::{Calibration, FEWEST_PAIRS, Options, calibrate};
use crate::stereo::calibration_file::CalibrationFile;
use crate::stereo::check_file::{CameraCheckFile, Demand, Judged};

/// Runs the command.
pub fn run(args: &CameraCheck, config: &Config) -> Result<Outcome> {
    let board = board(args, config)?;
    let tolerance_mm = args.tolerance_mm.unwrap_or(config.tolerance_mm);
    let mut problems = Vec::new();
    config::positive(&mut problems, "tolerance_mm", tolerance_mm);
    if let Some(mm) = args.board_uncertainty_mm {
        config::positive(&mut problems, "board_uncertainty_mm", mm);
    }
    let demand = Demand { tolerance_mm, board_uncertainty_mm: args.board_uncertainty_mm.unwrap_or(0.0) };
    config::reject(problems)?;
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;

    let corners = corners(args, board, &out)?;
    corners.notes.iter().for_each(progress::note);
    let calibration = calibrate(&corners, &options(args))?;
    for skipped in &calibration.skipped {
        progress::warn(format!("pair {} is not used: {}", skipped.pair, skipped.reason));
    }
    let accuracy = accuracy::hold_out(&calibration)?;
    let second = second_board(args, board, &calibration, &out)?;
    let judged = Judged::new(&calibration, accuracy, second, &demand);
    judged.advice.iter().chain(&judged.warnings).for_each(progress::warn);

    let file = CameraCheckFile::new(&calibration, &judged);
    let page = report::camera_check::page(&calibration, &judged, &corners)?;
    out.write_json("calibration.json", &CalibrationFile::from(calibration.rig()))?;
    out.write("corners.csv", corners_file::to_csv(&calibration.mark(&corners)).as_bytes())?;
    out.write_json("camera-check.json", &file)?;
    out.write("camera-check.html", page.as_bytes())?;

    let stdout =
        if args.output.json { to_json(&file) } else { report::camera_check::summary(&calibration, &judged, &out) };
    let status = if judged.verdict == Verdict::Pass { Status::Done } else { Status::OutOfTolerance };
    Ok(Outcome { stdout, status })
}

/// The check board, as large as its temperature makes it.
fn board(args: &CameraCheck, config: &Config) -> Result<Board> {
    /// Temperature at which lengths are certified (ISO 1), deg C.
    const REFERENCE_C: f64 = 20.0;
    let board = config.check_board.board(args.squares, args.square_mm)?;
    let (Some(celsius), Some(ppm)) = (args.board_temperature_c, args.expansion_ppm_per_k) else { return Ok(board) };
    let growth = 1.0 + 1e-6 * ppm * (celsius - REFERENCE_C);
    let mut problems = Vec::new();
    config::positive(&mut problems, "the board's thermal growth", growth);
    config::reject(problems)?;
    Ok(Board { square_mm: board.square_mm * growth, ..board })
}

fn options(args: &CameraCheck) -> Options {
    Options { lens: args.lens, shape: args.board_shape.map(|shape| shape == BoardShape::Bowed) }
}

fn corners(args: &CameraCheck, board: Board, out: &OutDir) -> Result<Corners> {
    match (&args.corners, &args.images) {
        (Some(file), _) => corners_file::read(file, board, args.picture_size),
        (None, Some(images)) => {
            let (cache, overlays) = (Some(Cache { out }), args.draw.then_some(out));
            find_corners(images, &Wanted { board, needed: FEWEST_PAIRS, cache, overlays })
        }
        // The command line asks for one of the two.
        (None, None) => {
            Err(config::Error::Invalid { problems: vec!["neither pictures nor --corners given".into()] }.into())
        }
    }
}

/// A second board measured by the rig, where its pictures were named.
fn second_board(
    args: &CameraCheck,
    board: Board,
    calibration: &Calibration,
    out: &OutDir,
) -> Result<Option<SecondBoard>> {
    let Some(images) = &args.check_images else { return Ok(None) };
    let board = Board {
        squares: args.check_squares.unwrap_or(board.squares),
        square_mm: args.check_square_mm.unwrap_or(board.square_mm),
    };
    let mut problems = Vec::new();
    config::positive(&mut problems, "check_square_mm", board.square_mm);
    config::reject(problems)?;
    let corners = find_corners(images, &Wanted { board, needed: 1, cache: Some(Cache { out }), overlays: None })?;
    calibration.rig().check_size(&corners)?;
    Ok(accuracy::second_board(calibration, &corners))
}
