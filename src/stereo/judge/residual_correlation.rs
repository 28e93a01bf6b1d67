//! Are the residuals noise, or does something show in them that the model lacks?
//!
//! In: a calibration. Out: the correlation of neighbouring corners' residuals along the line that joins them (across
//! it, fits whose windows overlap correlate without any fault), and the pattern that is common to all pairs in each
//! cell of both pictures. Noise has neither. A pattern over the picture is a lens that the model cannot bend so; a
//! correlation without one is a board that is not as assumed, or corners pulled by light and blur.

use nalgebra::Vector2;
use serde::Serialize;

use crate::imaging::Side;
use crate::stereo::Camera;
use crate::stereo::calibrate::Calibration;
use crate::stereo::data::neighbour_correlation::{NeighbourCorrelation, SURE};
use crate::stereo::data::observation::Observation;
use crate::stereo::data::residuals::of_view;

/// Cells along x and y of a picture.
pub const CELLS: usize = 8;

/// Correlations below this change no result noticeably, however sure they are.
const HARMLESS: f64 = 0.05;

/// The mean residual in a cell of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cell {
    /// Middle of the cell, px.
    pub x_px: f64,
    pub y_px: f64,
    pub corners: usize,
    /// Mean residual (predicted minus seen), px; zero where there are none.
    pub mean_px: [f64; 2],
}

/// The residuals of one picture, cell by cell.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Field {
    pub side: &'static str,
    /// Row by row.
    pub cells: Vec<Cell>,
    /// Root mean square of what is systematic in the cells, noise taken off, px.
    pub systematic_px: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ResidualPattern {
    /// Correlation of the residuals of neighbouring corners.
    pub neighbours: NeighbourCorrelation,
    /// Left and right picture.
    pub fields: Vec<Field>,
}

impl ResidualPattern {
    /// True where nothing but noise shows.
    pub fn white(&self) -> bool {
        self.neighbours.along <= HARMLESS.max(SURE * self.neighbours.standard_error)
    }

    /// Root mean square of what is no noise in the residuals, px: the pattern that all pairs share, or what neighbours
    /// have in common. `sigma_px` is the corners' scatter. Zero where nothing but noise shows.
    pub fn systematic_px(&self, sigma_px: f64) -> f64 {
        if self.white() { 0.0 } else { self.pattern_px().max(self.neighbours.along.max(0.0).sqrt() * sigma_px) }
    }

    /// Root mean square of the pattern that all pairs share, the worse picture's, px.
    pub fn pattern_px(&self) -> f64 {
        self.fields.iter().map(|f| f.systematic_px).fold(0.0, f64::max)
    }
}

pub fn check(calibration: &Calibration) -> ResidualPattern {
    let shared = &calibration.values.shared;
    let mut fields = Side::BOTH.map(|side| Gather::new(side, shared.rig.camera(side)));
    for (view, pose) in calibration.views.iter().zip(&calibration.values.poses) {
        for (o, residual) in of_view(shared, view, pose) {
            fields[o.side as usize].add(&o, residual);
        }
    }
    ResidualPattern { neighbours: calibration.neighbours, fields: fields.into_iter().map(Gather::finish).collect() }
}

struct Gather {
    side: Side,
    size: [f64; 2],
    /// Of each cell: corners, the sum of their residuals and that of the squares.
    sums: Vec<(usize, Vector2<f64>, f64)>,
}

impl Gather {
    fn new(side: Side, camera: &Camera) -> Gather {
        let size = [camera.width, camera.height].map(|size| f64::from(size.max(1)));
        Gather { side, size, sums: vec![(0, Vector2::zeros(), 0.0); CELLS * CELLS] }
    }

    fn add(&mut self, o: &Observation, residual: Vector2<f64>) {
        let cell = |at: f64, size: f64| (((at + 0.5) / size * CELLS as f64).max(0.0) as usize).min(CELLS - 1);
        let (n, sum, squares) = &mut self.sums[cell(o.px.y, self.size[1]) * CELLS + cell(o.px.x, self.size[0])];
        *n += 1;
        *sum += residual;
        *squares += residual.norm_squared();
    }

    fn finish(self) -> Field {
        let (mut systematic, mut corners) = (0.0, 0usize);
        let cell = |(i, &(n, sum, squares)): (usize, &(usize, Vector2<f64>, f64))| {
            let mean = sum / n.max(1) as f64;
            if n > 1 {
                // Noise alone leaves its variance over n in the square of a mean.
                let noise = (squares / n as f64 - mean.norm_squared()) / (n as f64 - 1.0);
                systematic += n as f64 * (mean.norm_squared() - noise);
                corners += n;
            }
            let middle = |k: usize, size: f64| (k as f64 + 0.5) * size / CELLS as f64 - 0.5;
            let [x_px, y_px] = [middle(i % CELLS, self.size[0]), middle(i / CELLS, self.size[1])];
            Cell { x_px, y_px, corners: n, mean_px: mean.into() }
        };
        let cells = self.sums.iter().enumerate().map(cell).collect();
        let systematic_px = (systematic / corners.max(1) as f64).max(0.0).sqrt();
        Field { side: self.side.name(), cells, systematic_px }
    }
}
