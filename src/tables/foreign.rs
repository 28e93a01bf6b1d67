//! Files of other programs that hold no rows of cells, and how their tables are exported.
//!
//! In: a file's bytes, or its text. Out: what it is, and a line of the program that makes a table of it. What goes
//! wrong: a text in brackets may be a list of rows as programs write it, which is read; JSON is what parses as such.

use camino::Utf8Path;
use serde_json::Value;

/// What a file of another program is, and how its table is exported.
pub(super) fn of_bytes(bytes: &[u8], path: &Utf8Path) -> Option<(&'static str, String)> {
    const MATLAB: &str = "in MATLAB: `writematrix(NAME, 'table.csv')` for each array that is needed, joints and points; \
                          in Python: `numpy.savetxt('table.csv', scipy.io.loadmat('FILE.mat')['NAME'], delimiter=',')`";
    let table = table_of(path);
    let has_extension = |known: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(known));
    if bytes.starts_with(b"MATLAB ") || has_extension("mat") {
        return Some(("a MATLAB file (.mat)", MATLAB.replace("table.csv", &table)));
    }
    if bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        let hint = "export the arrays that are needed as CSV, e.g. with `h5dump -y -w 0 -d NAME`";
        return Some(("an HDF5 file", hint.to_owned()));
    }
    if bytes.starts_with(b"\x93NUMPY") {
        let hint = format!("in Python: `numpy.savetxt('{table}', numpy.load('FILE.npy'), delimiter=',')`");
        return Some(("a NumPy file", hint));
    }
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let begins = text.iter().find(|b| !b.is_ascii_whitespace());
    if has_extension("json") || matches!(begins, Some(b'{' | b'[')) {
        let value: Option<Value> = serde_json::from_slice(text).ok();
        // A list of lists of numbers is a table.
        let rows = value.as_ref().and_then(Value::as_array).is_some_and(|list| !list.iter().any(Value::is_object));
        if has_extension("json") || value.is_some() && !rows {
            return Some(("a JSON file", of_json(&value.unwrap_or_default(), path)));
        }
    }
    bytes.starts_with(&[0x1f, 0x8b]).then(|| ("a compressed file", "unpack it first: `gunzip FILE`".to_owned()))
}

/// The line that makes a table of a JSON file: of its longest list of records, of records with names, or of a list for
/// each column.
fn of_json(value: &Value, path: &Utf8Path) -> String {
    let (file, table) = (path.file_name().unwrap_or_default(), table_of(path));
    let loaded = format!("json.load(open('{file}'))");
    let columns = |v: &Value| v.as_object().is_some_and(|o| !o.is_empty() && o.values().all(Value::is_array));
    let named = |v: &Value| v.as_object().is_some_and(|o| o.len() > 1 && o.values().all(Value::is_object));
    if by_columns(value) {
        return format!("in Python: `import pandas; pandas.read_json('{file}').to_csv('{table}', index=False)`");
    }
    let frame = match longest_list(value) {
        Some((_, keys)) if keys.is_empty() => format!("json_normalize({loaded})"),
        Some((_, keys)) => format!("json_normalize({loaded}, record_path=['{}'])", keys.join("', '")),
        None if named(value) => format!("json_normalize(list({loaded}.values()))"),
        None if columns(value) => format!("DataFrame({loaded})"),
        None => format!("json_normalize({loaded})"),
    };
    in_python("json", &frame, path)
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

/// What the table of a file is called: each has its own, so that none takes the place of another.
fn table_of(path: &Utf8Path) -> String {
    let stem = path.file_stem().unwrap_or("table");
    // The file itself may be called so, whatever is in it.
    let is_taken = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    if is_taken { format!("{stem}-table.csv") } else { format!("{stem}.csv") }
}

fn in_python(package: &str, frame: &str, path: &Utf8Path) -> String {
    format!("in Python: `import {package}, pandas; pandas.{frame}.to_csv('{}', index=False)`", table_of(path))
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
    let file = path.file_name().unwrap_or_default();
    if let Some((name, count)) = opencv_matrices(text) {
        let (digits, numbers) = if count > 1 { (" % i", format!("range({count})")) } else { ("", "[0]".to_owned()) };
        return Some(format!(
            "in Python: `import cv2, numpy; f = cv2.FileStorage('{file}', cv2.FILE_STORAGE_READ); numpy.savetxt('{}', [f.getNode('{name}'{digits}).mat().ravel() for i in {numbers}], delimiter=',')`, and so for each array that is needed",
            table_of(path)
        ));
    }
    let is_comment =
        |line: &&str| line.trim().is_empty() || line.trim_start().starts_with(['#', '%']) || line.starts_with("---");
    // A list that is too long for a line goes on in the next one.
    let mut open = 0;
    let mut begins = |line: &&str| {
        let goes_on = open > 0;
        open += line.matches('[').count() as i64 - line.matches(']').count() as i64;
        !goes_on
    };
    let lines: Vec<&str> = text.lines().filter(|line| !is_comment(line) && begins(line)).collect();
    let item = |line: &str| line.trim_start().strip_prefix("- ").is_some_and(|rest| !rest.contains([',', '[']));
    let of_yaml = lines.iter().filter(|line| behind_key(line).is_some() || item(line)).count();
    let nested = lines.iter().any(|line| behind_key(line).is_some_and(|rest| rest.trim().is_empty()));
    if !nested || 10 * of_yaml < 9 * lines.len() {
        return None;
    }
    let loaded = format!("yaml.safe_load(open('{file}'))");
    let records = match (lines.first().is_some_and(|first| first.starts_with('-')), keys_to_list(&lines)) {
        (true, _) => loaded,
        (_, Some(keys)) => loaded + &keys.iter().map(|key| in_brackets(key)).collect::<String>(),
        _ => format!("list({loaded}.values())"),
    };
    Some(in_python("yaml", &format!("json_normalize({records})"), path))
}

/// A key as Python looks it up; one that is a number is loaded as a number.
fn in_brackets(key: &str) -> String {
    if key.parse::<f64>().is_ok() { format!("[{key}]") } else { format!("['{key}']") }
}

/// The keys that lead to the first list of records.
fn keys_to_list(lines: &[&str]) -> Option<Vec<String>> {
    let indent = |line: &str| line.len() - line.trim_start().len();
    let is_record = |line: &&str| line.trim_start().starts_with("- ") && behind_key(line).is_some();
    let list = lines.iter().position(is_record)?;
    let mut keys: Vec<(usize, String)> = Vec::new();
    for line in &lines[..list] {
        keys.retain(|(before, _)| *before < indent(line));
        let name = line.trim().split(':').next().unwrap_or_default().trim_matches(['\'', '"']);
        keys.push((indent(line), name.to_owned()));
    }
    // The key of a list may stand as far to the right as its items, and no further.
    keys.retain(|(before, _)| *before <= indent(lines[list]));
    (!keys.is_empty()).then(|| keys.into_iter().map(|(_, key)| key).collect())
}

/// The name of the first matrix that OpenCV wrote, with `%d` for its number where there are several of it, and how
/// many.
fn opencv_matrices(text: &str) -> Option<(String, usize)> {
    let name = |line: &str| Some(line.strip_suffix("!!opencv-matrix")?.trim().strip_suffix(':')?.to_owned());
    let names: Vec<String> = text.lines().filter_map(|line| name(line.trim_end())).collect();
    let first = names.first()?;
    let base = first.trim_end_matches(|c: char| c.is_ascii_digit());
    let is_one = |name: &&String| {
        name.strip_prefix(base).is_some_and(|number| !number.is_empty() && number.chars().all(|c| c.is_ascii_digit()))
    };
    match names.iter().filter(is_one).count() {
        count @ 2.. => Some((format!("{base}%d"), count)),
        _ => Some((first.clone(), 1)),
    }
}

/// What stands behind a key of YAML.
fn behind_key(line: &str) -> Option<&str> {
    let (key, rest) = line.trim_start().trim_start_matches("- ").split_once(':')?;
    let plain = |c: char| c.is_alphanumeric() || "_-./*'\"".contains(c);
    (!key.is_empty() && key.chars().all(plain) && (rest.is_empty() || rest.starts_with(' '))).then_some(rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn yaml_is_told_with_the_line_that_exports_it() {
        let pose = |k: usize| {
            format!(
                "      - name: p_{k}\n        joints: [0.1, {k}, -0.3]\n        speed: 0.2\n        # deg: 5.7 2 3\n"
            )
        };
        let nested = format!("# poses\n/**:\n  parameters:\n    poses:\n{}{}{}", pose(1), pose(2), pose(3));
        let said = of_yaml(&nested, Utf8Path::new("in/poses.yaml")).unwrap();
        assert!(said.contains("['/**']['parameters']['poses']).to_csv('poses.csv'"), "{said}");
        let records = "a:\n  q:\n  - 1\n  - 2\nb:\n  q:\n  - 3\n  - 4\n";
        assert!(
            of_yaml(records, Utf8Path::new("a.yml")).unwrap().contains("list(yaml.safe_load(open('a.yml')).values())")
        );
        let flat = "poses:\n- a: 1\n  b: 2\n- a: 3\n  b: 4\n";
        assert!(of_yaml(flat, Utf8Path::new("a.yml")).unwrap().contains("open('a.yml'))['poses'])"));
        let matrix = |k: usize| {
            format!(
                "T_{k}: !!opencv-matrix\n   rows: 2\n   cols: 2\n   dt: d\n   data: [ 1.5, 2.5,\n       3.5, 4.5 ]\n"
            )
        };
        let opencv = format!("%YAML:1.0\n---\ncount: 2\n{}{}", matrix(0), matrix(1));
        let said = of_yaml(&opencv, Utf8Path::new("pairs.yml")).unwrap();
        assert!(said.contains("getNode('T_%d' % i)") && said.contains("range(2)"), "{said}");
        // Lists over two lines, as PyYAML writes them, below keys of several levels.
        let station = |i: usize| {
            format!(
                "    - id: {i}\n      joints: [1.5, 2.5, 3.5,\n        4.5, 5.5, 6.5]\n      point: [1.0, 2.0, 3.0]\n"
            )
        };
        let wrapped = format!(
            "names: [a, b,\n  c]\nheights:\n  1.98:\n    stations:\n{}",
            (0..9).map(station).collect::<String>()
        );
        let said = of_yaml(&wrapped, Utf8Path::new("flat.yaml")).unwrap();
        assert!(said.contains("open('flat.yaml'))['heights'][1.98]['stations'])"), "{said}");
        assert_eq!(of_yaml("a,b,c\n1,2,3\n4,5,6\n", Utf8Path::new("a.csv")), None);
        assert_eq!(of_yaml("- [1, 2, 3]\n- [4, 5, 6]\n", Utf8Path::new("a.yaml")), None);
    }

    #[test]
    fn each_file_has_a_table_of_its_own() {
        let of = |name: &str| of_bytes(b"[{\"a\": 1}, {\"a\": 2}]", Utf8Path::new(name)).unwrap().1;
        assert!(of("in/one.json").contains("to_csv('one.csv'") && of("two.json").contains("to_csv('two.csv'"));
        let matlab = |name: &str| of_bytes(b"MATLAB 5.0 MAT-file", Utf8Path::new(name)).unwrap().1;
        assert!(matlab("in/q.mat").contains("'q.csv'") && matlab("in/q.csv").contains("'q-table.csv'"));
        assert!(!matlab("in/q.csv").contains("'q.csv'"));
    }
}
