//! `stereocal camera-check --against`: whether a calibration still holds, by a few new pairs.

use camino::Utf8Path;

use super::super::{Outcome, Result};
use super::squares::squares;
use crate::cli::CameraCheck;
use crate::config::{self, Config};
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::calibration::{self, Calibrated};
use crate::formats::recheck::{self as formats, Check, HISTORY, RecheckFile, Standing};
use crate::imaging::input::cache::Cache;
use crate::imaging::input::corners_csv;
use crate::imaging::input::pairs::Pairing;
use crate::imaging::{Corners, Wanted, find_corners};
use crate::stereo::pairs::open_numbers;
use crate::stereo::recheck::{self, Before, FEWEST_PAIRS};
use crate::{progress, ranges, report};

/// What the flag takes.
const HINT: &str = "`--against` takes the calibration.json that `stereocal camera-check IMAGES` wrote; whether a robot is still the identified one is asked by \
                    `stereocal verify --against out/identified.toml --measurements FILE`";

/// Runs the command.
pub fn run(args: &CameraCheck, against: &Utf8Path, config: &Config, run: Run) -> Result<Outcome> {
    let tolerance_mm = args.tolerance_mm.unwrap_or(config.tolerance_mm);
    config::check_within("tolerance_mm", tolerance_mm, ranges::TOLERANCES_MM)?;
    let run = Run { force: args.output.force, ..run };
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;
    let of_flag = |error: crate::files::Error| error.with_hint(HINT);
    let file = calibration::file(Some(against), &out).map_err(of_flag)?;
    let calibrated = calibration::read(&file).map_err(of_flag)?;
    let places = [&args.images, &args.pairs.right, &args.corners];
    let inputs: Vec<&Utf8Path> =
        places.into_iter().flatten().map(|path| path.as_path()).chain([file.as_path()]).collect();
    let out = out.for_run(&run, &inputs);
    out.check_free(&["recheck.json", HISTORY, "recheck.html"])?;
    let mut checks = formats::history(&out, HISTORY)?;

    let corners = open_numbers::by_rig(corners(args, &calibrated, config, &out)?, &calibrated.rig);
    corners.notes.iter().for_each(progress::note);
    let run = out.provenance();
    let own = run.as_ref().and_then(|run| run.shares(&file));
    let said =
        |same| format!("{same} holds what this calibration was made of: only new pairs tell whether it still holds");
    let warnings: Vec<String> = own.map(said).into_iter().collect();
    warnings.iter().for_each(progress::warn);
    let Calibrated { rig, noise, pair_excess, pairs, volume, .. } = calibrated;
    let before = Before { rig, noise, pair_excess: pair_excess.unwrap_or(1.0), pairs, volume };
    let found = recheck::recheck(&before, &corners)?;

    let standing = Standing::of(found.change.is_some(), found.effect_mm, found.seen_mm, tolerance_mm).by(own.is_some());
    let content = RecheckFile::new(&found, standing, &file, tolerance_mm);
    let date = out.provenance().map(|provenance| provenance.date).unwrap_or_default();
    checks.push(Check::new(&content, date));
    let page = report::recheck::page(&found, standing, tolerance_mm, &checks, &warnings)?;
    let json = out.write_json("recheck.json", &content)?;
    out.write(HISTORY, formats::to_csv(&checks, "pairs").as_bytes())?;
    report::page::write(&out, "recheck.html", page)?;
    let summary = || report::recheck::summary(&found, standing, tolerance_mm, checks.len(), &out);
    Ok(Outcome { stdout: if args.output.json { json } else { summary() }, status: standing.status() })
}

/// The corners of the new pairs, on the board that calibrated unless another one is named.
fn corners(args: &CameraCheck, calibrated: &Calibrated, config: &Config, out: &OutDir) -> Result<Corners> {
    let named = args.board.is_some() || args.squares.is_some() || args.square_mm.is_some();
    let board = |pairing: Option<&Pairing>| match calibrated.board.filter(|_| !named) {
        Some(board) => Ok(board),
        None => squares(args, pairing)
            .and_then(|squares| Ok(config.check_board.board(args.board, squares, args.square_mm)?)),
    };
    if let Some(file) = &args.corners {
        return Ok(corners_csv::read(file, board(None)?, args.picture_size)?);
    }
    // The command line asks for one of the two.
    let nothing = || config::Error::Invalid { problems: vec!["neither pictures nor --corners given".into()] };
    let images = args.images.as_ref().ok_or_else(nothing)?;
    let pairing = args.pairs.source("camera-check", images).pairs(out)?;
    progress::note(&pairing.taken);
    let board = board(Some(&pairing))?;
    let cache = Some(Cache { out, thumbnails: false });
    Ok(find_corners(&pairing, &Wanted { board, needed: FEWEST_PAIRS, mosaic: args.bayer, cache, overlays: None })?)
}
