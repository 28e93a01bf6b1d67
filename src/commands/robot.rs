//! `stereocal robot`: nominal robot files, and what they say in words.

use camino::Utf8Path;
use nalgebra::Point3;

use super::{Outcome, Result};
use crate::cli::{DhConvention, RobotImport, RobotNew, RobotPlace, RobotShow, RobotWhat};
use crate::config::Config;
use crate::diagnostic::{Explain, Status};
use crate::files::provenance::Run;
use crate::files::{self, OutDir};
use crate::formats::robots::{dh_csv, ros_kinematics, urdf};
use crate::measurements::{Measurement, Observed, Source, is_not_near};
use crate::progress;
use crate::report::robot as report;
use crate::robot::catalogue::{self, Convention, names};
use crate::robot::tool_fit::Start;
use crate::robot::{Error, Robot, file};
use crate::tables::names::Unit;

pub fn run(what: &RobotWhat, config: &Config, run: Run) -> Result<Outcome> {
    let stdout = match what {
        RobotWhat::Import(args) => import(args, config, run)?,
        RobotWhat::New(args) => new(args, config, run)?,
        RobotWhat::List => report::list(),
        RobotWhat::Show(args) => show(args)?,
    };
    Ok(Outcome { stdout, status: Status::Done })
}

fn import(args: &RobotImport, config: &Config, run: Run) -> Result<String> {
    let name = args.file.file_stem().unwrap_or("robot");
    let description =
        args.file.extension().is_some_and(|e| ["urdf", "xml", "xacro"].iter().any(|u| e.eq_ignore_ascii_case(u)));
    let robot = if description {
        let description = urdf::Urdf::read(&args.file)?;
        description.chain(args.tip.as_deref())?.robot(&description.name)
    } else {
        match ros_kinematics::read(&args.file, name)? {
            Some(robot) => robot,
            None => table(args, name)?,
        }
    };
    write(&robot, &args.place, config, run, &[&args.file])
}

/// How many times nearer to the measurements one way to read a table must come than the others.
const CLEAR: f64 = 4.0;

/// A way to read a table.
type Way<'a> = (&'a dh_csv::Reading, Convention);

fn refuse(args: &RobotImport, message: String, hint: &str) -> Error {
    Error::Table { message, place: args.file.to_string(), hint: hint.to_owned() }
}

/// The robot of the way that is taken for a reason, unless it leaves a unit open.
fn take(args: &RobotImport, name: &str, (reading, convention): Way, why: &str) -> Result<Robot> {
    if let Some(open) = &reading.open {
        return Err(refuse(args, format!("{} ({})", open.message, reading.said), open.hint).into());
    }
    progress::note(format!("{}: {}, {} convention ({why})", args.file, reading.said, convention.name()));
    reading.offsets.iter().for_each(|said| progress::note(format!("{}: {said}", args.file)));
    reading.ends_said.iter().for_each(|said| progress::warn(format!("{}: {said}", args.file)));
    Ok(reading.robot(name, convention))
}

/// The robot of a table: of several ways to read it the one that fits the measurements.
fn table(args: &RobotImport, name: &str) -> Result<Robot> {
    let units: Vec<Unit> = args.units.iter().flat_map(|u| u.split(',')).filter_map(Unit::of).collect();
    let of = |angle: bool| units.iter().copied().find(|unit| unit.is_angle() == angle);
    let asked = dh_csv::Asked { columns: args.columns.as_deref(), units: [of(true), of(false)] };
    let readings = dh_csv::readings(&args.file, &asked)?;
    let conventions = |reading: &dh_csv::Reading| match (args.dh, reading.convention()) {
        (Some(typed), _) => vec![typed.into()],
        // Measurements are heard before what the table's ends show.
        (None, (Some(shown), _)) if args.measurements.is_empty() => vec![shown],
        _ => vec![Convention::Modified, Convention::Classic],
    };
    let ways: Vec<Way> = readings
        .iter()
        .flat_map(|r| conventions(r).into_iter().map(move |c| (r, c)))
        .filter(|(r, c)| !(r.is_modified() && *c == Convention::Classic))
        .collect();
    match &ways[..] {
        [] => {
            let message = "beta_deg stands beside alpha and a of a modified table".to_owned();
            return Err(refuse(args, message, "`--dh modified` reads it").into());
        }
        [way] => {
            let why = if args.dh.is_some() { "--dh says so".to_owned() } else { way.0.convention().1 };
            return take(args, name, *way, &why);
        }
        _ if args.measurements.is_empty() => return Err(open(args, &readings, &ways).into()),
        _ => {}
    }
    by_readings(args, name, &ways)
}

/// What a table leaves open, with the flags that say it.
fn open(args: &RobotImport, readings: &[dh_csv::Reading], ways: &[Way]) -> Error {
    if readings.len() > 1 {
        let orders: Vec<String> = readings.iter().map(|r| format!("`--columns {}`", r.columns)).collect();
        let message = "the columns have no names, and more than one order could be".to_owned();
        let hint = format!(
            "{}, or another order of these, says which; `--measurements FILE` lets the readings decide",
            orders.join(" or ")
        );
        return refuse(args, message, &hint);
    }
    let why = ways.first().map_or(String::new(), |(r, _)| format!(": {} ({})", r.convention().1, r.said));
    let message = format!(
        "whether alpha and a of a row stand before the joint or behind it is open, and the table could be either{why}"
    );
    let hint = "`--dh modified` (Craig: before) or `--dh classic` (Denavit and Hartenberg: behind) says which; `--measurements FILE` lets the readings decide";
    refuse(args, message, hint)
}

/// The way to read a table that measurements of the robot decide for.
fn by_readings(args: &RobotImport, name: &str, ways: &[Way]) -> Result<Robot> {
    let source = Source { files: args.measurements.clone(), ..Source::default() };
    let mut left: Vec<(f64, Way)> = Vec::new();
    let mut unread = Vec::new();
    for way in ways {
        let robot = way.0.robot(name, way.1);
        match source.read(&robot) {
            Ok((rows, _)) => left.extend(left_mm(&robot, &rows).map(|left| (left, *way))),
            Err(error) => unread.push(error),
        }
    }
    left.sort_by(|a, b| a.0.total_cmp(&b.0));
    // With a wrong way nothing is near; what is said with the right one is what the measurements leave open.
    let unread = unread.iter().find(|error| !is_not_near(error));
    match &left[..] {
        [] if let Some(error) = unread => {
            let place = error.place().unwrap_or_else(|| args.file.to_string());
            let message = format!("the measurements cannot be read yet: {error}");
            let hint = "leave in the measurements the joints and the measured points alone, or `--dh` and `--columns` read the table without them";
            Err(Error::Table { message, place, hint: hint.to_owned() }.into())
        }
        [] => {
            let message = "no way to read the table comes near to the measurements".to_owned();
            let hint = "see whether they are of one robot; `--dh` and `--columns` read the table without them";
            Err(refuse(args, message, hint).into())
        }
        [best, next, ..] if next.0 < CLEAR * best.0 => {
            let way =
                |(left, (r, c)): &(f64, Way)| format!("`--dh {} --columns {}` ({left:.2} mm)", c.name(), r.columns);
            let message = "more than one way to read the table fits the measurements".to_owned();
            Err(refuse(args, message, &format!("{} or {} says which", way(best), way(next))).into())
        }
        [best, ..] => take(args, name, best.1, &format!("it leaves {:.2} mm of the measurements", best.0)),
    }
}

/// The joints, rad, and the measured points of one placement.
type Placement = (Vec<Vec<f64>>, Vec<Point3<f64>>);

/// What a robot leaves of the measured points of the placement that has most of them, its tool and the sensor solved
/// for, mm; `None` where it does not fit them.
fn left_mm(robot: &Robot, rows: &[Measurement]) -> Option<f64> {
    let mut groups: std::collections::BTreeMap<&str, Placement> = std::collections::BTreeMap::new();
    for row in rows.iter().filter(|row| row.target == rows[0].target) {
        if let Observed::Position { point_mm, .. } = row.observed {
            let group = groups.entry(&row.at.group).or_default();
            group.0.push(row.at.joints_rad());
            group.1.push(point_mm);
        }
    }
    let (joints, points) = groups.into_values().max_by_key(|(joints, _)| joints.len())?;
    (joints.first()?.len() == robot.joints.len())
        .then(|| robot.fit_tool(&joints, &points, Start::Around))?
        .map(|fit| fit.left_mm)
}

fn new(args: &RobotNew, config: &Config, run: Run) -> Result<String> {
    let unknown = || Error::Unknown { name: args.name.clone(), nearest: most_similar(&args.name) };
    let name = match names::meant(&args.name)[..] {
        [] => return Err(unknown().into()),
        [name] => name,
        _ => return Err(Error::Ambiguous { name: args.name.clone(), candidates: names::meant(&args.name) }.into()),
    };
    let robot = catalogue::robot(name).ok_or_else(unknown)?;
    if name != args.name {
        progress::note(format!("`{}` is {name}", args.name));
    }
    let text = write(&robot, &args.place, config, run, &[])?;
    let arm = catalogue::ARMS.iter().find(|arm| arm.name == name);
    Ok(text + &arm.map(report::provenance).unwrap_or_default())
}

fn write(robot: &Robot, place: &RobotPlace, config: &Config, run: Run, inputs: &[&Utf8Path]) -> Result<String> {
    let folder = place.out.as_deref().unwrap_or(&config.out);
    if folder.extension() == Some("toml") && !folder.is_dir() {
        let message = "results go into a folder, and this is the name of a file".to_owned();
        let hint = format!(
            "the robot's file in it is called robot.toml: `--out {0}` writes {0}/robot.toml",
            folder.with_extension("")
        );
        return Err(files::Error::format(folder, None, message, Some(&hint)).into());
    }
    let out = OutDir::open(folder)?;
    let path = out.join("robot.toml");
    if path.exists() && !place.force {
        return Err(Error::Occupied { path: path.to_string() }.into());
    }
    let out = out.for_run(&Run { force: place.force, ..run }, inputs);
    out.write_toml("robot.toml", &file::to_toml(robot))?;
    Ok(format!("{path}\n{}", report::chain(robot)))
}

fn show(args: &RobotShow) -> Result<String> {
    let robot = file::read(Utf8Path::new(&args.file))?;
    let zero = vec![0.0; robot.joints.len()];
    let joints_deg = if args.joints.is_empty() { &zero } else { &args.joints };
    if joints_deg.len() != robot.joints.len() {
        return Err(Error::AngleCount { found: joints_deg.len(), needed: robot.joints.len() }.into());
    }
    Ok(format!("{}\n{}", report::chain(&robot), report::pose(&robot, joints_deg)))
}

/// The known name with the longest common run of letters, dashes left out, where that is most of the name.
fn most_similar(name: &str) -> Option<String> {
    let plain = |s: &str| s.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect::<String>();
    let wanted = plain(name);
    let common = |known: &str| {
        let known = plain(known);
        let ends = (0..wanted.len()).flat_map(|from| (from + 1..=wanted.len()).map(move |to| (from, to)));
        let runs = ends.filter(|&(from, to)| wanted.get(from..to).is_some_and(|part| known.contains(part)));
        (runs.map(|(from, to)| to - from).max().unwrap_or(0), std::cmp::Reverse(known.len()))
    };
    let names = catalogue::ARMS.iter().map(|arm| arm.name).chain([catalogue::PAPER]);
    let nearest = names.max_by_key(|known| common(known))?;
    let run = common(nearest).0;
    (run >= 3 && 2 * run > wanted.len()).then(|| nearest.to_owned())
}

impl From<DhConvention> for Convention {
    fn from(typed: DhConvention) -> Convention {
        match typed {
            DhConvention::Classic => Convention::Classic,
            DhConvention::Modified => Convention::Modified,
        }
    }
}
