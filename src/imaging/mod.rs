//! From a folder of pictures to the corners of the board in each, in an order both cameras agree on.

pub mod board;
pub mod corners;
pub mod corners_file;

use crate::error::Explain;

pub use board::Board;
pub use corners::{Corner, Corners, PairCorners, Side, Skipped};

/// What can go wrong between a folder and its corners.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A board's size was not understood.
    #[error("a board is given as COLUMNSxROWS squares, at least 3x3, got `{found}`")]
    BoardSize {
        /// What was typed.
        found: String,
    },
}

impl Explain for Error {
    fn hint(&self) -> Option<String> {
        match self {
            Error::BoardSize { .. } => Some("`--squares 20x20` is a board with 19x19 inner corners".to_owned()),
        }
    }
}
