//! A Denavit-Hartenberg table: a row a joint from the base, columns alpha, a, theta and d in any order, optionally `beta_deg` and
//! `min_deg,max_deg`.
//!
//! In: a table in any form, with names of its columns or without, or the text of a program or of settings ([`dh_text`]). Cells may be formulas (`pi/2`,
//! `q2 - 90`). Out: every way to read it, each with what was taken; with names of columns
//! there is one. Angles are radians where the names say so, or where none is named, none exceeds 2 pi and one is a quarter turn in radians;
//! lengths are metres where the longest is shorter than a toy's. What goes wrong: names that say degrees or mm over radians or metres, which is
//! refused: no arm has twists of 1.57 degrees at every elbow, and none is 0.4 mm long.

mod units;

use std::fmt::Write as _;

use camino::Utf8Path;

use self::units::units;
use super::dh_text;
use crate::files::{self, Result};
use crate::robot::Robot;
use crate::robot::catalogue::{Convention, Row, from_rows};
use crate::tables::expression::{self, Value};
use crate::tables::header::{self, Headed};
use crate::tables::names::{self, Unit};
use crate::tables::{Fields, Form, Grid};

const HINT: &str =
    "a row a joint, from the base: alpha_deg,a_mm,theta_deg,d_mm (deg and mm), or alpha, a, d, theta in any order";

/// What the columns of a row are called, in the order of [`Row`].
const NAMES: [&str; 4] = ["alpha", "a", "theta", "d"];

/// The same with units, as this program writes them.
const OWN: [&str; 4] = ["alpha_deg", "a_mm", "theta_deg", "d_mm"];

/// Other words for them.
const WORDS: [&[&str]; 4] = [
    &["alpha", "α", "twist"],
    &["a", "r", "length", "linklength"],
    &["theta", "θ", "th", "q", "angle"],
    &["d", "offset", "linkoffset"],
];

/// Words that may stand beside a parameter's letter.
const SAID_BESIDE: [&str; 5] = ["twist", "length", "angle", "offset", "linkoffset"];

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
    /// The convention that words or names say.
    stated: Option<Convention>,
    /// Whether the names are this program's own, whose tables are modified ones.
    own: bool,
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

    /// The convention: what words, names or a column `beta_deg` say, else what the table's ends show. An arm stands on its base: a first row with a twist
    /// or a length and a last one without is a classic table's, the other way round a modified one's. `None` where neither says it.
    pub fn convention(&self) -> Option<Convention> {
        if self.is_modified() {
            return Some(Convention::Modified);
        }
        let ends = self.rows.first().zip(self.rows.last()).filter(|_| self.rows.len() > 2);
        let is_plain = |row: &Row| row[0] == 0.0 && row[1] == 0.0;
        let shown = || match ends.map(|(first, last)| (is_plain(first), is_plain(last)))? {
            (false, true) => Some(Convention::Classic),
            (true, false) => Some(Convention::Modified),
            _ => None,
        };
        self.stated.or_else(shown).or(self.own.then_some(Convention::Modified))
    }

    /// Whether it has a column that stands beside alpha and a of a modified table alone.
    pub fn is_modified(&self) -> bool {
        self.beta_deg.iter().any(Option::is_some)
    }
}

/// Extensions of files that are tables whatever stands in them.
const TABLES: [&str; 5] = ["csv", "tsv", "xlsx", "xls", "ods"];

/// The links of a program's or settings' text as a table; `None` where it has none.
fn of_text(path: &Utf8Path) -> Result<Option<Vec<Reading>>> {
    let grid =
        |rows: Vec<(u64, Fields)>| Grid { path: path.to_owned(), form: Form::Delimited(','), encoding: None, rows };
    let Ok(text) = files::read_text(path, "the table of Denavit-Hartenberg parameters", Some(HINT)) else {
        return Ok(None);
    };
    let links = dh_text::read(&text).map_err(|(line, message)| grid(Vec::new()).refuse(line, message, Some(HINT)))?;
    let Some(links) = links else {
        let Some(table) = dh_text::matrix(&text) else { return Ok(None) };
        let grid = grid(table.rows.clone());
        return Ok(Some(match table.names.map(|names| names.map(str::to_owned)) {
            Some(names) => {
                let at = NAMES.map(|name| names.iter().position(|n| n == name).unwrap_or(0));
                vec![reading(&grid, &table.rows, at, Some(&names))?]
            }
            None => without_names(&grid, &table.rows)?,
        }));
    };
    let unit = if links.radians { " [rad]" } else { "" };
    let names = [format!("alpha{unit}"), "a".to_owned(), format!("theta{unit}"), "d".to_owned()];
    let cells = |row: &Row| Fields::new(row.map(|v| v.to_string()).iter().map(String::as_str));
    let rows: Vec<(u64, Fields)> = links.rows.iter().map(|(line, row)| (*line, cells(row))).collect();
    let mut found = reading(&grid(rows.clone()), &rows, [0, 1, 2, 3], Some(&names))?;
    found.stated = links.convention;
    Ok(Some(vec![found]))
}

/// Every way to read a table; `columns` names them where it is given.
pub fn readings(path: &Utf8Path, columns: Option<&str>) -> Result<Vec<Reading>> {
    if !path.extension().is_some_and(|e| TABLES.iter().any(|table| e.eq_ignore_ascii_case(table)))
        && let Some(found) = of_text(path)?
    {
        return Ok(found);
    }
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
        None => without_names(grid, &rows),
    }
}

/// Every order that the columns of a table without names may have.
fn without_names(grid: &Grid, rows: &[(u64, Fields)]) -> Result<Vec<Reading>> {
    // Columns of words and of the joint's number are no parameters.
    let counts =
        |c: usize| rows.iter().enumerate().all(|(i, (_, r))| r[c] == i.to_string() || r[c] == (i + 1).to_string());
    let is_number = |c: usize| rows.iter().all(|(_, r)| value(&r[c]).is_some());
    let free: Vec<usize> = (0..rows[0].1.len()).filter(|&c| is_number(c) && !(counts(c) && rows.len() > 2)).collect();
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
        ORDERS.iter().filter_map(|order| reading(grid, rows, in_order(order), None).ok()).collect();
    let regular = |r: &&Reading| r.rows.iter().all(|row| row[0].abs() <= 180.0 && row[2].abs() <= 360.0);
    let likely: Vec<Reading> = readings.iter().filter(regular).cloned().collect();
    Ok(if likely.is_empty() { readings } else { likely })
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
        // `Link twist (alpha)`, `theta offset`: the letter says it.
        let letters: Vec<&String> = words.iter().filter(|w| !SAID_BESIDE.contains(&w.as_str())).collect();
        let is_it = |w: &String| WORDS[which].contains(&w.as_str());
        if letters.is_empty() { matches!(&words[..], [only] if is_it(only)) } else { letters.into_iter().all(is_it) }
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
    let name = ["<sub>", "</sub>"].iter().fold(name.to_owned(), |name, mark| name.replace(mark, " "));
    let (mut words, mut unit) = names::words(&name);
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

/// What a cell says: a number, or a formula.
fn value(cell: &str) -> Option<Value> {
    expression::evaluate(cell, &|_| None)
}

/// The number of a cell.
fn number(grid: &Grid, line: u64, row: &Fields, column: usize) -> Result<Value> {
    let refuse = || grid.refuse(line, format!("`{}` is not a number", &row[column]), Some(HINT));
    value(&row[column]).filter(|value| value.number.is_finite()).ok_or_else(refuse)
}

/// What a joint may have beside its parameters: `beta_deg`, and limits.
type Beside = (Vec<Option<f64>>, Vec<Option<(f64, f64)>>);

/// Columns beside the parameters, of a table with names.
fn beside(grid: &Grid, rows: &[(u64, Fields)], names: Option<&[String]>) -> Result<Beside> {
    let optional = |name: &str| names.and_then(|n| n.iter().position(|c| c.eq_ignore_ascii_case(name)));
    let (beta, low, high) = (optional("beta_deg"), optional("min_deg"), optional("max_deg"));
    let (mut beta_deg, mut limits_deg) = (Vec::new(), Vec::new());
    for (line, row) in rows {
        let of = |column: Option<usize>| match column.filter(|&c| !row[c].is_empty()) {
            Some(column) => number(grid, *line, row, column).map(|v| Some(v.number)),
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
    Ok((beta_deg, limits_deg))
}

/// The rows that turn: where some have the joint's variable for theta, a row at the end without one is a fixed flange, which the tool takes in.
fn turning<'a>(grid: &Grid, rows: &'a [(u64, Fields)], columns: [usize; 4]) -> Result<&'a [(u64, Fields)]> {
    let theta = columns[2];
    let turns = |row: &(u64, Fields)| value(&row.1[theta]).is_some_and(|v| v.variable);
    // What is no number, or slides, is said of the cell.
    let stands = |row: &&(u64, Fields)| columns.iter().all(|&c| value(&row.1[c]).is_some_and(|v| !v.variable));
    let Some(last) = rows.iter().rposition(turns) else { return Ok(rows) };
    match rows[..last].iter().find(stands) {
        Some((line, row)) => {
            let message = format!(
                "theta is `{}`, but other rows have their joint's variable there: this one does not turn",
                &row[theta]
            );
            Err(grid.refuse(*line, message, Some("a row a joint; add what stands still to the row before")))
        }
        None if rows[last + 1..].iter().all(|row| stands(&row)) => Ok(&rows[..=last]),
        None => Ok(rows),
    }
}

fn reading(grid: &Grid, rows: &[(u64, Fields)], columns: [usize; 4], names: Option<&[String]>) -> Result<Reading> {
    let rows = turning(grid, rows, columns)?;
    let mut table: Vec<Row> = Vec::with_capacity(rows.len());
    let mut radians = false;
    for (line, row) in rows {
        let mut numbers = [0.0; 4];
        for (which, (slot, &column)) in numbers.iter_mut().zip(&columns).enumerate() {
            let value = number(grid, *line, row, column)?;
            if value.variable && which != 2 {
                let message =
                    format!("`{}`: the joint's variable is {}, so the joint slides", &row[column], NAMES[which]);
                return Err(grid.refuse(
                    *line,
                    message,
                    Some("a table has turning joints alone; `robot import` takes a sliding one from a URDF"),
                ));
            }
            radians |= value.radians && matches!(which, 0 | 2);
            *slot = value.number;
        }
        table.push(numbers);
    }
    let of_pi = |at: usize| (radians && matches!(at, 0 | 2)).then_some(Unit::Rad);
    let stated = |at: usize| names.and_then(|n| plain(&n[columns[at]]).1).or_else(|| of_pi(at));
    let angle = units(grid, rows, &table, [0, 2], [stated(0), stated(2)])?;
    let length = units(grid, rows, &table, [1, 3], [stated(1), stated(3)])?;
    for row in &mut table {
        *row = [angle.converted(row[0]), length.converted(row[1]), angle.converted(row[2]), length.converted(row[3])];
    }
    let (beta_deg, limits_deg) = beside(grid, rows, names)?;
    // `a(i-1)`, `alpha_{i-1}`: those of the link before.
    let before = |name: &String| {
        let bare: String = name.chars().filter(|c| c.is_alphanumeric() || matches!(c, '-' | '\u{2212}')).collect();
        ["i-1", "i\u{2212}1", "j-1", "n-1"].iter().any(|index| bare.contains(index))
    };
    let stated = names.filter(|n| before(&n[columns[0]]) || before(&n[columns[1]])).map(|_| Convention::Modified);
    let own = names.is_some_and(|n| columns.iter().zip(OWN).all(|(&c, own)| n[c].eq_ignore_ascii_case(own)));
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
    Ok(Reading { rows: table, beta_deg, limits_deg, said, columns, stated, own })
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
mod tests;
