//! What stands in a text one behind the other: parameters with their values, links, lists, and numbers that get names.
//!
//! In: code without comments. Out: what the links are made from. What goes wrong: a value that is no number, and a
//! joint that slides where only a call of a toolbox says it.

use std::collections::BTreeMap;

use super::link::{CALLS, KEYS, Known, Link, Wrong};
use super::lists::{self, Lists, Numbered, extent, list};
use super::{indexed, named};
use crate::formats::robots::dh_words::slides;
use crate::tables::expression::{self, Value, evaluate};

#[derive(Default)]
pub(super) struct Scan<'a> {
    pub(super) text: &'a str,
    pub(super) at: usize,
    pub(super) depth: usize,
    pub(super) line: u64,
    /// Names that the text has set to numbers.
    pub(super) known: Known,
    pub(super) links: Vec<Link>,
    pub(super) lists: Lists,
    /// Lists whose names have the same before the parameter's.
    pub(super) families: BTreeMap<String, Lists>,
    pub(super) numbered: Numbered,
    /// The first value that is no number.
    pub(super) wrong: Option<Wrong>,
}

impl Scan<'_> {
    pub(super) fn run(&mut self) -> Result<(), Wrong> {
        let mut before = '\n';
        while let Some(c) = self.text[self.at..].chars().next() {
            let starts = (c.is_alphabetic() || c == '_') && !(before.is_alphanumeric() || matches!(before, '_' | '.'));
            if starts || before == '.' && (c.is_alphabetic() || c == '_') {
                let rest = &self.text[self.at..];
                let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
                if starts {
                    self.word(end)?
                } else {
                    self.field(end)
                }
                before = 'a';
                continue;
            }
            match c {
                '(' | '[' | '{' => self.depth += 1,
                ')' | ']' | '}' => {
                    self.depth = self.depth.saturating_sub(1);
                    self.close(self.depth + 1);
                }
                '\n' => {
                    self.line += 1;
                    if self.depth == 0 && self.text[self.at + 1..].trim_start_matches(' ').starts_with("- ") {
                        self.close(0);
                    }
                }
                _ => {}
            }
            before = c;
            self.at += c.len_utf8();
        }
        Ok(())
    }

    /// A link as deep as that, or deeper, takes nothing more.
    fn close(&mut self, depth: usize) {
        if let Some(link) = self.links.last_mut().filter(|link| link.depth >= depth) {
            link.depth = usize::MAX;
        }
    }

    pub(super) fn evaluate(&self, text: &str) -> Option<Value> {
        evaluate(text, &|name| self.known.get(name).copied())
    }

    /// A name of so many bytes behind a dot: a parameter's list of a structure, `DH.alpha(1:7) = [...]`.
    fn field(&mut self, end: usize) {
        let (before, word) = (&self.text[..self.at], &self.text[self.at..self.at + end]);
        self.at += end;
        let Some(which) = KEYS.iter().position(|names| names.contains(&word)) else { return };
        let behind = self.text[self.at..].trim_start_matches([' ', '\t']);
        let range = behind.strip_prefix('(').and_then(|behind| behind.split_once(')'));
        let last = range.and_then(|(range, _)| range.trim().strip_prefix("1:")?.trim().parse::<usize>().ok());
        let value = match (range, last) {
            (Some((_, behind)), Some(_)) => behind.trim_start_matches([' ', '\t']),
            (Some(_), None) => return,
            (None, _) => behind,
        };
        let Some(value) = value.strip_prefix('=').filter(|value| !value.starts_with('=')) else { return };
        let equal = || Some(vec![self.evaluate(&value[..extent(value)]).filter(|v| !v.variable)?; last?]);
        let of = before.trim_end_matches('.').rsplit(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or("");
        if let Some(list) = list(value, &self.known).or_else(equal) {
            self.families.entry(of.to_owned()).or_default()[which].get_or_insert((self.line, list));
        }
    }

    /// A name of so many bytes: a call, a parameter with its value, or a number that gets a name.
    fn word(&mut self, end: usize) -> Result<(), Wrong> {
        let start = self.at;
        let word = &self.text[start..start + end];
        self.at += end;
        let rest = &self.text[self.at..];
        if CALLS.contains(&word) && rest.trim_start_matches(' ').starts_with('(') {
            return self.call(word, start);
        }
        let quote = rest.chars().next().filter(|c| matches!(c, '\'' | '"'));
        if quote.is_some() && self.flag(word) {
            return Ok(());
        }
        let behind = rest[quote.map_or(0, char::len_utf8)..].trim_start_matches([' ', '\t']);
        let behind = sized(behind).unwrap_or(behind);
        let separator = behind.chars().next().filter(|c| matches!(c, '=' | ':') || *c == ',' && quote.is_some());
        let Some(separator) = separator else { return Ok(()) };
        let value = &behind[separator.len_utf8()..];
        if value.starts_with('=') {
            return Ok(());
        }
        let value_at = self.text.len() - value.len();
        if self.of_call(word, value) {
            self.at = value_at + extent(value);
            return Ok(());
        }
        if self.of_kind(word, value) {
            return Ok(());
        }
        let which = KEYS.iter().position(|names| names.contains(&word.to_lowercase().as_str()));
        if let Some(which) = which {
            if let Some(list) = list(value, &self.known) {
                self.lists[which].get_or_insert((self.line, list));
                return Ok(());
            }
            let in_list = quote.is_some() && separator == ',';
            self.parameter(which, word, (value, value_at), in_list)?;
        } else if let Some((which, number)) = lists::numbered(word)
            && let Some(v) = self.evaluate(&value[..extent(value)]).filter(|v| !v.variable || which == 2)
        {
            self.numbered[which].entry(number).or_insert((self.line, v));
        }
        self.other(word, value);
        if separator == '=' && self.depth == 0 {
            self.assign(start, word.to_owned(), value);
        }
        Ok(())
    }

    /// A parameter with its value, which stands there; `in_list` says that the name may be a word of a list.
    fn parameter(&mut self, which: usize, word: &str, (value, at): (&str, usize), in_list: bool) -> Result<(), Wrong> {
        let text = &value[..extent(value)];
        let is_length = which == 3 && self.depth > 0 && self.called().is_none();
        let found = self.evaluate(text);
        let found = found.or_else(|| self.evaluate(&expression::of_reading(text, 'd')).filter(|_| is_length));
        match found {
            Some(v) if v.variable && is_length => {
                self.put(which, v);
                let link = self.links.last_mut().map(|link| &mut link.variable_d);
                link.into_iter().for_each(|d| *d = Some(text.trim().to_owned()));
                self.at = at + text.len();
            }
            Some(v) if !v.variable || which == 2 => {
                self.put(which, v);
                self.at = at + text.len();
            }
            Some(_) if self.depth > 0 => {
                return Err((self.line, format!("`{}`: a joint that slides", text.trim())));
            }
            None if in_list && text.trim().starts_with(['"', '\'']) => {}
            None if self.depth > 0 && !text.trim().is_empty() => self.no_number(word, text.trim()),
            _ => {}
        }
        Ok(())
    }

    /// Keeps the first value that is no number.
    fn no_number(&mut self, word: &str, text: &str) {
        let text = indexed::shown(text);
        let wrong = format!(
            "`{word}` is `{text}`, which is no number: names that the file sets to numbers above, + - * /, sin, cos, tan, atan2 and sqrt are followed"
        );
        self.wrong.get_or_insert((self.line, wrong));
    }

    /// A word beside a link's parameters that says whether it slides; whether it is one.
    fn of_kind(&mut self, word: &str, value: &str) -> bool {
        let text = &value[..extent(value)];
        let is_kind = matches!(word, "type" | "joint_type");
        if is_kind && text.trim().trim_matches(['"', '\'']).eq_ignore_ascii_case("fixed") {
            self.open(|link| !link.kind && !link.fixed).fixed = true;
            return true;
        }
        let said = slides(text).filter(|_| is_kind);
        said.inspect(|slides| self.open(|link| !link.kind).kind(*slides)).is_some()
    }

    /// What else a name with a value may be: a list of a family, a link's limits.
    fn other(&mut self, word: &str, value: &str) {
        if let Some((family, which)) = lists::affixed(word)
            && let Some(list) = list(value, &self.known)
        {
            self.families.entry(family).or_default()[which].get_or_insert((self.line, list));
        }
        if word == "qlim"
            && let Some([low, high]) = list(value, &self.known).as_deref()
            && let Some(link) = self.links.last_mut().filter(|link| link.depth == self.depth)
        {
            link.limits = Some([*low, *high]);
        }
    }

    /// Numbers that get names, `a1, a2 = 0.4, 0.3` too.
    fn assign(&mut self, start: usize, last: String, value: &str) {
        let before = self.text[..start].rsplit(['\n', ';']).next().unwrap_or("");
        // A type stands before one name: `double a1 = 0.4, a2 = 0.3`.
        let several = before.contains(',') && !before.contains('=');
        let mut names: Vec<String> = before.split(',').map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect();
        names.truncate(if several { names.len() } else { 0 });
        names.push(last);
        let mut rest = value;
        for name in names {
            let text = &rest[..extent(rest)];
            if let Some(list) = list(rest, &self.known) {
                let elements = list.into_iter().enumerate().map(|(at, v)| (indexed::element(&name, at), v));
                self.known.extend(elements.filter(|(_, v)| !v.variable));
            }
            if let Some(v) = self.evaluate(text).filter(|v| !v.variable) {
                self.known.insert(name, v);
            }
            rest = rest[text.len()..].strip_prefix(',').unwrap_or("");
        }
    }

    fn put(&mut self, which: usize, value: Value) {
        self.open(|link| link.values[which].is_none()).values[which] = Some(value);
    }

    /// The link that is being read where it has room, else a new one.
    fn open(&mut self, room: impl Fn(&Link) -> bool) -> &mut Link {
        let is_open = self.links.last().is_some_and(|link| link.depth == self.depth && room(link));
        if !is_open {
            let (name, of) = named::of(self.text, self.at, self.depth);
            self.links.push(Link { name, of, ..Link::at(self.line, self.depth) });
        }
        let last = self.links.len() - 1;
        &mut self.links[last]
    }
}

/// What is behind the size of an array that a list follows, `[6] = {0, 1}`.
pub(super) fn sized(behind: &str) -> Option<&str> {
    let (size, rest) = behind.strip_prefix('[')?.split_once(']')?;
    let rest = rest.trim_start();
    let listed = rest.strip_prefix('=')?.trim_start().starts_with(['{', '[']);
    (size.trim().chars().all(|c| c.is_alphanumeric() || c == '_') && listed).then_some(rest)
}
