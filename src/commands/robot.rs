//! `stereocal robot`: nominal robot files, and what they say in words.

use camino::Utf8Path;

use super::{Outcome, Result};
use crate::cli::{DhConvention, RobotCommand, RobotImport, RobotNew, RobotPlace, RobotShow, RobotWhat};
use crate::config::Config;
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::{dh_csv, urdf};
use crate::report::robot as report;
use crate::robot::catalogue::{self, Convention};
use crate::robot::{Error, Robot, file};

/// Runs the command.
pub fn run(args: &RobotCommand, config: &Config, run: Run) -> Result<Outcome> {
    let stdout = match &args.what {
        RobotWhat::Import(args) => import(args, config, run)?,
        RobotWhat::New(args) => new(args, config, run)?,
        RobotWhat::List => report::list(),
        RobotWhat::Show(args) => show(args)?,
    };
    Ok(Outcome { stdout, status: Status::Done })
}

fn import(args: &RobotImport, config: &Config, run: Run) -> Result<String> {
    let name = args.file.file_stem().unwrap_or("robot");
    let table = args.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    let robot = if table {
        dh_csv::read(&args.file, name, args.dh.into())?
    } else {
        let description = urdf::Urdf::read(&args.file)?;
        description.chain(args.tip.as_deref())?.robot(&description.name)
    };
    write(&robot, &args.place, config, run, &[&args.file])
}

fn new(args: &RobotNew, config: &Config, run: Run) -> Result<String> {
    let unknown = || Error::Unknown { name: args.name.clone(), nearest: most_similar(&args.name) };
    let robot = catalogue::robot(&args.name).ok_or_else(unknown)?;
    let text = write(&robot, &args.place, config, run, &[])?;
    let arm = catalogue::ARMS.iter().find(|arm| arm.name.eq_ignore_ascii_case(&args.name));
    Ok(text + &arm.map(report::provenance).unwrap_or_default())
}

fn write(robot: &Robot, place: &RobotPlace, config: &Config, run: Run, inputs: &[&Utf8Path]) -> Result<String> {
    let out = OutDir::open(place.out.as_deref().unwrap_or(&config.out))?;
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

/// The known name with the longest common run of letters, dashes left out.
fn most_similar(name: &str) -> String {
    let plain = |s: &str| s.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect::<String>();
    let wanted = plain(name);
    let common = |known: &str| {
        let known = plain(known);
        let ends = (0..wanted.len()).flat_map(|from| (from + 1..=wanted.len()).map(move |to| (from, to)));
        let runs = ends.filter(|&(from, to)| wanted.get(from..to).is_some_and(|part| known.contains(part)));
        (runs.map(|(from, to)| to - from).max().unwrap_or(0), std::cmp::Reverse(known.len()))
    };
    let names = catalogue::ARMS.iter().map(|arm| arm.name).chain([catalogue::PAPER]);
    names.max_by_key(|known| common(known)).unwrap_or(catalogue::PAPER).to_owned()
}

impl From<DhConvention> for Convention {
    fn from(typed: DhConvention) -> Convention {
        match typed {
            DhConvention::Classic => Convention::Classic,
            DhConvention::Modified => Convention::Modified,
        }
    }
}
