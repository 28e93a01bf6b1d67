//! A robot's program: which of its motions move by joint targets that can be corrected.

use crate::cli::Compensate;
use crate::compensate::{Compensated, Target};
use crate::csv_table::MOST_ROWS;
use crate::diagnostic::count;
use crate::files;
use crate::formats::targets::{self, Row};
use crate::programs::{self, Cause, Encoding, Instruction, JointOrder, Joints, Language};
use crate::robot::Robot;

/// What to do about motions that are not corrected.
const LEFT_HINT: &str = "`--joint-targets-only` corrects the joint targets and names the motions that it leaves as they are; \
                         their poses can be compensated as a CSV of name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";
const DATA_HINT: &str = "points of inline forms stand in the .dat file of this name: `stereocal compensate NAME.dat --joint-targets-only` corrects \
                         the joint targets among them; `--joint-targets-only` corrects those in this file and names the motions that it leaves";
const CSV_HINT: &str =
    "give the targets as a CSV of name,j1_deg,...,jN_deg or name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";

/// A robot program, and which of its joint targets it moves by.
pub(super) struct Program {
    pub(super) language: Language,
    pub(super) text: String,
    pub(super) encoding: Encoding,
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
        let bytes = files::read_text_bytes(path, "robot program", None)?;
        let refuse = |message: String, hint: &str| files::Error::format(path, None, message, Some(hint));
        let Some((text, encoding)) = programs::decoded(bytes) else {
            return Err(refuse("robot program: UTF-16 text".to_owned(), "save it as UTF-8, or as the controller does"));
        };
        let count = joints.slides.len();
        if let Some(axis) = order.unknown_axis(language) {
            let message = format!(
                "the robot has {count} joints; which of them {axis} of {} is, the file does not say",
                language.name()
            );
            return Err(refuse(message, JointOrder::HINT));
        }
        let read = programs::Program::read(language, &text, joints)
            .map_err(|message| refuse(message, "`--pulses-per-deg N,N,...`, from the controller's parameters"))?;
        if !args.joint_targets_only
            && let Some(first) = read.motions.iter().find(|motion| motion.moves_by.is_err())
        {
            let name = first.target.chars().all(|c| c.is_alphanumeric() || c == '_');
            let hint = match first.moves_by {
                Err(Cause::Elsewhere) if name && language.has_data_file(path) => DATA_HINT,
                _ => LEFT_HINT,
            };
            return Err(refuse(counted(&read.motions, first), hint));
        }
        let moved_by = read.moved_by(language);
        if moved_by.is_empty() {
            let message =
                format!("nothing in this {} program moves to a joint target of {count} numbers", language.name());
            return Err(refuse(message, CSV_HINT));
        }
        if read.motions.is_empty() && !args.joint_targets_only {
            let message = match moved_by.len() {
                1 => "1 joint target, but no instruction that moves to it, in this file".to_owned(),
                count => format!("{count} joint targets, but no instruction that moves to them, in this file"),
            };
            return Err(refuse(
                message,
                "`--joint-targets-only` corrects them, where everything that uses them is a motion",
            ));
        }
        if moved_by.len() > MOST_ROWS {
            return Err(refuse(format!("more than {MOST_ROWS} targets"), "split the program"));
        }
        Ok(Program { language, text, encoding, read, moved_by })
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
            Row { name: t.name.clone(), line: t.line, target, given: Some(given) }
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
            Instruction { moves_by, ..motion.clone() }
        };
        self.read.motions.iter().map(outcome).collect()
    }
}

/// "7 motions, 2 through joint targets; line 14: MoveL p10 is Cartesian".
fn counted(motions: &[Instruction], first: &Instruction) -> String {
    let through = motions.iter().filter(|m| m.moves_by.is_ok()).count();
    format!("{}, {through} through joint targets; {first}", count(motions.len(), "motion"))
}
