//! One picture to be taken: a camera, a board, what stands behind it, the light and the sensor.

use nalgebra::{Point2, Point3};

use super::backdrop::Backdrop;
use super::outline::{self, Outline};
use super::patch::Patch;
use super::psf::Optics;
use super::sensor::{Lighting, Sensor};
use crate::geometry::Transform;
use crate::imaging::coded::faces::{Face, faces};
use crate::simulate::physical_board::PhysicalBoard;
use crate::stereo::Camera;

/// Reflectances of a printed board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Print {
    /// White squares and margin.
    pub white: f64,
    pub black: f64,
    /// The plate's bevelled rim.
    pub rim: f64,
    pub rim_mm: f64,
}

/// Everything that makes one picture.
#[derive(Debug, Clone)]
pub struct Scene<'a> {
    pub camera: Camera,
    pub optics: Optics,
    pub board: &'a PhysicalBoard,
    pub camera_from_board: Transform,
    pub print: Print,
    /// What carries the board, in the board's frame, from behind to before.
    pub holder: &'a [Patch],
    /// What stands behind.
    pub backdrop: &'a Backdrop,
    pub lighting: Lighting,
    pub sensor: Sensor,
    pub seed: u64,
    /// Number of the picture, so that each has noise of its own.
    pub picture: u64,
}

/// Shapes of one brightness, to be painted together.
#[derive(Debug, Clone)]
pub struct Layer {
    /// Their outlines; they may touch but not overlap, but for those of sign -1.
    pub outlines: Vec<Outline>,
    /// Brightness at picture point (0, 0) and its change per px along x and y.
    pub tone: (f64, f64, f64),
}

impl Scene<'_> {
    /// All layers in front of the backdrop, from behind to before, as this camera sees them.
    pub fn layers(&self) -> Vec<Layer> {
        let mut layers: Vec<Layer> = self.holder.iter().filter_map(|patch| self.patch_layer(patch)).collect();
        let (w, h) = self.board.plate_half_mm();
        layers.extend(self.plate_layer(w + self.print.rim_mm, h + self.print.rim_mm, self.print.rim));
        layers.extend(self.plate_layer(w, h, self.print.white));
        layers.push(self.black_layer());
        layers.extend(self.marker_layers());
        layers.extend(self.board.covers.iter().filter_map(|patch| self.patch_layer(patch)));
        layers
    }

    fn board_outline(&self, corners: &[Point2<f64>]) -> Option<Outline> {
        let lift = |p: Point2<f64>| self.camera_from_board * self.board.on_surface(p.x, p.y);
        outline::project(&self.camera, corners, &lift)
    }

    fn plate_layer(&self, w: f64, h: f64, value: f64) -> Option<Layer> {
        let corners = [(-w, -h), (w, -h), (w, h), (-w, h)].map(|(x, y)| Point2::new(x, y));
        Some(Layer { outlines: vec![self.board_outline(&corners)?], tone: (value, 0.0, 0.0) })
    }

    fn black_layer(&self) -> Layer {
        let squares = self.board.drawing.squares;
        let mut outlines = Vec::new();
        for j in 0..squares.rows {
            for i in 0..squares.columns {
                if self.board.is_black(i, j) {
                    outlines.extend(self.board_outline(&self.board.square_mm(i, j)));
                }
            }
        }
        if self.board.workmanship.ink_spread_um > 0.0 && self.board.has_saddles() {
            for j in 1..squares.rows {
                for i in 1..squares.columns {
                    let overlap = self.board_outline(&self.board.overlap_mm(i, j));
                    outlines.extend(overlap.map(|o| Outline { sign: -1.0, ..o }));
                }
            }
        }
        Layer { outlines, tone: (self.print.black, 0.0, 0.0) }
    }

    /// The markers in the board's light squares, then what is white on them; none for a plain board.
    fn marker_layers(&self) -> Vec<Layer> {
        let faces = faces(&self.board.drawing, self.board.layout());
        let layer = |faces: &[Face], value: f64| Layer {
            outlines: faces.iter().filter_map(|face| self.board_outline(&self.board.face_mm(face))).collect(),
            tone: (value, 0.0, 0.0),
        };
        let layers = [layer(&faces.markers, self.print.black), layer(&faces.bits, self.print.white)];
        layers.into_iter().filter(|layer| !layer.outlines.is_empty()).collect()
    }

    fn patch_layer(&self, patch: &Patch) -> Option<Layer> {
        let camera_from_patch = self.camera_from_board * patch.parent_from_patch;
        let lift = |p: Point2<f64>| camera_from_patch * Point3::new(p.x, p.y, 0.0);
        let outline = outline::project(&self.camera, &patch.corners_mm, &lift)?;
        let tone = patch.tone.across(&outline);
        Some(Layer { outlines: vec![outline], tone })
    }

    /// True places of all inner corners in the raw picture, row by row, px.
    pub fn corners_px(&self) -> Vec<Point2<f64>> {
        let drawing = self.board.drawing;
        (0..drawing.rows())
            .flat_map(|row| (0..drawing.columns()).map(move |col| (col, row)))
            .map(|(col, row)| self.camera.project(&(self.camera_from_board * self.board.corner_mm(col, row))))
            .collect()
    }
}
