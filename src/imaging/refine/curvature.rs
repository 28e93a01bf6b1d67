//! How the lens bends a board's lines: curvature at each corner, from the corners of its line.
//!
//! In: a grid of places and how good they are at least. Out: for each corner the bend of its two edges. Method: the
//! offsets of a line's corners from its chord, as a polynomial of the place along it (degree 2 to 4, by how many corners there are).
//! Without it, a straight edge fitted to a long bent one is off by a twenty-fourth of bend times length squared.

use nalgebra::{DMatrix, DVector, Point2, Vector2};

use crate::imaging::lattice::Lattice;
use crate::statistics::median;

/// Bend of the two edges at each place of the grid, 1/px, in the sign of the corner model: the edge runs where
/// `n.d = -bend/2 (t.d)^2`. Zero on lines with fewer than four corners. A place that is off its line by many times what is usual there
/// and by `good_px` does not count.
pub fn bends(grid: &Lattice<Point>, good_px: f64) -> Vec<[f64; 2]> {
    let mut bends = vec![[0.0; 2]; grid.columns * grid.rows];
    for row in 0..grid.rows {
        let line: Vec<_> =
            (0..grid.columns).filter_map(|c| Some((row * grid.columns + c, *grid.get(c, row)?))).collect();
        line_bend(&line, good_px, |at, bend| bends[at][0] = bend);
    }
    for col in 0..grid.columns {
        let line: Vec<_> = (0..grid.rows).filter_map(|r| Some((r * grid.columns + col, *grid.get(col, r)?))).collect();
        line_bend(&line, good_px, |at, bend| bends[at][1] = bend);
    }
    bends
}

/// A corner of a line.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Where it is, px.
    pub px: Point2<f64>,
    /// Whether the line's bend is to be found from it; where fewer than four are, from all.
    pub counts: bool,
}

fn line_bend(line: &[(usize, Point)], good_px: f64, mut set: impl FnMut(usize, f64)) {
    let ([(_, first), .., (_, last)], 4..) = (line, line.len()) else { return };
    let (first, last) = (first.px, last.px);
    let chord = last - first;
    let length = chord.norm();
    let along = chord / length;
    let across = Vector2::new(-along.y, along.x);
    // A decomposition of numbers that are none would not end.
    if !along.iter().all(|v| v.is_finite()) {
        return;
    }
    let few = line.iter().filter(|(_, p)| p.counts).count() < 4;
    let counting: Vec<Point2<f64>> = line.iter().filter(|(_, p)| p.counts || few).map(|(_, p)| p.px).collect();
    // Places along the chord from -1 to 1 keep the powers well apart.
    let place = |p: &Point2<f64>| 2.0 * along.dot(&(p - first)) / length - 1.0;
    let degree = match counting.len() {
        4..=5 => 2,
        6..=8 => 3,
        _ => 4,
    };
    let points: Vec<(f64, f64)> = counting.iter().map(|p| (place(p), across.dot(&(p - first)))).collect();
    let Some(c) = polynomial(points, degree, good_px) else { return };
    for (at, p) in line {
        let v = place(&p.px);
        let second: f64 = (2..=degree).map(|k| c[k] * (k * (k - 1)) as f64 * v.powi(k as i32 - 2)).sum();
        let bend = -second * 4.0 / (length * length);
        if bend.is_finite() {
            set(*at, bend);
        }
    }
}

/// Coefficients of the polynomial through points `(place, offset)`, without those that lie far off: a corner that is hidden in part must
/// not bend the line of the others.
fn polynomial(mut points: Vec<(f64, f64)>, degree: usize, good_px: f64) -> Option<DVector<f64>> {
    /// A point is off by this many times the usual misfit at the least.
    const FAR: f64 = 8.0;
    loop {
        let powers = DMatrix::from_fn(points.len(), degree + 1, |i, k| points[i].0.powi(k as i32));
        let offsets = DVector::from_fn(points.len(), |i, _| points[i].1);
        let c = powers.clone().svd(true, true).solve(&offsets, 1e-12).ok()?;
        let misfit: Vec<f64> = (powers * &c - offsets).iter().map(|v| v.abs()).collect();
        let usual = median(misfit.iter().copied())?;
        let (worst, most) = misfit.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        // With fewer points than that none can be told from the others.
        if most < FAR * usual + good_px || points.len() < degree + 4 {
            return Some(c);
        }
        points.remove(worst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_have_their_curvature() {
        // Rows are arcs of radius 5000 px about a point far below the grid: curving away from the normal (0, 1).
        let radius = 5000.0;
        let grid = Lattice::from_fn(9, 5, |col, row| {
            let angle = (col as f64 - 4.0) * 40.0 / radius;
            let r = radius - row as f64 * 40.0;
            Some(Point { px: Point2::new(r * angle.sin(), -r * angle.cos()), counts: true })
        });
        for (at, [along_rows, along_columns]) in bends(&grid, 0.1).into_iter().enumerate() {
            let r = radius - (at / 9) as f64 * 40.0;
            // y grows away from the middle of the arc, so n.d is positive there and the bend negative.
            assert!((along_rows * r + 1.0).abs() < 2e-3, "{along_rows}");
            assert!(along_columns.abs() < 1e-9);
        }
    }

    #[test]
    fn short_or_broken_lines_are_straight() {
        let point = |x: f64, y: f64| Point { px: Point2::new(x, y), counts: true };
        let grid = Lattice::from_fn(3, 3, |col, row| Some(point(col as f64, (row * row) as f64)));
        assert!(bends(&grid, 0.1).iter().all(|b| *b == [0.0; 2]));
        let same = Lattice::from_fn(5, 5, |_, _| Some(point(1.0, 1.0)));
        assert!(bends(&same, 0.1).iter().all(|b| b.iter().all(|v| v.is_finite())));
    }

    #[test]
    fn a_corner_that_does_not_count_bends_no_line() {
        // The first corner of a straight line, where it has the most weight, is off.
        let line = |counts: bool| {
            Lattice::from_fn(12, 1, |col, _| {
                let y = if col == 0 { 0.5 } else { 0.0 };
                Some(Point { px: Point2::new(40.0 * col as f64, y), counts: counts || col > 0 })
            })
        };
        let most = |bends: Vec<[f64; 2]>| bends.iter().map(|b| b[0].abs()).fold(0.0, f64::max);
        assert!(most(bends(&line(true), 0.1)) > 1e-5);
        assert!(most(bends(&line(false), 0.1)) < 1e-12);
    }
}
