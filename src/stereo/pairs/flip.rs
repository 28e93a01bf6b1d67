//! Pairs that are the other way round: left and right are exchanged, or a camera or a program mirrors or turns both.

use crate::imaging::{Board, Corner, PairCorners};
use crate::stereo::{Camera, Rig};

/// How pairs are the other way round.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flip {
    /// Left picture for right one.
    Exchanged,
    /// Left for right.
    Mirrored,
    /// Top for bottom.
    UpsideDown,
    /// Both.
    HalfTurn,
}

impl Flip {
    /// The more usual ones first.
    pub const ALL: [Flip; 4] = [Flip::Exchanged, Flip::Mirrored, Flip::UpsideDown, Flip::HalfTurn];

    pub fn describe(self) -> &'static str {
        match self {
            Flip::Exchanged => "left and right pictures are exchanged",
            Flip::Mirrored => "the pictures are mirrored, left for right",
            Flip::UpsideDown => "the pictures are mirrored, top for bottom",
            Flip::HalfTurn => "the pictures are turned by half a turn",
        }
    }

    pub fn remedy(self) -> &'static str {
        match self {
            Flip::Exchanged => "give each the other's name; if the cameras themselves changed places, calibrate anew",
            _ => {
                "take the pictures as the cameras give them, as at the calibration: see the cameras' settings and the program that saved them"
            }
        }
    }

    /// A pair as it would have been found the other way round, each picture with the camera of its side.
    pub fn of_pair(self, board: &Board, rig: &Rig, pair: &PairCorners) -> PairCorners {
        let size = |camera: &Camera| [camera.width, camera.height];
        let [left, right] = match self {
            Flip::Exchanged => [pair.right.clone(), pair.left.clone()],
            _ => [(&rig.left, &pair.left), (&rig.right, &pair.right)]
                .map(|(camera, corners)| self.of(board, size(camera), corners)),
        };
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
