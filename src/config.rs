//! `stereocal.toml`: every default in one place. A flag beats the file, the file beats the default.

use camino::{Utf8Path, Utf8PathBuf};
use serde::Deserialize;

use crate::error::{Explain, Result};
use crate::files;
use crate::imaging::board::{Board, Squares};

/// The file that is read when none is named.
pub const DEFAULT_FILE: &str = "stereocal.toml";

/// Settings that make no sense.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// All that is wrong, at once.
    #[error("{} not possible: {}", if .problems.len() == 1 { "a setting is" } else { "settings are" }, .problems.join("; "))]
    Invalid {
        /// One line a problem.
        problems: Vec<String>,
    },
}

impl Explain for Error {}

/// Everything that can be set.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where results go.
    pub out: Utf8PathBuf,
    /// The ceramic check board: 20x20 squares of 10 mm (section 4 of the paper).
    pub check_board: BoardSettings,
    /// The alumina target on the flange: 7x6 squares of 10 mm (section 4 of the paper).
    pub target_board: BoardSettings,
    /// The accuracy the rig must have, mm (section 4 of the paper).
    pub tolerance_mm: f64,
    /// Identification: method, model, box, solvers.
    pub identify: crate::identify::Settings,
}

/// A board in the file.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardSettings {
    /// Number of squares.
    pub squares: Squares,
    /// Side of a square, mm.
    pub square_mm: f64,
}

impl BoardSettings {
    /// The board, with what was given on the command line instead of the file's values.
    pub fn board(&self, squares: Option<Squares>, square_mm: Option<f64>) -> Result<Board> {
        let board = Board { squares: squares.unwrap_or(self.squares), square_mm: square_mm.unwrap_or(self.square_mm) };
        let mut problems = Vec::new();
        positive(&mut problems, "square_mm", board.square_mm);
        reject(problems)?;
        Ok(board)
    }
}

impl Default for Config {
    fn default() -> Config {
        Config {
            out: "out".into(),
            check_board: BoardSettings { squares: Squares { columns: 20, rows: 20 }, square_mm: 10.0 },
            target_board: BoardSettings { squares: Squares { columns: 7, rows: 6 }, square_mm: 10.0 },
            tolerance_mm: 0.05,
            identify: crate::identify::Settings::default(),
        }
    }
}

impl Config {
    /// Reads the named file, or `stereocal.toml` in the working directory if it is there, and checks all of it.
    pub fn load(path: Option<&Utf8Path>) -> Result<Config> {
        let config = match path {
            Some(path) => files::read_toml(path, "the configuration", None)?,
            None if Utf8Path::new(DEFAULT_FILE).is_file() => {
                files::read_toml(Utf8Path::new(DEFAULT_FILE), "the configuration", None)?
            }
            None => Config::default(),
        };
        config.validate()?;
        Ok(config)
    }

    fn validate(&self) -> Result<()> {
        let mut problems = Vec::new();
        positive(&mut problems, "tolerance_mm", self.tolerance_mm);
        positive(&mut problems, "check_board.square_mm", self.check_board.square_mm);
        positive(&mut problems, "target_board.square_mm", self.target_board.square_mm);
        self.identify.validate(&mut problems);
        reject(problems)
    }
}

/// Notes a problem unless the value is finite and above zero.
pub fn positive(problems: &mut Vec<String>, name: &str, value: f64) {
    if !(value.is_finite() && value > 0.0) {
        problems.push(format!("{name} is {value}; it must be above zero"));
    }
}

/// An error where there are problems.
pub fn reject(problems: Vec<String>) -> Result<()> {
    if problems.is_empty() { Ok(()) } else { Err(Error::Invalid { problems }.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

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
