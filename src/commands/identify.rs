//! `stereocal identify`: measurements to kinematic parameters.

use camino::{Utf8Path, Utf8PathBuf};

use super::{Outcome, Result};
use crate::cli::{Identify, TableFlags};
use crate::config::Config;
use crate::files::OutDir;
use crate::files::provenance::{Digested, Provenance, Run};
use crate::formats::placements::record::{PLACEMENT, PlacementFile};
use crate::identify::data::dataset::Dataset;
use crate::identify::data::{known, shared, still};
use crate::identify::examine::{self, Examined};
use crate::identify::finding::Finding;
use crate::identify::judge::placement::Placed;
use crate::identify::record::{self, Advice, Findings, Record, quality};
use crate::identify::run::{Identification, identify, step_count};
use crate::identify::{Error, Method, Settings};
use crate::measurements::{Given, Measurement, Role, Source};
use crate::robot::file::IDENTIFIED_FILE as IDENTIFIED;
use crate::robot::{self, Robot};
use crate::{progress, report};

/// What `simulate` writes into the working directory.
const DEFAULT_ROBOT: &str = "robot.toml";

pub fn run(args: &Identify, config: &Config, run: Run) -> Result<Outcome> {
    let settings = settings(args, config);
    let out = args.output.out.clone().unwrap_or_else(|| config.out.clone());
    let default =
        if args.measurements.is_empty() { vec![out.join("measurements.csv")] } else { args.measurements.clone() };
    let source = source(default, &args.table, config);
    let file = robot_file(args.robot.as_deref());
    let given = nominal_robot(file.as_deref(), args.robot.is_some(), [&out, &config.out])?;
    let rows = read(&source, &given)?;
    let mut set = Dataset::of_robot(&rows, &given)?;
    still::check_points(&set, Some(&given))?;
    set.files = files(&source, &rows);
    [set.typed_angle, set.typed_unit] = source.typed_units();
    if let Some(path) = &args.known_distances {
        set.known = known::read(path, &set)?;
    }
    let (out, Measured { record, doubts: of_points }) = open(args, &out, run, &source.paths(), file.as_deref())?;
    if let Some(record) = &record {
        shared::take(record, &mut set);
    }
    shared::suppose_scale(&mut set);
    let as_read = set;
    let bar = progress::bar("identifying", 2 + step_count(&settings));
    let Examined { set, robot: nominal, along, findings, against, unexplained, .. } =
        examine::examine(&as_read, &given, &settings, &|step| bar.begin(step));
    if unexplained.is_some() {
        // What was mended on the way may have been mended because the cameras are on the hand.
        examine::in_hand::refuse(&as_read, &given)?;
        examine::in_hand::refuse(&set, &nominal)?;
    }
    let doubts = (unexplained.is_some(), along.robots.is_some());
    let (found, not_run) = search(&set, &nominal, &settings, args.seed, doubts, &bar)?;
    bar.finish_and_clear();
    let of_fit = record::findings::findings(&set, &found, &along);
    let mut findings = Findings::new(findings, (against, unexplained), of_fit, &along, &set, &found);
    findings.doubts.splice(0..0, of_points);
    let mut record = Record::new(&set, &nominal, &found, &along, findings, &settings, args.seed);
    record.warnings.extend(not_run.clone());
    record.not_run = not_run;
    record.rows = Given::new(&rows).with_mended(as_mended(&set));
    said(&record, &out, args.output.json);
    let placed = found.placed(&set, &nominal, &settings)?;
    let json = write(&out, &set, &nominal, &found, &record, placed.as_ref(), &settings)?;
    let stdout = if args.output.json {
        json
    } else {
        let identified = &found.candidates[found.chosen].robot;
        report::identify::summary(&record, (file.as_deref(), identified), placed.is_some(), &out)
    };
    let status = record.check().status();
    Ok(Outcome { stdout, status })
}

/// What was identified, and why not all methods were run.
///
/// Rows that no robot near the file's explains, as far as was seen, and rows of several robots get one method: the
/// others search the same neighbourhood, for longer where there is nothing to find, and change nothing of the verdict.
/// If the robot of that method explains rows that seemed to be unexplained, the others follow.
fn search(
    set: &Dataset,
    nominal: &Robot,
    settings: &Settings,
    seed: u64,
    (unexplained, several_robots): (bool, bool),
    bar: &progress::Step,
) -> std::result::Result<(Identification, Option<String>), Error> {
    let step = |step: &str| bar.begin(step);
    if settings.method.is_none() && (unexplained || several_robots) {
        let one = Settings { method: Some(Method::TrustRegion), ..settings.clone() };
        let found = identify(set, nominal, &one, seed, &step)?;
        if several_robots || !record::findings::is_explained(set, &found) {
            let not_run = "only trust-region was run: the other methods search the same neighbourhood of the robot file, and what speaks against \
                           the result would stay; `--method stapso` runs one of them all the same";
            return Ok((found, Some(not_run.to_owned())));
        }
        bar.lengthen(step_count(&one));
    }
    Ok((identify(set, nominal, settings, seed, &step)?, None))
}

/// The gravest warnings on the terminal; the page and the JSON have all. What the verdict says or stands beside the
/// method is not said again, unless that goes elsewhere.
fn said(record: &Record, out: &OutDir, is_json: bool) {
    const MOST: usize = 5;
    for (k, warning) in record.warnings.iter().take(MOST).enumerate() {
        match record.advice {
            _ if !is_json && (warning == record.whole_reason() || record.not_run.as_ref() == Some(warning)) => {}
            Advice::DoNotUse if k == 0 => progress::warn(format!("do not use the result: {warning}")),
            _ => progress::warn(warning),
        }
    }
    if record.warnings.len() > MOST {
        progress::warn(format!("{} more in {}", record.warnings.len() - MOST, out.join("identify.html")));
    }
}

/// What was typed beats the file.
fn settings(args: &Identify, config: &Config) -> Settings {
    let mut settings = config.identify.clone();
    match args.method.as_deref() {
        Some("auto") => settings.method = None,
        Some(name) => settings.method = Method::ALL.into_iter().find(|m| m.name() == name),
        None => {}
    }
    settings.model = args.model.or(settings.model);
    settings.constants = args.constants.or(settings.constants);
    settings.extensions = args.extensions.unwrap_or(settings.extensions);
    settings
}

/// The files with what is known of their columns: what was typed beats the settings.
pub fn source(files: Vec<Utf8PathBuf>, typed: &TableFlags, config: &Config) -> Source {
    let known = &config.measurements;
    Source {
        files,
        columns: typed.columns.clone().or_else(|| known.columns.clone()),
        units: typed.units.clone().or_else(|| known.units.clone()),
    }
}

/// Names of the tables of a run of several, by whose number its poses are named; a table that was joined of files has
/// that number alone.
fn files(source: &Source, rows: &[Measurement]) -> Vec<String> {
    let number = |row: &Measurement| row.at.pose.split_once(':').and_then(|(number, _)| number.parse::<usize>().ok());
    let last = rows.iter().map(number).try_fold(0, |last, number| Some(last.max(number?))).unwrap_or(0);
    let name = |number: usize| match source.files.len() == last {
        true => source.files[number - 1].file_name().unwrap_or(source.files[number - 1].as_str()).to_owned(),
        false => format!("table {number}"),
    };
    if source.files.len() > 1 { (1..=last).map(name).collect() } else { Vec::new() }
}

/// Measurements of a robot; says what was taken of tables that are not in the contract's own columns.
pub fn read(source: &Source, robot: &Robot) -> Result<Vec<Measurement>> {
    let (rows, said) = source.read(robot)?;
    let rows: Vec<Measurement> = rows.into_iter().map(Measurement::of_this_world).collect();
    said.into_iter().for_each(progress::note);
    if let Some(path) = source.files.first() {
        check_joints(robot, &rows, path)?;
    }
    Ok(rows)
}

/// Role, joints (deg, or mm) and point of each row.
fn as_mended(set: &Dataset) -> impl Iterator<Item = (Role, Vec<f64>, [f64; 3])> + '_ {
    let reading = |(j, q): (usize, &f64)| if set.is_sliding(j) { *q } else { q.to_degrees() };
    set.poses.iter().filter_map(move |pose| {
        let joints = pose.joints_rad.iter().enumerate().map(reading).collect();
        Some((pose.role, joints, pose.reading.point_mm()?.into()))
    })
}

/// What stands beside the measurements.
#[derive(Default)]
struct Measured {
    /// The `measure.json` that is about them.
    record: Option<Utf8PathBuf>,
    /// What speaks against them: that the rig beside them was calibrated again since, or what `measure` said of them.
    doubts: Vec<Finding>,
}

/// The results folder, once nothing is in the way of what will be written, and what stands beside the measurements.
fn open(
    args: &Identify,
    out: &Utf8Path,
    run: Run,
    measurements: &[Utf8PathBuf],
    robot: Option<&Utf8Path>,
) -> Result<(OutDir, Measured)> {
    let run = Run { force: args.output.force, ..run };
    let inputs: Vec<&Utf8Path> = measurements.iter().map(Utf8PathBuf::as_path).chain(robot).collect();
    let out = OutDir::open(out)?.for_run(&run, &inputs);
    out.check_free(&["identification.json", IDENTIFIED, PLACEMENT, "identify.html"])?;
    let measured = match measurements {
        [only] => check_calibration(&out, only),
        _ => Measured::default(),
    };
    Ok((out, measured))
}

/// The `measure.json` beside the measurements, where it is about them, and whether the calibration beside them is
/// another than the one that they were made with.
fn check_calibration(out: &OutDir, measurements: &Utf8Path) -> Measured {
    let folder = measurements.parent().unwrap_or(Utf8Path::new(""));
    let record = folder.join("measure.json");
    // Without provenance nothing says that they belong together but what they hold.
    let Some(measured_by) = Provenance::of_json(&record) else {
        return Measured { doubts: doubted(&record).into_iter().collect(), record: Some(record) };
    };
    let csv = Digested::read(measurements);
    if !csv.is_some_and(|csv| measured_by.outputs.iter().any(|output| output.sha256 == csv.sha256)) {
        return Measured::default();
    }
    let calibration = folder.join("calibration.json");
    let used = measured_by.inputs.last().zip(Digested::read(&calibration));
    let stale = used.filter(|(used, here)| !used.same_content(here)).map(|(Digested { file, .. }, _)| {
        let date = &measured_by.date;
        let said = format!("the measurements were made with another calibration than {calibration} ({file} of {date})");
        Finding::new(said, "run `stereocal measure` again")
    });
    out.measured_by(measured_by);
    Measured { doubts: stale.into_iter().chain(doubted(&record)).collect(), record: Some(record) }
}

/// What a `measure.json` says against its own points.
fn doubted(record: &Utf8Path) -> Option<Finding> {
    let said: serde_json::Value = serde_json::from_slice(&std::fs::read(record).ok()?).ok()?;
    let doubt = said["rig"]["doubt"].as_str()?;
    let act = "measure the squares of both boards, and run again what was told another size";
    Some(Finding::new(format!("{doubt} (`measure`, {record})"), act))
}

/// The robot file that is named, or `robot.toml` in the working directory where it is there.
pub fn robot_file(path: Option<&Utf8Path>) -> Option<Utf8PathBuf> {
    path.or_else(|| Some(Utf8Path::new(DEFAULT_ROBOT)).filter(|file| file.is_file())).map(Utf8Path::to_owned)
}

/// The robot of a file, or where there is none that of the paper; another may lie in a results folder.
fn nominal_robot(file: Option<&Utf8Path>, named: bool, results: [&Utf8Path; 2]) -> Result<Robot> {
    let Some(file) = file else {
        let there = results.map(|folder| folder.join(DEFAULT_ROBOT)).into_iter().find(|file| file.is_file());
        let there = there.map_or(String::new(), |file| format!("; `--robot {file}` takes the one that is there"));
        progress::warn(format!(
            "the nominal robot is taken to be that of Table 1 of the paper: no --robot, and no robot.toml in this folder{there}"
        ));
        return Ok(Robot::paper());
    };
    if !named {
        progress::note(format!("nominal robot: {file}"));
    }
    Ok(robot::file::read(file)?)
}

/// Whether the measurements are of a robot with these joints.
pub fn check_joints(robot: &Robot, rows: &[Measurement], path: &Utf8Path) -> Result<()> {
    let measured = rows.first().map_or(0, |r| r.at.joints_deg.len());
    if measured != robot.joints.len() {
        let place = path.to_string();
        let column = |joint: &robot::Joint| format!("j{}_{}", measured + 1, if joint.slides { "mm" } else { "deg" });
        let missing = robot.joints.get(measured).map(column);
        return Err(Error::JointCount { robot: robot.joints.len(), measurements: measured, missing, place }.into());
    }
    let slides = rows.first().map_or(&[][..], |r| &r.at.slides);
    let differs = |i: &usize| slides.get(*i).copied().unwrap_or(false) != robot.joints[*i].slides;
    if let Some(joint) = (0..measured).find(differs) {
        let (slides, place) = (robot.joints[joint].slides, path.to_string());
        return Err(Error::JointKind { joint: joint + 1, slides, place }.into());
    }
    Ok(())
}

fn write(
    out: &OutDir,
    set: &Dataset,
    nominal: &Robot,
    found: &Identification,
    record: &Record,
    placed: Option<&Placed>,
    settings: &Settings,
) -> Result<String> {
    let identified = &found.candidates[found.chosen].robot;
    let errors = |robot: &Robot, fitted: bool| quality(set, robot, fitted, found, settings).1;
    let is_fitted = found.candidates[found.chosen].found.is_some();
    let places: Vec<_> = set.poses.iter().map(|p| (p.role, nominal.target_mm(&p.joints_rad))).collect();
    let center = set.poses.iter().find(|p| p.role == Role::Center).or(set.poses.first());
    let arm = center.map_or_else(Vec::new, |p| nominal.skeleton_mm(&p.joints_rad));
    let after = errors(identified, is_fitted);
    let check = record.check();
    let mut placement = PlacementFile::new(IDENTIFIED, set, placed, &after);
    placement.check = Some(check.clone());
    let page = report::identify::page(set, record, &placement, &places, &arm, &errors(nominal, false), &after)?;
    let mut holds = record.expected.as_ref().map_or_else(
        || "The nominal robot was kept.".to_owned(),
        |expected| format!("{}; {}; it holds within {}.", robot::file::IDENTIFIED, expected.sentence(), expected.poses),
    );
    if record.advice == Advice::DoNotUse {
        holds = format!("Do not use this robot: {}.", record.reason);
    }
    let scale = record.scale.filter(|_| record.advice != Advice::DoNotUse);
    let scale = scale.map_or(String::new(), |scale| format!("# Not in this: {}.\n", scale.sentence()));
    let toml = robot::file::to_toml_checked(identified, Some(&check));
    out.write_toml(IDENTIFIED, &format!("# {holds}\n{scale}{toml}"))?;
    let json = out.write_json("identification.json", record)?;
    out.write_json(PLACEMENT, &placement)?;
    report::page::write(out, "identify.html", page)?;
    Ok(json)
}
