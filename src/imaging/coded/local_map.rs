//! The map from a board's plane to a picture near one place, from the corners round it: lenses bend a board's lines,
//! but hardly within two squares.

use nalgebra::{Matrix3, Point2, SMatrix, SVector};

use super::marker::mapped;
use crate::imaging::board::Pitch;
use crate::imaging::lattice::Places;

/// Corners up to so many columns and rows away count.
const REACH: isize = 2;

/// The homography from the board's plane, in sides of a square from a place of the grid, to the picture: by the corners
/// near it, but for that place itself where `without_it`. `None` where fewer than four are there, or all on a line.
fn near(grid: &Places, pitch: Pitch, (col, row): (isize, isize), without_it: bool) -> Option<Matrix3<f64>> {
    let mut points = Vec::new();
    for r in -REACH..=REACH {
        for c in -REACH..=REACH {
            if without_it && (c, r) == (0, 0) {
                continue;
            }
            let (x, y) = (pitch.at(col + c) - pitch.at(col), pitch.at(row + r) - pitch.at(row));
            points.extend(grid.around(col + c, row + r).map(|p| (x, y, *p)));
        }
    }
    least_squares(&points)
}

/// Where a corner should be by those near it, which need not hold it.
pub fn predicted(grid: &Places, pitch: Pitch, (col, row): (isize, isize)) -> Option<Point2<f64>> {
    let place = mapped(&near(grid, pitch, (col, row), true)?, 0.0, 0.0);
    place.iter().all(|v| v.is_finite()).then_some(place)
}

/// The four corners of the square between corner `(col, row)` and the one after it both ways, in order round it; those
/// that the grid lacks as its neighbours tell.
pub fn square(grid: &Places, pitch: Pitch, (col, row): (isize, isize)) -> Option<[Point2<f64>; 4]> {
    let places = [(0, 0), (1, 0), (1, 1), (0, 1)];
    let known = places.map(|(c, r)| grid.around(col + c, row + r).copied());
    if let [Some(a), Some(b), Some(c), Some(d)] = known {
        return Some([a, b, c, d]);
    }
    let map = near(grid, pitch, (col, row), false)?;
    let (width, height) = (pitch.after(col), pitch.after(row));
    let filled = |k: usize| mapped(&map, places[k].0 as f64 * width, places[k].1 as f64 * height);
    let filled = [0, 1, 2, 3].map(|k| known[k].unwrap_or_else(|| filled(k)));
    filled.iter().flat_map(|p| p.iter()).all(|v| v.is_finite()).then_some(filled)
}

/// Homography through points `(column, row, place)` by least squares of its linear equations, its last element one at
/// the place that they are relative to.
pub fn least_squares(points: &[(f64, f64, Point2<f64>)]) -> Option<Matrix3<f64>> {
    if points.len() < 4 {
        return None;
    }
    let middle = points.iter().map(|(_, _, p)| p.coords).sum::<nalgebra::Vector2<f64>>() / points.len() as f64;
    let scale = points.iter().map(|(_, _, p)| (p.coords - middle).norm()).fold(0.0, f64::max);
    let (mut matrix, mut right) = (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros());
    for (x, y, p) in points {
        let q = (p.coords - middle) / scale;
        for (row, value) in [
            ([*x, *y, 1.0, 0.0, 0.0, 0.0, -q.x * x, -q.x * y], q.x),
            ([0.0, 0.0, 0.0, *x, *y, 1.0, -q.y * x, -q.y * y], q.y),
        ] {
            let row = SVector::from(row);
            matrix += row * row.transpose();
            right += row * value;
        }
    }
    let eigen = matrix.symmetric_eigen();
    let (least, most) = (eigen.eigenvalues.min(), eigen.eigenvalues.max());
    if least.is_nan() || least <= 1e-9 * most {
        return None;
    }
    let h = matrix.cholesky()?.solve(&right);
    let local = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0);
    let back = Matrix3::new(scale, 0.0, middle.x, 0.0, scale, middle.y, 0.0, 0.0, 1.0);
    Some(back * local)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::lattice::Lattice;

    #[test]
    fn what_is_missing_is_where_perspective_has_it() {
        let map = Matrix3::new(40.0, 5.0, 100.0, -3.0, 35.0, 80.0, 0.01, -0.02, 1.0);
        let full = Lattice::from_fn(5, 5, |c, r| Some(mapped(&map, c as f64, r as f64)));
        let part = Lattice::from_fn(4, 4, |c, r| full.get(c, r).filter(|_| (c, r) != (1, 2)).copied());
        for at in [(1, 2), (4, 1), (2, 4), (4, 4)] {
            let found = predicted(&part, Pitch::Even, at).unwrap();
            assert!((found - full.get(at.0 as usize, at.1 as usize).unwrap()).norm() < 1e-6, "{at:?} {found}");
        }
        let square = square(&part, Pitch::Even, (3, 3)).unwrap();
        assert!((square[2] - full.get(4, 4).unwrap()).norm() < 1e-6);
        let line = Lattice::from_fn(6, 1, |c, _| full.get(c, 0).copied());
        assert_eq!(predicted(&line, Pitch::Even, (2, 0)), None);
    }
}
