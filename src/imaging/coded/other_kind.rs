//! What a picture shows in which nothing of a board was read: one of another kind, with markers or tags.
//!
//! In: a picture and the board that was looked for. Out: what is seen, with the dictionary, in the words by which hints
//! know it again. Goes wrong: markers too few or too small to be more than chance finds.

use super::copies::{grids_on, levels};
use super::explain;
use super::separate::family_seen;
use crate::imaging::Board;
use crate::imaging::board::{Kind, Pitch};
use crate::imaging::image::Picture;

/// What a picture shows that has a board with markers where one of another kind was looked for.
pub const HAS_MARKERS: &str = "shows a board with markers of ";

/// The same for a grid of tags, with black squares between them or without.
pub const HAS_TAGS: &str = "shows a grid of tags of ";

/// Whether a picture in which nothing of a board was read shows one of another kind with markers or tags.
pub fn of_other_kind(picture: &Picture, asked: &Board) -> Option<String> {
    /// Copies and grids that are looked at: markers that number a board are on the largest of them.
    const COPIES: usize = 2;
    const GRIDS: usize = 3;
    /// Most markers leave at least as much of a square free on each side, and borders of tags are wider.
    const MARGIN: f64 = 0.1;
    /// What Kalibr prints; grids of other gaps are found as long as they are not far from it.
    const GAP: f64 = 0.3;
    let markers = (Pitch::Even, matches!(asked.kind, Kind::Charuco { .. }));
    let tags = (Pitch::Tags { gap: GAP }, matches!(asked.kind, Kind::Tags { .. }));
    let others = [markers, tags].into_iter().filter(|(_, is_asked)| !is_asked);
    let in_grids = others.map(|(pitch, _)| pitch).find_map(|pitch| {
        let dictionary = levels(picture).take(COPIES).find_map(|level| {
            let mut found = grids_on((level, &level.copy(picture)), pitch, MARGIN, false).take(GRIDS);
            found.find_map(|grid| explain::dictionary_in(picture, &grid, pitch))
        })?;
        Some(match pitch {
            Pitch::Even => format!("{HAS_MARKERS}{} in its squares", dictionary.name()),
            Pitch::Tags { .. } => format!("{HAS_TAGS}{}", dictionary.said()),
        })
    });
    in_grids.or_else(|| {
        let family = if tags.1 { None } else { family_seen(picture) };
        family.map(|family| format!("{HAS_TAGS}{}", family.said()))
    })
}
