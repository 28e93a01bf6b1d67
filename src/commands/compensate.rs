//! `stereocal compensate`: targets written for the nominal robot to readings that bring the real one there.

use camino::Utf8Path;
use nalgebra::Vector3;
use serde::Serialize;

use super::{Outcome, Result};
use crate::cli::Compensate;
use crate::compensate::{Compensated, Compensator, Target};
use crate::config::{self, Config};
use crate::csv_table::MOST_ROWS;
use crate::diagnostic::{Place, Status};
use crate::files::provenance::Run;
use crate::files::{self, OutDir};
use crate::formats::targets::{self, Row};
use crate::programs::{self, Joints, Language};
use crate::robot::{Error, Robot, file};

/// Length of the list of refused targets on the terminal.
const MOST_SAID: usize = 20;

/// What `compensate.json` says.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Summary {
    /// Targets in the file.
    targets: usize,
    /// Those with readings.
    compensated: usize,
    /// Mean distance of the real tool from where it was meant to be, without compensation, mm.
    before_mean_mm: Option<f64>,
    /// Largest.
    before_max_mm: Option<f64>,
    /// Those without.
    refused: Vec<Refused>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
struct Refused {
    name: String,
    line: u64,
    reason: String,
}

/// Runs the command.
pub fn run(args: &Compensate, config: &Config, run: Run) -> Result<Outcome> {
    let (nominal, identified) = (file::read(&args.robot)?, file::read(&args.identified)?);
    check(args, &nominal, &identified)?;
    let slides: Vec<bool> = nominal.joints.iter().map(|j| j.slides).collect();
    let joints = Joints { slides: &slides, pulses_per_deg: &args.pulses_per_deg };
    let program = Language::of(&args.targets).map(|language| Program::read(&args.targets, language, joints));
    let program = program.transpose()?;
    let rows = match &program {
        Some(program) => program.rows(&nominal),
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
    let found = compensator.compensate(&list);
    let in_file = |readings: &[f64]| -> Vec<f64> {
        readings.iter().zip(&slides).map(|(r, slides)| if *slides { *r } else { r.to_degrees() }).collect()
    };
    let table = rows.iter().zip(&found).map(|(row, found)| match &found.readings {
        Ok(readings) => (row.name.as_str(), Some(in_file(readings)), "ok".to_owned()),
        Err(refusal) => (row.name.as_str(), row.given.clone(), refusal.to_string()),
    });
    out.write("compensated.csv", targets::to_csv(&nominal, table).as_bytes())?;
    if let Some(program) = &program {
        let changed = program.targets.iter().zip(&found);
        let changed: Vec<_> = changed.filter_map(|(t, f)| Some((t, in_file(f.readings.as_ref().ok()?)))).collect();
        let text = programs::with_readings(program.language, &program.text, joints, &changed);
        out.write(&program_name, text.as_bytes())?;
    }
    let summary = Summary::new(&rows, &found);
    let json = out.write_json("compensate.json", &summary)?;
    let status = if summary.refused.is_empty() { Status::Done } else { Status::OutOfTolerance };
    let written = out.join(if program.is_some() { &program_name } else { "compensated.csv" });
    let stdout = if args.output.json { json } else { said(&summary, &written) };
    Ok(Outcome { stdout, status })
}

fn check(args: &Compensate, nominal: &Robot, identified: &Robot) -> Result<()> {
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
    let (pulses, count) = (&args.pulses_per_deg, nominal.joints.len());
    if !pulses.is_empty() && (pulses.len() != count || pulses.iter().any(|p| !p.is_finite() || *p == 0.0)) {
        problems.push(format!("--pulses-per-deg has {} numbers; {count} that are not zero are needed", pulses.len()));
    }
    Ok(config::reject(problems)?)
}

/// A robot program with its joint targets.
struct Program {
    language: Language,
    text: String,
    targets: Vec<programs::Target>,
}

impl Program {
    fn read(path: &Utf8Path, language: Language, joints: Joints) -> files::Result<Program> {
        let text = files::read_text(path, "the robot program", None)?;
        let refuse = |message: String, hint: String| {
            let place = Place { path: path.to_owned(), line: None };
            files::Error::Format { message, place, hint: Some(hint) }
        };
        let targets = programs::targets(language, &text, joints).map_err(|message| {
            refuse(message, "`--pulses-per-deg N,N,...`, from the controller's parameters".into())
        })?;
        if targets.is_empty() {
            let message =
                format!("no joint target of {} numbers in this {} program", joints.slides.len(), language.name());
            let hint = "Cartesian targets are not changed in programs: give them as CSV, name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad";
            return Err(refuse(message, hint.to_owned()));
        }
        if targets.len() > MOST_ROWS {
            return Err(refuse(format!("more than {MOST_ROWS} targets"), "split the program".to_owned()));
        }
        Ok(Program { language, text, targets })
    }

    fn rows(&self, nominal: &Robot) -> Vec<Row> {
        let row = |t: &programs::Target| {
            let target = Target::Readings(targets::radians(&t.readings, nominal));
            Row { name: t.name.clone(), line: t.line, target, given: Some(t.readings.clone()) }
        };
        self.targets.iter().map(row).collect()
    }
}

impl Summary {
    fn new(rows: &[Row], found: &[Compensated]) -> Summary {
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
            refused,
        }
    }
}

fn said(summary: &Summary, written: &Utf8Path) -> String {
    let mut text = format!("{} of {} targets compensated: {written}\n", summary.compensated, summary.targets);
    if let (Some(mean), Some(max)) = (summary.before_mean_mm, summary.before_max_mm) {
        text += &format!("without it the real tool would be off by {mean:.3} mm in the mean, {max:.3} at the most\n");
    }
    for refused in summary.refused.iter().take(MOST_SAID) {
        text += &format!("not compensated: {} (line {}): {}\n", refused.name, refused.line, refused.reason);
    }
    if summary.refused.len() > MOST_SAID {
        text += &format!("... and {} more, named in compensated.csv\n", summary.refused.len() - MOST_SAID);
    }
    text
}
