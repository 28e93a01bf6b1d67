//! A robot's program: which of its motions move by joint targets that can be corrected.

use camino::Utf8Path;

use super::source::Source;
use crate::cli::Compensate;
use crate::compensate::{Compensated, Target};
use crate::csv_table::MOST_ROWS;
use crate::diagnostic::count;
use crate::files;
use crate::formats::targets::{self, Row};
use crate::programs::{self, Cause, Instruction, JointOrder, Joints, Language};
use crate::robot::Robot;

/// What to do about motions that are not corrected.
const LEFT_HINT: &str = "`--joint-targets-only` corrects the joint targets and names the motions that it leaves as they are; \
                         their poses can be compensated as a CSV of name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";
const DATA_HINT: &str = "points of inline forms stand in the .dat file of this name, which is read and corrected with this one where it stands \
                         beside it; KUKA keeps `XHOME` and what else all programs use in `$config.dat`";
const ALONE_HINT: &str = "`--joint-targets-only` corrects them, where everything that uses them is a motion";
const OF_DATA_HINT: &str = "`stereocal compensate NAME.src`, with this file beside it, corrects both; `--joint-targets-only` corrects them all, where \
                            everything that uses them is a motion";
const CSV_HINT: &str =
    "give the targets as a CSV of name,j1_deg,...,jN_deg or name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";

/// A robot program, and which of its joint targets it moves by.
pub(super) struct Program {
    language: Language,
    source: Source,
    read: programs::Program,
    moved_by: Vec<usize>,
}

impl Program {
    pub(super) fn read(
        args: &Compensate,
        language: Language,
        joints: Joints,
        order: &JointOrder,
    ) -> files::Result<Program> {
        let path = &args.targets;
        let refuse = |message: String, hint: &str| files::Error::format(path, None, message, Some(hint));
        let count = joints.slides.len();
        if let Some(axis) = order.unknown_axis(language) {
            let message = format!(
                "the robot has {count} joints; which of them {axis} of {} is, the file does not say",
                language.name()
            );
            return Err(refuse(message, JointOrder::HINT));
        }
        let understood = |source: &Source| {
            programs::Program::read(language, &source.text, joints)
                .map_err(|message| refuse(message, "`--pulses-per-deg N,N,...`, from the controller's parameters"))
        };
        let mut source = Source::read(path)?;
        let mut read = understood(&source)?;
        if language.has_data_file(path) && read.motions.iter().any(|m| is_elsewhere(&m.moves_by)) {
            source = source.with_data(path)?;
            read = understood(&source)?;
        }
        if !args.joint_targets_only
            && let Some(first) = read.motions.iter().find(|motion| motion.moves_by.is_err())
        {
            return Err(refuse(counted(&read.motions, first), &left_hint(&read.motions, first)));
        }
        let moved_by = read.moved_by(language);
        if moved_by.is_empty() {
            let message =
                format!("nothing in this {} program moves to a joint target of {count} numbers", language.name());
            let motions = read.motions.first().map(|first| format!(": {}", counted(&read.motions, first)));
            return Err(refuse(message + &motions.unwrap_or_default(), CSV_HINT));
        }
        if read.motions.is_empty() && !args.joint_targets_only {
            let is_data = language == Language::Krl && !language.has_data_file(path);
            let message = match moved_by.len() {
                1 => "1 joint target, but no instruction that moves to it, in this file".to_owned(),
                count => format!("{count} joint targets, but no instruction that moves to them, in this file"),
            };
            return Err(refuse(message, if is_data { OF_DATA_HINT } else { ALONE_HINT }));
        }
        if moved_by.len() > MOST_ROWS {
            return Err(refuse(format!("more than {MOST_ROWS} targets"), "split the program"));
        }
        Ok(Program { language, source, read, moved_by })
    }

    /// The file beside the program that holds points of it.
    pub(super) fn data_file(&self) -> Option<&Utf8Path> {
        self.source.data_file()
    }

    /// The files with the readings that were found, by their names below the results folder.
    pub(super) fn corrected(
        &self,
        path: &Utf8Path,
        joints: Joints,
        found: &[Compensated],
        in_program: impl Fn(&[f64]) -> Vec<f64>,
    ) -> Vec<(String, Vec<u8>)> {
        let changed = self.targets().zip(found);
        let changed: Vec<_> = changed.filter_map(|(t, f)| Some((t, in_program(f.readings.as_ref().ok()?)))).collect();
        let files = self.source.corrected(path, (self.language, joints), &changed).into_iter();
        files.map(|(path, bytes)| (format!("compensated/{}", path.file_name().unwrap_or("program")), bytes)).collect()
    }

    /// The joint targets that are corrected, in the order of the text.
    pub(super) fn targets(&self) -> impl Iterator<Item = &programs::Target> {
        self.moved_by.iter().filter_map(|&k| self.read.targets.get(k))
    }

    /// Readings in the robot's order of joints.
    pub(super) fn rows(&self, nominal: &Robot, order: &JointOrder) -> Vec<Row> {
        let row = |t: &programs::Target| {
            let given = order.of_robot(&t.readings);
            let target = Target::Readings(targets::radians(&given, nominal));
            Row { name: t.name.clone(), line: self.source.line(t.line), target, given: Some(given) }
        };
        self.targets().map(row).collect()
    }

    /// The motions, those among the unchanged ones that move to a target whose correction was refused.
    pub(super) fn outcome(&self, found: &[Compensated]) -> Vec<Instruction> {
        let refusal = |k: &usize| {
            let place = self.moved_by.binary_search(k).ok()?;
            found.get(place)?.readings.as_ref().err().map(|refusal| Cause::Refused(refusal.to_string()))
        };
        let outcome = |motion: &Instruction| {
            let moves_by = motion.moves_by.clone().and_then(|targets| match targets.iter().find_map(refusal) {
                Some(cause) => Err(cause),
                None => Ok(targets),
            });
            let mut motion = motion.clone();
            motion.moves_by = moves_by;
            motion
        };
        self.read.motions.iter().map(outcome).collect()
    }
}

/// Whether a motion's point may stand in a data file.
fn is_elsewhere(moves_by: &Result<Vec<usize>, Cause>) -> bool {
    matches!(moves_by, Err(Cause::Elsewhere | Cause::Undeclared))
}

/// What to do about motions of which this one is the first that is not corrected.
fn left_hint(motions: &[Instruction], first: &Instruction) -> String {
    let in_data = first.moves_by == Err(Cause::Undeclared);
    match motions.iter().any(|motion| motion.moves_by.is_ok()) {
        true if in_data => format!("{DATA_HINT}; {LEFT_HINT}"),
        true => LEFT_HINT.to_owned(),
        false if in_data => DATA_HINT.to_owned(),
        false => CSV_HINT.to_owned(),
    }
}

/// "7 motions, 2 through joint targets; line 14: MoveL p10 is Cartesian".
fn counted(motions: &[Instruction], first: &Instruction) -> String {
    let through = motions.iter().filter(|m| m.moves_by.is_ok()).count();
    format!("{}, {through} through joint targets; {first}", count(motions.len(), "motion"))
}
