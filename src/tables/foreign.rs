//! Files of other programs that hold no rows of cells, and how their tables are exported.
//!
//! In: a file's bytes, or its text. Out: what it is, and a line of the program that makes a table of it. What goes wrong: a text in brackets may be
//! a list of rows as programs write it, which is read; JSON is what parses as such.

use camino::Utf8Path;
use serde_json::Value;

/// What a file of another program is, and how its table is exported.
pub(super) fn of_bytes(bytes: &[u8], path: &Utf8Path) -> Option<(&'static str, String)> {
    const MATLAB: &str = "in MATLAB: `writematrix(NAME, 'table.csv')` for each array that is needed, joints and points; \
                          in Python: `numpy.savetxt('table.csv', scipy.io.loadmat('FILE.mat')['NAME'], delimiter=',')`";
    let has_extension = |known: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(known));
    if bytes.starts_with(b"MATLAB ") || has_extension("mat") {
        return Some(("a MATLAB file (.mat)", MATLAB.to_owned()));
    }
    if bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        let hint = "export the arrays that are needed as CSV, e.g. with `h5dump -y -w 0 -d NAME`";
        return Some(("an HDF5 file", hint.to_owned()));
    }
    if bytes.starts_with(b"\x93NUMPY") {
        let hint = "in Python: `numpy.savetxt('table.csv', numpy.load('FILE.npy'), delimiter=',')`";
        return Some(("a NumPy file", hint.to_owned()));
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let begins = text.iter().find(|b| !b.is_ascii_whitespace());
    if has_extension("json") || matches!(begins, Some(b'{' | b'[')) {
        let value: Option<Value> = serde_json::from_slice(text).ok();
        // A list of lists of numbers is a table.
        let rows = value.as_ref().and_then(Value::as_array).is_some_and(|list| !list.iter().any(Value::is_object));
        if has_extension("json") || value.is_some() && !rows {
            return Some(("a JSON file", of_json(&value.unwrap_or_default(), path.file_name().unwrap_or_default())));
        }
    }
    bytes.starts_with(&[0x1f, 0x8b]).then(|| ("a compressed file", "unpack it first: `gunzip FILE`".to_owned()))
}

/// The line that makes a table of a JSON file: of its longest list of records, of records with names, or of a list for each column.
fn of_json(value: &Value, file: &str) -> String {
    let loaded = format!("json.load(open('{file}'))");
    let columns = |v: &Value| v.as_object().is_some_and(|o| !o.is_empty() && o.values().all(Value::is_array));
    let named = |v: &Value| v.as_object().is_some_and(|o| o.len() > 1 && o.values().all(Value::is_object));
    if by_columns(value) {
        return format!("in Python: `import pandas; pandas.read_json('{file}').to_csv('table.csv', index=False)`");
    }
    let frame = match longest_list(value) {
        Some((_, keys)) if keys.is_empty() => format!("json_normalize({loaded})"),
        Some((_, keys)) => format!("json_normalize({loaded}, record_path=['{}'])", keys.join("', '")),
        None if named(value) => format!("json_normalize(list({loaded}.values()))"),
        None if columns(value) => format!("DataFrame({loaded})"),
        None => format!("json_normalize({loaded})"),
    };
    in_python("json", &frame)
}

/// Whether it is what `DataFrame.to_json` writes: columns by name, of each the values by the rows' numbers.
fn by_columns(value: &Value) -> bool {
    let rows = |column: &Value| {
        let cells = column.as_object()?;
        let is_cell =
            |(row, cell): (&String, &Value)| row.parse::<u64>().is_ok() && !cell.is_object() && !cell.is_array();
        (!cells.is_empty() && cells.iter().all(is_cell)).then_some(cells.len())
    };
    let columns = value.as_object().into_iter().flatten().map(|(_, column)| rows(column));
    let lengths: Option<Vec<usize>> = columns.collect();
    lengths.is_some_and(|lengths| lengths.len() > 1 && lengths.iter().all(|length| *length == lengths[0]))
}

fn in_python(package: &str, frame: &str) -> String {
    format!("in Python: `import {package}, pandas; pandas.{frame}.to_csv('table.csv', index=False)`")
}

/// The longest list of records, with the keys that lead to it.
fn longest_list(value: &Value) -> Option<(usize, Vec<&str>)> {
    match value {
        Value::Array(list) => list.iter().all(Value::is_object).then_some((list.len(), Vec::new())),
        Value::Object(object) => {
            let below = object.iter().filter_map(|(key, value)| {
                let (length, mut keys) = longest_list(value)?;
                keys.insert(0, key);
                Some((length, keys))
            });
            below.filter(|(length, _)| *length > 1).max_by_key(|(length, _)| *length)
        }
        _ => None,
    }
}

/// How a table is made of a YAML file; `None` of another text, and of a list of rows of numbers.
pub(super) fn of_yaml(text: &str, path: &Utf8Path) -> Option<String> {
    let is_comment = |line: &&str| line.trim().is_empty() || line.starts_with(['#', '%']) || line.starts_with("---");
    let lines: Vec<&str> = text.lines().filter(|line| !is_comment(line)).collect();
    let item = |line: &str| line.trim_start().strip_prefix("- ").is_some_and(|rest| !rest.contains([',', '[']));
    let of_yaml = lines.iter().filter(|line| behind_key(line).is_some() || item(line)).count();
    let nested = lines.iter().any(|line| behind_key(line).is_some_and(|rest| rest.trim().is_empty()));
    if !nested || 10 * of_yaml < 9 * lines.len() {
        return None;
    }
    let loaded = format!("yaml.safe_load(open('{}'))", path.file_name().unwrap_or_default());
    let outer = |line: &str| !line.starts_with([' ', '\t', '-']);
    let list = lines.windows(2).find(|two| outer(two[0]) && two[1].trim_start().starts_with("- "));
    let name = |line: &str| line.trim_end().trim_end_matches(':').trim_matches(['\'', '"']).to_owned();
    let records = match (lines.first().is_some_and(|first| first.starts_with('-')), list) {
        (true, _) => loaded,
        (_, Some(two)) => format!("{loaded}['{}']", name(two[0])),
        _ => format!("list({loaded}.values())"),
    };
    Some(in_python("yaml", &format!("json_normalize({records})")))
}

/// What stands behind a key of YAML.
fn behind_key(line: &str) -> Option<&str> {
    let (key, rest) = line.trim_start().trim_start_matches("- ").split_once(':')?;
    let plain = |c: char| c.is_alphanumeric() || "_-./'\"".contains(c);
    (!key.is_empty() && key.chars().all(plain) && (rest.is_empty() || rest.starts_with(' '))).then_some(rest)
}
