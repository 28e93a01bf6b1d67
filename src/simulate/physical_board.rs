//! A board as it was really made: its plate, where its corners really are, and how flat it is.
//!
//! Each crossing of lines is off by its own pitch error and the edges run straight from crossing to crossing, so an
//! error of one corner fades along its edges: a detector that fits edges over part of a square sees about two thirds of
//! it. Against the true corners such a detector scatters by the other third, more than the noise in its window tells
//! it.

use nalgebra::{Point2, Point3};

use super::draws::{Draws, Purpose};
use super::picture::patch::Patch;
use crate::imaging::Board;
use crate::imaging::board::Layout;
use crate::imaging::coded::faces::Face;

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

/// How a board is bent beyond a bow, um.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Warp {
    /// Height of two opposite corners over the other two, halved: the surface is `twist u v` over [-1, 1]^2.
    pub twist_um: f64,
    /// Height of the crest of an S along x: a full wave over the board.
    pub s_um: f64,
}

/// A made board. Its frame is the drawing's: origin in the centre, x along columns, y along rows, z away from the
/// viewer.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalBoard {
    /// What it should be.
    pub drawing: Board,
    /// How it was made.
    pub workmanship: Workmanship,
    /// All crossings of lines, outer ones included, row by row: `(columns + 1) x (rows + 1)` squares' corners, mm.
    lattice_mm: Vec<Point2<f64>>,
    /// How it is bent beyond its bow.
    pub warp: Warp,
    /// What lies on it or stands before it, in its frame, from behind to before: stickers, misprints, a hand.
    pub covers: Vec<Patch>,
}

impl PhysicalBoard {
    /// Makes a board; `index` tells boards of one seed apart.
    pub fn new(drawing: Board, workmanship: Workmanship, seed: u64, index: u64) -> PhysicalBoard {
        let mut draws = Draws::new(seed, Purpose::BoardPitch, index);
        let (columns, rows) = (drawing.squares.columns, drawing.squares.rows);
        let (scale, pitch) = (drawing.square_mm * (1.0 + workmanship.scale_ppm * 1e-6), drawing.pitch());
        let line = |k: usize, lines: usize| {
            let of = |k: usize| pitch.at(k as isize - 1);
            of(k) - (of(0) + of(lines)) / 2.0
        };
        let sigma_mm = workmanship.pitch_um * 1e-3;
        let mut lattice_mm = Vec::with_capacity((columns + 1) * (rows + 1));
        for j in 0..=rows {
            for i in 0..=columns {
                let x = line(i, columns) * scale + sigma_mm * draws.normal();
                let y = line(j, rows) * scale + sigma_mm * draws.normal();
                lattice_mm.push(Point2::new(x, y));
            }
        }
        let mut board = PhysicalBoard { drawing, workmanship, lattice_mm, warp: Warp::default(), covers: Vec::new() };
        board.lay_frame();
        board
    }

    /// Moves and turns the print so that the drawing, laid over the inner corners by least squares, is the board's
    /// frame: that is how any instrument finds the frame of a real board.
    fn lay_frame(&mut self) {
        let (columns, rows) = (self.drawing.columns(), self.drawing.rows());
        let all = || (0..columns * rows).map(|k| (k % columns, k / columns));
        let drawn = |(col, row)| self.drawing.corner_mm(col, row).xy();
        let made = |(col, row): (usize, usize)| self.crossing_mm(col + 1, row + 1);
        let count = (columns * rows) as f64;
        let shift = all().map(|at| made(at) - drawn(at)).sum::<nalgebra::Vector2<f64>>() / count;
        let (mut cross, mut dot) = (0.0, 0.0);
        for at in all() {
            let (drawn, made) = (drawn(at).coords, made(at).coords - shift);
            cross += drawn.perp(&made);
            dot += drawn.dot(&made);
        }
        let back = nalgebra::Rotation2::new(-cross.atan2(dot));
        for place in &mut self.lattice_mm {
            *place = back * (*place - shift);
        }
    }

    /// Crossing `(i, j)` of the lines between squares, counted from 0 at the outer edge, mm.
    pub fn crossing_mm(&self, i: usize, j: usize) -> Point2<f64> {
        self.lattice_mm[j * (self.drawing.squares.columns + 1) + i]
    }

    /// The surface's height at a place, mm. Its mean over the squares is zero, so a plane fitted to the board is z = 0.
    pub fn height_mm(&self, x_mm: f64, y_mm: f64) -> f64 {
        let (bow_x, bow_y) = self.workmanship.bow_um;
        let [width, height] = self.drawing.extent_mm();
        let (u, v) = (x_mm / (width / 2.0), y_mm / (height / 2.0));
        // The middle stands out toward the viewer, who is on the side of negative z.
        let bow = bow_x * (1.0 / 3.0 - u * u) + bow_y * (1.0 / 3.0 - v * v);
        -1e-3 * (bow + self.warp.twist_um * u * v + self.warp.s_um * (std::f64::consts::PI * u).sin())
    }

    /// A place on the surface, mm.
    pub fn on_surface(&self, x_mm: f64, y_mm: f64) -> Point3<f64> {
        Point3::new(x_mm, y_mm, self.height_mm(x_mm, y_mm))
    }

    /// Where inner corner `(col, row)` really is, in the board's frame, mm: where two black squares meet at the
    /// crossing of their lines, of a black square alone where the ink ends.
    pub fn corner_mm(&self, col: usize, row: usize) -> Point3<f64> {
        let p = self.crossing_mm(col + 1, row + 1);
        if self.has_saddles() {
            return self.on_surface(p.x, p.y);
        }
        let spread_mm = self.workmanship.ink_spread_um * 1e-3;
        let [right, down] = Board::outwards(col, row);
        self.on_surface(p.x + spread_mm * right, p.y + spread_mm * down)
    }

    /// Half the plate's width and height, mm.
    pub fn plate_half_mm(&self) -> (f64, f64) {
        let [width, height] = self.drawing.extent_mm().map(|mm| mm / 2.0 + self.workmanship.margin_mm);
        (width, height)
    }

    /// True for a black square. The square at the first corner of the first row is black.
    pub fn is_black(&self, i: usize, j: usize) -> bool {
        self.layout().is_dark(i as isize, j as isize)
    }

    /// Which squares are light, and hold the markers of a board that has any.
    pub fn layout(&self) -> Layout {
        self.drawing.layouts().first().copied().unwrap_or(Layout::New)
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

    /// Whether black squares meet at its crossings.
    pub fn has_saddles(&self) -> bool {
        self.layout() != Layout::Grid
    }

    /// The four corners of a face in one of the squares, in order round it, mm: it moves with the square's crossings.
    /// The ink's spread is not that of markers, whose faces tell no place.
    pub fn face_mm(&self, face: &Face) -> [Point2<f64>; 4] {
        let (i, j) = face.square;
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(di, dj)| self.crossing_mm(i + di, j + dj).coords);
        let at = |u: f64, v: f64| Point2::from((a * (1.0 - u) + b * u) * (1.0 - v) + (d * (1.0 - u) + c * u) * v);
        let Face { from, to, .. } = face;
        [(from[0], from[1]), (to[0], from[1]), (to[0], to[1]), (from[0], to[1])].map(|(u, v)| at(u, v))
    }

    /// Where two black squares that meet at an inner crossing overlap because of the ink's spread, mm.
    pub fn overlap_mm(&self, i: usize, j: usize) -> [Point2<f64>; 4] {
        let s = self.workmanship.ink_spread_um * 1e-3;
        let p = self.crossing_mm(i, j);
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| Point2::new(p.x + x * s, p.y + y * s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(workmanship: Workmanship) -> PhysicalBoard {
        PhysicalBoard::new(Board::checker("20x20".parse().unwrap(), 10.0), workmanship, 3, 0)
    }

    const PERFECT: Workmanship =
        Workmanship { pitch_um: 0.0, bow_um: (0.0, 0.0), ink_spread_um: 0.0, scale_ppm: 0.0, margin_mm: 8.0 };

    #[test]
    fn a_perfect_board_is_its_drawing() {
        let board = made(PERFECT);
        for row in 0..19 {
            for col in 0..19 {
                assert!((board.corner_mm(col, row) - board.drawing.corner_mm(col, row)).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn corners_scatter_by_the_pitch() {
        let board = made(Workmanship { pitch_um: 10.0, ..PERFECT });
        let mut sum = 0.0;
        for (col, row) in (0..19).flat_map(|row| (0..19).map(move |col| (col, row))) {
            sum += (board.corner_mm(col, row) - board.drawing.corner_mm(col, row)).norm_squared();
        }
        let sigma_um = (sum / (2.0 * 361.0)).sqrt() * 1e3;
        // 722 draws give their standard deviation to 2.6 %; four times that.
        assert!((sigma_um / 10.0 - 1.0).abs() < 0.11, "{sigma_um}");
    }

    #[test]
    fn a_bow_stands_out_toward_the_viewer_and_has_no_mean() {
        let board = made(Workmanship { bow_um: (60.0, 20.0), ..PERFECT });
        let ends = board.height_mm(100.0, 0.0) - board.height_mm(0.0, 0.0);
        assert!((ends - 0.060).abs() < 1e-12, "{ends}");
        let n = 200;
        let at = |k: usize| (k as f64 + 0.5) / n as f64 * 200.0 - 100.0;
        let mean: f64 = (0..n * n).map(|k| board.height_mm(at(k % n), at(k / n))).sum::<f64>() / (n * n) as f64;
        assert!(mean.abs() < 1e-6, "{mean}");
    }

    #[test]
    fn ink_makes_black_larger_by_twice_its_spread() {
        let board = made(Workmanship { ink_spread_um: 50.0, ..PERFECT });
        let square = board.square_mm(3, 4);
        assert!((square[1].x - square[0].x - 10.1).abs() < 1e-12 && (square[2].y - square[1].y - 10.1).abs() < 1e-12);
    }
}
