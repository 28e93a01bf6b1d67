//! What the light over a whole board says of its gradient at one corner.
//!
//! In: the fits of a board's corners, each with a gradient of the light of its own. Out: the same fits with the
//! gradient that their board tells. A gradient makes one end of an edge brighter than the other, which a wide blur
//! cannot tell from a shift: by gradient times blur squared. Fitting both costs a fifth to two fifths of the precision
//! at a blur of 2.5 px in squares of 24 px. Light varies smoothly over a board, so its other corners know the gradient.
//!
//! Method: a polynomial of the place (degree 1 or 2, by the number of corners) through all gradients, robust; what they
//! scatter about it beyond their own uncertainty is how far the light is not smooth, and both together are a prior for
//! each corner. Fits are linear near their end, so that a prior is a step and needs no second fit: the conditional mean
//! of a normal distribution. Goes wrong: shadows, glare; a gradient far from the board's stays what it was, and rough
//! light makes the prior weak.

use nalgebra::{DMatrix, DVector, Matrix2, Matrix2xX, Point2, Vector2};

use crate::imaging::lattice::Lattice;
use crate::imaging::refine::Measured;
use crate::statistics::median;

/// Fewest corners for a plane and for a second degree.
const LEAST: [(usize, usize); 2] = [(30, 6), (12, 3)];
/// Rounds of reweighting; three or four settle.
const ROUNDS: usize = 6;
/// A gradient this many sigmas from the board's is another light.
const ANOTHER_LIGHT: f64 = 4.0;

/// Draws each fit's gradient of the light to that of the board; nothing happens to boards of less than twelve corners.
pub fn tie(board: &mut Lattice<Measured>) {
    let corners: Vec<&mut Measured> = board.cells.iter_mut().flatten().collect();
    let Some(&(_, terms)) = LEAST.iter().find(|(least, _)| corners.len() >= *least) else { return };
    let places: Vec<Point2<f64>> = corners.iter().map(|m| m.px).collect();
    let slopes: Vec<Vector2<f64>> = corners.iter().map(|m| m.fit.model.light_slope).collect();
    let own: Vec<f64> = corners.iter().map(|m| m.fit.light_covariance.trace() / 2.0).collect();
    let Some(smooth) = Smooth::through(&design(&places, terms), &slopes, &own) else { return };
    for (i, corner) in corners.into_iter().enumerate() {
        let (light, variance) = (smooth.slopes[i], smooth.variances[i]);
        if (light - slopes[i]).norm_squared() < 2.0 * ANOTHER_LIGHT.powi(2) * (own[i] + variance) {
            draw(corner, light, variance);
        }
    }
}

/// A smooth light: what the other corners tell of the gradient at each, and how well, as the variance along an axis.
struct Smooth {
    slopes: Vec<Vector2<f64>>,
    variances: Vec<f64>,
}

impl Smooth {
    /// Of gradients with variances `own`; `None` where the places don't determine it.
    fn through(design: &DMatrix<f64>, slopes: &[Vector2<f64>], own: &[f64]) -> Option<Smooth> {
        // Half of a two-dimensional normal deviation's square is below ln 2 in half of all cases.
        let spread =
            |squares: &[f64]| median(squares.iter().copied()).map(|square| square / (2.0 * std::f64::consts::LN_2));
        let given = Matrix2xX::from_columns(slopes).transpose();
        let mut rough = 0.0;
        let mut trust = vec![1.0; slopes.len()];
        let mut smooth = None;
        for _ in 0..ROUNDS {
            let weights = DVector::from_fn(own.len(), |i, _| trust[i] / (own[i] + rough));
            let weighted = DMatrix::from_fn(design.nrows(), design.ncols(), |i, k| design[(i, k)] * weights[i]);
            let normal = (weighted.transpose() * design).cholesky()?;
            let missing = design * normal.solve(&(weighted.transpose() * &given)) - &given;
            let by_row = normal.solve(&design.transpose());
            let variances: Vec<f64> =
                (0..own.len()).map(|i| design.row(i).transpose().dot(&by_row.column(i))).collect();
            // What a fit through the others alone would give: a corner is no witness of its own light.
            let without = |i: usize| 1.0 / (1.0 - weights[i] * variances[i]).max(1e-3);
            let step = |i: usize| missing.row(i).transpose() * without(i);
            let others = |i: usize| slopes[i] + Vector2::new(step(i)[0], step(i)[1]);
            let squares: Vec<f64> = missing.row_iter().map(|row| row.norm_squared()).collect();
            smooth = Some(Smooth {
                slopes: (0..own.len()).map(others).collect(),
                variances: (0..own.len()).map(|i| rough + variances[i] * without(i)).collect(),
            });
            for (i, square) in squares.iter().enumerate() {
                trust[i] = (2.0 * (2.0 * (own[i] + rough) / square).sqrt()).min(1.0);
            }
            rough = (spread(&squares)? - median(own.iter().copied())?).max(0.0);
        }
        smooth.filter(|s| s.variances.iter().all(|v| v.is_finite() && *v >= 0.0))
    }
}

/// Polynomials of the place, scaled to about one.
fn design(places: &[Point2<f64>], terms: usize) -> DMatrix<f64> {
    let mean = places.iter().map(|p| p.coords).sum::<Vector2<f64>>() / places.len() as f64;
    let extent = places.iter().map(|p| (p.coords - mean).norm()).fold(f64::MIN_POSITIVE, f64::max);
    DMatrix::from_fn(places.len(), terms, |i, k| {
        let d = (places[i].coords - mean) / extent;
        [1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y][k]
    })
}

/// The fit, given a gradient of the light of that variance along an axis.
fn draw(corner: &mut Measured, light: Vector2<f64>, variance: f64) {
    let fit = &mut corner.fit;
    let Some(inverse) = (fit.light_covariance + Matrix2::identity() * variance).try_inverse() else { return };
    let (place, slope) = (fit.place_by_light * inverse, fit.light_covariance * inverse);
    let missing = light - fit.model.light_slope;
    corner.px += place * missing;
    fit.model.corner += place * missing;
    fit.model.light_slope += slope * missing;
    fit.covariance_px2 -= place * fit.place_by_light.transpose();
    fit.place_by_light -= place * fit.light_covariance;
    fit.light_covariance -= slope * fit.light_covariance;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::imaging::refine::saddle_fit::{Fit, Model};

    /// A board of fits whose places are off by what their gradients are off by, times a blur of 2 px squared;
    /// deviations of the gradients repeat with period `prime`.
    fn board(columns: usize, rows: usize, light: impl Fn(Point2<f64>) -> Vector2<f64>) -> Lattice<Measured> {
        Lattice::from_fn(columns, rows, |col, row| {
            let at = Point2::new(col as f64 * 30.0, row as f64 * 30.0);
            let k = row * columns + col;
            let wrong = Vector2::new((k * 37 % 101) as f64 - 50.0, (k * 61 % 101) as f64 - 50.0) * 3.4e-6;
            let fit = Fit {
                model: Model { corner: wrong * -4.0, light_slope: light(at) + wrong, ..Model::example() },
                covariance_px2: Matrix2::identity() * 2.0 * 16e-8,
                place_by_light: Matrix2::identity() * -4e-8,
                light_covariance: Matrix2::identity() * 1e-8,
                ..Fit::example()
            };
            Some(Measured { px: at + wrong * -4.0, fit, reach: [0.7; 2] })
        })
    }

    /// Root mean square of the places' deviations along an axis, px.
    fn deviation(board: &Lattice<Measured>) -> f64 {
        let square = |(col, row, m): (usize, usize, &Measured)| {
            (m.px - Point2::new(col as f64 * 30.0, row as f64 * 30.0)).norm_squared()
        };
        (board.iter().map(square).sum::<f64>() / (2 * board.count()) as f64).sqrt()
    }

    #[test]
    fn smooth_light_takes_its_part_out_of_the_places() {
        let mut even = board(9, 6, |p| Vector2::new(1e-4 + 1e-7 * p.y, -2e-4 + 2e-7 * p.x));
        let before = deviation(&even);
        tie(&mut even);
        // Six of 108 numbers are spent on the light.
        assert!(deviation(&even) < 0.4 * before, "{} {before}", deviation(&even));
        let left = even.iter().next().unwrap().2.fit.covariance_px2[(0, 0)];
        assert!((1.0..1.6).contains(&(left / 16e-8)), "{left}");
    }

    #[test]
    fn rough_light_leaves_the_places_alone() {
        let rough = |p: Point2<f64>| Vector2::new((p.x * 0.7).sin(), (p.y * 1.3).cos()) * 3e-3;
        let mut board = board(9, 6, rough);
        let before = deviation(&board);
        tie(&mut board);
        assert!((deviation(&board) / before - 1.0).abs() < 0.05);
        assert!(board.iter().all(|(_, _, m)| m.fit.covariance_px2[(0, 0)] > 1.9 * 16e-8));
    }

    #[test]
    fn a_highlight_stays_with_its_corner() {
        let glare =
            |p: Point2<f64>| if p.x == 60.0 && p.y == 90.0 { Vector2::new(5e-3, 0.0) } else { Vector2::zeros() };
        let (mut with, mut without) = (board(9, 6, glare), board(9, 6, |_| Vector2::zeros()));
        let untouched = *with.get(2, 3).unwrap();
        tie(&mut with);
        tie(&mut without);
        assert_eq!(with.get(2, 3), Some(&untouched));
        assert!((deviation(&with) / deviation(&without) - 1.0).abs() < 0.3);
    }

    #[test]
    fn few_corners_or_one_place_change_nothing() {
        let mut few = board(3, 3, |_| Vector2::zeros());
        let before = few.clone();
        tie(&mut few);
        assert_eq!(few, before);
        let mut same = board(9, 6, |_| Vector2::zeros()).map(|m| Measured { px: Point2::origin(), ..*m });
        let before = same.clone();
        tie(&mut same);
        assert_eq!(same, before);
    }
}
