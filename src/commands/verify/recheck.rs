//! `stereocal verify --against`: whether an identified robot still is that robot, by some ten new poses.

use camino::{Utf8Path, Utf8PathBuf};

use super::super::beyond::{self, Outside};
use super::super::identify::{check_joints, read, source};
use super::super::{Outcome, Result};
use crate::cli::Verify;
use crate::config::{self, Config};
use crate::diagnostic::{Status, count};
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::placements::record::{PLACEMENT, PlacementFile};
use crate::formats::recheck::{self as formats, Check};
use crate::formats::robot_recheck::{self, HISTORY};
use crate::formats::robots::known;
use crate::identify::Error;
use crate::identify::data::dataset::Dataset;
use crate::identify::data::{still, targets};
use crate::identify::examine::on_rows::{self, OfKnown};
use crate::identify::examine::shifted;
use crate::identify::judge::locate::FEWEST_POSES;
use crate::identify::judge::recheck::{Before, Recheck, Stood, recheck};
use crate::measurements::{Measurement, Observed, Role};
use crate::report::robot_recheck::Judged;
use crate::robot::{self, Advice, Robot};
use crate::{progress, report};

pub fn run(args: &Verify, against: &Utf8Path, config: &Config, run: Run) -> Result<Outcome> {
    let (robot, check) = robot::file::read_checked(against)?;
    let before = known::before(against, &robot).ok_or_else(|| Error::NotKnown { path: against.to_string() })?;
    let source = source(args.measurements.clone(), &args.table, config);
    let mut rows = read(&source, &robot)?;
    // Nothing is fitted that rows could be kept from.
    rows.iter_mut().filter(|row| row.at.role == Role::Verify).for_each(|row| row.at.role = Role::Sample);
    check_joints(&robot, &rows, &args.measurements[0])?;
    let own = Own::among(&mut rows, against);
    let (set, is_mended) = mended(of_targets(&rows, against)?, &robot, before.p95_mm, config)?;
    let stood = stood(args.placement.as_deref(), against, &set)?;
    let placed = |group: &str| stood.as_ref()?.sensor_from_base(group, &robot.ends.root_from_frame0);
    let out = opened(args, against, config, run, &source.paths())?;
    out.check_free(&["verify.json", HISTORY, "verify.html"])?;
    let mut checks = formats::history(&out, HISTORY)?;

    let shift = shifted::find(&set, &robot).map(|shift| {
        format!("{}; mend the file first: else this looks like a change of the robot", shift.statement(&set))
    });
    let record = against.with_file_name("identification.json");
    let made_by = out.provenance();
    let whole = made_by.as_ref().and_then(|run| run.shares(&record)).filter(|_| own.rows == 0);
    let how = if own.rows > 0 && own.fitted == 0 { "judged when it was identified by" } else { "identified from" };
    let said = |same| format!("this robot was {how} {same}: only new poses tell whether it still is that robot");
    let of_own = own.statement().or(whole.map(str::to_owned)).map(said);
    let skipped = set.skipped.iter().map(|pose| format!("pose {} is not compared: {}", pose.pose, pose.reason));
    let beyond = beyond::ranges(against, &robot, &set, &set.rows(|_| true));
    let advised = check.as_ref().and_then(|check| check.warning(against));
    let warnings: Vec<String> =
        advised.into_iter().chain(is_mended.clone()).chain(shift).chain(of_own).chain(skipped).chain(beyond).collect();
    warnings.iter().for_each(progress::warn);
    // A change that is smaller than what the robot was off by anyway is none to act on.
    let tolerance_mm = args.tolerance_mm.unwrap_or(config.tolerance_mm.max(before.p95_mm));
    let found = Recheck { tolerance_mm, ..compared((&set, &robot), against, &before, &placed)? };
    let standing = robot_recheck::standing(&found, tolerance_mm, whole.is_some() || own.all);
    let content = robot_recheck::content(&found, standing, against, tolerance_mm);
    let date = out.provenance().map(|provenance| provenance.date).unwrap_or_default();
    checks.push(Check {
        date,
        against: against.to_string(),
        pairs: found.poses.len(),
        standing,
        cause: found.cause(),
        effect_mm: found.effect_mm,
        seen_mm: found.seen_mm,
        length_mm: None,
    });
    let advice = check.map_or(Advice::Use, |check| check.advice);
    let judged = Judged { standing, tolerance_mm, advice, is_mended: is_mended.is_some() };
    let page = report::robot_recheck::page(&found, judged, &checks, &warnings)?;
    let json = out.write_json("verify.json", &content)?;
    out.write(HISTORY, formats::to_csv(&checks, "poses").as_bytes())?;
    report::page::write(&out, "verify.html", page)?;
    let summary = || report::robot_recheck::summary(&found, judged, checks.len(), &out);
    let least = if is_mended.is_some() { Status::OutOfTolerance } else { advice.status() };
    let status = standing.status().or_worse(least);
    Ok(Outcome { stdout: if args.json { json } else { summary() }, status })
}

/// The results folder of a run that reads these files and the robot.
fn opened(args: &Verify, against: &Utf8Path, config: &Config, run: Run, paths: &[Utf8PathBuf]) -> Result<OutDir> {
    let placement = args.placement.as_deref();
    let inputs: Vec<&Utf8Path> = paths.iter().map(Utf8PathBuf::as_path).chain([against]).chain(placement).collect();
    let run = Run { force: args.force, ..run };
    Ok(OutDir::open(args.out.as_deref().unwrap_or(&config.out))?.for_run(&run, &inputs))
}

/// Where the sensor stood: as the file says that is named, which must have a group of these rows, or one beside the
/// robot, where it is there.
fn stood(named: Option<&Utf8Path>, against: &Utf8Path, set: &Dataset) -> Result<Option<PlacementFile>> {
    let path = named.map_or_else(|| against.with_file_name(PLACEMENT), Utf8Path::to_owned);
    let file = match PlacementFile::read(&path) {
        Ok(file) => file,
        Err(_) if named.is_none() => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    if file.mirrored != set.mirrored {
        let (placed, rows) = if file.mirrored { ("", " not") } else { (" not", "") };
        progress::warn(format!(
            "{path} is{placed} of points whose x was negated, and these are{rows}: where the sensor stands is not compared"
        ));
        return Ok(None);
    }
    let [placed, rows]: [Vec<&str>; 2] = [
        file.groups.iter().map(|group| group.group.as_str()).collect(),
        set.groups.iter().map(|group| group.name.as_str()).collect(),
    ];
    if named.is_none() || rows.iter().any(|name| placed.contains(name)) {
        return Ok(Some(file));
    }
    let problem =
        format!("--placement {path} is of group {}, and the rows are of {}", placed.join(", "), rows.join(", "));
    Err(config::Error::Invalid { problems: vec![problem] }.into())
}

/// The rows, whose targets stand where the robot's identification found them.
fn of_targets(rows: &[Measurement], against: &Utf8Path) -> std::result::Result<Dataset, Error> {
    match targets::of_places(rows, &known::places_mm(against)) {
        Some((rows, targets)) => Dataset::of_rows(&rows, Some(targets)),
        None => Dataset::new(rows),
    }
}

/// Whether the robot changed, or what measured it moved, by these rows. Where rows are outside of the ranges that it
/// was identified in, that is open where the other rows do not show it as well, and it is no more than what the model
/// may lack there: it goes where the terms beyond the links are as uncertain as they are large, or it is nothing single
/// or the zero of a joint that is outside, and no more than what was corrected of the robot.
fn compared(
    (set, robot): (&Dataset, &Robot),
    against: &Utf8Path,
    before: &Before,
    placed: Stood,
) -> std::result::Result<Recheck, Error> {
    // Held to the end: it says that this runs.
    let _step = progress::bar("comparing with the robot as it was", 0);
    let found = recheck(set, robot, before, placed)?;
    let Outside { joints, rows } = beyond::outside(against, robot, set, &set.rows(|_| true));
    let is_outside = |cause: &str| joints.iter().any(|(joint, _)| cause == format!("joint-{}", joint + 1));
    let is_unexplained = found.likeliest.is_empty() || found.scatters();
    let is_lacking = is_unexplained || found.likeliest.iter().any(|(cause, _)| is_outside(cause));
    let is_small = found.changed && is_lacking && found.effect_mm <= found.correction_mm;
    let outside: Vec<usize> = joints.iter().map(|(joint, _)| *joint).collect();
    let goes = || recheck(set, robot, &before.outside(&outside), placed).is_ok_and(|beyond| beyond.cause().is_empty());
    if found.cause().is_empty() || joints.is_empty() || !(is_small || goes()) {
        return Ok(found);
    }
    let inside = set.clone().without(&rows, "it is outside of the ranges that the robot was identified in");
    let enough = inside.placing_rows(FEWEST_POSES + 1).is_ok();
    let shows = |of_inside: Recheck| of_inside.changed || !found.changed && !of_inside.cause().is_empty();
    Ok(match enough && recheck(&inside, robot, before, placed).is_ok_and(shows) {
        true => found,
        false => Recheck { extrapolated: joints.into_iter().map(|(_, said)| said).collect(), ..found },
    })
}

/// The rows in the units, signs and columns that the robot has, and what was mended. Rows that it was identified from
/// are not known again in others.
fn mended(set: Dataset, robot: &Robot, p95_mm: f64, config: &Config) -> Result<(Dataset, Option<String>)> {
    still::check_points(&set, Some(robot))?;
    Ok(match on_rows::of_known(&set, robot, p95_mm, &config.identify) {
        Some(OfKnown { set, finding }) => (
            set,
            Some(format!(
                "{}; whether these rows are new, or rows of the identification in another form, cannot be told: only new ones say anything",
                finding.sentence()
            )),
        ),
        None => (set, None),
    })
}

/// Rows that the robot was identified from, among those that are to say whether it still is that robot.
struct Own {
    /// How many, of how many with a reading.
    rows: usize,
    of: usize,
    /// How many of them may have been fitted; the others were to verify it.
    fitted: usize,
    /// Whether the others are too few to judge by: then all rows are kept.
    all: bool,
}

impl Own {
    /// Takes them out where the others are enough.
    fn among(rows: &mut Vec<Measurement>, against: &Utf8Path) -> Own {
        let given = known::given(against);
        let read = |row: &&Measurement| !matches!(row.observed, Observed::Missing { .. });
        let (of, own) = (rows.iter().filter(read).count(), rows.iter().filter(|row| given.holds(row)).count());
        let fitted = rows.iter().filter(|row| given.fitted(row)).count();
        let others: Vec<Measurement> = rows.iter().filter(|row| !given.holds(row)).cloned().collect();
        let enough = of_targets(&others, against).is_ok_and(|set| set.placing_rows(FEWEST_POSES + 1).is_ok());
        if own > 0 && enough {
            *rows = others;
        }
        Own { rows: own, of, fitted, all: own > 0 && !enough }
    }

    fn statement(&self) -> Option<String> {
        let Own { rows, of, all, .. } = self;
        let left_out = if *all { "" } else { ", which are left out" };
        (*rows > 0).then(|| format!("{rows} of these {}{left_out}", count(*of, "row")))
    }
}
