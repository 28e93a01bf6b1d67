//! Pictures that are the other way round: a camera or a program mirrors them, or turns them by half a turn.

use crate::imaging::{Board, Corner, PairCorners};
use crate::stereo::Rig;

/// How pictures are the other way round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flip {
    /// Left for right.
    Mirrored,
    /// Top for bottom.
    UpsideDown,
    /// Both.
    HalfTurn,
}

impl Flip {
    pub const ALL: [Flip; 3] = [Flip::Mirrored, Flip::UpsideDown, Flip::HalfTurn];

    pub fn describe(self) -> &'static str {
        match self {
            Flip::Mirrored => "mirrored, left for right",
            Flip::UpsideDown => "mirrored, top for bottom",
            Flip::HalfTurn => "turned by half a turn",
        }
    }

    /// A pair as it would have been found in pictures that are the other way round, each with the camera that it has.
    pub fn of_pair(self, board: &Board, rig: &Rig, pair: &PairCorners) -> PairCorners {
        let [left, right] = [(&rig.left, &pair.left), (&rig.right, &pair.right)]
            .map(|(camera, corners)| self.of(board, [camera.width, camera.height], corners));
        PairCorners { pair: pair.pair.clone(), left, right }
    }

    /// Corners as they are in the other picture, of this width and height, numbered as they would be found there.
    fn of(self, board: &Board, [width, height]: [u32; 2], corners: &[Corner]) -> Vec<Corner> {
        let (x, y) = (self != Flip::UpsideDown, self != Flip::Mirrored);
        let flip = |corner: &Corner| {
            let mut corner = *corner;
            if x {
                corner.px.x = f64::from(width) - 1.0 - corner.px.x;
                corner.col = board.columns() - 1 - corner.col;
            }
            if y {
                corner.px.y = f64::from(height) - 1.0 - corner.px.y;
                corner.row = board.rows() - 1 - corner.row;
            }
            if let Some(covariance) = corner.covariance_px2.as_mut().filter(|_| x != y) {
                covariance.m12 = -covariance.m12;
                covariance.m21 = -covariance.m21;
            }
            corner
        };
        let mut flipped: Vec<Corner> = corners.iter().map(flip).collect();
        flipped.sort_by_key(|corner| (corner.row, corner.col));
        flipped
    }
}
