//! Corners as the bundle sees them: a point of the board, a pixel, a weight.

use nalgebra::{Matrix2, Point2, Point3, Vector2};

pub use crate::imaging::Side;
use crate::imaging::{Board, Corner, PairCorners};

/// A corner of the board seen in one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    /// In which picture.
    pub side: Side,
    /// Column on the board.
    pub col: usize,
    /// Row on the board.
    pub row: usize,
    /// Place on a flat board, mm, in the board's frame.
    pub board_mm: Point3<f64>,
    /// How much one unit of the paraboloids along x and along y lifts the corner: `1 - x^2` and `1 - y^2` over [-1, 1]^2.
    pub lift: [f64; 2],
    /// Raw pixel.
    pub px: Point2<f64>,
    /// The refinement's own covariance, px^2; zero where it gave none.
    pub covariance_px2: Matrix2<f64>,
    /// Whitener of the residual: `whitener * (px - predicted)` has unit covariance. Set by the noise model.
    pub whitener: Matrix2<f64>,
    /// False for an outlier: it stays in the list, so that it can be reported, and counts for nothing.
    pub active: bool,
}

impl Observation {
    /// A point that belongs to no board, seen with this standard deviation of a coordinate.
    pub fn of_point(side: Side, px: Point2<f64>, sigma_px: f64) -> Observation {
        Observation {
            side,
            col: 0,
            row: 0,
            board_mm: Point3::origin(),
            lift: [0.0; 2],
            px,
            covariance_px2: Matrix2::identity() * (sigma_px * sigma_px),
            whitener: Matrix2::identity() / sigma_px,
            active: true,
        }
    }

    /// Place on a board bent by `shape` (height of the paraboloids along x and y in the middle), mm.
    pub fn board_point(&self, shape_mm: &[f64; 2]) -> Point3<f64> {
        let z = self.lift[0] * shape_mm[0] + self.lift[1] * shape_mm[1];
        Point3::new(self.board_mm.x, self.board_mm.y, z)
    }

    /// Makes it the corner at another place of the board.
    pub fn renumber(&mut self, board: &Board, (col, row): (usize, usize)) {
        (self.col, self.row) = (col, row);
        self.board_mm = board.corner_mm(col, row);
        self.lift = lift(board, &self.board_mm);
    }

    /// The residual in units of its own standard deviation.
    pub fn whiten(&self, residual_px: Vector2<f64>) -> Vector2<f64> {
        self.whitener * residual_px
    }
}

/// How far a corner that was found but could not be measured may be off, px.
const COARSE_PX: f64 = 1.0;

/// What one pair of pictures shows of the board: left corners first, then right.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// Name of the pair.
    pub pair: String,
    /// Its corners.
    pub observations: Vec<Observation>,
}

impl View {
    /// The corners of a pair: those that imaging relies on, or, in a picture with fewer than `fewest` of them, all that it found.
    /// A whole picture out of focus is judged by how it fits, with the covariances it has.
    pub fn new(board: &Board, corners: &PairCorners, fewest: usize) -> View {
        let of = |side, list: &[Corner]| -> Vec<Observation> {
            let inside =
                |c: &&Corner| c.col < board.columns() && c.row < board.rows() && c.px.iter().all(|v| v.is_finite());
            let relied = list.iter().filter(|c| c.used).count();
            list.iter()
                .filter(inside)
                .filter(|c| c.used || relied < fewest)
                .map(|c| observation(board, side, c))
                .collect()
        };
        let mut observations = of(Side::Left, &corners.left);
        observations.extend(of(Side::Right, &corners.right));
        View { pair: corners.pair.clone(), observations }
    }

    /// Active corners of one picture.
    pub fn active(&self, side: Side) -> impl Iterator<Item = &Observation> + Clone {
        self.observations.iter().filter(move |o| o.active && o.side == side)
    }

    /// Only the corners of one picture.
    pub fn only(&self, side: Side) -> View {
        let observations = self.observations.iter().copied().filter(|o| o.side == side).collect();
        View { pair: self.pair.clone(), observations }
    }

    /// Renumbers the right picture's corners as on a board that is turned in its plane by so many quarter turns. A board with unequal
    /// sides takes half turns only.
    pub fn turn_right(&mut self, board: &Board, quarters: usize) {
        for o in self.observations.iter_mut().filter(|o| o.side == Side::Right) {
            let (col, row) = (o.col, o.row);
            let (last_col, last_row) = (board.columns() - 1, board.rows() - 1);
            let place = match quarters % 4 {
                0 => (col, row),
                1 => (last_row - row, col),
                2 => (last_col - col, last_row - row),
                _ => (row, last_col - col),
            };
            o.renumber(board, place);
        }
    }

    /// The pair with its pictures exchanged.
    pub fn exchanged(&self) -> View {
        let mut exchanged = self.clone();
        for o in &mut exchanged.observations {
            o.side = o.side.other();
        }
        exchanged
    }

    /// The pair with about `most` corners a picture, spread over the board.
    pub fn thinned(&self, most: usize) -> View {
        let some = |side| {
            let all: Vec<&Observation> = self.active(side).collect();
            let count = all.len().min(most);
            (0..count).map(|k| *all[k * all.len() / count]).collect::<Vec<_>>()
        };
        View { pair: self.pair.clone(), observations: Side::BOTH.into_iter().flat_map(some).collect() }
    }
}

fn observation(board: &Board, side: Side, corner: &Corner) -> Observation {
    let board_mm = board.corner_mm(corner.col, corner.row);
    // A covariance that isn't one (not positive, not finite) says nothing: as if none had been given.
    let covariance_px2 = corner
        .covariance_px2
        .filter(|c| c.iter().all(|v| v.is_finite()) && c.m11 > 0.0 && c.determinant() > 0.0)
        .unwrap_or_else(|| if corner.used { Matrix2::zeros() } else { Matrix2::identity() * (COARSE_PX * COARSE_PX) });
    Observation {
        side,
        col: corner.col,
        row: corner.row,
        board_mm,
        lift: lift(board, &board_mm),
        px: corner.px,
        covariance_px2,
        whitener: Matrix2::identity(),
        active: true,
    }
}

fn lift(board: &Board, at: &Point3<f64>) -> [f64; 2] {
    let edge = board.corner_mm(board.columns() - 1, board.rows() - 1);
    [1.0 - (at.x / edge.x).powi(2), 1.0 - (at.y / edge.y).powi(2)]
}
