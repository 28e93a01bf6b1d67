//! A camera described by another lens model.
//!
//! In: a camera, places in its picture, and a camera of the model that is to describe it. Out: how the former's frame is
//! turned in the latter's, and the step of the latter's numbers by which its rays through these places come nearest to
//! the former's, to first order. Numbers of the same name are not the same thing in two models: the radial terms of a
//! rational lens are exchanged for its denominators, and may be a hundred times those of a polynomial that bends the same
//! rays alike; and a sensor that tilts has another centre, and with it another direction ahead. Goes wrong: places
//! through which the camera has no ray are left out.

use nalgebra::{DMatrix, DVector, Matrix2xX, Matrix3, Point2, Rotation3, UnitQuaternion, Vector3};

use crate::geometry::nearest_rotation;
use crate::linear_algebra::solution;
use crate::stereo::Camera;

/// A camera as another model has it.
#[derive(Debug, Clone, PartialEq)]
pub struct Described {
    /// Of directions: the describing camera's frame from the described one's.
    pub own_from_camera: UnitQuaternion<f64>,
    /// From the describing camera, in the order of [`Camera::numbers`] as far as its lens has them.
    pub step: DVector<f64>,
}

/// `camera` as one `like` another, by where these places lie, px. `None` where `like` has no ray through any of them.
pub fn describe(camera: &Camera, like: &Camera, places_px: impl Iterator<Item = Point2<f64>>) -> Option<Described> {
    let ray = |camera: &Camera, px: &Point2<f64>| Some(camera.undistort(px)?.coords.push(1.0).normalize());
    let rays: Vec<(Point2<f64>, Vector3<f64>, Vector3<f64>)> =
        places_px.filter_map(|px| Some((px, ray(camera, &px)?, ray(like, &px)?))).collect();
    if rays.is_empty() {
        return None;
    }
    let turn = nearest_rotation(&rays.iter().map(|(_, theirs, own)| own * theirs.transpose()).sum::<Matrix3<f64>>());
    let numbers = 4 + like.lens.free_count();
    let (mut normal, mut right) = (DMatrix::zeros(numbers, numbers), DVector::zeros(numbers));
    for (px, theirs, _) in &rays {
        let Some(seen) = like.project_with_derivatives(&(turn * theirs).into()) else { continue };
        let slopes = Matrix2xX::from_columns(&seen.by_camera[..numbers]);
        normal += slopes.tr_mul(&slopes);
        right += slopes.tr_mul(&(px - seen.px));
    }
    let own_from_camera = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turn));
    Some(Described { own_from_camera, step: solution(&normal, &right) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::Lens;
    use crate::stereo::model::projection::tests::bent_camera;

    fn places() -> impl Iterator<Item = Point2<f64>> {
        (0..100).map(|i| Point2::new(240.0 + 90.0 * f64::from(i % 10), 152.0 + 80.0 * f64::from(i / 10)))
    }

    /// By how much the rays of the camera and of its description differ at most, px.
    fn off_px(camera: &Camera, like: &Camera) -> f64 {
        let described = describe(camera, like, places()).unwrap();
        let mut found = *like;
        found.add(described.step.as_slice());
        let off = places().map(|px| {
            let theirs = described.own_from_camera * camera.undistort(&px).unwrap().coords.push(1.0);
            (found.project(&theirs.into()) - px).norm()
        });
        off.fold(0.0, f64::max)
    }

    #[test]
    fn a_camera_of_the_same_model_is_described_as_it_is() {
        let like = bent_camera(Lens::Brown5);
        let mut camera = like;
        camera.add(&[0.2, -0.1, 0.1, 0.3, 1e-4, -3e-4, 1e-5, 2e-5, 1e-4]);
        // What is of second order.
        let off = off_px(&camera, &like);
        assert!(off < 2e-2, "{off}");
        assert!(describe(&like, &like, places()).unwrap().step.amax() < 1e-9);
        assert_eq!(describe(&like, &like, std::iter::empty()), None);
    }

    #[test]
    fn a_rational_lens_with_huge_terms_is_a_polynomial_with_small_ones() {
        // Numerator and denominator nearly cancel.
        let mut rational = Camera { lens: Lens::Rational8, ..Camera::pinhole(1280, 1024, 1500.0) };
        rational.distortion[..8].copy_from_slice(&[30.0, 4.0, 1e-3, 0.0, 2.0, 30.2, 9.0, 1.0]);
        let like = Camera { lens: Lens::Brown5, ..Camera::pinhole(1280, 1024, 1490.0) };
        assert!(describe(&rational, &like, places()).unwrap().step.rows(4, 5).amax() < 5.0);
        assert!(off_px(&rational, &like) < 0.2);
    }

    #[test]
    fn a_tilted_sensor_is_a_turn_and_little_else() {
        let mut tilted = Camera { lens: Lens::Tilted14, ..Camera::pinhole(1280, 1024, 1500.0) };
        tilted.distortion[12] = 0.05;
        tilted.cy += 75.0;
        let like = Camera { lens: Lens::Brown5, ..Camera::pinhole(1280, 1024, 1500.0) };
        let described = describe(&tilted, &like, places()).unwrap();
        assert!(described.own_from_camera.angle() > 0.03, "{described:?}");
        assert!(off_px(&tilted, &like) < 0.5, "{}", off_px(&tilted, &like));
    }
}
