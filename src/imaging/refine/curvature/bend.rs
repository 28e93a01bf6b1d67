//! How an edge bends, and how well that is known.

use nalgebra::{Matrix2, Point2};

/// How the corners of a line show it to bend at one of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bend {
    /// 1/px, in the sign of the corner model: the edge runs where `n.d = -bend/2 (t.d)^2`.
    pub per_px: f64,
    /// By how much it changes with that corner's own offset from the line, 1/px^2.
    pub(super) by_own: f64,
    /// Its variance by the places of all corners, 1/px^2.
    pub(super) variance: f64,
}

impl Bend {
    /// Variance of a corner across its line, measured in a window whose straight edge is off by `by_bend` px^2 times
    /// the bend, px^2; `known_px2` is what it is where the bend is known. The corner itself shows the bend.
    pub fn variance_px2(&self, by_bend: f64, known_px2: f64) -> f64 {
        known_px2 * (1.0 + 2.0 * by_bend * self.by_own) + by_bend * by_bend * self.variance
    }

    /// How much of what moves the corner in such a window across its line does so still where the line's bend, which it
    /// takes part in, is the edge's.
    pub fn own_share(&self, by_bend: f64) -> f64 {
        1.0 + by_bend * self.by_own
    }
}

/// Fewest corners that show how a line bends.
pub(super) const FEWEST: usize = 3;

/// Which lines tell how they bend.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// How good places are at least, px.
    pub good_px: f64,
    /// Whether the board may be seen in part, so that lines are short.
    pub in_part: bool,
}

/// What a place is good for that is only seen, px^2.
pub const SEEN: Matrix2<f64> = Matrix2::new(1.0, 0.0, 0.0, 1.0);

/// A corner of a line.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Where it is, px.
    pub px: Point2<f64>,
    /// Whether the line's bend is to be found from it.
    pub counts: bool,
    /// How well it is known, px^2.
    pub covariance_px2: Matrix2<f64>,
}
