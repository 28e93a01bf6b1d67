//! A scene to a picture, tile by tile.
//!
//! In: a [`Scene`]. Out: a [`Picture`]. Method: every shape's outline is projected through the lens; in tiles that an
//! outline crosses, the exact area coverage of cells a quarter of a pixel wide is painted layer by layer, then spread
//! and integrated over pixels ([`super::psf`]); tiles that no outline crosses show one surface. Light and sensor
//! follow. Tiles are independent, so any order gives the same picture; memory is one picture of 16 bits.

use nalgebra::{Point2, Point3};

use super::coverage::Coverage;
use super::psf::{FINE, Spot, Taps, pupil};
use super::scene::{Layer, Scene};
use super::sensor::Exposer;
use crate::simulate::draws::NormalTable;

/// Side of a tile, px. The spot is one and the same within a tile.
const TILE: usize = 16;

/// A picture as a camera delivers it.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: usize,
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
    /// Points of the lens's pupil; empty for a lens that is a Gaussian and nothing else.
    pupil: Vec<(f32, f32)>,
    /// Pixels round a tile that its blurred pixels draw on.
    apron_px: usize,
    tiles_x: usize,
    tiles_y: usize,
    /// Tile and layer, sorted, for each outline that comes near a tile.
    crossings: Vec<(u32, u16)>,
}

/// Buffers of one tile, used again for the next.
#[derive(Debug)]
struct Scratch {
    coverage: Coverage,
    cells: Vec<f32>,
    spread: Vec<f32>,
    columns: Vec<f32>,
    light: Vec<f32>,
}

impl<'a> Renderer<'a> {
    /// Projects all outlines and finds the tiles they cross.
    pub fn new(scene: &'a Scene<'a>) -> Renderer<'a> {
        let layers = scene.layers();
        let has_spot = scene.optics.defocus.is_some() || scene.optics.coma_px != 0.0;
        let taps = Taps::gaussian(scene.optics.gaussian_px, if has_spot { 4 } else { 2 });
        let spot_cells = if has_spot { scene.largest_spot_cells() } else { 0 };
        let apron_px = (taps.apron_cells() + spot_cells).div_ceil(FINE);
        let tiles = |px: u32| (px as usize).div_ceil(TILE);
        let (tiles_x, tiles_y) = (tiles(scene.camera.width), tiles(scene.camera.height));
        let pupil = if has_spot { pupil() } else { Vec::new() };
        let mut renderer = Renderer { scene, layers, taps, pupil, apron_px, tiles_x, tiles_y, crossings: Vec::new() };
        renderer.crossings = renderer.find_crossings();
        renderer
    }

    fn find_crossings(&self) -> Vec<(u32, u16)> {
        // Pixel p covers p - 0.5 to p + 0.5: shifted by half a pixel, tiles start at multiples of their side.
        let near = self.apron_px as f64;
        let mut crossings = Vec::new();
        let range = |low: f64, high: f64, count: usize| {
            let tile = |v: f64| (((v + 0.5) / TILE as f64).floor().max(0.0) as usize).min(count);
            if high + near + 0.5 < 0.0 { 0..0 } else { tile(low - near)..(tile(high + near) + 1).min(count) }
        };
        for (layer, outline) in
            self.layers.iter().enumerate().flat_map(|(k, layer)| layer.outlines.iter().map(move |o| (k, o)))
        {
            let points = &outline.points;
            for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
                // Long pieces are marked bit by bit, or their bounding boxes would mark half the picture.
                let bits = ((b - a).norm() / TILE as f64).clamp(1.0, 1e4).ceil();
                for k in 0..bits as usize {
                    let from = a + (b - a) * (k as f64 / bits);
                    let to = a + (b - a) * ((k + 1) as f64 / bits);
                    for ty in range(from.y.min(to.y), from.y.max(to.y), self.tiles_y) {
                        for tx in range(from.x.min(to.x), from.x.max(to.x), self.tiles_x) {
                            crossings.push(((ty * self.tiles_x + tx) as u32, layer as u16));
                        }
                    }
                }
            }
        }
        crossings.sort_unstable();
        crossings.dedup();
        crossings
    }

    fn cells_side(&self) -> usize {
        (TILE + 2 * self.apron_px) * FINE
    }

    fn scratch(&self) -> Scratch {
        let side = self.cells_side();
        Scratch {
            coverage: Coverage::new(side, side),
            cells: vec![0.0; side * side],
            spread: vec![0.0; if self.pupil.is_empty() { 0 } else { side * side }],
            columns: vec![0.0; side * TILE],
            light: vec![0.0; TILE * TILE],
        }
    }

    /// Light of a tile before the sensor, as shares of its range, into `scratch.light`.
    fn light(&self, tx: usize, ty: usize, scratch: &mut Scratch) {
        let (x0, y0) = ((tx * TILE) as f64, (ty * TILE) as f64);
        let tile = (ty * self.tiles_x + tx) as u32;
        let first = self.crossings.partition_point(|c| c.0 < tile);
        let crossing = self.crossings[first..].iter().take_while(|c| c.0 == tile).map(|c| usize::from(c.1));
        // No outline of these layers comes near: what covers the middle covers all of the tile.
        let middle = Point2::new(x0 + TILE as f64 / 2.0 - 0.5, y0 + TILE as f64 / 2.0 - 0.5);
        let base = (0..self.layers.len())
            .rev()
            .filter(|&k| !crossing.clone().any(|c| c == k))
            .find(|&k| self.layers[k].outlines.iter().any(|o| o.contains(&middle)));
        let mut above = crossing.filter(|&k| base.is_none_or(|base| k > base)).peekable();
        if above.peek().is_some() {
            self.paint_base(base, x0, y0, scratch);
            self.paint(above, x0, y0, scratch);
            self.blur(&middle, scratch);
        } else {
            for (y, row) in scratch.light.chunks_exact_mut(TILE).enumerate() {
                self.surface(base, x0, y0 + y as f64, row);
            }
        }
        for (y, row) in scratch.light.chunks_exact_mut(TILE).enumerate() {
            self.scene.lighting.shine(row, x0, y0 + y as f64, &self.scene.camera);
        }
    }

    /// One row of pixels of a layer, or of the backdrop.
    fn surface(&self, layer: Option<usize>, x0: f64, y: f64, row: &mut [f32]) {
        match layer {
            Some(layer) => {
                let (value, along_x, along_y) = self.layers[layer].tone;
                let start = value + along_x * x0 + along_y * y;
                row.iter_mut().enumerate().for_each(|(x, value)| *value = (start + along_x * x as f64) as f32);
            }
            None => {
                let backdrop = self.scene.backdrop;
                row.iter_mut().enumerate().for_each(|(x, value)| *value = backdrop.at(x0 + x as f64, y));
            }
        }
    }

    /// Fills the fine cells with what lies beneath all crossing layers. It is smooth: one value a pixel will do.
    fn paint_base(&self, base: Option<usize>, x0: f64, y0: f64, scratch: &mut Scratch) {
        let side = self.cells_side();
        let pixels = side / FINE;
        let apron = self.apron_px as f64;
        let mut row = vec![0.0; pixels];
        for (y, lines) in scratch.cells.chunks_exact_mut(side * FINE).enumerate() {
            self.surface(base, x0 - apron, y0 - apron + y as f64, &mut row);
            let (line, others) = lines.split_at_mut(side);
            line.chunks_exact_mut(FINE).zip(&row).for_each(|(cells, &value)| cells.fill(value));
            others.chunks_exact_mut(side).for_each(|other| other.copy_from_slice(line));
        }
    }

    /// Paints layers, from behind to before, over the fine cells of a tile with its apron.
    fn paint(&self, layers: impl Iterator<Item = usize>, x0: f64, y0: f64, scratch: &mut Scratch) {
        let apron = self.apron_px as f64;
        // A pixel's area starts half a pixel before its centre.
        let origin = (x0 - apron - 0.5, y0 - apron - 0.5);
        let side = TILE as f64 + 2.0 * apron;
        let cell = 1.0 / FINE as f64;
        for layer in layers {
            let layer = &self.layers[layer];
            scratch.coverage.clear();
            for o in &layer.outlines {
                if o.high.x > origin.0 && o.low.x < origin.0 + side && o.high.y > origin.1 && o.low.y < origin.1 + side
                {
                    scratch.coverage.add(&o.points, origin, FINE as f64, o.sign);
                }
            }
            let (value, along_x, along_y) = layer.tone;
            let first = value + along_x * (origin.0 + cell / 2.0) + along_y * (origin.1 + cell / 2.0);
            let tone = (first as f32, (along_x * cell) as f32, (along_y * cell) as f32);
            scratch.coverage.paint(&mut scratch.cells, tone);
        }
    }

    /// Fine cells to pixels: the lens's spot, then Gaussian and pixel along x and along y.
    fn blur(&self, middle: &Point2<f64>, scratch: &mut Scratch) {
        let side = self.cells_side();
        if !self.pupil.is_empty() {
            let (disc_px, flare_px) = self.scene.spot_at(middle);
            Spot::new(&self.pupil, disc_px, flare_px).spread(&scratch.cells, side, &mut scratch.spread);
            std::mem::swap(&mut scratch.cells, &mut scratch.spread);
        }
        let start = (self.apron_px * FINE) - self.taps.apron_cells();
        let weights = &self.taps.weights;
        for (row, out) in scratch.cells.chunks_exact(side).zip(scratch.columns.chunks_exact_mut(TILE)) {
            for (x, value) in out.iter_mut().enumerate() {
                *value = dot(&row[start + x * FINE..][..weights.len()], weights);
            }
        }
        for (y, out) in scratch.light.chunks_exact_mut(TILE).enumerate() {
            out.fill(0.0);
            for (k, &weight) in weights.iter().enumerate() {
                let row = &scratch.columns[(start + y * FINE + k) * TILE..][..TILE];
                out.iter_mut().zip(row).for_each(|(value, cell)| *value += weight * cell);
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

impl Scene<'_> {
    /// Radius of the blur disc and the comatic flare of a point of the board's plane seen at a place in the picture,
    /// px.
    pub fn spot_at(&self, px: &Point2<f64>) -> (f64, (f64, f64)) {
        let camera = &self.camera;
        let (dx, dy) = (px.x - camera.cx, px.y - camera.cy);
        let disc_px = self.optics.defocus.map_or(0.0, |defocus| {
            let origin = self.camera_from_board * Point3::origin();
            let normal = self.camera_from_board.rotation * nalgebra::Vector3::z();
            let ray = nalgebra::Vector3::new(dx / camera.fx, dy / camera.fy, 1.0);
            let z = normal.dot(&origin.coords) / normal.dot(&ray);
            // Beyond the board its plane may run into the camera or away to the horizon.
            let z = if z.is_finite() && z > 0.0 { z } else { origin.z };
            defocus.radius_px(z.clamp(0.6 * origin.z, 1.6 * origin.z), camera.fx)
        });
        let to_corner = f64::from(camera.width).hypot(f64::from(camera.height)) / 2.0;
        let share = self.optics.coma_px / to_corner;
        (disc_px, (share * dx, share * dy))
    }

    fn largest_spot_cells(&self) -> usize {
        let (w, h) = (f64::from(self.camera.width), f64::from(self.camera.height));
        // Depth and field vary evenly over a plane: the largest spot is at one of the corners or at a border's middle.
        let spots = (0..9).map(|k| Point2::new(w * f64::from(k % 3) / 2.0, h * f64::from(k / 3) / 2.0));
        let reach = |(disc, flare): (f64, (f64, f64))| Spot::reach_cells(disc, flare.0.hypot(flare.1));
        spots.map(|px| reach(self.spot_at(&px))).max().unwrap_or(0)
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
