//! What a file's own words advise against, said to whoever uses it.

use camino::Utf8Path;

use crate::diagnostic::Status;
use crate::files::provenance::{Digested, Provenance};
use crate::formats::calibration::Calibrated;
use crate::formats::recheck::{CheckedAgainst, Standing};
use crate::progress;
use crate::robot::Check;

/// Warns of what a robot's or a placement's own file says of its use; with which status a command that uses it ends at
/// best.
pub fn heed(check: Option<&Check>, file: &Utf8Path) -> Status {
    check.and_then(|check| check.warning(file)).into_iter().for_each(progress::warn);
    let changed = changed_since(file, "verify.json");
    changed.iter().for_each(progress::warn);
    let advised = check.map_or(Status::Done, Check::status);
    if changed.is_some() { Status::OutOfTolerance } else { advised }
}

/// What speaks against a rig.
pub struct RigDoubts {
    pub said: Vec<String>,
    /// With which status a command ends at best that states the uncertainty of what it makes with the rig: of a rig
    /// that did not pass it states more, of one that changed too little.
    pub status: Status,
    /// The same of a command that states none.
    pub status_without_uncertainty: Status,
}

/// Warns of what a rig's own calibration says against it, and a check that was made of it since.
pub fn heed_rig(rig: &Calibrated, file: &Utf8Path) -> RigDoubts {
    let changed = changed_since(file, "recheck.json");
    let status = if changed.is_some() { Status::OutOfTolerance } else { Status::Done };
    let said: Vec<String> = changed.into_iter().chain(rig.doubts()).collect();
    said.iter().for_each(progress::warn);
    let failed = if rig.has_failed() { Status::OutOfTolerance } else { Status::Done };
    RigDoubts { said, status, status_without_uncertainty: status.or_worse(failed) }
}

/// What the last check beside a result's file says against it, if it was of that very result.
pub fn changed_since(file: &Utf8Path, check: &str) -> Option<String> {
    let (path, result) = (file.with_file_name(check), file.file_name()?);
    let checked: CheckedAgainst = serde_json::from_slice(&std::fs::read(&path).ok()?).ok()?;
    let now = Digested::read(file)?.sha256;
    let is_of_it = Provenance::of_json(&path)?.inputs.iter().any(|input| input.sha256 == now);
    let changed = matches!(checked.standing, Standing::Changed | Standing::ChangedWithin);
    (is_of_it && changed).then(|| format!("{result} no longer holds by {path}: {}", checked.statement))
}
