//! The rows of a table in LaTeX: cells with `&` between them, rows that `\\` ends, rules between these.
//!
//! In: a document. Out: its table, each row with its line, cells as formulas have them (`-90°`, `pi/2`). A table whose
//! first row names alpha, or a twist, is the robot's. What goes wrong: two of these, and an environment without its
//! end; refused with the line.

use crate::formats::robots::dh_text::Wrong;
use crate::tables::Fields;

/// Environments with cells, and how many arguments in braces they have.
const TABLES: [(&str, usize); 6] =
    [("tabular", 1), ("tabular*", 2), ("tabularx", 2), ("tabulary", 2), ("longtable", 1), ("array", 1)];

/// What may stand before a row, and how many arguments it has.
const RULES: [(&str, usize); 12] = [
    ("hline", 0),
    ("toprule", 0),
    ("midrule", 0),
    ("bottomrule", 0),
    ("endfirsthead", 0),
    ("endhead", 0),
    ("endfoot", 0),
    ("endlastfoot", 0),
    ("cline", 1),
    ("cmidrule", 1),
    ("hhline", 1),
    ("rowcolor", 1),
];

/// Marks within cells, and what stands for them.
const MARKS: [(&str, &str); 26] = [
    ("^{\\circ}", "\u{b0}"),
    ("^\\circ", "\u{b0}"),
    ("\\degree", "\u{b0}"),
    ("\\textdegree", "\u{b0}"),
    ("^{*}", "*"),
    ("^*", "*"),
    ("^{\\ast}", "*"),
    ("^\\ast", "*"),
    ("\\cdot", "*"),
    ("\\times", "*"),
    ("\\dfrac", "\\frac"),
    ("\\tfrac", "\\frac"),
    ("\\left", ""),
    ("\\right", ""),
    ("\\textbf", ""),
    ("\\textit", ""),
    ("\\mathbf", ""),
    ("\\mathrm", ""),
    ("\\boldsymbol", ""),
    ("\\text", ""),
    ("\\bf", ""),
    ("\\,", " "),
    ("\\;", " "),
    ("\\!", ""),
    ("~", " "),
    ("$", ""),
];

/// The robot's table of a document; none where it has none.
pub(super) fn table(text: &str) -> Result<Option<Vec<(u64, Fields)>>, Wrong> {
    let plain: String = text.lines().map(|line| without_comment(line).to_owned() + "\n").collect();
    let mut tables = Vec::new();
    for (at, begin) in plain.match_indices("\\begin{") {
        let Some((name, behind)) = plain[at + begin.len()..].split_once('}') else { continue };
        let Some((_, arguments)) = TABLES.iter().find(|(known, _)| *known == name) else { continue };
        let Some(end) = behind.find(&format!("\\end{{{name}}}")) else {
            return Err((line_of(&plain, at), format!("`\\begin{{{name}}}` has no `\\end{{{name}}}`")));
        };
        let rows = rows(&plain, behind_arguments(&behind[..end], *arguments));
        tables.extend((rows.len() > 1).then_some(rows));
    }
    // Matrices of formulas, and tables of something else.
    let is_named = |rows: &Vec<(u64, Fields)>| {
        rows[0].1.iter().any(|cell| ["alpha", "\u{3b1}", "wist"].iter().any(|word| cell.contains(word)))
    };
    tables.retain(is_named);
    if let [one, other, ..] = &tables[..] {
        let message = format!(
            "a second table begins here; another is at line {}, and which is the robot's is not said: leave one of them in the file",
            one[0].0
        );
        return Err((other[0].0, message));
    }
    Ok(tables.pop())
}

/// A line without its comment; `\%` is none.
fn without_comment(line: &str) -> &str {
    let begins = |(at, _): &(usize, &str)| !line[..*at].ends_with('\\');
    line.match_indices('%').find(begins).map_or(line, |(at, _)| &line[..at])
}

fn line_of(text: &str, at: usize) -> u64 {
    1 + text[..at].matches('\n').count() as u64
}

/// Behind one argument in these brackets, where there is one.
fn behind_argument(text: &str, [open, close]: [char; 2]) -> Option<&str> {
    let inside = text.trim_start().strip_prefix(open)?;
    let mut depth = 0usize;
    for (at, c) in inside.char_indices() {
        match c {
            _ if c == close && depth == 0 => return Some(&inside[at + c.len_utf8()..]),
            _ if c == close => depth -= 1,
            _ if c == open => depth += 1,
            _ => {}
        }
    }
    None
}

/// Behind so many arguments in braces, and what stands in other brackets before them.
fn behind_arguments(mut text: &str, braces: usize) -> &str {
    let mut left = braces;
    while left > 0 {
        let other = behind_argument(text, ['[', ']']).or_else(|| behind_argument(text, ['(', ')']));
        left -= usize::from(other.is_none());
        match other.or_else(|| behind_argument(text, ['{', '}'])) {
            Some(rest) => text = rest,
            None => return text,
        }
    }
    text
}

/// Behind the rules above a row.
fn behind_rules(mut text: &str) -> &str {
    loop {
        text = text.trim_start();
        let Some(command) = text.strip_prefix('\\') else { return text };
        let word = command.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(command.len());
        let Some((_, arguments)) = RULES.iter().find(|(rule, _)| *rule == &command[..word]) else { return text };
        text = behind_arguments(&command[word..], *arguments);
    }
}

/// The rows of a table's body, which is a part of the text.
fn rows(text: &str, body: &str) -> Vec<(u64, Fields)> {
    let row = |(at, piece): (usize, &str)| {
        // `\\[2pt]` and `\\*` say how far the next row is.
        let piece = if at > 0 { piece.strip_prefix('*').unwrap_or(piece) } else { piece };
        let spaced = behind_argument(piece, ['[', ']']).filter(|_| at > 0 && piece.starts_with('['));
        let row = behind_rules(spaced.unwrap_or(piece));
        let line = line_of(text, row.as_ptr() as usize - text.as_ptr() as usize);
        let cells = row.replace("\\&", "and");
        (!row.trim().is_empty()).then(|| (line, Fields::new(cells.split('&').map(cell))))
    };
    body.split("\\\\").enumerate().filter_map(row).collect()
}

/// A cell without marks, fractions as `(a/b)`.
fn cell(text: &str) -> String {
    let mut plain = MARKS.iter().fold(text.to_owned(), |text, (mark, stands)| text.replace(mark, stands));
    while let Some(at) = plain.find("\\frac{") {
        let fraction = plain[at + "\\frac{".len()..].split_once("}{");
        let parts = fraction.and_then(|(above, rest)| Some((above, rest.split_once('}')?)));
        let Some((above, (below, rest))) = parts else { break };
        plain = format!("{}({above}/{below}){rest}", &plain[..at]);
    }
    let words = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    let inside = words.strip_prefix('{').and_then(|inside| inside.strip_suffix('}'));
    inside.filter(|inside| !inside.contains(['{', '}'])).map_or(words.clone(), |inside| inside.trim().to_owned())
}
