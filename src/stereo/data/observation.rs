//! Corners as the bundle sees them: a point of the board, a pixel, a weight.

use nalgebra::{Matrix2, Point2, Point3, Vector2, Vector3};

use crate::imaging::Board;
pub use crate::imaging::Side;
use crate::stereo::model::board_shape::{NUMBERS, height_mm, lift};

/// A corner of the board seen in one picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observation {
    pub side: Side,
    pub col: usize,
    pub row: usize,
    /// Place on a flat board, mm, in the board's frame.
    pub board_mm: Point3<f64>,
    /// How much one unit of each number of the board's shape lifts the corner.
    pub lift: [f64; NUMBERS],
    /// Raw pixel.
    pub px: Point2<f64>,
    /// The refinement's own covariance, px^2; zero where it gave none.
    pub covariance_px2: Matrix2<f64>,
    /// How far the corner's window reaches along the edges that run along the rows and along the columns, as a share of
    /// a square's side; zero where nothing is known of it.
    pub reach: [f64; 2],
    /// By how much what the window sees lies off the crossing itself, on the board, mm.
    pub seen_off_mm: Vector3<f64>,
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
            lift: [0.0; NUMBERS],
            px,
            covariance_px2: Matrix2::identity() * (sigma_px * sigma_px),
            reach: [0.0; 2],
            seen_off_mm: Vector3::zeros(),
            whitener: Matrix2::identity() / sigma_px,
            active: true,
        }
    }

    /// Place on a board bent by these numbers, mm.
    pub fn board_point(&self, shape_mm: &[f64; NUMBERS]) -> Point3<f64> {
        Point3::new(self.board_mm.x, self.board_mm.y, height_mm(&self.lift, shape_mm))
    }

    /// Makes it the corner at another place of the board.
    pub fn renumber(&mut self, board: &Board, (col, row): (usize, usize)) {
        (self.col, self.row) = (col, row);
        self.board_mm = board.corner_mm(col, row);
        self.lift = lift(board, &self.board_mm);
    }

    /// Standard deviation of a coordinate by the whitener, px, the mean of both (root mean square).
    pub fn sigma_px(&self) -> f64 {
        let information = self.whitener.tr_mul(&self.whitener);
        // Trace of the inverse of a 2x2 matrix.
        (0.5 * information.trace() / information.determinant()).sqrt()
    }

    /// The residual in units of its own standard deviation.
    pub fn whiten(&self, residual_px: Vector2<f64>) -> Vector2<f64> {
        self.whitener * residual_px
    }
}
