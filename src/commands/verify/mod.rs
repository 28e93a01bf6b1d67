//! `stereocal verify`: Table 3 of the paper for robots from anywhere; nothing of them is fitted, only the sensor's placement.
//!
//! Measurements are examined as `identify` examines them, with the first robot, so that both judge by the same rows: units are mended and
//! sessions get placements of their own. The robots are those of their files.

mod recheck;

use camino::Utf8Path;
use serde::Serialize;

use super::{Outcome, Result};
use crate::cli::Verify;
use crate::config::Config;
use crate::diagnostic::{Status, count};
use crate::files;
use crate::files::provenance::Run;
use crate::formats::robots::known;
use crate::identify;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::known as distances;
use crate::identify::examine::{self, Examined};
use crate::identify::judge::errors::{Judge, PLACED_BY_ITSELF};
use crate::identify::judge::folds;
use crate::identify::record::{self, PointSpread, spread};
use crate::measurements::{Measurement, Observed, Role};
use crate::progress;
use crate::report;
use crate::robot::{self, Robot};

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Verified {
    robots: Vec<RobotVerified>,
}

#[derive(Debug, Serialize)]
struct RobotVerified {
    file: String,
    verify: PointSpread,
}

/// Makes verify rows samples where the file has none to place the sensor by, as a file of nothing but fresh poses; says whether it did.
fn place_by_verify_rows(rows: &mut [Measurement]) -> bool {
    let usable =
        |role: Role| move |row: &Measurement| row.at.role == role && !matches!(row.observed, Observed::Missing { .. });
    if rows.iter().any(usable(Role::Sample)) || !rows.iter().any(usable(Role::Verify)) {
        return false;
    }
    for row in rows.iter_mut().filter(|row| row.at.role == Role::Verify) {
        row.at.role = Role::Sample;
    }
    true
}

/// That a robot was fitted to rows by which it is judged.
fn fitted_to(file: &Utf8Path, rows: &[Measurement]) -> Option<String> {
    let is_kept = rows.iter().any(|row| row.at.role == Role::Verify);
    let judged = |row: &&Measurement| !is_kept || row.at.role == Role::Verify;
    let (of, given) = (rows.iter().filter(judged).count(), known::given(file));
    let own = rows.iter().filter(judged).filter(|row| given.fitted(row)).count();
    (own > 0).then(|| {
        format!(
            "{file} was fitted to {own} of these {}: its figures there are those of a fit; `identify` said how far off rows are that it was without, \
             and new poses tell how far off it is now",
            count(of, "row")
        )
    })
}

/// The set as the examination mends it, its findings said; and whether something explains the errors.
fn examined(set: &Dataset, file: &Utf8Path, robot: &Robot, settings: &identify::Settings) -> (Dataset, bool) {
    let Examined { set, robot: mended, along, findings, unexplained } = examine::examine(set, robot, settings, &|_| {});
    let explained = unexplained.is_none();
    for finding in findings.into_iter().chain(unexplained).chain(record::findings::along_the_rows(&along)) {
        progress::warn(finding.sentence());
    }
    if mended != *robot {
        progress::warn(format!("the robot of {file} is judged without this correction"));
    }
    (set, explained)
}

/// What the user must know of the rows.
fn tell(set: &Dataset, folded: bool, only_verify: bool) {
    if let Some(targets) = &set.targets {
        progress::note(targets.sentence());
    }
    if let Some(repeats) = &set.repeats {
        progress::note(repeats.sentence());
    }
    if folded {
        progress::note("no row has the role `verify`: each row is judged with the sensor placed by the others");
    }
    if only_verify {
        progress::warn(
            "no row of role `sample` can be used: the verify rows also place the sensor, so that errors of points and wire lengths come out too small where there are few rows",
        );
    }
}

/// Runs the command.
pub fn run(args: &Verify, config: &Config, run: Run) -> Result<Outcome> {
    if let Some(against) = &args.against {
        return recheck::run(args, against, config, run);
    }
    let settings = &config.identify;
    let mut robots = Vec::new();
    for file in &args.robot {
        robots.push((file, robot::file::read(file)?));
    }
    let source = super::identify::source(args.measurements.clone(), &args.table, config);
    let mut rows = match robots.first() {
        Some((_, robot)) => super::identify::read(&source, robot)?,
        None => Vec::new(),
    };
    for (_, robot) in &robots {
        super::identify::check_joints(robot, &rows, &args.measurements[0])?;
    }
    args.robot.iter().filter_map(|file| fitted_to(file, &rows)).for_each(progress::warn);
    let only_verify = place_by_verify_rows(&mut rows);
    let mut set = match robots.first() {
        Some((_, robot)) => Dataset::of_robot(&rows, robot)?,
        None => Dataset::new(&rows)?,
    };
    if let Some(path) = &args.known_distances {
        set.known = distances::read(path, &set)?;
    }
    let mut explained = true;
    if let Some((file, robot)) = robots.first() {
        (set, explained) = examined(&set, file, robot, settings);
    }
    let folded = !only_verify && set.verify_rows().is_empty();
    let (fitted, judged) = match only_verify || folded {
        true => (set.rows(|_| true), set.rows(|pose| pose.role != Role::Center)),
        false => (set.fit_rows(), set.verify_rows()),
    };
    tell(&set, folded, only_verify);
    let judge = Judge::plain(&set, &fitted, settings.wire_offset);
    let robots: Vec<RobotVerified> = robots
        .iter()
        .map(|(file, robot)| {
            let errors = if folded { folds::judged(&judge, robot, &judged) } else { judge.errors(robot, &judged) };
            RobotVerified { file: file.to_string(), verify: spread(&judge, robot, &errors, &judged) }
        })
        .collect();
    if robots.iter().all(|robot| robot.verify.is_empty()) {
        return Err(identify::Error::NothingJudged { rows: judged.len(), needed: PLACED_BY_ITSELF }.into());
    }
    let stdout = match args.json {
        true => files::to_json(&Verified { robots }),
        false => {
            let rows: Vec<(&str, &PointSpread)> = robots.iter().map(|r| (r.file.as_str(), &r.verify)).collect();
            report::identify::verified(&rows, folded)
        }
    };
    Ok(Outcome { stdout, status: if explained { Status::Done } else { Status::OutOfTolerance } })
}
