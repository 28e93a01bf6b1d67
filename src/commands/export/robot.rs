//! `stereocal export robot`: the identified robot for other programs, and what they cannot have of it.

use nalgebra::Vector3;

use super::super::heed::heed;
use super::super::{Outcome, Result};
use crate::cli::{ExportRobot, RobotFormat};
use crate::config::Config;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::robots::urdf::Urdf;
use crate::formats::robots::{
    ExportedRobot, dh_csv, known, ros_kinematics, ur_calibration, urdf_corrected, urdf_plain,
};
use crate::geometry::Transform;
use crate::robot::refit::Residual;
use crate::robot::{Check, Error, Robot, axes, catalogue, file, tool_text};

/// Deviations below this are rounding, mm: common normals of nearly parallel axes lose half the digits.
const ROUNDING_MM: f64 = 1e-4;

pub fn run(args: &ExportRobot, config: &Config, run: Run) -> Result<Outcome> {
    let path = args.robot.clone().unwrap_or_else(|| config.out.join(file::IDENTIFIED_FILE));
    let (robot, check) = file::read_checked(&path)?;
    let status = heed(check.as_ref(), &path);
    let out = OutDir::open(args.files.out.as_deref().unwrap_or(&config.out))?;
    let inputs = [Some(&path), args.nominal_urdf.as_ref(), args.nominal.as_ref()];
    let inputs: Vec<&camino::Utf8Path> = inputs.into_iter().flatten().map(|path| path.as_path()).collect();
    let out = out.for_run(&Run { force: args.files.force, ..run }, &inputs);
    let identified = Identified { over: known::identified_over(&path, &robot), robot, check };
    let exported = export(args, &identified)?;
    if !args.files.force {
        spare_other_robots(&out.join(exported.name), &exported)?;
    }
    match args.format {
        RobotFormat::Toml => out.write_toml(exported.name, &exported.text)?,
        _ => out.write(exported.name, exported.text.as_bytes())?,
    }
    let written = out.join(exported.name);
    let mut stdout = format!("{written}\n{}\n{}\n", holds(args.format), fidelity(&identified, &exported.carried));
    exported.notes.iter().for_each(|note| stdout.push_str(&format!("note: {note}\n")));
    Ok(Outcome { stdout, status })
}

/// What a file of a format holds, and in which units.
fn holds(format: RobotFormat) -> &'static str {
    match format {
        RobotFormat::Urdf => "joint origins and axes from the base to the flange, in m and rad",
        RobotFormat::DhCsv => {
            "modified Denavit-Hartenberg parameters (alpha and a of the link before the joint), in mm and deg"
        }
        RobotFormat::Toml => "all of the robot, modified Denavit-Hartenberg parameters, in mm and deg",
        RobotFormat::RosKinematicsYaml => "each link's frame in the one before, in m and rad",
        RobotFormat::UrCalibration => {
            "what is added to the controller's own Denavit-Hartenberg parameters, in m and rad"
        }
    }
}

/// A robot file that is no export, such as the nominal one that `simulate` and `robot new` write under the same name,
/// is not replaced by a corrected one: the next identification would start from it.
fn spare_other_robots(path: &camino::Utf8Path, exported: &ExportedRobot) -> Result<()> {
    let Ok(standing) = std::fs::read_to_string(path) else { return Ok(()) };
    let is_export = standing.lines().take_while(|line| line.starts_with('#')).any(|line| line.contains("export robot"));
    if path.extension() != Some("toml") || standing == exported.text || is_export {
        return Ok(());
    }
    let message = format!("{path} is there already and is no export: it may be the nominal robot");
    Err(Error::NotExportable { message, hint: "another `--out`, or `--force`".to_owned() }.into())
}

fn export(args: &ExportRobot, identified: &Identified) -> Result<ExportedRobot> {
    let (robot, plain) = (&identified.robot, || identified.plain());
    Ok(match (args.format, &args.nominal_urdf) {
        (RobotFormat::Toml, _) => {
            let text = file::to_toml_checked(robot, identified.check.as_ref());
            ExportedRobot { name: "robot.toml", text, carried: robot.clone(), notes: Vec::new() }
        }
        (RobotFormat::Urdf, None) => urdf_plain::build(&plain()),
        (RobotFormat::Urdf, Some(path)) => {
            let urdf = Urdf::read(path)?;
            let chain = urdf.chain(args.tip.as_deref())?;
            let hint = format!(
                "`stereocal robot import {path}` makes the robot file that belongs to it: identify with that, or leave --nominal-urdf out"
            );
            urdf_corrected::correct(&urdf, &chain, &plain())
                .map_err(|message| Error::NotExportable { message, hint })?
        }
        (RobotFormat::DhCsv, _) => table(&along_axes(plain())),
        (RobotFormat::RosKinematicsYaml, _) => {
            let robot = along_axes(plain());
            turning(&robot, "kinematics files hold revolute joints only")?;
            ros_kinematics::build(&robot)
        }
        (RobotFormat::UrCalibration, _) => {
            let nominal = nominal(args, robot)?;
            turning(robot, "a UR's joints all turn")?;
            ur_calibration::build(&plain(), &nominal.without_corrections())
        }
    })
}

/// The same robot with all joints counted along their axes.
fn along_axes(robot: Robot) -> Robot {
    if robot.joints.iter().all(|j| j.sign > 0.0) {
        return robot;
    }
    let flange = robot.root_from_flange(&vec![0.0; robot.joints.len()]);
    axes::robot(&robot.name, &robot.axes(), &flange)
}

fn table(robot: &Robot) -> ExportedRobot {
    let ends = [("[base]", robot.ends.root_from_frame0), ("[flange]", robot.ends.last_frame_from_flange)];
    let missing = ends.iter().filter(|(_, t)| *t != Transform::identity());
    let notes =
        missing.map(|(name, _)| format!("the constant {name} of the robot file has no place in a table: add it"));
    let mut notes: Vec<String> = notes.collect();
    if robot.tool_mm != Vector3::zeros() {
        let tool = tool_text(&robot.tool_mm.into());
        notes.push(format!(
            "the tool, {tool} mm in the last frame, has no place in a table: add it in the other program"
        ));
    }
    ExportedRobot { name: "robot.csv", text: dh_csv::to_csv(robot), carried: robot.clone(), notes }
}

fn turning(robot: &Robot, why: &str) -> Result<()> {
    let Some(joint) = robot.joints.iter().position(|j| j.slides) else { return Ok(()) };
    let message = format!("joint {} slides; {why}", joint + 1);
    Err(Error::NotExportable { message, hint: "`--format urdf` carries it".to_owned() }.into())
}

/// The robot that deviations are counted from.
fn nominal(args: &ExportRobot, robot: &Robot) -> Result<Robot> {
    let nominal = match &args.nominal {
        Some(path) => file::read(path)?,
        None => {
            let arm = if let [arm] = catalogue::names::meant(&robot.name)[..] { catalogue::robot(arm) } else { None };
            arm.ok_or_else(|| Error::NotExportable {
                message: format!("nominal robot unknown: no common arm is called `{}`", robot.name),
                hint: "`--nominal FILE` names the nominal robot file".to_owned(),
            })?
        }
    };
    if nominal.joints.len() != robot.joints.len() {
        let count = |robot: &Robot| robot.joints.len().to_string();
        return Err(Error::Different { identified: count(robot), nominal: count(&nominal) }.into());
    }
    Ok(nominal)
}

/// A robot, what its file says of its use, and the ranges of its joints over which it was identified, where they are
/// known.
struct Identified {
    robot: Robot,
    check: Option<Check>,
    over: Option<Vec<(f64, f64)>>,
}

impl Identified {
    /// With the ranges in which it is to be met.
    fn met(&self) -> Robot {
        self.over.as_ref().map_or_else(|| self.robot.clone(), |ranges| self.robot.within(ranges))
    }

    /// The nearest plain chain there, with its own limits.
    fn plain(&self) -> Robot {
        let mut plain = self.met().without_corrections();
        plain.joints.iter_mut().zip(&self.robot.joints).for_each(|(plain, own)| plain.limits_rad = own.limits_rad);
        plain
    }
}

/// How well the file carries the robot.
fn fidelity(identified: &Identified, carried: &Robot) -> String {
    let robot = &identified.robot;
    let off = Residual::between(&identified.met(), carried);
    let over = if identified.over.is_some() { "the ranges that were measured" } else { "the joints' ranges" };
    if off.max_mm < ROUNDING_MM {
        return format!("flange poses equal to {:.0e} mm over {over}", off.max_mm.max(1e-12));
    }
    let terms = [
        ("gravity", !robot.corrections.gravity.is_empty() && carried.corrections.gravity.is_empty()),
        ("bending", !robot.corrections.bending.is_empty() && carried.corrections.bending.is_empty()),
        ("harmonics", !robot.corrections.harmonics.is_empty() && carried.corrections.harmonics.is_empty()),
        ("wobble", !robot.corrections.wobble.is_empty() && carried.corrections.wobble.is_empty()),
        ("couplings", !robot.corrections.couplings.is_empty() && carried.corrections.couplings.is_empty()),
    ];
    let lost: Vec<&str> = terms.iter().filter(|(_, lost)| *lost).map(|(name, _)| *name).collect();
    let (why, hint) = match lost.is_empty() {
        true => ("the format has no place for all of the robot's constants".to_owned(), ""),
        false => (
            format!("the format has no place for {}: refitted over {over}", lost.join(" and ")),
            "\nhint: `identify --extensions none` finds the constants that this format can hold",
        ),
    };
    format!(
        "{why}; remaining error: {:.4} mm on average, {:.4} mm and {:.4} mrad at most{hint}",
        off.mean_mm,
        off.max_mm,
        1e3 * off.max_rad
    )
}
