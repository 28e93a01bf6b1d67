//! `stereocal board`: a board to print, in its true size.

use super::{Outcome, Result};
use crate::cli::PrintBoard;
use crate::config::{self, Config};
use crate::diagnostic::Status;
use crate::files::OutDir;
use crate::files::provenance::Run;
use crate::formats::boards::sheet::{Sheet, TooLarge};
use crate::imaging::Board;
use crate::progress;

/// A side of which a printer of 300 dots an inch draws a twelfth no longer, mm.
const FINE_MM: f64 = 1.0;

pub fn run(args: &PrintBoard, config: &Config, run: Run) -> Result<Outcome> {
    let invalid = |problem| config::Error::Invalid { problems: vec![problem] };
    // The command line asks for one of the two.
    let nothing = || invalid("no board named".to_owned());
    let plain = args.squares.zip(args.square_mm).map(|(squares, mm)| Board::checker(squares, mm));
    let board = args.board.or(plain).ok_or_else(nothing)?;
    let sheet = Sheet::new(&board).map_err(|TooLarge { message, hint }| config::Error::Usage { message, hint })?;
    let run = Run { force: args.output.force, ..run };
    let out = OutDir::open(args.output.out.as_deref().unwrap_or(&config.out))?.for_run(&run, &[]);
    if board.square_mm < FINE_MM {
        progress::warn(format!("squares of {} mm: few printers draw them; sizes are in mm", board.square_mm));
    }
    let all = !(args.pdf || args.svg || args.png);
    let png = if args.png { Some(sheet.png(args.dpi).map_err(invalid)?) } else { None };
    let written: Vec<(&str, Vec<u8>)> = [
        (args.pdf || all).then(|| ("board.pdf", sheet.pdf())),
        (args.svg || all).then(|| ("board.svg", sheet.svg().into_bytes())),
        png.map(|bytes| ("board.png", bytes)),
    ]
    .into_iter()
    .flatten()
    .collect();
    let names: Vec<&str> = written.iter().map(|(name, _)| *name).collect();
    out.check_free(&names)?;
    note_earlier(&out, &written);
    for (name, bytes) in &written {
        out.write(name, bytes)?;
    }
    let files: Vec<String> = names.iter().map(|name| out.join(name).to_string()).collect();
    let stdout = if args.output.json {
        let object = serde_json::json!({
            "board": board.to_string(), "paper": sheet.paper, "width_mm": sheet.width_mm, "height_mm": sheet.height_mm, "files": files,
        });
        format!("{object:#}\n")
    } else {
        let Sheet { paper, width_mm, height_mm, .. } = &sheet;
        format!(
            "{board} on {paper} ({width_mm} x {height_mm} mm): {}\nnext: print it at 100 %, measure it, and name it as it came out: `stereocal camera-check IMAGES --board {board}`\n",
            files.join(", ")
        )
    };
    Ok(Outcome { stdout, status: Status::Done })
}

/// Says which sheets of an earlier run are replaced by another board's, and which stay beside it.
fn note_earlier(out: &OutDir, written: &[(&str, Vec<u8>)]) {
    for name in ["board.pdf", "board.svg", "board.png"] {
        let Ok(earlier) = std::fs::read(out.join(name)) else { continue };
        match written.iter().find(|(new, _)| *new == name) {
            Some((_, bytes)) if *bytes == earlier => {}
            Some(_) => progress::note(format!("{} of an earlier run is replaced", out.join(name))),
            None => progress::warn(format!(
                "{} stays as an earlier run wrote it: it may be of another board",
                out.join(name)
            )),
        }
    }
}
