//! The table of a document of sentences: rows with bars between their cells.
//!
//! In: text. Out: its table alone, in the lines where it stands, and characters for what pages write for them. What
//! goes wrong: two tables; refused with the line.

use std::borrow::Cow;

use camino::Utf8Path;

use crate::files::Result;
use crate::tables::{Form, Grid};

/// Characters that pages name.
const ENTITIES: [(&str, &str); 8] = [
    ("&alpha;", "\u{3b1}"),
    ("&theta;", "\u{3b8}"),
    ("&pi;", "\u{3c0}"),
    ("&minus;", "-"),
    ("&deg;", "\u{b0}"),
    ("&nbsp;", " "),
    ("&lowast;", "*"),
    ("&amp;", "&"),
];

/// The text with characters for what pages write for them, `&theta;` and `&#8321;`.
pub(super) fn without_entities(text: &str) -> Cow<'_, str> {
    if !text.contains('&') {
        return text.into();
    }
    let text = ENTITIES.iter().fold(text.to_owned(), |text, (name, c)| text.replace(name, c));
    let mut pieces = text.split("&#");
    let mut plain = pieces.next().unwrap_or("").to_owned();
    for piece in pieces {
        let decoded = piece.split_once(';').and_then(|(code, rest)| {
            let number =
                code.strip_prefix('x').map_or_else(|| code.parse().ok(), |hex| u32::from_str_radix(hex, 16).ok());
            Some(format!("{}{rest}", char::from_u32(number?)?))
        });
        plain.push_str(&decoded.unwrap_or_else(|| format!("&#{piece}")));
    }
    plain.into()
}

/// The table of a document alone, whose rows have bars between their cells, in lines where they stand; the text where
/// it has none.
pub(super) fn alone<'a>(path: &Utf8Path, text: &'a str) -> Result<Cow<'a, str>> {
    let lines: Vec<&str> = text.lines().collect();
    let is_rule = |line: &str| !line.trim().is_empty() && line.chars().all(|c| "-=+|: \t".contains(c));
    let is_row = |line: &str| line.matches('|').count() > 2;
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    let mut open = false;
    for (at, line) in lines.iter().enumerate().filter(|(_, line)| !is_rule(line)) {
        match (is_row(line), blocks.last_mut().filter(|_| open)) {
            (true, Some(block)) => block.push(at),
            (true, None) => blocks.push(vec![at]),
            (false, _) => {}
        }
        open = is_row(line);
    }
    // A table that is none of a robot has other names.
    let is_named = |block: &&Vec<usize>| {
        let first = lines[block[0]].to_lowercase();
        (first.contains("alpha") || first.contains('\u{3b1}')) && block.len() > 2
    };
    let long = |block: &&Vec<usize>| block.len() > 2;
    let mut found: Vec<&Vec<usize>> = blocks.iter().filter(is_named).collect();
    if found.is_empty() {
        found = blocks.iter().filter(long).collect();
    }
    let block = match found[..] {
        [] => return Ok(text.into()),
        [block] => block,
        [one, other, ..] => {
            let message = format!(
                "a second table begins here; another is at line {}, and which is the robot's is not said",
                one[0] + 1
            );
            let grid = Grid::empty(path, Form::Delimited(','), None);
            return Err(grid.refuse(other[0] as u64 + 1, message, Some("leave one of them in the file")));
        }
    };
    // Names may stand above a table without bars between them.
    let cells = |line: &str| line.trim().trim_matches('|').matches('|').count() + 1;
    let above = (0..block[0]).rev().find(|&at| !lines[at].trim().is_empty());
    let words = above.map(|at| lines[at].split_whitespace().collect::<Vec<_>>()).unwrap_or_default();
    let mut rows = vec![String::new(); lines.len()];
    if let Some(at) = above.filter(|_| words.len() == 4 && cells(lines[block[0]]) == 5) {
        rows[at] = format!("-|{}", words.join("|"));
    }
    for &at in block {
        rows[at] = lines[at].trim().trim_matches('|').to_owned();
    }
    Ok((rows.join("\n") + "\n").into())
}
