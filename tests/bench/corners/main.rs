//! Benchmark of the corner measurement: `cargo bench --bench corners` (add `--profile dev` to reuse the test build).
//!
//! Single corners, drawn by supersampling, against the Cramer-Rao bound of the same window; whole boards, drawn by the
//! simulator's renderer, with OpenCV's `cornerSubPix` and sector detector and the crate `chess-corners` beside the fit
//! on the same pictures; boards at all tilts and turns; boards with markers in part. `-- single`, `-- boards`, `--
//! poses 300`, `-- coded FIRST COUNT [FOLDER]` or `-- tags FIRST COUNT [FOLDER]` makes one table alone.

#![allow(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a benchmark times, prints its table, and ends where its input is not as it should be"
)]

mod boards;
mod coded;
mod corner_patch;
mod poses;
mod single;
mod sub_pix;

fn main() {
    // One table alone where it is named; `poses N` draws N pairs.
    let arguments: Vec<String> = std::env::args().collect();
    let named = |name: &str| arguments.iter().position(|a| a == name);
    let all = ["single", "boards", "poses", "coded", "tags", "grid"].into_iter().all(|name| named(name).is_none());
    if all || named("single").is_some() {
        single::table();
        single::defocus();
    }
    if all || named("boards").is_some() {
        boards::table();
    }
    if all || named("poses").is_some() {
        let count = named("poses").and_then(|at| arguments.get(at + 1)?.parse().ok());
        poses::table(count.unwrap_or(1000));
    }
    for (name, kind) in [("coded", coded::Coded::Markers), ("tags", coded::Coded::Tags), ("grid", coded::Coded::Grid)] {
        if all || named(name).is_some() {
            let number = |place: usize| named(name).and_then(|at| arguments.get(at + place)?.parse().ok());
            let folder = named(name).and_then(|at| arguments.get(at + 3)).map(std::path::Path::new);
            coded::table(
                kind,
                number(1).unwrap_or(0),
                number(2).unwrap_or(300),
                folder.filter(|folder| folder.is_dir()),
            );
        }
    }
}
