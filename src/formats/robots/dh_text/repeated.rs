//! Links that a program makes more often than they stand in its text: `[RevoluteDH(a=0.3)] * 3`, a comprehension, a
//! loop.
//!
//! In: code, and the links that its calls make. Out: the code with a list of calls that a whole number multiplies
//! written out, and a refusal with the line of any other. What goes wrong: a function that makes links and is called
//! several times is not seen.

use super::added::is_link;
use super::link::{CALLS, Link, Wrong, calls, makes};
use super::lists::up_to;

/// Links of one list that are written out at the most.
const MOST: usize = 20;

fn refused(code: &str, at: usize, what: &str) -> Wrong {
    let message = format!(
        "{what} makes links more often than they are written, which cannot be followed: write each link by itself"
    );
    (1 + code[..at].matches('\n').count() as u64, message)
}

/// The code with `[...] * 3` of calls that make links written out.
pub(super) fn expanded(code: &str) -> Result<String, Wrong> {
    if !makes(code) {
        return Ok(code.to_owned());
    }
    let mut text = code.to_owned();
    let opens: Vec<usize> = code.match_indices('[').map(|(at, _)| at).collect();
    // From behind, so that what stands before keeps its place.
    for open in opens.into_iter().rev() {
        let inside = &text[open + 1..][..up_to(&text[open + 1..], &[])];
        let end = open + 1 + inside.len() + 1;
        let behind = text.get(end..).unwrap_or("").trim_start_matches(' ');
        let factor =
            behind.strip_prefix('*').filter(|rest| !rest.starts_with('*')).map(|rest| rest.trim_start_matches(' '));
        let before = text[..open].trim_end_matches(' ').strip_suffix('*').map(|before| before.trim_end_matches(' '));
        // `*[...]` takes a list apart.
        let before = before.filter(|before| before.ends_with(|c: char| c.is_alphanumeric() || c == ')'));
        let of_links = makes(inside) || inside.split(',').any(|name| is_link(code, name.trim()));
        if !of_links || factor.is_none() && before.is_none() {
            continue;
        }
        let digits = factor.map_or(0, |rest| rest.bytes().take_while(u8::is_ascii_digit).count());
        let times =
            factor.and_then(|rest| rest[..digits].parse::<usize>().ok()).filter(|times| (1..=MOST).contains(times));
        let rest = factor.map_or("", |rest| &rest[digits..]);
        let alone = !rest.starts_with(|c: char| c.is_alphanumeric() || matches!(c, '_' | '.'))
            && !rest.trim_start_matches(' ').starts_with(['*', '/']);
        match times.filter(|_| alone && before.is_none() && makes(inside) && !inside.contains('\n')) {
            Some(times) => {
                let (all, behind) =
                    (vec![inside.trim_end().trim_end_matches(','); times].join(", "), text.len() - rest.len());
                text.replace_range(open..behind, &format!("[{all}]"));
            }
            None => return Err(refused(code, open, "a product of a list")),
        }
    }
    Ok(text)
}

/// Refuses links that a loop, a comprehension or a copy makes.
pub(super) fn refuse_unwritten(code: &str, links: &[Link]) -> Result<(), Wrong> {
    if !links.iter().any(|link| link.call) {
        return Ok(());
    }
    for call in CALLS {
        for (at, inside) in calls(code, call) {
            let behind = inside.get(up_to(inside, &[]) + 1..).unwrap_or("").trim_start();
            // Behind a whole statement a loop begins.
            let in_brackets = code[..at].matches(['[', '(']).count() > code[..at].matches([']', ')']).count();
            let what = match () {
                () if in_brackets && behind.starts_with("for ") => "a comprehension",
                () if in_loop(code, at) => "a loop",
                () if code[..at].rsplit(['\n', ';']).next().is_some_and(|of| of.contains("repmat(")) => "`repmat`",
                () => continue,
            };
            return Err(refused(code, at, what));
        }
    }
    Ok(())
}

/// Whether a place is in the body of a loop: of Python by the indents, of MATLAB before the `end`.
fn in_loop(code: &str, at: usize) -> bool {
    let opens = |line: &str, words: &[&str]| {
        let line = line.trim_start();
        words.iter().any(|word| line.strip_prefix(word).is_some_and(|rest| rest.starts_with([' ', '('])))
    };
    const LOOPS: [&str; 3] = ["for", "while", "parfor"];
    let start = code[..at].rfind('\n').map_or(0, |end| end + 1);
    if opens(&code[start..at], &LOOPS) {
        return true;
    }
    let indent = |line: &str| line.len() - line.trim_start().len();
    let mut least = indent(&code[start..]).min(at - start);
    for line in code[..start].lines().rev().filter(|line| !line.trim().is_empty()) {
        if indent(line) < least {
            least = indent(line);
            if opens(line, &LOOPS) {
                return true;
            }
        }
    }
    let mut blocks = Vec::new();
    let is_end = |line: &str| {
        line.strip_prefix("end").is_some_and(|rest| !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_'))
    };
    for line in code[..start].lines().map(str::trim) {
        if is_end(line) {
            blocks.pop();
        } else if opens(line, &["for", "while", "parfor", "if", "switch", "try", "function", "classdef"])
            || line == "try"
        {
            let whole = line.trim_end_matches([';', ' ']).ends_with("end");
            blocks.extend((!whole).then(|| opens(line, &LOOPS)));
        }
    }
    // Without an `end` further down, no block of these is open.
    let ends = code[at..].lines().any(|line| is_end(line.trim()));
    ends && blocks.contains(&true)
}
