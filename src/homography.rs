//! The homography of a plane seen in a picture.
//!
//! In: points of a plane and where they are seen. Out: the projective map that takes the ones to the others. Method: normalised direct linear
//! transform (Hartley & Zisserman 2003, 4.4); points that are far off are left out. Goes wrong: points on a line have none.

use nalgebra::{DMatrix, Matrix3, Point2, Vector2, Vector3};

use crate::statistics::median;

/// Fewest points that determine a homography with something to spare.
pub const FEWEST_POINTS: usize = 6;

/// Points that miss the homography by this many medians are left out of the next one.
const FAR_MEDIANS: f64 = 6.0;

/// The homography from a plane to a picture, of pairs of both's points, and the median of what it leaves, in the picture's unit: a wrong pair
/// among many good ones is left out. `None` for too few points or points on a line.
pub fn homography(points: &[(Point2<f64>, Point2<f64>)]) -> Option<(Matrix3<f64>, f64)> {
    let mut kept = points.to_vec();
    let mut found = direct(&kept)?;
    // A wrong pair pulls the first fit toward itself; the second is nearly free of it, the third free.
    for _ in 0..2 {
        let miss = |(plane, picture): &(Point2<f64>, Point2<f64>)| (apply(&found, plane) - picture).norm();
        let limit = FAR_MEDIANS * median(points.iter().map(miss))?;
        kept = points.iter().filter(|pair| miss(pair) <= limit).copied().collect();
        found = direct(&kept)?;
    }
    let left = median(points.iter().map(|(plane, picture)| (apply(&found, plane) - picture).norm()))?;
    left.is_finite().then_some((found, left))
}

/// The direct linear transform of all points.
fn direct(points: &[(Point2<f64>, Point2<f64>)]) -> Option<Matrix3<f64>> {
    if points.len() < FEWEST_POINTS {
        return None;
    }
    let (to_plane, _) = normaliser(points.iter().map(|(b, _)| *b))?;
    let (to_picture, from_picture) = normaliser(points.iter().map(|(_, p)| *p))?;
    let mut design = DMatrix::zeros(2 * points.len(), 9);
    for (i, (plane, picture)) in points.iter().enumerate() {
        let b = to_plane * Vector3::new(plane.x, plane.y, 1.0);
        let p = to_picture * Vector3::new(picture.x, picture.y, 1.0);
        for k in 0..3 {
            design[(2 * i, k)] = b[k];
            design[(2 * i, 6 + k)] = -p.x * b[k];
            design[(2 * i + 1, 3 + k)] = b[k];
            design[(2 * i + 1, 6 + k)] = -p.y * b[k];
        }
    }
    let eigen = (design.transpose() * &design).symmetric_eigen();
    let mut order: Vec<usize> = (0..9).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    // Two vanishing eigenvalues: the points lie on a line.
    if eigen.eigenvalues[order[1]] <= 1e-9 * eigen.eigenvalues[order[8]] {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    let h = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(from_picture * h * to_plane)
}

/// Where a homography takes a point of the plane.
pub fn apply(h: &Matrix3<f64>, plane: &Point2<f64>) -> Point2<f64> {
    let p = h * Vector3::new(plane.x, plane.y, 1.0);
    Point2::new(p.x / p.z, p.y / p.z)
}

/// Moves points to mean zero and mean square two; and back. `None` where they coincide.
fn normaliser(points: impl Iterator<Item = Point2<f64>> + Clone) -> Option<(Matrix3<f64>, Matrix3<f64>)> {
    let count = points.clone().count() as f64;
    let mean = points.clone().map(|p| p.coords).sum::<Vector2<f64>>() / count;
    let spread = (points.map(|p| (p.coords - mean).norm_squared()).sum::<f64>() / count / 2.0).sqrt();
    let usable = spread > 0.0 && spread.is_finite();
    let to = Matrix3::new(1.0 / spread, 0.0, -mean.x / spread, 0.0, 1.0 / spread, -mean.y / spread, 0.0, 0.0, 1.0);
    let from = Matrix3::new(spread, 0.0, mean.x, 0.0, spread, mean.y, 0.0, 0.0, 1.0);
    usable.then_some((to, from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_projective_map_is_found_beside_a_wrong_pair() {
        let truth = Matrix3::new(30.0, 2.0, 300.0, -3.0, 28.0, 200.0, 4e-3, -2e-3, 1.0);
        let pair = |i: u32| {
            let plane = Point2::new(f64::from(i % 6), f64::from(i / 6));
            (plane, apply(&truth, &plane))
        };
        let mut pairs: Vec<_> = (0..30).map(pair).collect();
        pairs[8].1.x += 40.0;
        let (found, left) = homography(&pairs).unwrap();
        assert!(left < 1e-9, "{left}");
        for (plane, picture) in (0..30).map(pair) {
            assert!((apply(&found, &plane) - picture).norm() < 1e-8);
        }
    }

    #[test]
    fn points_on_a_line_have_no_homography() {
        let line: Vec<_> =
            (0..10).map(|i| (Point2::new(f64::from(i), 0.0), Point2::new(f64::from(i) * 3.0, 5.0))).collect();
        assert!(homography(&line).is_none());
    }
}
