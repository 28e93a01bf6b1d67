//! `rectified.json`: the matrices of rectified pictures as OpenCV has them, and how well their rows agree.

use nalgebra::{Matrix3, Matrix3x4};
use serde::Serialize;
use serde_json::{Value, json};

use crate::imaging::{Board, Skipped};
use crate::linear_algebra::rows;
use crate::stereo::model::rectification::{Matrices, RowResidual, Scaling, SizeResidual};
use crate::stereo::{Rig, Side};

/// The content of `rectified.json`. Matrices row by row, px and mm.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct RectifiedFile {
    /// "rectify", or "undistort" where each picture was straightened by itself.
    pub mode: &'static str,
    pub width: u32,
    pub height: u32,
    /// `stereoRectify`'s `alpha`; null where pictures were only straightened.
    pub alpha: Option<f64>,
    /// `stereoRectify`'s `CALIB_ZERO_DISPARITY`.
    pub zero_disparity: Option<bool>,
    /// `R1`, `R2`, `P1`, `P2`, and `Q` of pictures on common rows.
    #[serde(flatten)]
    matrices: Value,
    /// Share of each rectified picture that shows something.
    pub coverage: Coverage,
    /// "rows", or "columns" for cameras one above the other: what corresponding points have in common.
    pub common: Option<&'static str>,
    /// How far the rows differ over all corners of the board that was found; null without a board.
    pub residual: Option<RowResidual>,
    pub board: Option<String>,
    /// How large the board comes out, where it is the one that calibrated.
    pub size: Option<SizeResidual>,
    /// The boards that were looked for.
    #[serde(skip)]
    pub looked_for: String,
    pub pairs: Vec<RectifiedPair>,
    /// The pairs not written, and why.
    pub pairs_skipped: Vec<Skipped>,
}

/// Share of each picture that shows something.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Coverage {
    pub left: f64,
    pub right: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RectifiedPair {
    pub pair: String,
    /// The left picture, below the results folder.
    pub left: String,
    pub right: String,
    /// How far its rows differ; null where the board was not found.
    pub residual: Option<RowResidual>,
}

impl RectifiedFile {
    /// Of pictures on common rows.
    pub fn rectified(rig: &Rig, matrices: &Matrices, scaling: Scaling, coverage: Coverage) -> RectifiedFile {
        let common = if matrices.in_columns() { "columns" } else { "rows" };
        let mut file = RectifiedFile {
            mode: "rectify",
            alpha: Some(scaling.alpha),
            zero_disparity: Some(scaling.zero_disparity),
            common: Some(common),
            ..RectifiedFile::of(rig, Side::BOTH.map(|side| matrices.of(side)), coverage)
        };
        file.matrices["Q"] = json!(rows(&matrices.disparity_to_depth));
        file
    }

    /// Of pictures that were straightened, each in its own camera's matrix.
    pub fn undistorted(rig: &Rig, coverage: Coverage) -> RectifiedFile {
        let one = Matrix3::identity();
        let [p1, p2] = [&rig.left, &rig.right].map(|camera| camera.matrix().insert_column(3, 0.0));
        RectifiedFile::of(rig, [(&one, &p1), (&one, &p2)], coverage)
    }

    fn of(rig: &Rig, [(r1, p1), (r2, p2)]: [(&Matrix3<f64>, &Matrix3x4<f64>); 2], coverage: Coverage) -> RectifiedFile {
        RectifiedFile {
            mode: "undistort",
            width: rig.left.width,
            height: rig.left.height,
            matrices: json!({"R1": rows(r1), "R2": rows(r2), "P1": rows(p1), "P2": rows(p2)}),
            coverage,
            ..RectifiedFile::default()
        }
    }

    /// The same with how well the rows of a board's corners agree.
    pub fn with_residual(mut self, board: Board, residual: Option<RowResidual>) -> RectifiedFile {
        self.board = Some(board.squares.to_string());
        self.residual = residual;
        self
    }
}
