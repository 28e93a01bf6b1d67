//! What surrounds a corner: its edges, as long as its squares, and the markers in two of these.

use nalgebra::{Point2, Vector2};

use super::saddle_fit::window::Quad;
use crate::imaging::Board;
use crate::imaging::board::{Layout, Pitch, Print};
use crate::imaging::coded::local_map;
use crate::imaging::coded::marker::{mapped, square_map};
use crate::imaging::lattice::Places;

/// What a marker's outline reaches beyond it, blurs, and how far from where it should be it may lie, px: it is drawn in
/// whole pixels, and placed by corners of the reduced copy.
const HALO_BLURS: f64 = 3.0;
const HALO_PX: f64 = 0.5;
/// How far from where they should be the next edges may lie, px.
const NEXT_PX: f64 = 1.0;
/// Least margin between an edge and a marker beside it in which the edge is seen by itself, px and in blurs.
const LEAST_MARGIN_PX: f64 = 2.0;
const LEAST_MARGIN_BLURS: f64 = 3.0;
/// The same beside a tag, between whose bits and the next tag an edge seems sharper than it is: of rendered ones with
/// gaps or borders of 2.6 to 3 blurs the fits made 3.1 to 3.4, and places two to three of their sigmas off.
const LEAST_TAG_MARGIN_BLURS: f64 = 3.5;

/// A square with a marker, from the corner on: where its own four corners lie, relative to the corner.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Marked([Vector2<f64>; 4]);

/// A corner's surroundings: vectors along the two edges, as long as to the nearer neighbour.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    /// Where the corner is thought to be, px.
    pub(super) place: Point2<f64>,
    /// Along the rows and along the columns, px.
    pub(super) edges: [Vector2<f64>; 2],
    /// Whose bend nothing but the corner's own window tells.
    pub(super) own_bends: [bool; 2],
    /// Side of the markers, as a share of a square's.
    pub(super) share: f64,
    /// Side of such a square, as a share of the shorter edge.
    pub(super) square: f64,
    /// The squares that hold them.
    pub(super) marked: [Option<Marked>; 2],
    /// On which sides of the edges the only dark quadrant is, where there is but one.
    pub(super) dark: Option<[f64; 2]>,
}

impl Cell {
    /// The cell of a corner; `None` where it has no neighbour along one of its edges, or squares too small or too
    /// oblique to hold an edge.
    pub(super) fn of(places: &Places, col: usize, row: usize) -> Option<Cell> {
        /// Least height of a square over its side, px.
        const LEAST_HEIGHT_PX: f64 = 2.0;
        let place = *places.get(col, row)?;
        let (c, r) = (col as isize, row as isize);
        let edge = |dc: isize, dr: isize| {
            let forth = places.around(c + dc, r + dr).map(|p| p - place);
            let back = places.around(c - dc, r - dr).map(|p| place - p);
            match (forth, back) {
                (Some(f), Some(b)) => Some((f + b).normalize() * f.norm().min(b.norm())),
                (one, other) => one.or(other),
            }
        };
        let cell = Cell {
            place,
            edges: [edge(1, 0)?, edge(0, 1)?],
            own_bends: [false; 2],
            share: 0.0,
            square: 1.0,
            marked: [None; 2],
            dark: None,
        };
        (cell.side() * cell.skew() > LEAST_HEIGHT_PX).then_some(cell)
    }

    /// The same on a board with markers.
    pub(super) fn with_markers(self, places: &Places, (col, row): (usize, usize), print: Option<Print>) -> Cell {
        let Some(Print { share, layout, pitch, .. }) = print else { return self };
        let edges = if layout == Layout::Grid { self.within_gaps(places, pitch, [col, row]) } else { self.edges };
        let (col, row) = (col as isize, row as isize);
        // Of the four squares round a corner two that lie opposite hold markers, or one is a tag.
        let round = [(0, 0), (-1, -1), (-1, 0), (0, -1)];
        let mut holding = round.into_iter().filter(|(c, r)| layout.holds_marker(col + 1 + c, row + 1 + r));
        // The cell's own edges reach to the nearest neighbours.
        let side = 1.0 / pitch.least();
        let marked = [holding.next(), holding.next()].map(|square| {
            let (c, r) = square?;
            let known = local_map::square(places, pitch, (col + c, row + r));
            let [a, b] = edges.map(|edge| edge * side);
            let edges_only = || {
                let first = a * c as f64 + b * r as f64;
                [first, first + a, first + a + b, first + b]
            };
            Some(Marked(known.map_or_else(edges_only, |corners| corners.map(|p| p - self.place))))
        });
        let dark = (layout == Layout::Grid).then(|| {
            let [right, down] = Board::outwards(col as usize, row as usize).map(|out| -out);
            let normal = |k: usize| Vector2::new(-edges[k].y, edges[k].x);
            [normal(0).dot(&(edges[1] * down)).signum(), normal(1).dot(&(edges[0] * right)).signum()]
        });
        Cell { edges, share, marked, square: side, dark, ..self }
    }

    /// The edges, no longer than a gap is wide where the tag beyond the gap is not seen: what is there instead nobody
    /// knows.
    fn within_gaps(&self, places: &Places, pitch: Pitch, [col, row]: [usize; 2]) -> [Vector2<f64>; 2] {
        let [x, y] = Board::outwards(col, row).map(|out| out as isize);
        let (c, r) = (col as isize, row as isize);
        let is_seen = [places.around(c + x, r).is_some(), places.around(c, r + y).is_some()];
        [0, 1].map(|k| if is_seen[k] { self.edges[k] } else { self.edges[k] * pitch.least() })
    }

    /// Over how much of bend times the half of a window squared a straight edge is off at the corner: through it by a
    /// sixth, where it ends there by a twelfth the other way.
    pub(super) fn straight(&self) -> f64 {
        if self.dark.is_some() { -12.0 } else { 6.0 }
    }

    /// Whether it lies on a board with markers.
    pub(super) fn has_markers(&self) -> bool {
        self.marked != [None; 2]
    }

    /// Distance from an edge to the markers beside it, px, no farther than the next edge; infinite without markers.
    fn margin_px(&self) -> f64 {
        if !self.has_markers() {
            return f64::INFINITY;
        }
        // Beyond a grid's outermost tags there are squares as wide as a gap, too.
        ((1.0 - self.share) / 2.0).min(1.0 / self.square) * self.square_height_px()
    }

    /// The least height of the squares with markers over the edges that meet at the corner, px. At the border of a grid
    /// of tags an edge is as long as a tag one way and as a gap the other, and what is short in the picture may be
    /// either.
    fn square_height_px(&self) -> f64 {
        // Of a checkerboard every edge is a square's.
        if self.square <= 1.0 {
            return self.side() * self.skew();
        }
        let height = |marked: &Marked| {
            let at = (0..4).min_by(|a, b| marked.0[*a].norm().total_cmp(&marked.0[*b].norm())).unwrap_or(0);
            let [a, b] = [1, 3].map(|next| marked.0[(at + next) % 4] - marked.0[at]);
            (a.x * b.y - a.y * b.x).abs() / a.norm().max(b.norm())
        };
        self.marked.iter().flatten().map(height).fold(f64::INFINITY, f64::min)
    }

    /// Whether a first fit, whose window leaves out what a sharp picture shows of the markers, is more than a start.
    /// Two markers that lie opposite each other pull a corner hardly; a tag has none opposite, and the next corner is
    /// but a gap away. Beside a single dark quadrant the bits of its tag are as near as its border is wide: such a fit
    /// is a start and no more.
    pub(super) fn stands_alone(&self, blur_px: f64) -> bool {
        self.square <= 1.0 || self.dark.is_none() && self.hidden(blur_px).is_some()
    }

    /// What a window of such a blur leaves out; `None` where markers stand too near for the edges to be seen by
    /// themselves.
    pub(super) fn hidden(&self, blur_px: f64) -> Option<[Option<Quad>; 2]> {
        let least = if self.square > 1.0 { LEAST_TAG_MARGIN_BLURS } else { LEAST_MARGIN_BLURS };
        let is_clear = self.margin_px() >= LEAST_MARGIN_PX.max(least * blur_px);
        is_clear.then(|| self.hidden_by(HALO_BLURS * blur_px + self.unless_in_tag(HALO_PX)))
    }

    /// How far from where they should be the next edges may lie, px.
    pub(super) fn next_px(&self) -> f64 {
        self.unless_in_tag(NEXT_PX)
    }

    /// A tag's bits are printed with its edges, and its border is so narrow that a px of it is most of what a window
    /// leaves: there nothing is left out for what may lie elsewhere.
    fn unless_in_tag(&self, px: f64) -> f64 {
        if self.dark.is_some() { 0.0 } else { px }
    }

    /// The markers beside the corner, larger by a halo, px.
    pub(super) fn hidden_by(&self, halo_px: f64) -> [Option<Quad>; 2] {
        // What an edge's own blur shows of a marker is nothing where it begins within the halo.
        let near = ((1.0 - self.share) / 2.0 - halo_px / self.square_height_px()).max(0.0);
        self.marked.map(|marked| {
            let corners = marked?.0.map(Point2::from);
            let map = square_map(&corners)?;
            let far = 1.0 - near;
            Some(Quad([(near, near), (far, near), (far, far), (near, far)].map(|(x, y)| mapped(&map, x, y).coords)))
        })
    }

    /// Length of the shorter edge, px.
    pub(super) fn side(&self) -> f64 {
        self.edges[0].norm().min(self.edges[1].norm())
    }

    /// A window's halves along the edges, as shares of them.
    pub(super) fn reach(&self, halves: &[Vector2<f64>; 2]) -> [f64; 2] {
        [0, 1].map(|k| halves[k].norm() / self.edges[k].norm())
    }

    /// Sine of the angle between the edges.
    pub(super) fn skew(&self) -> f64 {
        let [a, b] = self.edges;
        (a.x * b.y - a.y * b.x).abs() / (a.norm() * b.norm())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::lattice::Lattice;

    /// A grid of tags of 40 px, their gaps a share of it, seen so obliquely that its columns are as short as this.
    fn margin_px(gap: f64, foreshortened: f64, at: (usize, usize)) -> f64 {
        let pitch = Pitch::Tags { gap };
        let x = |line: usize| 40.0 * pitch.at(line as isize);
        let places: Places = Lattice::from_fn(12, 8, |c, r| Some(Point2::new(x(c), foreshortened * x(r))));
        // Two of eight fields are border.
        let print = Print { share: 0.5, pitch, layout: Layout::Tags, inverted: false };
        let cell = Cell::of(&places, at.0, at.1).map(|cell| cell.with_markers(&places, at, Some(print)));
        cell.map_or(f64::NAN, |cell| cell.margin_px())
    }

    #[test]
    fn a_tags_border_is_as_narrow_as_it_is_seen_at_the_grids_border_too() {
        for foreshortened in [1.0, 0.7, 0.5, 0.35] {
            for at in [(0, 0), (3, 0), (0, 3), (11, 4), (5, 7), (4, 3)] {
                let margin = margin_px(0.4, foreshortened, at);
                assert!((margin - 10.0 * foreshortened).abs() < 1e-9, "{foreshortened} {at:?}: {margin}");
            }
            // Where gaps are narrower than the tags' borders they are what is next.
            for at in [(0, 0), (4, 3)] {
                let margin = margin_px(0.2, foreshortened, at);
                assert!((margin - 8.0 * foreshortened).abs() < 1e-9, "{foreshortened} {at:?}: {margin}");
            }
        }
    }
}
