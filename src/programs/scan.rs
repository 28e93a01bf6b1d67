//! Numbers in a program's text, with where they stand.

use std::ops::Range;

use super::Target;

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

/// Numbers from `at` with commas between, up to `most` of them, and the place behind the last.
pub fn list(text: &str, at: usize, most: usize) -> (Vec<Number>, usize) {
    let (mut numbers, mut end) = (Vec::new(), at);
    while numbers.len() < most {
        let from = if numbers.is_empty() { Some(end) } else { word(text, end, ",") };
        let Some(found) = from.and_then(|from| number(text, from)) else { break };
        end = found.1.end;
        numbers.push(found);
    }
    (numbers, end)
}

/// Numbers behind `labels` in their order, each label with blanks and signs of `between` behind it; the place behind the last.
pub fn labelled(text: &str, at: usize, labels: &[String], between: &[&str]) -> Option<(Vec<Number>, usize)> {
    let (mut numbers, mut end) = (Vec::new(), at);
    for label in labels {
        for skipped in between {
            end = word(text, end, skipped).unwrap_or(end);
        }
        end = word(text, end, label)?;
        end = word(text, end, "=").unwrap_or(end);
        let found = number(text, end)?;
        end = found.1.end;
        numbers.push(found);
    }
    Some((numbers, end))
}

/// A target of these numbers; named by its line where it has no name.
pub fn target(text: &str, name: Option<String>, numbers: Vec<Number>) -> Option<Target> {
    let line = line(text, numbers.first()?.1.start);
    let (readings, places) = numbers.into_iter().unzip();
    Some(Target { name: name.unwrap_or_else(|| format!("line {line}")), line, readings, places, pulses: false })
}

/// Line of a place, from 1.
fn line(text: &str, at: usize) -> u64 {
    1 + text[..at].bytes().filter(|b| *b == b'\n').count() as u64
}

/// Whether the place stands in a line that begins with a mark of comments.
pub fn in_comment(text: &str, at: usize, mark: &str) -> bool {
    let start = text[..at].rfind('\n').map_or(0, |end| end + 1);
    text[start..at].trim_start().starts_with(mark)
}
