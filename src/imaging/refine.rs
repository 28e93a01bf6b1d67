//! Coarse corners to measured ones: a fit of the blurred corner to the raw pixels at full size, for each corner.
//!
//! In: the picture and the board as detected. Out: corners with covariance. First each corner is fitted on the reduced copy
//! in a small window that a coarse start can't lead astray; then at full size in the largest window that stays inside the
//! four squares round it; last, the board's corners share what they know of the light. Goes wrong: a corner without contrast, hidden, cut off by the border or saturated; it
//! is dropped, the others stay.

use nalgebra::{Point2, Vector2};

use super::Corner;
use super::bend::bends;
use super::corner_fit::window::{Frame, Window};
use super::corner_fit::{Fit, Model, fit};
use super::detect::Detected;
use super::grid::{Grid, Places};
use super::lighting;
use super::picture::{Picture, Pixels};

/// Half of the first window on the copy, px.
const FIRST_HALF_PX: f64 = 6.0;
/// Pixels farther than this many blurs from both edges tell only the two grey levels.
const BAND_BLURS: f64 = 3.5;
/// The next edge's blur reaches this many blurs into the square.
const MARGIN_BLURS: f64 = 3.0;

/// Half of the largest window, px. The gain goes with the root of the window, the time with the window; beyond this a
/// board's own making (1 um is 0.02 px at 0.05 mm a px) hides all gain.
const MOST_HALF_PX: f64 = 80.0;
/// Half of the window that brings a fit near its end where the squares are large, px.
const NEAR_HALF_PX: f64 = 20.0;

/// Share of the light that may change over a square. Light does not; a fit that says so has taken a neighbour's edge for its gradient.
const MOST_LIGHT_CHANGE: f64 = 0.3;

/// A corner and all that its fit tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Raw place in the picture, px.
    pub px: Point2<f64>,
    /// The fit it comes from.
    pub fit: Fit,
}

/// Measures all corners of a board.
pub fn refine(picture: &Picture, detected: &Detected) -> Grid<Corner> {
    let measured = measure(picture, detected);
    Grid::from_fn(measured.columns, measured.rows, |col, row| {
        if let Some(m) = measured.get(col, row) {
            let [a, b] = m.fit.model.blur_px;
            let blur_px = Some((0.5 * (a * a + b * b)).sqrt());
            return Some(Corner {
                col,
                row,
                px: m.px,
                covariance_px2: Some(m.fit.covariance_px2),
                blur_px,
                used: true,
            });
        }
        // Kept where it was seen roughly, so that a picture in which nothing could be measured can still be judged.
        let px = detected.at_full_size(detected.corners.get(col, row)?);
        Some(Corner { col, row, px, covariance_px2: None, blur_px: None, used: false })
    })
}

/// Measures all corners of a board, with what else the fits tell.
pub fn measure(picture: &Picture, detected: &Detected) -> Grid<Measured> {
    let (columns, rows) = (detected.corners.columns, detected.corners.rows);
    let k = detected.factor as f64;
    let mut window = Window::default();
    let first: Grid<Measured> = Grid::from_fn(columns, rows, |col, row| {
        let cell = Cell::of(&detected.corners, col, row)?;
        // A stretched copy reaches 255 without being saturated.
        let fit = first_fit(&detected.copy, &cell, &mut window)?;
        Some(Measured { px: fit.place(&cell.place), fit })
    });
    let bends = bends(&first.map(|m| detected.at_full_size(&m.px)));
    // A neighbour that could not be measured still says how far the squares reach.
    let places: Places = Grid::from_fn(columns, rows, |col, row| {
        let px = first.get(col, row).map_or(detected.corners.get(col, row), |m| Some(&m.px))?;
        Some(detected.at_full_size(px))
    });
    let saturation = picture.saturation();
    let mut measured = Grid::from_fn(columns, rows, |col, row| {
        let from = first.get(col, row)?;
        let cell = Cell::of(&places, col, row)?;
        let mut start =
            Model { corner: Vector2::zeros(), bend: bends[row * columns + col], ..enlarged(&from.fit.model, k) };
        if matches!(picture.pixels, Pixels::Sixteen(_)) {
            // The copy's grey values are not the picture's: without contrast the fit finds levels of its own.
            start.half_contrast = 0.0;
        }
        match full_fit(picture, saturation, &cell, &start, &mut window) {
            // At full size the first fit is a measurement already, of a smaller window.
            Some(full) if detected.factor > 1 || agrees(from, &full) => Some(full),
            _ if detected.factor == 1 => Some(*from),
            _ => None,
        }
    });
    lighting::tie(&mut measured);
    measured
}

/// A corner's surroundings: vectors along the two edges, as long as to the nearer neighbour.
#[derive(Clone, Copy)]
struct Cell {
    place: Point2<f64>,
    edges: [Vector2<f64>; 2],
}

impl Cell {
    fn of(grid: &Places, col: usize, row: usize) -> Option<Cell> {
        let place = *grid.get(col, row)?;
        let (c, r) = (col as isize, row as isize);
        let edge = |dc: isize, dr: isize| {
            let forth = grid.around(c + dc, r + dr).map(|p| p - place);
            let back = grid.around(c - dc, r - dr).map(|p| place - p);
            match (forth, back) {
                (Some(f), Some(b)) => Some((f + b).normalize() * f.norm().min(b.norm())),
                (one, other) => one.or(other),
            }
        };
        let cell = Cell { place, edges: [edge(1, 0)?, edge(0, 1)?] };
        (cell.side() * cell.skew() > 2.0).then_some(cell)
    }

    /// Length of the shorter edge, px.
    fn side(&self) -> f64 {
        self.edges[0].norm().min(self.edges[1].norm())
    }

    /// Sine of the angle between the edges.
    fn skew(&self) -> f64 {
        let [a, b] = self.edges;
        (a.x * b.y - a.y * b.x).abs() / (a.norm() * b.norm())
    }
}

/// A model of the copy as one of the picture it was reduced from by `k`.
fn enlarged(model: &Model, k: f64) -> Model {
    // The copy's pixel adds the variance of its own box.
    let blur = |s: f64| if k > 1.0 { (k * k * (s * s - 1.0 / 12.0)).max(0.25).sqrt() } else { s };
    Model { blur_px: model.blur_px.map(blur), light_slope: model.light_slope / k, ..*model }
}

/// A fit in a small window, or in larger ones where a wide blur fills it.
fn first_fit(copy: &Picture, cell: &Cell, window: &mut Window) -> Option<Fit> {
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
        };
        let halves = cell.edges.map(|e| e.normalize() * half);
        window.collect(copy, f64::MAX, &Frame { start: cell.place, halves, band_px: f64::MAX });
        if let Some(first) = fit(&start, window)
            && plausible(&first, &start, cell)
            && (first.model.blur_px.iter().all(|&s| s < 0.4 * half) || half >= most)
        {
            return Some(first);
        }
        if half >= most {
            return None;
        }
        half = (2.0 * half).min(most);
    }
}

/// A fit in the largest window that the squares allow, from one near the corner where that is much smaller: most steps are
/// taken there, and the blur it finds is that of the picture, not of the copy, so fewer pixels count as near an edge.
fn full_fit(picture: &Picture, saturation: f64, cell: &Cell, start: &Model, window: &mut Window) -> Option<Measured> {
    let wide = cell.side() > 2.0 * NEAR_HALF_PX;
    let near = if wide { fit_within(NEAR_HALF_PX, picture, saturation, cell, start, window) } else { None };
    let (place, start) = near.map_or((cell.place, *start), |near| {
        // A window in the middle of which the corner is: what the light's gradient adds on one side it takes on the other.
        (near.px, Model { corner: Vector2::zeros(), ..near.fit.model })
    });
    fit_within(MOST_HALF_PX, picture, saturation, &Cell { place, ..*cell }, &start, window)
}

/// A fit in a window that reaches up to `most_half_px` along each edge.
fn fit_within(
    most_half_px: f64,
    picture: &Picture,
    saturation: f64,
    cell: &Cell,
    start: &Model,
    window: &mut Window,
) -> Option<Measured> {
    let mut start = *start;
    loop {
        let blur = start.blur_px[0].max(start.blur_px[1]);
        // Oblique edges come nearer to each other.
        let margin = (MARGIN_BLURS * blur + 1.0) / cell.skew();
        let halves = cell.edges.map(|e| e.normalize() * (e.norm() - margin).max(0.5 * e.norm()).min(most_half_px));
        let band_px = BAND_BLURS * blur + 1.0;
        window.collect(picture, saturation, &Frame { start: cell.place, halves, band_px });
        let found = fit(&start, window)?;
        let wider = found.model.blur_px[0].max(found.model.blur_px[1]);
        // The copy may have hidden how wide the blur is; the band must hold the whole edge.
        if BAND_BLURS * wider <= 1.2 * band_px {
            let fits = plausible(&found, &start, cell);
            return fits.then(|| Measured { px: found.place(&cell.place), fit: found });
        }
        if wider > 0.5 * cell.side() {
            return None;
        }
        start = Model { blur_px: found.model.blur_px, ..start };
    }
}

/// False for a fit that wandered off, turned away, or found no contrast.
fn plausible(fit: &Fit, start: &Model, cell: &Cell) -> bool {
    let turned = (0..2).map(|k| (fit.model.angles_rad[k] - start.angles_rad[k]).abs()).fold(0.0, f64::max);
    fit.model.corner.norm() < (0.4 * cell.side()).min(3.0)
        && turned < 0.35
        && fit.model.blur_px.iter().all(|&s| s < 0.5 * cell.side())
        && fit.model.half_contrast.abs() > fit.residual
        && fit.model.light_slope.norm() * cell.side() < MOST_LIGHT_CHANGE
        && fit.covariance_px2.trace() < 0.25
}

/// True where the large window tells the same as the small one: a hidden or unprinted neighbour square shows as misfit.
fn agrees(first: &Measured, second: &Measured) -> bool {
    let (Measured { px: a, fit: first }, Measured { px: b, fit: second }) = (first, second);
    let sigma = (first.covariance_px2 + second.covariance_px2).trace().sqrt();
    // The copy's grey values are of 8 bits, stretched; the picture's may be of 16.
    let per_grey_of_copy = (second.model.half_contrast / first.model.half_contrast).abs();
    (b - a).norm() < 5.0 * sigma + 0.05
        && second.residual < per_grey_of_copy * (2.0 * first.residual + 1.0)
        && second.covariance_px2.trace() < 1.5 * first.covariance_px2.trace()
}
