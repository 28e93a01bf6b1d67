//! Pixels that a corner cannot explain: hot ones and hot columns, and those that a clipped channel has pulled down.
//!
//! In: a corner's fit and what is usual on its board. Out: which pixels a second fit leaves out. A pixel is out where
//! it lies far from the first fit in the noise of the board and in the contrast, so that neither noise nor a blur that
//! is no Gaussian costs pixels; beside clipped pixels also where the fit comes near the level at which they clip, since
//! of those only the darker ones would be left. Goes wrong: something before the board, which takes more of the window;
//! [`few`] tells them apart.

use std::f64::consts::FRAC_1_SQRT_2;

use nalgebra::Vector2;

use super::Measured;
use super::saddle_fit::Model;
use super::saddle_fit::window::Keep;

/// A pixel is out where it lies this many standard deviations of the board's noise from the first fit...
const MOST_SIGMAS: f64 = 6.0;
/// ... and this share of half the contrast, which no blur of a lens adds; less than that remains of what hides a
/// square.
const MOST_CONTRAST: f64 = 0.15;
/// Standard deviations below the level at which pixels clip where none of them has been clipped yet.
const CLIP_SIGMAS: f64 = 3.0;
/// As many pixels of a window may be out as a column and a half of it holds: something before the board hides more.
const MOST_COLUMNS: f64 = 1.6;

/// Whether so many of a window's pixels are few enough to be hot ones.
pub(super) fn few(out: usize, pixels: usize) -> bool {
    out as f64 <= MOST_COLUMNS * ((out + pixels) as f64).sqrt()
}

/// Keeps what the first fit of a corner explains.
pub(super) struct Explained {
    model: Model,
    most_off: f64,
    clip_level: f64,
    highest: f64,
}

impl Explained {
    /// What `first` explains, in a window that starts at its place; `roughness` is the board's usual residual as a
    /// share of half the contrast, `clips` whether there are clipped pixels in the window.
    pub(super) fn by(first: &Measured, roughness: f64, clip_level: f64, clips: bool) -> Explained {
        let model = Model { corner: Vector2::zeros(), ..first.fit.model };
        let half_contrast = model.half_contrast.abs();
        let sigma = roughness * half_contrast;
        Explained {
            model,
            most_off: (MOST_SIGMAS * sigma).max(MOST_CONTRAST * half_contrast),
            clip_level,
            highest: if clips { clip_level - CLIP_SIGMAS * sigma } else { f64::INFINITY },
        }
    }
}

impl Keep for Explained {
    fn keeps(&self, x: f64, y: f64, grey: f64) -> bool {
        let expected = about(&self.model, x, y);
        grey < self.clip_level && expected < self.highest && (grey - expected).abs() <= self.most_off
    }
}

/// The model's grey value, where edges that are not square to each other overlap to a twentieth of the contrast.
fn about(model: &Model, x: f64, y: f64) -> f64 {
    let [a, b]: [f64; 2] = [0, 1].map(|k| {
        let (sin, cos) = model.angles_rad[k].sin_cos();
        let along = cos * x + sin * y;
        let z = (cos * y - sin * x + 0.5 * model.bend[k] * along * along) / model.blur_px[k];
        statrs::function::erf::erf(z * FRAC_1_SQRT_2)
    });
    let pattern = model.dark.map_or(a * b, |[first, second]| 0.5 * (a * b + second * a + first * b - first * second));
    (1.0 + model.light_slope.x * x + model.light_slope.y * y) * (model.level + model.half_contrast * pattern)
}
