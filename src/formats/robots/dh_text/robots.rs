//! Several robots that one text makes.
//!
//! In: code, and the lines of its links. Out: a refusal that names the robots where the links are of more than one.
//! What goes wrong: robots that are made without a call of a toolbox are not told apart.

use std::collections::BTreeSet;

use super::link::{Wrong, calls};
use super::lists::{extent, up_to};

/// Calls that make a robot of links.
pub(super) const CALLS: [&str; 3] = ["SerialLink", "DHRobot", "super().__init__"];

/// A call that makes a robot.
#[derive(Debug)]
struct Made<'a> {
    /// Its first and last lines.
    lines: (u64, u64),
    name: Option<&'a str>,
    /// What the robot is assigned to.
    variable: &'a str,
    /// What it is made of, where that is one name.
    of: Option<&'a str>,
}

/// Refuses links of more than one robot.
pub(super) fn of_one(code: &str, links: &[u64]) -> Result<(), Wrong> {
    let made = made(code);
    // Links stand in the call, or before it.
    let of_link = |line: &u64| {
        let inside = made.iter().position(|m| (m.lines.0..=m.lines.1).contains(line));
        inside.or_else(|| made.iter().position(|m| m.lines.0 > *line))
    };
    let mut robots: BTreeSet<usize> = links.iter().filter_map(of_link).collect();
    if robots.len() == 1 {
        // One list of links may make two robots; two lists do, unless one is a robot already.
        let mut lists = BTreeSet::new();
        let is_list = |of: &str| !made.iter().any(|m| m.variable == of);
        robots.extend((0..made.len()).filter(|&i| made[i].of.is_some_and(|of| is_list(of) && lists.insert(of))));
        if lists.len() < 2 {
            return Ok(());
        }
    }
    if robots.len() < 2 {
        return Ok(());
    }
    let named = |&i: &usize| {
        let Made { lines, name, variable, .. } = &made[i];
        let name = name.or(Some(*variable).filter(|v| !v.is_empty())).map(|name| format!("{name}, "));
        format!("{}line {}", name.unwrap_or_default(), lines.0)
    };
    let names: Vec<String> = robots.iter().map(named).collect();
    let message = format!(
        "the file makes {} robots ({}), and which is meant is not said: leave the links of one of them in the file",
        names.len(),
        names.join("; ")
    );
    Err((made[robots.iter().nth(1).copied().unwrap_or(0)].lines.0, message))
}

fn made(code: &str) -> Vec<Made<'_>> {
    let mut made = Vec::new();
    for (at, inside) in CALLS.iter().flat_map(|call| calls(code, call)) {
        let before = &code[..at];
        let statement = before.rsplit(['\n', ';']).next().unwrap_or("");
        if ["def ", "class ", "function ", "classdef "].iter().any(|word| statement.contains(word)) {
            continue;
        }
        let end = up_to(inside, &[]);
        let first = inside[..extent(inside)].trim();
        let is_name = |text: &str| !text.is_empty() && text.chars().all(|c| c.is_alphanumeric() || c == '_');
        let lines = |text: &str| text.matches('\n').count() as u64;
        let line = 1 + lines(before);
        let variable = statement.split_once('=').map_or("", |(name, _)| name.trim());
        let of = Some(first).filter(|first| is_name(first));
        made.push(Made { lines: (line, line + lines(&inside[..end])), name: name(&inside[..end]), variable, of });
    }
    made.sort_by_key(|made| made.lines);
    made
}

/// The name that a call gives: `'name', 'left arm'`, `name="left arm"`.
fn name(inside: &str) -> Option<&str> {
    let (at, word) = ["'name'", "\"name\"", "name="].iter().find_map(|word| Some((inside.find(word)?, word)))?;
    let value = inside[at + word.len()..].trim_start_matches([' ', ',', '.', '\n', '=']);
    let quote = value.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    value[1..].split(quote).next()
}
