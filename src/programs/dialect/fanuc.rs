//! Fanuc's listing: positions `J1= .. deg` behind `/POS`.
//!
//! In: the text of a listing. Out: its positions of joints, and its instructions that move, each with what shifts or
//! leads it. What goes wrong: a last instruction without its end.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;

use crate::programs::instruction::{Cause, Instruction};
use crate::programs::language::{Motion, Target, Written};
use crate::programs::scan;

/// Words of a motion: joint, linear, circular, circular arc, spline; as groups of axes that move independently have
/// them too.
const MOTIONS: [&str; 10] = ["J", "L", "C", "A", "S", "JP", "LP", "CP", "AP", "SP"];
/// How options end, in several languages of the controller, that move a point from where it was taught.
const OFFSET: &str = "OFFSET";
/// The one that makes it relative to the point before.
const RELATIVE: &str = "INC";
/// Options that follow a sensor.
const LED: [&str; 4] = ["TRACK", "TAST", "AVC", "SEARCH"];
/// How instructions begin that shift the motions behind them, or let a sensor or a force lead the arm, up to one that
/// begins the same and ends in one of `ENDS`.
const LEADS: [(&[&str], Cause); 5] = [
    (&["TOUCH", OFFSET], Cause::Offset),
    (&["MP", OFFSET], Cause::Offset),
    (&["TRACK"], Cause::Led),
    (&["SOFTFLOAT"], Cause::Led),
    (&["FORCE", "CTRL"], Cause::Led),
];
const ENDS: [&str; 2] = ["END", "OFF"];

/// Positions in joint coordinates, by their number.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let names = scan::axes('J', count);
    let position = |at: usize| {
        let numbers = scan::labelled(text, at, &names)?;
        let before = &text[..at];
        let open = before.rfind("P[")?;
        let name = before[open..].split_inclusive(']').next().map(str::to_owned);
        scan::target(text, name, numbers, None)
    };
    let word_starts = |at: &usize| text[..*at].ends_with(|c: char| !c.is_ascii_alphanumeric());
    text.match_indices("J1").map(|(at, _)| at).filter(word_starts).filter_map(position).collect()
}

/// Every instruction that moves, between `/MN` and `/POS`.
pub(super) fn motions(text: &str, targets: &[Target]) -> Vec<Instruction> {
    let start = text.find("/MN").map_or(0, |at| at + 3);
    let end = text[start..].find("/POS").map_or(text.len(), |length| start + length);
    let code = instructions(&text[..end]);
    let positions = Positions::read(&text[end..], targets, written(&code[start..]));
    let motion = |word: Range<usize>, group: Option<&str>, end_of_it: usize, led: &Option<Cause>| {
        let points = points(&code, word.end..end_of_it);
        let Some(last) = points.last().map(|point| point.end) else {
            // Positions of a pallet, and what else is none of the program's own.
            let target = scan::trimmed(&code, word.end..end_of_it);
            let end = code[target.clone()].find(char::is_whitespace).map_or(target.end, |k| target.start + k);
            return Instruction::new(text, word, target.start..end, Err(Cause::Elsewhere));
        };
        let moves_by = points.iter().map(|point| positions.held(&code[point.clone()]));
        let moves_by = moves_by.collect::<Result<Vec<usize>, Cause>>();
        let group = group.filter(|group| *group != "GP1").map(|_| Cause::Group);
        let moves_by = moves_by.and_then(|found| match option(&code[last..end_of_it]).or(group).or(led.clone()) {
            Some(cause) => Err(cause),
            None => Ok(found),
        });
        Instruction::new(text, word, points[0].start..last, moves_by)
    };
    let (mut from, mut leads, mut found) = (start, Vec::<usize>::new(), Vec::new());
    for next in code[start..].match_indices(';').map(|(k, _)| start + k).chain([code.len()]) {
        let at = std::mem::replace(&mut from, next + 1)..next;
        if let Some((lead, word, begins)) = lead(&code, at.clone()) {
            leads.retain(|other| *other != lead);
            leads.extend(begins.then_some(lead));
            // The arm may move by it alone.
            let led = LEADS[lead].1.clone();
            found.extend((begins && led == Cause::Led).then(|| Instruction::new(text, word, at.end..at.end, Err(led))));
            continue;
        }
        let unended = (next == code.len()).then_some(Cause::Unended);
        let led = unended.or_else(|| leads.first().map(|lead| LEADS[*lead].1.clone()));
        let words = words(&code, at.clone());
        let ends: Vec<usize> = words.iter().skip(1).map(|(word, _)| word.start).chain([at.end]).collect();
        found.extend(words.into_iter().zip(ends).map(|((word, group), end)| motion(word, group, end, &led)));
    }
    found
}

/// Which of the leads a statement is, its words, and whether it begins there.
fn lead(code: &str, at: Range<usize>) -> Option<(usize, Range<usize>, bool)> {
    let places: Vec<Range<usize>> = scan::words(&code[at.clone()]).collect();
    let words: Vec<String> = places.iter().map(|w| code[at.clone()][w.clone()].to_ascii_uppercase()).collect();
    let begins =
        |(head, _): &(&[&str], Cause)| words.len() >= head.len() && head.iter().zip(&words).all(|(a, b)| a == b);
    let lead = LEADS.iter().position(begins)?;
    let word = at.start + places[0].start..at.start + places[LEADS[lead].0.len() - 1].end;
    Some((lead, word, !words.last().is_some_and(|last| ENDS.contains(&last.as_str()))))
}

/// The words of a statement that move, each with the group of axes named before it: one that stands first, or that has
/// a position behind it.
fn words(code: &str, at: Range<usize>) -> Vec<(Range<usize>, Option<&str>)> {
    let (mut depth, mut seen) = (0i32, at.start);
    let mut found = Vec::new();
    let mut last = "";
    for word in scan::words(&code[at.clone()]).map(|w| at.start + w.start..at.start + w.end) {
        let gap = &code[seen..word.start];
        depth += gap.matches('[').count() as i32 - gap.matches(']').count() as i32;
        seen = word.end;
        let name = &code[word.clone()];
        let behind = code[word.end..at.end].trim_start().trim_start_matches('@').trim_start();
        let first = code[at.start..word.start].trim().is_empty();
        let positions = behind.starts_with("P[") || behind.starts_with("PR[");
        let named = || {
            first && name.len() == 1 && behind.starts_with(|c: char| c.is_ascii_alphabetic()) && behind.contains('[')
        };
        if depth == 0 && MOTIONS.contains(&name) && (positions || named()) {
            found.push((word, Some(last).filter(|last| last.starts_with("GP") && gap.trim() == ",")));
        }
        last = name;
    }
    found
}

/// Why a motion with these options is not corrected: what stands in brackets are names and numbers.
fn option(options: &str) -> Option<Cause> {
    let mut depth = 0i32;
    let plain = |c: char| {
        depth += i32::from(c == '[') - i32::from(c == ']');
        if depth > 0 { ' ' } else { c }
    };
    let plain: String = options.chars().map(plain).collect::<String>().to_ascii_uppercase();
    // A register behind an option is what it adds; one that an option writes into has a sign of equality behind it.
    let register = |word: &Range<usize>| {
        ["PR", "VR"].contains(&&plain[word.clone()])
            && !plain[word.end..].trim_start_matches([' ', ']']).starts_with('=')
    };
    let offset = |word: &Range<usize>| plain[word.clone()].ends_with(OFFSET) || &plain[word.clone()] == RELATIVE;
    if scan::words(&plain).any(|word| offset(&word) || register(&word)) {
        return Some(Cause::Offset);
    }
    scan::words(&plain).any(|word| LED.contains(&&plain[word])).then_some(Cause::Led)
}

/// Positions of the program that an instruction writes into, by their numbers; `None` where a register holds the
/// number.
fn written(code: &str) -> Vec<Option<u64>> {
    let own = |at: &usize| !code[..*at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    let places = code.match_indices("P[").map(|(at, _)| at).filter(own);
    let assigned = |at: usize| {
        let end = scan::closed(code, at + 1)?;
        code[end..].trim_start().starts_with('=').then(|| number(&code[at..end]))
    };
    places.filter_map(assigned).collect()
}

/// The text with blanks in place of the numbers of lines and of remarks (`!` and `//`); of the same length.
fn instructions(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let number = line.trim_start().trim_start_matches(|c: char| c.is_ascii_digit()).trim_start();
        let body = number.strip_prefix(':').unwrap_or(number);
        let remark = ["!", "//", "--"].iter().any(|mark| body.trim_start().starts_with(mark));
        let blank = if remark { line.trim_end().len() } else { line.len() - body.len() };
        let (hidden, shown) = line.split_at(blank);
        out.extend(hidden.bytes().map(|b| if b == b'\n' { '\n' } else { ' ' }));
        // Names in quotes may hold anything; nothing begins a comment inside of a line, and no line has an end in it.
        out.push_str(&scan::code(shown, "\n"));
    }
    out
}

/// The positions behind a motion's word, `P[..]` and `PR[..]`.
fn points(code: &str, at: Range<usize>) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    let mut from = at.start;
    loop {
        let start = scan::word(code, from, "@").unwrap_or(from);
        let open = scan::word(code, start, "PR[").or(scan::word(code, start, "P[")).filter(|open| *open <= at.end);
        let Some(open) = open else { return found };
        // Names of other code pages may have brackets among their bytes.
        let numbered = code[open..].starts_with(|c: char| c.is_ascii_digit());
        let end =
            if numbered { code[open..at.end].find(']').map(|k| open + k + 1) } else { scan::closed(code, open - 1) };
        let end = end.map_or(at.end, |end| end.min(at.end));
        found.push(scan::trimmed(code, start..end));
        from = end;
    }
}

/// What stands behind `/POS`.
struct Positions<'a> {
    text: &'a str,
    /// Joint targets by the numbers of their positions; of two groups there are two.
    joints: BTreeMap<u64, Vec<usize>>,
    /// Where each position begins.
    listed: BTreeMap<u64, usize>,
    written: Vec<Option<u64>>,
}

impl Positions<'_> {
    fn read<'a>(text: &'a str, targets: &[Target], written: Vec<Option<u64>>) -> Positions<'a> {
        let mut joints: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for (k, number) in targets.iter().enumerate().filter_map(|(k, t)| Some((k, number(&t.name)?))) {
            joints.entry(number).or_default().push(k);
        }
        let mut listed = BTreeMap::new();
        for (at, number) in text.match_indices("P[").filter_map(|(at, _)| Some((at, number(&text[at..])?))) {
            listed.entry(number).or_insert(at);
        }
        Positions { text, joints, listed, written }
    }

    /// The joint target of a point of a motion.
    fn held(&self, point: &str) -> Result<usize, Cause> {
        let number = number(point).ok_or(Cause::Elsewhere)?;
        match self.joints.get(&number).map(Vec::as_slice) {
            Some([_]) if self.written.iter().any(|w| w.is_none_or(|w| w == number)) => Err(Cause::Elsewhere),
            Some([k]) => Ok(*k),
            Some(_) => Err(Cause::Groups),
            None => {
                let body = self.listed.get(&number).and_then(|&at| self.text[at..].split('}').next());
                Err(match body {
                    None => Cause::Elsewhere,
                    // Of a tool that is held in place, RX.
                    Some(body) if scan::words(body).any(|w| ["X", "RX"].contains(&&body[w])) => Cause::Cartesian,
                    Some(_) => Cause::Incomplete,
                })
            }
        }
    }
}

/// The number of `P[12:name]`; none where a register holds it.
fn number(point: &str) -> Option<u64> {
    let rest = point.strip_prefix("P[")?;
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[digits..].starts_with([':', ']', ' ']).then(|| rest[..digits].parse().ok()).flatten()
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion, _: bool) -> Vec<(String, String)> {
    let name = name.to_ascii_uppercase();
    let mut lines = vec!["!DO[1] triggers the cameras ;".to_owned(), "!PR[n] holds stop n's joints ;".to_owned()];
    let mut positions = String::new();
    for (k, stop) in stops.iter().enumerate() {
        lines.push(format!("!{} ;", stop.name));
        for (side, list) in [&stop.approach, &stop.readings].into_iter().enumerate() {
            let number = 2 * k + side + 1;
            lines.push(format!("J P[{number}] {:.0}% FINE ;", motion.speed_percent));
            let parts: Vec<String> =
                scan::axes('J', list.len()).iter().zip(list).map(|(n, v)| format!("{n}= {v} deg")).collect();
            let _ = writeln!(positions, "P[{number}]{{\n   GP1:\n  UF : 0, UT : 1,\n  {}\n}};", parts.join(", "));
        }
        lines.push(format!("WAIT {:.2}(sec) ;", motion.dwell_s));
        lines.push("DO[1]=PULSE,0.1sec ;".to_owned());
        lines.push(format!("PR[{}]=JPOS ;", k + 1));
    }
    let mut text = format!("/PROG  {name}\n/ATTR\nDEFAULT_GROUP = 1,*,*,*,*;\n/MN\n");
    for (k, line) in lines.iter().enumerate() {
        let _ = writeln!(text, "{:4}:{line}", k + 1);
    }
    let _ = write!(text, "/POS\n{positions}/END\n");
    vec![(format!("{name}.ls"), text)]
}
