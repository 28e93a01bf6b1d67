//! What stands in a cell beside its number, or in place of one: a unit, a list, a name, a comment.
//!
//! In: rows of cells as they were told apart. Out: rows whose cells are numbers. A column of lists, `[1.0, 2.0]`, is as
//! many columns; a column of numbers with a unit behind each has that unit in its name; lines that name each of their
//! numbers, `A1 1.5, A2 2.5`, are rows below these names. What goes wrong: lists of different lengths, and units that
//! differ within a column, stay as they are and are refused where they should be numbers.

use super::fields::Fields;
use super::names::{Name, Unit, What};
use super::numbers::is_number;

/// Entries of the longest list that is a part of a pose: a transform.
const LONGEST: usize = 16;

/// Numbers that a line names at the least.
const NAMED: usize = 3;

/// What the cells of a column are.
#[derive(Clone, PartialEq)]
enum Column {
    Plain,
    /// Lists of so many entries; of transforms the last column is the point.
    Lists(usize, bool),
    /// Numbers with this behind them.
    Unit(String),
}

/// Lines that name each of their numbers, all in the same order: a row of names, and the numbers.
pub(super) fn named(text: &str) -> Option<Vec<(u64, Fields)>> {
    let mut rows: Vec<(u64, Fields)> = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        if line.trim().is_empty() || line.starts_with(['#', '%']) {
            continue;
        }
        let between = |c: char| c.is_whitespace() || ",;=:{}[]()\"'".contains(c);
        let words: Vec<&str> = line.split(between).filter(|word| !word.is_empty()).collect();
        let (names, values): (Vec<&str>, Vec<&str>) = words.chunks_exact(2).map(|two| (two[0], two[1])).unzip();
        let is_name = |word: &&str| word.starts_with(char::is_alphabetic) && word.parse::<f64>().is_err();
        if !words.len().is_multiple_of(2)
            || names.len() < NAMED
            || !names.iter().all(is_name)
            || !values.iter().all(|word| is_number(word))
        {
            return None;
        }
        let names = Fields::new(names);
        if rows.is_empty() {
            rows.push((number, names));
        } else if rows[0].1 != names {
            return None;
        }
        rows.push((number, Fields::new(values)));
    }
    (rows.len() > 2).then_some(rows)
}

/// What a comment begins with.
const MARKS: [&str; 2] = ["#", "//"];

/// The cells of a line before a comment that stands behind a number; between `blanks` its mark is a cell of its own.
fn without_comment(cells: &Fields, blanks: bool) -> Option<Fields> {
    let before = |cell: &str| {
        let (number, rest) = cell.split_once(char::is_whitespace)?;
        let number = number.replace(',', ".");
        (MARKS.iter().any(|mark| rest.trim_start().starts_with(mark)) && is_number(&number)).then_some(number)
    };
    let at = (1..cells.len()).find(|&i| blanks && MARKS.contains(&&cells[i]) || before(&cells[i]).is_some())?;
    let last = before(&cells[at]);
    Some(Fields::new(cells.iter().take(at).chain(last.as_deref())))
}

/// Makes columns of lists as many columns, takes units behind numbers to the names and comments away; `blanks` stand
/// between the cells.
pub(super) fn plain(rows: &mut Vec<(u64, Fields)>, blanks: bool) {
    // A column may be called `#`.
    let is_marked = |row: &Fields| row.iter().any(|cell| MARKS.contains(&cell));
    let usual = rows.iter().rev().map(|(_, row)| row).find(|row| !is_marked(row)).map(Fields::len);
    for (_, row) in rows.iter_mut() {
        if let Some(before) = without_comment(row, blanks && Some(row.len()) != usual) {
            *row = before;
        }
    }
    // Names and titles stand above the first cell of a kind.
    let special = |row: &Fields| row.iter().any(|cell| kind_of(cell) != Column::Plain);
    let Some(mut first) = rows.iter().position(|(_, row)| special(row)) else { return };
    let width = rows.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
    let names = rows[..first].iter().rev().map(|(_, row)| row).find(|row| row.len() > 1);
    let name = |column: usize| names.filter(|names| names.len() > column).map(|names| &names[column]);
    let columns: Vec<Column> = (0..width).map(|column| kind(&rows[first..], column, name(column))).collect();
    if columns.iter().all(|column| *column == Column::Plain) {
        return;
    }
    if first == 0 && columns.iter().any(|column| matches!(column, Column::Unit(_))) {
        rows.insert(0, (rows[0].0, Fields::new((0..width).map(|_| ""))));
        first = 1;
    }
    for (i, (_, row)) in rows.iter_mut().enumerate() {
        let title = i < first && row.len() == 1;
        let cells = row.iter().zip(&columns).enumerate().flat_map(|(at, (cell, column))| match column {
            Column::Lists(length, transform) if i < first && !title => of_list(cell, *length, *transform),
            Column::Lists(length, _) if !title => {
                let mut numbers: Vec<String> = list(cell).iter().flatten().map(|n| (*n).to_owned()).collect();
                numbers.resize(*length, String::new());
                numbers
            }
            Column::Unit(unit) if i < first && cell.is_empty() => vec![format!("column {} [{unit}]", at + 1)],
            Column::Unit(unit) if i < first && !title => vec![format!("{cell} [{unit}]")],
            Column::Unit(_) => vec![with_unit(cell).map_or(cell.to_owned(), |(number, _)| number)],
            _ => vec![cell.to_owned()],
        });
        *row = Fields::new(cells);
    }
}

/// What all cells of a column are, but for those that are empty.
fn kind(rows: &[(u64, Fields)], column: usize, name: Option<&str>) -> Column {
    const NOTHING: [&str; 6] = ["", "-", "nan", "none", "null", "n/a"];
    let cells = rows.iter().filter(|(_, row)| row.len() > column).map(|(_, row)| row[column].trim());
    let mut cells = cells.filter(|cell| !NOTHING.contains(&cell.to_lowercase().as_str()));
    let Some(first) = cells.next() else { return Column::Plain };
    let found = kind_of(first);
    let name = Name::of(name.unwrap_or(""));
    // A group may be called `1 m`.
    let contradicts = |unit: &str| {
        name.unit.is_some_and(|stated| Unit::of(unit) != Some(stated)) || matches!(name.what, What::Own(_))
    };
    match &found {
        Column::Unit(unit) if contradicts(unit) => Column::Plain,
        Column::Plain => Column::Plain,
        _ if cells.all(|cell| kind_of(cell) == found) => found,
        _ => Column::Plain,
    }
}

fn kind_of(cell: &str) -> Column {
    if let Some(numbers) = list(cell) {
        let last: Vec<f64> = numbers.iter().skip(12).filter_map(|n| n.parse().ok()).collect();
        return Column::Lists(numbers.len(), last == [0.0, 0.0, 0.0, 1.0]);
    }
    with_unit(cell).map_or(Column::Plain, |(_, unit)| Column::Unit(unit))
}

/// How many numbers a cell holds.
pub(super) fn count(cell: &str) -> usize {
    match kind_of(cell) {
        Column::Lists(length, _) => length,
        Column::Unit(_) => 1,
        Column::Plain => usize::from(cell.parse::<f64>().is_ok()),
    }
}

/// The numbers of a list in a cell, lists in it one after the other; or its words, where each is in quotes.
pub(super) fn list(cell: &str) -> Option<Vec<&str>> {
    let inside = cell.strip_prefix(['[', '('])?.strip_suffix([']', ')'])?;
    let between = |c: char| c.is_whitespace() || ",;[]()".contains(c);
    let numbers: Vec<&str> = inside.split(between).filter(|word| !word.is_empty()).collect();
    if !(2..=LONGEST).contains(&numbers.len()) {
        return None;
    }
    if numbers.iter().all(|text| is_number(text)) {
        return Some(numbers);
    }
    numbers.into_iter().map(|text| in_quotes(text, '"').or_else(|| in_quotes(text, '\''))).collect()
}

fn in_quotes(text: &str, quote: char) -> Option<&str> {
    text.strip_prefix(quote)?.strip_suffix(quote)
}

/// A number with a unit behind it, apart.
fn with_unit(cell: &str) -> Option<(String, String)> {
    let letter = |c: char| c.is_alphabetic() || c == '\u{b0}';
    let number = cell.trim_end_matches(letter);
    let unit = &cell[number.len()..];
    if unit.is_empty() || !number.contains(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let plain = number.trim().replace(',', ".").replace('\u{2212}', "-");
    (is_number(&plain) && Unit::of(unit).is_some()).then(|| (plain, unit.to_owned()))
}

/// Names for the numbers of a list: joints are counted, three numbers are a point, and so is the last column of a
/// transform.
fn of_list(name: &str, length: usize, transform: bool) -> Vec<String> {
    let (base, unit) = without_unit(name);
    // `T` before a transform's name says what it is.
    let base = base.strip_prefix("T_").filter(|_| transform).unwrap_or(base);
    let unit = unit.map_or(String::new(), |unit| format!(" [{unit}]"));
    let named = |index: &str| if base.is_empty() { String::new() } else { format!("{base}_{index}{unit}") };
    let joints = matches!(Name::of(&format!("{base}_1")).what, What::Joint(_));
    let point = !joints && Name::of(&format!("{base}_x")).what == What::Coordinate(0);
    let index = |i: usize| match (length, transform) {
        (16, true) if i % 4 == 3 && i < 12 && point => named(["x", "y", "z"][i / 4]),
        (16, true) => named(&format!("r{i}")),
        (3, _) if point => named(["x", "y", "z"][i]),
        _ => named(&(i + 1).to_string()),
    };
    (0..length).map(index).collect()
}

/// A name without the unit behind it.
fn without_unit(name: &str) -> (&str, Option<&str>) {
    let name = name.trim();
    let at = name.rfind(['[', '(', '_', ' ', '.']).filter(|at| *at > 0);
    let unit = at.map(|at| name[at + 1..].trim_end_matches([']', ')']));
    match (at, unit) {
        (Some(at), Some(unit)) if Unit::of(unit).is_some() => (name[..at].trim_end_matches(['_', ' ']), Some(unit)),
        _ => (name, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_stands_behind_the_cells_of_a_row() {
        let read = |lines: &[&str]| {
            let mut rows: Vec<(u64, Fields)> =
                lines.iter().zip(1..).map(|(line, number)| (number, Fields::new(line.split_whitespace()))).collect();
            plain(&mut rows, true);
            rows.iter().map(|(_, row)| row.iter().collect::<Vec<_>>().join(" ")).collect::<Vec<_>>()
        };
        assert_eq!(read(&["a b # of me", "1 2 # again", "3 4"]), ["a b", "1 2", "3 4"]);
        // A column that is called by its mark.
        assert_eq!(read(&["a # b", "1 2 3", "4 5 6"]), ["a # b", "1 2 3", "4 5 6"]);
    }
}
