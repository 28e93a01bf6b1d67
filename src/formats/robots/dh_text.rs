//! Denavit-Hartenberg parameters in the text of programs and settings.
//!
//! In: text. Out: a row a joint, alpha, a, theta, d as they stand there, and the convention where words say it. Forms: links that are built one by one with
//! named parameters (`RevoluteDH(d=0.1, a=0, alpha=pi/2)`, `Link('d', 0.1, 'a', 0, ...)`, `{a: 0, alpha: 1.57, ...}`, keys one below the other);
//! `Link([theta d a alpha])` of the Robotics Toolbox for MATLAB; a list a parameter (`a = [0, -0.4, ...]`); and parameters with numbers
//! (`alpha0: 0, a0: 0, d1: 0.3, alpha1: -pi/2`). Parameters that a link's call
//! does not name are zero. Names that the text sets to a number stand for it.
//! What goes wrong: a parameter that is no number, sliding joints, axes that are turned round; all refused with the line.

mod comments;
mod link;
mod lists;
mod matrix;
mod numbered;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

pub use self::matrix::{Matrix, matrix};

use self::link::{KEYS, Link};
pub use self::link::{Known, Wrong};
use self::lists::{Lists, extent, list};
use super::dh_words::Words;
use crate::robot::catalogue::Convention;
use crate::tables::expression::{Value, evaluate};

/// Calls that make a link.
const CALLS: [&str; 8] =
    ["RevoluteDH", "RevoluteMDH", "PrismaticDH", "PrismaticMDH", "DHLink", "Link", "Revolute", "Prismatic"];

/// Why a sliding joint is refused.
const SLIDES: &str = "a joint that slides, which a table of turning joints has no place for";

/// What a text holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Text {
    pub links: Option<Links>,
    /// What the words say.
    pub words: Words,
    /// The names that the text sets to numbers.
    pub known: Known,
}

/// Links that a text names the parameters of.
#[derive(Debug, Clone, PartialEq)]
pub struct Links {
    /// Line and parameters; of theta it is known whether the joint's variable is part of it.
    pub rows: Vec<(u64, [Value; 4])>,
    /// What the calls that make links or the numbers in names show, and how that is said.
    pub convention: Option<(Convention, &'static str)>,
    /// Whether calls of a toolbox make them, which are classic where nothing says otherwise.
    pub calls: bool,
    pub limits: Vec<Option<[Value; 2]>>,
    /// Whether the text speaks of limits, read or not.
    pub limited: bool,
}

/// Reads a text; `prose` says that it is one of sentences, without code.
pub fn read(text: &str, prose: bool) -> Result<Text, Wrong> {
    let (code, comments) = comments::split(text);
    let words = if prose { Words::of(text, "") } else { Words::of(&comments, &code) };
    let mut scan = Scan { text: &code, line: 1, ..Scan::default() };
    scan.run()?;
    let lower = code.to_lowercase();
    if ["'prismatic'", "\"prismatic\"", ": prismatic"].iter().any(|word| lower.contains(word)) && scan.links.len() > 1 {
        return Err((1, SLIDES.to_owned()));
    }
    let known = std::mem::take(&mut scan.known);
    Ok(Text { links: links(scan, lower.contains("qlim"))?, words, known })
}

/// The links of what was read; none where there are fewer than two.
fn links(scan: Scan, limited: bool) -> Result<Option<Links>, Wrong> {
    let Scan { mut links, lists, families, of_calls, numbered, wrong, .. } = scan;
    let others = || -> Result<(Vec<Link>, Option<Convention>), Wrong> {
        let of_lists = lists::links(&lists, &families)?;
        Ok(if of_lists.is_empty() { numbered::links(&numbered) } else { (of_lists, None) })
    };
    // What a loop takes out of lists is no number where the link is made.
    if let Some(wrong) = wrong {
        links = Vec::new();
        if others()?.0.len() < 2 {
            return Err(wrong);
        }
    }
    // A lone key is one of something else.
    links.retain(|link| link.call || link.values.iter().flatten().count() > 1);
    if links.len() > 1 {
        let has = |link: &Link| link.values.map(|v| v.is_some());
        if let Some(odd) = links.iter().find(|link| !link.call && has(link) != has(&links[0])) {
            return Err((odd.line, "this link has other parameters than the first".to_owned()));
        }
    }
    let mut shown = None;
    if links.len() < 2 {
        (links, shown) = others()?;
    }
    if links.len() < 2 {
        return Ok(None);
    }
    let none = Value { number: 0.0, radians: false, variable: false };
    // What a call makes turns, whatever its theta says.
    let value = |link: &Link, v: Option<Value>| {
        let v = v.unwrap_or(none);
        Value { variable: v.variable && !link.call, ..v }
    };
    Ok(Some(Links {
        rows: links.iter().map(|link| (link.line, link.values.map(|v| value(link, v)))).collect(),
        convention: of_calls
            .map(|c| (c, "the calls that make its links say so"))
            .or(shown.map(|c| (c, "alpha and a are numbered from 0, d from 1"))),
        calls: links.iter().any(|link| link.call),
        limits: links.iter().map(|link| link.limits).collect(),
        limited,
    }))
}

#[derive(Default)]
struct Scan<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    line: u64,
    /// Names that the text has set to numbers.
    known: Known,
    links: Vec<Link>,
    lists: Lists,
    /// Lists whose names have the same before the parameter's.
    families: BTreeMap<String, Lists>,
    /// The convention of the calls that make links.
    of_calls: Option<Convention>,
    numbered: numbered::Numbered,
    /// The first value that is no number.
    wrong: Option<Wrong>,
}

impl Scan<'_> {
    fn run(&mut self) -> Result<(), Wrong> {
        let mut before = '\n';
        while let Some(c) = self.text[self.at..].chars().next() {
            let starts = (c.is_alphabetic() || c == '_') && !(before.is_alphanumeric() || matches!(before, '_' | '.'));
            if starts {
                let rest = &self.text[self.at..];
                let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(rest.len());
                self.word(end)?;
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

    fn evaluate(&self, text: &str) -> Option<Value> {
        evaluate(text, &|name| self.known.get(name).copied())
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
        let behind = rest[quote.map_or(0, char::len_utf8)..].trim_start_matches([' ', '\t']);
        let behind = sized(behind).unwrap_or(behind);
        let separator = behind.chars().next().filter(|c| matches!(c, '=' | ':') || *c == ',' && quote.is_some());
        let Some(separator) = separator else { return Ok(()) };
        let value = &behind[separator.len_utf8()..];
        if value.starts_with('=') {
            return Ok(());
        }
        let value_at = self.text.len() - value.len();
        let which = KEYS.iter().position(|names| names.contains(&word.to_lowercase().as_str()));
        if let Some(which) = which {
            if let Some(list) = list(value, &self.known) {
                self.lists[which].get_or_insert((self.line, list));
                return Ok(());
            }
            let text = &value[..extent(value)];
            match self.evaluate(text) {
                Some(v) if !v.variable || which == 2 => {
                    self.put(which, v);
                    self.at = value_at + text.len();
                }
                Some(_) if self.depth > 0 => {
                    return Err((self.line, format!("`{}`: a joint that slides", text.trim())));
                }
                None if self.depth > 0 && !text.trim().is_empty() => {
                    let wrong = (self.line, format!("`{word}` is `{}`, which is no number", text.trim()));
                    self.wrong.get_or_insert(wrong);
                }
                _ => {}
            }
        } else if let Some((which, number)) = numbered::parameter(word)
            && let Some(v) = self.evaluate(&value[..extent(value)]).filter(|v| !v.variable || which == 2)
        {
            self.numbered[which].entry(number).or_insert((self.line, v));
        }
        self.other(word, value)?;
        if separator == '=' && self.depth == 0 {
            self.assign(start, word.to_owned(), value);
        }
        Ok(())
    }

    /// What else a name with a value may be: a list of a family, a link's limits, a joint that counts the other way.
    fn other(&mut self, word: &str, value: &str) -> Result<(), Wrong> {
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
        if word == "flip" && value.trim_start().starts_with(['T', 't']) {
            let message = "`flip`: a joint that counts the other way, which a table has no place for";
            return Err((self.line, message.to_owned()));
        }
        Ok(())
    }

    /// Numbers that get names, `a1, a2 = 0.4, 0.3` too.
    fn assign(&mut self, start: usize, last: String, value: &str) {
        let before = self.text[..start].rsplit(['\n', ';']).next().unwrap_or("");
        let mut names: Vec<String> = before.split(',').map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()).collect();
        names.push(last);
        let mut rest = value;
        for name in names {
            let text = &rest[..extent(rest)];
            if let Some(v) = self.evaluate(text).filter(|v| !v.variable) {
                self.known.insert(name, v);
            }
            rest = rest[text.len()..].strip_prefix(',').unwrap_or("");
        }
    }

    fn put(&mut self, which: usize, value: Value) {
        let (depth, line) = (self.depth, self.line);
        let open = self.links.last_mut().filter(|link| link.depth == depth && link.values[which].is_none());
        match open {
            Some(link) => link.values[which] = Some(value),
            None => {
                let mut link = Link::at(line, depth);
                link.values[which] = Some(value);
                self.links.push(link);
            }
        }
    }

    /// A call that makes a link: its parameters follow by name, or in a list.
    fn call(&mut self, word: &str, start: usize) -> Result<(), Wrong> {
        let before = self.text[..start].trim_end_matches(' ');
        if ["class", "def", "function", "import", "classdef"].iter().any(|w| before.ends_with(w)) {
            return Ok(());
        }
        if word.starts_with("Prismatic") {
            return Err((self.line, SLIDES.to_owned()));
        }
        self.of_calls = match word {
            "RevoluteMDH" => Some(Convention::Modified),
            "RevoluteDH" => Some(Convention::Classic),
            _ => self.of_calls,
        };
        let inside = self.text[self.at..].trim_start_matches(' ')[1..].trim_start();
        let mut link = Link { call: true, ..Link::at(self.line, self.depth + 1) };
        if inside.starts_with('[') && word == "Link" {
            let numbers = list(inside, &self.known).filter(|list| (4..=6).contains(&list.len()));
            let Some(list) = numbers else {
                return Err((self.line, "`Link([...])` without the numbers theta, d, a, alpha".to_owned()));
            };
            if list.get(4).is_some_and(|sigma| sigma.number != 0.0) {
                return Err((self.line, SLIDES.to_owned()));
            }
            let mut theta = list[0];
            if let Some(offset) = list.get(5) {
                theta =
                    Value { number: theta.number + offset.number, radians: theta.radians || offset.radians, ..theta };
            }
            link.values = [Some(list[3]), Some(list[2]), Some(theta), Some(list[1])];
        } else {
            let first = &inside[..extent(inside)];
            let named = first.trim().is_empty() || first.contains('=') || first.trim_start().starts_with(['\'', '"']);
            if !named {
                return Err((self.line, format!("`{word}({}, ...)`: parameters without names", first.trim())));
            }
        }
        self.links.push(link);
        Ok(())
    }
}

/// What is behind the size of an array that a list follows, `[6] = {0, 1}`.
fn sized(behind: &str) -> Option<&str> {
    let (size, rest) = behind.strip_prefix('[')?.split_once(']')?;
    let rest = rest.trim_start();
    let listed = rest.strip_prefix('=')?.trim_start().starts_with(['{', '[']);
    (size.trim().chars().all(|c| c.is_alphanumeric() || c == '_') && listed).then_some(rest)
}
