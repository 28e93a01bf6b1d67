//! `stereocal measure`: Pictures of the target on the robot to its point and orientation per pose.

mod extras;
mod watch;

use std::collections::BTreeMap;

use camino::{Utf8Path, Utf8PathBuf};

use super::heed::{RigDoubts, heed_rig};
use super::{Outcome, Result};
use crate::cli::Measure;
use crate::config::Config;
use crate::diagnostic::{Status, count};
use crate::files::OutDir;
use crate::files::provenance::{Provenance, Run, are_among};
use crate::formats::calibration::{self, Calibrated};
use crate::formats::measure::{self, MeasureFile};
use crate::imaging::corners::named;
use crate::imaging::input::cache::Cache;
use crate::imaging::input::pairs::{PairFiles, Source};
use crate::imaging::{Corners, PairCorners, Wanted, find_corners};
use crate::measurements::{self, RobotPose};
use crate::report::measure::Extras;
use crate::stereo::board_pose::{Knowledge, Refusal, Seen, Series, series};
use crate::stereo::pairs::open_numbers;
use crate::{progress, report, stereo};

pub fn run(args: &Measure, config: &Config, run: Run) -> Result<Outcome> {
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;
    let rig_file = calibration::file(args.calibration.as_deref(), out.path(), &config.out)?;
    let source = args.pairs.source("measure", &args.poses);
    let list = list_of_poses(&source);
    let (known, RigDoubts { said: doubts, status, .. }) = knowledge(args, config, &rig_file)?;
    let (poses, taken) = measurements::read_pose_list(&list)?;
    taken.iter().for_each(progress::note);
    if args.watch {
        let wanted = Wanted {
            board: known.board,
            needed: 1,
            mosaic: args.bayer,
            cache: Some(Cache { out: &out, thumbnails: true }),
            overlays: None,
        };
        watch::wait(&source, &out, &poses, &known, &wanted)?;
    }
    let run = Run { force: args.output.force, ..run };
    let out = out.for_run(&run, &[source.places().as_slice(), &[&list, &rig_file]].concat());
    out.check_free(&["measurements.csv", "measure.json", "measure.html"])?;

    let (cache, overlays) = (Some(Cache { out: &out, thumbnails: true }), args.draw.then_some(&out));
    let wanted = Wanted { board: known.board, needed: 1, mosaic: args.bayer, cache, overlays };
    let pairing = source.pairs(&out)?;
    progress::note(&pairing.taken);
    calibrated_by(&pairing.pairs, &rig_file).iter().for_each(progress::note);
    let corners = find_corners(&pairing, &wanted)?;
    known.rig.check_size(&corners)?;
    // As it is seen: of a grid of tags whose it is, and how far black has spread.
    let known = Knowledge { board: corners.board, ..known };
    let corners = open_numbers::by_rig(corners, &known.rig);
    corners.notes.iter().for_each(progress::note);
    let mut series = series::measure(&known, seen(poses, &corners));
    let shifted = extras::shifted(&series)?;
    let is_open = shifted.is_some() || series.judgement.leaves_open(known.tolerance_mm);
    series.notes.extend(shifted);
    let file = MeasureFile::new(&series, &corners, &known);
    say(&series, &file);
    let distances = extras::distances(&series)?;
    let (thumbnails, json) = rayon::join(
        || extras::thumbnails(&series, &corners, &pairing.pairs, &wanted),
        || {
            out.write("measurements.csv", measure::to_csv(&series.poses).as_bytes())?;
            out.write_json("measure.json", &file)
        },
    );
    let json = json?;
    let page = report::measure::page(&series, &file, &known, &Extras { thumbnails, distances, doubts })?;
    let names = corners.pairs.iter().map(|pair| pair.pair.as_str());
    let page = if args.draw { report::page::with_overlays(page, names) } else { page };
    report::page::write(&out, "measure.html", page)?;
    end(&series, &known, &out)?;
    let stdout = if args.output.json { json } else { report::measure::summary(&file, &out) };
    let status = if is_open { Status::OutOfTolerance } else { status };
    Ok(Outcome { stdout, status })
}

/// That pictures are those of the calibration, which agree with the rig whatever it is.
fn calibrated_by(pairs: &[PairFiles], rig_file: &Utf8Path) -> Option<String> {
    let known = Provenance::pictures_of(rig_file);
    let own = pairs.iter().filter(|pair| are_among(&known, [&pair.left, &pair.right])).count();
    (own > 0).then(|| {
        format!(
            "{own} of {} calibrated this rig: that they agree with it shows nothing of how well it measures others",
            count(pairs.len(), "pair")
        )
    })
}

/// What a list of poses is called.
const LISTS: [&str; 3] = ["poses.csv", "poses.xlsx", "poses.txt"];

/// Where the poses are: in the folder of the pictures; of two folders in the one that holds both, else in one of them.
fn list_of_poses(source: &Source<'_>) -> Utf8PathBuf {
    let both = source.right.and_then(|right| source.images.ancestors().find(|above| right.starts_with(above)));
    let places = both.into_iter().chain(source.places());
    let mut lists = places.flat_map(|place| LISTS.map(|name| place.join(name)));
    let first = both.unwrap_or(source.images).join("poses.csv");
    lists.find(|list| list.is_file()).unwrap_or(first)
}

/// The rig, the target and what is known of both; what is said against the rig.
fn knowledge(args: &Measure, config: &Config, rig_file: &Utf8Path) -> Result<(Knowledge, RigDoubts)> {
    let board = config.target_board.board(args.target.board, args.target.squares, args.target.square_mm)?;
    let calibrated = calibration::read(rig_file)?;
    let doubts = heed_rig(&calibrated, rig_file);
    let Calibrated { rig, noise, pair_excess, farthest_pair, volume, .. } = calibrated;
    if rig.covariance.is_none() {
        progress::warn(format!(
            "{rig_file} holds no covariance: the points' uncertainties leave out that of the calibration"
        ));
    }
    if noise.is_none() {
        progress::warn(format!(
            "{rig_file} does not say how corners scattered: whether these pictures scatter more is not judged"
        ));
    }
    let (crossing_mm, tolerance_mm) = (config.measure.crossing_mm, config.tolerance_mm);
    let known = Knowledge { rig, noise, pair_excess, farthest_pair, volume, board, crossing_mm, tolerance_mm };
    Ok((known, doubts))
}

/// Every pose of the list with its corners, or why there are none.
fn seen(poses: Vec<RobotPose>, corners: &Corners) -> Vec<Seen> {
    let refused = |reason: &str| Err(Refusal { status: "not seen", reason: reason.to_owned() });
    let mut by_name: BTreeMap<&str, std::result::Result<PairCorners, Refusal>> =
        corners.pairs.iter().map(|pair| (pair.pair.as_str(), Ok(pair.clone()))).collect();
    for skipped in &corners.skipped {
        by_name.insert(&skipped.pair, refused(&skipped.reason));
    }
    let renamed = numbers_without_zeros(&poses, by_name.keys().copied());
    let of = |at: RobotPose| {
        let missing = || Err(Refusal { status: "no pictures", reason: "no pictures of this name".to_owned() });
        let name = renamed.get(&at.pose).map_or(at.pose.as_str(), String::as_str);
        let corners = by_name.remove(name).unwrap_or_else(missing);
        Seen { at, corners }
    };
    let seen = poses.into_iter().map(of).collect();
    if let Some((pose, picture)) = renamed.first_key_value() {
        let poses = count(renamed.len(), "pose");
        progress::note(format!(
            "{poses} by number, as a spreadsheet drops zeros: `{pose}` of poses.csv is picture `{picture}`"
        ));
    }
    let idle: Vec<String> = by_name.keys().map(|name| (*name).to_owned()).collect();
    if !idle.is_empty() {
        progress::warn(format!("{} belong to no pose of poses.csv: {}", count(idle.len(), "pair"), named(&idle)));
    }
    seen
}

/// The pictures of poses that have none of their name, but of the same number: `0105` of `105`, where no other is
/// meant.
fn numbers_without_zeros<'a>(poses: &[RobotPose], pictures: impl Iterator<Item = &'a str>) -> BTreeMap<String, String> {
    let bare = |name: &str| {
        let digits = !name.is_empty() && name.bytes().all(|b| b.is_ascii_digit());
        digits.then(|| name.trim_start_matches('0').to_owned())
    };
    let mut by_number: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for picture in pictures {
        if let Some(number) = bare(picture) {
            by_number.entry(number).or_default().push(picture);
        }
    }
    let mut numbers: BTreeMap<String, usize> = BTreeMap::new();
    poses.iter().filter_map(|at| bare(&at.pose)).for_each(|number| *numbers.entry(number).or_default() += 1);
    let of = |at: &RobotPose| {
        let number = bare(&at.pose)?;
        let [picture] = by_number.get(&number)?[..] else { return None };
        let alone = numbers.get(&number) == Some(&1) && picture != at.pose;
        alone.then(|| (at.pose.clone(), picture.to_owned()))
    };
    poses.iter().filter_map(of).collect()
}

/// What a person should know, on stderr.
fn say(series: &Series, file: &MeasureFile) {
    if series.judgement.ends_the_run() {
        return;
    }
    let mut causes: Vec<(&str, Vec<String>)> = Vec::new();
    for pose in &series.poses {
        let Err(Refusal { reason, .. }) = &pose.target else { continue };
        match causes.iter_mut().find(|(cause, _)| cause == reason) {
            Some((_, names)) => names.push(pose.at.pose.clone()),
            None => causes.push((reason, vec![pose.at.pose.clone()])),
        }
    }
    for (reason, names) in causes {
        let (poses, are) = if names.len() == 1 { ("pose", "is") } else { ("poses", "are") };
        progress::warn(format!("{poses} {} {are} not measured: {reason}", named(&names)));
    }
    file.warnings.iter().for_each(progress::warn);
}

/// A rig that is not the calibrated one, or not one measured pose, is the end of the run; the files say so as well.
fn end(series: &Series, known: &Knowledge, out: &OutDir) -> Result<()> {
    let judgement = &series.judgement;
    let measured = series.poses.iter().filter(|pose| pose.target.is_ok()).count();
    if let (true, Some(statement)) = (judgement.ends_the_run(), judgement.describe(&known.rig, &known.board)) {
        let before = || format!("; {} before that: {}", count(measured, "measured pose"), out.join("measurements.csv"));
        let kept = if measured > 0 { before() } else { String::new() };
        let hint = judgement.hint(&known.rig).unwrap_or_default();
        return Err(stereo::Error::RigChanged { statement: statement + &kept, hint }.into());
    }
    if measured == 0 {
        return Err(stereo::Error::NothingMeasured { poses: series.poses.len() }.into());
    }
    Ok(())
}
