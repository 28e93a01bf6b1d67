//! The source as a graph of modules: who uses whose items, resolved through imports and re-exports as the compiler
//! does.
//!
//! In: the root file of a crate. Out: its modules, and for each the modules that define what its paths name. A module
//! of nothing but `mod` and `pub use` hands on what others define and is no module of its own. What is compiled for
//! tests alone is left out. A method that is called on a value whose type is never written leaves no path and is not
//! seen.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::Visit;
use syn::{Attribute, Item, UseTree, Visibility};

#[derive(Default)]
pub struct Module {
    /// From the root: `identify::solve::task`.
    pub name: String,
    pub parent: Option<usize>,
    children: BTreeMap<String, usize>,
    items: BTreeSet<String>,
    /// What a name that was imported stands for.
    imports: BTreeMap<String, Vec<Vec<String>>>,
    globs: Vec<Vec<String>>,
    paths: BTreeSet<Vec<String>>,
    /// Nothing but `mod` and `pub use`.
    pub hands_on: bool,
}

pub struct Crate {
    pub modules: Vec<Module>,
}

/// What a path leads to.
#[derive(Clone, Copy, PartialEq)]
enum Named {
    Module(usize),
    ItemOf(usize),
}

impl Crate {
    pub fn read(root: &Path) -> Self {
        let mut read = Self { modules: Vec::new() };
        let folder = root.parent().unwrap().to_path_buf();
        read.add(None, String::new(), parsed(root).items, &folder);
        read
    }

    /// Adds a module and those that it declares, whose files are in `folder`.
    fn add(&mut self, parent: Option<usize>, name: String, items: Vec<Item>, folder: &Path) -> usize {
        let index = self.modules.len();
        let hands_on = items.iter().filter(|item| !for_tests(attributes(item))).all(|item| match item {
            Item::Mod(module) => module.content.is_none(),
            Item::Use(import) => !matches!(import.vis, Visibility::Inherited),
            _ => false,
        });
        self.modules.push(Module { name: name.clone(), parent, hands_on, ..Module::default() });
        for item in items {
            if for_tests(attributes(&item)) {
                continue;
            }
            if let Item::Mod(child) = item {
                let word = child.ident.to_string();
                let (items, below) = match child.content {
                    Some((_, items)) => (items, folder.join(&word)),
                    None => (parsed(&file_of(folder, &word)).items, folder.join(&word)),
                };
                let path = if name.is_empty() { word.clone() } else { format!("{name}::{word}") };
                let child = self.add(Some(index), path, items, &below);
                self.modules[index].children.insert(word, child);
            } else {
                let module = &mut self.modules[index];
                module.items.extend(name_of(&item));
                Reader { module }.visit_item(&item);
            }
        }
        index
    }

    /// The modules that define what module `from` names, each with a path that leads there.
    pub fn used_by(&self, from: usize) -> BTreeMap<usize, String> {
        let module = &self.modules[from];
        let imported = module.imports.values().flatten();
        let mut used = BTreeMap::new();
        for path in imported.chain(&module.paths).chain(&module.globs) {
            if let Some(Named::ItemOf(to)) = self.resolve(from, path, true, &mut BTreeSet::new())
                && to != from
            {
                used.entry(to).or_insert_with(|| path.join("::"));
            }
        }
        used
    }

    /// What `path` names where it stands in module `from`; of a module and an item of the same name the item, if
    /// `item`.
    fn resolve(
        &self,
        from: usize,
        path: &[String],
        item: bool,
        seen: &mut BTreeSet<(usize, Vec<String>, bool)>,
    ) -> Option<Named> {
        if !seen.insert((from, path.to_vec(), item)) {
            return None;
        }
        let mut at = from;
        let mut rest = path;
        while let Some(first) = rest.first() {
            at = match first.as_str() {
                "crate" => 0,
                "self" if rest.len() == path.len() => at,
                "super" => self.modules[at].parent?,
                _ => break,
            };
            rest = &rest[1..];
        }
        let Some((first, rest)) = rest.split_first() else { return Some(Named::Module(at)) };
        match self.named(at, first, item && rest.is_empty(), seen)? {
            Named::Module(inner) if !rest.is_empty() => {
                let below: Vec<String> = std::iter::once("self".to_owned()).chain(rest.iter().cloned()).collect();
                self.resolve(inner, &below, item, seen)
            }
            named => Some(named),
        }
    }

    fn named(
        &self,
        at: usize,
        name: &str,
        item: bool,
        seen: &mut BTreeSet<(usize, Vec<String>, bool)>,
    ) -> Option<Named> {
        let module = &self.modules[at];
        let child = module.children.get(name).map(|&child| Named::Module(child));
        let own = module.items.contains(name).then_some(Named::ItemOf(at));
        if let Some(found) = if item { own } else { child.or(own) } {
            return Some(found);
        }
        let mut paths: Vec<Vec<String>> = module.imports.get(name).cloned().unwrap_or_default();
        let through = |glob: &Vec<String>| glob.iter().cloned().chain([name.to_owned()]).collect();
        paths.extend(module.globs.iter().map(through));
        for path in &paths {
            match self.resolve(at, path, item, seen) {
                // An import may stand for a module and for an item of the same name.
                Some(Named::Module(_)) if item => continue,
                Some(found) => return Some(found),
                None => (),
            }
        }
        child
    }
}

/// Gathers what a module imports and which paths it writes.
struct Reader<'a> {
    module: &'a mut Module,
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_attribute(&mut self, _: &'ast Attribute) {}

    fn visit_item(&mut self, item: &'ast Item) {
        if !for_tests(attributes(item)) {
            syn::visit::visit_item(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        if !for_tests(&function.attrs) {
            syn::visit::visit_impl_item_fn(self, function);
        }
    }

    fn visit_item_use(&mut self, import: &'ast syn::ItemUse) {
        self.import(&mut Vec::new(), &import.tree);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.module.paths.insert(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        syn::visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.visit_path(&call.path);
        self.tokens(call.tokens.clone());
    }
}

impl Reader<'_> {
    fn import(&mut self, before: &mut Vec<String>, tree: &UseTree) {
        match tree {
            UseTree::Path(path) => {
                before.push(path.ident.to_string());
                self.import(before, &path.tree);
                before.pop();
            }
            UseTree::Group(group) => group.items.iter().for_each(|tree| self.import(before, tree)),
            UseTree::Glob(_) => self.module.globs.push(before.clone()),
            UseTree::Name(name) => self.bring(before, &name.ident.to_string(), &name.ident.to_string()),
            UseTree::Rename(renamed) => {
                self.bring(before, &renamed.ident.to_string(), &renamed.rename.to_string());
            }
        }
    }

    fn bring(&mut self, before: &[String], name: &str, by: &str) {
        let mut path = before.to_vec();
        let mut by = by.to_owned();
        if name == "self" {
            by = if by == "self" { path.last().cloned().unwrap_or_default() } else { by };
        } else {
            path.push(name.to_owned());
        }
        self.module.imports.entry(by).or_default().push(path);
    }

    /// Paths in what a macro is given: names with `::` between them, but no fields and methods.
    fn tokens(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mark = |i: usize, c: char| matches!(tokens.get(i), Some(TokenTree::Punct(p)) if p.as_char() == c);
        let mut i = 0;
        while i < tokens.len() {
            match &tokens[i] {
                TokenTree::Group(group) => self.tokens(group.stream()),
                TokenTree::Ident(first) if i == 0 || !mark(i - 1, '.') => {
                    let mut path = vec![first.to_string()];
                    while let Some(TokenTree::Ident(next)) = tokens.get(i + 3)
                        && mark(i + 1, ':')
                        && mark(i + 2, ':')
                    {
                        path.push(next.to_string());
                        i += 3;
                    }
                    self.module.paths.insert(path);
                }
                _ => (),
            }
            i += 1;
        }
    }
}

pub fn parsed(path: &Path) -> syn::File {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

fn file_of(folder: &Path, module: &str) -> PathBuf {
    let file = folder.join(format!("{module}.rs"));
    if file.is_file() { file } else { folder.join(module).join("mod.rs") }
}

/// Whether something is compiled for tests alone.
pub fn for_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Path>().is_ok_and(|path| path.is_ident("test"))
    })
}

pub fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(i) => &i.attrs,
        Item::Enum(i) => &i.attrs,
        Item::Fn(i) => &i.attrs,
        Item::Impl(i) => &i.attrs,
        Item::Macro(i) => &i.attrs,
        Item::Mod(i) => &i.attrs,
        Item::Static(i) => &i.attrs,
        Item::Struct(i) => &i.attrs,
        Item::Trait(i) => &i.attrs,
        Item::Type(i) => &i.attrs,
        Item::Use(i) => &i.attrs,
        _ => &[],
    }
}

fn name_of(item: &Item) -> Option<String> {
    let ident = match item {
        Item::Const(i) => &i.ident,
        Item::Enum(i) => &i.ident,
        Item::Fn(i) => &i.sig.ident,
        Item::Macro(i) => i.ident.as_ref()?,
        Item::Static(i) => &i.ident,
        Item::Struct(i) => &i.ident,
        Item::Trait(i) => &i.ident,
        Item::Type(i) => &i.ident,
        _ => return None,
    };
    Some(ident.to_string())
}
