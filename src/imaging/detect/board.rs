//! Where the board is that was asked for, plain or with markers.

use super::detected::{Detected, Refusal};
use super::plain;
use crate::imaging::image::Picture;
use crate::imaging::{Board, coded};

/// Looks for the board; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    if board.is_coded() {
        return coded::detect(picture, board);
    }
    plain::detect(picture, board).map_err(|refusal| coded::with_markers(picture).map_or(refusal, Refusal::from))
}
