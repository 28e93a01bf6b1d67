//! What looking for a board in a picture gives.

use crate::imaging::Board;
use crate::imaging::board::Print;
use crate::imaging::image::pyramid::{Level, coarse_factor};
use crate::imaging::image::{Grey8, Picture};
use crate::imaging::lattice::{Places, Renumbering};

/// Grids of fewer corners than this are chance.
pub const LEAST_SEEN: usize = 12;

/// A board found in a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Detected {
    /// Coarse places of the inner corners on the copy, px, to about half a pixel.
    pub corners: Places,
    pub copy: Grey8,
    /// Its size; never doubled.
    pub level: Level,
    /// How its markers are printed, where it has any.
    pub print: Option<Print>,
    /// What else the numbers of its corners could be, where that is open.
    pub open: Option<Open>,
}

impl Detected {
    /// A board without markers whose numbers are not open.
    pub fn plain(corners: Places, copy: Grey8, level: Level) -> Detected {
        Detected { corners, copy, level, print: None, open: None }
    }
}

/// Why a picture gave no corners.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// For a person.
    pub reason: String,
    /// The other board that the picture shows instead.
    pub seen: Option<Board>,
}

impl From<String> for Refusal {
    fn from(reason: String) -> Refusal {
        // One line: reasons are listed, one a line.
        Refusal { reason: reason.replace('\n', " "), seen: None }
    }
}

/// That the corners of a picture may have other numbers as well.
#[derive(Debug, Clone, PartialEq)]
pub struct Open {
    /// The others, each from the one that they have.
    pub others: Vec<Renumbering>,
    /// Why they are open, for a person.
    pub refusal: Refusal,
}

/// The copy on which whole boards with large squares are seen: half as long and wide as that of [`coarse_factor`] and
/// made of a few of the picture's lines, of a small picture the same.
pub fn glance_level(picture: &Picture) -> Level {
    let first = coarse_factor(picture);
    if first == 1 { Level::Reduced(1) } else { Level::Skimmed(2 * first) }
}

/// What was found on a copy, on one that is no finer than the picture.
pub fn on_a_copy(picture: &Picture, level: Level, small: &Grey8, corners: Places) -> Detected {
    match level {
        Level::Reduced(_) | Level::Skimmed(_) => Detected::plain(corners, small.clone(), level),
        Level::Doubled => {
            let level = Level::Reduced(1);
            let corners = corners.map(|p| level.to_copy(&Level::Doubled.to_picture(p)));
            Detected::plain(corners, level.copy(picture), level)
        }
    }
}
