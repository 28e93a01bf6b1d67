//! `stereocal camera-check --against`: whether a calibration still holds, by a few new pairs.

use std::collections::BTreeSet;

use camino::Utf8Path;

use super::super::{Outcome, Result};
use super::squares::squares;
use crate::cli::CameraCheck;
use crate::config::{self, Config};
use crate::files::OutDir;
use crate::files::provenance::{Provenance, Run, are_among, hash_of_picture};
use crate::formats::calibration::{self, Calibrated};
use crate::formats::recheck::{self as formats, Check, HISTORY, Standing};
use crate::imaging::corners::named;
use crate::imaging::input::cache::Cache;
use crate::imaging::input::corners_csv;
use crate::imaging::input::pairs::{PairFiles, Pairing, Source};
use crate::imaging::{Corners, Wanted, find_corners};
use crate::stereo::findings::standing::MATERIAL_SHARE;
use crate::stereo::pairs::open_numbers;
use crate::stereo::recheck::{self, Before, FEWEST_PAIRS};
use crate::{progress, ranges, report};

/// What the flag takes.
const HINT: &str = "`--against` takes the calibration.json that `stereocal camera-check IMAGES` wrote; whether a robot is still the identified one is asked by \
                    `stereocal verify --against out/identified.toml --measurements FILE`";

pub fn run(args: &CameraCheck, against: &Utf8Path, config: &Config, run: Run) -> Result<Outcome> {
    let run = Run { force: args.output.force, ..run };
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;
    let of_flag = |error: crate::files::Error| error.with_hint(HINT);
    let file = calibration::file(Some(against), out.path(), &config.out).map_err(of_flag)?;
    let calibrated = calibration::read(&file).map_err(of_flag)?;
    // What the calibration was held against says what it has to hold still.
    let of_check = || calibrated.check.map_or(config.tolerance_mm, |check| check.tolerance_mm);
    let tolerance_mm = args.tolerance_mm.unwrap_or_else(of_check);
    config::check_within("tolerance_mm", tolerance_mm, ranges::TOLERANCES_MM)?;
    let places = [&args.images, &args.pairs.right, &args.corners];
    let inputs: Vec<&Utf8Path> =
        places.into_iter().flatten().map(|path| path.as_path()).chain([file.as_path()]).collect();
    let out = out.for_run(&run, &inputs);
    out.check_free(&["recheck.json", HISTORY, "recheck.html"])?;
    let mut checks = formats::history(&out, HISTORY)?;

    let (corners, own) = corners(args, &calibrated, config, (&out, &file))?;
    let corners = open_numbers::by_rig(corners, &calibrated.rig);
    corners.notes.iter().for_each(progress::note);
    let made_by = out.provenance();
    let whole = made_by.as_ref().and_then(|run| run.shares(&file)).filter(|_| !own.left_out);
    let said =
        |same| format!("{same} holds what this calibration was made of: only new pairs tell whether it still holds");
    let of_own = own.statements().into_iter().chain(whole.map(said));
    let warnings: Vec<String> =
        calibrated.doubts().into_iter().chain(other_size(&calibrated, &corners)).chain(of_own).collect();
    warnings.iter().for_each(progress::warn);
    let Calibrated { rig, noise, pair_excess, farthest_pair, pairs, volume, .. } = calibrated;
    let before = Before { rig, noise, pair_excess: pair_excess.unwrap_or(1.0), farthest_pair, pairs, volume };
    let mut found = recheck::recheck(&before, &corners)?;
    // As of a change, what moves a length by less is nothing to act on.
    found.strays.retain(|stray| stray.effect_mm > MATERIAL_SHARE * tolerance_mm);

    let standing = Standing::of(found.change.is_some(), found.effect_mm, found.seen_mm, tolerance_mm)
        .by(whole.is_some())
        .beside(!found.strays.is_empty());
    let content = formats::content(&found, standing, &file, tolerance_mm);
    let date = out.provenance().map(|provenance| provenance.date).unwrap_or_default();
    checks.push(Check::new(&found, standing, &file, date));
    let page = report::recheck::page(&found, standing, tolerance_mm, &checks, &warnings)?;
    let json = out.write_json("recheck.json", &content)?;
    out.write(HISTORY, formats::to_csv(&checks, "pairs").as_bytes())?;
    report::page::write(&out, "recheck.html", page)?;
    let summary = || report::recheck::summary(&found, standing, tolerance_mm, checks.len(), &out);
    Ok(Outcome { stdout: if args.output.json { json } else { summary() }, status: standing.status() })
}

/// Where the board is said to be of another size than the one that calibrated.
fn other_size(calibrated: &Calibrated, corners: &Corners) -> Option<String> {
    let (then, now) = (calibrated.board?, corners.board);
    let differ = then.squares == now.squares && then.square_mm != now.square_mm;
    differ.then(|| {
        format!(
            "the calibration was made with squares of {} mm, and {} mm are said now: if it is the same board, leave `--square-mm` away",
            then.square_mm, now.square_mm
        )
    })
}

/// Pairs that the calibration was made of, among those that are to say whether it still holds.
#[derive(Default)]
struct Own {
    pairs: Vec<String>,
    /// Pairs of the same two pictures as an earlier one: they tell nothing of their own.
    again: Vec<String>,
    /// How many pairs there were with them.
    of: usize,
    /// Whether the others are enough to judge by: then these are left out.
    left_out: bool,
}

impl Own {
    /// Takes the pairs of which a picture is one of the calibration's out where the others are enough.
    fn among(pairing: &mut Pairing, calibration: &Utf8Path) -> Own {
        let known = Provenance::pictures_of(calibration);
        let of = pairing.pairs.len();
        let mut seen = BTreeSet::new();
        let is_first = |pair: &PairFiles| seen.insert([&pair.left, &pair.right].map(|path| hash_of_picture(path)));
        let (pairs, again): (Vec<PairFiles>, Vec<PairFiles>) = pairing.pairs.drain(..).partition(is_first);
        pairing.pairs = pairs;
        let is_own = |pair: &PairFiles| are_among(&known, [&pair.left, &pair.right]);
        let (own, others): (Vec<PairFiles>, Vec<PairFiles>) = pairing.pairs.iter().cloned().partition(is_own);
        let left_out = !own.is_empty() && others.len() >= FEWEST_PAIRS;
        if left_out {
            pairing.pairs = others;
        }
        let names = |pairs: Vec<PairFiles>| pairs.into_iter().map(|pair| pair.pair).collect();
        Own { pairs: names(own), again: names(again), of, left_out }
    }

    fn statements(&self) -> Vec<String> {
        let said = |pairs: &[String], why: &str| {
            let are = if pairs.len() == 1 { "is" } else { "are" };
            format!("{} of {} pairs {are} left out, {why}: {}", pairs.len(), self.of, named(pairs))
        };
        let again = (!self.again.is_empty()).then(|| said(&self.again, "the same pictures as another pair's"));
        let own = self.left_out.then(|| said(&self.pairs, "of which this calibration was made"));
        again.into_iter().chain(own).collect()
    }
}

/// The corners of the new pairs, on the board that calibrated unless another one is named.
fn corners(
    args: &CameraCheck,
    calibrated: &Calibrated,
    config: &Config,
    (out, calibration): (&OutDir, &Utf8Path),
) -> Result<(Corners, Own)> {
    let named = args.board.is_some() || args.squares.is_some() || args.square_mm.is_some();
    let board = |pairing: Option<&Pairing>| match calibrated.board.filter(|_| !named) {
        Some(board) => Ok(board),
        None => squares(args, pairing)
            .and_then(|squares| Ok(config.check_board.board(args.board, squares, args.square_mm)?)),
    };
    if let Some(file) = &args.corners {
        return Ok((corners_csv::read(file, board(None)?, args.picture_size)?, Own::default()));
    }
    // The command line asks for one of the two.
    let nothing = || config::Error::Invalid { problems: vec!["neither pictures nor --corners given".into()] };
    let images = args.images.as_ref().ok_or_else(nothing)?;
    let source = Source { needed: FEWEST_PAIRS, ..args.pairs.source("camera-check", images) };
    let mut pairing = source.pairs(out)?;
    progress::note(&pairing.taken);
    let own = Own::among(&mut pairing, calibration);
    let board = board(Some(&pairing))?;
    let cache = Some(Cache { out, thumbnails: false });
    let wanted = Wanted { board, needed: FEWEST_PAIRS, mosaic: args.bayer, cache, overlays: None };
    Ok((find_corners(&pairing, &wanted)?, own))
}
