//! A table in brackets in the text of a program, a row a joint, with the order of its columns in a comment.
//!
//! In: text, and what its names stand for. Out: the rows of the one table in it. What goes wrong: a row with a word
//! that stands for no number, a line inside of the table's brackets that is no row, and two tables; all refused with
//! the line, since a row less is another robot.

use super::comments;
use super::indexed::shown;
use super::link::{Known, Wrong};
use super::lists::up_to;
use crate::tables::Fields;
use crate::tables::expression::evaluate;
use crate::tables::names;

/// Lines above a table that may say the order of its columns.
const ABOVE: usize = 8;

/// Rows as they stand, and the columns' names where a comment has them.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    pub rows: Vec<(u64, Fields)>,
    pub names: Option<Vec<&'static str>>,
    /// Where further tables of several rows begin, lines.
    pub others: Vec<u64>,
}

/// Rows from which on another table may be of another robot.
const OF_A_ROBOT: usize = 3;

/// What a line is to a table.
#[derive(Debug, PartialEq)]
enum Line<'a> {
    /// Its cells.
    Row(Vec<&'a str>),
    /// A row but for this cell.
    Broken(&'a str),
    /// Nothing but a comment or brackets; whether it is empty.
    Nothing { empty: bool },
    /// Anything else, which may be a list of another number of numbers.
    Other { code: &'a str, list: bool },
}

/// The longest run of lines that hold `width` numbers each, or where there is none of lists in one line; none where
/// there are fewer than two.
pub fn matrix(text: &str, known: &Known, width: usize) -> Result<Option<Matrix>, Wrong> {
    match of_lines(&(1..).zip(text.lines()).collect::<Vec<_>>(), known, width)? {
        None => of_lines(&apart(text), known, width),
        found => Ok(found),
    }
}

/// Bytes to the next list, where what ends at `end` is one and another follows.
fn next_list(text: &str, end: usize) -> Option<usize> {
    let next = text[end..].trim_start().strip_prefix(',')?.trim_start();
    next.starts_with(['[', '{']).then(|| text.len() - next.len())
}

/// Bytes to what follows the first list: another one, or something else behind the end of all of them.
fn behind_list(text: &str) -> Option<usize> {
    text.match_indices([']', '}']).find_map(|(at, _)| {
        let closes = |c: char| matches!(c, ']' | '}');
        let rest = text[at + 1..].trim_start_matches(|c: char| closes(c) || c.is_whitespace());
        let ends_all = text[at + 1..].trim_start().starts_with(closes) && !rest.is_empty();
        if ends_all { Some(text.len() - rest.len()) } else { next_list(text, at + 1) }
    })
}

/// The lines of a text with their numbers, those with lists in a list cut behind each; those of JSON wherever its lines
/// end.
fn apart(text: &str) -> Vec<(u64, &str)> {
    let whole =
        if text.trim_start().starts_with(['[', '{']) { vec![text] } else { text.split_inclusive('\n').collect() };
    let (mut pieces, mut line) = (Vec::new(), 1);
    for mut rest in whole {
        let of_lists = rest.trim_start().starts_with(['[', '{']) || rest.contains("[[") || rest.contains("{{");
        while let Some(at) = behind_list(rest).filter(|_| of_lists) {
            pieces.push((line, &rest[..at]));
            line += rest[..at].matches('\n').count() as u64;
            rest = &rest[at..];
        }
        pieces.push((line, rest));
        line += rest.matches('\n').count() as u64;
    }
    pieces
}

fn of_lines(numbered: &[(u64, &str)], known: &Known, width: usize) -> Result<Option<Matrix>, Wrong> {
    let lines: Vec<&str> = numbered.iter().map(|(_, line)| *line).collect();
    let number = |at: usize| numbered[at].0;
    let mut read: Vec<(usize, Line)> = Vec::with_capacity(lines.len());
    let mut depth = 0usize;
    for line in &lines {
        let code = &line[..comments::start(line)];
        read.push((depth, of(line, code.trim(), known, width)));
        let opened = code.matches(['[', '{', '(']).count();
        depth = (depth + opened).saturating_sub(code.matches([']', '}', ')']).count());
    }
    let mut runs = runs(&read);
    runs.retain(|run| !is_transform(run.clone().filter_map(|at| row_of(&read[at].1)), known));
    let rows = |run: &std::ops::Range<usize>| run.clone().filter(|&at| matches!(read[at].1, Line::Row(_))).count();
    let tables = || runs.iter().filter(|run| rows(run) > 1);
    let Some(longest) = tables().map(|run| run.len()).max() else { return Ok(None) };
    let mut of_longest = tables().filter(|run| run.len() == longest);
    let Some(run) = of_longest.next() else { return Ok(None) };
    let apart = |a: &std::ops::Range<usize>, b: &std::ops::Range<usize>| {
        let between = a.end.min(b.end)..a.start.max(b.start);
        !between.is_empty() && between.into_iter().all(|at| matches!(read[at].1, Line::Nothing { .. }))
    };
    let second = of_longest.next().or_else(|| tables().find(|other| apart(run, other)));
    if let Some(second) = second {
        let message = format!(
            "a second table of numbers begins here; another is at line {}, and which is the robot's is not said",
            number(run.start)
        );
        return Err((number(second.start), message + ": leave one of them in the file"));
    }
    let alike = |at: usize| {
        let indented = |at: usize| lines[at].len() - lines[at].trim_start().len();
        matches!(read.get(at), Some((depth, Line::Other { list: true, .. })) if *depth == read[run.end - 1].0)
            && indented(at) == indented(run.end - 1)
    };
    let beside = [run.start.wrapping_sub(1), run.end].into_iter().filter(|&at| alike(at));
    for at in whole(&read, run).chain(beside) {
        let wrong = match &read[at].1 {
            Line::Broken(cell) => format!("`{}` stands for no number", shown(cell)),
            Line::Other { code, .. } => {
                format!("`{}` is no row of {width} numbers, but stands among such rows", shown(code))
            }
            _ => continue,
        };
        return Err((number(at), wrong + ", and without this row it is another robot"));
    }
    let cells = |at: usize| match &read[at].1 {
        Line::Row(cells) => Some((number(at), Fields::new(cells))),
        _ => None,
    };
    let named = lines[run.start.saturating_sub(ABOVE)..=run.start].iter().rev().find_map(|line| order(line, width));
    let others = tables().filter(|other| *other != run && rows(other) >= OF_A_ROBOT);
    let others = others.map(|other| number(other.start)).collect();
    Ok(Some(Matrix { others, rows: run.clone().filter_map(cells).collect(), names: named }))
}

/// The cells of a row, none where it is broken.
fn row_of<'a>(line: &'a Line) -> Option<&'a [&'a str]> {
    match line {
        Line::Row(cells) => Some(cells),
        Line::Broken(_) => Some(&[]),
        _ => None,
    }
}

/// Whether rows are those of a homogeneous transform: the last is 0, 0, 0, 1, and those before it turn.
fn is_transform<'a>(rows: impl Iterator<Item = &'a [&'a str]>, known: &Known) -> bool {
    let value =
        |cell: &&str| evaluate(cell, &|name| known.get(name).copied()).filter(|v| !v.variable).map(|v| v.number);
    let rows: Vec<Option<Vec<f64>>> = rows.map(|cells| cells.iter().map(value).collect()).collect();
    let [turning @ .., Some(last)] = &rows[..] else { return false };
    if turning.len() != 3 || last[..] != [0.0, 0.0, 0.0, 1.0] {
        return false;
    }
    let whole: Option<Vec<&[f64]>> = turning.iter().map(|row| row.as_deref().filter(|row| row.len() == 4)).collect();
    let dot = |a: &[f64], b: &[f64]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    // With a formula in it that stands for no number it is no table either.
    whole.is_none_or(|rows| {
        (0..3).all(|i| (0..3).all(|k| (dot(rows[i], rows[k]) - f64::from(u8::from(i == k))).abs() < 1e-3))
    })
}

/// The lines of each table: an empty line ends one that is not inside of brackets.
fn runs(read: &[(usize, Line)]) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    let mut open = false;
    for (at, (depth, line)) in read.iter().enumerate() {
        match line {
            Line::Row(_) | Line::Broken(_) => {
                // Behind the bracket that ends a table another begins.
                match runs.last_mut().filter(|run| open && *depth >= read[run.end - 1].0) {
                    Some(run) => run.end = at + 1,
                    None => runs.push(at..at + 1),
                }
                open = true;
            }
            Line::Nothing { empty } => open &= !empty || *depth > 0,
            Line::Other { .. } => open = false,
        }
    }
    runs
}

/// The lines of a table with those before and behind it that stand inside of its brackets.
fn whole(read: &[(usize, Line)], run: &std::ops::Range<usize>) -> std::ops::Range<usize> {
    let depth = read[run.end - 1].0;
    let inside = |at: &usize| depth > 0 && read[*at].0 >= depth;
    let first = (0..run.start).rev().take_while(inside).last().unwrap_or(run.start);
    let end = (run.end..read.len()).take_while(inside).last().map_or(run.end, |last| last + 1);
    first..end
}

/// What a line is; `code` is what it has without comments.
fn of<'a>(line: &'a str, code: &'a str, known: &Known, width: usize) -> Line<'a> {
    let is_rule = |c: char| matches!(c, '[' | ']' | '{' | '}' | '(' | ')' | ',' | ';' | ' ' | '-' | '=' | '+' | '|');
    if code.chars().all(is_rule) {
        return Line::Nothing { empty: line.trim().is_empty() };
    }
    // `], dtype=float)` ends a table.
    if code.starts_with([']', '}', ')']) && !code.contains(['[', '{']) {
        return Line::Nothing { empty: false };
    }
    // Of two rows in a line the first is none less.
    let ends = || code.match_indices([']', '}']).map(|(at, _)| at + 1);
    if code.starts_with(['[', '{']) && ends().any(|end| next_list(code, end).is_some()) {
        return Line::Other { code, list: true };
    }
    // `x[0]` is a cell.
    let opens = |(at, _): &(usize, &str)| !code[..*at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let last = code.rmatch_indices(['[', '{']).find(opens);
    let bracketed = last.map(|(at, _)| &code[at + 1..]).or_else(|| tuple(code));
    let mut inside = bracketed.unwrap_or(code).trim();
    // A bracket that closes what is not opened here is the table's.
    while let Some(rest) = inside.strip_suffix([']', '}', ')', ',', ';', '.', ' ']) {
        let is_own = |open: char, close: char| {
            inside.ends_with(close) && inside.matches(open).count() >= inside.matches(close).count()
        };
        if is_own('(', ')') || is_own('[', ']') {
            break;
        }
        inside = rest;
    }
    let by_comma = inside.contains(',');
    let cells: Vec<&str> = match by_comma {
        true => by_commas(inside),
        false => inside.split_whitespace().collect(),
    };
    let is_number = |cell: &&str| evaluate(cell, &|name| known.get(name).copied()).is_some();
    let numbers = cells.iter().filter(|cell| is_number(cell)).count();
    // Words with blanks between them may be a sentence.
    let most = if by_comma { 1 } else { width.saturating_sub(1) };
    // `x = f(0, 1, 2, 3)` is none.
    let first = cells.first().copied().unwrap_or("");
    let is_call = first.contains('=') || first.matches('(').count() != first.matches(')').count();
    match cells.iter().find(|cell| !is_number(cell)) {
        _ if cells.len() != width => {
            let list = bracketed.is_some() && by_comma && numbers == cells.len();
            Line::Other { code, list }
        }
        None => Line::Row(cells),
        Some(cell) if numbers >= most && !is_call && order(line, width).is_none() => Line::Broken(cell),
        Some(_) => Line::Other { code, list: false },
    }
}

/// The inside of a row in parentheses, `(0, 0.3, 0),`.
fn tuple(code: &str) -> Option<&str> {
    let inside = code.strip_prefix('(')?;
    let end = up_to(inside, &[]);
    let rest = inside.get(end + 1..)?.trim_matches([',', ';', ' ', ')', ']']);
    (rest.is_empty() && inside[..end].contains(',')).then_some(&inside[..end])
}

/// Cells with commas between them, those in parentheses aside.
fn by_commas(mut inside: &str) -> Vec<&str> {
    let mut cells = Vec::new();
    loop {
        let end = up_to(inside, &[',']);
        cells.push(inside[..end].trim());
        match inside[end..].strip_prefix(',') {
            Some(rest) => inside = rest,
            None => {
                // Behind a bracket that nothing opened something else goes on.
                cells.extend(inside[end..].split(',').map(str::trim).filter(|cell| !cell.is_empty()));
                return cells;
            }
        }
    }
}

/// The parameters in the order in which a line names them, one behind the other: four, or three without theta. Where
/// letters name them, words beside these say the same: `link offset d`.
fn order(line: &str, width: usize) -> Option<Vec<&'static str>> {
    order_by(line, width, false).or_else(|| order_by(line, width, true))
}

fn order_by(line: &str, width: usize, by_words: bool) -> Option<Vec<&'static str>> {
    const INDICES: [&str; 8] = ["i", "j", "n", "rad", "deg", "m", "mm", "link"];
    let name = |word: &String| match word.as_str() {
        "alpha" | "α" => Some("alpha"),
        "a" | "r" => Some("a"),
        "theta" | "θ" | "q" => Some("theta"),
        "d" => Some("d"),
        "twist" if by_words => Some("alpha"),
        "length" if by_words => Some("a"),
        "angle" if by_words => Some("theta"),
        "offset" if by_words => Some("d"),
        _ => None,
    };
    let (words, _) = names::words(line);
    let is_index = |w: &String| {
        INDICES.contains(&w.as_str()) || w == if by_words { "joint" } else { "offset" } || w.parse::<f64>().is_ok()
    };
    let says = |w: &&String| !is_index(w);
    let mut found: Vec<Option<&'static str>> = words.iter().filter(says).map(name).collect();
    // `offset (d)` is one.
    found.dedup_by(|a, b| by_words && a == b);
    let wanted: &[&'static str] = if width == 3 { &["alpha", "a", "d"] } else { &["alpha", "a", "theta", "d"] };
    let all = |window: &&[Option<&'static str>]| wanted.iter().all(|n| window.contains(&Some(n)));
    if wanted.len() == 3 && found.contains(&Some("theta")) {
        return None;
    }
    found.windows(wanted.len()).find(all)?.iter().copied().collect()
}
