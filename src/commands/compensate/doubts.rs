//! Targets that are hardly what was meant: corrected already, or in another unit.

use camino::Utf8Path;

use super::super::Result;
use crate::compensate::Target;
use crate::config;
use crate::files::provenance::{Digested, Provenance};
use crate::formats::targets::Row;
use crate::progress;
use crate::robot::{Robot, file};

/// Refuses targets that `compensate` itself wrote, which would be corrected twice: known by the hash in the `compensate.json` beside them.
pub(super) fn refuse_corrected(targets: &Utf8Path) -> Result<()> {
    let folder = targets.parent().unwrap_or(Utf8Path::new(""));
    let above = folder.parent().unwrap_or(Utf8Path::new(".."));
    let written_by = |folder: &Utf8Path| Provenance::of_json(&folder.join("compensate.json"));
    let hash = Digested::read(targets).map(|digested| digested.sha256);
    let wrote = |run: &Provenance| run.outputs.iter().any(|output| Some(&output.sha256) == hash.as_ref());
    let Some(run) = [folder, above].into_iter().filter_map(written_by).find(wrote) else { return Ok(()) };
    Err(config::Error::Usage {
        message: format!("{targets} is what `compensate` wrote ({}): its targets are corrected already", run.date),
        hint: format!("give the targets as they were written for the nominal robot; that run was `{}`", run.command),
    }
    .into())
}

/// That both robots are ones that `identify` found, and the second was not found from the first.
pub(super) fn of_nominal(robot: &Utf8Path, identified: &Utf8Path) -> Option<String> {
    if !file::is_identified(robot) || !file::is_identified(identified) {
        return None;
    }
    let made_by = Provenance::of_json(&identified.with_file_name("identification.json"));
    let here = Digested::read(robot)?;
    let is_made_of = made_by.is_some_and(|run| run.inputs.iter().any(|input| input.sha256 == here.sha256));
    (!is_made_of).then(|| {
        format!(
            "--robot {robot} is itself a robot that `identify` found, and {identified} was not identified from it: the targets are taken as written \
             for it; where they were written for the nominal robot, `--robot` names the file that `identify` was given"
        )
    })
}

/// Warns of joint targets that look like radians in degrees, and of joints that have no limits.
pub(super) fn warn(rows: &[Row], robot: &Robot) {
    let turning = |row: &Row| -> Option<Vec<f64>> {
        let readings = row.given.as_ref().filter(|_| matches!(row.target, Target::Readings(_)))?;
        Some(readings.iter().zip(&robot.joints).filter(|(_, joint)| !joint.slides).map(|(q, _)| *q).collect())
    };
    let largest_deg = |readings: &Vec<f64>| readings.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
    let largest: Vec<f64> = rows.iter().filter_map(turning).map(|readings| largest_deg(&readings)).collect();
    let most_deg = largest.iter().fold(0.0_f64, |most, q| most.max(*q));
    // A turn is 6.28 rad. An arm that moves a tool turns some joint by more than as many degrees; its zero posture alone says nothing.
    if most_deg > 0.0 && most_deg <= std::f64::consts::TAU {
        progress::warn(format!(
            "no joint of these targets is farther than {most_deg:.3} deg from zero: are they radians? A table says so by columns `j1_rad`.."
        ));
    }
    let open = robot.joints_without_limits();
    if !open.is_empty() {
        progress::note(format!(
            "the robot file has no limits of joint {}: two turns either way are taken where a joint turns; `limits_deg` (`limits_mm`) says what \
             the real arm can",
            open.join(", ")
        ));
    }
}
