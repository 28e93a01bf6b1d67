//! Lines of a log that name their values: `12:30:05 q=[0.1, ...] p=[0.4, 0.2, 0.3]`, or each value in a line of its
//! own.
//!
//! In: a text. Out: a row of the names, and one each time that they all have come; the time and what else stands before
//! and between them is left alone, as are lines without a list. What goes wrong: other names somewhere, or in another
//! order, and names that are of no more than one list, as in the calls of a program, make it no such log.

use crate::tables::Fields;
use crate::tables::cells::list;
use crate::tables::names::{Name, What};
use crate::tables::numbers::is_number;

/// Rows from which on a text is a log.
const ROWS: usize = 3;

/// Values of a row at the most.
const MOST_VALUES: usize = 40;

/// Characters of the longest list.
const LONGEST: usize = 1000;

/// The names, and below them the rows with the lines in which they begin; and how many lines hold no list.
pub fn read(text: &str) -> Option<(Vec<(u64, Fields)>, usize)> {
    let mut rows: Vec<(u64, Vec<(&str, &str)>)> = Vec::new();
    let (mut lines, mut others) = (0, 0);
    let alike = |a: &[(&str, &str)], b: &[(&str, &str)]| a.iter().map(|v| v.0).eq(b.iter().map(|v| v.0));
    for (line, number) in text.lines().zip(1..).filter(|(line, _)| !line.trim().is_empty()) {
        lines += 1;
        let values = values(line);
        if !values.iter().any(|(_, value)| list(value).is_some()) {
            others += 1;
            continue;
        }
        for value in values {
            if rows.last().is_none_or(|(_, row)| row.iter().any(|(name, _)| *name == value.0)) {
                if rows.last().is_some_and(|(_, row)| !alike(row, &rows[0].1)) {
                    return None;
                }
                rows.push((number, Vec::new()));
            }
            let (_, row) = rows.last_mut().filter(|(_, row)| row.len() < MOST_VALUES)?;
            row.push(value);
        }
    }
    let first = rows.first()?;
    let lists = first.1.iter().filter(|(_, value)| list(value).is_some()).count();
    let is_point = |name: &str| matches!(Name::of(name).what, What::Coordinate(_) | What::Distance);
    let measured = lists > 1 || first.1.iter().any(|(name, _)| is_point(name));
    let is_log = rows.len() >= ROWS && 5 * (lines - others) > lines && rows.iter().all(|row| alike(&row.1, &first.1));
    (is_log && measured).then(|| {
        let names = (first.0, Fields::new(first.1.iter().map(|v| v.0)));
        let row = |(line, row): &(u64, Vec<(&str, &str)>)| (*line, Fields::new(row.iter().map(|v| v.1)));
        (std::iter::once(names).chain(rows.iter().map(row)).collect(), others)
    })
}

/// The values of a line, lists and numbers, each with its name before it.
fn values(line: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    let mut from = 0;
    for (at, _) in line.match_indices(['=', ':', '[', '(']) {
        if at < from {
            continue;
        }
        let text = line[at..].trim_start_matches(['=', ':']).trim_start();
        // A pose of URScript has a letter before it.
        let text = text.strip_prefix('p').filter(|rest| rest.starts_with('[')).unwrap_or(text);
        if let (Some(name), Some(value)) = (name(&line[from..at]), value(text)) {
            from = line.len() - text.len() + value.len();
            found.push((name, value));
        }
    }
    found
}

/// The word at the end of a text, quotes left out.
fn name(before: &str) -> Option<&str> {
    let before = before.trim_end().trim_end_matches(['"', '\'']);
    let start = before.trim_end_matches(|c: char| c.is_alphanumeric() || c == '_').len();
    Some(&before[start..]).filter(|name| name.starts_with(char::is_alphabetic))
}

/// The list or the number with which a text begins.
fn value(text: &str) -> Option<&str> {
    let mut depth = 0;
    let mut end = None;
    for (at, c) in text.char_indices().take(LONGEST) {
        match c {
            '[' | '(' => depth += 1,
            ']' | ')' if depth > 1 => depth -= 1,
            // With the bracket that closes the list, without one that closes what the number stands in.
            ']' | ')' => end = Some(at + depth),
            _ if depth == 0 && (c.is_whitespace() || ",;}".contains(c)) => end = Some(at),
            _ => continue,
        }
        if end.is_some() {
            break;
        }
    }
    let whole = end.unwrap_or(if text.len() < LONGEST { text.len() } else { 0 });
    Some(&text[..whole]).filter(|value| list(value).is_some() || is_number(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(text: &str) -> Option<(Vec<Vec<String>>, usize)> {
        let (rows, others) = read(text)?;
        Some((rows.iter().map(|(_, row)| row.iter().map(str::to_owned).collect()).collect(), others))
    }

    #[test]
    fn named_lists_are_rows_in_one_line_or_in_several() {
        let expected = [["q", "tcp"], ["[1.5,2,3]", "[4,5,6]"], ["[7,8,9]", "[1,2,3]"], ["[4,5,6]", "[7,8,9]"]];
        let text = |line: &dyn Fn(&str, &str) -> String| -> String {
            expected[1..].iter().map(|[q, tcp]| line(q, tcp)).collect()
        };
        for log in [
            text(&|q, p| format!("q={q} tcp={p}\n")),
            text(&|q, p| format!("q: {q}, tcp: {p}\n")),
            text(&|q, p| format!("2024-05-03 12:30:05.125 INFO [12.5] q = {q}; tcp = p{p}\n")),
            text(&|q, p| format!("[INFO] [160.25]: q {q} tcp {p}\n")),
            text(&|q, p| format!("{{'q': {q}, 'tcp': {p}}}\n")),
            text(&|q, p| format!("12:30:05: q={q}\n12:30:06: tcp={p}\n")),
        ] {
            let (rows, others) = rows(&log).unwrap_or_else(|| panic!("{log}"));
            assert!(rows == expected && others == 0, "{rows:?} {log}");
        }
        let mixed = text(&|q, p| format!("moved\nq={q} x=1.5 tcp={p}\n"));
        let (rows, others) = rows(&mixed).unwrap();
        assert_eq!(
            (rows[0].clone(), rows[1][1].as_str(), others),
            (vec!["q".into(), "x".into(), "tcp".into()], "1.5", 3)
        );
    }

    #[test]
    fn what_is_no_log_is_none() {
        for text in [
            "movej([1, 2, 3], a=1.5)\n".repeat(4),
            "movej(q=[1, 2, 3], a=1.5, v=1)\n".repeat(4),
            "MoveJoints(1, 2, 3)\nDelay(1)\n".repeat(4),
            "q=[1, 2, 3] p=[4, 5, 6]\nq=[1, 2, 3]\n".repeat(3),
            "q=[1, 2, 3] p=[4, 5, 6]\n".to_owned(),
            "\"[1, 2, 3]\",\"[4, 5, 6]\"\n".repeat(4),
            "j:{1,2,3}{EJ 0,0}\n".repeat(4),
            "MoveAbsJ j1 := [[1,2,3],[9E9,9E9,9E9]];\n".repeat(4),
        ] {
            assert_eq!(rows(&text), None, "{text}");
        }
    }
}
