//! `stereocal camera-check --against`: whether a calibration still holds, by a few new pairs.

use std::collections::BTreeSet;

use camino::{Utf8Path, Utf8PathBuf};

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
use crate::imaging::{Board, Corners, Wanted, find_corners};
use crate::stereo::findings::standing::MATERIAL_SHARE;
use crate::stereo::pairs::open_numbers;
use crate::stereo::recheck::again::{self, Ends};
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
    let mut corners = open_numbers::by_rig(corners, &calibrated.rig);
    let again = Again::among(&mut corners, &calibrated.ends_px, &own);
    corners.notes.iter().for_each(progress::note);
    let made_by = out.provenance();
    let whole = made_by.as_ref().and_then(|run| run.shares(&file)).filter(|_| !own.only_new);
    let said =
        |same| format!("{same} holds what this calibration was made of: only new pairs tell whether it still holds");
    let of_own = own.statements().into_iter().chain(whole.map(said));
    let warnings: Vec<String> = calibrated
        .doubts()
        .into_iter()
        .chain(other_size(&calibrated, &corners))
        .chain(of_own)
        .chain(again.said)
        .collect();
    warnings.iter().for_each(progress::warn);
    let Calibrated { rig, noise, pair_excess, farthest_pair, pairs, volume, board, .. } = calibrated;
    let before = Before { rig, noise, pair_excess: pair_excess.unwrap_or(1.0), farthest_pair, pairs, volume };
    let mut found = recheck::recheck(&before, &corners)?;
    if found.change.is_some() {
        check_squares(&before, &corners, board)?;
    }
    // As of a change, what moves a length by less is nothing to act on; and what the calibration's own pairs scatter by
    // is in its uncertainty.
    let all_own = args.corners.is_some() && whole.is_some();
    let is_own = |stray: &recheck::Stray| all_own || own.pairs.contains(&stray.pair);
    found.strays.retain(|stray| stray.effect_mm > MATERIAL_SHARE * tolerance_mm && !is_own(stray));

    let standing = Standing::of(found.change.is_some(), found.effect_mm, found.seen_mm, tolerance_mm)
        .by(whole.is_some() || again.only)
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
    let then = of_other_size(calibrated.board?, &corners.board)?;
    Some(format!(
        "the calibration was made with squares of {} mm, and {} mm are said now: if it is the same board, leave `--square-mm` away",
        then.square_mm, corners.board.square_mm
    ))
}

/// The board that calibrated, where it has as many squares of another size.
fn of_other_size(then: Board, now: &Board) -> Option<Board> {
    (then.squares == now.squares && then.square_mm != now.square_mm).then_some(then)
}

/// Pairs that contradict the rig with the squares that are said, and agree with it with those that calibrated, show no
/// change: they are of the board that calibrated.
fn check_squares(before: &Before, corners: &Corners, calibrated: Option<Board>) -> Result<()> {
    let said = corners.board;
    let Some(board) = calibrated.and_then(|then| of_other_size(then, &said)) else { return Ok(()) };
    let stands =
        recheck::recheck(before, &Corners { board, ..corners.clone() }).is_ok_and(|found| found.change.is_none());
    if !stands {
        return Ok(());
    }
    let message = format!(
        "the pairs agree with the calibration where the squares are of {} mm, as they were when it was made, and not where they are of {} mm as is said",
        board.square_mm, said.square_mm
    );
    Err(config::Error::Usage { message, hint: "leave `--square-mm` away".to_owned() }.into())
}

/// Pairs that show the board where the calibration's did, in pictures that are not its own: those were saved anew.
struct Again {
    /// What is said of them.
    said: Option<String>,
    /// Whether they are all that there is to judge by.
    only: bool,
}

impl Again {
    /// Takes them out where the others are enough.
    fn among(corners: &mut Corners, known: &[Ends], own: &Own) -> Again {
        let again = again::pairs(corners, known).into_iter().filter(|pair| !own.pairs.contains(pair));
        let again: Vec<String> = again.collect();
        let of = corners.pairs.len();
        let only = !again.is_empty() && of < again.len() + FEWEST_PAIRS;
        let said = (!again.is_empty()).then(|| {
            let out = if only { "which say nothing of what happened since" } else { "left out" };
            format!(
                "{} of {of} pairs show the board where pairs of the calibration did, to a tenth of a pixel: their pictures, saved anew, {out}: {}",
                again.len(),
                named(&again)
            )
        });
        if !only {
            corners.pairs.retain(|pair| !again.contains(&pair.pair));
        }
        Again { said, only }
    }
}

/// Pairs of pictures that the calibration was made of, among those that are to say whether it still holds.
#[derive(Default)]
struct Own {
    pairs: Vec<String>,
    /// Pairs of which one picture is the calibration's and the other is not.
    half: Vec<String>,
    /// Pairs of the same two pictures as an earlier one: they tell nothing of their own.
    again: Vec<String>,
    /// How many pairs there were with them.
    of: usize,
    /// Whether the others are enough to judge by: then these are left out.
    left_out: bool,
    /// The same of those of which only one picture is the calibration's.
    half_left_out: bool,
    /// Whether such pairs were left out, and none is left.
    only_new: bool,
}

impl Own {
    /// Takes the pairs of which a picture is one of the calibration's out where the others are enough; those of which
    /// only one is where any others are.
    fn among(pairing: &mut Pairing, calibration: &Utf8Path) -> Own {
        let known = Provenance::pictures_of(calibration);
        let of = pairing.pairs.len();
        let mut seen = BTreeSet::new();
        let is_first = |pair: &PairFiles| seen.insert([&pair.left, &pair.right].map(|path| hash_of_picture(path)));
        let (pairs, again): (Vec<PairFiles>, Vec<PairFiles>) = pairing.pairs.drain(..).partition(is_first);
        pairing.pairs = pairs;
        let is_known = |path: &&Utf8PathBuf| are_among(&known, [path.as_path()]);
        let count = |pair: &PairFiles| [&pair.left, &pair.right].into_iter().filter(is_known).count();
        let counted: Vec<(usize, PairFiles)> = pairing.pairs.drain(..).map(|pair| (count(&pair), pair)).collect();
        let with = |known: usize| {
            let of = counted.iter().filter(|(count, _)| *count == known);
            of.map(|(_, pair)| pair.pair.clone()).collect::<Vec<String>>()
        };
        let [others, half, own] = [0, 1, 2].map(with);
        let left_out = !own.is_empty() && others.len() >= FEWEST_PAIRS;
        let whole = if left_out { others.len() } else { others.len() + own.len() };
        let half_left_out = !half.is_empty() && whole >= FEWEST_PAIRS;
        let stays = |(known, _): &(usize, PairFiles)| [true, !half_left_out, !left_out][*known];
        pairing.pairs = counted.into_iter().filter(stays).map(|(_, pair)| pair).collect();
        let none_left = |pairs: &[String], left_out: bool| left_out || pairs.is_empty();
        let only_new = (left_out || half_left_out) && none_left(&own, left_out) && none_left(&half, half_left_out);
        let again = again.into_iter().map(|pair| pair.pair).collect();
        Own { pairs: own, half, again, of, left_out, half_left_out, only_new }
    }

    fn statements(&self) -> Vec<String> {
        let said = |pairs: &[String], left_out: bool, why: &str| {
            let are = if pairs.len() == 1 { "is" } else { "are" };
            let out = if left_out { "left out" } else { "compared" };
            format!("{} of {} pairs {are} {out}, {why}: {}", pairs.len(), self.of, named(pairs))
        };
        let again = (!self.again.is_empty()).then(|| said(&self.again, true, "the same pictures as another pair's"));
        let own = self.left_out.then(|| said(&self.pairs, true, "of which this calibration was made"));
        let half = (!self.half.is_empty()).then(|| {
            let why = "of which one picture is of those that this calibration was made of and the other is not (changed since, or another \
                       pair's)";
            said(&self.half, self.half_left_out, why)
        });
        again.into_iter().chain(own).chain(half).collect()
    }
}

/// The corners of the new pairs, on the board that calibrated unless another one is named.
fn corners(
    args: &CameraCheck,
    calibrated: &Calibrated,
    config: &Config,
    (out, calibration): (&OutDir, &Utf8Path),
) -> Result<(Corners, Own)> {
    let named = args.board.is_some() || args.squares.is_some();
    let board = |pairing: Option<&Pairing>| match calibrated.board.filter(|_| !named) {
        Some(board) => Ok(args.square_mm.map_or(board, |mm| board.scaled(mm / board.square_mm))),
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::temporary_folder;

    /// The pairs of these names that are compared with a calibration of pairs a, b and c, and what is said: each has
    /// the left and the right picture of the letters behind it.
    fn compared(pairs: &[&str]) -> (Vec<String>, Own) {
        let (_keep, root) = temporary_folder();
        let picture = |side: &str, content: char| {
            let path = root.join(format!("{side}{content}.png"));
            std::fs::write(&path, format!("{side}{content}")).unwrap();
            path
        };
        let known = ["a", "b", "c"].into_iter().flat_map(|pair| ["left", "right"].map(|side| format!("{side}{pair}")));
        let hashes: Vec<String> =
            known.map(|content| crate::files::provenance::picture_hash(content.as_bytes())[..16].to_owned()).collect();
        let input = serde_json::json!({"file": "", "sha256": "", "picture_hashes": hashes});
        let made_of = serde_json::json!({"program": "", "date": "", "command": "", "inputs": [input], "outputs": []});
        let calibration = root.join("calibration.json");
        std::fs::write(&calibration, serde_json::json!({ "provenance": made_of }).to_string()).unwrap();
        let pair = |name: &&str| {
            let of: Vec<char> = name.chars().collect();
            PairFiles { pair: (*name).to_owned(), left: picture("left", of[0]), right: picture("right", of[1]) }
        };
        let mut pairing = Pairing { pairs: pairs.iter().map(pair).collect(), ..Pairing::default() };
        let own = Own::among(&mut pairing, &calibration);
        (pairing.pairs.into_iter().map(|pair| pair.pair).collect(), own)
    }

    #[test]
    fn a_pair_with_one_picture_of_the_calibration_is_neither_its_own_nor_new() {
        let (left, own) = compared(&["aa", "bb", "cx"]);
        assert!(left == ["aa", "bb"] && !own.only_new, "{left:?}");
        let said = own.statements().join("; ");
        assert!(
            said.starts_with("1 of 3 pairs is left out, of which one picture is") && said.ends_with(": cx"),
            "{said}"
        );

        let (left, own) = compared(&["aa", "bx", "yy", "zz"]);
        assert!(left == ["yy", "zz"] && own.only_new, "{left:?}");
        assert_eq!(own.statements().len(), 2);

        // Where nothing else is there, they are compared, and said to be what they are.
        let (left, own) = compared(&["ax", "by"]);
        assert!(left == ["ax", "by"] && !own.only_new, "{left:?}");
        let said = own.statements().join("; ");
        assert!(said.starts_with("2 of 2 pairs are compared, of which one picture is"), "{said}");

        let (left, own) = compared(&["xx", "yy"]);
        assert!(left == ["xx", "yy"] && own.statements().is_empty() && !own.only_new, "{left:?}");
    }
}
