//! A table in brackets in the text of a program, a row a joint, with the order of its columns in a comment.

use crate::tables::Fields;
use crate::tables::expression::evaluate;
use crate::tables::names;

/// Lines above a table that may say the order of its columns.
const ABOVE: usize = 8;

/// Rows as they stand, and the columns' names where a comment has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    pub rows: Vec<(u64, Fields)>,
    pub names: Option<[&'static str; 4]>,
}

/// The longest run of lines that hold four numbers each; none where there are fewer than two, or two as long.
pub fn matrix(text: &str) -> Option<Matrix> {
    let lines: Vec<&str> = text.lines().collect();
    let cells: Vec<Option<Vec<&str>>> = lines.iter().map(|line| four(line)).collect();
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (at, row) in cells.iter().enumerate() {
        match (row, runs.last_mut()) {
            (Some(_), Some((start, end))) if *end == at && *start < at => *end = at + 1,
            (Some(_), _) => runs.push((at, at + 1)),
            _ => {}
        }
    }
    let longest = runs.iter().map(|(start, end)| end - start).max().filter(|n| *n > 1)?;
    let mut of_longest = runs.iter().filter(|(start, end)| end - start == longest);
    let (&(start, end), None) = (of_longest.next()?, of_longest.next()) else { return None };
    let rows = (start..end).filter_map(|at| Some((at as u64 + 1, Fields::new(cells[at].as_ref()?.iter().copied()))));
    let named = lines[start.saturating_sub(ABOVE)..=start].iter().rev().find_map(|line| order(line));
    Some(Matrix { rows: rows.collect(), names: named })
}

/// The four cells of a row, without brackets and comments.
fn four(line: &str) -> Option<Vec<&str>> {
    let line = line[..["#", "%", "//"].iter().filter_map(|mark| line.find(mark)).min().unwrap_or(line.len())].trim();
    let bracketed = line.rfind(['[', '{']).map(|at| &line[at + 1..]).unwrap_or(line);
    let inside = bracketed.trim_end_matches([']', '}', ')', ',', ';', '.', ' ']);
    let cells: Vec<&str> = match inside.contains(',') {
        true => inside.split(',').map(str::trim).collect(),
        false => inside.split_whitespace().collect(),
    };
    (cells.len() == 4 && cells.iter().all(|cell| evaluate(cell, &|_| None).is_some())).then_some(cells)
}

/// The four parameters in the order in which a line names them, one behind the other.
fn order(line: &str) -> Option<[&'static str; 4]> {
    const INDICES: [&str; 9] = ["i", "j", "n", "rad", "deg", "m", "mm", "offset", "link"];
    let name = |word: &String| match word.as_str() {
        "alpha" | "α" => Some("alpha"),
        "a" | "r" => Some("a"),
        "theta" | "θ" | "q" => Some("theta"),
        "d" => Some("d"),
        _ => None,
    };
    let words: Vec<String> = names::words(line)
        .0
        .into_iter()
        .filter(|w| !INDICES.contains(&w.as_str()) && w.parse::<f64>().is_err())
        .collect();
    let found: Vec<Option<&'static str>> = words.iter().map(name).collect();
    let all = |window: &&[Option<&'static str>]| ["alpha", "a", "theta", "d"].iter().all(|n| window.contains(&Some(n)));
    let window = found.windows(4).find(all)?;
    Some([window[0]?, window[1]?, window[2]?, window[3]?])
}
