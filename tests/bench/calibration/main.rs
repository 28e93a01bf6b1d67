//! Benchmark `calibration`: what the bundle costs beside OpenCV's, whether the intervals of its numbers hold, what known lenses give, and what
//! shows that a rig changed.
//!
//! `cargo bench --bench calibration -- speed|coverage|known-lenses|against [RIGS]`; without a word all.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark prints its tables, and ends where its input is not as it should be"
)]

mod against;
mod coverage;
mod known_lenses;
mod peer;
mod speed;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect();
    let runs = |name: &str| wanted.is_empty() || wanted.iter().any(|word| word == name);
    if runs("speed") {
        speed::run();
    }
    if runs("coverage") {
        coverage::run();
    }
    if runs("known-lenses") {
        known_lenses::run();
    }
    if runs("against") {
        against::run(wanted.iter().find_map(|word| word.parse().ok()).unwrap_or(60));
    }
}
