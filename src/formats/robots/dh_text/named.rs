//! What a link and the list that it stands in are called, and which links hold still by their names.
//!
//! In: code, and where a link begins. Out: `tool_frame` of `"tool_frame": {a: 0, ...}`, of a block of YAML, or of a key
//! `name` beside the parameters; the place and the name of the list around it. What goes wrong: names of joints that
//! turn and are those of a tool.

use std::collections::BTreeMap;

use super::link::{Link, Wrong};

/// Words in the name of what stands behind the last joint.
const TOOLS: [&str; 9] = ["tool", "tool0", "flange", "ee", "eef", "tcp", "effector", "endeffector", "tooltip"];

/// Words in the name of what stands before the first, where joints have names of their own.
const BASES: [&str; 3] = ["base", "world", "mount"];

/// Keys beside the parameters that name a link.
const KEYS: [&str; 6] = ["name", "link", "joint", "frame", "link_name", "joint_name"];

fn is_part(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The last bracket that is open at the end of a text.
fn opening(text: &str) -> Option<usize> {
    let mut closed = 0usize;
    for (at, c) in text.char_indices().rev() {
        match c {
            ')' | ']' | '}' => closed += 1,
            '(' | '[' | '{' if closed == 0 => return Some(at),
            '(' | '[' | '{' => closed -= 1,
            _ => {}
        }
    }
    None
}

/// The key or the name that the value which begins at a text's end belongs to; a call's own name is none.
fn key(before: &str, bracket: &str) -> Option<String> {
    let before = match bracket.starts_with('(') {
        true => before.trim_end_matches(|c| is_part(c) || c == '.'),
        false => before,
    };
    let before = before.trim_end().strip_suffix([':', '='])?.trim_end().trim_end_matches(['"', '\'']);
    let name = before.rsplit(|c: char| !(is_part(c) || matches!(c, '-' | ' '))).next().unwrap_or("").trim();
    (!name.is_empty()).then(|| name.to_owned())
}

/// What a key beside the parameters says.
fn beside(inside: &str) -> Option<String> {
    KEYS.iter().find_map(|key| {
        inside.match_indices(key).find_map(|(at, _)| {
            let alone = !inside[..at].ends_with(is_part);
            let behind = inside[at + key.len()..].trim_start_matches(['"', '\'', ' ']).strip_prefix([':', '='])?;
            let value = behind.trim_start().trim_start_matches(['"', '\'']);
            let value = value.split(['"', '\'', ',', '\n', '}', ')']).next().unwrap_or("").trim();
            (alone && !value.is_empty()).then(|| value.to_owned())
        })
    })
}

/// The name of a link outside of brackets: the key above its block, or a key of its item in a list.
fn of_block(code: &str, at: usize) -> Option<String> {
    let start = code[..at].rfind('\n').map_or(0, |end| end + 1);
    let indent = |line: &str| line.len() - line.trim_start().len();
    let is_item = |line: &str| line.trim_start().starts_with("- ");
    let own = at - start;
    let mut first = start;
    if !is_item(&code[start..]) {
        if own == 0 {
            return None;
        }
        for line in code[..start].lines().rev() {
            first -= line.len() + 1;
            if line.trim().is_empty() || indent(line) >= own {
                continue;
            }
            if !is_item(line) {
                return line.trim().strip_suffix(':').map(|name| name.trim_matches(['"', '\'']).to_owned());
            }
            break;
        }
    }
    let item = &code[first..];
    let end =
        item.match_indices('\n').map(|(at, _)| at + 1).find(|&at| is_item(&item[at..]) || indent(&item[at..]) == 0);
    beside(&item[..end.unwrap_or(item.len())])
}

/// The name of the link whose first parameter stands there, and the list around it: its place and its name.
pub(super) fn of(code: &str, at: usize, depth: usize) -> (Option<String>, Option<(usize, String)>) {
    if depth == 0 {
        return (of_block(code, at), None);
    }
    let Some(open) = opening(&code[..at]) else { return (None, None) };
    let inside = &code[open + 1..];
    let inside = &inside[..super::lists::up_to(inside, &[])];
    let name = key(&code[..open], &code[open..]).or_else(|| beside(inside));
    let around = opening(&code[..open]).map(|list| (list, key(&code[..list], &code[list..]).unwrap_or_default()));
    (name, around)
}

fn has(name: &Option<String>, words: &[&str]) -> bool {
    let lower = name.as_deref().unwrap_or("").to_lowercase();
    lower.split(|c: char| !c.is_alphanumeric()).any(|word| words.contains(&word))
}

/// Which links hold still: those at the ends whose names say so, unless a word or a variable beside says that they
/// move.
pub(super) fn still(links: &[Link]) -> Vec<bool> {
    let moves = |link: &Link| link.call || link.kind || link.values[2].is_some_and(|v| v.variable);
    let counted = |name: &Option<String>| name.as_deref().is_some_and(|n| n.ends_with(|c: char| c.is_ascii_digit()));
    let is_tool = |link: &&Link| !moves(link) && has(&link.name, &TOOLS);
    let tools = links.iter().rev().take_while(is_tool).count();
    let others = &links[..links.len() - tools];
    let bases = match others {
        [first, rest @ ..] if !moves(first) && has(&first.name, &BASES) && rest.len() > 1 => {
            rest.iter().all(|link| counted(&link.name) || link.of.is_some() && link.of != first.of)
        }
        _ => false,
    };
    let all = links.len();
    let by_name = |at: usize| others.len() > 1 && (at >= all - tools || at == 0 && bases);
    (0..all).map(|at| links[at].fixed || by_name(at)).collect()
}

/// What is said of links that hold still by their names.
pub(super) fn said(links: &[Link]) -> Vec<String> {
    let still = still(links);
    let named = links.iter().zip(&still).filter(|(link, still)| **still && !link.fixed);
    let said = |(link, _): (&Link, &bool)| {
        let name = link.name.as_deref().unwrap_or("");
        format!("`{name}` of line {} is taken for what holds still, by its name, and is no joint", link.line)
    };
    named.map(said).collect()
}

/// Refuses links of several lists of them.
pub(super) fn of_one_list(links: &[Link]) -> Result<(), Wrong> {
    let mut lists: BTreeMap<usize, (u64, &str, usize)> = BTreeMap::new();
    let still = still(links);
    // A lone key is one of something else.
    let is_one = |(link, still): &(&Link, bool)| !link.call && !still && link.values.iter().flatten().count() > 1;
    for (link, _) in links.iter().zip(still).filter(is_one) {
        if let Some((at, name)) = &link.of {
            lists.entry(*at).or_insert((link.line, name, 0)).2 += 1;
        }
    }
    let several: Vec<&(u64, &str, usize)> = lists.values().filter(|(.., count)| *count > 1).collect();
    let [_, second, ..] = several[..] else { return Ok(()) };
    let named = |(line, name, count): &&(u64, &str, usize)| {
        let name = if name.is_empty() { String::new() } else { format!("{name}, ") };
        format!("{name}{count} links from line {line}")
    };
    let names: Vec<String> = several.iter().map(named).collect();
    let message = format!(
        "the file has {} lists of links ({}), and which is meant is not said: leave one of them in the file",
        names.len(),
        names.join("; ")
    );
    Err((second.0, message))
}
