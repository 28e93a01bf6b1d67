//! What a program writes into its variables.
//!
//! In: the code without comments and strings, and the joint targets written as numbers in it. Out: by variable, the
//! targets that it can hold. A variable that is given anything else anywhere (a computed value, one of its fields, a
//! routine's parameter), or is handed to something that may write into it, holds what this file does not say. Variables
//! of one name in several routines are taken together, so that doubt about one is doubt about all.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::handed::{self, Calls};
use super::instruction::Cause;
use super::language::Target;
use super::scan;

/// How a language writes values into variables.
#[derive(Debug, Clone, Copy)]
pub(super) struct Syntax {
    /// Between a name and its value.
    pub assign: &'static str,
    /// The end of a value outside of brackets.
    pub end: char,
    /// Whether capital and small letters are the same.
    pub any_case: bool,
    /// The words before a routine's name and its parameters.
    pub routines: &'static [&'static str],
    /// What is handed to calls, where these get variables and not their values.
    pub calls: Option<Calls>,
    /// Whether a value is Cartesian.
    pub cartesian: fn(&str) -> bool,
}

/// One of the values of a variable.
#[derive(Debug, Clone)]
enum Value {
    /// Joint targets as numbers, by their places in the list of targets.
    Targets(Range<usize>),
    /// What another variable holds.
    Of(String),
    /// Something that no joint target in this file shows.
    Other(Cause),
}

/// All variables of a program.
#[derive(Debug)]
pub(super) struct Variables {
    syntax: Syntax,
    values: BTreeMap<String, Vec<Value>>,
}

impl Variables {
    /// Collects every value that is written into a variable.
    pub(super) fn read(code: &str, syntax: Syntax, targets: &[Target]) -> Variables {
        let mut variables = Variables { syntax, values: BTreeMap::new() };
        let mut brackets = 0usize;
        let mut seen = 0;
        for word in scan::words(code) {
            for c in code[seen..word.start].chars() {
                match c {
                    '(' => brackets += 1,
                    ')' => brackets = brackets.saturating_sub(1),
                    _ => {}
                }
            }
            seen = word.end;
            let name = &code[word.clone()];
            if brackets == 0 && scan::is_name(name) && !code[..word.start].ends_with(['\\', '.']) {
                variables.assigned(code, word, targets);
            }
        }
        variables.parameters(code);
        if let Some(calls) = syntax.calls {
            for name in handed::handed(code, &calls, syntax.end, syntax.routines) {
                variables.add(name, Value::Other(Cause::Elsewhere));
            }
        }
        variables
    }

    /// The targets that a variable can hold, or why they are not known.
    pub(super) fn held(&self, name: &str) -> Result<Vec<usize>, Cause> {
        let (mut found, mut visited, mut doubt) = (BTreeSet::new(), BTreeSet::new(), None);
        let mut open = vec![self.key(name)];
        while let Some(name) = open.pop() {
            if !visited.insert(name.clone()) {
                continue;
            }
            for value in self.values.get(&name).ok_or(Cause::Elsewhere)? {
                match value {
                    Value::Targets(range) => found.extend(range.clone()),
                    Value::Of(other) => open.push(other.clone()),
                    // A variable that holds a pose anywhere is one of poses, whatever else is written into it.
                    Value::Other(Cause::Cartesian) => return Err(Cause::Cartesian),
                    Value::Other(cause) => doubt = doubt.or_else(|| Some(cause.clone())),
                }
            }
        }
        match doubt {
            Some(cause) => Err(cause),
            None if found.is_empty() => Err(Cause::Elsewhere),
            None => Ok(found.into_iter().collect()),
        }
    }

    /// Whether anything is written into a variable.
    pub(super) fn knows(&self, name: &str) -> bool {
        self.values.contains_key(&self.key(name))
    }

    /// What an expression is: one joint target as numbers, or a variable, an element of one included.
    pub(super) fn expression(&self, code: &str, at: Range<usize>, targets: &[Target]) -> Result<Vec<usize>, Cause> {
        match self.value(code, at, targets, true) {
            Value::Targets(range) => Ok(range.collect()),
            Value::Of(name) => self.held(&name),
            Value::Other(cause) => Err(cause),
        }
    }

    fn key(&self, name: &str) -> String {
        if self.syntax.any_case { name.to_ascii_uppercase() } else { name.to_owned() }
    }

    fn add(&mut self, name: &str, value: Value) {
        let key = self.key(name);
        self.values.entry(key).or_default().push(value);
    }

    /// Parameters of a routine hold what its callers say.
    fn parameters(&mut self, code: &str) {
        for (header, name) in handed::headers(code, self.syntax.routines) {
            let parameters = &code[name.end..header.end];
            scan::words(parameters).for_each(|word| self.add(&parameters[word], Value::Other(Cause::Elsewhere)));
        }
    }

    /// The value behind a word, where one is assigned to it, to an element or to a field of it.
    fn assigned(&mut self, code: &str, word: Range<usize>, targets: &[Target]) {
        let (mut at, mut field) = (word.end, false);
        loop {
            let rest = &code[at..];
            let blank = rest.len() - rest.trim_start_matches([' ', '\t']).len();
            match rest[blank..].chars().next() {
                Some('[' | '{') => match scan::closed(code, at + blank) {
                    Some(end) => at = end,
                    None => return,
                },
                Some('.') => {
                    field = true;
                    let Some(part) = scan::words(&code[at..]).next() else { return };
                    // A call of a variable's own, `list.append(...)`.
                    if code[at + part.end..].starts_with('(') && &code[at + part.start..at + part.end] != "length" {
                        return self.add(&code[word], Value::Other(Cause::Elsewhere));
                    }
                    at += part.end;
                }
                _ => break,
            }
        }
        let Some(from) = scan::word(code, at, self.syntax.assign) else { return };
        if code[at..from].contains('\n') || code[from..].starts_with('=') {
            return;
        }
        let value = if field {
            Value::Other(Cause::Elsewhere)
        } else {
            self.value(code, from..self.end(code, from), targets, false)
        };
        let name = &code[word];
        self.add(name, value);
    }

    fn end(&self, code: &str, from: usize) -> usize {
        let mut ends = scan::levels(&code[from..]).filter(|(_, c, depth)| *c == self.syntax.end && *depth == 0);
        ends.next().map_or(code.len(), |(at, ..)| from + at)
    }

    /// What stands at a place; of a list of targets all, where it is not to be a `single` one.
    fn value(&self, code: &str, at: Range<usize>, targets: &[Target], single: bool) -> Value {
        let at = scan::trimmed(code, at);
        let text = &code[at.clone()];
        let from = targets.partition_point(|t| t.whole.start < at.start);
        let to = from + targets[from..].partition_point(|t| t.whole.start < at.end);
        if from < to && only_numbers(code, at.clone(), &targets[from..to]) && !(single && to > from + 1) {
            return Value::Targets(from..to);
        }
        if (self.syntax.cartesian)(text) {
            return Value::Other(Cause::Cartesian);
        }
        if text.starts_with(['[', '{']) && from == to {
            return Value::Other(if is_numbers(text) { Cause::Incomplete } else { Cause::Elsewhere });
        }
        let mut words = scan::words(text);
        let Some(first) = words.next().filter(|w| w.start == 0 && scan::is_name(&text[w.clone()])) else {
            return Value::Other(Cause::Elsewhere);
        };
        let rest = text[first.end..].trim_start();
        let element = rest.starts_with(['[', '{']) && scan::closed(rest, 0) == Some(rest.len());
        if rest.is_empty() || element {
            return Value::Of(self.key(&text[first]));
        }
        Value::Other(if rest.starts_with(['+', '-', ':']) { Cause::Offset } else { Cause::Elsewhere })
    }
}

/// Whether a list has a number in each of its places, labels before them allowed (`A1 30`).
fn is_numbers(list: &str) -> bool {
    let mut places = list.split(['[', ']', '{', '}', ',']).map(str::trim).filter(|place| !place.is_empty());
    places.all(|place| place.split_whitespace().last().is_some_and(|number| number.parse::<f64>().is_ok()))
}

/// Whether nothing but these targets, brackets and commas stand at a place.
fn only_numbers(code: &str, at: Range<usize>, targets: &[Target]) -> bool {
    let ends = std::iter::once(at.start).chain(targets.iter().map(|t| t.whole.end));
    let starts = targets.iter().map(|t| t.whole.start).chain([at.end]);
    let mut between = ends.zip(starts).filter_map(|(end, start)| code.get(end..start));
    between.all(|text| text.chars().all(|c| c.is_whitespace() || "[]{},".contains(c)))
}
