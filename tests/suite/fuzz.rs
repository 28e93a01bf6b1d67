//! A short, seeded run of the fuzzing that `scripts/fuzz` does at length: no reader panics.

#[path = "../bench/fuzz/mod.rs"]
mod harness;

use crate::run::workplace;

/// Mutated files for each reader; the long run has three hundred times as many.
const RUNS: usize = 160;

#[test]
fn no_reader_panics() {
    let folder = workplace();
    let root = camino::Utf8Path::from_path(folder.path()).expect("its name is UTF-8");
    for target in harness::targets(root) {
        let outcome = target.run(RUNS, 1, root);
        // Time and memory are the long run's: other tests run beside this one.
        let panics: Vec<_> = outcome.failures.iter().filter(|(what, _)| what == "panic").collect();
        if !panics.is_empty() {
            let kept = folder.keep();
            panic!("{}: {panics:?} in {}", target.name, kept.display());
        }
    }
}
