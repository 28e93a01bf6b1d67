//! Where the names of a table's columns stand, if there are any, and where its numbers begin.
//!
//! In: a grid. Out: names, or none, and the rows below. The first row that is mostly numbers, or has numbers and words
//! where the rows below it have them, is the first row of the table; the row above it has the names, one that has
//! nothing but units below the names goes with them, and what stands above is a title. Names that count the columns, 0,
//! 1, 2, ..., are none. A comment above the numbers whose words are none of their columns is no row of names. What goes
//! wrong: rows of other lengths than the others, names of another count than the columns, and a second table below the
//! first; all are refused with the line.

use super::fields::Fields;
use super::grid::Grid;
use super::names::{Name, Unit, What, is_said_of_another, words};
use crate::files::{self, Result};

/// A table's rows, and names where it has them.
#[derive(Debug, Clone)]
pub struct Headed {
    /// One a column.
    pub names: Option<Vec<String>>,
    /// Line and cells, all of one length.
    pub rows: Vec<(u64, Fields)>,
}

/// Columns from which on names that count them are no readings.
const COUNTED: usize = 4;

/// Rows below one that tell which of its columns are of numbers.
const BELOW: usize = 20;

/// Finds the names of a grid; `is_number` says which of its cells are numbers.
pub fn split(grid: &Grid, is_number: &dyn Fn(&str) -> bool) -> Result<Headed> {
    let Some(mut first) = first_row(grid, is_number) else {
        let records = grid.rows.iter().flat_map(|(_, row)| row.iter()).any(|cell| cell.starts_with("[{"));
        let hint = match records {
            true => {
                "a cell holds a list of records: make a table of that list, `record_path` in `pandas.json_normalize`"
            }
            false => "a table has rows of numbers, with names of the columns above them or without",
        };
        let text = files::read_text(&grid.path, "table", None).unwrap_or_default();
        return Err(match files::kind::kind(&text) {
            Some(kind) if kind != "a table" => {
                grid.refuse(1, format!("this is {kind}, and a table is needed"), Some(hint))
            }
            _ => grid.refuse(1, "no row of numbers".to_owned(), Some(hint)),
        });
    };
    let mut names = None;
    if first == 0 && counts(&grid.rows[0].1) && grid.rows.len() > 1 {
        first = 1;
    } else {
        // Names may be numbers, too: the joints' 1 to 6 beside x, y and z.
        first += usize::from(names_below(grid, first, is_number));
        let width = grid.rows[first].1.len();
        let head = (0..first).rev().find(|&at| !is_remark(&grid.rows[at].1, width));
        // What stands above a remark may be a title as well.
        let fits = |at: &usize| at + 1 == first || grid.rows[*at].1.len().abs_diff(width) < 2;
        names = head.filter(fits).map(|at| above(grid, at));
    }
    let rows = even(grid, first, names.as_ref().map_or(0, |(_, names)| names.len()))?;
    let width = rows.first().map_or(0, |(_, row)| row.len());
    let names = names.and_then(|(line, names)| Some((line, without_title(names, width)?)));
    let names = names.map(|(line, names)| fitted(grid, line, names, &rows, width)).transpose()?;
    Ok(Headed { names, rows })
}

/// The rows of a grid whose columns are named otherwise, whatever stands above them.
pub fn rows_alone(grid: &Grid, is_number: &dyn Fn(&str) -> bool) -> Result<Headed> {
    Ok(Headed { names: None, rows: even(grid, first_row(grid, is_number).unwrap_or(0), 0)? })
}

pub fn is_number(cell: &str) -> bool {
    cell.parse::<f64>().is_ok()
}

/// The first row of the table.
fn first_row(grid: &Grid, is_number: &dyn Fn(&str) -> bool) -> Option<usize> {
    let rows = &grid.rows;
    (0..rows.len()).find(|&at| is_data(&rows[at].1, is_number) || is_labelled(&rows[at..], is_number))
}

/// Whether the first of these rows has numbers where most of those below it have numbers, and words where they have
/// words, be these as many as they may: `A,Main,p1,2.5,3.5,4.5,2024-05-06 10:00:00`. What is counted or sized in names
/// and titles is whole, or stands above words.
fn is_labelled(rows: &[(u64, Fields)], is_number: &dyn Fn(&str) -> bool) -> bool {
    let [(_, row), below @ ..] = rows else { return false };
    let below = &below[..below.len().min(BELOW)];
    let is_word = |cell: &str| cell.chars().any(char::is_alphanumeric) && !is_number(cell);
    let most = |column: usize, is: &dyn Fn(&str) -> bool| {
        2 * below.iter().filter(|(_, r)| r.len() == row.len() && is(&r[column])).count() > below.len()
    };
    let is_alike = |(column, cell): (usize, &str)| match (is_number(cell), is_word(cell)) {
        (true, _) => most(column, is_number),
        (_, true) => most(column, &is_word),
        _ => true,
    };
    let is_broken = |cell: &str| cell.parse::<f64>().is_ok_and(|v| v.is_finite() && v.fract() != 0.0);
    let filled = row.iter().filter(|cell| !cell.trim().is_empty()).count();
    // Of a title in a spreadsheet most cells are empty.
    row.iter().filter(|cell| is_broken(cell)).count() > 1
        && 2 * filled > row.len()
        && row.iter().enumerate().all(is_alike)
}

/// More numbers than words.
fn is_data(row: &Fields, is_number: &dyn Fn(&str) -> bool) -> bool {
    let filled = row.iter().filter(|cell| !cell.trim().is_empty()).count();
    let numbers = row.iter().filter(|cell| is_number(cell)).count();
    numbers > 0 && 2 * numbers >= filled
}

/// Whether a row counts some of its columns, and has words for others that have numbers in all rows below it.
fn names_below(grid: &Grid, row: usize, is_number: &dyn Fn(&str) -> bool) -> bool {
    let (cells, below) = (&grid.rows[row].1, &grid.rows[row + 1..]);
    let counted: Vec<usize> = cells.iter().filter_map(|cell| cell.parse().ok()).collect();
    let counts = counted.first().is_some_and(|&first| first < 2 && counted.iter().zip(first..).all(|(n, i)| *n == i));
    let is_word = |cell: &str| !cell.is_empty() && !is_number(cell);
    let numbers = |column: usize| below.iter().all(|(_, r)| column < r.len() && is_number(&r[column]));
    counts && below.len() > 1 && (0..cells.len()).any(|column| is_word(&cells[column]) && numbers(column))
}

/// Whether a row is a comment. What a spreadsheet writes for a value that it does not have is none.
fn is_comment(row: &Fields) -> bool {
    const ERRORS: [&str; 7] = ["#N/A", "#REF!", "#DIV/0!", "#VALUE!", "#NAME?", "#NUM!", "#NULL!"];
    ["#", "%", "//"].iter().any(|mark| row[0].starts_with(mark))
        && !ERRORS.iter().any(|error| row[0].starts_with(error))
}

/// Whether a row above the numbers is a comment that names no columns.
fn is_remark(row: &Fields, width: usize) -> bool {
    if row.iter().skip(1).all(|cell| cell.trim().is_empty()) {
        return is_comment(row) && without_title(vec![row[0].to_owned()], width).is_none();
    }
    let unknown = |cell: &str| Name::of(cell).what == What::Other;
    // Units stand apart from their names; the number of the row may be one more or one less.
    let names = row.iter().filter(|cell| !cell.starts_with(['[', '(']) && !matches!(*cell, "#" | "%" | "//")).count();
    is_comment(row) && names.abs_diff(width) > 1 && row.iter().all(unknown)
}

/// Refuses a second table below the first: names that stand again, or a row of other names of columns.
fn refuse_second_table(grid: &Grid, first: usize) -> Result<()> {
    let names = first.checked_sub(1).map(|at| &grid.rows[at].1);
    let known = |cell: &&str| !matches!(Name::of(cell).what, What::Other | What::Own(_));
    let is_names = |row: &Fields| {
        let filled = row.iter().filter(|cell| !cell.trim().is_empty()).count();
        let understood = row.iter().filter(known).count();
        let words = row.iter().all(|cell| cell.parse::<f64>().is_err());
        let others = understood > 1 && 2 * understood >= filled && !is_comment(row);
        words && filled > 1 && (Some(row) == names || others)
    };
    let Some((line, _)) = grid.rows[first..].iter().find(|(_, row)| is_names(row)) else { return Ok(()) };
    let hint = "save each table as a file of its own, each with `--measurements`, where the robot or the sensor was moved between them; else remove the line";
    Err(grid.refuse(*line, "a second table begins here: this row holds names of columns".to_owned(), Some(hint)))
}

/// Whether a row counts its columns, but for that of the rows' own numbers.
fn counts(row: &Fields) -> bool {
    let skipped = usize::from(row[0].is_empty());
    let from = row.iter().nth(skipped).and_then(|cell| cell.parse::<usize>().ok()).unwrap_or(usize::MAX);
    from < 2
        && row.len() >= COUNTED + skipped
        && row.iter().skip(skipped).zip(from..).all(|(cell, i)| cell == i.to_string())
}

/// The names of a row, or above it where it has their units, with the headings above them, and their line.
fn above(grid: &Grid, mut at: usize) -> (u64, Vec<String>) {
    let cells = |at: usize| -> Vec<String> { grid.rows[at].1.iter().map(|c| c.trim().to_owned()).collect() };
    let mut names = cells(at);
    let unit = |cell: &String| cell.is_empty() || Unit::of(cell.trim_matches(['[', ']', '(', ')'])).is_some();
    if at > 0 && names.iter().all(unit) && cells(at - 1).len() == names.len() {
        let joined = |(name, unit): (String, &String)| match unit.is_empty() {
            true => name,
            false => format!("{name} [{}]", unit.trim_matches(['[', ']', '(', ')'])),
        };
        at -= 1;
        names = cells(at).into_iter().zip(&names).map(joined).collect();
    }
    let filled = |cells: &[String]| cells.iter().filter(|cell| !cell.is_empty()).count();
    let twice = (1..names.len()).any(|i| !names[i].is_empty() && names[..i].contains(&names[i]));
    if at > 0 && filled(&cells(at - 1)) > 1 {
        // A heading stands in the first of the cells that it spans. Names that stand twice are of it, and others have
        // its unit.
        let mut heading = String::new();
        let headings = cells(at - 1).into_iter().chain(std::iter::repeat(String::new()));
        for (name, above) in names.iter_mut().zip(headings) {
            heading = if above.is_empty() { heading } else { above };
            match words(&heading).1 {
                _ if twice => *name = format!("{heading} {name}").trim().to_owned(),
                Some(unit) if Name::of(name).unit.is_none() && !name.is_empty() => {
                    *name += &format!(" [{}]", unit.flag())
                }
                _ => {}
            }
        }
    }
    (grid.rows[at].0, names)
}

/// The names of a line in one piece, which has another delimiter than the rows; `None` where it is a title.
fn without_title(names: Vec<String>, width: usize) -> Option<Vec<String>> {
    let [only] = &names[..] else { return Some(names) };
    if width == 1 {
        return Some(names);
    }
    let only = only.trim_start_matches(['#', '%']);
    let split = |by: char| -> Vec<String> { only.split(by).map(|word| word.trim().to_owned()).collect() };
    let blanks = only.split_whitespace().map(str::to_owned).collect();
    [split(','), split(';'), split('\t'), split('|'), blanks].into_iter().find(|words| words.len() == width)
}

/// The rows from `first` on, made equally long: cells at the end that are empty everywhere are none.
fn even(grid: &Grid, first: usize, names: usize) -> Result<Vec<(u64, Fields)>> {
    refuse_second_table(grid, first)?;
    let filled =
        |row: &Fields| row.len() - row.iter().collect::<Vec<_>>().iter().rev().take_while(|c| c.is_empty()).count();
    let rows: Vec<&(u64, Fields)> = grid.rows[first..].iter().filter(|(_, row)| !is_comment(row)).collect();
    let mut lengths: Vec<usize> = rows.iter().map(|(_, row)| row.len()).collect();
    lengths.sort_unstable();
    let usual = lengths.chunk_by(|a, b| a == b).max_by_key(|chunk| chunk.len()).map_or(0, |chunk| chunk[0]);
    let widest = rows.iter().map(|(_, row)| filled(row)).max().unwrap_or(0);
    let width = if widest <= usual { usual.min(widest.max(names)) } else { usual };
    let mut even = Vec::with_capacity(rows.len());
    for (line, row) in rows {
        if row.len() < width.min(usual) || filled(row) > width {
            let cells = if row.len() == 1 { "1 cell".to_owned() } else { format!("{} cells", row.len()) };
            let message = format!("{cells}, but most rows have {usual}");
            return Err(grid.refuse(*line, message, Some("each row has a cell for each column; an empty one counts")));
        }
        even.push((*line, if row.len() == width { row.clone() } else { Fields::new(row.iter().take(width)) }));
    }
    Ok(even)
}

/// Names with those that belong to the one before put behind it.
fn joined(names: &[String], belongs: impl Fn(&str, &str) -> bool) -> Vec<String> {
    let mut joined: Vec<String> = Vec::new();
    for (i, name) in names.iter().enumerate() {
        match joined.last_mut().filter(|_| belongs(&names[i - 1], name)) {
            Some(before) => *before = format!("{before} {name}"),
            None => joined.push(name.clone()),
        }
    }
    joined
}

/// Names, one a column: without a comment's mark, with units put back to the names that blanks cut off, with one for
/// numbers of rows.
fn fitted(grid: &Grid, line: u64, mut names: Vec<String>, rows: &[(u64, Fields)], width: usize) -> Result<Vec<String>> {
    if names.first().is_some_and(|name| matches!(name.as_str(), "#" | "%" | "//")) {
        names.remove(0);
    }
    if let Some(first) = names.first_mut() {
        *first = first.trim_start_matches(['#', '%']).trim_start_matches("//").trim().to_owned();
    }
    if names.len() > width {
        names = joined(&names, |_, name| name.starts_with(['[', '(']));
    }
    while names.len() > width && names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    if names.len() > width {
        // `Nominal X Nominal Y`: blanks cut these off from what they are said of.
        let joined = joined(&names, |before, _| is_said_of_another(before));
        names = if joined.len() == width { joined } else { names };
    }
    // Names of rows have no name of their own.
    let numbered = rows
        .iter()
        .enumerate()
        .all(|(i, (_, row))| row[0].parse::<f64>().map_or(true, |v| v == i as f64 || v == (i + 1) as f64));
    if names.len() + 1 == width && numbered {
        names.insert(0, String::new());
    }
    if names.len() != width {
        let message = format!("{} names for {width} columns", names.len());
        let hint = "`--columns NAME,NAME,...` names the columns in their order, `-` skips one";
        return Err(grid.refuse(line, message, Some(hint)));
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Headed> {
        let (_folder, path) = files::temporary("t.csv", text);
        split(&Grid::read(&path, "the table", "")?, &is_number)
    }

    fn names(text: &str) -> Option<Vec<String>> {
        read(text).unwrap().names
    }

    #[test]
    fn names_are_found_wherever_they_stand() {
        let rows = "1,2,3\n4,5,6.5\n7,8,9\n";
        for header in ["a,b,c\n", "# a,b,c\n", "Table of today\na,b,c\n", "a,b,c,\n"] {
            assert_eq!(names(&format!("{header}{rows}")).unwrap(), ["a", "b", "c"], "{header}");
        }
        assert_eq!(names(&format!("a,b,c\nmm,mm,\n{rows}")).unwrap(), ["a [mm]", "b [mm]", "c"]);
        assert_eq!(names("# a [mm] b\n1.5 2\n3.5 4\n").unwrap(), ["a [mm]", "b"]);
        let two = "Name Nominal X Nominal Y Measured X Measured Y\nP1 1.5 2 3 4\nP2 3.5 4 5 6\n";
        assert_eq!(names(two).unwrap(), ["Name", "Nominal X", "Nominal Y", "Measured X", "Measured Y"]);
        assert_eq!(names("a b\nr1 1.5 2\nr2 3.5 4\n").unwrap(), ["", "a", "b"]);
        let labelled = "a,b,p1,1.5,2.5,3,2024-05-06 10:00\na,b,p2,,4.5,6,2024-05-06 10:01\na,b,p3,7,8.5,9,2024-05-06 10:02\na,b,p4,1,8,9.5,2024-05-06 10:03\n";
        assert_eq!(names(labelled), None);
        assert_eq!(read(labelled).unwrap().rows.len(), 4);
        let head = "// of today\n// Set,Group,Target,X,Y,Z,Time\n";
        assert_eq!(names(&format!("{head}{labelled}")).unwrap(), ["Set", "Group", "Target", "X", "Y", "Z", "Time"]);
        // Numbers in a title stand above words, or are alone in their row.
        let title = "tool,at,1.5,2.5,mm,by,me\n";
        assert_eq!(read(&format!("{title}{labelled}")).unwrap().rows.len(), 4);
        assert!(read("a,b,c,1.5,2.5\nd,e,f,g,h\n").is_err());
        assert_eq!(names(rows), None);
        assert_eq!(names(&format!("1,2,x\n{rows}")).unwrap(), ["1", "2", "x"]);
        assert_eq!(read(&format!("a,b,c\n{rows}# pause; then on\n1,2,3\n% end\n")).unwrap().rows.len(), 4);
        assert_eq!(names("0,1,2,3\n1.5,2,3,4\n"), None);
        assert_eq!(names(",0,1,2,3\n0,1.5,2,3,4\n1,2.5,3,4,5\n"), None);
        for title in
            ["Units: mm", "// exported by the tracker", "# 3 columns", "# measured by Ada in May,,", "# today,"]
        {
            assert_eq!(names(&format!("{title}\n{rows}")), None, "{title}");
        }
        for header in ["a b c", "# a\tb\tc", "a;b;c"] {
            assert_eq!(names(&format!("{header}\n{rows}")).unwrap(), ["a", "b", "c"], "{header}");
        }
        let headings = "No.,nominal (mm),,measured,\n,X,Y,X,Y\n1,2.5,3,4,5\n2,3.5,4,5,6\n";
        let together = ["No.", "nominal (mm) X", "nominal (mm) Y", "measured X", "measured Y"];
        assert_eq!(names(headings).unwrap(), together);
        // Names that stand once need nothing of what is above them.
        assert_eq!(names("robot 7,today,\na,b,c\n1,2,3\n4,5,6.5\n").unwrap(), ["a", "b", "c"]);
        assert_eq!(read("0,1,2,3\n1.5,2,3,4\n").unwrap().rows.len(), 1);
    }

    #[test]
    fn rows_of_other_lengths_are_refused_with_their_line() {
        let said = |text: &str| crate::diagnostic::report(&read(text).unwrap_err());
        assert!(said("a,b,c\n1,2,3\n4,5\n6,7,8\n").contains("t.csv:3"));
        assert!(said("a,b\n1,2,3\n4,5,6\n9,9,9\n").contains("2 names for 3 columns"));
        assert_eq!(read("a,b\n1,2,\n4,5,\n").unwrap().rows[0].1.len(), 2);
    }
}
