//! Targets of `compensate` as CSV: `name` and readings, or poses of the tool.
//!
//! Readings are `j1_deg..jN_deg` (`jN_mm` where a joint slides); poses `x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad`, with
//! readings beside them that say the posture where they are not empty.

use std::fmt::Write as _;

use camino::Utf8Path;

use crate::compensate::{Target, pose};
use crate::csv_table::{Fields, Table, quoted};
use crate::files::Result;
use crate::measurements::{Source, reading_name};
use crate::progress;
use crate::robot::Robot;

const HINT: &str =
    "a row a target: name,j1_deg,...,jN_deg, or name,x_mm,y_mm,z_mm,rx_rad,ry_rad,rz_rad (optionally j1_deg,...)";

const ROTATION_HINT: &str =
    "rx_rad,ry_rad,rz_rad are a rotation vector: the axis of the turn, as long as the angle in radians";

#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub name: String,
    pub line: u64,
    /// What it asks for.
    pub target: Target,
    /// The readings that were given, as the file has them, deg (mm).
    pub given: Option<Vec<f64>>,
}

/// Reads targets for a robot; says what was taken of columns that have other names than these.
pub fn read(path: &Utf8Path, robot: &Robot) -> Result<Vec<Row>> {
    let table = Table::read(path, "targets file", HINT);
    let own = |table: &Table| ["j1_deg", "j1_mm", "x_mm"].iter().any(|name| table.column(name).is_some());
    let table = match table {
        Ok(table) if own(&table) => table,
        Err(e) if path.is_dir() || matches!(e, crate::files::Error::Missing { .. }) => return Err(e),
        _ => return of_other_names(path, robot),
    };
    // `plan` and `measure` call it a pose.
    let name = match table.column("pose") {
        Some(pose) if table.column("name").is_none() => pose,
        _ => table.require("name")?,
    };
    let columns = ["x_mm", "y_mm", "z_mm", "rx_rad", "ry_rad", "rz_rad"];
    let poses: Vec<usize> = columns.iter().filter_map(|c| table.column(c)).collect();
    if !(poses.is_empty() || poses.len() == columns.len()) {
        let missing: Vec<&str> = columns.into_iter().filter(|c| table.column(c).is_none()).collect();
        let message = format!("a pose has the columns {}; there is no {}", columns.join(","), missing.join(", "));
        return Err(table.refuse_with(1, message, Some(HINT)));
    }
    let has_joints = poses.is_empty() || table.column("j1_deg").or(table.column("j1_mm")).is_some();
    let joints = if has_joints { joint_columns(&table, robot)? } else { Vec::new() };
    let row = |(line, row): &(u64, Fields)| {
        let given = !joints.is_empty() && (poses.is_empty() || joints.iter().any(|&c| !row[c].is_empty()));
        let numbers =
            |columns: &[usize]| columns.iter().map(|&c| table.number(*line, row, c)).collect::<Result<Vec<_>>>();
        let given = given.then(|| numbers(&joints)).transpose()?;
        let near_rad = given.as_ref().map(|readings| radians(readings, robot));
        let target = match (poses.is_empty(), near_rad) {
            (true, readings) => Target::Readings(readings.unwrap_or_default()),
            (false, near_rad) => {
                let numbers = numbers(&poses)?;
                let turn_rad = numbers[3].hypot(numbers[4]).hypot(numbers[5]);
                if turn_rad > std::f64::consts::TAU {
                    let message =
                        format!("a tool turned by {turn_rad:.4} rad, more than a whole turn: are these degrees?");
                    return Err(table.refuse_with(*line, message, Some(ROTATION_HINT)));
                }
                Target::Pose { root_from_tool: pose(&numbers), near_rad }
            }
        };
        Ok(Row { name: row[name].to_owned(), line: *line, target, given })
    };
    table.rows.iter().map(row).collect()
}

/// Readings in a table whose columns have other names, or none: as measurements are read.
fn of_other_names(path: &Utf8Path, robot: &Robot) -> Result<Vec<Row>> {
    let (poses, said) = Source::of(path.to_owned()).readings(robot)?;
    let row = |(line, name, given): (u64, String, Vec<f64>)| Row {
        name,
        line,
        target: Target::Readings(radians(&given, robot)),
        given: Some(given),
    };
    progress::note(said);
    Ok(poses.into_iter().map(row).collect())
}

fn joint_columns(table: &Table, robot: &Robot) -> Result<Vec<usize>> {
    let (columns, slides) = table.joint_columns()?;
    if columns.len() != robot.joints.len() {
        let message = format!("{} columns of readings, but the robot has {} joints", columns.len(), robot.joints.len());
        return Err(table.refuse_with(1, message, Some(HINT)));
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        if slides.get(i).copied().unwrap_or(false) != joint.slides {
            let needed = reading_name(i, joint.slides);
            return Err(table.refuse(1, format!("no column `{needed}`, as the robot's joint {} needs", i + 1)));
        }
    }
    Ok(columns)
}

/// Readings as a file has them, deg (mm), in rad (mm).
pub fn radians(readings: &[f64], robot: &Robot) -> Vec<f64> {
    let reading = |(value, joint): (&f64, &crate::robot::Joint)| if joint.slides { *value } else { value.to_radians() };
    readings.iter().zip(&robot.joints).map(reading).collect()
}

/// `compensated.csv`: a row a target with its readings, deg (mm), where there are any, and `ok` or the reason.
pub fn to_csv<'a>(robot: &Robot, rows: impl Iterator<Item = (&'a str, Option<Vec<f64>>, String)>) -> String {
    let mut text = String::from("name");
    for (j, joint) in robot.joints.iter().enumerate() {
        let _ = write!(text, ",{}", reading_name(j, joint.slides));
    }
    text.push_str(",status\n");
    for (name, readings, status) in rows {
        text.push_str(&quoted(name));
        for j in 0..robot.joints.len() {
            let reading = readings.as_ref().and_then(|r| r.get(j)).map_or_else(String::new, f64::to_string);
            let _ = write!(text, ",{reading}");
        }
        let _ = writeln!(text, ",{}", quoted(&status));
    }
    text
}
