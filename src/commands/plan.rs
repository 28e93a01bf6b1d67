//! `stereocal plan`: robot, rig and spheres to poses, and robot programs that visit them.

use camino::{Utf8Path, Utf8PathBuf};
use nalgebra::Vector3;

use super::heed::heed_rig;
use super::identify::robot_file;
use super::{Outcome, Result};
use crate::cli::{Plan as Arguments, PlanKind};
use crate::config::{self, Config};
use crate::diagnostic::count;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::calibration::{self, Calibrated};
use crate::formats::plan::PlanFile;
use crate::measurements::{Measurement, Role, Source, poses_csv, reading_name};
use crate::plan::scene::Scene;
use crate::plan::{PAPER_SAMPLES, Plan, Planned, Settings, plan};
use crate::programs::{JointOrder, Joints, Language, Motion, Stop, program};
use crate::robot::{self, Robot, catalogue};
use crate::{progress, report};

/// Standard deviation of a corner where the calibration does not say, px.
const CORNER_PX: f64 = 0.03;

/// Samples and poses to verify with, of the best plan; the paper's has 50 of the latter.
const SAMPLES: usize = 60;
const VERIFY: usize = 20;
const PAPER_VERIFY: usize = 50;

/// How far every joint stands off before it approaches its reading from below, deg (mm).
const APPROACH: f64 = 2.0;

/// Name of the programs.
const PROGRAM: &str = "stereocal_plan";

pub fn run(args: &Arguments, config: &Config, run: Run) -> Result<Outcome> {
    let out = args.output.out.clone().unwrap_or_else(|| config.out.clone());
    let rig_file = calibration::file(args.calibration.as_deref(), &out, &config.out)?;
    let calibrated = calibration::read(&rig_file)?;
    let doubts = heed_rig(&calibrated, &rig_file);
    let Calibrated { rig, noise, pair_excess, .. } = calibrated;
    let robot_file = robot_file(args.robot.as_deref());
    let robot = match &robot_file {
        Some(path) => robot::file::read(path)?,
        None => {
            progress::note("nominal robot: Table 1 of the paper (no --robot, and no robot.toml here)");
            catalogue::paper()
        }
    };
    let robot = within_a_turn(robot);
    let slides: Vec<bool> = robot.joints.iter().map(|j| j.slides).collect();
    let order = joint_order(args, &slides)?;
    let read = |path: &Utf8PathBuf| {
        let rows = super::identify::read(&Source::of(path.clone()), &robot)?;
        check_one_target(&rows, path).map(|()| rows)
    };
    let earlier = args.after.as_ref().map(read).transpose()?;
    let out = OutDir::open(&out)?;
    let inputs = [Some(&rig_file), robot_file.as_ref(), args.after.as_ref()];
    let inputs: Vec<&Utf8Path> = inputs.into_iter().flatten().map(|path| path.as_path()).collect();
    let out = out.for_run(&Run { force: args.output.force, ..run }, &inputs);
    out.check_free(&["poses.csv", "plan.json", "plan.html"])?;
    let board = config.target_board.board(args.target.board, args.target.squares, args.target.square_mm)?;
    // Boards held by hand scatter about the rig by more than their corners do, and the target will, too.
    let excess = pair_excess.unwrap_or(1.0).max(1.0).sqrt();
    let corner_px = excess * noise.map_or(CORNER_PX, |n| n.added_px.max(CORNER_PX / 3.0));
    let scene = Scene::new(rig, board, corner_px, args.tilt_deg.to_radians(), args.depth_mm, args.margin_mm)?;
    let measured = earlier.as_deref().zip(args.after.as_ref().map(|path| path.as_str()));
    let found = plan(&robot, &scene, &settings(args), measured)?;
    found.warnings.iter().for_each(progress::warn);
    let record = PlanFile::new(&found);
    out.write("poses.csv", poses_csv(found.poses.iter().map(|pose| &pose.at)).as_bytes())?;
    for (name, text) in programs(args, &robot, &order, &found.poses) {
        out.write(&format!("programs/{name}"), text.as_bytes())?;
    }
    let json = out.write_json("plan.json", &record)?;
    let page = report::plan::page(&scene, &robot, &found, &record)?;
    report::page::write(&out, "plan.html", page)?;
    let stdout = if args.output.json { json } else { said(args, &found, &record, &out, earlier.as_deref()) };
    Ok(Outcome { stdout, status: doubts.status_without_uncertainty })
}

/// Joints that turn and have no limits stay within half a turn either way: what they really can, the file does not say.
fn within_a_turn(mut robot: Robot) -> Robot {
    let open = robot.joints_without_limits();
    if !open.is_empty() {
        progress::warn(format!(
            "the robot file has no limits of joint {}: -180 to 180 deg are taken where a joint turns. Write `limits_deg` (`limits_mm`) of the \
             real arm before you run the programs",
            open.join(", ")
        ));
    }
    let turn = std::f64::consts::PI;
    robot.joints.iter_mut().filter(|j| !j.slides).for_each(|j| j.limits_rad = j.limits_rad.or(Some((-turn, turn))));
    robot
}

/// What the options say of the joints of programs, where it suits the robot.
fn joint_order(args: &Arguments, slides: &[bool]) -> Result<JointOrder> {
    config::reject(Joints { slides, pulses_per_deg: &args.pulses_per_deg }.problem().into_iter().collect())?;
    Ok(JointOrder::new(&args.joint_order, slides.len())
        .map_err(|problem| config::Error::Invalid { problems: vec![problem] })?)
}

/// A plan is for the board whose centre is the mark point.
fn check_one_target(rows: &[Measurement], path: &Utf8Path) -> Result<()> {
    let Some(other) = rows.iter().find(|row| row.target != rows[0].target) else { return Ok(()) };
    let message = format!("rows of several targets (`{}` and `{}`); a plan is for one", rows[0].target, other.target);
    Err(crate::plan::Error::Measured { message, place: path.to_string() }.into())
}

fn settings(args: &Arguments) -> Settings {
    let paper = args.plan == PlanKind::Paper;
    Settings {
        samples: args.poses.unwrap_or(if paper { PAPER_SAMPLES } else { SAMPLES }),
        verify: args.verify.unwrap_or(if paper { PAPER_VERIFY } else { VERIFY }),
        paper,
        first: args.first,
        pool: args.pool,
        seed: args.seed,
        centers_mm: args.center.iter().map(|c| Vector3::from(*c)).collect(),
        radius_mm: args.radius_mm,
        noise_mm: args.noise_mm,
        repeatability_mm: args.repeatability_mm,
    }
}

/// One program a controller, plain CSV among them. Where a language has an axis of which nobody said which joint it is,
/// no program.
fn programs(args: &Arguments, robot: &Robot, order: &JointOrder, poses: &[Planned]) -> Vec<(String, String)> {
    let slides: Vec<bool> = robot.joints.iter().map(|j| j.slides).collect();
    let motion = Motion { speed_percent: args.speed_percent, dwell_s: args.dwell_s };
    let stop = |pose: &Planned| {
        let from = pose.at.joints_deg.iter().zip(&robot.joints).map(|(reading, joint)| {
            let low = joint.limits_rad.map_or(f64::NEG_INFINITY, |l| if joint.slides { l.0 } else { l.0.to_degrees() });
            (reading - APPROACH).max(low)
        });
        Stop { name: pose.at.pose.clone(), readings: pose.at.joints_deg.clone(), approach: from.collect() }
    };
    let stops: Vec<Stop> = poses.iter().map(stop).collect();
    let ordered = |stop: &Stop| Stop {
        name: stop.name.clone(),
        readings: order.in_program(&stop.readings),
        approach: order.in_program(&stop.approach),
    };
    let (open, known): (Vec<Language>, Vec<Language>) =
        Language::ALL.into_iter().partition(|language| order.unknown_axis(*language).is_some());
    if !open.is_empty() {
        let names: Vec<&str> = open.into_iter().map(Language::name).collect();
        progress::warn(format!(
            "no programs for {}: which of the {} joints the number behind the six axes is, nobody said; {}",
            names.join(", "),
            slides.len(),
            JointOrder::HINT
        ));
    }
    let ordered: Vec<Stop> = stops.iter().map(ordered).collect();
    let ordered_slides = order.in_program(&slides);
    let joints = Joints { slides: &ordered_slides, pulses_per_deg: &args.pulses_per_deg };
    let write = |language| program(language, PROGRAM, &ordered, &motion, joints);
    let mut files: Vec<(String, String)> = known.into_iter().flat_map(write).collect();
    let names = slides.iter().enumerate().map(|(joint, slides)| reading_name(joint, *slides));
    let mut csv = format!("name,step,{}\n", names.collect::<Vec<String>>().join(","));
    for stop in &stops {
        for (step, readings) in [("approach", &stop.approach), ("stop", &stop.readings)] {
            let fields: Vec<String> = readings.iter().map(|r| format!("{r:.4}")).collect();
            csv += &format!("{},{step},{}\n", crate::csv_table::quoted(&stop.name), fields.join(","));
        }
    }
    files.push((format!("{PROGRAM}.csv"), csv));
    files
}

fn said(args: &Arguments, found: &Plan, record: &PlanFile, out: &OutDir, earlier: Option<&[Measurement]>) -> String {
    let of = |role: Role| found.poses.iter().filter(|p| p.at.role == role).count();
    let mut text = format!(
        "{} poses in {} ({} to identify from, {} to verify, the others centres): {}\n",
        found.poses.len(),
        count(found.placements.len(), "group"),
        of(Role::Sample),
        of(Role::Verify),
        out.join("poses.csv")
    );
    text += &format!("programs: {}\nreport: {}\n", out.join("programs"), out.join("plan.html"));
    if args.first.is_some() {
        text += "measure them, then `stereocal plan --after out/measurements.csv` plans the rest where the cameras really stand\n";
        return text;
    }
    if let Some(rows) = earlier {
        text += &format!("{} rows were measured before and count\n", rows.len());
    }
    text + &report::plan::summary(record)
}
