//! Denavit-Hartenberg parameters in the text of programs and settings.
//!
//! In: text. Out: a row a joint, alpha, a, theta, d as they stand there, and the convention where words say it. Forms: links that are built one by one with
//! named parameters (`RevoluteDH(d=0.1, a=0, alpha=pi/2)`, `Link('d', 0.1, 'a', 0, ...)`, `{a: 0, alpha: 1.57, ...}`, keys one below the other);
//! `Link([theta d a alpha])` of the Robotics Toolbox for MATLAB; a list a parameter (`a = [0, -0.4, ...]`); and parameters with numbers
//! (`alpha0: 0, a0: 0, d1: 0.3, alpha1: -pi/2`). Parameters that a link's call
//! does not name are zero. Names that the text sets to a number stand for it.
//! What goes wrong: a parameter that is no number, sliding joints, axes that are turned round; all refused with the line.

mod link;
mod matrix;
mod numbered;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

pub use self::matrix::{Matrix, matrix};

use self::link::{KEYS, Link};
use crate::robot::catalogue::{Convention, Row};
use crate::tables::expression::{Value, evaluate};

/// Calls that make a link.
const CALLS: [&str; 8] =
    ["RevoluteDH", "RevoluteMDH", "PrismaticDH", "PrismaticMDH", "DHLink", "Link", "Revolute", "Prismatic"];

/// Why a sliding joint is refused.
const SLIDES: &str = "a joint that slides, which a table of turning joints has no place for";

/// What a text holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Links {
    /// Line and parameters.
    pub rows: Vec<(u64, Row)>,
    /// Whether angles were written with pi or turned into radians.
    pub radians: bool,
    /// What the text's words say.
    pub convention: Option<Convention>,
}

/// A line and what is wrong there.
pub type Wrong = (u64, String);

/// The links of a text; none where it has none.
pub fn read(text: &str) -> Result<Option<Links>, Wrong> {
    let text = without_comments(text);
    let mut scan = Scan {
        text: &text,
        at: 0,
        depth: 0,
        line: 1,
        known: BTreeMap::new(),
        links: Vec::new(),
        lists: Default::default(),
        of_calls: None,
        numbered: Default::default(),
        wrong: None,
    };
    scan.run()?;
    let lower = text.to_lowercase();
    if ["'prismatic'", "\"prismatic\"", ": prismatic"].iter().any(|word| lower.contains(word)) && scan.links.len() > 1 {
        return Err((1, SLIDES.to_owned()));
    }
    let Scan { mut links, lists, of_calls, numbered, wrong, .. } = scan;
    let others = || -> Result<(Vec<Link>, Option<Convention>), Wrong> {
        let of_lists = of_lists(&lists)?;
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
    let values = || links.iter().flat_map(|link| [link.values[0], link.values[2]]).flatten();
    Ok(Some(Links {
        radians: values().any(|v| v.radians),
        rows: links.iter().map(|link| (link.line, link.values.map(|v| v.map_or(0.0, |v| v.number)))).collect(),
        convention: of_calls.or(shown).or_else(|| convention(&lower, links.iter().any(|link| link.call))),
    }))
}

/// What the words of a text say; a toolbox's call that says nothing makes a classic link.
fn convention(lower: &str, calls: bool) -> Option<Convention> {
    let has = |words: &[&str]| words.iter().any(|word| lower.contains(word));
    match (has(&["mdh", "modified", "craig"]), has(&["standard", "classic"])) {
        (true, false) => Some(Convention::Modified),
        (false, true) => Some(Convention::Classic),
        (false, false) if calls => Some(Convention::Classic),
        _ => None,
    }
}

/// The text with comments as blanks, so that lines stay where they are.
fn without_comments(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut quoted: Option<&str> = None;
    for line in text.lines() {
        let mut rest = line;
        while !rest.is_empty() {
            if let Some(mark) = quoted {
                let Some(end) = rest.find(mark) else { break };
                (rest, quoted) = (&rest[end + mark.len()..], None);
                continue;
            }
            let comment = ["#", "%", "//"].iter().filter_map(|mark| rest.find(mark)).min().unwrap_or(rest.len());
            let block = ["\"\"\"", "'''"].iter().filter_map(|mark| Some((rest.find(mark)?, *mark))).min();
            match block {
                Some((start, mark)) if start < comment => {
                    plain.push_str(&rest[..start]);
                    (rest, quoted) = (&rest[start + mark.len()..], Some(mark));
                }
                _ => {
                    plain.push_str(&rest[..comment]);
                    break;
                }
            }
        }
        plain.push('\n');
    }
    plain
}

struct Scan<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    line: u64,
    /// Names that the text has set to numbers.
    known: BTreeMap<String, f64>,
    links: Vec<Link>,
    /// The first list of each parameter, with its line.
    lists: [Option<(u64, Vec<Value>)>; 4],
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
                    self.close();
                }
                '\n' => {
                    self.line += 1;
                    if self.depth == 0 && self.text[self.at + 1..].trim_start_matches(' ').starts_with("- ") {
                        self.end_block();
                    }
                }
                _ => {}
            }
            before = c;
            self.at += c.len_utf8();
        }
        Ok(())
    }

    /// A link whose brackets are closed takes nothing more.
    fn close(&mut self) {
        let depth = self.depth;
        if let Some(link) = self.links.last_mut().filter(|link| link.depth > depth) {
            link.depth = usize::MAX;
        }
    }

    fn end_block(&mut self) {
        if let Some(link) = self.links.last_mut().filter(|link| link.depth == 0) {
            link.depth = usize::MAX;
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
        let behind = rest[quote.map_or(0, char::len_utf8)..].trim_start_matches([' ', '\t']);
        let separator = behind.chars().next().filter(|c| matches!(c, '=' | ':') || *c == ',' && quote.is_some());
        let Some(separator) = separator else { return Ok(()) };
        let value = &behind[separator.len_utf8()..];
        if value.starts_with('=') {
            return Ok(());
        }
        let value_at = self.text.len() - value.len();
        let which = KEYS.iter().position(|names| names.contains(&word.to_lowercase().as_str()));
        if let Some(which) = which {
            if let Some(list) = self.list(value) {
                self.lists[which].get_or_insert((self.line, list));
                return Ok(());
            }
            let text = &value[..extent(value)];
            let known = |name: &str| self.known.get(name).copied();
            match evaluate(text, &known) {
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
        } else if let Some((which, number)) = numbered::parameter(word) {
            let known = |name: &str| self.known.get(name).copied();
            if let Some(v) = evaluate(&value[..extent(value)], &known).filter(|v| !v.variable || which == 2) {
                self.numbered[which].entry(number).or_insert((self.line, v));
            }
        }
        if word == "flip" && value.trim_start().starts_with(['T', 't']) {
            return Err((
                self.line,
                "`flip`: a joint that counts the other way, which a table has no place for".to_owned(),
            ));
        }
        if separator == '=' && self.depth == 0 {
            self.assign(start, word.to_owned(), value);
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
            let known = |name: &str| self.known.get(name).copied();
            if let Some(v) = evaluate(text, &known).filter(|v| !v.variable) {
                self.known.insert(name, v.number);
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
                let mut values = [None; 4];
                values[which] = Some(value);
                self.links.push(Link { line, depth, call: false, values });
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
        let mut link = Link { line: self.line, depth: self.depth + 1, call: true, values: [None; 4] };
        if inside.starts_with('[') && word == "Link" {
            let numbers = self.list(inside).filter(|list| (4..=6).contains(&list.len()));
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

    /// The numbers of a list, `[0, pi/2]`, `np.array([0 1])`, `np.deg2rad([0, 90])`; `None` where it is none.
    fn list(&self, value: &str) -> Option<Vec<Value>> {
        let value = value.trim_start();
        let open = value.find(['[', '{'])?;
        let head = value[..open].trim();
        let turned = head.trim_end_matches('(').rsplit('.').next().is_some_and(|f| matches!(f, "deg2rad" | "radians"));
        if !(head.is_empty() || head.ends_with('(') && head.len() < 30) || head.contains(['\n', ',', ';']) {
            return None;
        }
        let end = open + value[open..].find([']', '}'])?;
        let inside = &value[open + 1..end];
        let known = |name: &str| self.known.get(name).copied();
        let numbers: Option<Vec<Value>> = match inside.contains([',', ';']) {
            true => {
                inside.trim_end_matches([',', ';', ' ', '\n']).split([',', ';']).map(|t| evaluate(t, &known)).collect()
            }
            false => inside.split_whitespace().map(|t| evaluate(t, &known)).collect(),
        };
        let turn = |v: Value| if turned { Value { number: v.number.to_radians(), radians: true, ..v } } else { v };
        numbers.map(|list| list.into_iter().map(turn).collect())
    }
}

/// Bytes of a value: to the comma, the end of the line or the bracket that ends it.
fn extent(value: &str) -> usize {
    let mut depth = 0usize;
    for (at, c) in value.char_indices() {
        match c {
            '(' | '[' | '{' => depth += 1,
            ')' | ']' | '}' if depth == 0 => return at,
            ')' | ']' | '}' => depth -= 1,
            ',' | ';' | '\n' if depth == 0 => return at,
            _ => {}
        }
    }
    value.len()
}

/// Links of lists, where the three that every table has are there.
fn of_lists(lists: &[Option<(u64, Vec<Value>)>; 4]) -> Result<Vec<Link>, Wrong> {
    let [Some((line, alpha)), Some((_, a)), theta, Some((_, d))] = lists else { return Ok(Vec::new()) };
    let theta = theta.as_ref().map(|(_, list)| list);
    if [a.len(), d.len(), theta.map_or(a.len(), Vec::len)].iter().any(|n| *n != alpha.len()) {
        return Err((*line, "the lists of alpha, a, d and theta have different lengths".to_owned()));
    }
    let link = |i: usize| {
        let values = [Some(alpha[i]), Some(a[i]), theta.map(|list| list[i]), Some(d[i])];
        Link { line: *line, depth: 0, call: false, values }
    };
    Ok((0..alpha.len()).map(link).collect())
}
