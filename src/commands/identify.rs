//! `stereocal identify`: measurements to kinematic parameters.

use camino::{Utf8Path, Utf8PathBuf};

use super::Outcome;
use crate::cli::Identify;
use crate::config::Config;
use crate::error::{Result, Status};
use crate::files::{self, OutDir};
use crate::identify::choose::{Identification, identify};
use crate::identify::dataset::Dataset;
use crate::identify::record::{Record, quality};
use crate::identify::{Error, Settings, sessions};
use crate::measurements::{self, Measurement};
use crate::progress;
use crate::report::identify as report;
use crate::robot::{self, Robot};

/// What `simulate` writes into the working directory.
const DEFAULT_ROBOT: &str = "robot.toml";

/// Runs the command.
pub fn run(args: &Identify, config: &Config) -> Result<Outcome> {
    let settings = settings(args, config);
    let out = args.output.out.clone().unwrap_or_else(|| config.out.clone());
    let path = args.measurements.clone().unwrap_or_else(|| out.join("measurements.csv"));
    let rows = measurements::read(&path)?;
    let nominal = nominal_robot(args.robot.as_deref())?;
    check_joints(&nominal, &rows, &path)?;
    let (set, sessions) = sessions::find(&Dataset::new(&rows, args.seed)?, &nominal, &settings)?;
    let out = OutDir::open(&out)?;

    let bar = progress::bar("identifying", 0);
    let found = identify(&set, &nominal, &settings, args.seed, &|step| bar.set_message(step.to_owned()))?;
    bar.finish_and_clear();

    let record = Record::new(&set, &nominal, &found, &sessions, &settings, args.seed);
    for warning in &record.warnings {
        progress::warn(warning);
    }
    write(&out, &set, &nominal, &found, &record, &settings)?;
    let stdout = if args.output.json { files::to_json(&record) } else { report::summary(&record) };
    Ok(Outcome { stdout, status: Status::Done })
}

/// What was typed beats the file.
fn settings(args: &Identify, config: &Config) -> Settings {
    let mut settings = config.identify.clone();
    match args.method.as_deref() {
        Some("auto") => settings.method = None,
        Some(name) => settings.method = crate::identify::Method::ALL.into_iter().find(|m| m.name() == name),
        None => {}
    }
    settings.model = args.model.or(settings.model);
    settings.constants = args.constants.or(settings.constants);
    settings.extensions = args.extensions.unwrap_or(settings.extensions);
    settings
}

fn nominal_robot(path: Option<&Utf8Path>) -> Result<Robot> {
    if let Some(path) = path {
        return robot::file::read(path);
    }
    let default = Utf8PathBuf::from(DEFAULT_ROBOT);
    if default.is_file() {
        progress::note(format!("nominal robot: {default}"));
        return robot::file::read(&default);
    }
    progress::note("nominal robot: Table 1 of the paper (no --robot, and no robot.toml here)");
    Ok(Robot::paper())
}

fn check_joints(robot: &Robot, rows: &[Measurement], path: &Utf8Path) -> Result<()> {
    let measured = rows.first().map_or(0, |r| r.at.joints_deg.len());
    if measured != robot.joints.len() {
        let place = path.to_string();
        return Err(Error::JointCount { robot: robot.joints.len(), measurements: measured, place }.into());
    }
    Ok(())
}

fn write(
    out: &OutDir,
    set: &Dataset,
    nominal: &Robot,
    found: &Identification,
    record: &Record,
    settings: &Settings,
) -> Result<()> {
    let identified = &found.candidates[found.chosen].robot;
    let errors = |robot: &Robot| quality(set, robot, found, settings).1;
    let places: Vec<_> = set.poses.iter().map(|p| (p.role, nominal.target_mm(&p.joints_rad))).collect();
    let page = report::page(set, record, &places, &errors(nominal), &errors(identified))?;
    out.write_json("identification.json", record)?;
    out.write("identified.toml", robot::file::to_toml(identified).as_bytes())?;
    out.write("identify.html", page.as_bytes())
}
