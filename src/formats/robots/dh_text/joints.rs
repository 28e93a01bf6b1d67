//! What lists beside the parameters say of the joints: which of them slide, how many have limits and readings, and
//! zero offsets that stand apart.
//!
//! In: code without comments. Out: each with its line and its name. What goes wrong: a list of kinds that is built by a
//! product or a sum; refused with its line where one of them slides.

use std::collections::BTreeSet;

use super::indexed::{element, is_of_readings};
use super::link::{Known, Wrong};
use super::lists::{list, up_to};
use super::scan::sized;
use crate::formats::robots::dh_words::slides;

/// Names of lists that say of each joint whether it slides, in small letters without underscores.
const KINDS: [&str; 10] =
    ["type", "types", "jointtype", "jointtypes", "typejoint", "sigma", "sigmas", "kind", "kinds", "jointkinds"];

/// The least number of joints that lists of limits and readings are heard of.
const FEWEST: usize = 3;

/// What is said of the joints.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Said {
    pub kinds: Option<Kinds>,
    /// Line, name and numbers of lists that hold zero offsets.
    pub offsets: Vec<(u64, String, usize)>,
    /// Line, name and entries of lists of limits.
    pub limits: Vec<(u64, String, usize)>,
    /// The joints' readings by number: their name and how many there are, from the first on.
    pub readings: Option<(String, usize)>,
}

/// Which joints slide, by a list.
#[derive(Debug, Clone, PartialEq)]
pub struct Kinds {
    pub line: u64,
    pub name: String,
    pub slides: Vec<bool>,
    /// Whether words say it, and not 0 and 1, which may be something else.
    pub words: bool,
}

impl Said {
    /// Which of these rows are of joints that slide, by a list; rows at the end that hold still have no entry.
    pub fn slides(&self, rows: usize, still: &[bool]) -> Result<Option<Vec<bool>>, Wrong> {
        let Some(Kinds { line, name, slides, words }) = &self.kinds else { return Ok(None) };
        let count = slides.len();
        let tail = (count..rows).all(|row| still.get(row) == Some(&true));
        match count == rows || count < rows && tail {
            true => Ok(Some(slides.iter().copied().chain(std::iter::repeat(false)).take(rows).collect())),
            // Numbers may be of anything.
            false if !words || rows < 2 => Ok(None),
            false => {
                Err((*line, format!("`{name}` says of {count} joints whether they slide, but {rows} rows are joints")))
            }
        }
    }

    /// How many joints limits or readings speak of where rows of so many joints are one or two more, and how that is
    /// said.
    pub fn fewer(&self, joints: usize) -> (Option<(u64, String)>, Option<String>) {
        let fewer = |count: usize| (FEWEST..joints).contains(&count) && count + 2 >= joints;
        let fits = self.limits.iter().any(|(.., count)| *count == joints);
        let limits = self.limits.iter().find(|(.., count)| fewer(*count)).filter(|_| !fits).map(|(line, name, count)| {
            (*line, format!("`{name}` has {count} entries, but {joints} rows are joints: a row that holds still is none, and which is not said"))
        });
        let readings = self.readings.as_ref().filter(|(_, count)| fewer(*count)).map(|(name, count)| {
            format!("{joints} rows are read as joints, but the code names {count} readings of `{name}` by their number: where a row holds still, take it out and write it into the robot file's [base] or [flange]")
        });
        (limits, readings)
    }
}

impl Said {
    /// What is said of zero offsets in a list of their own beside rows of so many joints.
    pub fn apart(&self, joints: usize) -> impl Iterator<Item = String> {
        self.offsets.iter().filter(move |(.., count)| *count == joints).map(|(line, name, _)| {
            format!("`{name}` of line {line} is LEFT OUT: where these are the joints' zero offsets, add them to theta, or as `offset` to each link")
        })
    }
}

/// Every name of a text that a value follows: line, name, value.
fn values(code: &str) -> impl Iterator<Item = (u64, &str, &str)> {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    let (mut line, mut counted) = (1u64, 0);
    code.match_indices(['=', ':']).filter_map(move |(at, _)| {
        line += code[counted..at].matches('\n').count() as u64;
        counted = at;
        let value = code[at + 1..].trim_start_matches([' ', '\t']);
        let mut before = code[..at].trim_end_matches([' ', '\t']);
        if let Some((name, size)) = before.strip_suffix(']').and_then(|b| b.rsplit_once('['))
            && sized(&code[name.len()..]).is_some()
            && size.chars().all(is_part)
        {
            before = name;
        }
        let before = before.trim_end_matches(['"', '\'']);
        let name = before.rsplit(|c| !is_part(c)).next().unwrap_or("");
        (!name.is_empty() && !value.starts_with(['=', ':'])).then_some((line, name, value))
    })
}

/// A list's inside and what follows its bracket.
fn bracketed(value: &str) -> Option<(&str, &str)> {
    let value = value.trim_start_matches([' ', '\t', '\n']);
    let open = value
        .find(['[', '{', '(', '\n', ';', ','])
        .filter(|open| *open < 30 && value[*open..].starts_with(['[', '{', '(']))?;
    let inside = &value[open + 1..];
    let end = up_to(inside, &[]);
    let behind = inside.get(end + 1..)?;
    // `np.array([...])`, `{{...}}`
    match inside[..end].trim_start().starts_with(['[', '{']) && !inside[..end].contains([':']) {
        true if value[..=open].ends_with('(') => bracketed(&inside[..end]),
        _ => Some((&inside[..end], behind)),
    }
}

/// Which joints slide, and whether words say it; `Err` where it is no plain list.
fn kinds(value: &str) -> Result<Option<(Vec<bool>, bool)>, ()> {
    let letters = value.trim_start().strip_prefix(['"', '\'']).and_then(|rest| rest.split(['"', '\'']).next());
    if let Some(letters) = letters {
        let all: Option<Vec<bool>> =
            letters.chars().map(|c| if c.is_alphabetic() { slides(&c.to_string()) } else { None }).collect();
        return Ok(all.filter(|all| all.len() > 1).map(|all| (all, true)));
    }
    let Some((inside, behind)) = bracketed(value) else { return Ok(None) };
    let word = |word: &str| slides(word.trim().rsplit([':', '.']).next().unwrap_or(""));
    let split: Vec<&str> = match inside.contains([',', ';']) {
        true => inside.trim().trim_end_matches([',', ';']).split([',', ';']).collect(),
        false => inside.split_whitespace().collect(),
    };
    let Some(all) = split.iter().map(|w| word(w)).collect::<Option<Vec<bool>>>() else { return Ok(None) };
    let built = behind.trim_start_matches([' ', ')']).starts_with(['*', '+']);
    let statement = &value[..up_to(value, &['\n', ';'])];
    let slide = |w: &str| slides(w) == Some(true) && !w.starts_with(|c: char| c.is_ascii_digit());
    if built {
        let any = statement.split(|c: char| !c.is_alphanumeric()).any(slide);
        return if any { Err(()) } else { Ok(None) };
    }
    let words = inside.chars().any(char::is_alphabetic);
    Ok((all.len() > 1).then_some((all, words)))
}

/// Entries of a list, or of a list of lists.
fn entries(value: &str) -> Option<usize> {
    let (inside, _) = bracketed(value)?;
    let mut inside = inside.trim();
    // `deg2rad([...])`
    if let Some((within, _)) = Some(inside).filter(|i| i.starts_with(['[', '{'])).and_then(bracketed)
        && within.trim_start().starts_with(['[', '{'])
    {
        inside = within.trim();
    }
    let rows = inside.contains(';');
    let mut count = 0;
    while !inside.is_empty() {
        let end = up_to(inside, if rows { &[';'] } else { &[','] });
        count += usize::from(!inside[..end].trim().is_empty());
        inside = inside.get(end + 1..).unwrap_or("").trim();
    }
    Some(count)
}

/// Whether a list so called has an entry for each joint: limits of positions.
fn is_of_limits(name: &str) -> bool {
    let lower = name.to_lowercase();
    let other =
        ["vel", "acc", "torque", "effort", "speed", "force", "jerk", "work", "pos_"].iter().any(|w| lower.contains(w));
    !other
        && ["joint_limit", "jointlimit", "qlim", "q_lim", "joint_range", "jointrange"].iter().any(|w| lower.contains(w))
}

/// Reads what lists say; `known` is what names stand for.
pub(super) fn said(code: &str, known: &Known) -> Result<Said, Wrong> {
    let mut said = Said::default();
    for (line, name, value) in values(code) {
        let lower = name.to_lowercase();
        if KINDS.contains(&lower.replace('_', "").as_str()) {
            let Ok(found) = kinds(value) else {
                let message = format!(
                    "`{name}` says of joints that they slide in a product or a sum of lists, which is not followed: write the list out"
                );
                return Err((line, message));
            };
            if let Some((slides, words)) = found.filter(|_| said.kinds.is_none()) {
                said.kinds = Some(Kinds { line, name: name.to_owned(), slides, words });
            }
        } else if lower.contains("offset") && !lower.contains("link") && !lower.starts_with("d_") {
            // An element that a row names is in it.
            let unused = || !code.contains(&element(name, 0));
            let numbers = list(value, known).filter(|list| list.iter().any(|v| v.number != 0.0) && unused());
            said.offsets.extend(numbers.map(|list| (line, name.to_owned(), list.len())));
        } else if is_of_limits(name) {
            said.limits.extend(entries(value).map(|count| (line, name.to_owned(), count)));
        }
    }
    said.readings = readings(code);
    Ok(said)
}

/// The readings `q_0`, `q_1`, ... that a code names, all of them from the first on.
fn readings(code: &str) -> Option<(String, usize)> {
    let numbers: BTreeSet<usize> = code
        .split(|c: char| !(c.is_alphanumeric() || c == '_'))
        .filter_map(|word| {
            word.split_once('_').filter(|(name, _)| *name == "q" && is_of_readings(name))?.1.parse().ok()
        })
        .collect();
    let whole = numbers.iter().copied().eq(0..numbers.len());
    (whole && !numbers.is_empty()).then(|| ("q".to_owned(), numbers.len()))
}
