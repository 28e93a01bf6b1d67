//! How many squares the check board has: as was said, or as the pictures show.

use super::super::Result;
use crate::cli::{AskedSquares, CameraCheck};
use crate::imaging::Squares;
use crate::imaging::count::{Counted, count_squares};
use crate::imaging::input::pairs::Pairing;
use crate::{config, progress};

/// The squares that were said, or that the pictures show where they are to be counted.
pub fn squares(args: &CameraCheck, pairing: Option<&Pairing>) -> Result<Option<Squares>> {
    match (args.squares, pairing) {
        (None, _) => Ok(None),
        (Some(AskedSquares::Said(squares)), _) => Ok(Some(squares)),
        (Some(AskedSquares::Counted), Some(pairing)) => {
            let Counted { squares, pictures, ends, of } = count_squares(pairing, args.bayer)?;
            let shown = if ends { "show all of it" } else { "show so many and no more, without a margin round them" };
            progress::note(format!("the board has {squares} squares: {pictures} of {of} pictures {shown}"));
            Ok(Some(squares))
        }
        (Some(AskedSquares::Counted), None) => {
            let problem = "`--squares auto` counts in pictures, and --corners gives none".to_owned();
            Err(config::Error::Invalid { problems: vec![problem] }.into())
        }
    }
}
