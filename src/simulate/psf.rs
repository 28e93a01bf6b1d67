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

/// Weights of fine cells along one axis for one pixel: `weights[k]` belongs to cell `first + k`, counted from the pixel's first cell.
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
    /// Cell means in place of the scene widen the result by two boxes of a cell, of variance 1/12 cell^2 each;
    /// the Gaussian gives that variance up, so that the mean over all positions of an edge within a cell is right.
    pub fn gaussian(sigma_px: f64) -> Taps {
        let cell = 1.0 / FINE as f64;
        let variance = sigma_px * sigma_px - cell * cell / 6.0;
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
        let mut weights: Vec<f64> = (0..count)
            .map(|k| {
                let start = (first + k as isize) as f64 * cell;
                (0..STEPS).map(|i| density(start + (i as f64 + 0.5) * cell / STEPS as f64)).sum()
            })
            .collect();
        let total: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= total);
        Taps { first, weights: weights.iter().map(|&w| w as f32).collect() }
    }

    /// Cells needed before and after a pixel.
    pub fn apron_cells(&self) -> usize {
        self.first.unsigned_abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_keep_the_light_and_the_variance() {
        for sigma in [0.3, 0.7, 1.5] {
            let taps = Taps::gaussian(sigma);
            let sum: f32 = taps.weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-6);
            let middle = FINE as f64 / 2.0;
            let variance: f64 = taps
                .weights
                .iter()
                .enumerate()
                .map(|(k, &w)| f64::from(w) * (((k as isize + taps.first) as f64 + 0.5 - middle) / FINE as f64).powi(2))
                .sum();
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
}
