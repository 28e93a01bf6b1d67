//! Products and inverses of dense matrices as least squares need them.
//!
//! Rank is treated in one way: a symmetric matrix is brought to a unit diagonal, so that radians and mm are comparable,
//! and what it says along eigenvectors below `RANK` is nothing. Such directions stay where they are.

use nalgebra::{Cholesky, DMatrix, DVector, Dim, Matrix, RawStorage, SymmetricEigen};

/// Relative size below which an eigenvalue of a normal matrix counts as zero.
const RANK: f64 = 1e-13;

/// `A' B`, by way of the blocked product: `tr_mul` takes dot products one by one, at several times the time for
/// matrices of this size.
pub fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    a.transpose() * b
}

/// A symmetric matrix with rows of different units brought to a unit diagonal, and the factors of its rows and columns
/// that do it. `None` where an element of the diagonal is not above zero.
pub fn to_unit_diagonal(matrix: &DMatrix<f64>) -> Option<(DMatrix<f64>, DVector<f64>)> {
    let scale = matrix.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = || DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    scale.iter().all(|s| s.is_finite()).then(|| (scaled(), scale.clone()))
}

/// Of a symmetric matrix that may lack rank. Rows and columns are brought to a common size first: radians and mm mix.
pub fn pseudo_inverse(matrix: DMatrix<f64>) -> DMatrix<f64> {
    if matrix.is_empty() {
        return matrix;
    }
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| if matrix[(i, i)] > 0.0 { 1.0 / matrix[(i, i)].sqrt() } else { 0.0 });
    let scaled = DMatrix::from_fn(n, n, |r, c| matrix[(r, c)] * scale[r] * scale[c]);
    if scaled.iter().any(|v| !v.is_finite()) {
        return DMatrix::zeros(n, n);
    }
    let inverse = inverse_of_full_rank(&scaled).unwrap_or_else(|| inverse_by_axes(scaled));
    DMatrix::from_fn(n, n, |r, c| inverse[(r, c)] * scale[r] * scale[c])
}

/// The inverse where all eigenvalues are surely above those that count as zero: the sum of those of a matrix is above
/// its largest one, and that of its inverse above one over its smallest.
fn inverse_of_full_rank(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let inverse = Cholesky::new(matrix.clone())?.inverse();
    (inverse.trace() * matrix.trace() * RANK < 1.0).then_some(inverse)
}

fn inverse_by_axes(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let mut inverse = DMatrix::zeros(matrix.nrows(), matrix.nrows());
    let eigen = SymmetricEigen::new(matrix);
    let threshold = RANK * eigen.eigenvalues.amax();
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > threshold {
            inverse += vector * vector.transpose() / *value;
        }
    }
    inverse
}

/// The solution of normal equations that may lack rank; what they do not determine is zero.
pub fn solution(matrix: &DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    let by_cholesky = || {
        let (scaled, scale) = to_unit_diagonal(matrix)?;
        let (cholesky, n) = (Cholesky::new(scaled)?, matrix.nrows() as f64);
        // The trace is n: the largest eigenvalue is at most n, and the product of all but the smallest is below e.
        let is_whole = cholesky.determinant() > std::f64::consts::E * n * RANK;
        is_whole.then(|| cholesky.solve(&right.component_mul(&scale)).component_mul(&scale))
    };
    by_cholesky().unwrap_or_else(|| pseudo_inverse(matrix.clone()) * right)
}

/// How many directions a normal matrix determines.
pub fn rank(normal: &DMatrix<f64>) -> usize {
    (pseudo_inverse(normal.clone()) * normal).trace().round() as usize
}

/// Unknowns eliminated from a normal matrix: they are at their best for any values of those that are kept.
#[derive(Debug, Clone)]
pub struct Eliminated {
    /// Normal matrix of what is kept.
    pub normal: DMatrix<f64>,
    /// `unknowns = -follow * kept`.
    pub follow: DMatrix<f64>,
    /// Inverse normal matrix of the unknowns, what is kept held.
    pub inverse: DMatrix<f64>,
}

impl Eliminated {
    /// All rows and columns beyond the first `kept`.
    pub fn new(normal: &DMatrix<f64>, kept: usize) -> Eliminated {
        let own = normal.nrows() - kept;
        let inverse = pseudo_inverse(normal.view((kept, kept), (own, own)).into_owned());
        let cross = normal.view((kept, 0), (own, kept)).into_owned();
        let follow = &inverse * &cross;
        let normal = normal.view((0, 0), (kept, kept)) - product(&cross, &follow);
        Eliminated { normal, follow, inverse }
    }
}

/// Columns less their projection on others.
pub fn without(columns: &DMatrix<f64>, others: &DMatrix<f64>) -> DMatrix<f64> {
    // The inner product is of few columns and may be taken one by one.
    columns - others * (pseudo_inverse(others.tr_mul(others)) * product(others, columns))
}

/// A matrix row by row, as files have it.
pub fn rows<R: Dim, C: Dim, S: RawStorage<f64, R, C>>(matrix: &Matrix<f64, R, C, S>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns(count: usize, from: usize) -> DMatrix<f64> {
        DMatrix::from_fn(9, count, |r, c| ((3 * r + 7 * (from + c)) as f64).sin())
    }

    #[test]
    fn what_is_eliminated_is_at_its_best() {
        let (kept, own) = (columns(2, 0), columns(3, 2));
        let all = DMatrix::from_fn(9, 5, |r, c| if c < 2 { kept[(r, c)] } else { own[(r, c - 2)] });
        let eliminated = Eliminated::new(&product(&all, &all), 2);
        let left = without(&kept, &own);
        assert!((&eliminated.normal - product(&left, &left)).amax() < 1e-12);
        assert!((left - (&kept - &own * &eliminated.follow)).amax() < 1e-12);
    }

    #[test]
    fn a_column_that_is_there_twice_counts_once() {
        let twice = DMatrix::from_fn(9, 2, |r, _| (r as f64).cos() * 1e6);
        let left = without(&columns(2, 0), &twice);
        assert!((left - without(&columns(2, 0), &twice.columns(0, 1).into_owned())).amax() < 1e-9);
    }

    #[test]
    fn a_solution_is_that_of_the_pseudo_inverse_with_and_without_rank() {
        let right = DVector::from_fn(4, |r, _| (r as f64).sin());
        let mut columns = columns(4, 0);
        columns.column_mut(2).scale_mut(1e6);
        for lacks in [false, true] {
            if lacks {
                let first = columns.column(0).into_owned();
                columns.set_column(3, &(first * -2.5));
            }
            let normal = product(&columns, &columns);
            let expected = pseudo_inverse(normal.clone()) * &right;
            assert!((solution(&normal, &right) - &expected).norm() < 1e-9 * expected.norm(), "{lacks}");
        }
    }
}
