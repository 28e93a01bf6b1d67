//! `stereocal locate`: where the cameras stand and the target sits, with a robot that is taken as it is.

use camino::{Utf8Path, Utf8PathBuf};
use serde::Serialize;

use super::heed::heed;
use super::identify::{check_joints, read, source};
use super::{Outcome, Result, measure};
use crate::cli::Locate;
use crate::config::Config;
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::{Provenance, Run};
use crate::formats::placements::record::{PLACEMENT, PlacementFile};
use crate::formats::robots::known;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::still;
use crate::identify::examine::{self, Examined};
use crate::identify::finding::Finding;
use crate::identify::judge::errors::Judge;
use crate::identify::judge::locate::{Fit, locate};
use crate::identify::judge::{folds, strays};
use crate::identify::record;
use crate::robot::{Advice, Check};
use crate::{progress, report, robot};

/// `placement.json` with the fit that it is from.
#[derive(Debug, Serialize)]
struct LocatedFile {
    #[serde(flatten)]
    placement: PlacementFile,
    fit: Fit,
}

pub fn run(args: &Locate, config: &Config, run: Run) -> Result<Outcome> {
    let out = args.measure.output.out.clone().unwrap_or_else(|| config.out.clone());
    let (robot, check) = robot::file::read_checked(&args.robot)?;
    let heeded = heed(check.as_ref(), &args.robot);
    replaced(&out).into_iter().for_each(progress::warn);
    let file = measured(args, config, &run, &out)?;
    let source = source(vec![file], &args.table, config);
    let rows = read(&source, &robot)?;
    check_joints(&robot, &rows, &source.files[0])?;
    let run = Run { force: args.measure.output.force, ..run };
    let paths = source.paths();
    let inputs: Vec<&Utf8Path> = paths.iter().map(Utf8PathBuf::as_path).chain([args.robot.as_path()]).collect();
    let out = OutDir::open(&out)?.for_run(&run, &inputs);
    out.check_free(&[PLACEMENT])?;

    let set = Dataset::new(&rows)?;
    still::check_points(&set, Some(&robot))?;
    let Examined { set, robot: of_rows, along, findings, mended, against, unexplained } =
        examine::examine(&set, &robot, &config.identify, &|_| {});
    // The robot is that of its file: what is wrong between the two is mended in the rows.
    let set = examine::on_rows::mended(&set, &robot, &of_rows).unwrap_or(set);
    let moved = along.instead.clone().into_iter().chain(record::findings::along_the_rows(&along, &set));
    let said = against.iter().chain(&findings).chain(&unexplained).cloned().chain(moved);
    said.for_each(|finding| progress::warn(finding.sentence()));
    let mut doubts: Vec<String> =
        against.iter().chain(&unexplained).chain(&along.robots).chain(&mended).map(Finding::sentence).collect();
    if unexplained.is_some() {
        examine::in_hand::refuse(&set, &robot)?;
    }
    let (trust, open) = (known::trust(&args.robot), known::left_open(&args.robot, &robot));
    // Of a robot that is another one nothing is told, whatever the poses are.
    let located =
        locate(&set, &robot, trust, open.as_ref(), &config.identify).map_err(|error| match (error, &unexplained) {
            (Error::Open { .. }, Some(finding)) => Error::OtherRobot { why: finding.finding.clone() },
            (error, _) => error,
        })?;
    let is_placed = |row: &usize| located.fit.stray.as_ref().is_none_or(|stray| stray.row != *row);
    let all: Vec<usize> = set.rows(|_| true).into_iter().filter(is_placed).collect();
    let (judge, placed) = (Judge::plain(&set, &all, false), &located.placed.robot);
    let held_out = folds::judged(&judge, placed, &all);
    let strays = strays::find(&judge, (&[placed], &[&set]), &all).map(|strays| strays.statement(&set));
    strays.iter().for_each(progress::warn);
    doubts.extend(strays);
    let mut placement = PlacementFile::new(args.robot.as_str(), &set, Some(&located.placed), &held_out);
    let own = of_rows_and_fit(&doubts, &located.fit);
    let status = if own.is_none() { Status::Done } else { Status::OutOfTolerance };
    placement.check = match check {
        Some(Check { advice: Advice::DoNotUse, .. }) if !located.fit.contradicted => check,
        check => own.or(check),
    };
    let content = LocatedFile { placement, fit: located.fit };
    let json = out.write_json(PLACEMENT, &content)?;
    let summary = || report::located::summary(&content.placement, &content.fit, !doubts.is_empty(), &out);
    let stdout = if args.measure.output.json { json } else { summary() };
    Ok(Outcome { stdout, status: status.or_worse(heeded) })
}

/// What the rows say of the placement's use; `None` where they are as they are written and agree with the robot.
fn of_rows_and_fit(doubts: &[String], fit: &Fit) -> Option<Check> {
    let advice = if fit.contradicted { Advice::DoNotUse } else { Advice::Check };
    let reasons: Vec<String> = fit.objection().into_iter().chain(doubts.iter().cloned()).collect();
    (!reasons.is_empty()).then(|| Check {
        advice,
        reason: reasons.join("; "),
        out_of_tolerance: false,
        mended: Vec::new(),
    })
}

/// What stands in the results folder that another command made, and that this one replaces.
fn replaced(out: &Utf8Path) -> Vec<String> {
    let by_other = |(name, what): (&str, &str)| {
        let command = Provenance::of_json(&out.join(name))?.command;
        let by = command.split_whitespace().find(|word| ["identify", "measure", "locate"].contains(word))?;
        (by != "locate").then(|| format!("{what} in {out} that `{by}` wrote is replaced: `--out DIR` keeps both"))
    };
    [(PLACEMENT, "placement.json"), ("measure.json", "measurements.csv")].into_iter().filter_map(by_other).collect()
}

/// The measurements: those of a folder of pictures are made first, as `measure` makes them.
fn measured(args: &Locate, config: &Config, run: &Run, out: &Utf8Path) -> Result<Utf8PathBuf> {
    if !args.measure.poses.is_dir() {
        return Ok(args.measure.poses.clone());
    }
    measure::run(&args.measure, config, run.clone())?;
    Ok(out.join("measurements.csv"))
}
