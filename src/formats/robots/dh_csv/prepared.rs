//! What is done to the cells of a table before they are read: units that stand in them, a column of theta that nobody
//! wrote, a formula that blanks cut in two.
//!
//! In: rows, and names of their columns. Out: the same with units in the names, `a [m]` over `0.35m`; with a column of
//! zeros for theta where alpha, a and d are there and no other column has numbers or variables. What goes wrong: cells
//! of one column in several units; refused with the line.

use std::borrow::Cow;

use super::names::{self, plain};
use super::table::Table;
use crate::files::Result;
use crate::tables::names::Unit;
use crate::tables::{Fields, Grid, expression};

/// A number and the unit behind it, `0.35m`, `90 deg`.
pub(super) fn of_unit(cell: &str) -> Option<(&str, Unit)> {
    let cell = cell.trim();
    let number = cell.trim_end_matches(char::is_alphabetic);
    let unit = Unit::of(&cell[number.len()..])?;
    number.trim().parse::<f64>().ok().map(|_| (number.trim(), unit))
}

/// Names of columns, and rows.
type Named<'a> = (Cow<'a, [String]>, Cow<'a, [(u64, Fields)]>);

/// Names and rows with the units of cells in the names.
pub(super) fn without_units<'a>(table: &Table<'a>, names: &'a [String]) -> Result<Named<'a>> {
    let (mut names, mut rows) = (Cow::Borrowed(names), Cow::Borrowed(table.rows));
    for column in 0..names.len() {
        let of = |row: &(u64, Fields)| of_unit(&row.1[column]).map(|(_, unit)| unit);
        let Some(unit) = table.rows.iter().find_map(of) else { continue };
        let is_zero = |row: &(u64, Fields)| table.value(&row.1[column]).is_some_and(|v| v.number == 0.0);
        let stated = plain(&names[column]).1;
        let odd = table.rows.iter().find(|row| of(row).map_or(!is_zero(row), |other| other != unit));
        if let Some((line, row)) = odd.or(table.rows.first().filter(|_| stated.is_some_and(|stated| stated != unit))) {
            let message = format!(
                "`{}` stands in a column whose unit is {} by another cell or its name",
                &row[column],
                unit.word()
            );
            return Err(table.grid.refuse(
                *line,
                message,
                Some("write the unit once, into the column's name: `a [m]`"),
            ));
        }
        if stated.is_none() {
            names.to_mut()[column] += &format!(" [{}]", unit.word());
        }
        for (_, row) in rows.to_mut() {
            let cells: Vec<String> = row.iter().map(str::to_owned).collect();
            let cell = |(at, cell): (usize, &String)| match of_unit(cell) {
                Some((number, _)) if at == column => number.to_owned(),
                _ => cell.clone(),
            };
            *row = Fields::new(cells.iter().enumerate().map(cell));
        }
    }
    Ok((names, rows))
}

/// Whether alpha, a and d have columns and theta has none, nor anything else that could be it.
pub(super) fn lacks_theta(table: &Table, names: &[String]) -> Result<bool> {
    let Some([alpha, a, d]) = names::without_theta(names) else { return Ok(false) };
    let is_other = |column: &usize| ![alpha, a, d].contains(column) && names[*column] != "-";
    let moves = |column: usize| table.rows.iter().any(|(_, row)| table.value(&row[column]).is_some_and(|v| v.variable));
    Ok(table.beside([alpha, a, a, d])?.left_out.is_empty() && !(0..names.len()).filter(is_other).any(moves))
}

/// Names and rows with a column of zeros for theta.
pub(super) fn with_theta(names: &[String], rows: &[(u64, Fields)]) -> (Vec<String>, Vec<(u64, Fields)>) {
    let names = names.iter().cloned().chain(["theta".to_owned()]).collect();
    let longer = |(line, row): &(u64, Fields)| (*line, Fields::new(row.iter().chain(["0"])));
    (names, rows.iter().map(longer).collect())
}

/// A grid whose rows have formulas with blanks in one cell, where these make a row longer by one than the others:
/// `A3 -90`.
pub(super) fn rejoined(grid: &Grid) -> Cow<'_, Grid> {
    let mut lengths: Vec<usize> = grid.rows.iter().map(|(_, row)| row.len()).collect();
    lengths.sort_unstable();
    let usual = lengths.chunk_by(|a, b| a == b).max_by_key(|chunk| chunk.len()).map_or(0, |chunk| chunk[0]);
    let is_variable = |cell: &str| {
        let value =
            |text: &str| expression::evaluate(text, &|_| None).or_else(|| expression::counted_back(text, &|_| None));
        value(&expression::of_reading(cell, 'A')).is_some_and(|v| v.variable)
    };
    let cut = |row: &Fields| {
        let cells: Vec<&str> = row.iter().collect();
        let is_sign = |cell: &str| cell.len() > 1 && cell.starts_with(['+', '-']) && cell.parse::<f64>().is_ok();
        (1..cells.len())
            .find(|&at| is_variable(cells[at - 1]) && is_sign(cells[at]))
            .filter(|_| cells.len() == usual + 1)
    };
    if !grid.rows.iter().any(|(_, row)| cut(row).is_some()) {
        return Cow::Borrowed(grid);
    }
    let mut whole = grid.clone();
    for (_, row) in &mut whole.rows {
        if let Some(at) = cut(row) {
            let cells: Vec<String> = row.iter().map(str::to_owned).collect();
            let joined = format!("{}{}", cells[at - 1], cells[at]);
            *row = Fields::new(cells[..at - 1].iter().chain([&joined]).chain(&cells[at + 1..]));
        }
    }
    Cow::Owned(whole)
}
