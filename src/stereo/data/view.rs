//! What one pair of pictures shows of the board.

use nalgebra::Matrix2;

use crate::imaging::{Board, Corner, PairCorners, Side};
use crate::stereo::data::Observation;
use crate::stereo::model::board_shape::lift;

/// How far a corner that was found but could not be measured may be off, px.
const COARSE_PX: f64 = 1.0;

/// What one pair of pictures shows of the board: left corners first, then right.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    pub pair: String,
    pub observations: Vec<Observation>,
}

impl View {
    /// The corners of a pair: those that imaging relies on, or, in a picture with fewer than `fewest` of them, all that
    /// it found. A whole picture out of focus is judged by how it fits, with the covariances it has.
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

    pub fn active(&self, side: Side) -> impl Iterator<Item = &Observation> + Clone {
        self.observations.iter().filter(move |o| o.active && o.side == side)
    }

    pub fn only(&self, side: Side) -> View {
        let observations = self.observations.iter().copied().filter(|o| o.side == side).collect();
        View { pair: self.pair.clone(), observations }
    }

    /// The corners of one picture, and those of the other side's picture in another pair.
    pub fn paired(&self, side: Side, with: &View) -> View {
        let mut paired = self.only(side);
        paired.observations.extend(with.only(side.other()).observations);
        paired
    }

    /// Renumbers the right picture's corners, see [`View::turn`].
    pub fn turn_right(&mut self, board: &Board, quarters: usize) {
        self.turn(board, Side::Right, quarters);
    }

    /// Renumbers a picture's corners as on a board that is turned in its plane by so many quarter turns. A board with
    /// unequal sides takes half turns only.
    pub fn turn(&mut self, board: &Board, side: Side, quarters: usize) {
        for o in self.observations.iter_mut().filter(|o| o.side == side) {
            o.renumber(board, board.turned((o.col, o.row), quarters));
            if !quarters.is_multiple_of(2) {
                o.reach.reverse();
            }
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

/// The active corners of all these pairs.
pub fn in_use(views: &[View]) -> impl Iterator<Item = &Observation> + Clone {
    views.iter().flat_map(|view| &view.observations).filter(|o| o.active)
}

fn observation(board: &Board, side: Side, corner: &Corner) -> Observation {
    let board_mm = board.corner_mm(corner.col, corner.row);
    // A covariance that isn't one (not positive, not finite) says nothing: as if none had been given.
    let covariance_px2 = corner
        .covariance_px2
        .filter(|c| c.iter().all(|v| v.is_finite()) && c.m11 > 0.0 && c.determinant() > 0.0)
        .unwrap_or_else(|| if corner.used { Matrix2::zeros() } else { Matrix2::identity() * (COARSE_PX * COARSE_PX) });
    let (lift, reach) = (lift(board, &board_mm), corner.reach.unwrap_or([0.0; 2]));
    let point = Observation::of_point(side, corner.px, 1.0);
    Observation { col: corner.col, row: corner.row, board_mm, lift, covariance_px2, reach, ..point }
}
