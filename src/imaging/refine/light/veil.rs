//! The grey value from which light counts: what a picture shows where no light comes from the board.
//!
//! A corner's model lets uneven light act on light and dark squares in proportion. That holds for what the board
//! reflects, not for a camera's black level, for haze, for a picture whose contrast was stretched, or for a negative
//! (where it is the white level). In: the picture and where the corners are about. Out: that grey value, whole. Method:
//! over the board both kinds of squares follow the light, `grey = veil + light * reflectance`, hence the one is a
//! straight line in the other, and meets it at the veil. Goes wrong: even light does not tell the veil; then none is
//! needed, and zero is taken.

use nalgebra::{Point2, Vector2};

use crate::imaging::image::Image;
use crate::imaging::lattice::Places;
use crate::statistics::median;

/// Half of the patch in the middle of a square whose mean is taken, as a share of the square; blur does not reach it.
const PATCH_SQUARES: f64 = 0.15;
/// Fewest places for a line that is to be believed.
const FEWEST: usize = 12;
/// Residuals beyond this many times their median are something before the board.
const OUTLYING: f64 = 4.0;
/// Largest standard deviation of the veil, as a share of the contrast: of less certain ones nothing is believed.
const MOST_UNCERTAIN: f64 = 0.1;
/// Steepest line: steeper, light and dark follow the light alike, and do not tell where they meet.
const STEEPEST: f64 = 0.8;

/// Light and dark at one corner, each the mean of two squares, so that a gradient is none.
#[derive(Clone, Copy)]
struct Pair {
    even: f64,
    odd: f64,
}

/// The veil of a picture, a whole grey value; zero where the board does not tell.
pub fn level<T: Copy + Into<f64>>(image: &Image<T>, clip_level: f64, places: &Places) -> f64 {
    let pairs = pairs(image, clip_level, places);
    let found = line(&pairs).and_then(|(veil, sigma)| {
        let contrast = median(pairs.iter().map(|p| (p.even - p.odd).abs()))?;
        (sigma < MOST_UNCERTAIN * contrast).then_some(veil)
    });
    found.map_or(0.0, f64::round)
}

/// Where the line of one kind of squares over the other meets equality, and the standard deviation of that.
fn line(pairs: &[Pair]) -> Option<(f64, f64)> {
    let variance = |of: fn(&Pair) -> f64| {
        let mean = pairs.iter().map(of).sum::<f64>() / pairs.len() as f64;
        pairs.iter().map(|p| (of(p) - mean).powi(2)).sum::<f64>()
    };
    // The kind that follows the light more is the better ruler.
    let even_varies = variance(|p| p.even) > variance(|p| p.odd);
    let mut points: Vec<(f64, f64)> =
        pairs.iter().map(|p| if even_varies { (p.even, p.odd) } else { (p.odd, p.even) }).collect();
    let mut fit = Line::through(&points)?;
    for _ in 0..3 {
        let usual = median(points.iter().map(|p| fit.off(p).abs()))?;
        points.retain(|p| fit.off(p).abs() <= OUTLYING * usual.max(f64::EPSILON));
        fit = Line::through(&points)?;
    }
    if fit.slope.abs() > STEEPEST {
        return None;
    }
    let veil = (fit.mean_y - fit.slope * fit.mean_x) / (1.0 - fit.slope);
    // The line is known best in its middle: what its slope leaves open grows with the way to the veil.
    let sigma = fit.slope_sigma * (veil - fit.mean_x).abs() / (1.0 - fit.slope);
    (veil.is_finite() && sigma.is_finite()).then_some((veil, sigma))
}

struct Line {
    mean_x: f64,
    mean_y: f64,
    slope: f64,
    slope_sigma: f64,
}

impl Line {
    fn through(points: &[(f64, f64)]) -> Option<Line> {
        let n = points.len() as f64;
        if points.len() < FEWEST {
            return None;
        }
        let (mean_x, mean_y) =
            (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
        let xx = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum::<f64>();
        let xy = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum::<f64>();
        let slope = xy / xx;
        let left = points.iter().map(|p| (p.1 - mean_y - slope * (p.0 - mean_x)).powi(2)).sum::<f64>();
        let slope_sigma = (left / (n - 2.0) / xx).sqrt();
        slope.is_finite().then_some(Line { mean_x, mean_y, slope, slope_sigma })
    }

    fn off(&self, (x, y): &(f64, f64)) -> f64 {
        y - self.mean_y - self.slope * (x - self.mean_x)
    }
}

/// Light and dark round every corner whose four squares are seen whole and unclipped.
fn pairs<T: Copy + Into<f64>>(image: &Image<T>, clip_level: f64, places: &Places) -> Vec<Pair> {
    let square = |col: usize, row: usize| -> Option<f64> {
        let [a, b, d, c] = places.square(col, row)?;
        let middle = Point2::from((a.coords + b.coords + c.coords + d.coords) / 4.0);
        let sides = [b - a, c - a, d - b, d - c];
        let side = sides.iter().map(Vector2::norm).fold(f64::INFINITY, f64::min);
        mean(image, clip_level, &middle, PATCH_SQUARES * side)
    };
    let (columns, rows) = (places.columns.saturating_sub(1), places.rows.saturating_sub(1));
    let squares: Vec<Option<f64>> = (0..rows * columns).map(|k| square(k % columns, k / columns)).collect();
    let at = |col: usize, row: usize| squares[row * columns + col];
    let of_corner = |col: usize, row: usize| -> Option<Pair> {
        let falling = (at(col, row)? + at(col + 1, row + 1)?) / 2.0;
        let rising = (at(col + 1, row)? + at(col, row + 1)?) / 2.0;
        Some(if (col + row).is_multiple_of(2) {
            Pair { even: falling, odd: rising }
        } else {
            Pair { even: rising, odd: falling }
        })
    };
    let inner = |k: usize| (k % columns.saturating_sub(1).max(1), k / columns.saturating_sub(1).max(1));
    let count = columns.saturating_sub(1) * rows.saturating_sub(1);
    (0..count).map(inner).filter_map(|(col, row)| of_corner(col, row)).collect()
}

/// Mean of the pixels round a place; `None` at the border, or where one of them is clipped.
fn mean<T: Copy + Into<f64>>(image: &Image<T>, clip_level: f64, at: &Point2<f64>, half: f64) -> Option<f64> {
    let half = half.floor().max(0.0);
    let (left, top) = (at.x.round() - half, at.y.round() - half);
    let (right, bottom) = (left + 2.0 * half, top + 2.0 * half);
    let inside = left >= 0.0 && top >= 0.0 && right < image.width as f64 && bottom < image.height as f64;
    if !inside {
        return None;
    }
    let mut sum = 0.0;
    for y in top as usize..=bottom as usize {
        for &value in &image.pixels[y * image.width + left as usize..=y * image.width + right as usize] {
            let grey: f64 = value.into();
            if grey >= clip_level {
                return None;
            }
            sum += grey;
        }
    }
    Some(sum / (2.0 * half + 1.0).powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::lattice::Lattice;

    /// Squares of 20 px under light that falls by a fifth, of reflectance 0.85 and 0.08, over `veil`.
    fn board(veil: f64, gain: f64, fall: f64) -> (Image<u16>, Places) {
        let (width, height) = (200, 160);
        let grey = |x: usize, y: usize| {
            let light = 1.0 - fall * (x as f64 / width as f64) - 0.5 * fall * (y as f64 / height as f64);
            let noise = ((x * 7919 + y * 104_729) % 17) as f64 - 8.0;
            let reflectance = if (x / 20 + y / 20).is_multiple_of(2) { 0.85 } else { 0.08 };
            (veil + gain * light * reflectance + noise).round() as u16
        };
        let place = |c: usize, r: usize| Some(Point2::new(20.0 * (c + 1) as f64 - 0.5, 20.0 * (r + 1) as f64 - 0.5));
        (Image::from_fn(width, height, grey), Lattice::from_fn(9, 7, place))
    }

    #[test]
    fn a_black_level_haze_and_negatives_are_found() {
        for (veil, gain) in [(0.0, 10_000.0), (3000.0, 10_000.0), (20_000.0, 8000.0), (60_000.0, -40_000.0)] {
            let (image, places) = board(veil, gain, 0.2);
            let found = level(&image, 65_535.0, &places);
            // The patches' noise, far from where the line is known.
            assert!((found - veil).abs() < 0.01 * gain.abs(), "{veil}: {found}");
        }
    }

    #[test]
    fn even_light_or_too_few_squares_tell_nothing() {
        let (image, places) = board(5000.0, 10_000.0, 0.0);
        assert_eq!(level(&image, 65_535.0, &places), 0.0);
        let few = Lattice::from_fn(3, 3, |c, r| places.get(c, r).copied());
        assert_eq!(level(&board(5000.0, 10_000.0, 0.2).0, 65_535.0, &few), 0.0);
        // Clipped squares are none.
        assert_eq!(level(&board(0.0, 10_000.0, 0.2).0, 4000.0, &places), 0.0);
    }
}
