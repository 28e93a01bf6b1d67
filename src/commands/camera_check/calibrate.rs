//! `stereocal camera-check`: Pictures of the check board to a calibrated rig and a verdict.

use std::collections::BTreeSet;

use camino::Utf8Path;

use super::super::{Error, Outcome, Result};
use super::squares::squares;
use crate::cli::{BoardShape, CameraCheck};
use crate::config::{self, Config};
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::{Provenance, Run, are_among, hash_of_picture};
use crate::formats::calibration::CalibrationFile;
use crate::formats::camera_check;
use crate::formats::lenses;
use crate::imaging::board::SQUARES_MM;
use crate::imaging::board::printed::Printed;
use crate::imaging::image::{ENOUGH_QUALITY, jpeg_quality};
use crate::imaging::input::cache::Cache;
use crate::imaging::input::corners_csv;
use crate::imaging::input::pairs::{PairFiles, Pairing, Source};
use crate::imaging::overlay::SideBySide;
use crate::imaging::{self, Board, Corners, Side, Wanted, find_corners, kind};
use crate::report::drawing::pair_picture::PairPicture;
use crate::report::drawing::picture::PairJpeg;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::residuals;
use crate::stereo::findings::standing::{self, Asked};
use crate::stereo::judge::assessment::{Demand, Judged};
use crate::stereo::judge::ledger::{LensPairs, Standards};
use crate::stereo::judge::lengths::held_out;
use crate::stereo::judge::lengths::second_board::{self, SecondBoard};
use crate::stereo::judge::moved_tags;
use crate::stereo::judge::moves;
use crate::stereo::judge::verdict::Verdict;
use crate::stereo::model::known_lenses::{KnownLenses, TOLERANCE};
use crate::stereo::pairs::{fewest_pairs, open_numbers};
use crate::stereo::select::options::Options;
use crate::stereo::volume;
use crate::{progress, ranges, report, stereo};

pub fn run(args: &CameraCheck, config: &Config, run: Run) -> Result<Outcome> {
    if let Some(against) = &args.against {
        return super::recheck::run(args, against, config, run);
    }
    let mut demand = demand(args, config)?;
    let out = open(args, config, run)?;

    let known = known_lenses(args)?;
    let pairing = pairing(args, known.as_ref(), &out)?;
    let (board, by_caliper_mm) = board(args, config, pairing.as_ref())?;
    demand.board_uncertainty_mm = demand.board_uncertainty_mm.or(by_caliper_mm);
    demand.size_assumed = size_assumed(args, config);
    demand.size_assumed.iter().for_each(progress::warn);
    demand.lens_pairs = pairs_of_lenses(args, pairing.as_ref(), &out);
    demand.lens_pairs.statement().iter().for_each(progress::warn);
    let corners = corners(args, board, pairing.as_ref(), known.as_ref(), &out)?;
    let known = known.map(|known| known.of_pictures(&corners)).transpose()?;
    let asked = Asked { options: options(args, known), tolerance_mm: demand.tolerance_mm, extent: demand.extent };
    let corners = open_numbers::by_other_pairs(corners, &asked.options);
    corners.notes.iter().for_each(progress::note);
    let calibrated = match &args.since {
        Some(pair) => standing::calibrate_since(&corners, pair, &asked),
        None => standing::calibrate_standing(&corners, &asked),
    };
    let (calibration, findings) = calibrated.map_err(|error| explained(error, args, board, pairing.as_ref()))?;
    volume::lengths::check(&calibration, demand.extent)?;
    moved_tags::said(&calibration).iter().for_each(progress::warn);
    said_spread(&calibration, demand.tolerance_mm).iter().for_each(progress::note);
    let accuracy = held_out::hold_out(&calibration, demand.board_uncertainty_mm)?;
    let second = second_board(args, board, pairing.as_ref(), &calibration, (demand.board_uncertainty_mm, &out))?;
    let standards = Standards { second, moves: moves::measure(&calibration, &args.known_move)? };
    let mut judged = Judged::new(&calibration, findings, accuracy, standards, &demand);
    if args.lens.is_some() && judged.verdict != Verdict::Pass {
        let other = "leave `--lens` away: the lens is then the one that best predicts pairs it has not seen";
        judged.advice.insert(0, other.to_owned());
    }
    if judged.verdict != Verdict::Pass {
        judged.advice.extend(pairing.as_ref().and_then(compressed));
    }
    calibration.rig().unusual().into_iter().chain(report::camera_check::blurred(&corners)).for_each(progress::warn);

    let file = camera_check::content(&calibration, &judged);
    let pictures = pictures(args, pairing.as_ref(), &calibration, &judged);
    let page = report::camera_check::page(&calibration, &judged, &corners, &pictures)?;
    out.write_json("calibration.json", &CalibrationFile::from(calibration.rig()).with_check(&calibration, &judged))?;
    if !out.is_input("corners.csv") {
        out.write("corners.csv", corners_csv::to_csv(&calibration.mark(&corners)).as_bytes())?;
    }
    let json = out.write_json("camera-check.json", &file)?;
    let names = corners.pairs.iter().map(|pair| pair.pair.as_str());
    let drawn = args.draw && args.images.is_some();
    let page = if drawn { report::page::with_overlays(page, names) } else { page };
    report::page::write(&out, "camera-check.html", page)?;

    let stdout = if args.output.json { json } else { report::camera_check::summary(&calibration, &judged, &out) };
    let status = if judged.verdict == Verdict::Pass { Status::Done } else { Status::OutOfTolerance };
    Ok(Outcome { stdout, status })
}

/// The error of pairs that contradict each other, or that of a board of another kind where they show one.
fn explained(error: stereo::Error, args: &CameraCheck, board: Board, pairing: Option<&Pairing>) -> Error {
    let stereo::Error::Contradiction { total, .. } = error else { return error.into() };
    let needed = fewest_pairs(None).min(total);
    let markers = pairing.and_then(|pairing| kind::with_markers(pairing, &board, needed, args.bayer));
    markers.map_or_else(|| error.into(), Error::from)
}

/// That black has spread on the board and its corners with it, where it is seen to have.
fn said_spread(calibration: &Calibration, tolerance_mm: f64) -> Option<String> {
    /// Share of the tolerance that is not worth a line.
    const LEAST: f64 = 0.01;
    let ([mm, uncertainty_mm], board) = (calibration.spread_mm()?, &calibration.board);
    let pitch = board.spans_mm(2).map(|mm| format!("{:.3}", (mm * 1e6).round() / 1e6));
    (mm.abs() > uncertainty_mm.max(LEAST * tolerance_mm)).then(|| {
        format!(
            "each side of the board's tags is printed {:.4} mm farther {} than it is drawn (to {uncertainty_mm:.4} mm): lengths allow for it. What scales them \
             is a tag and a gap together, which must measure {} mm across and {} mm along",
            mm.abs(),
            if mm > 0.0 { "out" } else { "in" },
            pitch[0],
            pitch[1]
        )
    })
}

/// What lengths are judged by; refuses what can be refused without pictures.
fn demand(args: &CameraCheck, config: &Config) -> Result<Demand> {
    config.check_board.board(args.board, None, args.square_mm)?;
    let tolerance_mm = args.tolerance_mm.unwrap_or(config.tolerance_mm);
    let mut problems = Vec::new();
    ranges::within(&mut problems, "tolerance_mm", tolerance_mm, ranges::TOLERANCES_MM);
    if let Some(mm) = args.board_uncertainty_mm {
        ranges::within(&mut problems, "board_uncertainty_mm", mm, ranges::TOLERANCES_MM);
    }
    config::reject(problems)?;
    Ok(Demand {
        tolerance_mm,
        board_uncertainty_mm: args.board_uncertainty_mm,
        extent: args.volume.unwrap_or_default(),
        lens_pairs: LensPairs::default(),
        size_assumed: None,
    })
}

/// The worst and the best pair for the page; none where corners came without pictures.
fn pictures(
    args: &CameraCheck,
    pairing: Option<&Pairing>,
    calibration: &Calibration,
    judged: &Judged,
) -> Vec<PairPicture> {
    /// Width of a pair on the page, both pictures together, px.
    const WIDTH: u32 = 960;
    let Some(files) = pairing else { return Vec::new() };
    let order = report::camera_check::worst_first(judged);
    let chosen = [("worst by its largest length error", order.first()), ("best", order.last())];
    let picture = |(role, index): (&'static str, Option<&usize>)| {
        let view = &calibration.views[*index?];
        let pose = &calibration.values.poses[*index?];
        let files = files.pairs.iter().find(|files| files.pair == view.pair)?;
        let jpeg = PairJpeg::new(SideBySide::read(files, args.bayer)?, WIDTH)?;
        let residuals = residuals::of_view(&calibration.values.shared, view, pose);
        Some(PairPicture { pair: view.pair.clone(), role, jpeg, residuals })
    };
    chosen.into_iter().filter_map(picture).collect()
}

/// The results folder, once nothing is in the way of what will be written.
fn open(args: &CameraCheck, config: &Config, run: Run) -> Result<OutDir> {
    let run = Run { force: args.output.force, ..run };
    let lenses = args.intrinsics.iter().map(|lens| lens.path.as_path());
    let inputs: Vec<&Utf8Path> = [&args.images, &args.pairs.right, &args.corners, &args.check_images]
        .into_iter()
        .flatten()
        .map(|p| p.as_path())
        .chain(lenses)
        .collect();
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?.for_run(&run, &inputs);
    out.check_free(&["calibration.json", "camera-check.json", "camera-check.html"])?;
    if out.is_input("corners.csv") {
        progress::note(format!("{} is read and stays as it is", out.join("corners.csv")));
    } else {
        out.check_free(&["corners.csv"])?;
    }
    Ok(out)
}

/// The check board, as it was printed and as large as its temperature makes it; what a caliper leaves uncertain of it,
/// mm.
fn board(args: &CameraCheck, config: &Config, pairing: Option<&Pairing>) -> Result<(Board, Option<f64>)> {
    let squares = squares(args, pairing)?;
    let drawn = config.check_board.board(args.board, squares, args.square_mm)?;
    let Some(extent) = args.measured_mm else {
        return Ok((warm(args, drawn)?, None));
    };
    let invalid = |problem| config::Error::Invalid { problems: vec![problem] };
    let is_assumed = config.check_board.size_is_assumed(args.board, args.square_mm).is_some();
    let printed = if is_assumed { extent.of_any_size(&drawn) } else { extent.of(&drawn) };
    let Printed { board, uncertainty_mm } = printed.map_err(invalid)?;
    let [measured, said] = [board, drawn].map(|board| board.side_said());
    let said = match is_assumed {
        true => String::new(),
        false if measured == said => ", as was said".to_owned(),
        false => format!(", not {said} mm"),
    };
    progress::note(format!(
        "by its measured extent the board has {} of {measured} mm{said}; by a caliper, to {uncertainty_mm:.4} mm in all",
        board.unit()
    ));
    Ok((warm(args, board)?, Some(uncertainty_mm)))
}

/// That nobody said how large the squares are, neither as drawn nor as printed.
fn size_assumed(args: &CameraCheck, config: &Config) -> Option<String> {
    let printed = args.measured_mm.is_some();
    config.check_board.size_is_assumed(args.board, args.square_mm).filter(|_| !printed)
}

/// The board, as large as its temperature makes it.
fn warm(args: &CameraCheck, board: Board) -> Result<Board> {
    /// Temperature at which lengths are certified (ISO 1), deg C.
    const REFERENCE_C: f64 = 20.0;
    /// Inks and glues of boards go before that.
    const HOTTEST_C: f64 = 200.0;
    /// Nothing that boards are made of grows by less: Zerodur has 0.02.
    const LEAST_PPM: f64 = 0.005;
    let (Some(celsius), Some(ppm)) = (args.board_temperature_c, args.expansion_ppm_per_k) else { return Ok(board) };
    let growth = 1.0 + 1e-6 * ppm * (celsius - REFERENCE_C);
    let mut problems = Vec::new();
    ranges::positive(&mut problems, "the board's thermal growth", growth);
    if celsius > HOTTEST_C {
        problems
            .push(format!("--board-temperature-c {celsius}: no printed board is that hot; it is in deg C, not in K"));
    }
    if ppm != 0.0 && ppm.abs() < LEAST_PPM {
        problems.push(format!("--expansion-ppm-per-k {ppm}: it is in 1e-6/K, 23 for aluminium"));
    }
    config::reject(problems)?;
    Ok(board.scaled(growth))
}

fn options(args: &CameraCheck, known: Option<KnownLenses>) -> Options {
    Options { lens: args.lens, shape: args.board_shape.map(|shape| shape == BoardShape::Bowed), known }
}

fn known_lenses(args: &CameraCheck) -> Result<Option<KnownLenses>> {
    let known = lenses::read(&args.intrinsics)?;
    if known.as_ref().is_some_and(KnownLenses::both) && args.lens.is_some() {
        let problem = "--lens asks for a lens, and --intrinsics gives those of both cameras: leave one out";
        config::reject(vec![problem.to_owned()])?;
    }
    for side in Side::BOTH {
        let camera = known.as_ref().filter(|known| !known.states_covariance(side)).and_then(|known| known.camera(side));
        if let Some(camera) = camera {
            progress::note(format!(
                "the {} lens ({}) comes without a covariance: it is taken to {} % of its focal length{}",
                side.name(),
                camera.lens.name(),
                100.0 * TOLERANCE,
                if camera.width == 0 { ", and for pictures of this size, for the file says none" } else { "" }
            ));
        }
    }
    Ok(known)
}

/// The pairs of pictures, where there are pictures.
fn pairing(args: &CameraCheck, known: Option<&KnownLenses>, out: &OutDir) -> Result<Option<Pairing>> {
    let Some(images) = &args.images else { return Ok(None) };
    let source = Source { needed: fewest_pairs(known), ..args.pairs.source("camera-check", images) };
    let pairing = source.pairs(out)?;
    progress::note(&pairing.taken);
    let names: Vec<String> = pairing.pairs.iter().map(|files| files.pair.clone()).collect();
    moves::check_names(&args.known_move, &names)?;
    Ok(Some(pairing))
}

fn corners(
    args: &CameraCheck,
    board: Board,
    pairing: Option<&Pairing>,
    known: Option<&KnownLenses>,
    out: &OutDir,
) -> Result<Corners> {
    let needed = fewest_pairs(known);
    match (&args.corners, pairing) {
        (Some(file), _) => Ok(corners_csv::read(file, board, args.picture_size)?),
        (None, Some(pairing)) => {
            let (cache, overlays) = (Some(Cache { out, thumbnails: false }), args.draw.then_some(out));
            Ok(find_corners(pairing, &Wanted { board, needed, mosaic: args.bayer, cache, overlays })?)
        }
        // The command line asks for one of the two.
        (None, None) => {
            Err(config::Error::Invalid { problems: vec!["neither pictures nor --corners given".into()] }.into())
        }
    }
}

/// Pictures that were compressed so far that their corners are not where they were.
fn compressed(pairing: &Pairing) -> Option<String> {
    let quality =
        pairing.pairs.iter().flat_map(|pair| [&pair.left, &pair.right]).filter_map(|path| jpeg_quality(path)).min();
    quality.filter(|quality| *quality < ENOUGH_QUALITY).map(|quality| {
        format!("save the pictures as PNG, or as JPEG of quality {ENOUGH_QUALITY} and more: these are of quality {quality}, whose blocks move corners")
    })
}

/// Hashes of the pictures that can be read.
fn hashes(pairs: &[PairFiles]) -> impl Iterator<Item = String> {
    pairs.iter().flat_map(|pair| [&pair.left, &pair.right]).filter_map(|path| hash_of_picture(path))
}

/// Which of the pairs were among those from which the lenses of `--intrinsics` are known; all where the whole file of
/// corners was.
fn pairs_of_lenses(args: &CameraCheck, pairing: Option<&Pairing>, out: &OutDir) -> LensPairs {
    let files = || args.intrinsics.iter().map(|lens| lens.path.as_path());
    let Some(pairing) = pairing else {
        let run = out.provenance();
        let same = files().filter(|file| run.as_ref().is_some_and(|run| run.shares(file).is_some())).count();
        return LensPairs { same, of: same };
    };
    let known: BTreeSet<String> = files().flat_map(Provenance::pictures_of).collect();
    let is_own = |pair: &&PairFiles| are_among(&known, [&pair.left, &pair.right]);
    LensPairs { same: pairing.pairs.iter().filter(is_own).count(), of: known.len() / 2 }
}

/// The error of a second board that is not found, with its own flags in the hint.
fn no_second_board(error: &imaging::Error, images: &Utf8Path) -> config::Error {
    let shown = match error {
        imaging::Error::TooFewPairs { other: Some(other), .. } => {
            format!("; the pictures show one of {} squares", other.squares)
        }
        _ => String::new(),
    };
    config::Error::Usage {
        message: format!("the second board in {images}: {error}"),
        hint: format!(
            "`--check-squares CxR` and `--check-square-mm MM`, or `--check-board NAME`, say what the second board is{shown}"
        ),
    }
}

/// A second board measured by the rig, where its pictures were named.
fn second_board(
    args: &CameraCheck,
    board: Board,
    first: Option<&Pairing>,
    calibration: &Calibration,
    (board_uncertainty_mm, out): (Option<f64>, &OutDir),
) -> Result<Option<SecondBoard>> {
    let Some(images) = &args.check_images else { return Ok(None) };
    let board = args.check_board.unwrap_or(match (args.check_squares, args.check_square_mm) {
        (None, None) => board,
        (squares, mm) => Board::checker(squares.unwrap_or(board.squares), mm.unwrap_or(board.square_mm)),
    });
    config::check_within("check_square_mm", board.square_mm, SQUARES_MM)?;
    let (mosaic, cache) = (args.bayer, Some(Cache { out, thumbnails: false }));
    let pairing = Source::folder("camera-check", images).pairs(out)?;
    let known: BTreeSet<String> = first.into_iter().flat_map(|first| hashes(&first.pairs)).collect();
    let again = hashes(&pairing.pairs).filter(|hash| known.contains(hash)).count();
    if again > 0 {
        let message = format!(
            "{again} of the {} pictures in {images} are those that the rig is calibrated from: they check nothing",
            2 * pairing.pairs.len()
        );
        let hint = "`--check-images` takes pictures of a second board, or others of the first".to_owned();
        return Err(config::Error::Usage { message, hint }.into());
    }
    let wanted = Wanted { board, needed: 1, mosaic, cache, overlays: None };
    let corners = find_corners(&pairing, &wanted).map_err(|error| no_second_board(&error, images))?;
    calibration.rig().check_size(&corners)?;
    let corners = open_numbers::by_rig(corners, calibration.rig());
    Ok(Some(second_board::second_board(calibration, &corners, board_uncertainty_mm)))
}
