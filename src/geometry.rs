//! Rigid transforms as the rest of the program writes them, on top of nalgebra.

use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// A rigid transform, named `a_from_b` where it is bound.
pub type Transform = Isometry3<f64>;

/// The transform with the rotation vector `r_rad` (axis times angle) and the translation `t_mm`.
pub fn transform(r_rad: Vector3<f64>, t_mm: Vector3<f64>) -> Transform {
    Isometry3::from_parts(Translation3::from(t_mm), UnitQuaternion::from_scaled_axis(r_rad))
}

/// The rotation vector of a transform, rad, its length in [0, pi].
pub fn rotation_vector(a_from_b: &Transform) -> Vector3<f64> {
    a_from_b.rotation.scaled_axis()
}

/// The rotation matrix of a transform.
pub fn rotation_matrix(a_from_b: &Transform) -> Matrix3<f64> {
    a_from_b.rotation.to_rotation_matrix().into_inner()
}

/// The transform of a rotation matrix that is orthonormal to rounding, and a translation.
pub fn transform_from_matrix(rotation: Matrix3<f64>, t_mm: Vector3<f64>) -> Transform {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Isometry3::from_parts(Translation3::from(t_mm), rotation)
}

/// Applies a small change: `exp(delta_r)` on the left of the rotation, `delta_t` added to the translation.
pub fn perturb(a_from_b: &Transform, delta_r_rad: Vector3<f64>, delta_t_mm: Vector3<f64>) -> Transform {
    let mut rotation = UnitQuaternion::from_scaled_axis(delta_r_rad) * a_from_b.rotation;
    rotation.renormalize();
    Isometry3::from_parts(Translation3::from(a_from_b.translation.vector + delta_t_mm), rotation)
}

/// The matrix of the cross product: `skew(a) * b = a x b`.
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}
