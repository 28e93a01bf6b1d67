//! What the library shows to other programs: the items of its front page, and no more.

use std::path::Path;

use syn::{Item, UseTree, Visibility};

use super::modules;

/// Each of these is a promise.
const FACE: &[&str] = &[
    "Board",
    "Calibration",
    "Compensated",
    "Compensator",
    "Corners",
    "Dataset",
    "Error",
    "Identification",
    "Measurement",
    "Method",
    "Model",
    "Plan",
    "Result",
    "Rig",
    "Robot",
    "Settings",
    "Verdict",
    "World",
    "calibrate",
    "find_corners",
    "identify",
    "plan",
];

fn names(tree: &UseTree, into: &mut Vec<String>) {
    match tree {
        UseTree::Path(path) => names(&path.tree, into),
        UseTree::Name(name) => into.push(name.ident.to_string()),
        UseTree::Rename(renamed) => into.push(renamed.rename.to_string()),
        UseTree::Glob(_) => into.push("*".to_owned()),
        UseTree::Group(group) => group.items.iter().for_each(|tree| names(tree, into)),
    }
}

/// Names that the root file of a crate shows in its documentation.
fn shown(file: &syn::File) -> Vec<String> {
    let is_hidden = |item: &Item| {
        modules::attributes(item).iter().any(|attribute| {
            attribute.path().is_ident("doc") && attribute.parse_args::<syn::Ident>().is_ok_and(|word| word == "hidden")
        })
    };
    let mut shown = Vec::new();
    for item in file.items.iter().filter(|item| !is_hidden(item)) {
        match item {
            Item::Use(import) if matches!(import.vis, Visibility::Public(_)) => names(&import.tree, &mut shown),
            Item::Mod(module) if matches!(module.vis, Visibility::Public(_)) => shown.push(module.ident.to_string()),
            _ => (),
        }
    }
    shown.sort();
    shown
}

#[test]
fn the_front_page_shows_what_is_promised_and_no_more() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs");
    assert_eq!(shown(&modules::parsed(&root)), FACE);
}

#[test]
fn a_module_that_is_not_hidden_is_seen() {
    let file =
        syn::parse_file("#[doc(hidden)] pub mod a; pub mod b; mod c; pub use a::{D, e as F}; use a::G;").unwrap();
    assert_eq!(shown(&file), ["D", "F", "b"]);
}
