//! Values behind a key in a YAML or Python-like text: enough for calibration files, which are keys and lists of
//! numbers.
//!
//! A list is what stands behind its own key and nothing else: in brackets (nested ones count row by row), as YAML's
//! rows that start with a dash, or as the `data` of a matrix with `rows` and `cols`. A key that stands twice is
//! refused, and so is any other count of numbers than the one that is needed.

/// The text behind a key at the start of a line (blanks and quotes aside), up to the end of the file; an error where
/// the key stands twice.
pub fn behind<'a>(text: &'a str, key: &str) -> Result<Option<&'a str>, String> {
    Ok(place(text, key)?.map(|(_, rest)| rest))
}

/// Indentation of a key and the text behind its colon.
fn place<'a>(text: &'a str, key: &str) -> Result<Option<(usize, &'a str)>, String> {
    let (mut at, mut found) = (0, None);
    for line in text.split_inclusive('\n') {
        let indented = line.trim_start();
        let bare = indented.trim_start_matches(['\'', '"']);
        if let Some(rest) = bare.strip_prefix(key)
            && let Some(rest) = rest.trim_start_matches(['\'', '"']).trim_start().strip_prefix(':')
        {
            if found.is_some() {
                return Err(format!("`{key}` stands twice"));
            }
            found = Some((line.len() - indented.len(), &text[at + line.len() - rest.len()..]));
        }
        at += line.len();
    }
    Ok(found)
}

/// A single word behind a key, without quotes.
pub fn word<'a>(text: &'a str, key: &str) -> Result<&'a str, String> {
    let rest = behind(text, key)?.ok_or_else(|| format!("no `{key}`"))?;
    let line = rest.lines().next().unwrap_or_default();
    Ok(line.trim().trim_end_matches(',').trim_matches(['\'', '"', ' ']))
}

/// A single number behind a key.
pub fn number(text: &str, key: &str) -> Result<f64, String> {
    let word = word(text, key)?;
    word.parse().map_err(|_| format!("`{key}` is not a number: `{word}`"))
}

/// The numbers of the list behind a key; exactly `count` where that is given.
pub fn list(text: &str, key: &str, count: Option<usize>) -> Result<Vec<f64>, String> {
    let (indent, rest) = place(text, key)?.ok_or_else(|| format!("no `{key}`"))?;
    let first = rest.lines().next().unwrap_or_default().trim();
    let numbers = if first.starts_with('[') {
        brackets(key, rest)?.0
    } else if let Some(lines) = rest.split_once('\n').map(|(_, lines)| lines)
        && lines.trim_start().starts_with('-')
    {
        dashes(key, lines)?
    } else {
        matrix(key, indent, rest)?
    };
    match count {
        Some(count) if numbers.len() != count => Err(format!("`{key}` has {} numbers, not {count}", numbers.len())),
        _ => Ok(numbers),
    }
}

/// The numbers between a bracket and its partner, and the text behind that.
fn brackets<'a>(key: &str, text: &'a str) -> Result<(Vec<f64>, &'a str), String> {
    let (mut numbers, mut depth, mut start) = (Vec::new(), 0, 0);
    for (i, c) in text.char_indices() {
        if depth > 0 && matches!(c, '[' | ']' | ',') {
            let word = text[start..i].trim();
            if !word.is_empty() {
                numbers.push(word.parse().map_err(|_| format!("`{key}` holds `{word}`, which is not a number"))?);
            }
        }
        match c {
            '[' => depth += 1,
            ']' if depth == 1 => return Ok((numbers, &text[i + 1..])),
            ']' => depth -= 1,
            _ => {}
        }
        if matches!(c, '[' | ']' | ',') {
            start = i + 1;
        }
        if depth == 0 && !c.is_whitespace() {
            break;
        }
    }
    Err(format!("the list of `{key}` has no end"))
}

/// Rows that start with a dash, each in brackets or of one number.
fn dashes(key: &str, lines: &str) -> Result<Vec<f64>, String> {
    let (mut numbers, mut rest) = (Vec::new(), lines.trim_start());
    while let Some(row) = rest.strip_prefix('-').filter(|row| row.starts_with([' ', '['])) {
        let row = row.trim_start();
        if row.starts_with('[') {
            let (of_row, behind) = brackets(key, row)?;
            numbers.extend(of_row);
            rest = behind.trim_start();
        } else {
            let (word, behind) = row.split_once('\n').unwrap_or((row, ""));
            let word = word.trim();
            numbers.push(word.parse().map_err(|_| format!("`{key}` holds `{word}`, which is not a number"))?);
            rest = behind.trim_start();
        }
    }
    Ok(numbers)
}

/// The `data` of a matrix: lines that are indented further than its key.
fn matrix(key: &str, indent: usize, rest: &str) -> Result<Vec<f64>, String> {
    let mut end = rest.find('\n').map_or(rest.len(), |i| i + 1);
    for line in rest[end..].split_inclusive('\n') {
        let bare = line.trim_start();
        // Long lists go on at any indentation; a new key does not.
        if !bare.is_empty() && line.len() - bare.len() <= indent && bare.starts_with(|c: char| c.is_alphabetic()) {
            break;
        }
        end += line.len();
    }
    let block = &rest[..end];
    let data = behind(block, "data")?.ok_or_else(|| format!("`{key}` has no list of numbers"))?;
    let numbers = match data.trim_start() {
        list if list.starts_with('[') => brackets(key, data)?.0,
        list if list.starts_with('-') => dashes(key, list)?,
        _ => return Err(format!("`{key}` has no list of numbers")),
    };
    if let (Some(_), Some(_)) = (behind(block, "rows")?, behind(block, "cols")?) {
        let (rows, columns) = (number(block, "rows")?, number(block, "cols")?);
        if rows * columns != numbers.len() as f64 {
            return Err(format!("`{key}` is {rows} x {columns}, but has {} numbers", numbers.len()));
        }
    }
    Ok(numbers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_in_every_form() {
        let text = "a: [1, 2,\n  3]\nb:\n- [1, 2]\n- [3, 4]\nc:\n- 1.5\n- 2\nd: [[1, 2], [3, 4]]\ne: !!opencv-matrix\n   rows: 1\n   cols: 2\n   \
                    dt: d\n   data: [ 1., 2. ]\n'f': [ 7,],\ng:\n  cols: 2\n  data:\n  - 1.0\n  - -2.5\n  rows: 1\n";
        for (key, numbers) in [
            ("a", vec![1.0, 2.0, 3.0]),
            ("b", vec![1.0, 2.0, 3.0, 4.0]),
            ("c", vec![1.5, 2.0]),
            ("d", vec![1.0, 2.0, 3.0, 4.0]),
            ("e", vec![1.0, 2.0]),
            ("f", vec![7.0]),
            ("g", vec![1.0, -2.5]),
        ] {
            assert_eq!(list(text, key, Some(numbers.len())), Ok(numbers), "{key}");
        }
    }

    #[test]
    fn a_list_is_what_stands_behind_its_own_key() {
        for (text, part) in [
            ("a: []\nb: [1, 2]\n", "`a` has 0 numbers, not 2"),
            ("a:\n- [1]\n- [1]\n- [2]\nb: [1]\n", "`a` has 3 numbers, not 2"),
            ("a: [1, 2]\na: [1, 2]\n", "`a` stands twice"),
            ("a:\n  rows: 1\n  cols: 2\n  data: []\nb:\n  data: [1, 2]\n", "1 x 2, but has 0"),
            ("a:\nb:\n  data: [1, 2]\n", "`a` has no list"),
            ("a: [1, 2", "no end"),
            ("a: [1, x]", "`x`, which is not a number"),
            ("b: [1]", "no `a`"),
        ] {
            let said = list(text, "a", Some(2)).unwrap_err();
            assert!(said.contains(part), "{text}: {said}");
        }
    }
}
