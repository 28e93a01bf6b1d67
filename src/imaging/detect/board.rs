//! Where the board is that was asked for, plain or with markers.

use super::detected::{Detected, Refusal};
use super::plain;
use crate::imaging::image::Picture;
use crate::imaging::{Board, coded};

/// Looks for the board; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    if board.is_coded() { coded::detect(picture, board) } else { plain::detect(picture, board) }
}
