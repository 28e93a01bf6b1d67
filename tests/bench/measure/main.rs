//! Benchmark `measure`: is what `measure` says true, does it notice what is wrong, and what does it cost.
//!
//! `cargo bench --bench measure -- coverage|pictures|robots|faults|changes|speed`; without a word all of them.
//! `changes` is a part of `faults`. `coverage`, `robots` and `faults` work on the simulator's true corners with
//! Gaussian noise, so that hundreds of poses cost seconds; `pictures` (of one size in px, where a number follows) and
//! `speed` run the program on rendered pictures.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark prints its tables, and ends where its input is not as it should be"
)]

mod coverage;
mod faults;
mod pictures;
mod rig_changes;
mod robots;
mod speed;
mod worlds;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let runs = |name: &str| wanted.is_empty() || wanted.iter().any(|word| word == name);
    if runs("coverage") {
        coverage::run();
    }
    if runs("pictures") {
        let size = wanted.iter().find_map(|word| word.parse().ok());
        pictures::run_all(size);
    }
    if runs("robots") {
        robots::run();
    }
    if runs("faults") {
        faults::run();
    }
    if runs("faults") || runs("changes") {
        rig_changes::run();
    }
    if runs("speed") {
        speed::run_all();
    }
}
