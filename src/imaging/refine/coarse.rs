//! First fits on the reduced copy, in windows so small that a coarse start can't lead them astray.

use nalgebra::Vector2;

use super::Measured;
use super::acceptance::{MOST_LIGHT_CHANGE, plausible};
use super::cell::Cell;
use super::saddle_fit::window::{Below, Frame, Window};
use super::saddle_fit::{Beside, Fit, Model, fit};
use crate::imaging::detect::Detected;
use crate::imaging::image::Image;
use crate::imaging::lattice::Lattice;

/// Half of the first window on the copy, px.
const FIRST_HALF_PX: f64 = 6.0;

/// How far from a marker's outline pixels are left out, blurs.
const HALO_BLURS: f64 = 1.0;

/// A first fit of each corner on the reduced copy.
pub(super) fn coarse(detected: &Detected, window: &mut Window) -> Lattice<Measured> {
    detected.corners.filter_map(|col, row, _| {
        let cell = Cell::of(&detected.corners, col, row)?;
        let cell = cell.with_markers(&detected.corners, (col, row), detected.print);
        let (fit, reach) = coarse_fit(&detected.copy, &cell, window)?;
        Some(Measured { px: fit.place(&cell.place), fit, reach })
    })
}

/// A fit in a small window, or in larger ones where a wide blur fills it; and how far that reaches.
fn coarse_fit(copy: &Image<u8>, cell: &Cell, window: &mut Window) -> Option<(Fit, [f64; 2])> {
    let most = 0.6 * cell.side();
    let mut half = FIRST_HALF_PX.min(most);
    loop {
        let start = Model {
            corner: Vector2::zeros(),
            angles_rad: cell.edges.map(|e| e.y.atan2(e.x)),
            blur_px: [(0.15 * half).max(0.8); 2],
            level: 0.0,
            half_contrast: 0.0,
            light_slope: Vector2::zeros(),
            bend: [0.0; 2],
            dark: cell.dark,
        };
        let halves = cell.edges.map(|e| e.normalize() * half);
        // A stretched copy reaches 255 without being clipped.
        // A first fit is but a start: what the blur of a marker does to it matters less than pixels.
        let hidden = cell.hidden_by(HALO_BLURS * start.blur_px[0]);
        let frame = Frame { start: cell.place, halves, band_px: f64::MAX, hidden, dark: cell.dark };
        window.collect(copy, 0.0, &Below(f64::MAX), &frame);
        if let Some(first) = fit(&start, window, Beside::default())
            && plausible(&first, &start, cell, MOST_LIGHT_CHANGE)
            && (first.model.blur_px.iter().all(|&s| s < 0.4 * half) || half >= most)
        {
            return Some((first, cell.reach(&halves)));
        }
        if half >= most {
            return None;
        }
        half = (2.0 * half).min(most);
    }
}

/// A model of the copy as one of the picture it was reduced from by `k`.
pub(super) fn enlarged(model: &Model, k: f64) -> Model {
    // The copy's pixel adds the variance of its own box.
    let blur = |s: f64| if k > 1.0 { (k * k * (s * s - 1.0 / 12.0)).max(0.25).sqrt() } else { s };
    Model { blur_px: model.blur_px.map(blur), light_slope: model.light_slope / k, ..*model }
}
