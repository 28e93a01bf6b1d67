//! Elements of lists by their number, `q[0]`, `joint_angles[2]`, `jA(1)`, as names.
//!
//! In: text. Out: the same text, in its lines, with `q_0` for an element of the joints' readings, and `lengths__0` for
//! one of a list that the text sets; brackets count from 0, parentheses from 1. What is set itself, `q[0] = 1`, and
//! elements of an element stay as they are. A list called theta whose numbers are not all zero is one of numbers. What
//! goes wrong: a function that is called as readings are, `angles(1)`.

use std::borrow::Cow;
use std::collections::BTreeSet;

/// What the joints' readings are called, in small letters without underscores.
const READINGS: [&str; 19] = [
    "q",
    "qs",
    "qpos",
    "qlist",
    "th",
    "theta",
    "thetas",
    "thetalist",
    "\u{3b8}",
    "joint",
    "joints",
    "jointangle",
    "jointangles",
    "jointvalues",
    "jointpositions",
    "jointpos",
    "angles",
    "ja",
    "jointvars",
];

fn is_part(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

pub(super) fn is_of_readings(name: &str) -> bool {
    READINGS.contains(&name.to_lowercase().replace('_', "").as_str())
}

/// What an element of a list is called.
pub(super) fn element(list: &str, number: usize) -> String {
    format!("{list}__{number}")
}

/// Where the bracket of a list opens that a value is, at most behind a call's name.
pub(super) fn opening(value: &str) -> Option<usize> {
    let mut head = value.char_indices().take(60).take_while(|(_, c)| !matches!(c, '\n' | ';' | ','));
    head.find(|(_, c)| matches!(c, '[' | '{')).map(|(at, _)| at)
}

/// The text with elements as they stood there.
pub(super) fn shown(text: &str) -> String {
    let mut pieces = text.split("__");
    let mut plain = pieces.next().unwrap_or("").to_owned();
    for piece in pieces {
        let digits = piece.bytes().take_while(u8::is_ascii_digit).count();
        match digits {
            0 => plain.push_str(&format!("__{piece}")),
            _ => plain.push_str(&format!("[{}]{}", &piece[..digits], &piece[digits..])),
        }
    }
    plain
}

/// A name at the beginning with the number of an element behind it, and the bytes of both.
fn element_at(text: &str) -> Option<(&str, usize, usize)> {
    let end = text.find(|c| !is_part(c))?;
    let (close, from) = match text[end..].chars().next()? {
        '[' => (']', 0),
        '(' => (')', 1),
        _ => return None,
    };
    let (number, behind) = text[end + 1..].split_once(close)?;
    let number = number.trim().parse::<usize>().ok()?.checked_sub(from)?;
    let next = behind.trim_start_matches([' ', '\t']);
    let is_set = next.starts_with('=') && !next.starts_with("==");
    (!is_set && !behind.starts_with(['[', '('])).then(|| (&text[..end], number, text.len() - behind.len()))
}

/// The names that a text sets to lists of numbers, but for readings.
fn lists(text: &str) -> BTreeSet<&str> {
    let mut names = BTreeSet::new();
    for (at, _) in text.match_indices('=') {
        let value = text[at + 1..].trim_start();
        let mut before = text[..at].trim_end();
        if let Some((name, size)) = before.strip_suffix(']').and_then(|before| before.rsplit_once('['))
            && size.chars().all(is_part)
        {
            before = name;
        }
        let name = &before[before
            .rfind(|c| !is_part(c))
            .map_or(0, |at| at + before[at..].chars().next().map_or(1, char::len_utf8))..];
        let Some(open) = opening(value) else { continue };
        let inside = value[open + 1..].split([']', '}']).next().unwrap_or("");
        let moves = inside.chars().any(|c| c.is_ascii_digit() && c != '0');
        let is_theta = name.to_lowercase().starts_with("th") || name.starts_with('\u{3b8}');
        if !name.is_empty() && (moves && is_theta || !is_of_readings(name)) {
            names.insert(name);
        }
    }
    names
}

/// The text with names for elements.
pub fn indexed(text: &str) -> Cow<'_, str> {
    if !text.contains(['[', '(']) {
        return text.into();
    }
    let lists = lists(text);
    let mut plain = String::with_capacity(text.len());
    let (mut at, mut before) = (0, ' ');
    while let Some(c) = text[at..].chars().next() {
        let starts = (c.is_alphabetic() || c == '_') && !is_part(before);
        let found = if starts { element_at(&text[at..]) } else { None };
        match found {
            Some((name, number, length)) if lists.contains(name) => {
                plain.push_str(&element(name, number));
                at += length;
                before = ']';
            }
            Some((name, number, length)) if is_of_readings(name) => {
                plain.push_str(&format!("q_{number}"));
                at += length;
                before = ']';
            }
            _ => {
                plain.push(c);
                at += c.len_utf8();
                before = c;
            }
        }
    }
    plain.into()
}
