//! Grids of tags that nothing dark touches, as OpenCV prints them, of AprilTags or ArUco markers: found in any part of
//! them.
//!
//! In: a picture and the board. Out: a reduced copy and the board's corners on it as far as they are seen, each at its
//! place on the board. Method: dark shapes of four sides (`quads`), on copies from coarse to fine until the tags' bits
//! are large enough; the code of each says which tag it is. Where each says that the others are is where they must be:
//! a tag that most of those round it do not confirm is none of the board's, or has been moved. Goes wrong: a single
//! tag, which nothing confirms; tags whose outline is cut off by the picture's border.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix3, Point2};

use self::quads::{Quad, quads};
use super::copies::{ENOUGH_MARGIN_PX, levels, without_strays};
use super::detection;
use super::explain;
use super::marker::{Fields, Marker, fields, grey_at, mapped, read, square_map};
use super::numbering::{AGREEING, tolerated};
use crate::imaging::Board;
use crate::imaging::board::dictionary::Dictionary;
use crate::imaging::board::{Kind, Layout, Print, Squares};
use crate::imaging::detect::{Detected, Refusal, on_a_copy};
use crate::imaging::image::pyramid::Level;
use crate::imaging::image::{Grey8, Picture};
use crate::imaging::lattice::{Lattice, Places};

/// How far tags tell of each other, in tags.
const REACH: isize = 2;
/// By how much the middle of another tag may be off where a tag has it, in sides of a tag a tag and gap away: a tag's
/// own corners are seen to a fraction of a pixel of its own side.
const OFF: f64 = 0.15;
/// Most columns of a board.
const MOST_COLUMNS: usize = 40;
/// Share of the places beyond the tags' corners that are dark where black squares stand there, at the least.
const DARK: f64 = 0.5;

/// What is seen of tags in a picture.
enum Seen {
    /// The board's.
    Grid(Detected),
    /// Tags with black squares between them.
    WithSquares,
    /// Tags that are no part of the board, with the reason.
    Other(Refusal),
    Nothing,
}

/// Looks for a grid of tags, whosever it is where that is not said; the reason where it was not found.
pub fn detect(picture: &Picture, board: Board) -> Result<Detected, Refusal> {
    let layout = match board.kind {
        Kind::Tags { layout, .. } => layout,
        _ => return detection::detect(picture, board),
    };
    let said = |other: Layout| {
        let reason = format!("shows the tags in {}; --board says the other", other.said());
        Refusal { reason, seen: Some(board.with_layout(other)) }
    };
    match layout {
        Some(Layout::Grid) => match look(picture, &board) {
            Seen::Grid(detected) => Ok(detected),
            Seen::Other(refusal) => Err(refusal),
            seen @ (Seen::WithSquares | Seen::Nothing) => {
                match detection::detect(picture, board.with_layout(Layout::Tags)) {
                    Ok(_) => Err(said(Layout::Tags)),
                    Err(_) if matches!(seen, Seen::WithSquares) => Err(said(Layout::Tags)),
                    Err(_) => Err(family::of_another(picture, &board)
                        .unwrap_or_else(|| "shows no tag of the board that can be read".to_owned().into())),
                }
            }
        },
        _ => {
            let separate = board.with_layout(Layout::Grid);
            // Looking for Kalibr's squares takes far longer where there are none.
            let first = glance(picture, &separate);
            if matches!(first, Seen::Grid(_)) && layout.is_some() {
                return Err(said(Layout::Grid));
            }
            if matches!(first, Seen::Grid(_))
                && let Seen::Grid(detected) = look(picture, &separate)
            {
                return Ok(detected);
            }
            let refusal = match detection::detect(picture, board) {
                Ok(detected) => return Ok(detected),
                Err(refusal) => refusal,
            };
            match look(picture, &separate) {
                Seen::Grid(_) if layout.is_some() => Err(said(Layout::Grid)),
                Seen::Grid(detected) => Ok(detected),
                Seen::Other(other) => Err(other),
                Seen::Nothing if explain::is_unread(&refusal) => {
                    Err(family::of_another(picture, &separate).unwrap_or(refusal))
                }
                Seen::WithSquares | Seen::Nothing => Err(refusal),
            }
        }
    }
}

/// A tag that was read.
struct Tag {
    number: usize,
    /// Its corners in the picture, clockwise from the upper left as OpenCV prints it.
    corners: Quad,
    /// From its own sides to the picture, and back.
    maps: [Matrix3<f64>; 2],
    /// Of the places beyond its corners the share that is dark.
    dark: f64,
    fields: Fields,
}

impl Tag {
    /// The tag in a shape, if it is one of a family.
    fn of(picture: &Picture, quad: &Quad, family: Dictionary, fields: Fields) -> Option<Tag> {
        let marker = read(picture, quad, fields).filter(|marker| !marker.inverted)?;
        let number = number(marker, family)?;
        // The corner that it begins with is the one from which its code is read as it stands.
        let turned = (0..4).map(|by| [0, 1, 2, 3].map(|k| quad[(k + by) % 4]));
        let differs = |corners: &Quad| {
            let code = family.code(number)?;
            Some(read(picture, corners, fields)?.differs_from(code)).filter(|wrong| *wrong <= tolerated(fields.bits))
        };
        let (_, corners) =
            turned.filter_map(|corners| Some((differs(&corners)?, corners))).min_by_key(|(wrong, _)| *wrong)?;
        let map = square_map(&corners)?;
        let maps = [map, map.try_inverse()?];
        Some(Tag { number, corners, dark: dark_beyond(picture, &map, fields)?, maps, fields })
    }

    fn middle(&self) -> Point2<f64> {
        mapped(&self.maps[0], 0.5, 0.5)
    }
}

/// The number of a marker in a family, however it is turned; `None` where it is none of it, or as near to two.
fn number(marker: Marker, family: Dictionary) -> Option<usize> {
    let turns = [0, 1, 2, 3].map(|quarters| marker.turned(quarters));
    let wrong = |number: usize| {
        let code = family.code(number)?;
        turns.iter().map(|turned| turned.differs_from(code)).min()
    };
    let mut best: (usize, Option<usize>) = (tolerated(marker.bits) + 1, None);
    for number in 0..family.count() {
        match wrong(number) {
            Some(by) if by < best.0 => best = (by, Some(number)),
            Some(by) if by == best.0 => best.1 = None,
            _ => {}
        }
    }
    best.1
}

/// Of the places beyond a tag's corners, in the middles of where gaps cross, the share that is nearer to its border's
/// grey than to the paper's.
fn dark_beyond(picture: &Picture, map: &Matrix3<f64>, fields: Fields) -> Option<f64> {
    let beyond = fields.beyond();
    let border = 0.5 * fields.margin();
    let mean = |places: [(f64, f64); 4]| {
        let greys = places.map(|(x, y)| grey_at(picture, &mapped(map, x, y)));
        let [Some(a), Some(b), Some(c), Some(d)] = greys else { return None };
        Some([a, b, c, d])
    };
    let middle = |at: f64| [(0.5, at), (0.5, 1.0 - at), (at, 0.5), (1.0 - at, 0.5)];
    let sum = |greys: [f64; 4]| greys.iter().sum::<f64>() / 4.0;
    let level = 0.5 * (sum(mean(middle(beyond))?) + sum(mean(middle(border))?));
    let far = 1.0 - beyond;
    let corners = mean([(beyond, beyond), (far, beyond), (far, far), (beyond, far)])?;
    Some(corners.iter().filter(|grey| **grey < level).count() as f64 / 4.0)
}

/// All tags of a family on a copy.
fn tags_on(picture: &Picture, (level, copy): (Level, &Grey8), family: Dictionary, ways: &[Fields]) -> Vec<Tag> {
    let in_picture = |quad: Quad| quad.map(|p| level.to_picture(&p));
    let one = |quad: Quad| ways.iter().find_map(|fields| Tag::of(picture, &quad, family, *fields));
    quads(copy).into_iter().map(in_picture).filter_map(one).collect()
}

/// How tags stand to each other.
struct Order {
    /// Columns of tags.
    columns: usize,
    /// Whether they are upside down: as their makers print them.
    upside_down: bool,
    /// The tags that those round them confirm.
    confirmed: Vec<usize>,
    /// How many are contradicted by more than confirm them.
    contradicted: usize,
}

impl Order {
    fn place(&self, number: usize) -> (isize, isize) {
        ((number % self.columns) as isize, (number / self.columns) as isize)
    }

    /// How tags would stand to each other on a board of so many columns.
    fn of(tags: &[Tag], pitch: f64, columns: usize, upside_down: bool) -> Order {
        let mut order = Order { columns, upside_down, confirmed: Vec::new(), contradicted: 0 };
        for (i, tag) in tags.iter().enumerate() {
            let (mut right, mut wrong) = (0, 0);
            for other in tags.iter().enumerate().filter(|(k, _)| *k != i).map(|(_, other)| other) {
                match order.agree(tag, other, pitch) {
                    Some(true) => right += 1,
                    Some(false) => wrong += 1,
                    None => {}
                }
            }
            if right > wrong {
                order.confirmed.push(i);
            } else if wrong > 0 {
                order.contradicted += 1;
            }
        }
        order
    }

    /// Whether two tags are where each has the other; `None` where they are too far apart to tell, on the board and in
    /// the picture.
    fn agree(&self, tag: &Tag, other: &Tag, pitch: f64) -> Option<bool> {
        let ((x, y), (col, row)) = (self.place(tag.number), self.place(other.number));
        let (dx, dy) = (col - x, row - y);
        let sign = if self.upside_down { -1.0 } else { 1.0 };
        let off = |from: &Tag, to: &Tag, dx: isize, dy: isize| {
            let seen = mapped(&from.maps[1], to.middle().x, to.middle().y);
            let [should_x, should_y] = [dx, dy].map(|tags| 0.5 + sign * pitch * tags as f64);
            ((seen.x - should_x).hypot(seen.y - should_y), (seen.x - 0.5).hypot(seen.y - 0.5))
        };
        let both = [off(tag, other, dx, dy), off(other, tag, -dx, -dy)];
        let is_near = dx.abs().max(dy.abs()) <= REACH && (dx, dy) != (0, 0);
        let seems_near = both.iter().any(|(_, apart)| *apart < pitch * (REACH as f64 - 0.5));
        let most = OFF * pitch * (dx.abs().max(dy.abs()).max(1) as f64).powi(2);
        (is_near || seems_near).then(|| is_near && both.iter().any(|(off, _)| *off <= most))
    }

    fn is_sure(&self, tags: usize) -> bool {
        self.confirmed.len() >= 2.min(tags) && self.confirmed.len() > AGREEING * self.contradicted
    }
}

/// What the coarsest copy of a picture shows of a grid of separate tags.
fn glance(picture: &Picture, board: &Board) -> Seen {
    look_on(picture, board, levels(picture).take(1))
}

/// What a picture shows of it.
fn look(picture: &Picture, board: &Board) -> Seen {
    look_on(picture, board, levels(picture))
}

fn look_on(picture: &Picture, board: &Board, levels: impl Iterator<Item = Level>) -> Seen {
    let Kind::Tags { family, .. } = board.kind else { return Seen::Nothing };
    let mut ways = fields(board);
    // OpenCV's have a border of one bit.
    ways.reverse();
    let [columns, rows] = board.tags();
    let mut best: Option<(Vec<Tag>, Level, Grey8)> = None;
    for level in levels {
        let copy = level.copy(picture);
        let tags = tags_on(picture, (level, &copy), family, &ways);
        let field_px = |tag: &Tag| {
            let side = (0..4).map(|k| (tag.corners[k] - tag.corners[(k + 1) % 4]).norm()).fold(f64::INFINITY, f64::min);
            side * tag.fields.margin() / level.scale()
        };
        let least_px = tags.iter().map(field_px).fold(f64::INFINITY, f64::min);
        let is_done = tags.len() >= columns * rows || !tags.is_empty() && least_px >= ENOUGH_MARGIN_PX;
        if !tags.is_empty() && best.as_ref().is_none_or(|(known, ..)| tags.len() > known.len()) {
            best = Some((tags, level, copy));
        }
        if is_done {
            break;
        }
    }
    match best {
        Some((tags, level, copy)) => judged(picture, board, &tags, (level, &copy)),
        None => Seen::Nothing,
    }
}

/// What tags are by how they stand to each other.
fn judged(picture: &Picture, board: &Board, tags: &[Tag], (level, copy): (Level, &Grey8)) -> Seen {
    let dark = tags.iter().map(|tag| tag.dark).sum::<f64>() / tags.len() as f64;
    if dark > DARK {
        return Seen::WithSquares;
    }
    let ([columns, rows], pitch) = (board.tags(), 1.0 + board.pitch().after(1));
    let of = |columns: usize| {
        let [upright, upside_down] = [false, true].map(|upside_down| Order::of(tags, pitch, columns, upside_down));
        if upside_down.confirmed.len() > upright.confirmed.len() { upside_down } else { upright }
    };
    let order = of(columns);
    // The only tag of a board of one needs no other.
    let is_whole = columns * rows == 1 && tags.len() == 1 && tags[0].number == 0;
    if !is_whole && !order.is_sure(tags.len().max(2)) {
        let others = (1..=MOST_COLUMNS).filter(|other| *other != columns).map(of);
        return match unlike(board, tags, others) {
            Seen::Other(refusal) => Seen::Other(family::of_another(picture, board).unwrap_or(refusal)),
            seen => seen,
        };
    }
    let kept: Vec<usize> = if is_whole { vec![0] } else { order.confirmed.clone() };
    let mut by_number: BTreeMap<usize, usize> = BTreeMap::new();
    for &i in &kept {
        if by_number.insert(tags[i].number, i).is_some() {
            return Seen::Other(TWO_BOARDS.to_owned().into());
        }
    }
    if by_number.keys().any(|number| *number >= columns * rows) {
        let reason = format!("shows a board larger than {}: its tags go on beyond those", board.said());
        return Seen::Other(Refusal { reason, seen: None });
    }
    let corners = laid(board, tags, &by_number, order.upside_down);
    let corners = without_strays(corners, board.pitch());
    let fields = tags[kept[0]].fields;
    let print = Print { share: fields.marked(), pitch: board.pitch(), layout: Layout::Grid, inverted: false };
    let on_copy = corners.map(|p| level.to_copy(p));
    Seen::Grid(Detected { print: Some(print), ..on_a_copy(picture, level, copy, on_copy) })
}

/// The corners of tags at their places on the board.
fn laid(board: &Board, tags: &[Tag], by_number: &BTreeMap<usize, usize>, upside_down: bool) -> Places {
    let columns = board.tags()[0];
    Lattice::from_fn(board.columns(), board.rows(), |col, row| {
        let tag = &tags[*by_number.get(&(row / 2 * columns + col / 2))?];
        let corner = [[0, 1], [3, 2]][row % 2][col % 2];
        Some(tag.corners[if upside_down { (corner + 2) % 4 } else { corner }])
    })
}

const TWO_BOARDS: &str = "shows two boards with the same markers: cover one of them";

/// Why tags are none of the board's.
fn unlike(board: &Board, tags: &[Tag], others: impl Iterator<Item = Order>) -> Seen {
    let best = others.filter(|order| order.is_sure(tags.len().max(2))).max_by_key(|order| order.confirmed.len());
    let [columns, rows] = board.tags();
    if let Some(other) = best {
        let reason = format!(
            "shows the markers of a board of {} columns of tags; --board says {columns}x{rows} (columns first, as printed)",
            other.columns
        );
        // Columns and rows are easily said in the wrong order.
        let is_exchanged = other.columns == rows;
        let rows = if is_exchanged { board.squares.columns } else { board.squares.rows };
        let squares = Squares { columns: 2 * other.columns + 1, rows };
        return Seen::Other(Refusal { reason, seen: Some(Board { squares, ..*board }) });
    }
    let numbers: BTreeSet<usize> = tags.iter().map(|tag| tag.number).collect();
    match tags.len() {
        0 | 1 => Seen::Nothing,
        // Most numbers stand there twice.
        count if 2 * (count - numbers.len()) > numbers.len() => Seen::Other(TWO_BOARDS.to_owned().into()),
        count => {
            let reason = format!(
                "shows {count} tags of the board, in another order or at other distances than {board} has them"
            );
            Seen::Other(reason.into())
        }
    }
}

mod family;
mod quads;
#[cfg(test)]
mod tests;

pub use family::family_seen;
