//! From the pictures of two sides to pairs: by equal names, by what is left without the word for the side, by number,
//! by time, or in their order.
//!
//! Out: pairs in natural order of their names, each with a name of its own, and the pictures without a partner. The
//! first way that pairs most of the smaller side is taken, else the one that pairs most; what it leaves over may have
//! another naming that pairs it. Goes wrong: two pictures of a side that would be the same one of a pair.

use std::collections::BTreeMap;

use camino::{Utf8Path, Utf8PathBuf};

use super::matched::{Matched, finished};
use super::names::{Open, Reach, SEPARATORS, natural_order, numbers, stem, tokens};
use super::{PairBy, PairFiles, times};
use crate::imaging::{Error, Result, Side};

/// The ways of telling which pictures belong together, in the order they are tried.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
    EqualNames,
    OpenNames(Reach),
    /// The numbers that are not the same throughout those names of a side that are alike but for them.
    NumbersOfForm,
    /// The numbers that are not the same throughout a side.
    VaryingNumbers,
    /// The last number of each name: taken only where it pairs most of a side, for the seconds of a time agree by
    /// chance.
    LastNumber,
}

/// Of them those that say something of few names, too: those of a second naming.
const OF_FEW: [Way; 3] = [Way::EqualNames, Way::OpenNames(Reach::Words), Way::NumbersOfForm];

const WAYS: [Way; 6] = [
    Way::EqualNames,
    Way::OpenNames(Reach::Words),
    Way::OpenNames(Reach::Letters),
    Way::NumbersOfForm,
    Way::VaryingNumbers,
    Way::LastNumber,
];

impl Way {
    fn by(self) -> PairBy {
        match self {
            Way::EqualNames | Way::OpenNames(_) => PairBy::Name,
            Way::NumbersOfForm | Way::VaryingNumbers | Way::LastNumber => PairBy::Number,
        }
    }

    fn keys(self, stems: &[&str]) -> Vec<Option<String>> {
        match self {
            Way::EqualNames => stems.iter().map(|stem| Some((*stem).to_owned())).collect(),
            Way::OpenNames(reach) => stems.iter().map(|stem| Some(Open::new(stem, reach).key)).collect(),
            Way::NumbersOfForm => numbers_of_form(stems),
            Way::VaryingNumbers => varying_numbers(stems),
            Way::LastNumber => {
                stems.iter().map(|stem| plain_numbers(stem).last().map(|number| (*number).to_owned())).collect()
            }
        }
    }
}

/// Pairs left pictures with right ones. No pair at all is no error here, two pictures for one place are, where nothing
/// else pairs them.
pub fn pair(left: &[Utf8PathBuf], right: &[Utf8PathBuf], by: Option<PairBy>) -> Result<Matched> {
    if by == Some(PairBy::Order) {
        return Ok(in_order([left, right]));
    }
    let smaller = left.len().min(right.len());
    let mut best = Matched { by: PairBy::Name, also: None, pairs: Vec::new(), single: Vec::new() };
    let mut refused = None;
    for way in WAYS.into_iter().filter(|way| by.is_none_or(|by| way.by() == by)) {
        match by_key([left, right], way.by(), &|stems| way.keys(stems)) {
            Ok(matched) => {
                let most = 2 * matched.pairs.len() > smaller;
                if matched.pairs.len() > best.pairs.len() && (most || way != Way::LastNumber) {
                    best = matched;
                }
                if most {
                    break;
                }
            }
            Err(_) if matches!(way, Way::NumbersOfForm | Way::LastNumber) => (),
            Err(e) => refused = refused.or(Some(e)),
        }
    }
    // Of times a few are equal by chance, and a few are near.
    let most = |pairs: usize| 2 * pairs > smaller;
    if by.is_none_or(|by| by == PairBy::Time)
        && !most(best.pairs.len())
        && let Some(by_time) = times::pair([left, right]).filter(|by_time| most(by_time.pairs.len()))
    {
        return Ok(by_time);
    }
    match refused {
        Some(e) if best.pairs.is_empty() => Err(e),
        _ => Ok(with_the_rest(best, left, by)),
    }
}

/// What the naming of most leaves over may have one of its own.
fn with_the_rest(mut matched: Matched, left: &[Utf8PathBuf], by: Option<PairBy>) -> Matched {
    if matched.pairs.is_empty() {
        return matched;
    }
    for way in OF_FEW.into_iter().filter(|way| by.is_none_or(|by| way.by() == by)) {
        let [of_left, of_right]: [Vec<Utf8PathBuf>; 2] =
            matched.single.iter().cloned().partition::<Vec<_>, _>(|path| left.contains(path)).into();
        let Ok(rest) = by_key([&of_left, &of_right], way.by(), &|stems| way.keys(stems)) else { continue };
        if !rest.pairs.is_empty() {
            matched.also = Some(way.by()).filter(|by| *by != matched.by).or(matched.also);
            matched.pairs.extend(rest.pairs);
            matched.single = rest.single;
        }
    }
    finished(matched)
}

/// Pairs by a key that each name has; `None` is a name without one.
pub fn by_key(sides: [&[Utf8PathBuf]; 2], by: PairBy, key: &dyn Fn(&[&str]) -> Vec<Option<String>>) -> Result<Matched> {
    let mut keyed: BTreeMap<(String, String), [Vec<&Utf8PathBuf>; 2]> = BTreeMap::new();
    let mut matched = Matched { by, also: None, pairs: Vec::new(), single: Vec::new() };
    for side in Side::BOTH {
        let paths = sides[side as usize];
        let stems: Vec<&str> = paths.iter().map(|p| stem(p)).collect();
        for (path, key) in paths.iter().zip(key(&stems)) {
            match key {
                Some(key) => keyed.entry((shown(&key), key)).or_default()[side as usize].push(path),
                None => matched.single.push(path.clone()),
            }
        }
    }
    for ((shown, key), [left, right]) in keyed {
        match (left.as_slice(), right.as_slice()) {
            ([left], [right]) => {
                let pair = name(by, &key, left, right);
                matched.pairs.push(PairFiles { pair, left: (*left).clone(), right: (*right).clone() });
            }
            ([], single) | (single, []) => matched.single.extend(single.iter().map(|path| (*path).clone())),
            ([first, second, ..], _) | (_, [first, second, ..]) => {
                return Err(Error::SameName { pair: shown, first: (*first).clone(), second: (*second).clone() });
            }
        }
    }
    Ok(finished(matched))
}

/// A key without the marks of words that were left open, for an order that a person expects.
fn shown(key: &str) -> String {
    key.replace('\0', "").trim_matches(SEPARATORS).to_owned()
}

/// What a pair is called: what a person recognises in both names.
fn name(by: PairBy, key: &str, left: &Utf8Path, right: &Utf8Path) -> String {
    let (left, right) = (stem(left), stem(right));
    match by {
        PairBy::Number => {
            // What is behind the mark tells forms of names apart.
            let numbers = key.split('\0').next().unwrap_or_default();
            match [left, right].map(|stem| written(stem, numbers)) {
                [Some(left), Some(right)] if left == right => left,
                _ => numbers.to_owned(),
            }
        }
        _ if left == right => left.to_owned(),
        _ => {
            let opened = [Reach::Words, Reach::Letters].map(|reach| [Open::new(left, reach), Open::new(right, reach)]);
            let alike = opened.iter().find(|[a, b]| a.key == b.key);
            alike.map_or_else(|| key.to_owned(), |[a, b]| a.without_side(left, b))
        }
    }
}

/// Numbers of a name as they are written in it, with their zeros in front.
fn written(stem: &str, plain_numbers: &str) -> Option<String> {
    let all = numbers(stem);
    let mut before = all.as_slice();
    let mut found = Vec::new();
    // The last ones count.
    for number in plain_numbers.rsplit('_') {
        let at = before.iter().rposition(|written| plain(written) == number)?;
        found.push(before[at]);
        before = &before[..at];
    }
    found.reverse();
    Some(found.join("_"))
}

/// The numbers that are not the same in names that are alike but for their numbers and words for a side, and what these
/// names have in common.
fn numbers_of_form(stems: &[&str]) -> Vec<Option<String>> {
    let form = |stem: &str| {
        let open = Open::new(stem, Reach::Words).key;
        let is_number = |token: &str| token.starts_with(|c: char| c.is_ascii_digit());
        tokens(&open).into_iter().map(|token| if is_number(token) { "#" } else { token }).collect::<String>()
    };
    let mut forms: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (at, stem) in stems.iter().enumerate() {
        forms.entry(form(stem)).or_default().push(at);
    }
    let mut keys = vec![None; stems.len()];
    for (form, members) in forms {
        let alike: Vec<&str> = members.iter().map(|at| stems[*at]).collect();
        // Of one name nobody knows which of its numbers count: all do.
        let of_form =
            if alike.len() > 1 { varying_numbers(&alike) } else { vec![Some(plain_numbers(alike[0]).join("_"))] };
        for (at, numbers) in members.into_iter().zip(of_form) {
            keys[at] = numbers.filter(|numbers| !numbers.is_empty()).map(|numbers| format!("{numbers}\0{form}"));
        }
    }
    keys
}

/// The numbers that are not the same in all names of a side, where all have as many.
fn varying_numbers(stems: &[&str]) -> Vec<Option<String>> {
    let all: Vec<Vec<&str>> = stems.iter().map(|stem| plain_numbers(stem)).collect();
    let width = all.first().map_or(0, Vec::len);
    if width == 0 || all.iter().any(|numbers| numbers.len() != width) {
        return vec![None; stems.len()];
    }
    let varies = |column: &usize| all.iter().any(|numbers| numbers[*column] != all[0][*column]);
    let mut columns: Vec<usize> = (0..width).filter(varies).collect();
    if columns.is_empty() {
        columns.push(width - 1);
    }
    all.iter().map(|numbers| Some(columns.iter().map(|c| numbers[*c]).collect::<Vec<_>>().join("_"))).collect()
}

fn plain_numbers(stem: &str) -> Vec<&str> {
    numbers(stem).into_iter().map(plain).collect()
}

/// A number without zeros in front.
fn plain(number: &str) -> &str {
    let plain = number.trim_start_matches('0');
    if plain.is_empty() { number.get(number.len().saturating_sub(1)..).unwrap_or_default() } else { plain }
}

pub(super) fn in_order(sides: [&[Utf8PathBuf]; 2]) -> Matched {
    let [left, right] = sides.map(|paths| {
        let mut sorted = paths.to_vec();
        sorted.sort_by(|a, b| natural_order(stem(a), stem(b)));
        sorted
    });
    let pairs = if left.len() == right.len() {
        let both = left.into_iter().zip(right);
        both.map(|(left, right)| PairFiles { pair: stem(&left).to_owned(), left, right }).collect()
    } else {
        Vec::new()
    };
    Matched { by: PairBy::Order, also: None, pairs, single: Vec::new() }
}
