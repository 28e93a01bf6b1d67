//! Links that a program adds to its list without making them: those of another robot, `links.extend(puma.links)`, or of
//! a loop.
//!
//! In: code, and the links that its calls make. Out: a refusal with the line of what cannot be followed. What goes
//! wrong: what the text does between is not run, so that a list which is cut short afterwards is not seen.

use super::link::{Link, Wrong, makes};
use super::lists::up_to;
use super::robots;

/// Words between a list's name and what is added to it.
const ADDS: [&str; 4] = [".extend(", ".append(", ".insert(", "+="];

/// Refuses links that no call of the text makes, and a call that makes more than one.
pub(super) fn none(code: &str, links: &[Link]) -> Result<(), Wrong> {
    if !links.iter().any(|link| link.call) {
        return Ok(());
    }
    let line_of = |at: usize| 1 + code[..at].matches('\n').count() as u64;
    let mut adds: Vec<(usize, &str)> = ADDS.iter().flat_map(|word| code.match_indices(word)).collect();
    adds.sort_unstable();
    for (at, word) in adds {
        let list = code[..at].trim_end().rsplit(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or("");
        let behind = &code[at + word.len()..];
        let added = &behind[..up_to(behind, &['\n'])];
        let of_links =
            is_link(code, list) || added.contains(".links") || code.contains(&format!("{list}.append(Revolute"));
        if of_links
            && !makes(added)
            && !added.split(',').all(|name| is_link(code, name.trim().trim_matches(['[', ']'])))
        {
            let statement = match word.ends_with('(') {
                true => format!("{list}{word}{added})"),
                false => format!("{list} {word} {}", added.trim()),
            };
            let message = format!(
                "`{statement}`: links are added that the file does not make, which cannot be followed: write their parameters in their place"
            );
            return Err((line_of(at), message));
        }
    }
    robot_of_another(code).map_or(Ok(()), |(at, of)| {
        let message = format!("`{of}`: the robot has links of another one, which cannot be followed: write their parameters in their place");
        Err((line_of(at), message))
    })
}

/// Whether a name is set to a link.
pub(super) fn is_link(code: &str, name: &str) -> bool {
    assigned(code, name).any(makes)
}

/// What is assigned to a name, each to the end of its statement.
fn assigned<'a>(code: &'a str, name: &'a str) -> impl Iterator<Item = &'a str> {
    code.match_indices(name).filter(move |_| !name.is_empty()).filter_map(move |(at, name)| {
        let alone = !code[..at].ends_with(|c: char| c.is_alphanumeric() || matches!(c, '_' | '.'));
        let behind = code[at + name.len()..].trim_start_matches(' ');
        let value = behind.strip_prefix('=').filter(|value| !value.starts_with('='))?;
        alone.then(|| &value[..up_to(value, &['\n', ';'])])
    })
}

/// A call that makes a robot of another one's links, and what it takes of it.
fn robot_of_another(code: &str) -> Option<(usize, &str)> {
    robots::CALLS.iter().find_map(|call| {
        code.match_indices(call).find_map(|(at, _)| {
            let inside = code[at + call.len()..].strip_prefix('(')?;
            let first = inside[..up_to(inside, &[','])].trim();
            first.contains(".links").then_some((at, first))
        })
    })
}
