//! The point spread function: what the lens makes of a point, as weights on the renderer's fine grid.
//!
//! A pixel's value is the scene, spread by the lens, integrated over the pixel's area. The scene arrives as exact cell
//! means on a grid [`FINE`] times finer; here are the weights with which those cells enter a pixel.
//! Everything is summed numerically from the spread's density; no error function, on which corner fits build.

/// Cells a pixel side.
pub const FINE: usize = 4;

/// What spreads a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// Standard deviation of the Gaussian core (diffraction, pixel cross-talk), px.
    pub gaussian_px: f64,
    /// Entrance pupil over the distance to the focal plane: blur disc by depth. `None` keeps everything in focus.
    pub defocus: Option<Defocus>,
    /// Length of the comatic tail at the picture's corner, px; it grows linearly with the field and points outward.
    pub coma_px: f64,
}

/// A finite aperture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Defocus {
    /// Diameter of the entrance pupil, mm.
    pub pupil_mm: f64,
    /// Distance in focus along the optical axis, mm.
    pub focus_mm: f64,
}

impl Defocus {
    /// Radius of the blur disc of a point at depth `z_mm`, px, for a focal length in px (thin lens:
    /// the cone from the pupil to the point, cut by the focal plane, seen from the pupil).
    pub fn radius_px(&self, z_mm: f64, focal_px: f64) -> f64 {
        0.5 * self.pupil_mm * focal_px * (1.0 / z_mm - 1.0 / self.focus_mm).abs()
    }
}

/// Weights of fine cells along one axis for one pixel: `weights[k]` belongs to cell `first + k`, counted from the
/// pixel's first cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Taps {
    /// Offset of the first cell; not positive.
    pub first: isize,
    /// The weights; their sum is 1.
    pub weights: Vec<f32>,
}

/// How many standard deviations of the Gaussian are kept.
const REACH: f64 = 4.2;

/// Quadrature points a cell.
const STEPS: usize = 32;

impl Taps {
    /// The pixel's box spread by a Gaussian.
    ///
    /// Cell means in place of the scene widen the result by two boxes of a cell, of variance 1/12 cell^2 each, and a
    /// [`Spot`] on cells by two more; the Gaussian gives the variance of so many `boxes` up, so that the mean over all
    /// positions of an edge within a cell is right.
    pub fn gaussian(sigma_px: f64, boxes: usize) -> Taps {
        let cell = 1.0 / FINE as f64;
        let variance = sigma_px * sigma_px - boxes as f64 * cell * cell / 12.0;
        let sigma = variance.max(0.0).sqrt();
        let reach = (REACH * sigma / cell).ceil() as isize;
        let first = -reach;
        let count = (FINE as isize + 2 * reach) as usize;
        if reach == 0 {
            return Taps { first, weights: vec![cell as f32; count] };
        }
        // Density of box * Gaussian at a place: the Gaussian summed over the pixel.
        let fine_steps = STEPS * FINE;
        let h = 1.0 / fine_steps as f64;
        let density = |x: f64| -> f64 {
            (0..fine_steps).map(|i| (-0.5 * ((x - (i as f64 + 0.5) * h) / sigma).powi(2)).exp()).sum()
        };
        let weight = |k: usize| -> f64 {
            let start = (first + k as isize) as f64 * cell;
            (0..STEPS).map(|i| density(start + (i as f64 + 0.5) * cell / STEPS as f64)).sum()
        };
        let mut weights: Vec<f64> = (0..count).map(weight).collect();
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= total);
        Taps { first, weights: weights.iter().map(|&w| w as f32).collect() }
    }

    /// Cells needed before and after a pixel.
    pub fn apron_cells(&self) -> usize {
        self.first.unsigned_abs()
    }
}

/// Points of the pupil that make a spot. They lie in a sunflower's pattern, each with its opposite.
const PUPIL_POINTS: usize = 8192;

/// The pupil's points, in a unit disc.
pub fn pupil() -> Vec<(f32, f32)> {
    let half = PUPIL_POINTS / 2;
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let opposite = |k: usize| {
        let radius = ((k as f64 + 0.5) / half as f64).sqrt();
        let (sin, cos) = (k as f64 * golden).sin_cos();
        let (x, y) = ((radius * cos) as f32, (radius * sin) as f32);
        [(x, y), (-x, -y)]
    };
    (0..half).flat_map(opposite).collect()
}

/// Where the rays of one scene point land, as weights on fine cells: what is not Gaussian in the lens.
///
/// A ray through the pupil at `(rho cos t, rho sin t)` lands at `R rho (cos t, sin t) + B rho^2 (2 + cos 2t, sin 2t)`:
/// a disc of radius R out of focus, a comatic flare of length 3 B along the field. The chief ray (rho = 0) stays at
/// the point's true place, so a flare moves the centroid of light: that is what coma does to a measurement.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Spot {
    /// Cells from the centre to each side.
    pub reach: usize,
    /// Weights, `2 reach + 1` rows and columns; their sum is 1.
    pub weights: Vec<f32>,
}

impl Spot {
    /// Largest reach for a blur disc and a flare of these sizes, px, in cells.
    pub fn reach_cells(disc_px: f64, flare_px: f64) -> usize {
        ((disc_px + flare_px) * FINE as f64).ceil() as usize + 1
    }

    /// The spot for a blur disc of a radius and a flare along `(x, y)`, all px.
    pub fn new(pupil: &[(f32, f32)], disc_px: f64, flare_px: (f64, f64)) -> Spot {
        let reach = Spot::reach_cells(disc_px, flare_px.0.hypot(flare_px.1));
        let side = 2 * reach + 1;
        let mut weights = vec![0.0; side * side];
        let each = 1.0 / pupil.len() as f32;
        let scale = FINE as f32;
        let disc = disc_px as f32 * scale;
        let (fx, fy) = (flare_px.0 as f32 * scale / 3.0, flare_px.1 as f32 * scale / 3.0);
        let middle = reach as f32;
        for &(u, v) in pupil {
            // rho^2 (2 + cos 2t, sin 2t) with u, v along and across the field.
            let (along, across) = (3.0 * u * u + v * v, 2.0 * u * v);
            let x = disc * u + fx * along - fy * across + middle;
            let y = disc * v + fy * along + fx * across + middle;
            // A ray is shared by the four cells round it, so that the light's centroid stays where it is.
            let (i, j) = ((x.max(0.0) as usize).min(side - 2), (y.max(0.0) as usize).min(side - 2));
            let (right, low) = (x - i as f32, y - j as f32);
            weights[j * side + i] += each * (1.0 - right) * (1.0 - low);
            weights[j * side + i + 1] += each * right * (1.0 - low);
            weights[(j + 1) * side + i] += each * (1.0 - right) * low;
            weights[(j + 1) * side + i + 1] += each * right * low;
        }
        Spot { reach, weights }
    }

    /// Spreads a square of `side` cells; what lies within `reach` of its border is left as it is.
    pub fn spread(&self, cells: &[f32], side: usize, out: &mut [f32]) {
        out.copy_from_slice(cells);
        let (reach, width) = (self.reach, 2 * self.reach + 1);
        if side <= 2 * reach {
            return;
        }
        let inner = side - 2 * reach;
        for y in reach..side - reach {
            let line = &mut out[y * side + reach..][..inner];
            line.fill(0.0);
            for (j, row) in self.weights.chunks_exact(width).enumerate() {
                // Light from the cell at -offset lands here.
                let from = &cells[(y + reach - j) * side..][..side];
                for (i, &weight) in row.iter().enumerate() {
                    if weight != 0.0 {
                        let source = &from[2 * reach - i..][..inner];
                        for (value, cell) in line.iter_mut().zip(source) {
                            *value += weight * cell;
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_keep_the_light_and_the_variance() {
        for sigma in [0.3, 0.7, 1.5] {
            let taps = Taps::gaussian(sigma, 2);
            let sum: f32 = taps.weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-6);
            let middle = FINE as f64 / 2.0;
            let off = |k: usize| ((k as isize + taps.first) as f64 + 0.5 - middle) / FINE as f64;
            let variance: f64 = taps.weights.iter().enumerate().map(|(k, &w)| f64::from(w) * off(k).powi(2)).sum();
            let cell = 1.0 / FINE as f64;
            // Weights sampled at the cells' centres lack a cell's own variance once, and gave up two.
            let expected = sigma * sigma + 1.0 / 12.0 - cell * cell / 6.0;
            assert!(
                (variance - expected).abs() < 0.02 * expected + cell * cell / 12.0 + 1e-3,
                "{sigma}: {variance} {expected}"
            );
        }
    }

    #[test]
    fn nothing_is_blurred_in_the_focal_plane() {
        let defocus = Defocus { pupil_mm: 2.0, focus_mm: 525.0 };
        assert_eq!(defocus.radius_px(525.0, 10_000.0), 0.0);
        assert!(defocus.radius_px(425.0, 10_000.0) > defocus.radius_px(625.0, 10_000.0));
    }

    #[test]
    fn a_disc_is_centred_and_a_flare_points_along_the_field() {
        let pupil = pupil();
        let centroid = |spot: &Spot| {
            let width = 2 * spot.reach + 1;
            let at = |k: usize| (k as f64 - spot.reach as f64) / FINE as f64;
            let sum = |f: &dyn Fn(usize, usize) -> f64| -> f64 {
                spot.weights.iter().enumerate().map(|(k, &w)| f64::from(w) * f(k % width, k / width)).sum()
            };
            (sum(&|_, _| 1.0), sum(&|i, _| at(i)), sum(&|_, j| at(j)), sum(&|i, j| at(i).powi(2) + at(j).powi(2)))
        };
        let (total, x, y, spread) = centroid(&Spot::new(&pupil, 1.3, (0.0, 0.0)));
        assert!((total - 1.0).abs() < 1e-5 && x.abs() < 1e-4 && y.abs() < 1e-4, "{total} {x} {y}");
        // A disc's second moment is R^2 / 2; sharing a ray among cells adds 1/6 of their side squared each way.
        assert!((spread - (1.3f64.powi(2) / 2.0 + 1.0 / 48.0)).abs() < 0.005, "{spread}");
        // The flare's centroid: 2 B <rho^2> = B, a third of its length.
        let (_, x, y, _) = centroid(&Spot::new(&pupil, 0.0, (0.9, -1.2)));
        assert!((x - 0.3).abs() < 1e-4 && (y + 0.4).abs() < 1e-4, "{x} {y}");
    }

    #[test]
    fn a_spot_lands_on_the_side_it_points_to() {
        let spot = Spot::new(&pupil(), 0.0, (0.75, 0.0));
        let side = 21;
        let mut cells = vec![0.0; side * side];
        cells[10 * side + 10] = 1.0;
        let mut out = cells.clone();
        spot.spread(&cells, side, &mut out);
        let right: f32 = (11..side).map(|i| out[10 * side + i]).sum();
        let left: f32 = (0..10).map(|i| out[10 * side + i]).sum();
        assert!(right > 0.1 && left < 1e-6, "{right} {left}");
    }
}
