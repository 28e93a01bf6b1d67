//! The table of a file, whatever it is: a sheet, a text of rows, a document with a table in it, a program or settings.

use std::borrow::Cow;

use camino::Utf8Path;

use super::latex;
use super::names::HINT;
use super::offsets;
use super::reading::{Reading, reading};
use super::table::Table;
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

/// Extensions of texts in sentences, where words in brackets are no code.
const PROSE: [&str; 4] = ["md", "txt", "rst", "tex"];

/// Characters that pages name.
const ENTITIES: [(&str, &str); 8] = [
    ("&alpha;", "\u{3b1}"),
    ("&theta;", "\u{3b8}"),
    ("&pi;", "\u{3c0}"),
    ("&minus;", "-"),
    ("&deg;", "\u{b0}"),
    ("&nbsp;", " "),
    ("&lowast;", "*"),
    ("&amp;", "&"),
];

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
    let text = without_entities(&text);
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
        return Ok(vec![of_links(path, &read, links, asked)?]);
    }
    let width = given.as_ref().map_or(4, Vec::len);
    if let Some(matrix) = dh_text::matrix(&text, &read.known, width).map_err(refuse)? {
        let grid = Grid { rows: matrix.rows.clone(), ..empty(path) };
        let names = given.clone().or(matrix.names.map(|names| names.map(str::to_owned).to_vec()));
        let names = names.as_deref();
        let mut ways = ways(&Table {
            names,
            known: &read.known,
            ..table(&grid, &matrix.rows, asked, read.words, given.as_deref())
        })?;
        ways.iter_mut().for_each(|way| way.said += &beside_others(&matrix));
        return Ok(ways);
    }
    if let Some((line, _)) = read.links.as_ref().and_then(|links| links.rows.first()) {
        let message = "the parameters have names of their own here, and no table has columns to name".to_owned();
        return Err(empty(path).refuse(*line, message, Some("leave out `--columns`")));
    }
    let of_rows = of_grid(&Grid::of_text(path, alone(path, &text)?.into_owned())?, asked, Some(read.words));
    of_rows.map_err(|error| read.incomplete.map_or(error, refuse))
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
    Table { grid, rows, names: given, given, known: &NONE, words, units: asked.units }
}

/// The one way to read a table with names, or all of one without.
fn ways(table: &Table) -> Result<Vec<Reading>> {
    match table.names {
        Some(names) => Ok(vec![reading(table, offsets::columns(table, names)?)?]),
        None => without_names(table),
    }
}

/// Every order that the columns of a table without names may have.
fn without_names(table: &Table) -> Result<Vec<Reading>> {
    let rows = table.rows;
    // Columns of words and of the joint's number are no parameters.
    let is_number = |c: usize| rows.iter().all(|(_, r)| table.value(&r[c]).is_some());
    let free: Vec<usize> =
        (0..rows[0].1.len()).filter(|&c| is_number(c) && !(table.counts(c) && rows.len() > 2)).collect();
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
    let columns = [w, x, y, z];
    let in_order = |order: &[usize; 4]| {
        let mut of_row = [0; 4];
        order.iter().zip(columns).for_each(|(&which, column)| of_row[which] = column);
        of_row
    };
    // Lengths in the place of angles are no multiples of a quarter turn.
    let (mut readings, mut wrong) = (Vec::new(), None);
    for order in &ORDERS {
        match reading(table, in_order(order)) {
            Ok(found) => readings.push(found),
            Err(e) => wrong = wrong.or(Some(e)),
        }
    }
    if let Some(wrong) = wrong.filter(|_| readings.is_empty()) {
        return Err(wrong);
    }
    let regular = |r: &&Reading| r.rows.iter().all(|row| row[0].abs() <= 180.0 && row[2].abs() <= 360.0);
    let likely: Vec<Reading> = readings.iter().filter(regular).cloned().collect();
    Ok(if likely.is_empty() { readings } else { likely })
}

/// The rows of a file; `words` are of all its text, where that is known.
fn of_grid(grid: &Grid, asked: &Asked, words: Option<Words>) -> Result<Vec<Reading>> {
    let given = given(asked);
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
    header::is_number(cell)
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
    let table = Table { names: Some(&names), ..table(&grid, &rows, asked, read.words, None) };
    let mut found = reading(&table, [0, 1, 2, 3])?;
    found.stated = links.convention;
    found.calls = links.calls;
    // A call says of an offset that it is one.
    found.offsets = found.offsets.filter(|_| !links.calls);
    found.contradiction = links.contradiction.clone();
    found.flipped = links.flipped.clone();
    let flipped: Vec<String> = (1..).zip(&links.flipped).filter(|(_, f)| **f).map(|(j, _)| j.to_string()).collect();
    if !flipped.is_empty() {
        found.said += &format!(", counted the other way (flip): {}", flipped.join(", "));
    }
    found.ends = links.ends.map(|end| end.map(|end| end.in_mm(found.length_mm)));
    found.ends_said.clone_from(&links.ends_said);
    if links.limited && found.limits_deg.iter().any(Option::is_none) {
        found.said.push_str(", left out: qlim");
    }
    Ok(found)
}

/// The text with characters for what pages write for them, `&theta;` and `&#8321;`.
fn without_entities(text: &str) -> Cow<'_, str> {
    if !text.contains('&') {
        return text.into();
    }
    let text = ENTITIES.iter().fold(text.to_owned(), |text, (name, c)| text.replace(name, c));
    let mut pieces = text.split("&#");
    let mut plain = pieces.next().unwrap_or("").to_owned();
    for piece in pieces {
        let decoded = piece.split_once(';').and_then(|(code, rest)| {
            let number =
                code.strip_prefix('x').map_or_else(|| code.parse().ok(), |hex| u32::from_str_radix(hex, 16).ok());
            Some(format!("{}{rest}", char::from_u32(number?)?))
        });
        plain.push_str(&decoded.unwrap_or_else(|| format!("&#{piece}")));
    }
    plain.into()
}

/// The table of a document alone, whose rows have bars between their cells, in lines where they stand; the text where
/// it has none.
fn alone<'a>(path: &Utf8Path, text: &'a str) -> Result<Cow<'a, str>> {
    let lines: Vec<&str> = text.lines().collect();
    let is_rule = |line: &str| !line.trim().is_empty() && line.chars().all(|c| "-=+|: \t".contains(c));
    let is_row = |line: &str| line.matches('|').count() > 2;
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let mut open = false;
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| !is_rule(line)) {
        match (is_row(line), blocks.last_mut().filter(|_| open)) {
            (true, Some(block)) => block.push(at),
            (true, None) => blocks.push(vec![at]),
            (false, _) => {}
        }
        open = is_row(line);
    }
    // A table that is none of a robot has other names.
    let is_named = |block: &&Vec<usize>| {
        let first = lines[block[0]].to_lowercase();
        (first.contains("alpha") || first.contains('\u{3b1}')) && block.len() > 2
    };
    let long = |block: &&Vec<usize>| block.len() > 2;
    let mut found: Vec<&Vec<usize>> = blocks.iter().filter(is_named).collect();
    if found.is_empty() {
        found = blocks.iter().filter(long).collect();
    }
    let block = match found[..] {
        [] => return Ok(text.into()),
        [block] => block,
        [one, other, ..] => {
            let message = format!(
                "a second table begins here; another is at line {}, and which is the robot's is not said",
                one[0] + 1
            );
            return Err(empty(path).refuse(other[0] as u64 + 1, message, Some("leave one of them in the file")));
        }
    };
    // Names may stand above a table without bars between them.
    let cells = |line: &str| line.trim().trim_matches('|').matches('|').count() + 1;
    let above = (0..block[0]).rev().find(|&at| !lines[at].trim().is_empty());
    let words = above.map(|at| lines[at].split_whitespace().collect::<Vec<_>>()).unwrap_or_default();
    let mut rows = vec![String::new(); lines.len()];
    if let Some(at) = above.filter(|_| words.len() == 4 && cells(lines[block[0]]) == 5) {
        rows[at] = format!("-|{}", words.join("|"));
    }
    for &at in block {
        rows[at] = lines[at].trim().trim_matches('|').to_owned();
    }
    Ok((rows.join("\n") + "\n").into())
}
