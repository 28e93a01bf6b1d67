//! Benchmark of the corner measurement: `cargo bench --bench corners` (add `--profile dev` to reuse the test build).
//!
//! Single corners, drawn by supersampling, against the Cramer-Rao bound of the same window; whole boards, drawn by the
//! simulator's renderer, with OpenCV's `cornerSubPix` and sector detector beside the fit on the same pictures.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

mod boards;
mod corner_patch;
mod single;

fn main() {
    if std::env::args().all(|a| a != "boards") {
        single::table();
        single::defocus();
    }
    boards::table();
}
