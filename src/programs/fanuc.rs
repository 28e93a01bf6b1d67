//! Fanuc's listing: positions `J1= .. deg` behind `/POS`.

use std::fmt::Write as _;

use std::ops::Range;

use super::instruction::{Cause, Instruction};
use super::language::{Motion, Target, Written};
use super::scan;

/// Words that begin a motion: joint, linear, circular, circular arc, spline.
const MOTIONS: [char; 5] = ['J', 'L', 'C', 'A', 'S'];
/// Options that move a point from where it was taught.
const OFFSETS: [&str; 4] = ["OFFSET", "TOOL_OFFSET", "VOFFSET", "INC"];

/// Positions in joint coordinates, by their number.
pub(super) fn targets(text: &str, count: usize) -> Vec<Target> {
    let names = scan::axes('J', count);
    let position = |at: usize| {
        let (numbers, _) = scan::labelled(text, at, &names, &["deg", "mm", ","])?;
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
    let mut from = start;
    let statements =
        code[start..].match_indices(';').map(|(k, _)| std::mem::replace(&mut from, start + k + 1)..start + k);
    let motion = |at: Range<usize>| {
        let at = scan::trimmed(&code, at);
        let word = at.start..at.start + 1;
        if !code.get(word.clone())?.starts_with(MOTIONS) {
            return None;
        }
        let points = points(&code, word.end..at.end);
        let last = points.last()?.end;
        let moves_by = points.iter().map(|point| position(text, end, &code[point.clone()], targets));
        let moves_by = moves_by.collect::<Result<Vec<usize>, Cause>>();
        let options = scan::words(&code[last..at.end]).map(|w| code[last + w.start..last + w.end].to_ascii_uppercase());
        let offset = options.into_iter().any(|word| OFFSETS.contains(&word.as_str()));
        let moves_by = moves_by.and_then(|found| if offset { Err(Cause::Offset) } else { Ok(found) });
        Some(Instruction::new(text, word, points[0].start..last, moves_by))
    };
    statements.filter_map(motion).collect()
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
        // Names in quotes may hold anything.
        out.push_str(&scan::code(shown, "\0"));
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
        let Some(end) = open.and_then(|open| scan::closed(code, open - 1)) else { return found };
        found.push(scan::trimmed(code, start..end));
        from = end;
    }
}

/// The joint target of a point of a motion, from the positions behind `/POS`.
fn position(text: &str, positions: usize, point: &str, targets: &[Target]) -> Result<usize, Cause> {
    let number = number(point).ok_or(Cause::Elsewhere)?;
    let mut found = targets.iter().enumerate().filter(|(_, t)| self::number(&t.name) == Some(number));
    match (found.next(), found.next()) {
        (Some((k, _)), None) => Ok(k),
        (Some(_), Some(_)) => Err(Cause::Groups),
        (None, _) => {
            let listed = text[positions..]
                .match_indices("P[")
                .find(|(at, _)| self::number(&text[positions + at..]) == Some(number));
            let body = listed.and_then(|(at, _)| text[positions + at..].split('}').next());
            Err(match body {
                None => Cause::Elsewhere,
                Some(body) if scan::words(body).any(|w| &body[w] == "X") => Cause::Cartesian,
                Some(_) => Cause::Incomplete,
            })
        }
    }
}

/// The number of `P[12:name]`; none where a register holds it.
fn number(point: &str) -> Option<u64> {
    let rest = point.strip_prefix("P[")?;
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    rest[digits..].starts_with([':', ']', ' ']).then(|| rest[..digits].parse().ok()).flatten()
}

pub(super) fn program(name: &str, stops: &[Written], motion: &Motion) -> Vec<(String, String)> {
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
