//! One picture of a flat board: its homography, what it says about the focal length, and the board's pose from it.
//!
//! Method: normalised direct linear transform (Hartley & Zisserman 2003, 4.4), Zhang's constraints (2000) with the
//! principal point in the middle, the pose by the nearest rotation. Lens distortion is ignored: these are starting
//! values.

use nalgebra::{DMatrix, Matrix3, Point2, Point3, Vector3};

use crate::geometry::{Transform, transform_from_matrix};
use crate::imaging::Side;
use crate::statistics::median;
use crate::stereo::data::View;

/// Fewest corners that determine a homography with something to spare.
pub const FEWEST_CORNERS: usize = 6;

/// Corners that miss the homography by this many medians are left out of the next one.
const FAR_MEDIANS: f64 = 6.0;

/// The homography from the board's plane (mm) to given picture coordinates, and the median of what it leaves: a wrong
/// corner among many good ones is left out. `None` for too few corners or corners on a line.
pub fn homography(points: impl IntoIterator<Item = (Point3<f64>, Point2<f64>)>) -> Option<(Matrix3<f64>, f64)> {
    let points: Vec<_> = points.into_iter().collect();
    let mut found = direct(&points)?;
    // A wrong corner pulls the first fit toward itself; the second is nearly free of it, the third free.
    let miss = |h: &Matrix3<f64>, pair: &(Point3<f64>, Point2<f64>)| (apply(h, &pair.0) - pair.1).norm();
    for _ in 0..2 {
        let limit = FAR_MEDIANS * median(points.iter().map(|pair| miss(&found, pair)))?;
        let kept: Vec<_> = points.iter().filter(|pair| miss(&found, pair) <= limit).copied().collect();
        found = direct(&kept)?;
    }
    let left = median(points.iter().map(|pair| miss(&found, pair)))?;
    left.is_finite().then_some((found, left))
}

/// The direct linear transform of all points.
fn direct(points: &[(Point3<f64>, Point2<f64>)]) -> Option<Matrix3<f64>> {
    if points.len() < FEWEST_CORNERS {
        return None;
    }
    let (to_board, _) = normaliser(points.iter().map(|(b, _)| Point2::new(b.x, b.y)))?;
    let (to_picture, from_picture) = normaliser(points.iter().map(|(_, p)| *p))?;
    let mut design = DMatrix::zeros(2 * points.len(), 9);
    for (i, (board, picture)) in points.iter().enumerate() {
        let b = to_board * Vector3::new(board.x, board.y, 1.0);
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
    // Two vanishing eigenvalues: the corners lie on a line.
    if eigen.eigenvalues[order[1]] <= 1e-9 * eigen.eigenvalues[order[8]] {
        return None;
    }
    let h = eigen.eigenvectors.column(order[0]);
    let h = Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], h[8]);
    Some(from_picture * h * to_board)
}

fn apply(h: &Matrix3<f64>, board: &Point3<f64>) -> Point2<f64> {
    let p = h * Vector3::new(board.x, board.y, 1.0);
    Point2::new(p.x / p.z, p.y / p.z)
}

/// Moves points to mean zero and mean square two; and back. `None` where they coincide.
fn normaliser(points: impl Iterator<Item = Point2<f64>> + Clone) -> Option<(Matrix3<f64>, Matrix3<f64>)> {
    let count = points.clone().count() as f64;
    let mean = points.clone().map(|p| p.coords).sum::<nalgebra::Vector2<f64>>() / count;
    let spread = (points.map(|p| (p.coords - mean).norm_squared()).sum::<f64>() / count / 2.0).sqrt();
    let usable = spread > 0.0 && spread.is_finite();
    let to = Matrix3::new(1.0 / spread, 0.0, -mean.x / spread, 0.0, 1.0 / spread, -mean.y / spread, 0.0, 0.0, 1.0);
    let from = Matrix3::new(spread, 0.0, mean.x, 0.0, spread, mean.y, 0.0, 0.0, 1.0);
    usable.then_some((to, from))
}

/// Focal lengths along x and y, px, from homographies to pictures with this principal point: Zhang's two constraints a
/// picture, least squares. `None` where the views do not tell (all fronto-parallel, or too far off for a pinhole).
pub fn focal_lengths(homographies: &[Matrix3<f64>], center: &Point2<f64>) -> Option<(f64, f64)> {
    let mut normal = nalgebra::Matrix2::zeros();
    let mut right = nalgebra::Vector2::zeros();
    let shift = Matrix3::new(1.0, 0.0, -center.x, 0.0, 1.0, -center.y, 0.0, 0.0, 1.0);
    for picture_from_board in homographies {
        let h = shift * picture_from_board;
        let (a, b) = (h.column(0), h.column(1));
        // Orthogonal and equally long columns; with a focal length of its own each way: (1/fx^2, 1/fy^2) is unknown.
        let rows = [
            ([a[0] * b[0], a[1] * b[1]], -a[2] * b[2]),
            ([a[0] * a[0] - b[0] * b[0], a[1] * a[1] - b[1] * b[1]], b[2] * b[2] - a[2] * a[2]),
        ];
        let weight = 1.0 / (a.norm_squared() * b.norm_squared()).max(f64::MIN_POSITIVE);
        for (row, value) in rows {
            let row = nalgebra::Vector2::from(row);
            normal += row * row.transpose() * weight;
            right += row * value * weight;
        }
    }
    let inverse_squares = normal.try_inverse()? * right;
    let (fx, fy) = (1.0 / inverse_squares.x.sqrt(), 1.0 / inverse_squares.y.sqrt());
    (fx.is_finite() && fy.is_finite()).then_some((fx, fy))
}

/// `camera_from_board` from the homography to normalised coordinates; the board lies in front of the camera.
pub fn pose(normalised_from_board: &Matrix3<f64>) -> Option<Transform> {
    let h = normalised_from_board;
    let scale = 2.0 / (h.column(0).norm() + h.column(1).norm());
    let scale = if h[(2, 2)] < 0.0 { -scale } else { scale };
    let (r1, r2, t) = (h.column(0) * scale, h.column(1) * scale, h.column(2) * scale);
    let rough = Matrix3::from_columns(&[r1, r2, r1.cross(&r2)]);
    if !rough.iter().chain(t.iter()).all(|v| v.is_finite()) {
        return None;
    }
    let svd = rough.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    (rotation.determinant() > 0.0).then(|| transform_from_matrix(rotation, t))
}

/// The homography from the board's plane to a picture, as [`homography`] has it.
pub fn of_picture(view: &View, side: Side) -> Option<(Matrix3<f64>, f64)> {
    homography(view.active(side).map(|o| (o.board_mm, o.px)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::transform;
    use crate::stereo::Camera;

    fn picture(camera: &Camera, camera_from_board: &Transform) -> Vec<(Point3<f64>, Point2<f64>)> {
        (0..30)
            .map(|i| Point3::new(f64::from(i % 6) * 10.0 - 25.0, f64::from(i / 6) * 10.0 - 20.0, 0.0))
            .map(|b| (b, camera.project(&(camera_from_board * b))))
            .collect()
    }

    #[test]
    fn zhang_finds_the_focal_lengths_and_the_pose() {
        let mut camera = Camera::pinhole(640, 480, 800.0);
        camera.fy = 780.0;
        let poses = [
            transform(Vector3::new(0.4, 0.1, 0.2), Vector3::new(5.0, -8.0, 200.0)),
            transform(Vector3::new(-0.1, 0.5, -0.3), Vector3::new(-15.0, 4.0, 230.0)),
        ];
        let all: Vec<Matrix3<f64>> = poses.iter().map(|pose| homography(picture(&camera, pose)).unwrap().0).collect();
        let (fx, fy) = focal_lengths(&all, &Point2::new(camera.cx, camera.cy)).unwrap();
        assert!((fx - 800.0).abs() < 1e-6 && (fy - 780.0).abs() < 1e-6, "{fx} {fy}");
        for (h, truth) in all.iter().zip(&poses) {
            let found = pose(&(camera.matrix().try_inverse().unwrap() * h)).unwrap();
            assert!((found.to_matrix() - truth.to_matrix()).amax() < 1e-8);
        }
    }

    #[test]
    fn fronto_parallel_views_do_not_tell_the_focal_length() {
        let camera = Camera::pinhole(640, 480, 800.0);
        let all = [0.0, 0.3].map(|turn| {
            let pose = transform(Vector3::new(0.0, 0.0, turn), Vector3::new(3.0, 2.0, 200.0));
            homography(picture(&camera, &pose)).unwrap().0
        });
        let found = focal_lengths(&all, &Point2::new(camera.cx, camera.cy));
        assert!(found.is_none_or(|(fx, _)| (fx - 800.0).abs() > 1.0), "{found:?}");
    }

    #[test]
    fn corners_on_a_line_have_no_homography() {
        let line: Vec<_> =
            (0..10).map(|i| (Point3::new(f64::from(i), 0.0, 0.0), Point2::new(f64::from(i) * 3.0, 5.0))).collect();
        assert!(homography(line).is_none());
    }
}
