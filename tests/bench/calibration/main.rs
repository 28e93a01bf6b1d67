//! Benchmark `calibration`: what the bundle costs beside OpenCV's, and whether the intervals of its numbers hold, and what known lenses give.
//!
//! `cargo bench --bench calibration -- speed|coverage|known-lenses`; without a word all.
#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark prints its tables, and ends where its input is not as it should be"
)]

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
}
