//! What stands behind the board, far out of focus, as one camera sees it.
//!
//! It is not measured by anybody, so it is drawn on a coarse grid, blurred there, and read between the grid's points.
//! One backdrop serves all pictures that a camera takes from one placement.

use nalgebra::Point2;

use super::coverage::Coverage;
use super::outline;
use super::patch::Patch;
use crate::geometry::Transform;
use crate::simulate::draws::{Draws, Purpose};
use crate::stereo::Camera;

/// Grid points across a picture.
const GRID: usize = 640;

/// Blur of what stands behind, grid steps: 0.3 % of the picture's width.
const BLUR: f32 = 2.0;

/// Roughness of surfaces, as a share of their brightness.
const TEXTURE: f64 = 0.035;

/// A smooth picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Backdrop {
    width: usize,
    height: usize,
    /// Picture pixels a grid step.
    step_px: f64,
    values: Vec<f32>,
}

impl Backdrop {
    /// One brightness everywhere.
    pub fn plain(value: f64) -> Backdrop {
        Backdrop { width: 2, height: 2, step_px: 1.0, values: vec![value as f32; 4] }
    }

    /// Draws patches given in the left camera's frame, from far to near. `index` tells backdrops of one seed apart.
    pub fn new(camera: &Camera, camera_from_left: &Transform, patches: &[Patch], seed: u64, index: u64) -> Backdrop {
        // Small pictures get no finer grid than their pixels.
        let step_px = (f64::from(camera.width.max(camera.height)) / GRID as f64).max(1.0);
        // One more point than steps, and one to spare for rounding.
        let points = |px: u32| (f64::from(px) / step_px).ceil() as usize + 2;
        let (width, height) = (points(camera.width), points(camera.height));
        let mut values = vec![0.0; width * height];
        let mut coverage = Coverage::new(width, height);
        let origin = (-0.5 - step_px / 2.0, -0.5 - step_px / 2.0);
        for patch in patches {
            let camera_from_patch = camera_from_left * patch.parent_from_patch;
            let lift = |p: Point2<f64>| camera_from_patch * nalgebra::Point3::new(p.x, p.y, 0.0);
            if let Some(outline) = outline::project(camera, &patch.corners_mm, &lift) {
                let (value, along_x, along_y) = patch.tone.across(&outline);
                coverage.clear();
                coverage.add(&outline.points, origin, 1.0 / step_px, 1.0);
                let first = value - 0.5 * (along_x + along_y);
                coverage.paint(&mut values, (first as f32, (along_x * step_px) as f32, (along_y * step_px) as f32));
            }
        }
        let mut draws = Draws::new(seed, Purpose::Texture, index);
        let mut texture: Vec<f32> = values.iter().map(|_| (draws.normal() * TEXTURE) as f32).collect();
        blur(&mut texture, width, height);
        blur(&mut values, width, height);
        // Blur takes most of white noise away; this gives it its size back.
        let gain = (4.0 * std::f32::consts::PI * BLUR * BLUR).sqrt();
        values.iter_mut().zip(&texture).for_each(|(value, t)| *value *= 1.0 + gain * t);
        Backdrop { width, height, step_px, values }
    }

    /// Brightness at a picture point.
    #[inline]
    pub fn at(&self, x_px: f64, y_px: f64) -> f32 {
        let place = |v: f64, count: usize| {
            let v = ((v + 0.5) / self.step_px).clamp(0.0, (count - 1) as f64 - 1e-6);
            (v as usize, (v - v.floor()) as f32)
        };
        let ((i, u), (j, v)) = (place(x_px, self.width), place(y_px, self.height));
        let row = &self.values[j * self.width + i..];
        let (top, bottom) =
            (row[0] + (row[1] - row[0]) * u, row[self.width] + (row[self.width + 1] - row[self.width]) * u);
        top + (bottom - top) * v
    }
}

/// Gaussian blur of [`BLUR`] grid steps, edges repeated.
fn blur(values: &mut [f32], width: usize, height: usize) {
    let reach = (3.0 * BLUR).ceil() as isize;
    let weights: Vec<f32> = (-reach..=reach).map(|k| (-0.5 * (k as f32 / BLUR).powi(2)).exp()).collect();
    let total: f32 = weights.iter().sum();
    let clamp = |v: isize, count: usize| v.clamp(0, count as isize - 1) as usize;
    let mut rows = vec![0.0; width * height];
    let mut padded = vec![0.0; width + 2 * reach as usize];
    for (source, out) in values.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        padded.iter_mut().enumerate().for_each(|(x, v)| *v = source[clamp(x as isize - reach, width)]);
        for (k, w) in weights.iter().enumerate() {
            out.iter_mut().zip(&padded[k..]).for_each(|(value, v)| *value += w / total * v);
        }
    }
    for y in 0..height {
        let out = &mut values[y * width..][..width];
        out.fill(0.0);
        for (k, w) in (-reach..=reach).zip(&weights) {
            let from = &rows[clamp(y as isize + k, height) * width..][..width];
            out.iter_mut().zip(from).for_each(|(value, v)| *value += w / total * v);
        }
    }
}
