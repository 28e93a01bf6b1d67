//! `stereocal compensate`: targets written for the nominal robot to readings that bring the real one there.

mod doubts;
mod pair;
mod program;
mod source;
mod told;

use camino::Utf8Path;

use super::heed::heed;
use super::{Outcome, Result};
use crate::cli::Compensate;
use crate::compensate::{Compensated, Compensator, Target};
use crate::config::{self, Config};
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::targets::{self, Row};
use crate::programs::{JointOrder, Joints, Language};
use crate::progress;
use pair::Pair;
use program::Program;
use told::{Summary, said};

pub fn run(args: &Compensate, config: &Config, run: Run) -> Result<Outcome> {
    let results = args.output.out.as_deref().unwrap_or(&config.out);
    let folders = [results, args.identified.parent().unwrap_or(Utf8Path::new(""))];
    doubts::refuse_corrected(&args.targets, &folders)?;
    doubts::refuse_unread(&args.targets)?;
    let pair = Pair::read(args)?;
    doubts::of_nominal(&args.robot, &args.identified).iter().for_each(progress::warn);
    let nominal = &pair.nominal;
    let heeded = heed(pair.check.as_ref(), &args.identified);
    let slides: Vec<bool> = nominal.joints.iter().map(|j| j.slides).collect();
    let order = check(args, Joints { slides: &slides, pulses_per_deg: &args.pulses_per_deg })?;
    let slides = order.in_program(&slides);
    let joints = Joints { slides: &slides, pulses_per_deg: &args.pulses_per_deg };
    let read = |language| Program::read(args, language, joints, &order);
    let program = Language::of(&args.targets).map(read).transpose()?;
    let data = program.as_ref().and_then(Program::data_file);
    data.map_or(Ok(()), |data| doubts::refuse_corrected(data, &folders))?;
    let rows = match &program {
        Some(program) => program.rows(nominal, &order),
        None => targets::read(&args.targets, nominal)?,
    };
    let out = OutDir::open(results)?;
    let run = Run { force: args.output.force, ..run };
    let inputs = [args.targets.as_path(), &args.robot, &args.identified].into_iter().chain(data);
    let out = out.for_run(&run, &inputs.collect::<Vec<&Utf8Path>>());
    out.check_free(&["compensated.csv", "compensate.json"])?;
    tell_of_postures(&rows);
    doubts::warn(&rows, [(&args.robot, nominal), (&args.identified, &pair.identified)]);
    let found = compensated(args, &pair, &rows);
    doubts::of_lengths(&rows, &found, |rows| compensated(args, &pair, rows)).iter().for_each(progress::warn);
    let in_file = |readings: &[f64]| -> Vec<f64> {
        readings.iter().zip(&nominal.joints).map(|(r, joint)| if joint.slides { *r } else { r.to_degrees() }).collect()
    };
    let table = rows.iter().zip(&found).map(|(row, found)| match &found.readings {
        Ok(readings) => (row.name.as_str(), Some(in_file(readings)), "ok".to_owned()),
        Err(refusal) => (row.name.as_str(), row.given.clone(), refusal.to_string()),
    });
    out.write("compensated.csv", targets::to_csv(nominal, table).as_bytes())?;
    let mut written = Vec::new();
    let in_program = |readings: &[f64]| order.in_program(&in_file(readings));
    for (name, bytes) in program.iter().flat_map(|p| p.corrected(&args.targets, joints, &found, in_program)) {
        out.write(&name, &bytes)?;
        written.push(out.join(&name).to_string());
    }
    let motions = program.as_ref().map(|program| program.outcome(&found));
    let there: Vec<&[f64]> = found.iter().filter_map(|f| f.readings.as_deref().ok()).collect();
    let beyond = super::beyond::targets(&args.identified, &pair.identified, &there);
    beyond.iter().for_each(|(said, _)| progress::warn(said));
    let is_known = beyond.is_none_or(|(_, far)| !far);
    let summary = Summary::new(&rows, &found, motions.as_deref(), &pair);
    let json = out.write_json("compensate.json", &summary)?;
    written.extend(written.is_empty().then(|| out.join("compensated.csv").to_string()));
    let whole = summary.is_whole() && is_known && pair.same.is_none() && !pair.tools_differ;
    let status = if whole { heeded } else { Status::OutOfTolerance };
    Ok(Outcome {
        stdout: if args.output.json { json } else { said(&summary, &pair, motions.as_deref(), &written.join(", ")) },
        status,
    })
}

/// Readings for all rows; those without a posture get one where the robot was identified, if there is one.
fn compensated(args: &Compensate, pair: &Pair, rows: &[Row]) -> Vec<Compensated> {
    // Of the languages one alone has radians; a table may have them.
    let radians = Language::of(&args.targets).is_none_or(|language| language == Language::UrScript);
    let list: Vec<Target> = rows.iter().map(|row| row.target.clone()).collect();
    let compensator = Compensator::new(&pair.nominal, &pair.identified, pair.tool_mm).given_in_radians(radians);
    match super::beyond::identified_over(&args.identified, &pair.identified) {
        Some(ranges) => compensator.identified_over(&ranges).compensate(&list),
        None => compensator.compensate(&list),
    }
}

/// Where no row says the posture.
fn tell_of_postures(rows: &[Row]) {
    if rows.iter().any(|row| matches!(row.target, Target::Pose { near_rad: None, .. })) {
        progress::note(
            "poses without readings: of the postures where the robot was identified, or else of all, the one farthest from limits and singular ones \
             is taken; columns j1_deg.. beside a pose say another",
        );
    }
}

/// What the options say of the joints.
fn check(args: &Compensate, joints: Joints) -> Result<JointOrder> {
    let mut problems: Vec<String> = joints.problem().into_iter().collect();
    match JointOrder::new(&args.joint_order, joints.slides.len()) {
        Ok(order) if problems.is_empty() => Ok(order),
        order => {
            problems.extend(order.err());
            Err(config::Error::Invalid { problems }.into())
        }
    }
}
