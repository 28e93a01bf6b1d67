//! Variables that are handed to something that may write into them.
//!
//! In: the code without comments and strings. Out: names of variables that stand as an argument of a call which is not
//! known to read alone, the file's own routines included. Constants are left out. A call is what has brackets behind
//! it, and where the language has calls without them the word before the first argument.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::scan;

/// Calls of a language that hands variables themselves and not their values.
#[derive(Debug, Clone, Copy)]
pub(super) struct Calls {
    /// Whether a call of this word leaves what it is given as it is.
    pub reads: fn(&str) -> bool,
    /// Whether parameters as they are declared take values alone.
    pub by_value: fn(&str) -> bool,
    /// Words that are no calls, with blanks between.
    pub keywords: &'static str,
    /// Words that begin declarations.
    pub declares: &'static str,
    /// Whether statements call without brackets, `word argument, argument`.
    pub bare: bool,
    /// Instructions that write into a variable named by a text: any of them all.
    pub by_name: &'static str,
}

/// The names, as they are written.
pub(super) fn handed<'a>(code: &'a str, calls: &Calls, end: char, routines: &[&str]) -> BTreeSet<&'a str> {
    let headers = headers(code, routines);
    let mut by_value = BTreeMap::new();
    for (header, name) in &headers {
        let all = by_value.entry(code[name.clone()].to_ascii_uppercase()).or_insert(true);
        *all &= (calls.by_value)(&code[name.end..header.end]);
    }
    let mut place = Place { calls, end, by_value, open: Vec::new(), given: None, declared: false, last: "" };
    let mut headers = headers.into_iter().map(|(header, _)| header).peekable();
    let (mut found, mut seen, mut header_end) = (BTreeSet::new(), 0, 0);
    for word in scan::words(code) {
        if let Some(header) = headers.next_if(|header| header.start <= word.start) {
            header_end = header.end;
        }
        place.pass(&code[seen..word.start]);
        if word.start < header_end {
            place.begin();
        } else if place.is_written(&code[seen..word.start], &code[word.clone()], &code[word.end..]) {
            found.insert(&code[word.clone()]);
        }
        seen = word.end;
    }
    if scan::words(code).any(|word| of(calls.by_name, &code[word])) {
        found.extend(scan::words(code).map(|word| &code[word]));
    }
    let constants = constants(code, calls.declares);
    found.retain(|name| !constants.contains(&name.to_ascii_uppercase()));
    found
}

/// Whether it is one of these words, whatever its case.
pub(super) fn of(words: &str, word: &str) -> bool {
    words.split_whitespace().any(|w| w.eq_ignore_ascii_case(word))
}

/// Where in a statement the reader is.
struct Place<'a> {
    calls: &'a Calls,
    end: char,
    /// The file's own routines, in capitals, and whether they take values alone.
    by_value: BTreeMap<String, bool>,
    /// Of each open bracket: whether what stands in it may be written.
    open: Vec<bool>,
    /// Whether the arguments of the statement's call without brackets may be, where there is one.
    given: Option<bool>,
    declared: bool,
    /// The word before, in the statement.
    last: &'a str,
}

impl<'a> Place<'a> {
    /// A statement begins.
    fn begin(&mut self) {
        (self.last, self.given, self.declared) = ("", None, false);
    }

    fn reads(&self, word: &str) -> bool {
        let own = self.by_value.get(&word.to_ascii_uppercase()).copied();
        of(self.calls.keywords, word) || own.unwrap_or_else(|| (self.calls.reads)(word))
    }

    /// Goes on behind what stands between two words.
    fn pass(&mut self, gap: &str) {
        for (at, c) in gap.char_indices() {
            match c {
                '(' => {
                    let call = gap[..at].trim().is_empty() && !self.last.is_empty();
                    self.open.push(call && !self.reads(self.last));
                }
                '[' | '{' => self.open.push(false),
                ')' | ']' | '}' => drop(self.open.pop()),
                c if c == self.end && (self.open.is_empty() || c == '\n') => {
                    self.open.clear();
                    self.begin();
                }
                _ if !self.open.is_empty() || !self.calls.bare => {}
                // A text, a negative number or a switch may stand first; between signs of per cent stands the name of a
                // routine.
                ',' | '\\' => self.given = self.given.or(Some(!self.reads(self.last))),
                '%' => self.given = Some(true),
                _ => {}
            }
        }
    }

    /// Goes on behind a word; whether it is a name that may be written.
    fn is_written(&mut self, gap: &str, word: &'a str, behind: &str) -> bool {
        let last = std::mem::replace(&mut self.last, word);
        let adjacent = scan::is_name(last) && !gap.is_empty() && gap.trim().is_empty();
        let outside = self.open.is_empty() && self.calls.bare;
        if outside && of(self.calls.declares, word) {
            self.declared = true;
        } else if outside && of(self.calls.keywords, word) {
            self.given = None;
        } else if outside && adjacent && !of(self.calls.keywords, last) {
            self.given = Some(!self.reads(last));
        }
        let written = self.open.last().copied().unwrap_or(self.given == Some(true) && !self.declared);
        // A known instruction with a switch or a list as its first argument.
        if outside && (self.calls.reads)(word) && behind.trim_start().starts_with(['[', '\\']) {
            self.given = Some(false);
        }
        written && scan::is_name(word) && !gap.ends_with(['.', '\\'])
    }
}

/// Routines that are declared: from the word that does to the end of the parameters, and the name.
pub(super) fn headers(code: &str, routines: &[&str]) -> Vec<(Range<usize>, Range<usize>)> {
    let header = |word: Range<usize>| {
        routines.iter().find(|r| r.eq_ignore_ascii_case(&code[word.clone()]))?;
        // The type of a function's value stands before its name.
        let name = |c: char| c.is_alphanumeric() || c == '_' || c == ' ' || c == '\t';
        let open = word.end + code[word.end..].find(|c| !name(c))?;
        let end = scan::closed(code, open).filter(|_| code[open..].starts_with('('))?;
        let name = scan::words(&code[word.end..open]).last()?;
        Some((word.start..end, word.end + name.start..word.end + name.end))
    };
    scan::words(code).filter_map(header).collect()
}

/// Names that are declared as constants and nowhere as anything else, in capitals.
fn constants(code: &str, declares: &str) -> BTreeSet<String> {
    let words: Vec<&str> = scan::words(code).map(|word| &code[word]).collect();
    let is_constant = |word: &str| word.eq_ignore_ascii_case("CONST");
    let (constants, others): (Vec<&[&str]>, Vec<&[&str]>) =
        words.windows(3).filter(|three| of(declares, three[0])).partition(|three| is_constant(three[0]));
    let others: BTreeSet<String> = others.iter().map(|three| three[2].to_ascii_uppercase()).collect();
    constants.iter().map(|three| three[2].to_ascii_uppercase()).filter(|name| !others.contains(name)).collect()
}
