//! What the window that a corner is measured in sees of the crossings about it.
//!
//! Edges run straight from crossing to crossing, so that they bend at one that is off, and a corner is measured by
//! fitting straight edges over a window: over a part `h` of each edge it sees `1 - h/2` of the crossing's own deviation
//! across that edge and `h/4` of each neighbour's (the means of `1 - |t|` and of `|t|` over the window). In: the
//! windows' reach. Out: the shares, and by how much what is seen lies off the crossing itself.

use nalgebra::{SVector, Vector2, Vector3};

use crate::imaging::Board;
use crate::stereo::data::{Observation, View, in_use};

/// Which crossings' deviations a window sees of a coordinate, with their shares: the crossing's own first; `None`
/// stands for a crossing at the board's rim.
pub type SeenShares = [(Option<usize>, f64); 3];

/// A window about a crossing.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    board: &'a Board,
    /// Column and row of the crossing.
    place: (usize, usize),
    /// See [`Observation::reach`].
    reach: [f64; 2],
}

impl<'a> Window<'a> {
    pub fn of(board: &'a Board, o: &Observation) -> Window<'a> {
        Window { board, place: (o.col, o.row), reach: o.reach }
    }

    /// For each crossing, row by row, a window with the mean reach of its corners'.
    pub fn means(board: &'a Board, views: &[View]) -> Vec<Window<'a>> {
        let reaches = crossing_means(board, views, |o| Vector2::from(o.reach));
        reaches.iter().enumerate().map(|(k, r)| Window { board, place: board.place(k), reach: [r.x, r.y] }).collect()
    }

    /// What it sees of the coordinate along x (0) or y (1).
    pub fn shares(&self, axis: usize) -> SeenShares {
        let at = |dc: isize, dr: isize| {
            let (col, row) = (self.place.0.checked_add_signed(dc), self.place.1.checked_add_signed(dr));
            let inside = col.zip(row).filter(|&(c, r)| c < self.board.columns() && r < self.board.rows());
            inside.map(|(c, r)| self.board.index(c, r))
        };
        // The edge along the row says where the corner is across it, in y; the one along the column in x.
        let (reach, dc, dr) = if axis == 0 { (self.reach[1], 0, 1) } else { (self.reach[0], 1, 0) };
        [(at(0, 0), 1.0 - 0.5 * reach), (at(-dc, -dr), 0.25 * reach), (at(dc, dr), 0.25 * reach)]
    }

    /// What it sees of the crossings' deviations, less the crossing's own deviation, mm.
    pub fn seen_off(&self, deviations_mm: &[Vector3<f64>]) -> Vector3<f64> {
        let own = deviations_mm[self.board.index(self.place.0, self.place.1)];
        let of = |axis: usize| {
            let shares = self.shares(axis);
            shares.iter().filter_map(|(from, share)| Some(share * deviations_mm[(*from)?][axis])).sum::<f64>()
                - own[axis]
        };
        Vector3::new(of(0), of(1), 0.0)
    }

    /// Variance that crossings at the board's rim, with a unit variance of their own, add to the deviation along x (0)
    /// or y (1) of the crossing: those bend edges as the others do and are never seen.
    pub fn rim_variance(&self, axis: usize) -> f64 {
        let shares = self.shares(axis);
        // What is seen of them is taken for the crossing's own deviation, of which less is seen.
        let (_, own) = shares[0];
        shares.iter().filter(|(from, _)| from.is_none()).map(|(_, share)| (share / own).powi(2)).sum()
    }
}

/// For each crossing, row by row, the mean over its corners in use; zero where there is none.
pub fn crossing_means<const N: usize>(
    board: &Board,
    views: &[View],
    of: impl Fn(&Observation) -> SVector<f64, N>,
) -> Vec<SVector<f64, N>> {
    let mut sums = vec![(0.0, SVector::zeros()); board.corner_count()];
    for o in in_use(views) {
        let (number, sum) = &mut sums[board.index(o.col, o.row)];
        *number += 1.0;
        *sum += of(o);
    }
    sums.into_iter().map(|(number, sum)| sum / f64::max(number, 1.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::{Side, Squares};
    use nalgebra::Point2;

    #[test]
    fn a_window_sees_as_much_of_straight_lines_as_there_is() {
        let board = Board::checker(Squares { columns: 7, rows: 6 }, 10.0);
        let window = |reach| Window { board: &board, place: (2, 0), reach };
        for axis in 0..2 {
            for reach in [[0.0, 0.0], [0.3, 0.8]] {
                let shares = window(reach).shares(axis);
                assert!((shares.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-12);
            }
        }
        // The edge along the column of a crossing of the first row begins at the rim.
        assert_eq!(window([0.4, 0.8]).shares(0)[1], (None, 0.2));
        assert_eq!(window([0.4, 0.8]).shares(1)[1], (Some(1), 0.1));
        assert_eq!(window([0.4, 0.8]).rim_variance(0), (0.2_f64 / 0.6).powi(2));
        assert_eq!(window([0.4, 0.8]).rim_variance(1), 0.0);
    }

    #[test]
    fn means_are_over_the_corners_in_use() {
        let board = Board::checker(Squares { columns: 4, rows: 4 }, 10.0);
        let observation = |reach, active| {
            let mut o = Observation::of_point(Side::Left, Point2::origin(), 0.01);
            (o.col, o.row, o.reach, o.active) = (1, 2, [reach; 2], active);
            o
        };
        let observations = vec![observation(0.2, true), observation(0.6, true), observation(0.9, false)];
        let means = Window::means(&board, &[View { pair: String::new(), observations }]);
        assert_eq!(means[board.index(1, 2)].reach, [0.4, 0.4]);
        assert_eq!(means[0].reach, [0.0, 0.0]);
    }
}
