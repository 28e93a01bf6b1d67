//! A Denavit-Hartenberg table: a row a joint from the base, columns alpha, a, theta and d in any order, optionally `beta_deg` and
//! `min_deg,max_deg`.
//!
//! In: a table in any form, with names of its columns or without. Out: every way to read it, each with what was taken; with names of columns
//! there is one. Angles are radians where the names say so, or where none is named, none exceeds 2 pi and one is a quarter turn in radians;
//! lengths are metres where the longest is shorter than a toy's. What goes wrong: names that say degrees or mm over radians or metres, which is
//! refused: no arm has twists of 1.57 degrees at every elbow, and none is 0.4 mm long.

use std::fmt::Write as _;

use camino::Utf8Path;

use crate::files::Result;
use crate::robot::Robot;
use crate::robot::catalogue::{Convention, Row, from_rows};
use crate::tables::header::{self, Headed};
use crate::tables::names::{self, Unit};
use crate::tables::{Fields, Grid};

const HINT: &str =
    "a row a joint, from the base: alpha_deg,a_mm,theta_deg,d_mm (deg and mm), or alpha, a, d, theta in any order";

/// Longest link that is taken for metres, mm: a toy's.
const METRES: f64 = 3.0;

/// How near an angle must be to a multiple of a quarter turn in radians to be taken for one.
const QUARTER: f64 = 2e-3;

/// What the columns of a row are called, in the order of [`Row`].
const NAMES: [&str; 4] = ["alpha", "a", "theta", "d"];

/// Other words for them.
const WORDS: [&[&str]; 4] = [
    &["alpha", "α", "twist"],
    &["a", "r", "length", "linklength"],
    &["theta", "θ", "th", "q", "angle"],
    &["d", "offset", "linkoffset"],
];

/// Orders in which tables without names are written.
const ORDERS: [[usize; 4]; 4] = [[0, 1, 3, 2], [0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 1, 0]];

/// A way to read a table.
#[derive(Debug, Clone)]
pub struct Reading {
    /// In deg and mm.
    rows: Vec<Row>,
    /// Other columns, of a table with names.
    beta_deg: Vec<Option<f64>>,
    limits_deg: Vec<Option<(f64, f64)>>,
    /// What was taken, for a sentence.
    pub said: String,
    /// The columns' names in their order, as `--columns` has them.
    pub columns: String,
}

impl Reading {
    /// The robot of this table.
    pub fn robot(&self, name: &str, convention: Convention) -> Robot {
        let mut robot = from_rows(name, convention, &self.rows);
        for (joint, (beta, limits)) in robot.joints.iter_mut().zip(self.beta_deg.iter().zip(&self.limits_deg)) {
            joint.beta_rad = beta.map_or(0.0, f64::to_radians);
            joint.limits_rad = limits.map(|(low, high)| (low.to_radians(), high.to_radians()));
        }
        robot
    }

    /// Whether it has a column that stands beside alpha and a of a modified table alone.
    pub fn is_modified(&self) -> bool {
        self.beta_deg.iter().any(Option::is_some)
    }
}

/// Every way to read a table; `columns` names them where it is given.
pub fn readings(path: &Utf8Path, columns: Option<&str>) -> Result<Vec<Reading>> {
    readings_of(&Grid::read(path, "the table of Denavit-Hartenberg parameters", HINT)?, columns)
}

fn readings_of(grid: &Grid, columns: Option<&str>) -> Result<Vec<Reading>> {
    let Headed { names, rows } = header::split(grid)?;
    let given = columns.map(|c| c.split(',').map(|word| word.trim().to_owned()).collect::<Vec<_>>());
    match given.or(names) {
        Some(names) => {
            let found = NAMES.map(|name| find(grid, &names, name));
            let [alpha, a, theta, d] = found;
            let columns = [alpha?, a?, theta?, d?];
            Ok(vec![reading(grid, &rows, columns, Some(&names))?])
        }
        None => {
            // Columns of words and of the joint's number are no parameters.
            let counts = |c: usize| {
                rows.iter().enumerate().all(|(i, (_, r))| r[c] == i.to_string() || r[c] == (i + 1).to_string())
            };
            let is_number = |c: usize| rows.iter().all(|(_, r)| r[c].parse::<f64>().is_ok());
            let free: Vec<usize> =
                (0..rows[0].1.len()).filter(|&c| is_number(c) && !(counts(c) && rows.len() > 2)).collect();
            let [w, x, y, z] = free[..] else {
                let message = format!("{} columns of numbers without names; four are needed", free.len());
                return Err(grid.refuse(rows[0].0, message, Some(HINT)));
            };
            let columns = [w, x, y, z];
            let in_order = |order: &[usize; 4]| {
                let mut of_row = [0; 4];
                order.iter().zip(columns).for_each(|(&which, column)| of_row[which] = column);
                of_row
            };
            // Lengths in the place of angles are no multiples of a quarter turn.
            let readings: Vec<Reading> =
                ORDERS.iter().filter_map(|order| reading(grid, &rows, in_order(order), None).ok()).collect();
            let regular = |r: &&Reading| r.rows.iter().all(|row| row[0].abs() <= 180.0 && row[2].abs() <= 360.0);
            let likely: Vec<Reading> = readings.iter().filter(regular).cloned().collect();
            Ok(if likely.is_empty() { readings } else { likely })
        }
    }
}

/// The column of a parameter.
fn find(grid: &Grid, names: &[String], wanted: &str) -> Result<usize> {
    let unit = if matches!(wanted, "alpha" | "theta") { "deg" } else { "mm" };
    let own = format!("{wanted}_{unit}");
    if let Some(at) = names.iter().position(|n| n.eq_ignore_ascii_case(&own)) {
        return Ok(at);
    }
    let which = NAMES.iter().position(|n| *n == wanted).unwrap_or(0);
    let says = |name: &String| {
        let words = plain(name).0;
        words.first().is_some_and(|w| WORDS[which].contains(&w.as_str())) && words.len() == 1
    };
    let found: Vec<usize> = (0..names.len()).filter(|&i| says(&names[i])).collect();
    let line = grid.rows.first().map_or(1, |(line, _)| *line);
    match found[..] {
        [at] => Ok(at),
        [] => Err(grid.refuse(line, format!("no column `{own}`; the header has: {}", names.join(", ")), Some(HINT))),
        _ => Err(grid.refuse(line, format!("two columns `{wanted}`"), Some(HINT))),
    }
}

/// Words of a name without indices and units, and its unit.
fn plain(name: &str) -> (Vec<String>, Option<Unit>) {
    let (mut words, mut unit) = names::words(name);
    if words.len() > 1
        && let Some(found) = words.last().and_then(|w| Unit::of(w))
    {
        unit = unit.or(Some(found));
        words.pop();
    }
    words.retain(|w| {
        !w.chars().all(|c| c.is_ascii_digit()) && !matches!(w.as_str(), "i" | "j" | "n" | "link" | "joint")
    });
    (words, unit)
}

fn reading(grid: &Grid, rows: &[(u64, Fields)], columns: [usize; 4], names: Option<&[String]>) -> Result<Reading> {
    let number = |line: u64, row: &Fields, column: usize| match row[column].parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(grid.refuse(line, format!("`{}` is not a number", &row[column]), Some(HINT))),
    };
    let mut table: Vec<Row> = Vec::with_capacity(rows.len());
    for (line, row) in rows {
        let mut numbers = [0.0; 4];
        for (slot, &column) in numbers.iter_mut().zip(&columns) {
            *slot = number(*line, row, column)?;
        }
        table.push(numbers);
    }
    let stated = |at: usize| names.and_then(|n| plain(&n[columns[at]]).1);
    let angle = units(grid, rows, &table, [0, 2], [stated(0), stated(2)])?;
    let length = units(grid, rows, &table, [1, 3], [stated(1), stated(3)])?;
    for row in &mut table {
        *row = [angle.converted(row[0]), length.converted(row[1]), angle.converted(row[2]), length.converted(row[3])];
    }
    let optional = |name: &str| names.and_then(|n| n.iter().position(|c| c.eq_ignore_ascii_case(name)));
    let (beta, low, high) = (optional("beta_deg"), optional("min_deg"), optional("max_deg"));
    let (mut beta_deg, mut limits_deg) = (Vec::new(), Vec::new());
    for (line, row) in rows {
        let of = |column: Option<usize>| match column.filter(|&c| !row[c].is_empty()) {
            Some(column) => number(*line, row, column).map(Some),
            None => Ok(None),
        };
        beta_deg.push(of(beta)?);
        limits_deg.push(match (of(low)?, of(high)?) {
            (Some(low), Some(high)) if low >= high => {
                return Err(grid.refuse(*line, format!("min_deg {low} is not below max_deg {high}"), None));
            }
            (Some(low), Some(high)) => Some((low, high)),
            _ => None,
        });
    }
    let mut order: Vec<(usize, &str)> = columns.iter().copied().zip(NAMES).collect();
    order.sort_unstable();
    let columns = order.iter().map(|(_, name)| *name).collect::<Vec<_>>().join(",");
    let header = if names.is_some() { "" } else { ", no header" };
    let said = format!(
        "{} joints; columns {columns}, angles in {}, lengths in {}{header}",
        rows.len(),
        angle.word(),
        length.word()
    );
    Ok(Reading { rows: table, beta_deg, limits_deg, said, columns })
}

/// The unit of two columns: what their names say, else what the numbers look like.
fn units(
    grid: &Grid,
    rows: &[(u64, Fields)],
    table: &[Row],
    at: [usize; 2],
    stated: [Option<Unit>; 2],
) -> Result<Unit> {
    let angles = at[0] == 0;
    let all = || table.iter().enumerate().flat_map(|(i, r)| at.map(|k| (i, r[k])));
    let largest = all().map(|(_, v)| v.abs()).fold(0.0, f64::max);
    let quarter = |v: f64| {
        let turns = v / std::f64::consts::FRAC_PI_2;
        turns.round() != 0.0 && (turns - turns.round()).abs() < QUARTER
    };
    let odd = match angles {
        true => all().find(|(_, v)| quarter(*v)).filter(|_| largest < 2.0 * std::f64::consts::TAU),
        false => all().find(|(_, v)| v.abs() == largest).filter(|_| largest > 0.0 && largest < METRES),
    };
    let (usual, other) = if angles { (Unit::Deg, Unit::Rad) } else { (Unit::Mm, Unit::M) };
    match (stated[0].or(stated[1]), odd) {
        (Some(unit), Some((row, v))) if unit == usual => {
            let (what, factor) = if angles { ("radians", "180/pi") } else { ("metres", "1000") };
            let message = format!(
                "the names say {}, but {v} is none and no number of these columns is above {largest:.2}: these are {what}",
                unit.word()
            );
            let hint = format!(
                "multiply the columns by {factor}, or call them {} and {} with `[{}]`",
                NAMES[at[0]],
                NAMES[at[1]],
                other.word()
            );
            Err(grid.refuse(rows[row].0, message, Some(&hint)))
        }
        (Some(unit), _) => Ok(unit),
        (None, Some(_)) => Ok(other),
        (None, None) => Ok(usual),
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Result<Vec<Reading>> {
        let folder = tempfile::tempdir().unwrap();
        let path = camino::Utf8PathBuf::from_path_buf(folder.path().join("dh.csv")).unwrap();
        std::fs::write(&path, text).unwrap();
        readings(&path, None)
    }

    #[test]
    fn one_table_in_all_its_forms() {
        let expected = vec![[0.0, 0.0, 0.0, 487.0], [-90.0, 85.0, -90.0, 0.0], [0.0, 640.0, 0.0, 12.5]];
        for text in [
            "alpha, a, d, theta\n0, 0, 487, 0\n-90, 85, 0, -90\n0, 640, 12.5, 0\n",
            "theta_deg;d_mm;a_mm;alpha_deg\n0;487;0;0\n-90;0;85;-90\n0;12,5;640;0\n",
            "joint,alpha [rad],a [m],theta [rad],d [m]\n1,0,0,0,0.487\n2,-1.5707963267948966,0.085,-1.5707963267948966,0\n3,0,0.64,0,0.0125\n",
            "d\ttheta\talpha\ta\n0.487\t0\t0\t0\n0\t-1.5707963267948966\t-1.5707963267948966\t0.085\n0.0125\t0\t0\t0.64\n",
        ] {
            let found = all(text).unwrap();
            assert_eq!(found.len(), 1, "{text}");
            for (row, expected) in found[0].rows.iter().zip(&expected) {
                assert!(row.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{text}: {row:?}");
            }
        }
    }

    #[test]
    fn without_names_every_order_that_could_be_is_offered() {
        let found = all("0, 0, 487, 0\n-90, 85, 0, -90\n0, 640, 12.5, 0\n").unwrap();
        assert!(found.len() > 1 && found.iter().any(|r| r.columns == "alpha,a,d,theta"), "{found:?}");
        let said = |text: &str| crate::diagnostic::report(&all(text).unwrap_err());
        assert!(said("alpha_deg,a_mm,theta_deg,d_mm\n1.5708,85,0,0\n0,640,1.5708,12\n").contains("radians"));
        assert!(said("alpha_deg,a_mm,theta_deg,d_mm\n90,0.085,0,0\n0,0.640,0,0\n").contains("metres"));
        assert!(said("alpha,a,theta\n90,85,0\n0,640,0\n").contains("no column `d_mm`"));
    }
}
