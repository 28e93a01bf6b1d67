//! No file over 400 lines, no function over 60.

use std::path::Path;

use syn::spanned::Spanned;
use syn::visit::Visit;

use super::{modules, source_files};

const LINES_OF_A_FILE: usize = 400;
/// Files and functions that are longer and not mended yet: lists that only get shorter.
const LONG_FILES: &[&str] = &[];
const LONG_FUNCTIONS: &[&str] = &[];
/// From its name to its last brace.
const LINES_OF_A_FUNCTION: usize = 60;

#[derive(Default)]
struct Functions {
    long: Vec<(String, usize)>,
    limit: usize,
}

impl Functions {
    fn look(&mut self, signature: &syn::Signature, body: &syn::Block) {
        let lines = body.span().end().line + 1 - signature.span().start().line;
        if lines > self.limit {
            self.long.push((signature.ident.to_string(), lines));
        }
    }
}

impl<'ast> Visit<'ast> for Functions {
    fn visit_item_mod(&mut self, module: &'ast syn::ItemMod) {
        if !modules::for_tests(&module.attrs) {
            syn::visit::visit_item_mod(self, module);
        }
    }

    fn visit_item_fn(&mut self, function: &'ast syn::ItemFn) {
        self.look(&function.sig, &function.block);
        syn::visit::visit_item_fn(self, function);
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        self.look(&function.sig, &function.block);
        syn::visit::visit_impl_item_fn(self, function);
    }
}

fn long_functions(file: &syn::File, limit: usize) -> Vec<(String, usize)> {
    let mut functions = Functions { limit, ..Functions::default() };
    functions.visit_file(file);
    functions.long
}

fn lines(path: &Path) -> usize {
    std::fs::read_to_string(path).unwrap().lines().count()
}

/// What is too long and no debt, and debts that are paid.
fn against(long: &[(String, usize)], debts: &[&str]) -> Vec<String> {
    let new = long.iter().filter(|(name, _)| !debts.contains(&name.as_str()));
    let new = new.map(|(name, lines)| format!("{name}: {lines} lines"));
    let paid = debts.iter().filter(|debt| !long.iter().any(|(name, _)| name == *debt));
    new.chain(paid.map(|debt| format!("{debt}: no longer too long, take it off the list"))).collect()
}

fn within(path: &Path) -> String {
    path.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap().display().to_string()
}

#[test]
fn no_file_is_longer_than_it_may_be() {
    let files = source_files().into_iter().map(|path| (within(&path), lines(&path)));
    let long: Vec<(String, usize)> = files.filter(|(_, lines)| *lines > LINES_OF_A_FILE).collect();
    let found = against(&long, LONG_FILES);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn no_function_is_longer_than_it_may_be() {
    let of_file = |path: &std::path::PathBuf| -> Vec<(String, usize)> {
        let functions = long_functions(&modules::parsed(path), LINES_OF_A_FUNCTION);
        functions.into_iter().map(|(name, lines)| (format!("{}: {name}", within(path)), lines)).collect()
    };
    let long: Vec<(String, usize)> = source_files().iter().flat_map(of_file).collect();
    let found = against(&long, LONG_FUNCTIONS);
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_long_function_is_found() {
    let file = syn::parse_file("struct A;\nimpl A {\n  fn short() {}\n  fn long(\n  ) {\n    f();\n  }\n}\n").unwrap();
    assert_eq!(long_functions(&file, 3), [("long".to_owned(), 4)]);
}
