//! Pixels that a corner cannot explain: hot ones and hot columns, and those that a clipped channel has pulled down.
//!
//! In: a corner's fit and what is usual on its board. Out: which pixels a second fit leaves out. A pixel is out where
//! it lies far from the first fit in the noise of the board and in the contrast, so that neither noise nor a blur that
//! is no Gaussian costs pixels; beside clipped pixels also where the fit comes near the level at which they clip, since
//! of those only the darker ones would be left. Goes wrong: something before the board, which takes more of the window;
//! [`few`] tells them apart.

use std::f64::consts::FRAC_1_SQRT_2;
use std::sync::LazyLock;

use nalgebra::Vector2;
use statrs::function::erf::erf;

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

/// The error function as a polygon, which is right to a ten-thousandth; nearly all pixels are told by that.
static POLYGON: LazyLock<Vec<f64>> =
    LazyLock::new(|| (0..=STEPS + 1).map(|i| erf(POLYGON_END * (i as f64 / STEPS as f64))).collect());
const STEPS: usize = 512;
const POLYGON_END: f64 = 4.0;
/// Share of the contrast within which of a limit the function itself decides.
const ROUGHLY: f64 = 1e-3;

fn roughly_erf(z: f64) -> f64 {
    if z.abs() >= POLYGON_END {
        return 1f64.copysign(z);
    }
    let at = z.abs() * (STEPS as f64 / POLYGON_END);
    let (i, share) = (at as usize, at.fract());
    (POLYGON[i] + share * (POLYGON[i + 1] - POLYGON[i])).copysign(z)
}

/// Whether so many of a window's pixels are few enough to be hot ones.
pub(super) fn few(out: usize, pixels: usize) -> bool {
    out as f64 <= MOST_COLUMNS * ((out + pixels) as f64).sqrt()
}

/// Keeps what the first fit of a corner explains.
pub(super) struct Explained {
    model: Model,
    /// Sine and cosine of its edges' angles.
    turns: [(f64, f64); 2],
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
            turns: model.angles_rad.map(f64::sin_cos),
            most_off: (MOST_SIGMAS * sigma).max(MOST_CONTRAST * half_contrast),
            clip_level,
            highest: if clips { clip_level - CLIP_SIGMAS * sigma } else { f64::INFINITY },
        }
    }
}

impl Keep for Explained {
    fn keeps(&self, x: f64, y: f64, grey: f64) -> bool {
        let within =
            |expected: f64, by: f64| expected < self.highest + by && (grey - expected).abs() <= self.most_off + by;
        let roughly = self.about(x, y, roughly_erf);
        let by = ROUGHLY * self.model.half_contrast.abs();
        grey < self.clip_level && within(roughly, by) && (within(roughly, -by) || within(self.about(x, y, erf), 0.0))
    }
}

impl Explained {
    /// The model's grey value, where edges that are not square to each other overlap to a twentieth of the contrast.
    fn about(&self, x: f64, y: f64, erf: impl Fn(f64) -> f64) -> f64 {
        let model = &self.model;
        let [a, b]: [f64; 2] = [0, 1].map(|k| {
            let (sin, cos) = self.turns[k];
            let along = cos * x + sin * y;
            let z = (cos * y - sin * x + 0.5 * model.bend[k] * along * along) / model.blur_px[k];
            erf(z * FRAC_1_SQRT_2)
        });
        let pattern =
            model.dark.map_or(a * b, |[first, second]| 0.5 * (a * b + second * a + first * b - first * second));
        (1.0 + model.light_slope.x * x + model.light_slope.y * y) * (model.level + model.half_contrast * pattern)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_kept_as_the_function_itself_says() {
        let model = Model { corner: Vector2::zeros(), ..Model::example() };
        let turns = model.angles_rad.map(f64::sin_cos);
        let by = Explained { model, turns, most_off: 10.5, clip_level: 240.0, highest: 180.0 };
        let exactly = |x: f64, y: f64, grey: f64| {
            let expected = by.about(x, y, erf);
            grey < by.clip_level && expected < by.highest && (grey - expected).abs() <= by.most_off
        };
        let mut kept = 0;
        for i in 0..40_000_u32 {
            let [x, y] = [i % 41, i / 41 % 37].map(|k| 0.31 * (f64::from(k) - 19.0));
            // Some of them at the limit to the last digits.
            let off = by.most_off + [0.0, 1e-12, -1e-12, 1e-5, -0.06, 5.0, -5.0][i as usize % 7];
            let grey = by.about(x, y, erf) + if i.is_multiple_of(2) { off } else { -off };
            assert_eq!(by.keeps(x, y, grey), exactly(x, y, grey), "{x} {y} {off}");
            kept += usize::from(by.keeps(x, y, grey));
        }
        assert!((5_000..30_000).contains(&kept), "{kept}");
    }
}
