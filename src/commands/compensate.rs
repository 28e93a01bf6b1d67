//! `stereocal compensate`: targets written for the nominal robot to readings that bring the real one there.

use camino::Utf8Path;
use nalgebra::Vector3;
use serde::Serialize;

use super::{Outcome, Result};
use crate::cli::Compensate;
use crate::compensate::{Compensated, Compensator, Target};
use crate::config::{self, Config};
use crate::csv_table::MOST_ROWS;
use crate::diagnostic::{Status, count};
use crate::files::provenance::Run;
use crate::files::{self, OutDir};
use crate::formats::targets::{self, Row};
use crate::programs::{self, Cause, Encoding, Instruction, JointOrder, Joints, Language};
use crate::progress;
use crate::robot::{Error, Robot, file};

/// Length of the lists of refused targets and of motions that stay as they are on the terminal.
const MOST_SAID: usize = 20;

/// What `compensate.json` says.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Summary {
    targets: usize,
    /// Those with readings.
    compensated: usize,
    /// Mean distance of the real tool from where it was meant to be, without compensation, mm.
    before_mean_mm: Option<f64>,
    /// Largest.
    before_max_mm: Option<f64>,
    /// By how much the tools of both files differ, where none was named for both, mm.
    #[serde(skip)]
    tools_apart_mm: f64,
    /// Those without.
    refused: Vec<Refused>,
    /// Of a program: every instruction that moves the robot.
    #[serde(skip_serializing_if = "Option::is_none")]
    motions: Option<Vec<Moved>>,
}

/// A motion of a program.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Moved {
    line: u64,
    instruction: String,
    target: String,
    /// `compensated` or `unchanged`.
    done: &'static str,
    /// Why it is unchanged.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

/// What to do about motions that are not corrected.
const LEFT_HINT: &str = "`--joint-targets-only` corrects the joint targets and names the motions that it leaves as they are; \
                         their poses can be compensated as a CSV of name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";
const DATA_HINT: &str = "points of inline forms stand in the .dat file of this name: `stereocal compensate NAME.dat --joint-targets-only` corrects \
                         the joint targets among them; `--joint-targets-only` corrects those in this file and names the motions that it leaves";
const CSV_HINT: &str =
    "give the targets as a CSV of name,j1_deg,...,jN_deg or name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";

#[derive(Debug, Clone, PartialEq, Serialize)]
struct Refused {
    name: String,
    line: u64,
    reason: String,
}

/// Runs the command.
pub fn run(args: &Compensate, config: &Config, run: Run) -> Result<Outcome> {
    let (nominal, identified) = (file::read(&args.robot)?, file::read(&args.identified)?);
    if file::is_identified(&args.robot) && !file::is_identified(&args.identified) {
        return Err(Error::Exchanged { robot: args.robot.to_string(), identified: args.identified.to_string() }.into());
    }
    let slides: Vec<bool> = nominal.joints.iter().map(|j| j.slides).collect();
    let order = check(args, &nominal, &identified, Joints { slides: &slides, pulses_per_deg: &args.pulses_per_deg })?;
    let slides = order.in_program(&slides);
    let joints = Joints { slides: &slides, pulses_per_deg: &args.pulses_per_deg };
    let read = |language| Program::read(args, language, joints, &order);
    let program = Language::of(&args.targets).map(read).transpose()?;
    let rows = match &program {
        Some(program) => program.rows(&nominal, &order),
        None => targets::read(&args.targets, &nominal)?,
    };
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?;
    let run = Run { force: args.output.force, ..run };
    let out = out.for_run(&run, &[&args.targets, &args.robot, &args.identified]);
    let program_name = format!("compensated/{}", args.targets.file_name().unwrap_or("program"));
    out.check_free(&["compensated.csv", "compensate.json"])?;
    let tool_mm = <[f64; 3]>::try_from(args.tool.as_slice()).ok().map(Vector3::from);
    let compensator = Compensator::new(&nominal, &identified, tool_mm);
    let list: Vec<_> = rows.iter().map(|row| row.target.clone()).collect();
    if list.iter().any(|target| matches!(target, Target::Pose { near_rad: None, .. })) {
        progress::note(
            "poses without readings: of all postures the one farthest from limits and singular ones is taken; columns j1_deg.. beside a pose say \
             another",
        );
    }
    let found = compensator.compensate(&list);
    let in_file = |readings: &[f64]| -> Vec<f64> {
        readings.iter().zip(&nominal.joints).map(|(r, joint)| if joint.slides { *r } else { r.to_degrees() }).collect()
    };
    let table = rows.iter().zip(&found).map(|(row, found)| match &found.readings {
        Ok(readings) => (row.name.as_str(), Some(in_file(readings)), "ok".to_owned()),
        Err(refusal) => (row.name.as_str(), row.given.clone(), refusal.to_string()),
    });
    out.write("compensated.csv", targets::to_csv(&nominal, table).as_bytes())?;
    if let Some(program) = &program {
        let changed = program.targets().zip(&found);
        let in_program = |readings: &[f64]| order.in_program(&in_file(readings));
        let changed: Vec<_> = changed.filter_map(|(t, f)| Some((t, in_program(f.readings.as_ref().ok()?)))).collect();
        let text = programs::with_readings(program.language, &program.text, joints, &changed);
        out.write(&program_name, &program.encoding.encoded(&text))?;
    }
    let motions = program.as_ref().map(|program| program.outcome(&found));
    let tools_apart_mm = tool_mm.map_or((nominal.tool_mm - identified.tool_mm).norm(), |_| 0.0);
    let summary = Summary::new(&rows, &found, motions.as_deref(), tools_apart_mm);
    let json = out.write_json("compensate.json", &summary)?;
    let whole =
        motions.as_ref().is_none_or(|motions| !motions.is_empty() && motions.iter().all(|m| m.moves_by.is_ok()));
    let status = if summary.refused.is_empty() && whole { Status::Done } else { Status::OutOfTolerance };
    let written = out.join(if program.is_some() { &program_name } else { "compensated.csv" });
    let stdout = if args.output.json { json } else { said(&summary, motions.as_deref(), &written) };
    Ok(Outcome { stdout, status })
}

/// What the options say of the joints, where all of them suit both robots.
fn check(args: &Compensate, nominal: &Robot, identified: &Robot, joints: Joints) -> Result<JointOrder> {
    let kinds = |robot: &Robot| {
        let sliding = robot.joints.iter().filter(|j| j.slides).count();
        format!("{}{}", robot.joints.len(), if sliding > 0 { format!(" ({sliding} sliding)") } else { String::new() })
    };
    let same = |(a, b): (&crate::robot::Joint, &crate::robot::Joint)| a.slides == b.slides;
    if nominal.joints.len() != identified.joints.len() || !nominal.joints.iter().zip(&identified.joints).all(same) {
        return Err(Error::Different { identified: kinds(identified), nominal: kinds(nominal) }.into());
    }
    let mut problems = Vec::new();
    if !(args.tool.is_empty() || args.tool.len() == 3 && args.tool.iter().all(|v| v.is_finite())) {
        problems.push(format!("--tool has {} numbers; X,Y,Z in mm are needed", args.tool.len()));
    }
    problems.extend(joints.problem());
    match JointOrder::new(&args.joint_order, nominal.joints.len()) {
        Ok(order) if problems.is_empty() => Ok(order),
        order => {
            problems.extend(order.err());
            Err(config::Error::Invalid { problems }.into())
        }
    }
}

/// A robot program, and which of its joint targets it moves by.
struct Program {
    language: Language,
    text: String,
    encoding: Encoding,
    read: programs::Program,
    moved_by: Vec<usize>,
}

impl Program {
    fn read(args: &Compensate, language: Language, joints: Joints, order: &JointOrder) -> files::Result<Program> {
        let path = &args.targets;
        let bytes = files::read_text_bytes(path, "robot program")?;
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
    fn targets(&self) -> impl Iterator<Item = &programs::Target> {
        self.moved_by.iter().filter_map(|&k| self.read.targets.get(k))
    }

    /// Readings in the robot's order of joints.
    fn rows(&self, nominal: &Robot, order: &JointOrder) -> Vec<Row> {
        let row = |t: &programs::Target| {
            let given = order.of_robot(&t.readings);
            let target = Target::Readings(targets::radians(&given, nominal));
            Row { name: t.name.clone(), line: t.line, target, given: Some(given) }
        };
        self.targets().map(row).collect()
    }

    /// The motions, those among the unchanged ones that move to a target whose correction was refused.
    fn outcome(&self, found: &[Compensated]) -> Vec<Instruction> {
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
    let s = if motions.len() == 1 { "" } else { "s" };
    format!("{} motion{s}, {through} through joint targets; {first}", motions.len())
}

impl Summary {
    fn new(rows: &[Row], found: &[Compensated], motions: Option<&[Instruction]>, tools_apart_mm: f64) -> Summary {
        let refused = rows.iter().zip(found).filter_map(|(row, found)| {
            let reason = found.readings.as_ref().err()?.to_string();
            Some(Refused { name: row.name.clone(), line: row.line, reason })
        });
        let refused: Vec<Refused> = refused.collect();
        let misses: Vec<f64> = found.iter().filter_map(|f| f.miss_mm).collect();
        Summary {
            targets: rows.len(),
            compensated: rows.len() - refused.len(),
            before_mean_mm: (!misses.is_empty()).then(|| misses.iter().sum::<f64>() / misses.len() as f64),
            before_max_mm: misses.iter().copied().reduce(f64::max),
            tools_apart_mm,
            refused,
            motions: motions.map(|motions| motions.iter().map(Moved::new).collect()),
        }
    }
}

impl Summary {
    /// What of that is not the arm's.
    fn tools(&self) -> String {
        if self.tools_apart_mm < SAME_MM {
            return String::new();
        }
        format!(
            "; the tools of the two files are {:.3} mm apart: `--tool X,Y,Z` names the one that works",
            self.tools_apart_mm
        )
    }
}

impl Moved {
    fn new(motion: &Instruction) -> Moved {
        Moved {
            line: motion.line,
            instruction: motion.word.clone(),
            target: motion.target.clone(),
            done: if motion.moves_by.is_ok() { "compensated" } else { "unchanged" },
            reason: motion.moves_by.as_ref().err().map(Cause::to_string),
        }
    }
}

/// Targets that move by less are not corrected, mm.
const SAME_MM: f64 = 1e-6;

fn said(summary: &Summary, motions: Option<&[Instruction]>, written: &Utf8Path) -> String {
    let mut text = format!("{} of {} compensated: {written}\n", summary.compensated, count(summary.targets, "target"));
    if let Some(motions) = motions {
        let through = motions.iter().filter(|m| m.moves_by.is_ok()).count();
        text += &match motions.len() {
            0 => "no instruction in this file moves to them: whether each use of them is a motion is not known\n"
                .to_owned(),
            1 if through == 1 => "the one motion to them is compensated\n".to_owned(),
            all if all == through => format!("all {all} motions move to them\n"),
            all => format!("{through} of {all} motions move to them; {} left as written\n", all - through),
        };
    }
    if let (Some(mean), Some(max)) = (summary.before_mean_mm, summary.before_max_mm) {
        text += &match max < SAME_MM {
            true => "both files describe the same robot, nothing was corrected: `--identified` names what `identify` wrote, identified.toml\n".to_owned(),
            false => format!(
                "without it the real tool would be off by {mean:.3} mm on average, {max:.3} at most (in the base frame; the errors of `identify` are \
                 those after a rigid fit of each placement){}\n",
                summary.tools()
            ),
        };
    }
    let left: Vec<String> = match motions {
        Some(motions) => motions.iter().filter(|m| m.moves_by.is_err()).map(|m| format!("left: {m}")).collect(),
        None => Vec::new(),
    };
    let refused = |r: &Refused| format!("not compensated: {} (line {}): {}", r.name, r.line, r.reason);
    listed(&mut text, summary.refused.iter().map(refused), summary.refused.len(), "compensated.csv");
    let of_motions = left.len();
    listed(&mut text, left.into_iter(), of_motions, "compensate.json");
    text
}

/// At most so many lines of a list, and where the others are named.
fn listed(text: &mut String, lines: impl Iterator<Item = String>, count: usize, file: &str) {
    lines.take(MOST_SAID).for_each(|line| *text += &format!("{line}\n"));
    if count > MOST_SAID {
        *text += &format!("... and {} more, named in {file}\n", count - MOST_SAID);
    }
}
