//! How one line of a whole board bends: the offsets of its corners from its chord.

use nalgebra::{DMatrix, DVector, Point2, Vector2};

use super::bend::{Bend, FEWEST, Point};
use crate::statistics::median;

/// Sets the bend of a line at each of its corners, where it shows any. Corners that are off by many times what is usual and by more than `good_px` do not
/// count.
pub(super) fn line_bend(line: &[(usize, Point)], good_px: f64, mut set: impl FnMut(usize, Bend)) {
    let ([(_, first), .., (_, last)], FEWEST..) = (line, line.len()) else { return };
    let (first, last) = (first.px, last.px);
    let chord = last - first;
    let length = chord.norm();
    let along = chord / length;
    let across = Vector2::new(-along.y, along.x);
    // A decomposition of numbers that are none would not end.
    if !along.iter().all(|v| v.is_finite()) {
        return;
    }
    let few = line.len() > FEWEST && line.iter().filter(|(_, p)| p.counts).count() <= FEWEST;
    let counting: Vec<&(usize, Point)> = line.iter().filter(|(_, p)| p.counts || few).collect();
    // Places along the chord from -1 to 1 keep the powers well apart.
    let place = |p: &Point2<f64>| 2.0 * along.dot(&(p - first)) / length - 1.0;
    let degree = match counting.len() {
        0..FEWEST => return,
        FEWEST..=5 => 2,
        6..=8 => 3,
        _ => 4,
    };
    let offset = |p: &Point2<f64>| across.dot(&(p - first));
    let points = counting.iter().map(|(at, p)| (*at, place(&p.px), offset(&p.px))).collect();
    let Some(coefficients) = through(points, degree, good_px) else { return };
    for (at, p) in line {
        let v = place(&p.px);
        let terms = (2..=degree).map(|k| (k * (k - 1)) as f64 * v.powi(k as i32 - 2));
        let second: f64 = terms.zip(2..).map(|(term, k)| coefficients[k] * term).sum();
        let per_px = -second * 4.0 / (length * length);
        if per_px.is_finite() {
            // Whole boards have lines so long that what their bends are off by is hardly anything.
            set(*at, Bend { per_px, by_own: 0.0, variance: 0.0 });
        }
    }
}

/// The polynomial through points `(number, place, offset)`, without those that lie far off: a corner that is hidden in part must
/// not bend the line of the others.
fn through(mut points: Vec<(usize, f64, f64)>, degree: usize, good_px: f64) -> Option<DVector<f64>> {
    /// A point is off by this many times the usual misfit at the least.
    const FAR: f64 = 8.0;
    loop {
        let powers = DMatrix::from_fn(points.len(), degree + 1, |i, k| points[i].1.powi(k as i32));
        let offsets = DVector::from_fn(points.len(), |i, _| points[i].2);
        let svd = powers.clone().svd(true, true);
        let coefficients = svd.solve(&offsets, 1e-12).ok()?;
        let misfit: Vec<f64> = (powers * &coefficients - offsets).iter().map(|v| v.abs()).collect();
        let usual = median(misfit.iter().copied())?;
        let (worst, most) = misfit.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        // With fewer points than that none can be told from the others.
        if most < FAR * usual + good_px || points.len() < degree + 4 {
            return Some(coefficients);
        }
        points.remove(worst);
    }
}
