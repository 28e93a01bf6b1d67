//! A Denavit-Hartenberg table as CSV: `alpha_deg,a_mm,theta_deg,d_mm`, a row a joint from the base, optionally `beta_deg` and
//! `min_deg,max_deg`.
//!
//! A table in radians or metres has the same form and is refused by its numbers: no arm has twists of 1.57 degrees at every
//! elbow, and none is 0.4 mm long.

use std::fmt::Write as _;

use camino::Utf8Path;

use crate::csv_table::Table;
use crate::files::Result;
use crate::robot::Robot;
use crate::robot::catalogue::{Convention, Row, from_rows};

const HINT: &str = "a row a joint, from the base: alpha_deg,a_mm,theta_deg,d_mm (deg and mm)";

/// Longest link that is taken for metres, mm: a toy's.
const METRES: f64 = 3.0;

/// How near an angle must be to a multiple of a quarter turn in radians to be taken for one.
const QUARTER: f64 = 2e-3;

/// Reads a table; `name` becomes the robot's name.
pub fn read(path: &Utf8Path, name: &str, convention: Convention) -> Result<Robot> {
    let table = Table::read(path, "the table of Denavit-Hartenberg parameters", HINT)?;
    let columns = ["alpha_deg", "a_mm", "theta_deg", "d_mm"].map(|name| find(&table, name));
    let [alpha, a, theta, d] = columns;
    let columns = [alpha?, a?, theta?, d?];
    let mut rows: Vec<Row> = Vec::with_capacity(table.rows.len());
    for (line, row) in &table.rows {
        let mut numbers = [0.0; 4];
        for (number, &column) in numbers.iter_mut().zip(&columns) {
            *number = table.number(*line, row, column)?;
        }
        rows.push(numbers);
    }
    check_units(&table, &rows)?;
    let mut robot = from_rows(name, convention, &rows);
    let optional = |name: &str| table.column(name);
    for (joint, (line, row)) in robot.joints.iter_mut().zip(&table.rows) {
        if let Some(column) = optional("beta_deg").filter(|&c| !row[c].is_empty()) {
            if convention == Convention::Classic {
                let message = "beta_deg stands beside alpha and a of a modified table".to_owned();
                return Err(table.refuse_with(1, message, Some("`--dh modified` reads it")));
            }
            joint.beta_rad = table.number(*line, row, column)?.to_radians();
        }
        if let (Some(low), Some(high)) = (optional("min_deg"), optional("max_deg"))
            && !(row[low].is_empty() && row[high].is_empty())
        {
            let (low, high) = (table.number(*line, row, low)?, table.number(*line, row, high)?);
            if low >= high {
                return Err(table.refuse(*line, format!("min_deg {low} is not below max_deg {high}")));
            }
            joint.limits_rad = Some((low.to_radians(), high.to_radians()));
        }
    }
    Ok(robot)
}

fn find(table: &Table, name: &str) -> Result<usize> {
    if let Some(column) = table.column(name) {
        return Ok(column);
    }
    let stem = name.split('_').next().unwrap_or(name);
    let other = table.header.iter().find(|h| h.to_lowercase().split('_').next() == Some(stem));
    let found = match other {
        Some(other) => format!("the column `{other}` is there, `{name}` was needed"),
        None => format!("no column `{name}`; the header has: {}", table.header.join(", ")),
    };
    let unit = if name.ends_with("deg") { "degrees" } else { "mm" };
    let hint = format!("convert the column to {unit} and call it {name}; {HINT}");
    Err(table.refuse_with(1, found, Some(&hint)))
}

/// Refuses radians and metres under the names of degrees and mm.
fn check_units(table: &Table, rows: &[Row]) -> Result<()> {
    let angles = || rows.iter().enumerate().flat_map(|(i, r)| [(i, "alpha_deg", r[0]), (i, "theta_deg", r[2])]);
    let quarter = |v: f64| {
        let turns = v / std::f64::consts::FRAC_PI_2;
        turns.round() != 0.0 && (turns - turns.round()).abs() < QUARTER
    };
    let small = angles().all(|(_, _, v)| v.abs() < 2.0 * std::f64::consts::TAU);
    if small && let Some((i, name, v)) = angles().find(|(_, _, v)| quarter(*v)) {
        let message = format!(
            "`{name}` is {v}, and no angle of the table is above {:.2}: these are radians; degrees were needed",
            angles().map(|(_, _, v)| v.abs()).fold(0.0, f64::max)
        );
        let hint = format!("multiply alpha and theta by 180/pi: {v} rad are {:.4} deg", v.to_degrees());
        return Err(table.refuse_with(table.rows[i].0, message, Some(&hint)));
    }
    let longest = rows.iter().flat_map(|r| [r[1].abs(), r[3].abs()]).fold(0.0, f64::max);
    if longest > 0.0 && longest < METRES {
        let message = format!("the longest a or d of the table is {longest} mm: these are metres; mm were needed");
        return Err(table.refuse_with(1, message, Some("multiply a and d by 1000")));
    }
    Ok(())
}

/// The modified table of a robot: what a table can carry.
pub fn to_csv(robot: &Robot) -> String {
    let beta = robot.joints.iter().any(|j| j.beta_rad != 0.0);
    let limits = robot.joints.iter().any(|j| j.limits_rad.is_some());
    let mut text = "alpha_deg,a_mm,theta_deg,d_mm".to_owned();
    text.push_str(if beta { ",beta_deg" } else { "" });
    text.push_str(if limits { ",min_deg,max_deg\n" } else { "\n" });
    for j in &robot.joints {
        let _ = write!(text, "{},{},{},{}", j.alpha_rad.to_degrees(), j.a_mm, j.theta_rad.to_degrees(), j.d_mm);
        if beta {
            let _ = write!(text, ",{}", j.beta_rad.to_degrees());
        }
        match j.limits_rad {
            Some((low, high)) => {
                let _ = write!(text, ",{},{}", low.to_degrees(), high.to_degrees());
            }
            None if limits => text.push_str(",,"),
            None => {}
        }
        text.push('\n');
    }
    text
}
