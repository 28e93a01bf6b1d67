//! Coarse corners to measured ones: a fit of the blurred corner to the raw pixels at full size, for each corner.
//!
//! In: the picture and the coarse grid. Out: corners with covariance. Each corner's window is a parallelogram along the two
//! edges that stays inside the four squares round it. Two passes: a small window that a coarse start can't
//! lead astray, then the largest one the squares allow. Goes wrong: a corner without contrast, hidden, cut off by
//! the border or saturated; it is dropped, the others stay.

use nalgebra::{Matrix2, Point2, Vector2};

use super::Corner;
use super::corner_fit::{Fit, Model, Window, fit};
use super::detect::Detected;
use super::grid::{Grid, Places};
use super::picture::Picture;

/// Half of the first window, px of the reduced copy.
const FIRST_HALF_COPY_PX: f64 = 5.0;
/// Pixels farther than this many blurs from both edges tell only the two grey levels; of those a sparse lattice is enough.
const BAND_BLURS: f64 = 4.0;
/// Spacing of that lattice, px.
const FLAT_STEP_PX: i64 = 4;

/// Measures all corners of a board.
pub fn refine(picture: &Picture, detected: &Detected) -> Grid<Corner> {
    let fits = refine_fits(picture, detected);
    Grid {
        columns: fits.columns,
        rows: fits.rows,
        cells: fits
            .iter_all()
            .map(|(col, row, fit)| match fit {
                Some((px, fit)) => {
                    Some(Corner { col, row, px: *px, covariance_px2: Some(fit.covariance_px2), used: true })
                }
                // Kept where it was seen roughly, so that a picture in which nothing could be measured can still be judged.
                None => {
                    let px = *detected.corners.get(col, row)?;
                    Some(Corner { col, row, px, covariance_px2: None, used: false })
                }
            })
            .collect(),
    }
}

/// Measures all corners of a board: place in the picture and the whole fit.
pub fn refine_fits(picture: &Picture, detected: &Detected) -> Grid<(Point2<f64>, Fit)> {
    let saturation = picture.saturation();
    let mut window = Window::default();
    Grid::from_fn(detected.corners.columns, detected.corners.rows, |col, row| {
        let cell = Cell::of(&detected.corners, col, row)?;
        refine_one(picture, saturation, &cell, detected.factor as f64, &mut window)
    })
}

/// A corner's surroundings: vectors along the two edges to the nearer neighbour.
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
        Some(Cell { place, edges: [edge(1, 0)?, edge(0, 1)?] })
    }

    /// Sine of the angle between the edges.
    fn skew(&self) -> f64 {
        let [a, b] = self.edges;
        (a.x * b.y - a.y * b.x).abs() / (a.norm() * b.norm())
    }
}

fn refine_one(
    picture: &Picture,
    saturation: f64,
    cell: &Cell,
    factor: f64,
    window: &mut Window,
) -> Option<(Point2<f64>, Fit)> {
    let side = cell.edges[0].norm().min(cell.edges[1].norm());
    let area_px = side * cell.skew();
    if area_px.is_nan() || area_px <= 2.0 {
        return None;
    }
    let first = first_fit(picture, saturation, cell, factor, window)?;
    let place = first.place(&cell.place);
    let start = Model { corner: Vector2::zeros(), ..first.model };
    let blur = start.blur_px[0].max(start.blur_px[1]);
    // The next corner's edge is blurred too, and oblique edges come nearer to each other.
    let halves = cell.edges.map(|e| e.normalize() * (e.norm() - (3.0 * blur + 1.0) / cell.skew()).max(0.5 * e.norm()));
    collect(picture, saturation, &place, &start, halves, BAND_BLURS * blur + 1.0, window);
    match fit(&start, window) {
        Some(second) if agrees(&first, &second) => Some((second.place(&place), second)),
        _ => Some((place, first)),
    }
}

/// A fit in a small window, or in larger ones where a wide blur fills it.
fn first_fit(picture: &Picture, saturation: f64, cell: &Cell, factor: f64, window: &mut Window) -> Option<Fit> {
    let side = cell.edges[0].norm().min(cell.edges[1].norm());
    let most = 0.6 * side;
    let mut half = (FIRST_HALF_COPY_PX * factor).max(6.0).min(most);
    loop {
        let start = Model {
            corner: Vector2::zeros(),
            angles_rad: cell.edges.map(|e| e.y.atan2(e.x)),
            blur_px: [(0.15 * half).max(0.8); 2],
            level: 0.0,
            level_slope: Vector2::zeros(),
            half_contrast: 0.0,
            contrast_slope: Vector2::zeros(),
            bend: [0.0; 2],
        };
        let halves = cell.edges.map(|e| e.normalize() * half);
        collect(picture, saturation, &cell.place, &start, halves, f64::MAX, window);
        if let Some(first) = fit(&start, window)
            && plausible(&first, &start, cell, factor)
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

/// False for a fit that wandered off, turned away, or found no contrast.
fn plausible(fit: &Fit, start: &Model, cell: &Cell, factor: f64) -> bool {
    let side = cell.edges[0].norm().min(cell.edges[1].norm());
    let moved = fit.model.corner.norm();
    let turned = (0..2).map(|k| (fit.model.angles_rad[k] - start.angles_rad[k]).abs()).fold(0.0, f64::max);
    let sigma = fit.covariance_px2.trace().sqrt();
    moved < (3.0 * factor).max(2.0).min(0.4 * side)
        && turned < 0.35
        && fit.model.blur_px.iter().all(|&s| s < 0.5 * side)
        && fit.model.half_contrast.abs() > fit.residual
        && sigma < 0.5
}

/// True where the large window tells the same as the small one: a hidden or unprinted neighbour square shows as misfit.
fn agrees(first: &Fit, second: &Fit) -> bool {
    let sigma = (first.covariance_px2 + second.covariance_px2).trace().sqrt();
    second.model.corner.norm() < 5.0 * sigma + 0.05
        && second.residual < 2.0 * first.residual + 1.0
        && second.covariance_px2.trace() < 1.5 * first.covariance_px2.trace()
}

/// Fills the window with the pixels of the parallelogram spanned by `halves` about `place`, and of those all within
/// `band` of an edge, else a sparse lattice. Saturated pixels are left out.
fn collect(
    picture: &Picture,
    saturation: f64,
    place: &Point2<f64>,
    model: &Model,
    halves: [Vector2<f64>; 2],
    band: f64,
    window: &mut Window,
) {
    window.clear();
    let (x0, y0) = (place.x.round(), place.y.round());
    let reach_x = (halves[0].x.abs() + halves[1].x.abs()).ceil() as i64 + 1;
    let reach_y = (halves[0].y.abs() + halves[1].y.abs()).ceil() as i64 + 1;
    let Some(inverse) = Matrix2::from_columns(&halves).try_inverse() else { return };
    let normals = model.angles_rad.map(|a| Vector2::new(-a.sin(), a.cos()));
    for iy in -reach_y..=reach_y {
        let y = y0 as i64 + iy;
        for ix in -reach_x..=reach_x {
            let x = x0 as i64 + ix;
            if x < 0 || y < 0 || x >= picture.width as i64 || y >= picture.height as i64 {
                continue;
            }
            let d = Vector2::new(x as f64 - place.x, y as f64 - place.y);
            if (inverse * d).amax() > 1.0 {
                continue;
            }
            let near = normals.iter().any(|n| n.dot(&d).abs() < band);
            if !near && (ix % FLAT_STEP_PX != 0 || iy % FLAT_STEP_PX != 0) {
                continue;
            }
            let grey = picture.at(x as usize, y as usize);
            if grey >= saturation {
                window.saturated += 1;
                continue;
            }
            window.push(d.x, d.y, grey);
        }
    }
}
