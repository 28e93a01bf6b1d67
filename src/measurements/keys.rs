//! Rows of files that complete each other, joined by the names that both files give them.
//!
//! In: the files of one table. Out: the same with their rows in the order of one of them, and a sentence where that is
//! another than they stand in. A row's name is its `pose`, what a program calls its target, its number, or a label that
//! ends in its number. Names that stand in the same order need nothing. Rows whose name the other file does not have
//! are left out and said. A file of points may have more rows of one name than of another: each takes the joints of its
//! name. What goes wrong: names of which the other file has less than half, which are said, and the rows paired as they
//! stand; and a name that has more rows of joints than others, or one of three files and more, which is refused.

use std::collections::{BTreeMap, BTreeSet};

use super::columns::part::{Kind, Part};
use crate::files::{Error, Result};
use crate::tables::names::{What, words};

/// Words of which a column's name consists that numbers or names the rows.
const NAMING: &str = "pose poses row point measurement no nr num number index idx id name label key nummer punkt";

/// The names of a file's rows.
struct Key {
    part: usize,
    column: usize,
    /// Whether a name of the column says so.
    said: bool,
    names: Vec<String>,
}

impl Key {
    fn of(part: usize, parts: &[Part]) -> Option<Key> {
        let file = &parts[part];
        if file.rows.is_empty() || file.is_program() && file.label().is_none() {
            return None;
        }
        let own = file.meanings.iter().flatten().position(|name| name.what == What::Own("pose"));
        let named = own.or_else(|| file.names.iter().flatten().position(|name| is_naming(name)));
        let named = named.or_else(|| (0..file.width()).find(|&column| is_named_alike(parts, part, column)));
        let bare = file.names.as_ref().is_none_or(|names| names[0].is_empty());
        // Without names of columns what a row belongs to may stand before its label.
        let labels = (1..file.width()).filter(|&column| file.names.is_none() && file.kinds[column] == Kind::Words);
        let columns: Vec<usize> = match named {
            Some(column) => vec![column],
            None if bare => std::iter::once(0).chain(labels).collect(),
            None => Vec::new(),
        };
        let key = |column: usize| {
            let names = names(file, column)?;
            let numbers = names.iter().all(|name| name.chars().all(|c| c.is_ascii_digit()));
            let key = Key { part, column, said: named.is_some(), names };
            (key.said || numbers && key.is_distinct()).then_some(key)
        };
        columns.into_iter().find_map(key)
    }

    fn set(&self) -> BTreeSet<&str> {
        self.names.iter().map(String::as_str).collect()
    }

    fn is_distinct(&self) -> bool {
        self.set().len() == self.names.len()
    }

    /// The first number, where the names count the rows.
    fn counts_from(&self) -> Option<usize> {
        let first = self.names[0].parse().ok()?;
        self.names.iter().zip(first..).all(|(name, i): (_, usize)| *name == i.to_string()).then_some(first)
    }

    /// Whether these names are of the same rows as the others; names that are not said to be some must be all there.
    fn is_of(&self, other: &Key) -> bool {
        let (a, b) = (self.set(), other.set());
        let (common, least) = (a.intersection(&b).count(), a.len().min(b.len()));
        // Whether a count from 0 or one from 1 lacks a row, nobody can say.
        let shifted = a.contains("0") != b.contains("0") && self.counts_from().or(other.counts_from()).is_some();
        !shifted && if self.said && other.said { 2 * common >= least } else { common == least }
    }

    /// Whether the other's rows stand in this order, each name as often one after the other, or all of them as often.
    fn is_in_order(&self, other: &Key) -> bool {
        let times = other.names.len() / self.names.len().max(1);
        let same = |at: &dyn Fn(usize) -> usize| (0..other.names.len()).all(|i| other.names[i] == self.names[at(i)]);
        times * self.names.len() == other.names.len() && (same(&|i| i / times) || same(&|i| i % self.names.len()))
    }
}

/// Whether a column calls each of the rows by a name of its own, and another file has a column of the same name with
/// most of these: those of times differ.
fn is_named_alike(parts: &[Part], part: usize, column: usize) -> bool {
    let calls = |file: &Part, column: usize| -> Option<BTreeSet<String>> {
        let is_other = file.meanings.as_ref()?[column].what == What::Other;
        let all = names(file, column).filter(|_| is_other)?;
        let is_name = |name: &String| name.chars().all(|c| c.is_ascii_digit()) || name.parse::<f64>().is_err();
        let count = all.len();
        let all: BTreeSet<String> = all.into_iter().filter(is_name).collect();
        (all.len() == count).then_some(all)
    };
    let name = |file: &Part, column: usize| Some(file.names.as_ref()?[column].trim().to_lowercase());
    let own = name(&parts[part], column).filter(|name| !name.is_empty());
    let Some((own, called)) = own.zip(calls(&parts[part], column)) else { return false };
    let is_alike = |(file, at): (&Part, usize)| {
        let of = calls(file, at).filter(|_| name(file, at).as_ref() == Some(&own));
        of.is_some_and(|of| 2 * of.intersection(&called).count() >= of.len().min(called.len()))
    };
    let others = parts.iter().enumerate().filter(|(other, _)| *other != part).map(|(_, file)| file);
    others.flat_map(|file| (0..file.width()).map(move |at| (file, at))).any(is_alike)
}

/// The names in a column, numbers without what all labels have before them; `None` where a row has none.
fn names(file: &Part, column: usize) -> Option<Vec<String>> {
    let cells: Vec<&str> = file.rows.iter().map(|(_, row)| row[column].trim()).collect();
    let stem = cells[0].trim_end_matches(|c: char| c.is_ascii_digit());
    let is_label = stem.is_empty() || stem.chars().any(char::is_alphabetic);
    let number = |cell: &&str| cell.strip_prefix(stem).filter(|_| is_label)?.parse::<u64>().ok().map(|n| n.to_string());
    let whole =
        |cell: &&str| cell.parse::<f64>().ok().filter(|v| v.fract() == 0.0 && v.abs() < 1e9).map(|v| v.to_string());
    let plain = |cell: &&str| (!cell.is_empty()).then(|| (*cell).to_owned());
    let all = |of: &dyn Fn(&&str) -> Option<String>| cells.iter().map(of).collect::<Option<Vec<String>>>();
    all(&number).or_else(|| all(&whole)).or_else(|| all(&plain))
}

/// The column of words by which a table calls its rows, each by one of its own: `Name`, `Point`.
pub(super) fn label(part: &Part) -> Option<usize> {
    let is_label = |column: &usize| {
        let cells: BTreeSet<&str> = part.rows.iter().map(|(_, row)| row[*column].trim()).collect();
        part.kinds[*column] == Kind::Words && cells.len() == part.rows.len() && !cells.contains("")
    };
    let named = part.names.iter().flatten().enumerate().filter(|(_, name)| is_naming(name));
    named.map(|(column, _)| column).filter(|_| part.times == 1).find(is_label)
}

/// Whether a column's name says that it numbers or names the rows.
pub(super) fn is_naming(name: &str) -> bool {
    let words = words(name).0;
    !words.is_empty() && words.iter().all(|word| NAMING.split(' ').any(|known| known == word))
}

/// Puts the rows of all files that name them in one order; says what was done where they stand otherwise.
pub(super) fn align(parts: &mut [Part]) -> Result<Option<String>> {
    let keys: Vec<Key> = (0..parts.len()).filter_map(|part| Key::of(part, parts)).collect();
    let least = keys.iter().filter(|key| key.is_distinct()).min_by_key(|key| key.names.len());
    let Some(first) = least.filter(|_| keys.len() > 1) else { return Ok(None) };
    let others: Vec<&Key> = keys.iter().filter(|key| key.part != first.part).collect();
    let counted = |key: &Key| key.counts_from().is_some_and(|from| from < 2) && key.names.len() == first.names.len();
    if others.iter().all(|key| first.is_in_order(key) || counted(first) && counted(key)) {
        return Ok(None);
    }
    let (joined, strange): (Vec<&Key>, Vec<&Key>) = others.into_iter().partition(|key| first.is_of(key));
    if joined.is_empty() {
        return Ok(strange
            .into_iter()
            .find(|key| first.said && key.said)
            .and_then(|key| contradiction(parts, first, key)));
    }
    let mut kept: Vec<usize> = (0..first.names.len()).collect();
    let mut rows: Vec<BTreeMap<&str, Vec<usize>>> = Vec::new();
    for key in &joined {
        let mut of_name: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
        key.names.iter().enumerate().for_each(|(row, name)| of_name.entry(name).or_default().push(row));
        kept.retain(|&row| of_name.contains_key(first.names[row].as_str()));
        rows.push(of_name);
    }
    if kept.is_empty() {
        return Ok(None);
    }
    let sentence = sentence(parts, first, &joined, &kept);
    let count = first.names.len();
    let mut of_first = kept.clone();
    for (key, of_name) in joined.iter().zip(&rows) {
        let of = |row: &usize| of_name.get(first.names[*row].as_str()).map_or(&[][..], Vec::as_slice);
        let times = kept.first().map_or(0, |row| of(row).len());
        if let Some(odd) = kept.iter().find(|row| of(row).len() != times) {
            if joined.len() > 1 || !is_measured_alone(&parts[key.part]) {
                return Err(uneven(&parts[key.part], &first.names[*odd], of(odd), times));
            }
            of_first = kept.iter().flat_map(|row| vec![*row; of(row).len()]).collect();
        }
        let order: Vec<usize> = kept.iter().flat_map(of).copied().collect();
        reorder(&mut parts[key.part], key, &order);
    }
    // A file without names stands row by row beside the first.
    let of_joined = |part: usize| joined.iter().any(|key| key.part == part);
    for part in (0..parts.len()).filter(|part| !of_joined(*part) && *part != first.part) {
        if parts[part].rows.len() == count {
            parts[part].rows = of_first.iter().map(|&row| parts[part].rows[row].clone()).collect();
        }
    }
    reorder(&mut parts[first.part], first, &of_first);
    parts[first.part].key = Some(first.column);
    Ok(Some(sentence))
}

/// Whether a file has what was measured, and no joints of its own that its rows could differ in.
fn is_measured_alone(part: &Part) -> bool {
    part.names_any(|what| matches!(what, What::Coordinate(_) | What::Distance | What::Matrix(..)))
        && !part.names_any(|what| matches!(what, What::Joint(_)))
}

fn reorder(part: &mut Part, key: &Key, order: &[usize]) {
    part.rows = order.iter().map(|&row| part.rows[row].clone()).collect();
    part.kinds[key.column] = Kind::Counts;
}

fn sentence(parts: &[Part], first: &Key, joined: &[&Key], kept: &[usize]) -> String {
    const SHOWN: usize = 12;
    let file = |key: &Key| parts[key.part].file_name();
    let files: Vec<String> = joined.iter().map(|key| file(key)).collect();
    let name = parts[first.part].column_name(first.column);
    let mut text = format!("{} + {}: rows joined by `{name}`, not by their order", file(first), files.join(" + "));
    let taken: BTreeSet<&str> = kept.iter().map(|&row| first.names[row].as_str()).collect();
    for key in std::iter::once(&first).chain(joined) {
        let mut lone: Vec<&str> = key.names.iter().map(String::as_str).filter(|name| !taken.contains(name)).collect();
        lone.dedup();
        if !lone.is_empty() {
            let more = if lone.len() > SHOWN { format!(" and {} more", lone.len() - SHOWN) } else { String::new() };
            let shown = lone[..lone.len().min(SHOWN)].join(", ");
            let name = parts[key.part].column_name(key.column);
            text.push_str(&format!(
                "; left out of {}: `{name}` {shown}{more}, which the other file does not have",
                file(key)
            ));
        }
    }
    text
}

/// That two files name their rows differently, and are paired row by row.
fn contradiction(parts: &[Part], first: &Key, other: &Key) -> Option<String> {
    let row = (0..first.names.len().min(other.names.len())).find(|&row| first.names[row] != other.names[row])?;
    let of = |key: &Key| {
        let part = &parts[key.part];
        format!("`{}` in `{}` of {}", &part.rows[row].1[key.column], part.column_name(key.column), part.file_name())
    };
    let (number, first, other) = (row + 1, of(first), of(other));
    Some(format!(
        "row {number} is {first} and {other}: the rows are paired in their order; look whether they belong together"
    ))
}

fn uneven(part: &Part, name: &str, rows: &[usize], times: usize) -> Error {
    let line = rows.first().map_or(1, |&row| part.rows[row].0);
    let message = format!("`{name}` has {} rows, others have {times}", rows.len());
    let hint = "where files are joined by the names of their rows, each has as many rows in one file; only in one of two files, that of the \
                points, a name may have more of them than others";
    part.grid.refuse(line, message, Some(hint))
}
