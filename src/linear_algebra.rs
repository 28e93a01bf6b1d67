//! Products and inverses of dense matrices as least squares need them.
//!
//! Rank is treated in one way: a symmetric matrix is brought to a unit diagonal, so that radians and mm are comparable, and what it says along
//! eigenvectors below [`RANK`] is nothing. Such directions stay where they are.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Relative size below which an eigenvalue of a normal matrix counts as zero.
const RANK: f64 = 1e-13;

/// `A' B`, by way of the blocked product: `tr_mul` takes dot products one by one, at several times the time for matrices of this size.
pub fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    a.transpose() * b
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
    let eigen = SymmetricEigen::new(scaled);
    let threshold = RANK * eigen.eigenvalues.amax();
    let mut inverse = DMatrix::zeros(n, n);
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > threshold {
            inverse += vector * vector.transpose() / *value;
        }
    }
    DMatrix::from_fn(n, n, |r, c| inverse[(r, c)] * scale[r] * scale[c])
}
