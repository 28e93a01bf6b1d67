//! What is said of a folder that was read, or could not be: what was found, and the call that would do.

use camino::{Utf8Path, Utf8PathBuf};

use super::listing::{Aside, Folder, list};
use super::matched::Matched;
use super::names::{Open, Reach, stem};
use super::readings::{Reading, Told};
use super::{Halves, PairBy, Pairing, Source};
use crate::diagnostic::count;
use crate::imaging::error::of_video;
use crate::imaging::{Error, Side, image};

/// Folders, and readings, that a message shows at most.
const MOST_SHOWN: usize = 8;

/// A command to type, with flags behind the places where there are any.
fn call(source: &Source<'_>, places: &[&Utf8Path], flags: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    let quote = |place: &Utf8Path| if place.as_str().chars().all(plain) { "" } else { "'" };
    let places: String = places.iter().map(|place| format!(" {0}{place}{0}", quote(place))).collect();
    let flags = if flags.is_empty() { String::new() } else { format!(" {flags}") };
    format!("`stereocal {}{places}{flags}`", source.command)
}

/// What was taken: `31 pairs by number: left stereoLeft/imageL*.png, right stereoRight/imageR*.png`.
pub fn taken(reading: &Reading, top: &Utf8Path) -> String {
    // Two folders that were named are said as they were named.
    let top = if reading.told == Told::Given { Utf8Path::new("") } else { top };
    let files = |side: usize| {
        let paired = reading.matched.pairs.iter().map(|pair| if side == 0 { &pair.left } else { &pair.right });
        pattern(&paired.map(|path| below(path, top)).collect::<Vec<_>>())
    };
    let unsaid = match reading.told {
        Told::Given | Told::Words | Told::Letters if names_disagree(reading) => {
            "; the names of the pictures say it the other way round"
        }
        Told::Given | Told::Words | Told::Letters => "",
        Told::Alike | Told::Two => "; no word tells left from right: the first by name is left",
    };
    let Matched { by, also, .. } = &reading.matched;
    let by = by.word().to_owned() + &also.map_or_else(String::new, |also| format!(" and {}", also.word()));
    format!("{} by {}: left {}, right {}{unsaid}", count(reading.count(), "pair"), by, files(0), files(1))
}

/// Whether the left pictures are all called right ones, and the right pictures left ones.
fn names_disagree(reading: &Reading) -> bool {
    let all = |side: Side, paths: &[Utf8PathBuf]| {
        paths.iter().all(|path| Open::new(stem(path), Reach::Words).side() == Some(side.other()))
    };
    Side::BOTH.into_iter().all(|side| all(side, &reading.sides[side as usize]))
}

fn below<'a>(path: &'a Utf8Path, top: &Utf8Path) -> &'a str {
    path.strip_prefix(top).unwrap_or(path).as_str()
}

/// What names have in common, with a star in place of the rest; numbers are not cut.
fn pattern(names: &[&str]) -> String {
    let (Some(first), true) = (names.first(), names.len() > 1) else { return names.concat() };
    let digit = |c: char| c.is_ascii_digit();
    let start = &first[..names.iter().map(|name| common(first, name)).min().unwrap_or(0)];
    let start = start.trim_end_matches(digit);
    let backward = |name: &&str| name[start.len()..].chars().rev().collect::<String>();
    let reversed: Vec<String> = names.iter().map(backward).collect();
    let end = &reversed[0][..reversed.iter().map(|name| common(&reversed[0], name)).min().unwrap_or(0)];
    let end: String = end.trim_end_matches(digit).chars().rev().collect();
    let end = if end.contains('.') { end.as_str() } else { "" };
    format!("{start}*{end}")
}

/// How many bytes two names have in common at their start.
fn common(a: &str, b: &str) -> usize {
    let differing = a.char_indices().zip(b.chars()).find(|((_, x), y)| x != y);
    differing.map_or(a.len().min(b.len()), |((at, _), _)| at)
}

/// Folders with pictures that were not taken.
pub fn not_taken(reading: &Reading, folders: &[Folder]) -> Option<String> {
    let others = folders.iter().filter(|folder| !folder.pictures.is_empty() && !reading.places.contains(&folder.path));
    let shown: Vec<String> = others.map(|f| format!("{} ({})", name(f), count(f.pictures.len(), "picture"))).collect();
    (!shown.is_empty()).then(|| format!("not taken: {}", listed(&shown, MOST_SHOWN)))
}

/// The first so many, and whether there are more.
fn listed<S: AsRef<str>>(all: &[S], most: usize) -> String {
    let first: Vec<&str> = all.iter().take(most).map(AsRef::as_ref).collect();
    format!("{}{}", first.join(", "), if all.len() > most { ", ..." } else { "" })
}

/// What files are called.
fn called(paths: &[Utf8PathBuf]) -> Vec<&str> {
    paths.iter().filter_map(|path| path.file_name()).collect()
}

fn name(folder: &Folder) -> String {
    if folder.below.is_empty() { "./".to_owned() } else { format!("{}/", folder.below) }
}

/// The folders, how many pictures each holds, and two of their names.
fn found(holding: &[&Folder]) -> String {
    let mut text = String::new();
    for folder in holding.iter().take(MOST_SHOWN) {
        let pictures = count(folder.pictures.len(), "picture");
        text.push_str(&format!("\n  {}: {pictures} ({})", name(folder), listed(&called(&folder.pictures), 2)));
    }
    if holding.len() > MOST_SHOWN {
        text.push_str(&format!("\n  and {} more folders with pictures", holding.len() - MOST_SHOWN));
    }
    text
}

/// Several readings are as good. `is_read_alone` says whether the folders of one, when they are named, are read in the
/// same way.
pub fn several(source: &Source<'_>, readings: &[Reading], is_read_alone: impl Fn(&Reading) -> bool) -> Error {
    let flags = source.by.map_or_else(String::new, |by| format!("--pair-by {}", by.word()));
    let mut statement = format!("these pictures can be read in {} ways", readings.len());
    let mut calls = Vec::new();
    for reading in readings.iter().take(MOST_SHOWN) {
        statement.push_str(&format!("\n  {}", taken(reading, source.images)));
        if is_read_alone(reading) {
            let places: Vec<&Utf8Path> = reading.places.iter().map(Utf8PathBuf::as_path).collect();
            calls.push(call(source, &places, &flags));
        }
    }
    if readings.len() > MOST_SHOWN {
        statement.push_str(&format!("\n  and {} more", readings.len() - MOST_SHOWN));
    }
    if calls.len() < readings.len().min(MOST_SHOWN) {
        calls.push(format!("move each camera's pictures into a folder of its own: {}", by_hand(source)));
    }
    Error::Unpaired { path: source.images.to_owned(), statement, hint: calls.join(", or ") }
}

fn by_hand(source: &Source<'_>) -> String {
    format!("`stereocal {} LEFT RIGHT`", source.command)
}

/// No reading finds a pair. `readings` are those that were tried.
pub fn none(source: &Source<'_>, folders: &[Folder], readings: &[Reading]) -> Error {
    let holding: Vec<&Folder> = folders.iter().filter(|folder| !folder.pictures.is_empty()).collect();
    let pictures: usize = holding.iter().map(|folder| folder.pictures.len()).sum();
    let best = readings.iter().min_by_key(|r| (r.told, r.depth));
    let (statement, hint) = match best {
        _ if pictures == 0 => without_pictures(source, folders),
        Some(reading) => unmatched(source, reading),
        None => match (one_side(folders), empty_side(folders)) {
            (_, Some((empty, side))) => (
                format!("{}/ holds no pictures", empty.file_name().unwrap_or(empty.as_str())),
                format!(
                    "the {} camera's pictures go there; or name the folders of both: {}",
                    side.name(),
                    by_hand(source)
                ),
            ),
            (Some((have, lacks)), None) => (
                format!("there is {have}/ but no {lacks}/"),
                match left_first(&holding).as_slice() {
                    [a, b] => call(source, &[&a.path, &b.path], ""),
                    _ => by_hand(source),
                },
            ),
            (None, None) => untold(source, &holding, pictures),
        },
    };
    let statement = statement + &found(&holding);
    Error::Unpaired { path: source.images.to_owned(), statement, hint }
}

/// No picture that can be read; perhaps a video, or pictures in another format.
fn without_pictures(source: &Source<'_>, folders: &[Folder]) -> (String, String) {
    const NONE: &str = "there are no pictures here (PNG, TIFF, BMP, JPEG, PGM)";
    let below = folders.first().into_iter().flat_map(|root| &root.folders).filter_map(|path| list(path).ok());
    let others: Vec<Utf8PathBuf> =
        folders.iter().flat_map(|f| f.others.clone()).chain(below.flat_map(|f| f.others)).collect();
    if others.is_empty() {
        let hint = format!(
            "is the path right? The pictures are in this folder, or in one for each camera: {}",
            by_hand(source)
        );
        return (NONE.to_owned(), hint);
    }
    let statement = format!("{NONE}, but {} ({})", count(others.len(), "other file"), listed(&called(&others), 1));
    let of_video = others.iter().find_map(|file| of_video(file));
    (statement, of_video.unwrap_or_else(|| "save pictures of other formats as PNG".to_owned()))
}

/// The sides are told, but nothing says which pictures belong together.
fn unmatched(source: &Source<'_>, reading: &Reading) -> (String, String) {
    let [left, right] = [&reading.sides[0], &reading.sides[1]].map(Vec::len);
    if source.by == Some(PairBy::Order) {
        let statement =
            format!("{} and {right} right ones cannot be paired in their order", count(left, "left picture"));
        return (statement, "`--pair-by order` needs as many left pictures as right ones".to_owned());
    }
    let by = source.by.map_or("name or number", PairBy::word);
    let statement = format!(
        "no pair found: {} have no partner of the same {by} on the other side, or more than one",
        count(left + right, "picture")
    );
    let hint = if left == right {
        format!("{} pairs them in the order of their names", call(source, &source.places(), "--pair-by order"))
    } else {
        format!(
            "name partners alike; {left} left pictures and {right} right ones cannot be paired in their order either"
        )
    };
    (statement, hint)
}

/// A folder called left without one called right, or the other way round.
fn one_side(folders: &[Folder]) -> Option<(&'static str, &'static str)> {
    let top = folders.first()?;
    let is = |word: &str| {
        top.folders.iter().any(|folder| folder.file_name().is_some_and(|name| name.eq_ignore_ascii_case(word)))
    };
    match (is("left"), is("right")) {
        (true, false) => Some(("left", "right")),
        (false, true) => Some(("right", "left")),
        _ => None,
    }
}

/// A folder of one side without pictures, beside one of the other side with some.
fn empty_side(folders: &[Folder]) -> Option<(&Utf8PathBuf, Side)> {
    let top = folders.first()?;
    let side = |path: &Utf8PathBuf| Open::new(path.file_name()?, Reach::Words).side();
    let holds = |path: &Utf8PathBuf| folders.iter().any(|f| !f.pictures.is_empty() && f.path.starts_with(path));
    let is_full = |wanted: Side| top.folders.iter().any(|path| side(path) == Some(wanted) && holds(path));
    let mut empty = top.folders.iter().filter(|path| !holds(path)).filter_map(|path| Some((path, side(path)?)));
    empty.find(|(_, side)| is_full(side.other()))
}

/// The folders below the one that was named, those with a word for left first and for right last.
fn left_first<'a>(holding: &[&'a Folder]) -> Vec<&'a Folder> {
    let mut below: Vec<&Folder> = holding.iter().copied().filter(|folder| folder.depth > 0).collect();
    below.sort_by_key(|folder| match Open::new(&folder.below, Reach::Words).side() {
        Some(Side::Left) => 0,
        None => 1,
        Some(Side::Right) => 2,
    });
    below
}

/// One folder was named twice.
pub fn same(source: &Source<'_>) -> Error {
    Error::Unpaired {
        path: source.images.to_owned(),
        statement: "both sides are the same folder".to_owned(),
        hint: format!("{} takes a folder of each camera's pictures", by_hand(source)),
    }
}

/// Nothing tells left from right.
fn untold(source: &Source<'_>, holding: &[&Folder], pictures: usize) -> (String, String) {
    let two_views = holding.iter().find_map(|folder| Some((folder, as_of_two(folder.pictures.first()?)?)));
    let halves = two_views.map(|(folder, halves)| {
        let call = call(source, &[&folder.path], halves.flag());
        let [left, right] = halves.words();
        format!("if the {left} half of each picture is the left camera's and the {right} one the right's: {call}")
    });
    let below = left_first(holding);
    let (statement, hint) = match below.as_slice() {
        [first, second, ..] => (
            format!("which of these {} are left and right is not told", count(below.len(), "folder")),
            format!("name two: {}", call(source, &[&first.path, &second.path], "")),
        ),
        _ => (
            format!("no pair found: the names of {} tell neither left nor right", count(pictures, "picture")),
            match halves {
                Some(_) => format!("{} takes a folder of each camera's pictures", by_hand(source)),
                None => format!(
                    "{} takes a folder of each camera's pictures; where each picture holds both views, `{}` or `{}` cuts it in two",
                    by_hand(source),
                    Halves::SideBySide.flag(),
                    Halves::TopBottom.flag()
                ),
            },
        ),
    };
    (statement, halves.map_or(hint.clone(), |halves| format!("{halves}; else {hint}")))
}

/// How a picture of this form would hold two, none of which is taller than wide; a square picture is one camera's.
fn as_of_two(path: &Utf8Path) -> Option<Halves> {
    let header = image::header(path).ok()?;
    match (header.width, header.height) {
        (width, height) if width >= 2 * height => Some(Halves::SideBySide),
        (width, height) if height > width => Some(Halves::TopBottom),
        _ => None,
    }
}

impl Pairing {
    /// What was left out, in a line; `None` where nothing was.
    pub fn left_out(&self) -> Option<String> {
        let mut parts = Vec::new();
        if !self.single.is_empty() {
            let pictures = count(self.single.len(), "picture");
            let in_order = match self.could_be_in_order {
                true => ", as many on each side: `--pair-by order` pairs all in the order of their names",
                false => "",
            };
            parts.push(format!("{pictures} without a partner ({}){in_order}", listed(&called(&self.single), 3)));
        }
        if self.sideless > 0 {
            parts.push(format!("{} whose names tell neither left nor right", count(self.sideless, "picture")));
        }
        let Aside { other, again } = self.aside;
        if again > 0 {
            parts.push(format!("{} in another format beside others of the same names", count(again, "picture")));
        }
        if other > 0 {
            parts.push(count(other, "other file"));
        }
        (!parts.is_empty()).then(|| format!("left out: {}", parts.join("; ")))
    }
}
