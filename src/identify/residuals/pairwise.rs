//! All distances between the poses of a group, whitened for the poses they share.
//!
//! A distance between points a and b, with noise e, is off by `u.(e_a - e_b)`; all of them together by `B e`. Their
//! covariance `B B'` has rank 3n - 6, and the whitened residual is the smallest e that explains them, `B^+ r`:
//! to first order the distances of a group say what its points say, no more and no less. Groups are cut into chunks of
//! at most [`CHUNK`] poses, because the work grows with the third power of a chunk's size.
//! What goes wrong: points in one plane leave the directions across it to a tiny ridge, which has nothing to act on.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix3, Matrix3xX, Vector3};

use super::state::State;
use crate::geometry::direction;
use crate::identify::model::kinematics::Place;
use crate::identify::sensor::{Raw, Scatter, Spot};

/// Poses whose distances are taken together at the most.
pub const CHUNK: usize = 60;

/// Ridge on the normal matrix as a fraction of its mean diagonal: far above rounding, far below any weight.
const RIDGE: f64 = 1e-10;

/// The pairs of one chunk.
#[derive(Debug, Clone)]
pub struct Pairs {
    spots: Vec<Spot>,
    /// Square roots of the covariances: point noise is `colour * e` with e white.
    colour: Vec<Matrix3<f64>>,
    /// Measured directions from b to a, for a < b, row by row.
    directions: Vec<Vector3<f64>>,
    lengths_mm: Vec<f64>,
    normal: Cholesky<f64, Dyn>,
}

impl Pairs {
    /// Of the points of one chunk; `None` where they coincide.
    pub fn new(spots: Vec<Spot>, scatter: &Scatter) -> Option<Pairs> {
        let n = spots.len();
        let inverse = |s: &Spot| (scatter.whitener(&s.covariance_mm2) * s.weight.max(1e-6)).try_inverse();
        let colour: Vec<Matrix3<f64>> = spots.iter().map(|s| inverse(s).unwrap_or_else(Matrix3::identity)).collect();
        let (mut directions, mut lengths_mm) = (Vec::new(), Vec::new());
        let mut normal = DMatrix::<f64>::zeros(3 * n, 3 * n);
        for a in 0..n {
            for b in a + 1..n {
                let (u, length) = direction(&(spots[a].point_mm - spots[b].point_mm));
                let (row_a, row_b) = (colour[a].tr_mul(&u), colour[b].tr_mul(&u));
                for (i, j, sign, left, right) in [
                    (a, a, 1.0, row_a, row_a),
                    (b, b, 1.0, row_b, row_b),
                    (a, b, -1.0, row_a, row_b),
                    (b, a, -1.0, row_b, row_a),
                ] {
                    let mut view = normal.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    view += sign * left * right.transpose();
                }
                directions.push(u);
                lengths_mm.push(length);
            }
        }
        let rigid = rigid_motions(&spots, &colour);
        let weight = normal.trace() / (3 * n).max(1) as f64;
        normal += weight * &rigid * rigid.transpose();
        for i in 0..3 * n {
            normal[(i, i)] += RIDGE * weight;
        }
        let normal = Cholesky::new(normal)?;
        Some(Pairs { spots, colour, directions, lengths_mm, normal })
    }

    fn pairs(&self) -> impl Iterator<Item = (usize, usize, usize)> + '_ {
        let n = self.spots.len();
        (0..n).flat_map(move |a| (a + 1..n).map(move |b| (a, b))).enumerate().map(|(k, (a, b))| (k, a, b))
    }

    /// The smallest point noise (in units of its own standard deviation) that explains the distances; 3 rows a pose.
    pub fn residuals(&self, places: &[Place]) -> DVector<f64> {
        let mut sums = vec![Vector3::zeros(); self.spots.len()];
        for (k, a, b) in self.pairs() {
            let modelled = (places[self.spots[a].pose].point_mm - places[self.spots[b].pose].point_mm).norm();
            let pull = self.directions[k] * (modelled - self.lengths_mm[k]);
            sums[a] += pull;
            sums[b] -= pull;
        }
        let mut rhs = DVector::zeros(3 * self.spots.len());
        for (i, sum) in sums.iter().enumerate() {
            rhs.fixed_rows_mut::<3>(3 * i).copy_from(&self.colour[i].tr_mul(sum));
        }
        self.normal.solve_mut(&mut rhs);
        rhs
    }

    /// Derivatives of [`Pairs::residuals`].
    pub fn derivatives(&self, state: &State) -> DMatrix<f64> {
        let (places, columns, n) = (&state.places, state.of_robot(), self.spots.len());
        let mut sums = vec![Matrix3xX::zeros(columns); n];
        let mut row = nalgebra::RowDVector::zeros(columns);
        for (k, a, b) in self.pairs() {
            let (place_a, place_b) = (&places[self.spots[a].pose], &places[self.spots[b].pose]);
            let (u, _) = direction(&(place_a.point_mm - place_b.point_mm));
            for c in 0..columns {
                row[c] = u.dot(&(place_a.point_columns.column(c) - place_b.point_columns.column(c)));
            }
            for c in 0..columns {
                let pull = self.directions[k] * row[c];
                let mut column = sums[a].column_mut(c);
                column += pull;
                let mut column = sums[b].column_mut(c);
                column -= pull;
            }
        }
        let mut rhs = DMatrix::zeros(3 * n, columns);
        for (i, sum) in sums.iter().enumerate() {
            rhs.rows_mut(3 * i, 3).copy_from(&self.colour[i].tr_mul(sum));
        }
        self.normal.solve_mut(&mut rhs);
        rhs
    }

    /// The same as point noise in mm.
    pub fn raw(&self, places: &[Place]) -> Vec<(usize, f64, Raw)> {
        let white = self.residuals(places);
        let raw = |(i, spot): (usize, &Spot)| {
            let e = self.colour[i] * white.fixed_rows::<3>(3 * i);
            (spot.pose, 1.0, Raw::Point(e, spot.covariance_mm2))
        };
        self.spots.iter().enumerate().map(raw).collect()
    }

    /// Number of residuals: 3 a pose.
    pub fn row_count(&self) -> usize {
        3 * self.spots.len()
    }

    /// Numbers that the distances of these poses can say: 3n - 6.
    pub fn count(&self) -> usize {
        (3 * self.spots.len()).saturating_sub(6)
    }
}

/// Orthonormal basis of the noise that moves all points rigidly, which no distance sees.
fn rigid_motions(spots: &[Spot], colour: &[Matrix3<f64>]) -> DMatrix<f64> {
    let n = spots.len();
    let centroid = spots.iter().fold(Vector3::zeros(), |s, p| s + p.point_mm.coords) / n.max(1) as f64;
    let mut motions = DMatrix::zeros(3 * n, 6);
    for (i, (spot, colour)) in spots.iter().zip(colour).enumerate() {
        let bleach = colour.try_inverse().unwrap_or_else(Matrix3::identity);
        let arm = spot.point_mm.coords - centroid;
        motions.fixed_view_mut::<3, 3>(3 * i, 0).copy_from(&bleach);
        motions.fixed_view_mut::<3, 3>(3 * i, 3).copy_from(&(bleach * arm.cross_matrix()));
    }
    if n < 2 { motions } else { motions.qr().q() }
}
