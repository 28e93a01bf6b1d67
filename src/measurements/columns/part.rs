//! One file of a table: its columns, with names understood where there are any.

use std::collections::BTreeSet;

use camino::Utf8Path;

use crate::files::{Error, Result};
use crate::measurements::summaries;
use crate::tables::Form;
use crate::tables::header;
use crate::tables::names::{Name, Unit, What};
use crate::tables::{Fields, Grid};

/// A column of one of several files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::measurements) struct At {
    pub part: usize,
    /// Its column, from 0.
    pub column: usize,
}

/// What a column has in its cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(in crate::measurements) enum Kind {
    /// Numbers, some of them other than zero; empty cells allowed.
    Numbers,
    /// The row's number.
    Counts,
    Zeros,
    Words,
    /// Numbers in a column that flags do not name.
    Beyond,
    /// Numbers and, in this row, a word.
    Mixed(usize),
}

#[derive(Debug, Clone)]
pub(in crate::measurements) struct Part {
    /// Where it was read, and how.
    pub grid: Grid,
    /// Names as they stand.
    pub names: Option<Vec<String>>,
    /// Names as they are understood; of a program its joints.
    pub meanings: Option<Vec<Name>>,
    /// Line and cells, all of one length.
    pub rows: Vec<(u64, Fields)>,
    pub kinds: Vec<Kind>,
    /// The column by which rows were joined with those of another file, or by which the table calls them.
    pub key: Option<usize>,
    /// Rows of the file that stand side by side in each row here.
    pub times: usize,
    /// What is said of rows that stood below the table.
    pub below: Option<String>,
}

/// Cells that say that there is no number.
const NOTHING: [&str; 11] = ["", "nan", "na", "n/a", "#n/a", "-", "--", "---", "null", "none", "inf"];

impl Part {
    /// Reads a file; a program's targets have the robot's joints, so many. Names that do not fit the columns are an
    /// error, unless the columns are `named` otherwise.
    pub fn read(path: &Utf8Path, joints: usize, named: bool) -> Result<Part> {
        let hint = "`stereocal measure POSES` writes out/measurements.csv; `--measurements FILE` names another";
        let grid = Grid::read_with_programs(path, "measurements file", hint, joints)?;
        if grid.rows.is_empty() {
            return Err(grid.refuse(1, "the file is empty".to_owned(), None));
        }
        let headed = match grid.form {
            Form::Program { .. } => header::Headed { names: None, rows: grid.rows.clone() },
            _ => match header::split(&grid, &header::is_number) {
                Err(_) if named => header::rows_alone(&grid, &header::is_number)?,
                headed => headed?,
            },
        };
        let mut headed = match stacked(&headed.rows).filter(|_| headed.names.is_none()) {
            Some(rows) => header::Headed { rows, ..headed },
            None => headed,
        };
        let below = summaries::taken_away(path, &mut headed.rows)?;
        let width = headed.rows.first().map_or(0, |(_, row)| row.len());
        let kinds = (0..width).map(|column| kind(&headed.rows, column)).collect();
        let mut meanings: Option<Vec<Name>> = headed.names.as_ref().map(|names| understood(names));
        if let Some(meanings) = &mut meanings {
            target_as_name(meanings, &headed.rows);
            without_blank_points(meanings, &headed.rows);
        }
        if let Form::Program { degrees, .. } = grid.form {
            meanings = Some((0..width).map(|column| of_program(column, joints, degrees)).collect());
        }
        let part = Part { grid, names: headed.names, meanings, rows: headed.rows, kinds, key: None, times: 1, below };
        part.unread_unit().filter(|_| !named).map_or(Ok(part), Err)
    }

    /// That a column is in a unit that is not read.
    fn unread_unit(&self) -> Option<Error> {
        let (names, meanings) = (self.names.as_ref()?, self.meanings.as_ref()?);
        let (name, unit) = names.iter().zip(meanings).find_map(|(name, m)| Some((name, m.unread_unit()?)))?;
        let message = format!("`{name}` is in `{unit}`, which is no unit that is read");
        let hint = "convert the column: joints to deg or rad; points and distances to mm, m, um, cm or inches";
        Some(self.refuse(message, Some(hint)))
    }

    pub fn width(&self) -> usize {
        self.kinds.len()
    }

    /// The same as the file has them.
    pub fn width_of_file(&self) -> usize {
        self.kinds.len() / self.times - usize::from(self.label().is_some())
    }

    /// The column with the names that a program gives its targets.
    pub fn label(&self) -> Option<usize> {
        let meanings = self.meanings.as_ref().filter(|_| self.is_program())?;
        meanings.iter().position(|name| name.what == What::Own("pose"))
    }

    pub fn is_program(&self) -> bool {
        matches!(self.grid.form, Form::Program { .. })
    }

    /// The calls that hold a program's targets, where its language is not known.
    pub fn calls(&self) -> &[String] {
        match &self.grid.form {
            Form::Program { calls, .. } => calls,
            _ => &[],
        }
    }

    /// Whether names say what it has.
    pub fn is_named(&self) -> bool {
        self.meanings.as_ref().is_some_and(|m| m.iter().any(|name| name.what != What::Other))
    }

    /// Whether a named column is one of these.
    pub fn names_any(&self, wanted: impl Fn(&What) -> bool) -> bool {
        self.meanings.as_ref().is_some_and(|m| m.iter().any(|name| wanted(&name.what)))
    }

    /// Columns of numbers without a name that says anything.
    pub fn free(&self) -> Vec<usize> {
        self.unnamed(|kind| *kind == Kind::Numbers)
    }

    /// The same with those of zeros: a joint that never moved is one.
    pub fn free_and_still(&self) -> Vec<usize> {
        self.unnamed(|kind| matches!(kind, Kind::Numbers | Kind::Zeros))
    }

    fn unnamed(&self, wanted: impl Fn(&Kind) -> bool) -> Vec<usize> {
        if self.is_named() { Vec::new() } else { (0..self.width()).filter(|&c| wanted(&self.kinds[c])).collect() }
    }

    /// Columns of numbers whose names are of no word that is known.
    pub fn spare(&self) -> Vec<usize> {
        let unknown = |name: &Name| name.what == What::Other && name.measured.is_none();
        match &self.meanings {
            Some(meanings) if self.is_named() && !self.is_program() => {
                (0..self.width()).filter(|&c| self.kinds[c] == Kind::Numbers && unknown(&meanings[c])).collect()
            }
            _ => Vec::new(),
        }
    }

    /// What is wrong with a column of numbers that has a word in it.
    pub fn mixed(&self) -> Option<Error> {
        let number = |row: &(u64, Fields), column: usize| row.1[column].parse::<f64>().is_ok();
        self.kinds.iter().enumerate().find_map(|(column, kind)| match kind {
            Kind::Mixed(row) if 2 * self.rows.iter().filter(|r| number(r, column)).count() > self.rows.len() => {
                self.optional(*row, column).err()
            }
            _ => None,
        })
    }

    /// Whether a column has a few values, each in several rows, as places and sessions have: it may be the group that
    /// the user means.
    pub fn parts_rows(&self, column: usize) -> bool {
        let mut values: Vec<&str> = self.rows.iter().map(|(_, row)| row[column].trim()).collect();
        values.sort_unstable();
        values.dedup();
        (2..=self.rows.len() / 4).contains(&values.len())
    }

    /// A column as a message calls it.
    pub fn column_name(&self, column: usize) -> String {
        let name = self.names.as_ref().and_then(|names| names.get(column)).filter(|name| !name.is_empty());
        let unnamed = || match self.label() == Some(column) {
            true => "name".to_owned(),
            false => format!("column {}", column + 1),
        };
        name.cloned().unwrap_or_else(unnamed)
    }

    /// The number of a cell, or none where the cell says so.
    pub fn optional(&self, row: usize, column: usize) -> Result<Option<f64>> {
        let (line, fields) = &self.rows[row];
        let cell = fields[column].trim();
        match cell.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(Some(value)),
            _ if NOTHING.contains(&cell.to_lowercase().as_str()) => Ok(None),
            _ => {
                let numbers = self.rows.iter().filter(|(_, r)| r[column].parse::<f64>().is_ok()).count();
                let (name, count) = (self.column_name(column), self.rows.len());
                let message = format!("`{name}` is not a number: `{cell}` ({numbers} of {count} rows have one)");
                let hint = "mend or remove the row, or leave the cell empty where nothing was measured";
                Err(self.grid.refuse(*line, message, Some(hint)))
            }
        }
    }

    /// The number of a cell that must have one.
    pub fn number(&self, row: usize, column: usize) -> Result<f64> {
        let value = self.optional(row, column)?;
        value.ok_or_else(|| {
            let message = format!("`{}` has no number", self.column_name(column));
            self.grid.refuse(self.rows[row].0, message, Some("a row without all joints says nothing; remove it"))
        })
    }

    /// The name of the file for a sentence.
    pub fn file_name(&self) -> String {
        self.grid.path.file_name().unwrap_or(self.grid.path.as_str()).to_owned()
    }

    /// A complaint about the file as a whole.
    pub fn refuse(&self, message: String, hint: Option<&str>) -> Error {
        self.grid.refuse(self.rows.first().map_or(1, |(line, _)| *line), message, hint)
    }
}

/// Transforms that are written one below the other, four rows of four each: a row of sixteen cells each.
fn stacked(rows: &[(u64, Fields)]) -> Option<Vec<(u64, Fields)>> {
    const LAST: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
    let is_last = |row: &Fields| row.iter().zip(LAST).all(|(cell, v)| cell.parse() == Ok(v));
    let four = rows.iter().all(|(_, row)| row.len() == 4) && rows.len().is_multiple_of(4);
    if !four || !rows.chunks_exact(4).all(|matrix| is_last(&matrix[3].1)) {
        return None;
    }
    let together = |matrix: &[(u64, Fields)]| (matrix[0].0, Fields::new(matrix.iter().flat_map(|(_, row)| row.iter())));
    Some(rows.chunks_exact(4).map(together).collect())
}

/// Letters by which Yaskawa's controllers call the joints of six axes, and of seven.
const LETTERED: [&str; 2] = ["slurbt", "slerubt"];

/// What Universal Robots calls the joints; recorders write them in the order of the alphabet.
const CALLED: [&str; 6] = ["shoulderpan", "shoulderlift", "elbow", "wrist1", "wrist2", "wrist3"];

/// Names as what they mean, those of controllers that call their joints by letters or by words included.
fn understood(names: &[String]) -> Vec<Name> {
    let mut meanings: Vec<Name> = names.iter().map(|name| Name::of(name)).collect();
    let words: Vec<String> = names.iter().map(|name| crate::tables::names::words(name).0.concat()).collect();
    for letters in LETTERED {
        let is_it = |window: &[String]| window.iter().zip(letters.chars()).all(|(word, c)| *word == c.to_string());
        if let Some(first) = words.windows(letters.len()).position(is_it) {
            for (joint, name) in meanings[first..first + letters.len()].iter_mut().enumerate() {
                *name = Name { what: What::Joint(joint + 1), key: vec![letters.to_owned()], ..name.clone() };
            }
        }
    }
    let called = |word: &&str| -> Option<usize> {
        let columns = (0..names.len()).filter(|&c| words[c].contains(*word) && meanings[c].measured != Some(false));
        <[usize; 1]>::try_from(columns.collect::<Vec<_>>()).ok().map(|[only]| only)
    };
    let columns: Vec<usize> = CALLED.iter().filter_map(called).collect();
    if columns.len() == CALLED.len() {
        for (joint, column) in columns.into_iter().enumerate() {
            let (unit, key) = (meanings[column].unit, vec!["called".to_owned()]);
            meanings[column] = Name { what: What::Joint(joint + 1), unit, key, measured: None };
        }
    }
    meanings
}

/// More targets than a body has.
const MANY: usize = 8;

/// A `target` of which each row has one of its own is the name of the row: the targets of a body come again at other
/// poses.
fn target_as_name(meanings: &mut [Name], rows: &[(u64, Fields)]) {
    let own = |wanted: &str| meanings.iter().position(|n| matches!(n.what, What::Own(own) if own == wanted));
    let Some(column) = own("target").filter(|_| own("pose").is_none() && rows.len() > MANY) else { return };
    let cells: BTreeSet<&str> =
        rows.iter().map(|(_, row)| row[column].trim()).filter(|cell| !cell.is_empty()).collect();
    if cells.len() == rows.len() {
        meanings[column].what = What::Own("pose");
    }
}

/// Columns of a point that nobody filled in, beside those of one that was, are none of a point.
fn without_blank_points(meanings: &mut [Name], rows: &[(u64, Fields)]) {
    let is_nothing = |cell: &str| NOTHING.contains(&cell.trim().to_lowercase().as_str());
    let is_blank = |column: usize| rows.iter().all(|(_, row)| is_nothing(&row[column]));
    let points: Vec<usize> =
        (0..meanings.len()).filter(|&column| matches!(meanings[column].what, What::Coordinate(_))).collect();
    let (blank, filled): (Vec<usize>, Vec<usize>) = points.into_iter().partition(|&column| is_blank(column));
    if !filled.is_empty() {
        blank.into_iter().for_each(|column| meanings[column].what = What::Other);
    }
}

/// Numbers of a program's line beyond the robot's joints are those of axes that it does not have; in a language that is
/// known the targets' names stand there.
fn of_program(column: usize, joints: usize, degrees: bool) -> Name {
    let what = match column {
        _ if column < joints => What::Joint(column + 1),
        _ if degrees => What::Own("pose"),
        _ => What::Other,
    };
    Name { what, unit: degrees.then_some(Unit::Deg), key: Vec::new(), measured: None }
}

fn kind(rows: &[(u64, Fields)], column: usize) -> Kind {
    let (mut numbers, mut words, mut zeros, mut counts) = (0, None, true, true);
    let first = rows[0].1[column].parse::<f64>().unwrap_or(f64::NAN);
    for (i, (_, row)) in rows.iter().enumerate() {
        match row[column].parse::<f64>() {
            Ok(value) => {
                numbers += 1;
                zeros &= value == 0.0;
                counts &= value == first + i as f64;
            }
            Err(_) if NOTHING.contains(&row[column].to_lowercase().as_str()) => {}
            Err(_) => words = words.or(Some(i)),
        }
    }
    match (numbers, words) {
        (0, _) => Kind::Words,
        (_, Some(row)) => Kind::Mixed(row),
        _ if zeros => Kind::Zeros,
        // Readings do not count rows.
        _ if counts && (first == 0.0 || first == 1.0) && rows.len() > 3 => Kind::Counts,
        _ => Kind::Numbers,
    }
}
