//! What the homographies of a flat board's pictures say about the focal length, and the board's pose from one.
//!
//! Method: Zhang's constraints (2000) with the principal point in the middle, the pose by the nearest rotation. Lens distortion is ignored: these are starting values.

use nalgebra::{Matrix3, Point2};

use crate::geometry::{Transform, transform_from_matrix};
use crate::stereo::data::observation::Observation;

/// Focal lengths along x and y, px, from homographies to pictures with this principal point: Zhang's two constraints a picture,
/// least squares. `None` where the views do not tell (all fronto-parallel, or too far off for a pinhole).
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

/// Board points (mm in its plane) and pixels of observations.
pub fn pixel_pairs<'a>(observations: impl Iterator<Item = &'a Observation>) -> Vec<(Point2<f64>, Point2<f64>)> {
    observations.map(|o| (o.board_mm.xy(), o.px)).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;
    use crate::geometry::transform;
    use crate::homography::homography;
    use crate::stereo::Camera;

    fn picture(camera: &Camera, camera_from_board: &Transform) -> Vec<(Point2<f64>, Point2<f64>)> {
        (0..30)
            .map(|i| Point3::new(f64::from(i % 6) * 10.0 - 25.0, f64::from(i / 6) * 10.0 - 20.0, 0.0))
            .map(|b| (b.xy(), camera.project(&(camera_from_board * b))))
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
        let all: Vec<Matrix3<f64>> = poses.iter().map(|pose| homography(&picture(&camera, pose)).unwrap().0).collect();
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
        let all: Vec<Matrix3<f64>> = [0.0, 0.3]
            .map(|turn| transform(Vector3::new(0.0, 0.0, turn), Vector3::new(3.0, 2.0, 200.0)))
            .iter()
            .map(|pose| homography(&picture(&camera, pose)).unwrap().0)
            .collect();
        let found = focal_lengths(&all, &Point2::new(camera.cx, camera.cy));
        assert!(found.is_none_or(|(fx, _)| (fx - 800.0).abs() > 1.0), "{found:?}");
    }
}
