//! A CSV file with a header: columns by name, every row as long as the header, complaints with the line.

use camino::Utf8Path;

use crate::error::{Place, Result};
use crate::files;

/// A CSV file with its header understood: fields by name, complaints with the line.
pub struct Table<'a> {
    /// Where it was read.
    pub path: &'a Utf8Path,
    /// Names of the columns.
    pub header: Vec<String>,
    /// Line number in the file (from 1) and fields.
    pub rows: Vec<(u64, Vec<String>)>,
}

impl<'a> Table<'a> {
    /// Reads a whole file; `what` names it in the message when it is not there, `hint` says what makes it. A file without rows is refused.
    pub fn read(path: &'a Utf8Path, what: &'static str, hint: &str) -> Result<Table<'a>> {
        let text = files::read_text(path, what, Some(hint))?;
        // Spreadsheets put a byte order mark first and, in half of Europe, semicolons between; instruments put tabs.
        let text = text.trim_start_matches('\u{feff}');
        let first = text.lines().next().unwrap_or_default();
        let delimiter = [b',', b';', b'\t'].into_iter().find(|&d| first.contains(char::from(d))).unwrap_or(b',');
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(delimiter)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let refuse = |e: csv::Error| {
            let line = e.position().map(csv::Position::line);
            files::Error::Format {
                message: format!("not readable as CSV: {e}"),
                place: Place { path: path.to_owned(), line },
                hint: None,
            }
        };
        let header: Vec<String> = reader.headers().map_err(refuse)?.iter().map(str::to_owned).collect();
        let mut table = Table { path, header, rows: Vec::new() };
        let twice = |&i: &usize| !table.header[i].is_empty() && table.header[..i].contains(&table.header[i]);
        if let Some(twice) = (1..table.header.len()).find(twice) {
            return Err(table.refuse(1, format!("two columns `{}`", table.header[twice])));
        }
        for record in reader.records() {
            let record = record.map_err(refuse)?;
            let line = record.position().map_or(0, csv::Position::line);
            if record.iter().all(str::is_empty) {
                continue;
            }
            if record.len() != table.header.len() {
                let message = format!("{} fields, but the header has {}", record.len(), table.header.len());
                return Err(table.refuse(line, message));
            }
            table.rows.push((line, record.iter().map(str::to_owned).collect()));
        }
        if table.rows.is_empty() {
            return Err(table.refuse(1, "the file has no rows below its header".to_owned()));
        }
        Ok(table)
    }

    /// A complaint about a line.
    pub fn refuse(&self, line: u64, message: String) -> crate::Error {
        self.refuse_with(line, message, None)
    }

    /// A complaint about a line, with what to do about it.
    pub fn refuse_with(&self, line: u64, message: String, hint: Option<&str>) -> crate::Error {
        let place = Place { path: self.path.to_owned(), line: Some(line) };
        files::Error::Format { message, place, hint: hint.map(str::to_owned) }.into()
    }

    /// The place of a column, where the header has it.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.header.iter().position(|h| h == name)
    }

    /// The place of a column that must be there.
    pub fn require(&self, name: &str) -> Result<usize> {
        self.column(name)
            .ok_or_else(|| self.refuse(1, format!("no column `{name}`; the header has: {}", self.header.join(", "))))
    }

    /// A field as a finite number.
    pub fn number(&self, line: u64, row: &[String], column: usize) -> Result<f64> {
        match row[column].parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let message = format!("`{}` is not a number: `{}`", self.header[column], row[column]);
                let decimal_comma = row[column].replacen(',', ".", 1).parse::<f64>().is_ok();
                Err(self.refuse_with(line, message, decimal_comma.then_some("write numbers with a decimal point")))
            }
        }
    }
}

/// A text as a field of a CSV file.
pub fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', ';']) { format!("\"{}\"", field.replace('"', "\"\"")) } else { field.to_owned() }
}
