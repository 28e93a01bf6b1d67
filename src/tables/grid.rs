//! A file as rows of cells: which delimiter it has.
//!
//! The delimiter is the one with which most of the first rows have equally many cells, and of those that do equally
//! well the one that makes most cells numbers; comma, semicolon, tab, bar and blanks in this order. Numbers may have a
//! decimal comma, or thousands set apart. Rows of a program's list, each in brackets, are rows without them. Time and
//! memory grow with the file's length alone.

use camino::{Utf8Path, Utf8PathBuf};

use super::called;
use super::cells;
use super::fields::{Fields, Form};
use super::lines::{log, program};
use super::numbers::Style;
use super::source::{self, Source};
use crate::files::{Error, Result};
use crate::programs::Language;

/// Columns of the widest table that is read.
pub const MOST_COLUMNS: usize = 100_000;

/// Rows of the longest table that is read.
pub const MOST_ROWS: usize = 3_000_000;

/// Rows that tell the delimiter.
const SEEN_ROWS: usize = 60;

/// A file as rows of cells; rows without anything in them are left out.
#[derive(Debug, Clone)]
pub struct Grid {
    /// Where it was read.
    pub path: Utf8PathBuf,
    pub form: Form,
    /// The encoding, where it is not UTF-8.
    pub encoding: Option<&'static str>,
    /// Line in the file (from 1) and cells.
    pub rows: Vec<(u64, Fields)>,
}

impl Grid {
    /// One without rows.
    pub fn empty(path: &Utf8Path, form: Form, encoding: Option<&'static str>) -> Grid {
        Grid { path: path.to_owned(), form, encoding, rows: Vec::new() }
    }

    /// Reads a file; `what` names it in the message when it is not there, `hint` says what makes it.
    pub fn read(path: &Utf8Path, what: &'static str, hint: &str) -> Result<Grid> {
        Grid::of(path, source::read(path, what, hint)?, None)
    }

    /// The text of a file in whatever encoding; `None` of a spreadsheet and of records.
    pub fn text(path: &Utf8Path, what: &'static str, hint: &str) -> Result<Option<String>> {
        Ok(match source::read(path, what, hint)? {
            Source::Text(text, _) => Some(text),
            Source::Records(_) | Source::Sheet { .. } => None,
        })
    }

    /// The rows of a text that was read from a file.
    pub fn of_text(path: &Utf8Path, text: String) -> Result<Grid> {
        Grid::of(path, Source::Text(text, None), None)
    }

    /// Reads a file of readings, which may be a program's: lines that hold a joint target of at least so many numbers
    /// are rows of those. Lists, units and comments in its cells are read, and names of joints in them.
    pub fn read_with_programs(path: &Utf8Path, what: &'static str, hint: &str, joints: usize) -> Result<Grid> {
        let mut grid = Grid::of(path, source::read(path, what, hint)?, Some(joints))?;
        cells::plain(&mut grid.rows, grid.form == Form::Delimited(' '));
        called::named(&mut grid.rows);
        Ok(grid)
    }

    fn of(path: &Utf8Path, source: Source, joints: Option<usize>) -> Result<Grid> {
        let empty = |form, encoding| Grid::empty(path, form, encoding);
        match source {
            Source::Sheet { rows, name, others } => {
                let mut grid = empty(Form::Sheet(name, others), None);
                rows.iter().try_for_each(|(line, cells)| grid.push(*line, cells.iter().map(String::as_str)))?;
                Ok(grid)
            }
            Source::Records(rows) => Ok(Grid { rows, ..empty(Form::Named("records of JSON", 0), None) }),
            Source::Text(text, encoding) => {
                let logged = joints.filter(|_| Language::of(path).is_none()).and_then(|_| log::read(&text));
                if let Some((rows, others)) = logged {
                    return Ok(Grid { rows, ..empty(Form::Named("lists of a log", others), encoding) });
                }
                if let Some((rows, form)) = joints.and_then(|joints| program::read(path, &text, joints)) {
                    let grid = Grid { rows, ..empty(form, encoding) };
                    if let Form::Program { calls, .. } = &grid.form
                        && calls.len() > 1
                    {
                        let calls = calls.join("`, `");
                        let message =
                            format!("lists of numbers in calls of `{calls}`: not all of them can be joint targets");
                        let hint = "leave the lines with joint targets alone, or make a table of them";
                        return Err(grid.refuse(grid.rows[0].0, message, Some(hint)));
                    }
                    return Ok(grid);
                }
                if let Some(rows) = joints.and_then(|_| cells::named(&text)) {
                    return Ok(Grid { rows, ..empty(Form::Delimited(','), encoding) });
                }
                let text = without_brackets(&text).unwrap_or(text);
                let delimiter = delimiter(&text);
                let mut grid = empty(Form::Delimited(delimiter), encoding);
                grid.fill(&text, delimiter, usize::MAX)?;
                Ok(grid)
            }
        }
    }

    /// The file without the name of a sheet.
    pub fn file(path: &Utf8Path) -> Utf8PathBuf {
        source::split(path).0
    }

    fn fill(&mut self, text: &str, delimiter: char, most: usize) -> Result<()> {
        if delimiter == ' ' {
            let mut lines = Lines { text: text.as_bytes(), at: 0, line: 1 };
            let start = text.as_ptr() as usize;
            for row in text.split(['\n', '\r']).filter(|row| !row.trim().is_empty()).take(most) {
                let line = lines.of((row.as_ptr() as usize - start) as u64);
                self.push(line, row.split_whitespace().map(unguarded))?;
            }
            self.tidy(true);
            return Ok(());
        }
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(delimiter as u8)
            .trim(csv::Trim::All)
            .flexible(true)
            .has_headers(false)
            .from_reader(text.as_bytes());
        let mut record = csv::StringRecord::new();
        let mut lines = Lines { text: text.as_bytes(), at: 0, line: 1 };
        while self.rows.len() < most && reader.read_record(&mut record).map_err(|e| self.unreadable(&e))? {
            let line = lines.of(record.position().map_or(0, csv::Position::byte));
            // A bar at both ends of a row is its frame.
            let framed = delimiter == '|' && record.len() > 2 && record.get(0) == Some("");
            let cells = record.iter().skip(usize::from(framed)).map(unguarded);
            self.push(line, cells)?;
        }
        self.tidy(delimiter != ',');
        Ok(())
    }

    fn push<'a>(&mut self, line: u64, cells: impl Iterator<Item = &'a str> + Clone) -> Result<()> {
        // A rule drawn under the names is no row.
        let drawn = if self.rows.len() == 1 { ['-', '=', ':'].as_slice() } else { &[] };
        if cells.clone().all(|cell| cell.trim().trim_matches(drawn).is_empty()) {
            return Ok(());
        }
        if self.rows.len() > MOST_ROWS {
            return Err(self.refuse(line, format!("more than {MOST_ROWS} rows; that many are read at the most"), None));
        }
        let fields = Fields::new(cells);
        if fields.len() > MOST_COLUMNS {
            let message = format!("{} columns; {MOST_COLUMNS} are read at the most", fields.len());
            return Err(self.refuse(line, message, None));
        }
        self.rows.push((line, fields));
        Ok(())
    }

    /// Writes all numbers as a program reads them; `free` says that a comma may stand inside of a number without quotes
    /// around it.
    fn tidy(&mut self, free: bool) {
        let style = Style::of(self.rows.iter().flat_map(|(_, row)| row.iter()), free);
        for (_, row) in &mut self.rows {
            let cells: Vec<Option<String>> = row.iter().map(|cell| style.number(cell)).collect();
            if cells.iter().any(Option::is_some) {
                *row = Fields::new(cells.iter().zip(row.iter()).map(|(new, old)| new.as_deref().unwrap_or(old)));
            }
        }
    }

    fn unreadable(&self, e: &csv::Error) -> Error {
        let line = e.position().map(csv::Position::line);
        Error::format(&self.path, line, format!("not readable as CSV: {e}"), None)
    }

    /// A complaint about a line.
    pub fn refuse(&self, line: u64, message: String, hint: Option<&str>) -> Error {
        Error::format(&self.path, Some(line), message, hint)
    }
}

/// A list of rows as programs write it, `[[1, 2], [3, 4]]`, `data = [1 2; 3 4]` on a line each: without the brackets.
/// `None` where most lines are none of its rows.
fn without_brackets(text: &str) -> Option<String> {
    let is_bracket = |c: char| matches!(c, '[' | ']' | '{' | '}' | '(' | ')');
    let of_numbers = |c: char| c.is_ascii_digit() || " \t\r,;.+-eE".contains(c);
    let lines: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
    let is_row = |line: &str| line.chars().all(|c| is_bracket(c) || of_numbers(c));
    let rows = lines.iter().filter(|line| is_row(line));
    // Names with units in brackets, `J1 [deg]`, close what they open and stand once; a list is opened on one line and
    // closed on another, or on each.
    let closed = |line: &&&str| line.matches(['[', '{', '(']).count() == line.matches([']', '}', ')']).count();
    let bracketed = lines.iter().filter(|line| line.contains(is_bracket)).count();
    let is_list = 2 * bracketed > lines.len() || lines.iter().any(|line| !closed(&line));
    if !is_list || 2 * rows.clone().count() <= lines.len() {
        return None;
    }
    // Names of lists are none of columns.
    let lists = rows.clone().all(|line| line.matches(['[', '{', '(']).count() > 1);
    let bare = |line: &str| {
        if lists && !is_row(line) {
            return String::new();
        }
        let plain = |c: char| match c {
            _ if is_bracket(c) => ' ',
            ';' if lists && line.contains(',') => ',',
            _ => c,
        };
        // `[1, 2][3, 4]`: between two lists there is a cell's end as well.
        let line = if line.contains(',') { parted(line) } else { line.to_owned() };
        let bare: String = line.chars().map(plain).collect();
        let bare = bare.trim().trim_end_matches([',', ';']).trim_end();
        bare.strip_prefix("- ").unwrap_or(bare).trim_start().to_owned()
    };
    Some(text.lines().map(|line| bare(line) + "\n").collect())
}

/// A line with a comma where one list begins right behind another.
fn parted(line: &str) -> String {
    let mut parted = String::with_capacity(line.len());
    for c in line.chars() {
        if matches!(c, '[' | '{' | '(') && parted.trim_end().ends_with([']', '}', ')']) {
            parted.push(',');
        }
        parted.push(c);
    }
    parted
}

/// Whether a spreadsheet would compute this cell (OWASP, "CSV Injection"). A number, of either sign, is no formula.
pub fn is_formula(text: &str) -> bool {
    text.starts_with(['=', '+', '-', '@']) && text.parse::<f64>().is_err()
}

/// A field without the apostrophe that is put before a formula.
fn unguarded(field: &str) -> &str {
    match field.strip_prefix('\'') {
        Some(rest) if is_formula(rest.trim_start_matches('\'')) => rest,
        _ => field,
    }
}

/// What stands between the cells of a text.
fn delimiter(text: &str) -> char {
    // (rows of equally many cells, numbers among their cells)
    let score = |delimiter: char| {
        let mut grid = Grid::empty(Utf8Path::new(""), Form::Delimited(delimiter), None);
        if grid.fill(text, delimiter, SEEN_ROWS).is_err() {
            return (0, 0);
        }
        let mut counts: Vec<usize> = grid.rows.iter().map(|(_, row)| row.len()).filter(|&n| n > 1).collect();
        counts.sort_unstable();
        let Some(usual) = counts.chunk_by(|a, b| a == b).max_by_key(|chunk| chunk.len()) else { return (0, 0) };
        let rows = grid.rows.iter().filter(|(_, row)| row.len() == usual[0]);
        let numbers = rows.flat_map(|(_, row)| row.iter()).map(cells::count).sum();
        (usual.len(), numbers)
    };
    let scores = [',', ';', '\t', '|', ' '].map(|d| (d, score(d)));
    let most = scores.iter().map(|(_, (rows, _))| *rows).max().unwrap_or(0);
    // A line or two may be a title, or have a cell too many.
    let enough = |rows: usize| most > 0 && rows + 2 + most / 10 >= most && rows > 0;
    let best = scores.iter().filter(|(_, (rows, _))| enough(*rows)).map(|(_, (_, numbers))| *numbers).max();
    let found = scores.iter().find(|(_, (rows, numbers))| enough(*rows) && Some(*numbers) == best);
    found.map_or(',', |(d, _)| *d)
}

/// Counts lines as an editor does. The reader's own count is one short in files whose lines end in `\r\n`: it takes a
/// record to begin between the two.
struct Lines<'a> {
    text: &'a [u8],
    at: usize,
    line: u64,
}

impl Lines<'_> {
    /// The line of the first byte at or after `byte` that ends no line; `byte` never falls from call to call.
    fn of(&mut self, byte: u64) -> u64 {
        let byte = usize::try_from(byte).unwrap_or(usize::MAX);
        while let Some(&here) = self.text.get(self.at)
            && (self.at < byte || here == b'\n' || here == b'\r')
        {
            self.at += 1;
            let ends = here == b'\n' || here == b'\r' && self.text.get(self.at) != Some(&b'\n');
            self.line += u64::from(ends);
        }
        self.line
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(text: &str) -> (char, Vec<(u64, Vec<String>)>) {
        let source = Source::Text(text.to_owned(), None);
        let grid = Grid::of(Utf8Path::new("t"), source, None).unwrap();
        let Form::Delimited(delimiter) = grid.form else { panic!("{:?}", grid.form) };
        (delimiter, grid.rows.iter().map(|(l, r)| (*l, r.iter().map(str::to_owned).collect())).collect())
    }

    #[test]
    fn forms_of_one_table_read_alike() {
        let forms = [
            (',', "j1,x\n1.5,-2\n\n3,4e1\n"),
            (';', "j1;x\r\n1,5;-2\r\n\r\n3;4e1\r\n"),
            ('\t', "j1\tx\n1.5\t\u{2212}2\n\n3\t4e1"),
            (' ', "j1   x\n  1,5 -2\n\n 3\t4e1\n"),
            (',', "j1, x\n1.5, -2\n\n3, 4e1\n"),
            (' ', "j1 x\r1.5 -2\r\r3 4e1\r"),
        ];
        for (expected, text) in forms {
            let (delimiter, rows) = grid(text);
            assert_eq!(delimiter, expected, "{text:?}");
            let cells: Vec<(u64, [&str; 2])> = rows.iter().map(|(l, r)| (*l, [r[0].as_str(), r[1].as_str()])).collect();
            assert_eq!(cells, [(1, ["j1", "x"]), (2, ["1.5", "-2"]), (4, ["3", "4e1"])], "{text:?}");
        }
    }

    #[test]
    fn lists_one_behind_the_other_are_apart() {
        for between in ["][", "] [", "],["] {
            let row = |k: usize| format!("[{k}.5,2,3{between}0.25,-0.5,0.5,0.75]\n");
            let (delimiter, rows) = grid(&(1..5).map(row).collect::<String>());
            assert_eq!(
                (delimiter, rows[0].1.iter().map(|c| c.trim()).collect::<Vec<_>>()),
                (',', vec!["1.5", "2", "3", "0.25", "-0.5", "0.5", "0.75"]),
                "{between}"
            );
        }
    }

    #[test]
    fn a_comma_inside_of_names_is_no_delimiter() {
        let text = "X, mm;Y, mm;Z, mm\n1,25;2,5;3,75\n4;5;6\n7;8;9\n10;11;12\n";
        let (delimiter, rows) = grid(text);
        assert_eq!((delimiter, rows[1].1[0].as_str()), (';', "1.25"));
    }
}
