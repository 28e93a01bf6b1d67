//! No circle among the modules, and no import against the order of the rooms in src/CONVENTIONS.md.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::modules::Crate;

/// Who uses whom, by index, with a path as written.
type Uses = Vec<BTreeMap<usize, String>>;

fn uses(of: &Crate) -> Uses {
    let own = |module: usize| if of.modules[module].hands_on { BTreeMap::new() } else { of.used_by(module) };
    (0..of.modules.len()).map(own).collect()
}

/// What is reached from `start`, itself only round a circle.
fn reached(uses: &Uses, start: usize) -> BTreeSet<usize> {
    let mut found = BTreeSet::new();
    let mut open = vec![start];
    while let Some(at) = open.pop() {
        open.extend(uses[at].keys().filter(|&&to| found.insert(to)));
    }
    found
}

/// Modules that reach each other, each circle once, with the imports inside it.
fn circles(of: &Crate) -> Vec<(Vec<usize>, Vec<String>)> {
    let uses = uses(of);
    let reached: Vec<BTreeSet<usize>> = (0..uses.len()).map(|module| reached(&uses, module)).collect();
    let mut found: Vec<(Vec<usize>, Vec<String>)> = Vec::new();
    for module in 0..uses.len() {
        let circle: Vec<usize> =
            reached[module].iter().copied().filter(|&other| reached[other].contains(&module)).collect();
        if circle.first() == Some(&module) {
            let inside = circle.iter().flat_map(|&from| {
                let within = uses[from].iter().filter(|(to, _)| circle.contains(to));
                within.map(move |(_, path)| format!("{} uses {path}", of.modules[from].name))
            });
            found.push((circle.clone(), inside.collect()));
        }
    }
    found
}

/// The rooms of each folder as a text writes them, in lines `folder: first < second, beside the second < third`.
fn order(text: &str) -> BTreeMap<String, BTreeMap<String, usize>> {
    let section = text.split("\n## Rooms").nth(1).unwrap_or_default();
    let block = section.split("```").nth(1).unwrap_or_default();
    let lines = block.lines().filter_map(|line| line.split_once(':'));
    let ranks = |rooms: &str| {
        let step = |(rank, rooms): (usize, &str)| -> Vec<(String, usize)> {
            rooms.split(',').map(|room| (room.trim().to_owned(), rank)).collect()
        };
        rooms.split('<').enumerate().flat_map(step).collect()
    };
    lines.map(|(folder, rooms)| (folder.trim().to_owned(), ranks(rooms))).collect()
}

/// Imports from a room that comes later, or from one beside; rooms without a place in the order.
fn against(of: &Crate, order: &BTreeMap<String, BTreeMap<String, usize>>) -> Vec<String> {
    let mut found = BTreeSet::new();
    for (folder, ranks) in order {
        let within = if folder == "src" { String::new() } else { format!("{folder}::") };
        let room = |name: &str| {
            name.strip_prefix(&within).map(|below| below.split("::").next().unwrap_or_default().to_owned())
        };
        for (from, used) in uses(of).iter().enumerate() {
            let Some(here) = room(&of.modules[from].name).filter(|room| !room.is_empty()) else { continue };
            let Some(&rank) = ranks.get(&here) else {
                found.insert(format!("{within}{here} has no place in the order of {folder}"));
                continue;
            };
            for (to, path) in used {
                let there = room(&of.modules[*to].name).filter(|there| *there != here);
                if there.is_some_and(|there| ranks.get(&there).is_none_or(|&theirs| theirs >= rank)) {
                    found.insert(format!("{} uses {path}", of.modules[from].name));
                }
            }
        }
    }
    found.into_iter().collect()
}

fn ours() -> Crate {
    Crate::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs"))
}

#[test]
fn no_modules_use_each_other_in_a_circle() {
    let ours = ours();
    assert!(ours.modules.len() > 100, "the source was not found");
    let found = circles(&ours);
    let told: Vec<String> = found.iter().map(|(circle, imports)| format!("{}: {imports:#?}", circle.len())).collect();
    assert!(told.is_empty(), "{} circles\n{}", told.len(), told.join("\n"));
}

#[test]
fn rooms_import_from_those_before_them() {
    let conventions = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/CONVENTIONS.md");
    let order = order(&std::fs::read_to_string(conventions).unwrap());
    assert!(order.contains_key("src") && order.contains_key("identify"), "no order was read: {order:?}");
    let found = against(&ours(), &order);
    assert!(found.is_empty(), "{found:#?}");
}

/// A crate of the given files.
fn planted(files: &[(&str, &str)]) -> Crate {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    Crate::read(&folder.path().join("lib.rs"))
}

fn names(of: &Crate) -> Vec<Vec<&str>> {
    circles(of).iter().map(|(circle, _)| circle.iter().map(|&i| of.modules[i].name.as_str()).collect()).collect()
}

#[test]
fn a_planted_circle_is_found_through_a_re_export() {
    let of = planted(&[
        ("lib.rs", "pub mod data; pub mod solve; pub mod judge;"),
        ("data/mod.rs", "mod rows; pub use rows::Rows;"),
        ("data/rows.rs", "use crate::solve; pub struct Rows; fn f() { let _ = format!(\"{}\", solve::Fit::new()); }"),
        ("solve.rs", "use crate::data::Rows; pub struct Fit(Rows); impl Fit { pub fn new() -> u8 { 0 } }"),
        ("judge.rs", "use crate::{data::Rows, solve::*}; fn g(_: Rows, _: Fit) {}"),
    ]);
    assert_eq!(names(&of), [["data::rows", "solve"]]);
    let order = order("\n## Rooms\n```text\nsrc: data < solve < judge\n```\n");
    assert_eq!(against(&of, &order), ["data::rows uses solve::Fit::new"]);
}

#[test]
fn a_parent_that_hands_on_is_no_module_of_its_own_and_one_with_code_is() {
    let child = ("a/one.rs", "use super::Two; pub struct One(Two);");
    let other = ("a/two.rs", "pub struct Two;");
    let root = ("lib.rs", "mod a;");
    let hands_on =
        planted(&[root, child, other, ("a/mod.rs", "mod one; mod two; pub use one::One; pub use two::Two;")]);
    assert!(names(&hands_on).is_empty());
    let with_code = planted(&[
        root,
        child,
        other,
        ("a/mod.rs", "mod one; pub use one::One; pub struct Two; fn f() -> One { g() }"),
    ]);
    assert_eq!(names(&with_code), [["a", "a::one"]]);
}

#[test]
fn what_is_for_tests_alone_makes_no_circle() {
    let of = planted(&[
        ("lib.rs", "mod a; mod b;"),
        (
            "a.rs",
            "pub struct A; #[cfg(test)] mod tests { use crate::b::B; fn t(_: B) {} } #[cfg(test)] fn f(_: crate::b::B) {}",
        ),
        ("b.rs", "pub struct B(crate::a::A);"),
    ]);
    assert!(names(&of).is_empty());
    let order = order("\n## Rooms\n```text\nsrc: b < a\n```\n");
    assert_eq!(against(&of, &order), ["b uses crate::a::A"]);
}

#[test]
fn a_room_without_a_place_in_the_order_is_named() {
    let of = planted(&[("lib.rs", "mod a; mod b;"), ("a.rs", "pub struct A;"), ("b.rs", "pub struct B;")]);
    let order = order("\n## Rooms\n```text\nsrc: a\n```\n");
    assert_eq!(against(&of, &order), ["b has no place in the order of src"]);
}
