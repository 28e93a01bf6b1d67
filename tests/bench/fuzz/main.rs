//! `cargo bench --bench fuzz -- [RUNS [SEED [TARGET...]]]`: every reader, or those named, with so many mutated files
//! each. Ends with status 1 where one failed, and says which file made it fail.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "it times, prints its table, and ends where its own files cannot be written"
)]

#[path = "mod.rs"]
mod fuzz;

use std::process::ExitCode;

/// Runs a target where none are given.
const RUNS: usize = 10_000;

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let runs = arguments.next().map_or(RUNS, |text| text.parse().expect("RUNS is a number"));
    let seed = arguments.next().map_or(1, |text| text.parse().expect("SEED is a number"));
    let wanted: Vec<String> = arguments.collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = camino::Utf8PathBuf::from_path_buf(folder.path().to_owned()).expect("its name is UTF-8");
    // A panic is a failure that is counted; its message would drown the table.
    std::panic::set_hook(Box::new(|_| {}));
    println!("{:14} {:>9} {:>11} {:>9}  failures", "reader", "runs", "longest", "memory");
    let mut failed = false;
    for target in fuzz::targets(&root) {
        if !wanted.is_empty() && !wanted.iter().any(|name| name == target.name) {
            continue;
        }
        let outcome = target.run(runs, seed, &root);
        let (ms, mb) = (1e3 * outcome.longest.as_secs_f64(), outcome.most_bytes >> 20);
        println!("{:14} {runs:>9} {ms:>8.1} ms {mb:>6} MB  {}", target.name, outcome.failures.len());
        for (what, kept) in &outcome.failures {
            println!("  {what}: {kept}");
            failed = true;
        }
    }
    if failed {
        println!("the files are kept in {}", folder.keep().display());
        return ExitCode::FAILURE;
    }
    ExitCode::SUCCESS
}
