//! How the lens bends a board's lines: curvature at each corner, from the corners of its line.
//!
//! In: a grid of places good to a tenth of a pixel. Out: for each corner the bend of its two edges. Method: the
//! offsets of a line's corners from its chord, as a polynomial of the place along it (degree 2 to 4, by how many corners there are).
//! Without it, a straight edge fitted to a long bent one is off by a twenty-fourth of bend times length squared.

use nalgebra::{DMatrix, DVector, Point2, Vector2};

use crate::imaging::lattice::Places;
use crate::statistics::median;

/// Bend of the two edges at each place of the grid, 1/px, in the sign of the corner model: the edge runs where
/// `n.d = -bend/2 (t.d)^2`. Zero on lines with fewer than four corners.
pub fn bends(grid: &Places) -> Vec<[f64; 2]> {
    let mut bends = vec![[0.0; 2]; grid.columns * grid.rows];
    for row in 0..grid.rows {
        let line: Vec<_> =
            (0..grid.columns).filter_map(|c| Some((row * grid.columns + c, *grid.get(c, row)?))).collect();
        line_bend(&line, |at, bend| bends[at][0] = bend);
    }
    for col in 0..grid.columns {
        let line: Vec<_> = (0..grid.rows).filter_map(|r| Some((r * grid.columns + col, *grid.get(col, r)?))).collect();
        line_bend(&line, |at, bend| bends[at][1] = bend);
    }
    bends
}

fn line_bend(line: &[(usize, Point2<f64>)], mut set: impl FnMut(usize, f64)) {
    let ([(_, first), .., (_, last)], 4..) = (line, line.len()) else { return };
    let chord = last - first;
    let length = chord.norm();
    let along = chord / length;
    let across = Vector2::new(-along.y, along.x);
    // A decomposition of numbers that are none would not end.
    if !along.iter().all(|v| v.is_finite()) {
        return;
    }
    // Places along the chord from -1 to 1 keep the powers well apart.
    let place = |p: &Point2<f64>| 2.0 * along.dot(&(p - first)) / length - 1.0;
    let degree = match line.len() {
        4..=5 => 2,
        6..=8 => 3,
        _ => 4,
    };
    let points: Vec<(f64, f64)> = line.iter().map(|(_, p)| (place(p), across.dot(&(p - first)))).collect();
    let Some(c) = polynomial(points, degree) else { return };
    for (at, p) in line {
        let v = place(p);
        let second: f64 = (2..=degree).map(|k| c[k] * (k * (k - 1)) as f64 * v.powi(k as i32 - 2)).sum();
        let bend = -second * 4.0 / (length * length);
        if bend.is_finite() {
            set(*at, bend);
        }
    }
}

/// Coefficients of the polynomial through points `(place, offset)`, without those that lie far off: a corner that is hidden in part must
/// not bend the line of the others.
fn polynomial(mut points: Vec<(f64, f64)>, degree: usize) -> Option<DVector<f64>> {
    /// A point is off by this many times the usual misfit and px at the least.
    const FAR: f64 = 8.0;
    const FAR_PX: f64 = 0.1;
    loop {
        let powers = DMatrix::from_fn(points.len(), degree + 1, |i, k| points[i].0.powi(k as i32));
        let offsets = DVector::from_fn(points.len(), |i, _| points[i].1);
        let c = powers.clone().svd(true, true).solve(&offsets, 1e-12).ok()?;
        let misfit: Vec<f64> = (powers * &c - offsets).iter().map(|v| v.abs()).collect();
        let usual = median(misfit.iter().copied())?;
        let (worst, most) = misfit.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        // With fewer points than that none can be told from the others.
        if most < FAR * usual + FAR_PX || points.len() < degree + 4 {
            return Some(c);
        }
        points.remove(worst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::lattice::Lattice;

    #[test]
    fn circles_have_their_curvature() {
        // Rows are arcs of radius 5000 px about a point far below the grid: curving away from the normal (0, 1).
        let radius = 5000.0;
        let grid = Lattice::from_fn(9, 5, |col, row| {
            let angle = (col as f64 - 4.0) * 40.0 / radius;
            let r = radius - row as f64 * 40.0;
            Some(Point2::new(r * angle.sin(), -r * angle.cos()))
        });
        for (at, [along_rows, along_columns]) in bends(&grid).into_iter().enumerate() {
            let r = radius - (at / 9) as f64 * 40.0;
            // y grows away from the middle of the arc, so n.d is positive there and the bend negative.
            assert!((along_rows * r + 1.0).abs() < 2e-3, "{along_rows}");
            assert!(along_columns.abs() < 1e-9);
        }
    }

    #[test]
    fn short_or_broken_lines_are_straight() {
        let grid = Lattice::from_fn(3, 3, |col, row| Some(Point2::new(col as f64, (row * row) as f64)));
        assert!(bends(&grid).iter().all(|b| *b == [0.0; 2]));
        let same = Lattice::from_fn(5, 5, |_, _| Some(Point2::new(1.0, 1.0)));
        assert!(bends(&same).iter().all(|b| b.iter().all(|v| v.is_finite())));
    }
}
