//! What surrounds a corner: its edges, as long as its squares.

use nalgebra::{Point2, Vector2};

use crate::imaging::lattice::Places;

/// A corner's surroundings: vectors along the two edges, as long as to the nearer neighbour.
#[derive(Clone, Copy)]
pub(super) struct Cell {
    /// Where the corner is thought to be, px.
    pub(super) place: Point2<f64>,
    /// Along the rows and along the columns, px.
    pub(super) edges: [Vector2<f64>; 2],
}

impl Cell {
    /// The cell of a corner; `None` where it has no neighbour along one of its edges, or squares too small or too oblique to hold an edge.
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
        let cell = Cell { place, edges: [edge(1, 0)?, edge(0, 1)?] };
        (cell.side() * cell.skew() > LEAST_HEIGHT_PX).then_some(cell)
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
