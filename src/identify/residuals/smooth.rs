//! A smooth error that the points of a placement share: what a sensor does to space, and what no model of the robot
//! follows.
//!
//! In: the points of a placement with their whiteners, how large the error is and over which length it changes. Out:
//! residuals and columns that are white under noise and smooth error together, and the error as far as it is known. It
//! is a Gaussian process over the sensor's space, alike and independent along x, y and z, of correlation `exp(-d^2 / 2
//! length^2)` (Rasmussen and Williams, "Gaussian processes for machine learning", 2006, chapter 2), seen through its
//! values at some of the points (Williams and Seeger, "Using the Nystrom method to speed up kernel machines", 2001):
//! the cost is linear in the points. What goes wrong: what changes over less than the distance of those points counts
//! as noise.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, SymmetricEigen, Vector3};

use crate::geometry::rigid_columns;
use crate::identify::sensor::SmoothError;
use crate::linear_algebra::{product, pseudo_inverse, without};

/// Points of a placement that the error is seen through, at the most.
const SEEN_THROUGH: usize = 24;

/// Functions of less than this share of the strongest one's variance are left out.
const LEAST_VARIANCE: f64 = 1e-4;

/// The error of one placement.
#[derive(Debug, Clone)]
pub struct Field {
    /// Whiteners of the points.
    whiteners: Vec<Matrix3<f64>>,
    /// A row a point, a column a function, mm a standard deviation.
    functions: DMatrix<f64>,
    /// The same white: a row a residual, three columns a function.
    white: DMatrix<f64>,
    /// What `white` takes off its projections: see [`Field::whiten`].
    shrink: DMatrix<f64>,
    /// Covariance of the unknowns given the residuals.
    covariance: DMatrix<f64>,
    /// Degrees of freedom that residuals lose to it beyond those of the placement's transform.
    pub lost: f64,
    /// Mean square of a coordinate that is left after a rigid fit to the points, mm^2.
    pub left_mm2: f64,
}

impl Field {
    /// Of points in the sensor's frame with their whiteners, `rows` residuals a point of which the first three are the
    /// point's.
    pub fn new(points: &[(Point3<f64>, Matrix3<f64>)], rows: usize, error: SmoothError) -> Field {
        let places: Vec<Point3<f64>> = points.iter().map(|(p, _)| *p).collect();
        let whiteners: Vec<Matrix3<f64>> = points.iter().map(|(_, w)| *w).collect();
        let functions = functions(&places, error.length_mm) * error.sd_mm;
        let white = white(&functions, &whiteners, rows);
        let eigen = SymmetricEigen::new(product(&white, &white));
        let of_values = |f: &dyn Fn(f64) -> f64| {
            let scaled = DMatrix::from_diagonal(&eigen.eigenvalues.map(|s| f(s.max(0.0))));
            &eigen.eigenvectors * scaled * eigen.eigenvectors.transpose()
        };
        let shrink = of_values(&|s| if s < 1e-9 { 0.5 } else { (1.0 - 1.0 / (1.0 + s).sqrt()) / s });
        let covariance = of_values(&|s| 1.0 / (1.0 + s));
        let left_mm2 = left_mm2(&places, &functions);
        let mut field = Field { whiteners, functions, white, shrink, covariance, lost: 0.0, left_mm2 };
        let mut once = motions(points, rows);
        field.whiten(&mut once);
        let mut twice = once.clone();
        field.whiten(&mut twice);
        let of_frame = (pseudo_inverse(product(&once, &once)) * product(&twice, &twice)).trace();
        field.lost = eigen.eigenvalues.iter().map(|s| s / (1.0 + s)).sum::<f64>() + of_frame - once.ncols() as f64;
        field
    }

    /// From white under noise to white under noise and error together: `(I + F F')^-1/2`, F the white functions.
    pub fn whiten(&self, columns: &mut DMatrix<f64>) {
        let along = &self.shrink * product(&self.white, columns);
        *columns -= &self.white * along;
    }

    /// The error at the points, mm, from residuals before whitening: what is most probable.
    pub fn most_probable(&self, residuals: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
        let rows = self.white.nrows() / residuals.len().max(1);
        let mut white = DVector::zeros(self.white.nrows());
        for (i, (whitener, residual)) in self.whiteners.iter().zip(residuals).enumerate() {
            white.fixed_rows_mut::<3>(rows * i).copy_from(&(whitener * residual));
        }
        let unknowns = &self.covariance * self.white.tr_mul(&white);
        let error = |i: usize| {
            let shares = self.functions.row(i);
            shares.iter().enumerate().map(|(k, f)| unknowns.fixed_rows::<3>(3 * k) * *f).sum::<Vector3<f64>>()
        };
        (0..residuals.len()).map(error).collect()
    }
}

/// Values of independent functions of unit variance at the points, whose products with themselves amount to the
/// correlation: a row a point, a column a function.
pub fn functions(points: &[Point3<f64>], length_mm: f64) -> DMatrix<f64> {
    let chosen = spread_out(points);
    let correlation =
        |a: &Point3<f64>, b: &Point3<f64>| (-(a - b).norm_squared() / (2.0 * length_mm * length_mm)).exp();
    let among =
        DMatrix::from_fn(chosen.len(), chosen.len(), |r, c| correlation(&points[chosen[r]], &points[chosen[c]]));
    let to = DMatrix::from_fn(points.len(), chosen.len(), |r, c| correlation(&points[r], &points[chosen[c]]));
    let eigen = SymmetricEigen::new(among);
    let least = LEAST_VARIANCE * eigen.eigenvalues.max();
    let kept = (0..chosen.len()).filter(|&k| eigen.eigenvalues[k] > least);
    let columns: Vec<DVector<f64>> =
        kept.map(|k| &to * eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt()).collect();
    if columns.is_empty() { DMatrix::zeros(points.len(), 0) } else { DMatrix::from_columns(&columns) }
}

/// White functions: a row a residual, three columns a function.
pub fn white(functions: &DMatrix<f64>, whiteners: &[Matrix3<f64>], rows: usize) -> DMatrix<f64> {
    let mut white = DMatrix::zeros(rows * functions.nrows(), 3 * functions.ncols());
    for (i, whitener) in whiteners.iter().enumerate() {
        for k in 0..functions.ncols() {
            white.fixed_view_mut::<3, 3>(rows * i, 3 * k).copy_from(&(whitener * functions[(i, k)]));
        }
    }
    white
}

/// Mean square of a coordinate of functions from which a rigid motion of the points is taken off, mm^2.
fn left_mm2(points: &[Point3<f64>], functions: &DMatrix<f64>) -> f64 {
    let plain: Vec<(Point3<f64>, Matrix3<f64>)> = points.iter().map(|p| (*p, Matrix3::identity())).collect();
    let motions = motions(&plain, 3);
    let left = without(&white(functions, &vec![Matrix3::identity(); points.len()], 3), &motions);
    left.norm_squared() / left.nrows().max(1) as f64
}

/// White rigid motions of the points.
fn motions(points: &[(Point3<f64>, Matrix3<f64>)], rows: usize) -> DMatrix<f64> {
    let mut motions = DMatrix::zeros(rows * points.len(), 6);
    for (i, (point, whitener)) in points.iter().enumerate() {
        motions.fixed_view_mut::<3, 6>(rows * i, 0).copy_from(&(whitener * rigid_columns(&point.coords)));
    }
    motions
}

/// Indices of points of which each is as far as can be from those before it.
fn spread_out(points: &[Point3<f64>]) -> Vec<usize> {
    let mut chosen = Vec::new();
    let mut apart = vec![f64::INFINITY; points.len()];
    let mut next = 0;
    while chosen.len() < SEEN_THROUGH.min(points.len()) {
        chosen.push(next);
        for (far, point) in apart.iter_mut().zip(points) {
            *far = far.min((point - points[next]).norm_squared());
        }
        // The first of equals.
        next = (0..points.len()).fold(0, |best, i| if apart[i] > apart[best] { i } else { best });
        if apart[next] <= 0.0 {
            break;
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<(Point3<f64>, Matrix3<f64>)> {
        let place =
            |i: usize| Point3::new((3.1 * i as f64).sin(), (1.7 * i as f64).cos(), (0.9 * i as f64).sin()) * 400.0;
        let whitener = |i: usize| Matrix3::identity() * (40.0 + i as f64) + Vector3::new(3.0, -2.0, 1.0).cross_matrix();
        (0..20).map(|i| (place(i), whitener(i))).collect()
    }

    #[test]
    fn whitened_twice_is_the_inverse_of_the_whole_covariance() {
        let (points, error) = (points(), SmoothError { sd_mm: 0.03, length_mm: 300.0 });
        let field = Field::new(&points, 3, error);
        let mut inverse = DMatrix::identity(60, 60);
        field.whiten(&mut inverse);
        field.whiten(&mut inverse);
        let whole = DMatrix::identity(60, 60) + &field.white * field.white.transpose();
        assert!((inverse * whole - DMatrix::<f64>::identity(60, 60)).amax() < 1e-10);
    }

    #[test]
    fn the_functions_are_the_process_where_it_is_seen_through_all_points() {
        let places: Vec<Point3<f64>> = points().iter().map(|(p, _)| *p).collect();
        let functions = functions(&places, 300.0);
        let correlation = &functions * functions.transpose();
        for r in 0..20 {
            for c in 0..20 {
                let d = (places[r] - places[c]).norm();
                assert!((correlation[(r, c)] - (-d * d / 180_000.0).exp()).abs() < 0.01, "{r} {c}");
            }
        }
    }

    #[test]
    fn what_is_smooth_is_found_and_what_is_not_is_left() {
        let points = points();
        let field = Field::new(&points, 3, SmoothError { sd_mm: 0.5, length_mm: 500.0 });
        let smooth = |p: &Point3<f64>| Vector3::new(0.4 * (p.x / 500.0).sin(), 0.0, 0.3 * (p.y / 600.0).cos());
        let found = field.most_probable(&points.iter().map(|(p, _)| smooth(p)).collect::<Vec<_>>());
        for ((p, _), error) in points.iter().zip(&found) {
            assert!((error - smooth(p)).norm() < 0.05, "{error} {}", smooth(p));
        }
        let rough: Vec<Vector3<f64>> =
            (0..20).map(|i| Vector3::repeat(if i % 2 == 0 { 0.02 } else { -0.02 })).collect();
        let field = Field::new(&points, 3, SmoothError { sd_mm: 0.01, length_mm: 500.0 });
        let rest = field.most_probable(&rough);
        let (left, all) = (rest.iter().map(Vector3::norm).sum::<f64>(), rough.iter().map(Vector3::norm).sum::<f64>());
        assert!(left < 0.3 * all && field.lost > 0.0 && field.lost < 20.0, "{left} {all} {}", field.lost);
    }
}
