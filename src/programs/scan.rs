//! Numbers in a program's text, with where they stand.

use std::ops::Range;

use super::language::Target;

/// A value and where it stands.
pub type Number = (f64, Range<usize>);

/// A number at `at`, blanks before it allowed: its value, its place, and what follows it.
pub fn number(text: &str, at: usize) -> Option<Number> {
    let start = at + text.get(at..)?.chars().take_while(|c| c.is_whitespace()).map(char::len_utf8).sum::<usize>();
    let part = |c: &char| c.is_ascii_digit() || "+-.eE".contains(*c);
    let length: usize = text[start..].chars().take_while(part).count();
    let value: f64 = text[start..start + length].parse().ok()?;
    value.is_finite().then_some((value, start..start + length))
}

/// What stands at `at` behind blanks, when it is `word`: the place behind it.
pub fn word(text: &str, at: usize, word: &str) -> Option<usize> {
    let rest = text.get(at..)?;
    let trimmed = rest.trim_start();
    let start = at + rest.len() - trimmed.len();
    let same = trimmed.get(..word.len()).is_some_and(|head| head.eq_ignore_ascii_case(word));
    same.then_some(start + word.len())
}

/// Numbers, or what else is a `number` in a language, from `at` with commas between, up to `most` of them, and the
/// place behind the last.
pub fn list(text: &str, at: usize, most: usize, number: fn(&str, usize) -> Option<Number>) -> (Vec<Number>, usize) {
    let (mut numbers, mut end) = (Vec::new(), at);
    while numbers.len() < most {
        let from = if numbers.is_empty() { Some(end) } else { word(text, end, ",") };
        let Some(found) = from.and_then(|from| number(text, from)) else { break };
        end = found.1.end;
        numbers.push(found);
    }
    (numbers, end)
}

/// Numbers behind `labels` in their order, units and commas between them.
pub fn labelled(text: &str, at: usize, labels: &[String]) -> Option<Vec<Number>> {
    let (mut numbers, mut end) = (Vec::new(), at);
    for label in labels {
        for skipped in ["deg", "mm", ","] {
            end = word(text, end, skipped).unwrap_or(end);
        }
        end = word(text, end, label)?;
        end = word(text, end, "=").unwrap_or(end);
        let found = number(text, end)?;
        end = found.1.end;
        numbers.push(found);
    }
    Some(numbers)
}

/// A target of these numbers, whose line is still to be counted; its name is empty where it has none. `open` is the
/// bracket that it begins with, where it has one.
pub fn target(text: &str, name: Option<String>, numbers: Vec<Number>, open: Option<usize>) -> Option<Target> {
    let (first, last) = (numbers.first()?.1.start, numbers.last()?.1.end);
    let whole = open.and_then(|open| Some(open..closed(text, open)?)).unwrap_or(first..last);
    let (readings, places) = numbers.into_iter().unzip();
    Some(Target { name: name.unwrap_or_default(), line: 0, readings, places, whole, pulses: false })
}

/// Names of the axes: those of the robot by this letter, then `E1`, `E2` and so on of external ones.
pub fn axes(letter: char, count: usize) -> Vec<String> {
    (0..count).map(|k| if k < 6 { format!("{letter}{}", k + 1) } else { format!("E{}", k - 5) }).collect()
}

/// Where the lines of a text end.
pub struct Lines(Vec<usize>);

impl Lines {
    pub fn of(text: &str) -> Lines {
        Lines(text.match_indices('\n').map(|(at, _)| at).collect())
    }

    /// Line of a place, from 1.
    pub fn line(&self, at: usize) -> u64 {
        1 + self.0.partition_point(|end| *end < at) as u64
    }
}

/// The text with blanks in place of comments (from `mark` to the line's end) and of what stands between double quotes
/// on a line; of the same length.
pub fn code(text: &str, mark: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let (mut quoted, mut comment) = (false, false);
    for (at, c) in text.char_indices() {
        match c {
            '\n' => (quoted, comment) = (false, false),
            '"' if quoted => quoted = false,
            '"' if !comment => quoted = text[at + 1..].chars().find(|c| matches!(c, '"' | '\n')) == Some('"'),
            _ if !quoted && !comment => comment = text[at..].starts_with(mark),
            _ => {}
        }
        if (quoted || comment || c == '"') && c != '\n' {
            (0..c.len_utf8()).for_each(|_| out.push(' '));
        } else {
            out.push(c);
        }
    }
    out
}

/// Places of the words: letters, digits, `_`, and KUKA's `$` and `#`. Numbers are words too.
pub fn words(code: &str) -> impl Iterator<Item = Range<usize>> + '_ {
    runs(code, |c| c.is_alphanumeric() || "_$#".contains(c))
}

/// Places of the runs of such characters.
pub fn runs(code: &str, part: fn(char) -> bool) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut at = 0;
    std::iter::from_fn(move || {
        let start = at + code[at..].find(part)?;
        at = code[start..].find(|c| !part(c)).map_or(code.len(), |length| start + length);
        Some(start..at)
    })
}

/// Whether it is a name and no number.
pub fn is_name(word: &str) -> bool {
    word.starts_with(|c: char| c.is_alphabetic() || "_$#".contains(c))
}

/// The place behind the bracket that closes the one at `open`.
pub fn closed(code: &str, open: usize) -> Option<usize> {
    let mut depth = 0usize;
    for (at, c) in code[open..].char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' => depth = depth.checked_sub(1)?,
            _ => {}
        }
        if depth == 0 {
            return Some(open + at + c.len_utf8());
        }
    }
    None
}

/// Every character with its place and how many brackets are open behind it; more that close than open count as none.
pub fn levels(code: &str) -> impl Iterator<Item = (usize, char, usize)> + '_ {
    code.char_indices().scan(0usize, |depth, (at, c)| {
        match c {
            '(' | '[' | '{' => *depth += 1,
            ')' | ']' | '}' => *depth = depth.saturating_sub(1),
            _ => {}
        }
        Some((at, c, *depth))
    })
}

/// The parts between the commas of `range` that stand in no bracket, without blanks around them.
pub fn parts(code: &str, range: Range<usize>) -> Vec<Range<usize>> {
    let (mut from, mut found) = (range.start, Vec::new());
    for (at, _, _) in levels(&code[range.clone()]).filter(|(_, c, depth)| *c == ',' && *depth == 0) {
        found.push(trimmed(code, from..range.start + at));
        from = range.start + at + 1;
    }
    found.push(trimmed(code, from..range.end));
    found
}

/// The range without blanks at its ends.
pub fn trimmed(code: &str, range: Range<usize>) -> Range<usize> {
    let part = &code[range.clone()];
    let start = range.start + part.len() - part.trim_start().len();
    start..start + part.trim().len()
}
