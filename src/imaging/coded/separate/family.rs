//! Which dictionary the markers of a picture are of that stand by themselves, whatever board was looked for.
//!
//! In: a picture. Out: the dictionary that most of its markers are of, where they are more than chance finds.

use std::cmp::Ordering;

use nalgebra::Point2;

use super::super::copies::levels;
use super::super::marker::{Fields, Marker, TAG_BORDERS, mapped, read, square_map};
use super::quads::{Quad, quads};
use crate::imaging::board::dictionary::Dictionary;
use crate::imaging::board::{Board, Kind};
use crate::imaging::detect::Refusal;
use crate::imaging::image::Picture;

/// Copies that are looked at, from coarse to fine: markers that number a board are on the largest of them.
const COPIES: usize = 2;

/// Markers of one dictionary, and the shapes that they were read in.
type Known = (Dictionary, Vec<Quad>);

/// What is said of a picture with tags of another family or dictionary, where more are read than chance finds.
pub fn of_another(picture: &Picture, board: &Board) -> Option<Refusal> {
    let Kind::Tags { family, gap_mm, .. } = board.kind else { return None };
    let (other, _) = most(picture, gap_mm / board.square_mm, Some(family)).filter(|(other, _)| *other != family)?;
    let reason = format!("shows markers of {}, the board has those of {}", other.said(), family.said());
    Some(Refusal { reason, seen: board.with_dictionary(other) })
}

/// The dictionary of a grid of separate tags or markers in a picture.
pub fn family_seen(picture: &Picture) -> Option<Dictionary> {
    /// About what OpenCV's programs print; the paper is looked for half as far from a tag.
    const GAP: f64 = 0.25;
    let (dictionary, shapes) = most(picture, GAP, None)?;
    let in_rows = shapes.iter().filter(|quad| nearest_is_beside(quad, &shapes)).count();
    (2 * in_rows > shapes.len()).then_some(dictionary)
}

/// Whether the nearest of the other markers lies beside one, as in a grid; those in a board's squares lie across from
/// each other.
fn nearest_is_beside(quad: &Quad, all: &[Quad]) -> bool {
    let Some(back) = square_map(quad).and_then(|map| map.try_inverse()) else { return false };
    let middle = |other: &Quad| other.iter().fold(Point2::origin(), |sum, corner| sum + corner.coords / 4.0);
    let off = |other: &Quad| {
        let at = mapped(&back, middle(other).x, middle(other).y);
        [(at.x - 0.5).abs(), (at.y - 0.5).abs()]
    };
    let length = |[x, y]: &[f64; 2]| x.hypot(*y);
    let others = all.iter().filter(|other| *other != quad).map(off);
    let nearest = others.min_by(|a, b| length(a).partial_cmp(&length(b)).unwrap_or(Ordering::Equal));
    nearest.is_some_and(|[x, y]| x.min(y) < 0.5 * x.max(y))
}

/// The dictionary that most separate markers are of. The one of a board comes before others that begin with the same
/// markers, and the smaller before the larger.
fn most(picture: &Picture, gap: f64, own: Option<Dictionary>) -> Option<Known> {
    /// More than chance finds.
    const FEWEST: usize = 4;
    let ways = TAG_BORDERS.into_iter().flat_map(|border| (4..=7).map(move |bits| Fields::of_tag(gap, bits, border)));
    let ways: Vec<Fields> = ways.collect();
    levels(picture).take(COPIES).find_map(|level| {
        let shapes = quads(&level.copy(picture)).into_iter().map(|quad| quad.map(|p| level.to_picture(&p)));
        let shapes: Vec<Quad> = shapes.collect();
        let mut best: Option<Known> = None;
        for fields in &ways {
            let one = |quad: &Quad| {
                let marker = read(picture, quad, *fields).filter(|marker| !marker.inverted)?;
                Some((*quad, marker))
            };
            let markers: Vec<(Quad, Marker)> = shapes.iter().filter_map(one).collect();
            if markers.len() < FEWEST {
                continue;
            }
            let all = own.into_iter().chain(Dictionary::all());
            for dictionary in all.filter(|dictionary| dictionary.bits() == fields.bits) {
                let is_known = |(_, marker): &&(Quad, Marker)| is_of(marker, dictionary);
                let known: Vec<Quad> = markers.iter().filter(is_known).map(|(quad, _)| *quad).collect();
                let is_more = best.as_ref().is_none_or(|(_, most)| known.len() > most.len());
                if is_more && known.len() >= FEWEST && 2 * known.len() > markers.len() {
                    best = Some((dictionary, known));
                }
            }
        }
        best
    })
}

fn is_of(marker: &Marker, dictionary: Dictionary) -> bool {
    let turns = [0, 1, 2, 3].map(|quarters| marker.turned(quarters).code);
    (0..dictionary.count()).any(|id| dictionary.code(id).is_some_and(|code| turns.contains(&code)))
}
