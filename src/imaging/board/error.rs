//! What can be wrong with a board that is named.

use crate::diagnostic::Explain;

/// A board that was not understood; `found` is what was typed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A board's size was not understood.
    #[error("a board is given as COLUMNSxROWS squares, at least 3x3, got `{found}`")]
    Size { found: String },
    /// The counts of a grid of tags were not understood.
    #[error("a grid of tags is given as COLUMNSxROWS tags, at least 1x1, got `{found}`")]
    TagCounts { found: String },
    /// A board's name was not understood.
    #[error("`{found}` names no board: {why}")]
    Name { found: String, why: String },
}

impl Explain for Error {
    fn hint(&self) -> Option<String> {
        let hint = match self {
            Error::TagCounts { .. } => "`6x6` are six columns of six tags",
            Error::Size { .. } => "`--squares 20x20` is a board with 19x19 inner corners",
            Error::Name { .. } => {
                "`--board checker:20x20:10`, or `--board charuco:11x8:15:11:DICT_5X5_100` (columns, rows, square and marker in mm as printed)"
            }
        };
        Some(hint.to_owned())
    }
}
