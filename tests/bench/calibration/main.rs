//! Benchmark `calibration`: what the bundle costs beside OpenCV's, whether the intervals of its numbers hold, what
//! known lenses give, and what shows that a rig changed.
//!
//! `cargo bench --bench calibration -- speed|coverage|known-lenses [PX]|against [RIGS] [SCENE]`; without a word all, a
//! part of a scene's name is that scene.
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
    let number = || wanted.iter().find_map(|word| word.parse().ok());
    if runs("speed") {
        speed::run();
    }
    if runs("coverage") {
        coverage::run();
    }
    if runs("known-lenses") {
        known_lenses::run(number());
    }
    if runs("against") {
        let scene = wanted.iter().skip(1).find(|word| word.parse::<u64>().is_err()).map_or("", String::as_str);
        against::run(number().unwrap_or(60), scene);
    }
}
