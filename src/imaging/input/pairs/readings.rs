//! Ways to read what lies in a folder as pictures of two cameras.
//!
//! In: the folders that hold pictures. Out: every reading with at least one pair: two folders, one folder whose names
//! say the side, or a folder for each pair, with what told left from right. Words tell most, then letters, then two
//! names that differ in one number or letter, then nothing but that there are two. [`choose`] takes the best of them,
//! or says that several are as good: a few stray pairs, or results that lie beside the pictures that they were made of,
//! are no rivals.

use std::collections::BTreeMap;

use camino::{Utf8Path, Utf8PathBuf};

use super::listing::{Aside, Folder};
use super::matched::Matched;
use super::matching::{self, by_key};
use super::names::{Open, Reach, SEPARATORS, natural_order, stem, tokens};
use super::{PairBy, PairFiles};
use crate::imaging::{Result, Side};

/// Folders that are compared with each other: among more, no two are the cameras' without being named.
const MOST_COMPARED: usize = 32;

/// Folders of two pictures each from which on they are those of pairs: nobody has so many cameras and two pictures of
/// each.
const PAIRS_AT_LEAST: usize = 5;

/// Words by which a folder says that its pictures were made of others.
const MADE: [&str; 10] = [
    "rectified",
    "undistorted",
    "corners",
    "output",
    "outputs",
    "result",
    "results",
    "overlay",
    "overlays",
    "disparity",
];

/// What tells left from right, the strongest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Told {
    /// The order in which two folders were named.
    Given,
    /// Words for the side.
    Words,
    /// Letters at the ends of words.
    Letters,
    /// Nothing; the names of both differ in one number or letter.
    Alike,
    /// Nothing; there are two.
    Two,
}

/// What is told by names read so far, the stronger first.
const BY_NAMES: [(Reach, Told); 2] = [(Reach::Words, Told::Words), (Reach::Letters, Told::Letters)];

/// One way to read a folder.
#[derive(Debug, Clone)]
pub struct Reading {
    /// What tells left from right.
    pub told: Told,
    /// Levels below the folder that was named.
    pub depth: usize,
    /// The folders, left first; one where names say the side.
    pub places: Vec<Utf8PathBuf>,
    /// Pictures of each side.
    pub sides: [Vec<Utf8PathBuf>; 2],
    pub matched: Matched,
    /// Pictures whose names tell no side.
    pub sideless: usize,
    /// Files of these folders that are passed over.
    pub aside: Aside,
}

impl Reading {
    /// How many pairs it finds.
    pub fn count(&self) -> usize {
        self.matched.pairs.len()
    }

    /// Whether these are some pairs beside another reading: too few, where that one has enough and its names tell the
    /// sides, or tell as much. What is then left out lies in a folder of its own; the same pictures read in another way
    /// stay a rival.
    fn is_stray_beside(&self, other: &Reading, needed: usize) -> bool {
        let apart = self.places.iter().any(|place| !other.places.contains(place));
        let told = other.told <= self.told.max(Told::Letters);
        self.count() < needed && other.count() >= needed && told && apart
    }

    /// Whether these are names of a folder that holds `left/` and `right/` as well, with no fewer pairs: those are what
    /// is read of it.
    fn is_beside_sides(&self, other: &Reading) -> bool {
        let ([folder], [left, right]) = (self.places.as_slice(), other.places.as_slice()) else { return false };
        let is = |side: &Utf8Path, word: &str| {
            side.parent() == Some(folder.as_path())
                && side.file_name().is_some_and(|name| name.eq_ignore_ascii_case(word))
        };
        is(left, "left") && is(right, "right") && other.count() >= self.count()
    }

    /// Whether these pictures were made of those of another reading: their folders say so, and they have their names.
    fn is_made_of(&self, other: &Reading) -> bool {
        let made = |path: &str| tokens(path).iter().any(|word| MADE.iter().any(|made| made.eq_ignore_ascii_case(word)));
        let of = |place: &Utf8PathBuf| {
            let mut differing = other.places.iter().map(|raw| apart(place.as_str(), raw.as_str()));
            differing.all(|[mine, theirs]| made(mine) && !made(theirs))
        };
        let named = |pair: &PairFiles| other.matched.pairs.iter().any(|raw| raw.pair == pair.pair);
        other.told <= self.told && self.places.iter().all(of) && self.matched.pairs.iter().all(named)
    }
}

/// Two folders, left first.
pub fn two_folders(left: &Folder, right: &Folder, told: Told, by: Option<PairBy>) -> Result<Reading> {
    Ok(Reading {
        told,
        depth: left.depth,
        places: vec![left.path.clone(), right.path.clone()],
        sides: [left.pictures.clone(), right.pictures.clone()],
        matched: matching::pair(&left.pictures, &right.pictures, by)?,
        sideless: 0,
        aside: [left.aside, right.aside].into_iter().sum(),
    })
}

/// All readings of these folders, those without a pair as well.
pub fn all(folders: &[Folder], by: Option<PairBy>) -> Vec<Result<Reading>> {
    let mut readings: Vec<Result<Reading>> = folders.iter().flat_map(|folder| by_names(folder, by)).collect();
    let below: Vec<&Folder> = folders.iter().filter(|folder| folder.depth > 0).collect();
    readings.extend(by_folders(&below).map(Ok));
    if below.len() > MOST_COMPARED {
        return readings;
    }
    for (k, first) in below.iter().enumerate() {
        for second in below[k + 1..].iter().filter(|second| second.depth == first.depth) {
            let alone = below.iter().filter(|folder| folder.depth == first.depth).count() == 2;
            if let Some((told, side)) = tell(first, second, alone) {
                let (left, right) = if side == Side::Left { (first, second) } else { (second, first) };
                readings.push(two_folders(left, right, told, by));
            }
        }
    }
    readings
}

/// A folder for each pair: two pictures in each of them, called alike in all and by words for the side; of many also by
/// two numbers or letters.
fn by_folders(below: &[&Folder]) -> Option<Reading> {
    let (first, rest) = below.split_first().filter(|(_, rest)| !rest.is_empty())?;
    let names = |folder: &Folder| -> Option<[String; 2]> {
        let [a, b] = folder.pictures.as_slice() else { return None };
        Some([stem(a).to_owned(), stem(b).to_owned()])
    };
    let called = names(first)?;
    let alike = |folder: &&&Folder| folder.depth == first.depth && names(folder).is_some_and(|names| names == called);
    if rest.iter().filter(alike).count() < rest.len() {
        return None;
    }
    let by_words = BY_NAMES.into_iter().find_map(|(reach, told)| {
        let [a, b] = [&called[0], &called[1]].map(|name| Open::new(name, reach));
        a.side_beside(&b).map(|side| (told, side))
    });
    let many = below.len() >= PAIRS_AT_LEAST && differ_in_one(&called[0], &called[1]);
    let first_is_left = natural_order(&called[0], &called[1]).is_lt();
    let counted = (Told::Alike, if first_is_left { Side::Left } else { Side::Right });
    let (told, side) = by_words.or(many.then_some(counted))?;
    let (left, right) = if side == Side::Left { (0, 1) } else { (1, 0) };
    let picture = |at: usize| below.iter().map(move |folder| folder.pictures[at].clone());
    let pairs = below.iter().zip(picture(left).zip(picture(right)));
    let pairs = pairs.map(|(folder, (left, right))| PairFiles { pair: folder.below.clone(), left, right }).collect();
    Some(Reading {
        told,
        depth: first.depth - 1,
        places: below.iter().map(|folder| folder.path.clone()).collect(),
        sides: [picture(left).collect(), picture(right).collect()],
        matched: Matched { by: PairBy::Name, also: None, pairs, single: Vec::new() },
        sideless: 0,
        aside: below.iter().map(|folder| folder.aside).sum(),
    })
}

/// What tells the sides of two folders, and the side of the first; `None` where they are not the two sides of
/// something.
fn tell(first: &Folder, second: &Folder, alone: bool) -> Option<(Told, Side)> {
    for (reach, told) in BY_NAMES {
        let open = |folder: &Folder| Open::new(&folder.below, reach);
        if let Some(side) = open(first).side_beside(&open(second)) {
            return Some((told, side));
        }
    }
    let apart = apart(&first.below, &second.below);
    let by_path = apart.map(|path| Open::new(path, Reach::Words).side());
    let inside = [first, second].map(common_side);
    match (by_path, inside) {
        ([a, b], [Some(side), Some(other)]) if side != other && a.is_none() && b.is_none() => {
            return Some((Told::Words, side));
        }
        // A left one without its right one, or two left ones: nothing to guess at.
        ([Some(_), _] | [_, Some(_)], _) | (_, [Some(_), _] | [_, Some(_)]) => return None,
        _ => (),
    }
    match (differ_in_one(&first.below, &second.below), alone) {
        (true, _) => Some((Told::Alike, Side::Left)),
        (false, true) => Some((Told::Two, Side::Left)),
        (false, false) => None,
    }
}

/// Whether two names differ in one number or in one letter alone.
fn differ_in_one(a: &str, b: &str) -> bool {
    let (a, b) = (tokens(a), tokens(b));
    let differing: Vec<(&str, &str)> = a.iter().copied().zip(b.iter().copied()).filter(|(a, b)| a != b).collect();
    let [(x, y)] = differing[..] else { return false };
    let number = |s: &str| s.chars().all(|c| c.is_ascii_digit());
    let letter = |s: &str| s.chars().count() == 1 && s.chars().all(char::is_alphabetic);
    a.len() == b.len() && (number(x) && number(y) || letter(x) && letter(y))
}

/// Two paths from the first folder on in which they differ.
fn apart<'a>(a: &'a str, b: &'a str) -> [&'a str; 2] {
    let same = a.split('/').zip(b.split('/')).take_while(|(a, b)| a == b).map(|(a, _)| a.len() + 1).sum::<usize>();
    [a, b].map(|path| path.get(same..).unwrap_or_default())
}

/// The side that all names of a folder tell.
fn common_side(folder: &Folder) -> Option<Side> {
    let mut sides = folder.pictures.iter().map(|path| Open::new(stem(path), Reach::Words).side());
    let first = sides.next()??;
    sides.all(|side| side == Some(first)).then_some(first)
}

/// The readings of one folder by its names: words for the side where there are some, else each place at which all names
/// have one of two numbers or words.
fn by_names(folder: &Folder, by: Option<PairBy>) -> Vec<Result<Reading>> {
    for (reach, told) in BY_NAMES {
        let sides = told_by_names(folder, reach);
        if sides.iter().any(Vec::is_empty) {
            continue;
        }
        let reading = matching::pair(&sides[0], &sides[1], by).map(|matched| in_one(folder, told, sides, matched));
        // Letters at the ends of words are no words unless they pair most pictures.
        let counts = |r: &Reading| told == Told::Words || 4 * r.count() > folder.pictures.len();
        if reading.as_ref().map_or(told == Told::Words, counts) {
            return vec![reading];
        }
    }
    by_two_values(folder, by)
}

fn in_one(folder: &Folder, told: Told, sides: [Vec<Utf8PathBuf>; 2], matched: Matched) -> Reading {
    let sideless = folder.pictures.len() - sides[0].len() - sides[1].len();
    let places = vec![folder.path.clone()];
    Reading { told, depth: folder.depth, places, sides, matched, sideless, aside: folder.aside }
}

/// Pictures whose names say left, and those whose names say right.
fn told_by_names(folder: &Folder, reach: Reach) -> [Vec<Utf8PathBuf>; 2] {
    let opened: Vec<(Open, &Utf8PathBuf)> =
        folder.pictures.iter().map(|path| (Open::new(stem(path), reach), path)).collect();
    let mut by_key: BTreeMap<&str, Vec<&Open>> = BTreeMap::new();
    for (open, _) in &opened {
        by_key.entry(&open.key).or_default().push(open);
    }
    let mut sides = [Vec::new(), Vec::new()];
    for (open, path) in &opened {
        let beside = by_key.get(open.key.as_str()).into_iter().flatten().find_map(|other| open.side_beside(other));
        if let Some(side) = beside.or_else(|| open.side()) {
            sides[side as usize].push((*path).clone());
        }
    }
    sides
}

/// Readings of names that have one of two numbers or words at some place, each with the same rest: `camera0_1.png` and
/// `camera1_1.png`.
///
/// Two pairs at least, and most of the folder's pictures in pairs: any two names differ somewhere.
fn by_two_values(folder: &Folder, by: Option<PairBy>) -> Vec<Result<Reading>> {
    let mut by_shape: BTreeMap<usize, Vec<(Vec<&str>, &Utf8PathBuf)>> = BTreeMap::new();
    for path in &folder.pictures {
        let tokens = tokens(stem(path));
        by_shape.entry(tokens.len()).or_default().push((tokens, path));
    }
    let Some((width, named)) = by_shape.into_iter().max_by_key(|(_, named)| named.len()) else { return Vec::new() };
    let split = |place: usize| {
        let mut values: BTreeMap<&str, Vec<Utf8PathBuf>> = BTreeMap::new();
        for (tokens, path) in &named {
            values.entry(tokens[place]).or_default().push((*path).clone());
        }
        let mut values: Vec<(&str, Vec<Utf8PathBuf>)> = values.into_iter().collect();
        values.sort_by(|(a, _), (b, _)| natural_order(a, b));
        let sides: [Vec<Utf8PathBuf>; 2] =
            values.into_iter().map(|(_, side)| side).collect::<Vec<_>>().try_into().ok()?;
        let rest = |stems: &[&str]| stems.iter().map(|stem| Some(without(&tokens(stem), place))).collect();
        let matched = match by {
            None | Some(PairBy::Name) => by_key([&sides[0], &sides[1]], PairBy::Name, &rest),
            by => matching::pair(&sides[0], &sides[1], by),
        };
        let reading = in_one(folder, Told::Alike, sides, matched.ok()?);
        (reading.count() > 1 && 4 * reading.count() > folder.pictures.len()).then_some(Ok(reading))
    };
    (0..width).filter_map(split).collect()
}

/// A name without the token at a place, and with one sign where two then meet.
fn without(tokens: &[&str], place: usize) -> String {
    let (before, after) = (tokens[..place].concat(), tokens[place + 1..].concat());
    let met = before.is_empty() || before.ends_with(SEPARATORS);
    before + if met { after.trim_start_matches(SEPARATORS) } else { &after }
}

/// The best reading, or all that are as good: none of them is to be preferred without being told. `needed` is how many
/// pairs are of use.
pub fn choose(mut readings: Vec<Reading>, needed: usize) -> Vec<Reading> {
    readings.retain(|reading| reading.count() > 0);
    let all = readings.clone();
    let gives_way =
        |r: &Reading, to: &Reading| r.is_stray_beside(to, needed) || r.is_beside_sides(to) || r.is_made_of(to);
    readings.retain(|r| !all.iter().any(|other| gives_way(r, other)));
    let Some(best) = readings.iter().min_by_key(|r| (r.told, r.depth)).cloned() else { return Vec::new() };
    readings.retain(|r| {
        // Names in the folder itself were always read, whatever lay below.
        let itself = best.depth == 0 && r.depth > 0;
        let equal = r.told == best.told && (!itself || r.count() > best.count());
        let nearer = r.told > best.told && r.depth < best.depth && r.count() >= best.count();
        // Too few whose names tell the sides, and enough whose names do not.
        let enough = best.count() < needed && r.count() >= needed;
        equal || nearer || enough
    });
    readings.sort_by_key(|r| (r.told, r.depth));
    readings
}
