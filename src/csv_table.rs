//! A table with a header: columns by name, every row as long as the header, complaints with the line.
//!
//! The file may have any form that [`crate::tables`] reads. Time and memory grow with the file's length alone, and
//! there is an end to it: [`MOST_COLUMNS`], [`MOST_ROWS`]. Text cells that a spreadsheet would run as a formula are
//! written with an apostrophe before them and read without.

use std::collections::BTreeMap;

use camino::Utf8Path;

use crate::files::{self, Result};
pub use crate::tables::Fields;
use crate::tables::Grid;
use crate::tables::grid::is_formula;
pub use crate::tables::grid::{MOST_COLUMNS, MOST_ROWS};

/// A table with its header understood: fields by name, complaints with the line.
pub struct Table<'a> {
    /// Where it was read.
    pub path: &'a Utf8Path,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Line number in the file (from 1) and fields.
    pub rows: Vec<(u64, Fields)>,
    columns: BTreeMap<String, usize>,
}

impl<'a> Table<'a> {
    /// Reads a whole file; `what` names it in the message when it is not there, `hint` says what makes it. A file
    /// without rows is refused.
    pub fn read(path: &'a Utf8Path, what: &'static str, hint: &str) -> Result<Table<'a>> {
        let grid = Grid::read(path, what, hint)?;
        let mut rows = grid.rows.into_iter();
        let header = rows.next().map_or_else(Vec::new, |(_, row)| row.iter().map(str::to_owned).collect());
        Table::new(path, header, rows.collect())
    }

    /// A table of these rows under this header.
    pub fn new(path: &'a Utf8Path, mut header: Vec<String>, mut rows: Vec<(u64, Fields)>) -> Result<Table<'a>> {
        // A delimiter at the end of each line makes a column that is none.
        let longest = rows.iter().map(|(_, row)| row.len()).max().unwrap_or(0);
        while header.len() > longest && longest > 0 && header.last().is_some_and(String::is_empty) {
            header.pop();
        }
        let mut table = Table { path, header, rows: Vec::new(), columns: BTreeMap::new() };
        for (i, name) in table.header.iter().enumerate().filter(|(_, name)| !name.is_empty()) {
            if table.columns.insert(name.clone(), i).is_some() {
                let hint = "a table begins with a line of column names, each of them once";
                return Err(table.refuse_with(1, format!("two columns `{name}`"), Some(hint)));
            }
        }
        for (line, row) in &mut rows {
            let wanted = table.header.len();
            if row.len() > wanted && row.iter().skip(wanted).all(str::is_empty) {
                *row = Fields::new(row.iter().take(wanted));
            }
            if row.len() != wanted {
                return Err(table.refuse(*line, format!("{} fields, but the header has {wanted}", row.len())));
            }
        }
        if rows.is_empty() {
            return Err(table.refuse(1, "the file has no rows below its header".to_owned()));
        }
        table.rows = rows;
        Ok(table)
    }

    /// The header as a message shows it: not all of a hundred thousand names.
    pub fn header_in_short(&self) -> String {
        const MOST: usize = 40;
        let mut text = self.header.iter().take(MOST).map(String::as_str).collect::<Vec<_>>().join(", ");
        if self.header.len() > MOST {
            text.push_str(&format!(", ... ({} columns)", self.header.len()));
        }
        text
    }

    /// A complaint about a line.
    pub fn refuse(&self, line: u64, message: String) -> files::Error {
        self.refuse_with(line, message, None)
    }

    /// A complaint about a line, with what to do about it.
    pub fn refuse_with(&self, line: u64, message: String, hint: Option<&str>) -> files::Error {
        files::Error::format(self.path, Some(line), message, hint)
    }

    /// The place of a column, where the header has it.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.get(name).copied()
    }

    /// The place of a column that must be there.
    pub fn require(&self, name: &str) -> Result<usize> {
        self.column(name)
            .ok_or_else(|| self.refuse(1, format!("no column `{name}`; the header has: {}", self.header_in_short())))
    }

    /// A field as a finite number.
    pub fn number(&self, line: u64, row: &Fields, column: usize) -> Result<f64> {
        match row[column].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let message = format!("`{}` is not a number: `{}`", self.header[column], &row[column]);
                let decimal_comma = row[column].replacen(',', ".", 1).parse::<f64>().is_ok();
                let hint = match row[column].trim().is_empty() {
                    true => Some("leave the row out where nothing was measured"),
                    false => decimal_comma.then_some("write numbers with a decimal point"),
                };
                Err(self.refuse_with(line, message, hint))
            }
        }
    }
}

/// A text as a field of a CSV file: quoted where it must be, and harmless to a spreadsheet.
pub fn quoted(field: &str) -> String {
    let guarded = if is_formula(field.trim_start_matches('\'')) { format!("'{field}") } else { field.to_owned() };
    // Semicolons and tabs are quoted too: this program's reader, and others, guess the delimiter from the header.
    match guarded.contains([',', ';', '\t', '"', '\r', '\n']) {
        true => format!("\"{}\"", guarded.replace('"', "\"\"")),
        false => guarded,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn read_back(names: &[String]) -> Vec<String> {
        let rows: String = names.iter().map(|name| format!("1,{}\n", quoted(name))).collect();
        let (_folder, path) = files::temporary("t.csv", format!("number,name\n{rows}"));
        let table = Table::read(&path, "the table", "").unwrap();
        table.rows.iter().map(|(_, row)| row[1].to_owned()).collect()
    }

    proptest! {
        /// Whatever a name is made of, it reads back; blanks at its ends are lost, as they are in every cell that is
        /// read. Names that are numbers in quotes with a decimal comma are read as these.
        #[test]
        fn names_read_back(names in prop::collection::vec("[-=+@',;\"\t\r\n a-c0\\\\é]{0,8}", 1..6)) {
            let trimmed: Vec<String> = names.iter().map(|name| name.trim().to_owned()).collect();
            let digits = |name: &String| name.chars().all(|c| "+-0,' ".contains(c));
            prop_assume!(!trimmed.iter().any(|name| name.contains('0') && digits(name)));
            prop_assert_eq!(read_back(&trimmed), trimmed);
        }
    }

    #[test]
    fn lines_are_counted_as_editors_count_them() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["a,b", "1,\"two", "lines\"", "", "2,x", "3,y", ""].join(end);
            for mark in ["", "\u{feff}"] {
                let (_folder, path) = files::temporary("t.csv", format!("{mark}{text}"));
                let table = Table::read(&path, "the table", "").unwrap();
                let lines: Vec<u64> = table.rows.iter().map(|(line, _)| *line).collect();
                assert_eq!(lines, [2, 5, 6], "{end:?}");
            }
        }
    }

    #[test]
    fn formulas_are_made_harmless_and_numbers_left_alone() {
        assert_eq!(quoted("=1+1"), "'=1+1");
        assert_eq!(quoted("@SUM(A1)"), "'@SUM(A1)");
        assert_eq!(quoted("'=1"), "''=1");
        assert_eq!(quoted("-5"), "-5");
        assert_eq!(quoted("p'1"), "p'1");
        assert_eq!(quoted("a\rb"), "\"a\rb\"");
        assert_eq!(quoted(""), "");
    }

    #[test]
    fn wide_tables_take_time_in_proportion() {
        let header = |n: usize| (0..n).map(|i| format!("c{i}")).collect::<Vec<_>>().join(",");
        let text = format!("{}\n{}\n", header(MOST_COLUMNS), vec!["1"; MOST_COLUMNS].join(","));
        let (_folder, path) = files::temporary("t.csv", text);
        let table = Table::read(&path, "the table", "").unwrap();
        assert_eq!(table.column("c99999"), Some(99_999));
        std::fs::write(&path, format!("{}\n", header(MOST_COLUMNS + 1))).unwrap();
        let message = Table::read(&path, "the table", "").err().unwrap().to_string();
        assert!(message.contains("100001 columns; 100000"), "{message}");
    }
}
