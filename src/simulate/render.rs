//! A scene to a picture, tile by tile.
//!
//! In: a [`Scene`]. Out: a [`Picture`]. Method: every shape's outline is projected through the lens; in tiles that an
//! outline crosses, the exact area coverage of cells a quarter of a pixel wide is painted layer by layer, then spread
//! and integrated over pixels ([`super::psf`]); tiles that no outline crosses have one tone. Light and sensor follow.
//! Tiles are independent, so any order gives the same picture; memory is one picture of 16 bits.

use nalgebra::Point2;

use super::coverage::Coverage;
use super::draws::NormalTable;
use super::outline::Outline;
use super::psf::{FINE, Taps};
use super::scene::{Layer, Scene};
use super::sensor::Exposer;

/// Side of a tile, px.
const TILE: usize = 16;

/// A picture as a camera delivers it.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// 8 or 16.
    pub file_bits: u8,
    /// Row by row.
    pub samples: Vec<u16>,
}

/// A scene made ready to be rendered.
#[derive(Debug)]
pub struct Renderer<'a> {
    scene: &'a Scene<'a>,
    layers: Vec<Layer>,
    taps: Taps,
    /// Pixels round a tile that its blurred pixels draw on.
    apron_px: usize,
    tiles_x: usize,
    tiles_y: usize,
    /// True for tiles that an outline crosses, apron included.
    crossed: Vec<bool>,
}

/// Buffers of one tile, used again for the next.
#[derive(Debug)]
struct Scratch {
    coverage: Coverage,
    cells: Vec<f32>,
    columns: Vec<f32>,
    light: Vec<f32>,
}

impl<'a> Renderer<'a> {
    /// Projects all outlines and finds the tiles they cross.
    pub fn new(scene: &'a Scene<'a>) -> Renderer<'a> {
        let layers = scene.layers();
        let taps = Taps::gaussian(scene.optics.gaussian_px);
        let apron_px = taps.apron_cells().div_ceil(FINE);
        let tiles = |px: u32| (px as usize).div_ceil(TILE);
        let (tiles_x, tiles_y) = (tiles(scene.camera.width), tiles(scene.camera.height));
        let mut renderer =
            Renderer { scene, layers, taps, apron_px, tiles_x, tiles_y, crossed: vec![false; tiles_x * tiles_y] };
        renderer.mark_crossed();
        renderer
    }

    fn mark_crossed(&mut self) {
        let apron = self.apron_px as f64 + 0.5;
        let tile_of = |v: f64, count: usize| ((v / TILE as f64).floor().max(0.0) as usize).min(count);
        for outline in self.layers.iter().flat_map(|layer| &layer.outlines) {
            let points = &outline.points;
            for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
                // Long pieces are marked bit by bit, or their bounding boxes would mark half the picture.
                let bits = ((b - a).norm() / TILE as f64).clamp(1.0, 1e5).ceil();
                for k in 0..bits as usize {
                    let from = a + (b - a) * (k as f64 / bits);
                    let to = a + (b - a) * ((k + 1) as f64 / bits);
                    let (x0, x1) = (from.x.min(to.x) - apron + 0.5, from.x.max(to.x) + apron + 0.5);
                    let (y0, y1) = (from.y.min(to.y) - apron + 0.5, from.y.max(to.y) + apron + 0.5);
                    if x1 < 0.0 || y1 < 0.0 {
                        continue;
                    }
                    for ty in tile_of(y0, self.tiles_y)..(tile_of(y1, self.tiles_y) + 1).min(self.tiles_y) {
                        for tx in tile_of(x0, self.tiles_x)..(tile_of(x1, self.tiles_x) + 1).min(self.tiles_x) {
                            self.crossed[ty * self.tiles_x + tx] = true;
                        }
                    }
                }
            }
        }
    }

    fn scratch(&self) -> Scratch {
        let side = (TILE + 2 * self.apron_px) * FINE;
        Scratch {
            coverage: Coverage::new(side, side),
            cells: vec![0.0; side * side],
            columns: vec![0.0; side * TILE],
            light: vec![0.0; TILE * TILE],
        }
    }

    /// Reflected light of a tile before the sensor, as shares of its range, into `scratch.light`.
    fn light(&self, tx: usize, ty: usize, scratch: &mut Scratch) {
        let (x0, y0) = ((tx * TILE) as f64, (ty * TILE) as f64);
        if self.crossed[ty * self.tiles_x + tx] {
            self.paint(x0, y0, scratch);
            self.spread(scratch);
        } else {
            let middle = Point2::new(x0 + TILE as f64 / 2.0 - 0.5, y0 + TILE as f64 / 2.0 - 0.5);
            let tone = self.topmost_tone(&middle);
            for (k, value) in scratch.light.iter_mut().enumerate() {
                let (x, y) = (x0 + (k % TILE) as f64, y0 + (k / TILE) as f64);
                *value = (tone.0 + tone.1 * x + tone.2 * y) as f32;
            }
        }
        let camera = &self.scene.camera;
        for (k, value) in scratch.light.iter_mut().enumerate() {
            let px = Point2::new(x0 + (k % TILE) as f64, y0 + (k / TILE) as f64);
            *value *= self.scene.lighting.at(&px, camera.width, camera.height) as f32;
        }
    }

    fn topmost_tone(&self, px: &Point2<f64>) -> (f64, f64, f64) {
        let covers = |layer: &&Layer| layer.outlines.iter().any(|o| o.contains(px));
        self.layers.iter().rev().find(covers).map_or((0.0, 0.0, 0.0), |layer| layer.tone)
    }

    /// Mean reflectance of each fine cell of a tile with its apron.
    fn paint(&self, x0: f64, y0: f64, scratch: &mut Scratch) {
        let apron = self.apron_px as f64;
        // A pixel's area starts half a pixel before its centre.
        let origin = (x0 - apron - 0.5, y0 - apron - 0.5);
        let side = TILE as f64 + 2.0 * apron;
        let cell = 1.0 / FINE as f64;
        scratch.cells.fill(0.0);
        for layer in &self.layers {
            let touches = |o: &&Outline| {
                o.high.x > origin.0 && o.low.x < origin.0 + side && o.high.y > origin.1 && o.low.y < origin.1 + side
            };
            let mut empty = true;
            for outline in layer.outlines.iter().filter(touches) {
                if empty {
                    scratch.coverage.clear();
                    empty = false;
                }
                scratch.coverage.add(&outline.points, origin, FINE as f64, outline.sign);
            }
            if !empty {
                let (value, along_x, along_y) = layer.tone;
                let first = value + along_x * (origin.0 + cell / 2.0) + along_y * (origin.1 + cell / 2.0);
                let tone = (first as f32, (along_x * cell) as f32, (along_y * cell) as f32);
                scratch.coverage.paint(&mut scratch.cells, tone);
            }
        }
    }

    /// Fine cells to pixels: weights along x, then along y.
    fn spread(&self, scratch: &mut Scratch) {
        let side = (TILE + 2 * self.apron_px) * FINE;
        let start = (self.apron_px * FINE) - self.taps.apron_cells();
        let weights = &self.taps.weights;
        for (row, out) in scratch.cells.chunks_exact(side).zip(scratch.columns.chunks_exact_mut(TILE)) {
            for (x, value) in out.iter_mut().enumerate() {
                let cells = &row[start + x * FINE..][..weights.len()];
                *value = dot(cells, weights);
            }
        }
        for (y, out) in scratch.light.chunks_exact_mut(TILE).enumerate() {
            out.fill(0.0);
            for (k, &weight) in weights.iter().enumerate() {
                let row = &scratch.columns[(start + y * FINE + k) * TILE..][..TILE];
                for (value, cell) in out.iter_mut().zip(row) {
                    *value += weight * cell;
                }
            }
        }
    }

    /// Light before the sensor in a rectangle of the picture, row by row, as shares of the sensor's range.
    pub fn light_in(&self, x: usize, y: usize, width: usize, height: usize) -> Vec<f64> {
        let mut scratch = self.scratch();
        let mut light = vec![0.0; width * height];
        for ty in y / TILE..(y + height).div_ceil(TILE).min(self.tiles_y) {
            for tx in x / TILE..(x + width).div_ceil(TILE).min(self.tiles_x) {
                self.light(tx, ty, &mut scratch);
                for (k, &value) in scratch.light.iter().enumerate() {
                    let (px, py) = (tx * TILE + k % TILE, ty * TILE + k / TILE);
                    if (x..x + width).contains(&px) && (y..y + height).contains(&py) {
                        light[(py - y) * width + px - x] = f64::from(value);
                    }
                }
            }
        }
        light
    }

    /// The whole picture, noise and all.
    pub fn picture(&self, normals: &NormalTable) -> Picture {
        let (width, height) = (self.scene.camera.width as usize, self.scene.camera.height as usize);
        let exposer = Exposer::new(self.scene.sensor, normals, self.scene.seed, self.scene.picture);
        let mut samples = vec![0u16; width * height];
        let mut scratch = self.scratch();
        let mut numbers = vec![0u16; TILE * TILE];
        for ty in 0..self.tiles_y {
            for tx in 0..self.tiles_x {
                self.light(tx, ty, &mut scratch);
                exposer.expose(&scratch.light, (ty * self.tiles_x + tx) as u64, &mut numbers);
                let columns = TILE.min(width - tx * TILE);
                for (dy, row) in numbers.chunks_exact(TILE).enumerate().take(TILE.min(height - ty * TILE)) {
                    let at = (ty * TILE + dy) * width + tx * TILE;
                    samples[at..at + columns].copy_from_slice(&row[..columns]);
                }
            }
        }
        Picture { width, height, file_bits: if self.scene.sensor.bits <= 8 { 8 } else { 16 }, samples }
    }
}

/// Scalar product with a fixed order of summation that the compiler can spread over lanes.
#[inline]
fn dot(a: &[f32], b: &[f32]) -> f32 {
    let mut lanes = [0.0f32; 8];
    let (a_whole, a_rest) = a.as_chunks::<8>();
    let (b_whole, b_rest) = b.as_chunks::<8>();
    for (x, y) in a_whole.iter().zip(b_whole) {
        for ((lane, x), y) in lanes.iter_mut().zip(x).zip(y) {
            *lane += x * y;
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(x, y)| x * y).sum();
    lanes.iter().sum::<f32>() + rest
}
