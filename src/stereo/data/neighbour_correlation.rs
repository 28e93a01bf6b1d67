//! How the residuals of neighbouring corners hang together, and what that does to standard deviations.
//!
//! A corner fit whose window reaches along the edges to the next corners uses each piece of edge twice: both its ends
//! move with the same noise across that edge, and not along it. Two windows that overlap wholly correlate by one half.
//! A lens, a board or light that the model lacks moves neighbours together in both directions. So the correlation along
//! the joining edge tells what the model lacks, and what the one across has more is overlap.
//!
//! Corners that share information are worth less than as many independent ones: the covariance of anything that
//! depends smoothly on the corners is larger by `1 + sum of the correlations with all neighbours`.

use nalgebra::{Point2, Vector2};
use serde::Serialize;

use crate::imaging::Side;
use crate::stereo::data::Observation;

/// Standard errors beyond which a correlation is not chance.
pub const SURE: f64 = 4.0;

/// Correlation across the joining edge of two windows that both hold all of it.
const WHOLE_OVERLAP: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct NeighbourCorrelation {
    /// Of the components along the line that joins the two.
    pub along: f64,
    /// Of the components across it.
    pub across: f64,
    /// Standard error of each if there were none.
    pub standard_error: f64,
    /// Pairs of neighbours for each corner: two in the middle of a large board.
    pub links_per_corner: f64,
}

impl NeighbourCorrelation {
    /// Over all pictures; each item holds the active corners of one pair with their residuals, px.
    pub fn of(views: impl Iterator<Item = Vec<(Observation, Vector2<f64>)>>) -> NeighbourCorrelation {
        let mut sums = Sums::default();
        for residuals in views {
            let largest = |of: fn(&Observation) -> usize| residuals.iter().map(|(o, _)| of(o) + 1).max().unwrap_or(0);
            let (columns, rows) = (largest(|o| o.col), largest(|o| o.row));
            for side in Side::BOTH {
                let mut at = vec![None; columns * rows];
                for (o, residual) in residuals.iter().filter(|(o, _)| o.side == side) {
                    // In units of its own scatter, but not turned as a whitener would.
                    at[o.row * columns + o.col] = Some((o.px, residual * o.whitener.determinant().abs().sqrt()));
                }
                sums.add(columns, &at);
            }
        }
        sums.finish()
    }

    /// Factor on the covariance of what depends smoothly on the corners; one where no overlap shows. A fault of the
    /// model moves neighbours together across the edge as well and cannot be told from overlap there: the factor then
    /// is that of a whole overlap, never less.
    pub fn inflation(&self) -> f64 {
        let sure = self.across > SURE * self.standard_error;
        if sure { 1.0 + self.across.min(WHOLE_OVERLAP) * self.links_per_corner } else { 1.0 }
    }
}

#[derive(Default)]
struct Sums {
    corners: usize,
    links: usize,
    /// Products and mean squares of the components along and across.
    along: (f64, f64),
    across: (f64, f64),
}

impl Sums {
    /// A picture's corners, row by row.
    fn add(&mut self, columns: usize, at: &[Option<(Point2<f64>, Vector2<f64>)>]) {
        self.corners += at.iter().flatten().count();
        for (i, here) in at.iter().enumerate() {
            let Some((here_px, here)) = here else { continue };
            let right = ((i + 1) % columns > 0).then_some(i + 1);
            let below = Some(i + columns).filter(|below| *below < at.len());
            for (there_px, there) in [right, below].into_iter().flatten().filter_map(|i| at[i]) {
                let Some(t) = (there_px - here_px).try_normalize(0.0) else { continue };
                let n = Vector2::new(-t.y, t.x);
                self.links += 1;
                for (sums, v) in [(&mut self.along, t), (&mut self.across, n)] {
                    let (a, b) = (here.dot(&v), there.dot(&v));
                    sums.0 += a * b;
                    sums.1 += 0.5 * (a * a + b * b);
                }
            }
        }
    }

    fn finish(self) -> NeighbourCorrelation {
        let ratio = |(product, square): (f64, f64)| if square > 0.0 { product / square } else { 0.0 };
        NeighbourCorrelation {
            along: ratio(self.along),
            across: ratio(self.across),
            standard_error: 1.0 / (self.links.max(1) as f64).sqrt(),
            links_per_corner: self.links as f64 / self.corners.max(1) as f64,
        }
    }
}
