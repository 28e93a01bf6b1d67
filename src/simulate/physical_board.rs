//! A board as it was really made: its plate, where its corners really are, and how flat it is.

use nalgebra::{Point2, Point3};

use super::draws::{Draws, Purpose};
use crate::imaging::Board;

/// How a board deviates from its drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Workmanship {
    /// Standard deviation of each corner along x and y, um: 1 for the ceramic board, 10 for the alumina target.
    pub pitch_um: f64,
    /// Height of the middle over the ends along x and along y (a paraboloid), um.
    pub bow_um: (f64, f64),
    /// How far black runs over each edge, um: white squares are smaller by twice this, black ones larger.
    pub ink_spread_um: f64,
    /// Common stretch of the board, parts per million (a board warmer than its certificate says).
    pub scale_ppm: f64,
    /// White around the squares, mm.
    pub margin_mm: f64,
}

/// A made board. Its frame is the drawing's: origin in the centre, x along columns, y along rows, z away from the viewer.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalBoard {
    /// What it should be.
    pub drawing: Board,
    /// How it was made.
    pub workmanship: Workmanship,
    /// All crossings of lines, outer ones included, row by row: `(columns + 1) x (rows + 1)` squares' corners, mm.
    lattice_mm: Vec<Point2<f64>>,
}

impl PhysicalBoard {
    /// Makes a board; `index` tells boards of one seed apart.
    pub fn new(drawing: Board, workmanship: Workmanship, seed: u64, index: u64) -> PhysicalBoard {
        let mut draws = Draws::new(seed, Purpose::BoardPitch, index);
        let (columns, rows) = (drawing.squares.columns, drawing.squares.rows);
        let scale = drawing.square_mm * (1.0 + workmanship.scale_ppm * 1e-6);
        let sigma_mm = workmanship.pitch_um * 1e-3;
        let mut lattice_mm = Vec::with_capacity((columns + 1) * (rows + 1));
        for j in 0..=rows {
            for i in 0..=columns {
                let x = (i as f64 - columns as f64 / 2.0) * scale + sigma_mm * draws.normal();
                let y = (j as f64 - rows as f64 / 2.0) * scale + sigma_mm * draws.normal();
                lattice_mm.push(Point2::new(x, y));
            }
        }
        PhysicalBoard { drawing, workmanship, lattice_mm }
    }

    /// Crossing `(i, j)` of the lines between squares, counted from 0 at the outer edge, mm.
    pub fn crossing_mm(&self, i: usize, j: usize) -> Point2<f64> {
        self.lattice_mm[j * (self.drawing.squares.columns + 1) + i]
    }

    /// The surface's height at a place, mm. Its mean over the squares is zero, so a plane fitted to the board is z = 0.
    pub fn height_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let (bow_x, bow_y) = self.workmanship.bow_um;
        let half = |squares: usize| squares as f64 * self.drawing.square_mm / 2.0;
        let u = x_mm / half(self.drawing.squares.columns);
        let v = y_mm / half(self.drawing.squares.rows);
        // The middle stands out toward the viewer, who is on the side of negative z.
        -1e-3 * (bow_x * (1.0 / 3.0 - u * u) + bow_y * (1.0 / 3.0 - v * v))
    }

    /// A place on the surface, mm.
    pub fn on_surface(&self, x_mm: f64, y_mm: f64) -> Point3<f64> {
        Point3::new(x_mm, y_mm, self.height_mm(x_mm, y_mm))
    }

    /// Where inner corner `(col, row)` really is, in the board's frame, mm.
    pub fn corner_mm(&self, col: usize, row: usize) -> Point3<f64> {
        let p = self.crossing_mm(col + 1, row + 1);
        self.on_surface(p.x, p.y)
    }

    /// Half the plate's width and height, mm.
    pub fn plate_half_mm(&self) -> (f64, f64) {
        let half = |squares: usize| squares as f64 * self.drawing.square_mm / 2.0 + self.workmanship.margin_mm;
        (half(self.drawing.squares.columns), half(self.drawing.squares.rows))
    }

    /// True for a black square. The square at the first corner of the first row is black.
    pub fn is_black(i: usize, j: usize) -> bool {
        (i + j).is_multiple_of(2)
    }

    /// The four corners of square `(i, j)` as printed, in order round it, mm.
    /// A black square grows by the ink's spread beyond the crossings; white is what black leaves.
    pub fn square_mm(&self, i: usize, j: usize) -> [Point2<f64>; 4] {
        let s = self.workmanship.ink_spread_um * 1e-3;
        let at = |di: usize, dj: usize, sx: f64, sy: f64| {
            let p = self.crossing_mm(i + di, j + dj);
            Point2::new(p.x + sx * s, p.y + sy * s)
        };
        [at(0, 0, -1.0, -1.0), at(1, 0, 1.0, -1.0), at(1, 1, 1.0, 1.0), at(0, 1, -1.0, 1.0)]
    }

    /// Where two black squares that meet at an inner crossing overlap because of the ink's spread, mm.
    pub fn overlap_mm(&self, i: usize, j: usize) -> [Point2<f64>; 4] {
        let s = self.workmanship.ink_spread_um * 1e-3;
        let p = self.crossing_mm(i, j);
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Point2::new(p.x + x * s, p.y + y * s))
    }
}
