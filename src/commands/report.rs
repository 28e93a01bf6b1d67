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

/// Runs the command.
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

/// Where a result was made of other files than those that stand in the folder now, as far as the results say what they were made of.
fn breaks(folder: &Utf8Path) -> Vec<String> {
    let provenance = |name: &str| Provenance::of_json(&folder.join(name));
    let now = |name: &str| Digested::read(&folder.join(name));
    let mut breaks = Vec::new();
    let mut compare = |then: Option<Digested>, name: &str, of: &str, command: &str| {
        if let (Some(then), Some(now)) = (then, now(name))
            && !then.same_content(&now)
        {
            breaks.push(format!(
                "{of} was made with another {name} than the one in {folder}: run `stereocal {command}` again"
            ));
        }
    };
    let named = |list: Vec<Digested>, name: &str| list.into_iter().find(|file| file.file.ends_with(name));
    let written = provenance("camera-check.json").and_then(|p| named(p.outputs, "calibration.json"));
    compare(written, "calibration.json", "camera-check.json", "camera-check");
    let used = provenance("measure.json").and_then(|p| named(p.inputs, "calibration.json"));
    compare(used, "calibration.json", "measure.json", "measure");
    let fitted = provenance("identification.json").and_then(|p| named(p.inputs, "measurements.csv"));
    compare(fitted, "measurements.csv", "identification.json", "identify");
    let results = [("camera-check.json", "camera-check"), ("measure.json", "measure")];
    breaks.extend(results.into_iter().flat_map(|(name, command)| {
        let inputs = provenance(name).map(|made| made.inputs).unwrap_or_default();
        let changed =
            inputs.into_iter().filter(|input| !Utf8Path::new(&input.file).starts_with(folder) && input.is_other_now());
        changed
            .map(move |input| {
                format!("{} changed since {name} was made of it: run `stereocal {command}` again", input.file)
            })
            .collect::<Vec<_>>()
    }));
    breaks
}
