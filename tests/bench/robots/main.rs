//! Benchmark of the identification on robots: the real sets where they are, and simulated arms whose truth is known.
//!
//! `cargo bench --bench robots` prints all; `-- real` (with wrong conventions planted in the real tables), `--
//! simulated [RUNS]`, `-- faults [RUNS [FAULT]]`, `-- touches [RUNS]`, `-- targets [RUNS]`, `-- people [RUNS]` and `--
//! speed` one of them.
#![allow(clippy::print_stdout, reason = "a benchmark says what it measured")]
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "a benchmark that cannot run has nothing to say")]
#![allow(clippy::disallowed_methods, reason = "a benchmark looks at the clock")]

mod conventions;
mod faults;
mod people;
mod real;
mod simulated;
mod speed;
mod targets;
mod touches;
mod worlds;

/// Runs of every simulated case.
const RUNS: u64 = 20;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let runs = arguments.get(1).and_then(|n| n.parse().ok()).unwrap_or(RUNS);
    let wanted = arguments.first().map(String::as_str);
    let asked = |name: &str| wanted.is_none_or(|w| w == name);
    if asked("real") {
        real::table();
        conventions::table();
    }
    if asked("simulated") {
        simulated::table(runs);
    }
    if asked("faults") {
        faults::table(runs, arguments.get(2).map_or("", String::as_str));
    }
    if asked("touches") {
        touches::table(runs);
    }
    if asked("targets") {
        targets::table(runs);
    }
    if asked("people") {
        people::table(runs);
    }
    if asked("speed") {
        speed::table();
    }
}
