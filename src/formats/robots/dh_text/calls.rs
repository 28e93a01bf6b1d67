//! Calls of toolboxes that make links, and what words in them say: the convention, that a joint slides, that it counts
//! the other way.

use super::link::{Link, Wrong};
use super::lists::{extent, list};
use super::scan::Scan;
use crate::robot::catalogue::Convention;

/// What a call's name says of the convention.
fn convention(call: &str) -> Option<Convention> {
    match call {
        "RevoluteMDH" | "PrismaticMDH" => Some(Convention::Modified),
        "RevoluteDH" | "PrismaticDH" => Some(Convention::Classic),
        _ => None,
    }
}

impl Scan<'_> {
    /// The link whose call is being read.
    pub(super) fn called(&mut self) -> Option<&mut Link> {
        let depth = self.depth;
        self.links.last_mut().filter(|link| link.call && link.depth == depth)
    }

    /// A word in quotes that is a flag of a link's call; whether it is one.
    pub(super) fn flag(&mut self, word: &str) -> bool {
        let Some(link) = self.called() else { return false };
        match word {
            "modified" => link.convention = Some(Convention::Modified),
            "standard" => link.convention = Some(Convention::Classic),
            "flip" => link.flipped = true,
            "prismatic" => link.slides = true,
            "revolute" => {}
            _ => return false,
        }
        true
    }

    /// What a name with a value says of the link whose call it stands in; whether it is nothing else.
    pub(super) fn of_call(&mut self, word: &str, value: &str) -> bool {
        let text = &value[..extent(value)];
        let number = self.evaluate(text);
        let is_true = text.trim().eq_ignore_ascii_case("true") || number.is_some_and(|v| v.number != 0.0);
        let Some(link) = self.called() else { return false };
        match word {
            "offset" if number.is_some() => link.offset = number,
            "sigma" => link.slides = is_true,
            "flip" => link.flipped = is_true,
            "mdh" if is_true => link.convention = Some(Convention::Modified),
            "mdh" => {}
            // The centre of mass.
            "r" => {}
            _ => return false,
        }
        true
    }

    /// A call that makes a link: its parameters follow by name, or in a list.
    pub(super) fn call(&mut self, word: &str, start: usize) -> Result<(), Wrong> {
        let before = self.text[..start].trim_end_matches(' ');
        if ["class", "def", "function", "import", "classdef"].iter().any(|w| before.ends_with(w)) {
            return Ok(());
        }
        let inside = self.text[self.at..].trim_start_matches(' ')[1..].trim_start();
        let mut link = Link { call: true, ..Link::at(self.line, self.depth + 1) };
        (link.slides, link.convention) = (word.starts_with("Prismatic"), convention(word));
        if inside.starts_with('[') && word == "Link" {
            let numbers = list(inside, &self.known).filter(|list| (4..=6).contains(&list.len()));
            let Some(list) = numbers else {
                return Err((self.line, "`Link([...])` without the numbers theta, d, a, alpha".to_owned()));
            };
            link.slides = list.get(4).is_some_and(|sigma| sigma.number != 0.0);
            link.offset = list.get(5).copied();
            link.values = [Some(list[3]), Some(list[2]), Some(list[0]), Some(list[1])];
        } else {
            let first = &inside[..extent(inside)];
            let named = first.trim().is_empty() || first.contains('=') || first.trim_start().starts_with(['\'', '"']);
            // `Link(i)` names a column.
            let is_index = matches!(first.trim(), "i" | "j" | "n" | "k" | "i-1" | "i+1");
            if is_index && self.text[..start].rsplit('\n').next().is_none_or(|line| !line.contains('=')) {
                return Ok(());
            }
            if !named {
                return Err((self.line, format!("`{word}({}, ...)`: parameters without names", first.trim())));
            }
        }
        self.links.push(link);
        Ok(())
    }
}
