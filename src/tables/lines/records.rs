//! Records of JSON as rows: an object a line, or a list of objects.
//!
//! In: a text. Out: a row of the names, and one for each object. A value in an object within has the names of both,
//! `point.x`; a list is a cell. What goes wrong: a text that is anything else, a lone object, objects of fewer numbers
//! than a point has, and objects that hardly share a name are no table.

use std::borrow::Cow;
use std::collections::BTreeMap;

use serde_json::{Deserializer, Map, Value};

use crate::tables::Fields;
use crate::tables::cells;

type Record = Map<String, Value>;

/// Numbers of a record at the least: those of a point.
const NUMBERS: usize = 3;

/// How many times as many cells as values a table has at the most; memory grows with the file's length.
const SPARSE: usize = 4;

/// The names, and below them the records with their lines.
pub fn read(text: &str) -> Option<Vec<(u64, Fields)>> {
    let (mut places, mut names): (BTreeMap<String, usize>, Vec<String>) = (BTreeMap::new(), Vec::new());
    let mut rows: Vec<(u64, Vec<(usize, String)>)> = Vec::new();
    for (line, record) in records(text)? {
        let mut values = Vec::new();
        flatten("", &Value::Object(record), &mut values);
        let place = |(name, value): (String, String)| {
            let place = *places.entry(name.clone()).or_insert(names.len());
            if place == names.len() {
                names.push(name);
            }
            (place, value)
        };
        rows.push((line, values.into_iter().map(place).collect()));
    }
    let values: usize = rows.iter().map(|(_, row)| row.len()).sum();
    let numbers =
        |(_, row): &(u64, Vec<(usize, String)>)| row.iter().map(|(_, cell)| cells::count(cell)).sum::<usize>();
    if rows.len() * names.len() > SPARSE * values || !rows.iter().any(|row| numbers(row) >= NUMBERS) {
        return None;
    }
    let row = |(line, values): (u64, Vec<(usize, String)>)| {
        let mut cells = vec![String::new(); names.len()];
        values.into_iter().for_each(|(place, value)| cells[place] = value);
        (line, Fields::new(cells))
    };
    let first = rows.first()?.0;
    Some(std::iter::once((first, Fields::new(&names))).chain(rows.into_iter().map(row)).collect())
}

/// The objects with the lines in which they begin, where the text is nothing else and has two of them.
fn records(text: &str) -> Option<Vec<(u64, Record)>> {
    let between = |c: char| c.is_whitespace() || c == ',' || c == '\u{feff}';
    let begins = text.trim_start_matches(between);
    let end = if begins.starts_with('[') { "]" } else { "" };
    if end.is_empty() && !begins.starts_with('{') {
        return None;
    }
    let mut line = 1 + newlines(&text[..text.len() - begins.len()]);
    let text = with_nulls(begins);
    let mut rest = text.strip_prefix('[').unwrap_or(&text);
    let mut found = Vec::new();
    loop {
        let behind = rest.trim_start_matches(between);
        line += newlines(&rest[..rest.len() - behind.len()]);
        if !behind.starts_with('{') {
            return (behind.trim_end() == end && found.len() > 1).then_some(found);
        }
        let mut stream = Deserializer::from_str(behind).into_iter::<Record>();
        found.push((line, stream.next()?.ok()?));
        rest = &behind[stream.byte_offset()..];
        line += newlines(&behind[..stream.byte_offset()]);
    }
}

fn newlines(text: &str) -> u64 {
    text.matches('\n').count() as u64
}

/// Python writes `NaN` for a number that there is none of, which JSON does not know.
fn with_nulls(text: &str) -> Cow<'_, str> {
    if !text.contains("NaN") {
        return text.into();
    }
    let outside = |(i, part): (usize, &str)| if i % 2 == 0 { part.replace("NaN", "null") } else { part.to_owned() };
    text.split('"').enumerate().map(outside).collect::<Vec<_>>().join("\"").into()
}

/// The values of an object with their names; one that is nothing is an empty cell.
fn flatten(name: &str, value: &Value, into: &mut Vec<(String, String)>) {
    let cell = match value {
        Value::Object(object) => {
            for (key, value) in object {
                flatten(&if name.is_empty() { key.clone() } else { format!("{name}.{key}") }, value, into);
            }
            return;
        }
        Value::Null => String::new(),
        Value::Array(list) if list.iter().all(Value::is_null) => String::new(),
        Value::String(text) => text.clone(),
        _ => value.to_string(),
    };
    into.push((name.to_owned(), cell));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Option<Vec<(u64, Vec<String>)>> {
        Some(read(text)?.iter().map(|(line, row)| (*line, row.iter().map(str::to_owned).collect())).collect())
    }

    #[test]
    fn an_object_is_a_row_wherever_it_begins() {
        let names = ["q", "p.x", "p.y", "note"];
        let expected = |lines: [u64; 2]| {
            let row = |line: u64, cells: [&str; 4]| (line, cells.map(str::to_owned).to_vec());
            vec![
                row(lines[0], names),
                row(lines[0], ["[1.5,2.5]", "3.5", "-4", ""]),
                row(lines[1], ["", "5", "", "NaN, lost"]),
            ]
        };
        let (first, second) = (
            r#"{"q": [1.5, 2.5], "p": {"x": 3.5, "y": -4}}"#,
            r#"{"p": {"x": 5, "y": NaN}, "q": null, "note": "NaN, lost"}"#,
        );
        assert_eq!(rows(&format!("{first}\n{second}\n")).unwrap(), expected([1, 2]));
        assert_eq!(rows(&format!("[{first}, {second}]")).unwrap(), expected([1, 1]));
        assert_eq!(rows(&format!("\u{feff}\n[\n {first},\n\n {second}\n]\n")).unwrap(), expected([3, 5]));
    }

    #[test]
    fn what_is_no_table_is_none() {
        for text in [
            "",
            "a,b\n1,2\n",
            "[[1, 2, 3], [4, 5, 6]]",
            r#"{"q": [1, 2, 3]}"#,
            r#"[{"q": 1}, {"q": 2}]"#,
            r#"[{"q": [1, 2, 3]}, {"q": [1, 2, 3]}"#,
            r#"{"q": [1, 2, 3]} {"q": [1, 2, 3]} more"#,
            "{A1 1, A2 2, A3 3}\n{A1 1, A2 2, A3 3}\n",
        ] {
            assert_eq!(rows(text), None, "{text}");
        }
        let sparse: String = (0..20).map(|i| format!("{{\"a{i}\": [1, 2, 3]}}\n")).collect();
        assert_eq!(rows(&sparse), None);
    }
}
