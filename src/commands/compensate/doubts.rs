//! Targets that are hardly what was meant: corrected already, in another unit, or in a language that is not read.

use std::collections::BTreeSet;

use camino::{Utf8Path, Utf8PathBuf};

use super::super::Result;
use crate::compensate::{Compensated, Target};
use crate::files::provenance::{Digested, Provenance};
use crate::formats::targets::Row;
use crate::programs::{Language, unread};
use crate::robot::{Robot, file};
use crate::tables::names::Unit;
use crate::{config, files, progress};

/// Refuses targets that `compensate` itself wrote, which would be corrected twice: known by the hash in the
/// `compensate.json` beside them, in one of these folders, or in a folder beside any of these or of the working
/// directory, where they are a copy.
pub(super) fn refuse_corrected(targets: &Utf8Path, folders: &[&Utf8Path]) -> Result<()> {
    let here = |folder: &Utf8Path| if folder.as_str().is_empty() { Utf8PathBuf::from(".") } else { folder.to_owned() };
    let folder = here(targets.parent().unwrap_or(Utf8Path::new("")));
    let above =
        if folder == "." { Utf8PathBuf::from("..") } else { here(folder.parent().unwrap_or(Utf8Path::new(""))) };
    let near = [folder, above, Utf8PathBuf::from(".")].into_iter().chain(folders.iter().map(|folder| here(folder)));
    let near: BTreeSet<Utf8PathBuf> = near.collect();
    let below = |folder: &Utf8PathBuf| folder.read_dir_utf8().into_iter().flatten().flatten().map(|e| e.into_path());
    let all = near.iter().cloned().chain(near.iter().flat_map(below));
    let given = Digested::read(targets);
    // Of a run that changed nothing both are one.
    let wrote = |run: &Provenance| holds(&run.outputs, given.as_ref()) && !holds(&run.inputs, given.as_ref());
    let mut runs = all.filter_map(|folder| Provenance::of_json(&folder.join("compensate.json")));
    let Some(run) = runs.find(wrote) else { return Ok(()) };
    Err(config::Error::Usage {
        message: format!("{targets} is what `compensate` wrote ({}): its targets are corrected already", run.date),
        hint: format!("give the targets as they were written for the nominal robot; that run was `{}`", run.command),
    }
    .into())
}

/// Refuses programs that are none of those that are read, which are no tables either.
pub(super) fn refuse_unread(targets: &Utf8Path) -> Result<()> {
    if Language::of(targets).is_some() {
        return Ok(());
    }
    let Ok(bytes) = std::fs::read(targets) else { return Ok(()) };
    let text = String::from_utf8_lossy(&bytes);
    let refuse = |message: String, hint: &str| Err(files::Error::format(targets, None, message, Some(hint)).into());
    if let Some(name) = unread(targets, &text) {
        let read: Vec<&str> = Language::ALL.into_iter().map(Language::name).collect();
        let message = format!("a program in a language that is not read ({name})");
        let hint = format!(
            "programs in {} are read; else give the targets as a CSV of name,j1_deg,...,jN_deg",
            read.join(", ")
        );
        return refuse(message, &hint);
    }
    match Language::seen_in(&text) {
        Some((language, ending)) => {
            let name = targets.file_stem().unwrap_or("program");
            let hint = format!("call the file {name}.{ending}: the ending says the language");
            refuse(format!("this looks like a program in {}", language.name()), &hint)
        }
        None => Ok(()),
    }
}

/// Whether the record beside an identified robot says that it is of that file, and was identified from this one.
pub(super) fn is_made_of(identified: &Utf8Path, robot: &Utf8Path) -> bool {
    let [found, given] = [identified, robot].map(Digested::read);
    record_of(identified).is_some_and(|run| holds(&run.inputs, given.as_ref()) && holds(&run.outputs, found.as_ref()))
}

fn record_of(identified: &Utf8Path) -> Option<Provenance> {
    Provenance::of_json(&identified.with_file_name("identification.json"))
}

fn holds(list: &[Digested], file: Option<&Digested>) -> bool {
    file.is_some_and(|file| list.iter().any(|known| known.sha256 == file.sha256))
}

/// That both robots are ones that `identify` found, and the second was not found from the first.
pub(super) fn of_nominal(robot: &Utf8Path, identified: &Utf8Path) -> Option<String> {
    if !file::is_identified(robot) || !file::is_identified(identified) {
        return None;
    }
    // That file may have been edited since.
    let is_made_of = record_of(identified).is_some_and(|run| holds(&run.inputs, Digested::read(robot).as_ref()));
    (!is_made_of).then(|| {
        format!(
            "--robot {robot} is itself a robot that `identify` found, and {identified} was not identified from it: the targets are taken as written \
             for it; where they were written for the nominal robot, `--robot` names the file that `identify` was given"
        )
    })
}

/// Warns of joint targets that look like radians in degrees, and of joints of which neither file, each with its robot,
/// has the limits.
pub(super) fn warn(rows: &[Row], [(drawn, nominal), (found, robot)]: [(&Utf8Path, &Robot); 2]) {
    let turning = |row: &Row| -> Option<Vec<f64>> {
        let readings = row.given.as_ref().filter(|_| matches!(row.target, Target::Readings(_)))?;
        Some(readings.iter().zip(&robot.joints).filter(|(_, joint)| !joint.slides).map(|(q, _)| *q).collect())
    };
    let largest_deg = |readings: &Vec<f64>| readings.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
    let largest: Vec<f64> = rows.iter().filter_map(turning).map(|readings| largest_deg(&readings)).collect();
    let most_deg = largest.iter().fold(0.0_f64, |most, q| most.max(*q));
    // A turn is 6.28 rad. An arm that moves a tool turns some joint by more than as many degrees; its zero posture
    // alone says nothing.
    if most_deg > 0.0 && most_deg <= std::f64::consts::TAU {
        progress::warn(format!(
            "no joint of these targets is farther than {most_deg:.3} deg from zero: are they radians? A table says so by columns `j1_rad`.."
        ));
    }
    let of_nominal = nominal.joints_without_limits();
    let open: Vec<String> = robot.joints_without_limits().into_iter().filter(|j| of_nominal.contains(j)).collect();
    if !open.is_empty() {
        progress::note(format!(
            "neither {drawn} nor {found} has limits of joint {}: two turns either way are taken where a joint turns; `limits_deg` (`limits_mm`) in \
             either says what the real arm can",
            open.join(", ")
        ));
    }
}

/// That poses which are not reached would be with lengths that are in metres; `compensated` is what becomes of rows.
pub(super) fn of_lengths(
    rows: &[Row],
    found: &[Compensated],
    compensated: impl Fn(&[Row]) -> Vec<Compensated>,
) -> Option<String> {
    let in_mm = |row: &Row| {
        let mut row = row.clone();
        let Target::Pose { root_from_tool, .. } = &mut row.target else { return None };
        root_from_tool.translation.vector *= Unit::M.converted(1.0);
        Some(row)
    };
    let refused = rows.iter().zip(found).filter(|(_, found)| found.readings.is_err());
    let asked: Vec<Row> = refused.filter_map(|(row, _)| in_mm(row)).collect();
    let reached = compensated(&asked);
    let reached = asked.iter().zip(&reached).filter(|(_, there)| there.readings.is_ok());
    let names: Vec<&str> = reached.map(|(row, _)| row.name.as_str()).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} of the targets ({}) would be reached with lengths 1000 times as long: are they metres? x_mm, y_mm and z_mm are read in mm",
            names.len(),
            listed(&names)
        )
    })
}

/// The first of some names.
fn listed(names: &[&str]) -> String {
    const SAID: usize = 4;
    names.iter().take(SAID).copied().chain((names.len() > SAID).then_some("...")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_that_are_not_read_are_named() {
        let said = |name: &str, text: &str| {
            let (_folder, path) = files::temporary(name, text);
            refuse_unread(&path).err().map_or(String::new(), |e| crate::diagnostic::report(&e))
        };
        let doosan = "from DRCF import *\nv = 60\ndef go():\n    movej(posj(0, 10, -80, 0, 70, 20), v=30, a=60)\n";
        let kawasaki = ".PROGRAM go()\n  SPEED 50 ALWAYS\n  JMOVE #[0,20,0,0,0,40]\n.END\n";
        for (name, text, word) in [
            ("a.drl", doosan, "Doosan DRL"),
            ("a.py", doosan, "Doosan DRL"),
            ("a.as", kawasaki, "Kawasaki AS"),
            ("a.txt", kawasaki, "Kawasaki AS"),
            ("a.as", ".AUXDATA\nN_INT1 \"a  \"\n.END\n", "Kawasaki AS"),
            ("a.py", "movej([0, 1, 2])\n", "Python"),
        ] {
            let said = said(name, text);
            assert!(said.contains(word) && said.contains("URScript, ABB RAPID, KUKA KRL"), "{name}: {said}");
        }
        let ur = "def calibration():\n  set_tcp(p[0,0,0,0,0,0])\n  movej([0.1,-1.2,1.3,0,1.5,0], a=1, v=1)\nend\n";
        assert!(said("poses.txt", ur).contains("call the file poses.script"), "{}", said("poses.txt", ur));
        for (name, text) in [("a.script", ur), ("a.csv", "name,j1_deg\na,1\n"), ("a.txt", "1 2 3\n4 5 6\n")] {
            assert_eq!(said(name, text), "", "{name}");
        }
    }
}
