//! `stereocal.toml`: every default in one place. A flag beats the file, the file beats the default.

use std::ops::RangeInclusive;

use camino::{Utf8Path, Utf8PathBuf};
use serde::Deserialize;

use crate::diagnostic::Explain;
use crate::files;
use crate::formats::boards::files::NamedBoard;
use crate::imaging::board::{Board, SQUARES_MM, Squares};
use crate::ranges::{TOLERANCES_MM, positive, within};

/// The file that is read when none is named.
pub const DEFAULT_FILE: &str = "stereocal.toml";

/// Result of reading settings.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Settings that cannot be read or make no sense.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    #[error(transparent)]
    Files(#[from] crate::files::Error),
    /// All that is wrong, at once.
    #[error("{} not possible: {}", if .problems.len() == 1 { "a setting is" } else { "settings are" }, .problems.join("; "))]
    Invalid {
        /// One line a problem.
        problems: Vec<String>,
    },
    /// Something else that was asked for and cannot be.
    #[error("{message}")]
    Usage { message: String, hint: String },
}

impl Explain for Error {
    fn place(&self) -> Option<String> {
        if let Error::Files(e) = self { e.place() } else { None }
    }
    fn hint(&self) -> Option<String> {
        match self {
            Error::Files(e) => e.hint(),
            Error::Invalid { .. } => None,
            Error::Usage { hint, .. } => Some(hint.clone()),
        }
    }
}

/// Everything that can be set.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where results go.
    pub out: Utf8PathBuf,
    /// The ceramic check board: 20x20 squares of 10 mm (section 4 of the paper).
    #[serde(deserialize_with = "check_board")]
    pub check_board: BoardSettings,
    /// The alumina target on the flange: 7x6 squares of 10 mm (section 4 of the paper).
    #[serde(deserialize_with = "target_board")]
    pub target_board: BoardSettings,
    /// The accuracy the rig must have, mm (section 4 of the paper).
    pub tolerance_mm: f64,
    /// Measuring the target on the robot.
    pub measure: MeasureSettings,
    /// Columns and units of tables of measurements.
    pub measurements: crate::measurements::source::Known,
    /// Identification: method, model, box, solvers.
    pub identify: crate::identify::Settings,
}

/// A board, and whether it is the paper's because none was said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardSettings {
    board: Board,
    is_assumed: bool,
}

/// A board as the file says it: by its name, or by its squares and their size.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoardFields {
    board: Option<NamedBoard>,
    squares: Option<Squares>,
    square_mm: Option<f64>,
}

impl BoardFields {
    /// The board of a section, where it is not empty.
    fn settings(self, default: BoardSettings) -> Result<BoardSettings, &'static str> {
        let board = match (self.board, self.squares, self.square_mm) {
            (None, None, None) => return Ok(default),
            (Some(NamedBoard(board)), None, None) => board,
            (None, Some(squares), Some(mm)) => Board::checker(squares, mm),
            (Some(_), ..) => return Err("`board` says squares and size already: it stands alone"),
            (None, None, _) => return Err("missing field `squares`, or `board`"),
            (None, _, None) => return Err("missing field `square_mm`"),
        };
        Ok(BoardSettings { board, is_assumed: false })
    }
}

fn check_board<'de, D: serde::Deserializer<'de>>(from: D) -> Result<BoardSettings, D::Error> {
    BoardFields::deserialize(from)?.settings(Config::default().check_board).map_err(serde::de::Error::custom)
}

fn target_board<'de, D: serde::Deserializer<'de>>(from: D) -> Result<BoardSettings, D::Error> {
    BoardFields::deserialize(from)?.settings(Config::default().target_board).map_err(serde::de::Error::custom)
}

/// What is known of the target on the robot.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MeasureSettings {
    /// Standard deviation of a crossing of the target against its drawing, by its certificate, mm: alumina is made to
    /// 10 um (section 4 of the paper). It bounds the target's size as well.
    pub crossing_mm: f64,
}

impl Default for MeasureSettings {
    fn default() -> MeasureSettings {
        MeasureSettings { crossing_mm: 0.01 }
    }
}

impl BoardSettings {
    fn assumed(columns: usize, rows: usize) -> BoardSettings {
        BoardSettings { board: Board::checker(Squares { columns, rows }, 10.0), is_assumed: true }
    }

    /// That nobody said how large the squares are, where it is so: no residual shows a wrong size.
    pub fn size_is_assumed(&self, named: Option<Board>, square_mm: Option<f64>) -> Option<String> {
        let is_assumed = self.is_assumed && named.is_none() && square_mm.is_none();
        is_assumed.then(|| {
            format!(
                "the squares are taken to be {} mm wide, because nobody said: every length comes from it; measure them and give `--square-mm`",
                self.board.square_mm
            )
        })
    }

    /// The board, with what was given on the command line instead of the file's values: a board, or squares and their
    /// size.
    pub fn board(&self, named: Option<Board>, squares: Option<Squares>, square_mm: Option<f64>) -> Result<Board> {
        let own = self.board;
        let board = named.unwrap_or(match (squares, square_mm) {
            (None, None) => own,
            _ => Board::checker(squares.unwrap_or(own.squares), square_mm.unwrap_or(own.square_mm)),
        });
        check_within("square_mm", board.square_mm, SQUARES_MM)?;
        Ok(board)
    }
}

impl Default for Config {
    fn default() -> Config {
        Config {
            out: "out".into(),
            check_board: BoardSettings::assumed(20, 20),
            target_board: BoardSettings::assumed(7, 6),
            tolerance_mm: 0.05,
            measure: MeasureSettings::default(),
            measurements: crate::measurements::source::Known::default(),
            identify: crate::identify::Settings::default(),
        }
    }
}

/// What makes the file.
const HINT: &str = "`stereocal init` writes one with every key and its meaning";

/// A key that stands where there is none of its name: most likely its section's line is a comment still.
fn of_section(error: files::Error) -> files::Error {
    match error {
        files::Error::Format { message, place, hint: None } if message.contains("unknown key") => {
            let hint = "a key belongs below the line of its section, as `squares` below `[check_board]`, and that line must not begin with `#`; \
                        `stereocal init --out new` writes every key where it belongs";
            files::Error::Format { message, place, hint: Some(hint.to_owned()) }
        }
        other => other,
    }
}

impl Config {
    /// The named file, or `stereocal.toml` in the working directory if it is there.
    pub fn file(path: Option<&Utf8Path>) -> Option<Utf8PathBuf> {
        path.or_else(|| Some(Utf8Path::new(DEFAULT_FILE)).filter(|file| file.is_file())).map(Utf8Path::to_owned)
    }

    /// Reads the file of settings, where there is one, and checks all of it.
    pub fn load(path: Option<&Utf8Path>) -> Result<Config> {
        let config = match Config::file(path) {
            Some(path) => files::read_toml(&path, "settings file", Some(HINT)).map_err(of_section)?,
            None => Config::default(),
        };
        config.validate()?;
        Ok(config)
    }

    fn validate(&self) -> Result<()> {
        let mut problems = Vec::new();
        within(&mut problems, "tolerance_mm", self.tolerance_mm, TOLERANCES_MM);
        within(&mut problems, "check_board.square_mm", self.check_board.board.square_mm, SQUARES_MM);
        within(&mut problems, "target_board.square_mm", self.target_board.board.square_mm, SQUARES_MM);
        positive(&mut problems, "measure.crossing_mm", self.measure.crossing_mm);
        self.measurements.validate(&mut problems);
        self.identify.validate(&mut problems);
        reject(problems)
    }
}

/// An error where a setting is beyond its range.
pub fn check_within(name: &str, value: f64, range: RangeInclusive<f64>) -> Result<()> {
    let mut problems = Vec::new();
    within(&mut problems, name, value, range);
    reject(problems)
}

/// An error where there are problems.
pub fn reject(problems: Vec<String>) -> Result<()> {
    if problems.is_empty() { Ok(()) } else { Err(Error::Invalid { problems }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_that_nobody_said_is_said() {
        let assumed = Config::default().check_board;
        assert!(assumed.size_is_assumed(None, None).is_some_and(|said| said.contains("10 mm")));
        assert_eq!(assumed.size_is_assumed(None, Some(10.0)), None);
        assert_eq!(assumed.size_is_assumed(Some("checker:9x7:20".parse().unwrap()), None), None);
        let config: Config = toml::from_str("[check_board]\nsquares = \"20x20\"\nsquare_mm = 10.0\n").unwrap();
        assert_eq!(config.check_board.size_is_assumed(None, None), None);
    }

    #[test]
    fn all_problems_come_at_once() {
        let config: Config =
            toml::from_str("tolerance_mm = -1.0\n[check_board]\nsquares = \"9x7\"\nsquare_mm = 0.0\n").unwrap();
        let message = config.validate().unwrap_err().to_string();
        assert!(message.contains("tolerance_mm is -1") && message.contains("check_board.square_mm is 0"), "{message}");
    }

    #[test]
    fn an_unknown_key_is_refused() {
        assert!(toml::from_str::<Config>("tolerance = 1.0").is_err());
    }
}
