//! Benchmark of the identification.
//!
//! `cargo bench --bench identify` times the solvers (`-- speed [measurements.csv robot.toml]` on files of your own);
//! `-- experiment [SEEDS]` rebuilds the paper's experiment with the commands themselves, with and without effects that
//! the model lacks; `-- constants [SEEDS]` asks how surely STAPSO ends at the least cost, with the paper's constants
//! and with ours.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark times, prints its table, and ends where its input is not as it should be"
)]

mod constants;
mod experiment;
mod speed;

/// Seeds of the experiment's table and of the constants'.
const SEEDS: (u64, u64) = (20, 100);

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    let count = |default| arguments.get(1).and_then(|n| n.parse().ok()).unwrap_or(default);
    match arguments.first().map(String::as_str) {
        Some("experiment") => experiment::table(count(SEEDS.0)),
        Some("constants") => constants::table(count(SEEDS.1)),
        Some("speed") => speed::table(&arguments[1..]),
        _ => speed::table(&arguments),
    }
}
