//! The table of a file, whatever it is: a sheet, a text of rows, a document with a table in it, a program or settings.

use camino::Utf8Path;

use super::document::{alone, without_entities};
use super::latex;
use super::names::{HINT, named};
use super::offsets;
use super::prepared;
use super::reading::{Reading, reading};
use super::table::Table;
use super::units::is_turn;
use crate::files::{self, Result};
use crate::formats::robots::dh_text::{self, Known, Links, Text};
use crate::formats::robots::dh_words::Words;
use crate::formats::robots::ur_calibration;
use crate::tables::expression::{self, Value};
use crate::tables::header::{self, Headed};
use crate::tables::names::Unit;
use crate::tables::{Fields, Form, Grid};

/// What flags say of a table.
#[derive(Debug, Clone, Copy, Default)]
pub struct Asked<'a> {
    /// The columns' names in their order.
    pub columns: Option<&'a str>,
    /// Of angles and of lengths.
    pub units: [Option<Unit>; 2],
}

const WHAT: &str = "the table of Denavit-Hartenberg parameters";

/// Orders in which tables without names are written.
const ORDERS: [[usize; 4]; 4] = [[0, 1, 3, 2], [0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 1, 0]];

/// Extensions of files that are tables whatever stands in them.
const TABLES: [&str; 5] = ["csv", "tsv", "xlsx", "xls", "ods"];

/// Extensions of programs.
const PROGRAMS: [&str; 14] = ["py", "m", "c", "cc", "cpp", "cxx", "h", "hpp", "js", "ts", "java", "rs", "jl", "ipynb"];

/// Extensions of texts in sentences, where words in brackets are no code.
const PROSE: [&str; 4] = ["md", "txt", "rst", "tex"];

/// Every way to read a file.
pub fn readings(path: &Utf8Path, asked: &Asked) -> Result<Vec<Reading>> {
    let is = |list: &[&str]| path.extension().is_some_and(|e| list.iter().any(|known| e.eq_ignore_ascii_case(known)));
    let text = match files::read_text(path, WHAT, Some(HINT)) {
        _ if is(&TABLES) => None,
        Ok(text) => Some(text),
        // Another encoding, or a spreadsheet.
        Err(_) => Grid::text(path, WHAT, HINT)?,
    };
    if text.as_deref().and_then(files::kind::kind) == Some("a robot file") {
        let hint = "`stereocal robot show FILE` says it in words; the commands take it by `--robot FILE`";
        let message = "this is a robot file already: there is nothing to import";
        return Err(files::Error::format(path, None, message, Some(hint)));
    }
    let Some(text) = text else { return of_grid(&Grid::read(path, WHAT, HINT)?, asked, None) };
    let text = dh_text::indexed(&without_entities(&text)).into_owned();
    let refuse = |(line, message): dh_text::Wrong| empty(path).refuse(line, message, Some(HINT));
    if (is(&PROSE) || text.trim_start().starts_with('\\'))
        && let Some(rows) = latex::table(&text).map_err(refuse)?
    {
        return of_grid(&Grid { rows, ..empty(path) }, asked, Some(Words::of(&text, "")));
    }
    let read = dh_text::read(&text, is(&PROSE)).map_err(refuse)?;
    let given = given(asked);
    if let (None, Some((line, what))) = (&read.links, ur_calibration::deviations(&text)) {
        return Err(empty(path).refuse(line, what, Some(ur_calibration::HINT)));
    }
    if let (Some(links), None) = (&read.links, &given) {
        let is_example = is(&PROSE) && !links.calls && !links.of_lists;
        let table = is_example.then(|| longer_table(path, &text, links, asked)).flatten();
        return table.map_or_else(|| Ok(vec![of_links(path, &read, links, asked)?]), Ok);
    }
    let width = given.as_ref().map_or(4, Vec::len);
    let mut matrix = dh_text::matrix(&text, &read.known, width).map_err(refuse)?;
    if matrix.is_none() && given.is_none() {
        // Without theta it is a robot's where its columns are named.
        let of_three = dh_text::matrix(&text, &read.known, 3).ok().flatten();
        matrix = of_three.filter(|matrix| matrix.names.is_some());
    }
    if let Some(matrix) = matrix {
        return of_matrix(path, &read, &matrix, asked);
    }
    if let Some((line, _)) = read.links.as_ref().and_then(|links| links.rows.first()) {
        let message = "the parameters have names of their own here, and no table has columns to name".to_owned();
        return Err(empty(path).refuse(*line, message, Some("leave out `--columns`")));
    }
    let of_rows =
        alone(path, &text).and_then(|text| of_grid(&Grid::of_text(path, text.into_owned())?, asked, Some(read.words)));
    let none = |error| if is(&PROGRAMS) && given.is_none() { nothing(path, &text, &read.known) } else { error };
    // Without names a program's numbers may be anything.
    let of_rows = match of_rows {
        Ok(ways) if is(&PROGRAMS) && given.is_none() && ways.len() > 1 => {
            return Err(nothing(path, &text, &read.known));
        }
        of_rows => of_rows,
    };
    of_rows.map_err(|error| read.incomplete.map_or_else(|| none(error), refuse))
}

/// What is said of a program in which nothing was found.
fn nothing(path: &Utf8Path, text: &str, known: &Known) -> files::Error {
    if let Some(three) = dh_text::matrix(text, known, 3).ok().flatten().filter(|m| m.rows.len() > 3) {
        let message = "rows of 3 numbers stand here, and what they are is not said".to_owned();
        let hint = "where theta is not written, `--columns a,alpha,d` in their order names them";
        return empty(path).refuse(three.rows[0].0, message, Some(hint));
    }
    let about = |line: &&str| ["alpha", "\u{3b1}", "dh", "DH", "enavit"].iter().any(|word| line.contains(word));
    let line = text.lines().position(|line| about(&line)).map_or(1, |at| at as u64 + 1);
    let message = "no Denavit-Hartenberg parameters were found that stand in this program as numbers: lists called alpha, a, d and theta, rows in \
                   brackets, parameters by name and calls of a toolbox are read";
    empty(path).refuse(line, message.to_owned(), Some(HINT))
}

/// The table of a document where it has more rows than links are made beside it, as an example has them.
fn longer_table(path: &Utf8Path, text: &str, links: &Links, asked: &Asked) -> Option<Vec<Reading>> {
    let table = alone(path, text).ok().filter(|table| table.len() < text.len())?;
    let mut ways = of_grid(&Grid::of_text(path, table.into_owned()).ok()?, asked, Some(Words::of(text, ""))).ok()?;
    let longer = ways.iter().all(|way| way.rows.len() > links.rows.len());
    let line = links.rows.first().map_or(1, |(line, _)| *line);
    for way in &mut ways {
        way.ends_said.push(format!(
            "the table of {} joints is taken, and the {} links from line {line} on, which the text makes beside it, are LEFT OUT",
            way.rows.len(),
            links.rows.len()
        ));
    }
    longer.then_some(ways)
}

/// The table in brackets of a program.
fn of_matrix(path: &Utf8Path, read: &Text, matrix: &dh_text::Matrix, asked: &Asked) -> Result<Vec<Reading>> {
    let given = given(asked);
    let grid = Grid { rows: matrix.rows.clone(), ..empty(path) };
    let names = given.clone().or(matrix.names.as_ref().map(|names| names.iter().map(|n| (*n).to_owned()).collect()));
    let table = Table {
        names: names.as_deref(),
        known: &read.known,
        joints: Some(&read.joints),
        ..table(&grid, &matrix.rows, asked, read.words, given.as_deref())
    };
    let variables = (0..matrix.rows.len()).any(|at| table.has_variable(at));
    let mut ways = ways(&table)?;
    for way in &mut ways {
        way.said += &beside_others(matrix);
        fits(path, read, way, variables)?;
        way.ends_said.extend(read.joints.apart(way.rows.len()));
    }
    Ok(ways)
}

/// Refuses rows of more joints than have limits, and says where readings are fewer.
fn fits(path: &Utf8Path, read: &Text, way: &mut Reading, variables: bool) -> Result<()> {
    let (limits, readings) = read.joints.fewer(way.rows.len());
    if let Some((line, message)) = limits.filter(|_| !variables) {
        let hint = "take the row that holds still out of the file and write it into the robot file's [base] or [flange], or give each joint its limits";
        return Err(empty(path).refuse(line, message, Some(hint)));
    }
    way.ends_said.extend(readings.filter(|_| !variables));
    Ok(())
}

/// Which table of several was taken.
fn beside_others(matrix: &dh_text::Matrix) -> String {
    let others: Vec<String> = matrix.others.iter().map(u64::to_string).collect();
    match &others[..] {
        [] => String::new(),
        _ => format!(
            ", the longest table, from line {}, of several: others begin at line {}; where one of them is the robot's, leave that one alone in the file",
            matrix.rows[0].0,
            others.join(", ")
        ),
    }
}

fn empty(path: &Utf8Path) -> Grid {
    Grid::empty(path, Form::Delimited(','), None)
}

/// The names of `--columns`.
fn given(asked: &Asked) -> Option<Vec<String>> {
    asked.columns.map(|c| c.split(',').map(|word| word.trim().to_owned()).collect())
}

fn table<'a>(
    grid: &'a Grid,
    rows: &'a [(u64, Fields)],
    asked: &Asked,
    words: Words,
    given: Option<&'a [String]>,
) -> Table<'a> {
    static NONE: Known = Known::new();
    Table { grid, rows, names: given, given, known: &NONE, words, still: &[], joints: None, units: asked.units }
}

/// The one way to read a table with names, or all of one without.
fn ways(table: &Table) -> Result<Vec<Reading>> {
    let Some(names) = table.names else { return without_names(table) };
    let (names, rows) = prepared::without_units(table, names)?;
    let table = Table { names: Some(&names), rows: &rows, ..*table };
    if !prepared::lacks_theta(&table, &names)? {
        return Ok(vec![reading(&table, offsets::columns(&table, &names)?)?]);
    }
    let (names, rows) = prepared::with_theta(&names, &rows);
    let mut found = reading(&Table { names: Some(&names), rows: &rows, ..table }, named(table.grid, &names)?)?;
    found.said += ", no column of theta: 0 beside each joint's variable";
    Ok(vec![found])
}

/// Every order that the columns of a table without names may have.
fn without_names(table: &Table) -> Result<Vec<Reading>> {
    let rows = table.rows;
    // Columns of words and of the joint's number are no parameters.
    let is_number = |c: &usize| rows.iter().all(|(_, r)| table.value(&r[*c]).is_some());
    // `A3` may be the label of a row, too.
    let is_axis = |c: &usize| rows.iter().all(|(_, r)| table.theta(&r[*c]).is_some());
    let counts = |c: &usize| table.counts(*c) && rows.len() > 2;
    let mut free: Vec<usize> = (0..rows[0].1.len()).filter(|c| is_number(c) && !counts(c)).collect();
    if free.len() == 3 {
        free = (0..rows[0].1.len()).filter(|c| is_axis(c) && !counts(c)).collect();
    }
    let [w, x, y, z] = free[..] else {
        let message = format!("{} columns of numbers without names; four are needed", free.len());
        let width = rows[0].1.len();
        let hint = match rows.len() > 1 && width >= 4 {
            true => format!(
                "`--columns NAME,NAME,...` names all {width} in their order, of them alpha, a, d and theta; `-` skips one"
            ),
            false => HINT.to_owned(),
        };
        return Err(table.grid.refuse(rows[0].0, message, Some(&hint)));
    };
    let (mut readings, wrong) = in_orders(table, [w, x, y, z], &ORDERS);
    // Lengths in the place of angles are no multiples of a quarter turn.
    let odd = |r: &Reading| r.rows.iter().any(|row| [row[1], row[3]].iter().any(|v| is_turn(v / r.length_mm)));
    let theta = [w, x, y, z]
        .into_iter()
        .position(|c| rows.iter().any(|(_, row)| table.theta(&row[c]).is_some_and(|v| v.variable)));
    if let Some(theta) = theta.filter(|_| readings.iter().all(odd)) {
        // Where variables show theta, the others may have any order.
        let with_theta = |[p, q, r]: [usize; 3]| {
            let mut order = vec![p, q, r];
            order.insert(theta, 2);
            [order[0], order[1], order[2], order[3]]
        };
        let orders = [[0, 1, 3], [0, 3, 1], [1, 0, 3], [1, 3, 0], [3, 0, 1], [3, 1, 0]].map(with_theta);
        let mut others = in_orders(table, [w, x, y, z], &orders).0;
        others.retain(|reading| !odd(reading));
        readings = if others.is_empty() { readings } else { others };
    }
    if let Some(wrong) = wrong.filter(|_| readings.is_empty()) {
        return Err(wrong);
    }
    let regular = |r: &&Reading| r.rows.iter().all(|row| row[0].abs() <= 180.0 && row[2].abs() <= 360.0);
    let likely: Vec<Reading> = readings.iter().filter(regular).cloned().collect();
    Ok(if likely.is_empty() { readings } else { likely })
}

/// The readings of these columns in each of the orders, and why the first that is none is refused.
fn in_orders(table: &Table, columns: [usize; 4], orders: &[[usize; 4]]) -> (Vec<Reading>, Option<files::Error>) {
    let (mut readings, mut wrong) = (Vec::new(), None);
    for order in orders {
        let mut of_row = [0; 4];
        order.iter().zip(columns).for_each(|(&which, column)| of_row[which] = column);
        match reading(table, of_row) {
            Ok(found) => readings.push(found),
            Err(e) => wrong = wrong.or(Some(e)),
        }
    }
    (readings, wrong)
}

/// The rows of a file; `words` are of all its text, where that is known.
fn of_grid(grid: &Grid, asked: &Asked, words: Option<Words>) -> Result<Vec<Reading>> {
    let given = given(asked);
    let grid = &prepared::rejoined(grid);
    let Headed { names, rows } = match given {
        Some(_) => header::rows_alone(grid, &is_number)?,
        None => header::split(grid, &is_number)?,
    };
    let width = rows.first().map_or(0, |(_, row)| row.len());
    if let Some(given) = given.as_ref().filter(|given| given.len() != width) {
        let line = rows.first().map_or(1, |(line, _)| *line);
        let message = format!("--columns names {} columns, but the table has {width}", given.len());
        return Err(grid.refuse(line, message, Some("`-` stands for a column that is none of alpha, a, d and theta")));
    }
    let prose = || grid.rows.iter().map(|(_, row)| row.iter().collect::<Vec<_>>().join(" ") + "\n").collect::<String>();
    let words = words.unwrap_or_else(|| Words::of(&prose(), ""));
    let names = given.clone().or(names);
    ways(&Table { names: names.as_deref(), ..table(grid, &rows, asked, words, given.as_deref()) })
}

/// Whether a cell is a number or a formula; a name alone, `theta`, is of a column.
fn is_number(cell: &str) -> bool {
    let cell = &dh_text::indexed(cell);
    header::is_number(cell)
        || prepared::of_unit(cell).is_some()
        || cell.contains(|c: char| c.is_ascii_digit() || c == '/')
            && expression::evaluate(cell, &|_| None).or_else(|| expression::counted_back(cell, &|_| None)).is_some()
}

/// Links whose parameters a text names.
fn of_links(path: &Utf8Path, read: &Text, links: &Links, asked: &Asked) -> Result<Reading> {
    let unit = |radians: bool| if radians { " [rad]" } else { "" };
    let angles = unit(links.rows.iter().any(|(_, row)| row[0].radians || row[2].radians));
    let mut limits = links.limits.iter().zip(&links.slides).filter(|(_, slides)| !**slides);
    let limits = unit(limits.any(|(limits, _)| limits.iter().flatten().any(|v| v.radians)));
    let names = [
        format!("alpha{angles}"),
        "a".to_owned(),
        format!("theta{angles}"),
        "d".to_owned(),
        "sigma".to_owned(),
        format!("min{limits}"),
        format!("max{limits}"),
    ];
    let cell = |v: &Value| if v.variable { format!("q + {}", v.number) } else { v.number.to_string() };
    let row = |joint: usize| {
        let (line, row) = &links.rows[joint];
        let limits = links.limits[joint].map(|limits| limits.map(|v| v.number)).filter(|[low, high]| low < high);
        let limits = limits.map_or([const { String::new() }; 2], |limits| limits.map(|v| v.to_string()));
        let sigma = u8::from(links.slides[joint]).to_string();
        (*line, Fields::new(row.iter().map(cell).chain([sigma]).chain(limits)))
    };
    let rows: Vec<(u64, Fields)> = (0..links.rows.len()).map(row).collect();
    let grid = Grid { rows: rows.clone(), ..empty(path) };
    let table = Table { names: Some(&names), still: &links.still, ..table(&grid, &rows, asked, read.words, None) };
    let mut found = reading(&table, [0, 1, 2, 3])?;
    let joints = table.turning([0, 1, 2, 3])?;
    found.stated = links.convention;
    found.calls = links.calls;
    // A call says of an offset that it is one.
    found.offsets = found.offsets.filter(|_| !links.calls);
    found.contradiction = links.contradiction.clone();
    found.flipped = links.flipped[joints].to_vec();
    let flipped: Vec<String> = (1..).zip(&found.flipped).filter(|(_, f)| **f).map(|(j, _)| j.to_string()).collect();
    if !flipped.is_empty() {
        found.said += &format!(", counted the other way (flip): {}", flipped.join(", "));
    }
    found.ends = links.ends.map(|end| end.map(|end| end.in_mm(found.length_mm)));
    found.ends_said.clone_from(&links.ends_said);
    fits(path, read, &mut found, links.rows.iter().any(|(_, row)| row[2].variable))?;
    found.ends_said.extend(read.joints.apart(found.rows.len()).filter(|_| !links.of_lists));
    if links.limited && found.limits_deg.iter().any(Option::is_none) {
        found.said.push_str(", left out: qlim");
    }
    Ok(found)
}
