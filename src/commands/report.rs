//! `stereocal report`: camera check, measurements and robot of a results folder on one page.

use camino::Utf8Path;
use serde_json::Value;

use super::heed::changed_since;
use super::{Outcome, Result};
use crate::cli::Report;
use crate::config::Config;
use crate::diagnostic::Status;
use crate::files::provenance::{Digested, Provenance, Run};
use crate::files::{self, OutDir};
use crate::progress;
use crate::report::{self, day::Day};

pub fn run(args: &Report, config: &Config, run: Run) -> Result<Outcome> {
    let folder = args.out.as_deref().unwrap_or(&config.out);
    let parts = ["camera-check.json", "measure.json", "identification.json"].map(|name| folder.join(name));
    let [check, measured, robot] = [read(&parts[0])?, read(&parts[1])?, read(&parts[2])?];
    if check.is_none() && measured.is_none() && robot.is_none() {
        let hint = "`stereocal camera-check IMAGES`, `measure POSES` and `identify` write what is reported; `--out DIR` names their folder";
        return Err(files::Error::Missing { what: "results", path: folder.to_owned(), hint: Some(hint.into()) }.into());
    }
    let out = OutDir::open(folder)?;
    let there: Vec<&Utf8Path> = parts.iter().filter(|path| path.is_file()).map(|path| path.as_path()).collect();
    let out = out.for_run(&Run { force: args.force, ..run }, &there);
    out.check_free(&["report.html"])?;
    let breaks: Vec<String> = breaks(folder).into_iter().chain(changed(folder)).collect();
    breaks.iter().for_each(progress::warn);
    let day = Day { check, measured, robot, breaks };
    report::page::write(&out, "report.html", report::day::page(&day))?;
    let status = if day.is_good() { Status::Done } else { Status::OutOfTolerance };
    Ok(Outcome { stdout: report::day::summary(&day, &out), status })
}

/// A result of an earlier command; `None` where it is not there.
fn read(path: &Utf8Path) -> Result<Option<Value>> {
    if path.is_file() { Ok(Some(files::read_json(path, "result", None)?)) } else { Ok(None) }
}

/// What a check of the rig or of the robot that was made since then says against it.
fn changed(folder: &Utf8Path) -> Vec<String> {
    let rig = changed_since(&folder.join("calibration.json"), "recheck.json");
    rig.into_iter().chain(changed_since(&folder.join("identified.toml"), "verify.json")).collect()
}

/// Where a result was made of other files than those that stand in the folder now, as far as the results say what they
/// were made of.
fn breaks(folder: &Utf8Path) -> Vec<String> {
    type Files = fn(Provenance) -> Vec<Digested>;
    let files = |result: &str, of: Files| Provenance::of_json(&folder.join(result)).map(of).unwrap_or_default();
    let compared: [(&str, Files, &str, &str); 3] = [
        ("camera-check.json", |run| run.outputs, "calibration.json", "camera-check"),
        ("measure.json", |run| run.inputs, "calibration.json", "measure"),
        ("identification.json", |run| run.inputs, "measurements.csv", "identify"),
    ];
    let mut breaks = Vec::new();
    for (result, of, name, command) in compared {
        let then = files(result, of).into_iter().find(|file| file.file.ends_with(name));
        let now = Digested::read(&folder.join(name));
        if then.zip(now).is_some_and(|(then, now)| !then.same_content(&now)) {
            breaks.push(format!(
                "{result} was made with another {name} than the one in {folder}: run `stereocal {command}` again"
            ));
        }
    }
    for (result, command) in [("camera-check.json", "camera-check"), ("measure.json", "measure")] {
        let elsewhere = |input: &Digested| !Utf8Path::new(&input.file).starts_with(folder);
        for input in files(result, |run| run.inputs) {
            if elsewhere(&input) && input.is_other_now() {
                let file = input.file;
                breaks.push(format!("{file} changed since {result} was made of it: run `stereocal {command}` again"));
            }
        }
    }
    breaks
}
