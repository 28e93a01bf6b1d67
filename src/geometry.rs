//! Rigid transforms as the rest of the program writes them, on top of nalgebra; the one that brings points onto others
//! best; convex hulls in the plane.

use nalgebra::{Isometry3, Matrix3, Matrix3x6, Point2, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

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

pub fn rotation_matrix(a_from_b: &Transform) -> Matrix3<f64> {
    a_from_b.rotation.to_rotation_matrix().into_inner()
}

/// The transform of a rotation matrix that is orthonormal to rounding, and a translation.
pub fn transform_from_matrix(rotation: Matrix3<f64>, t_mm: Vector3<f64>) -> Transform {
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Isometry3::from_parts(Translation3::from(t_mm), rotation)
}

/// The rotation vector of a rotation matrix, rad. Not from the arc cosine of the trace, which has half the digits near
/// zero and is no number where rounding makes the trace larger than three.
pub fn rotation_vector_of_matrix(rotation: &Matrix3<f64>) -> Vector3<f64> {
    /// Square of the sine up to which a turn is small enough for a short series.
    const SMALL_SINE_SQUARED: f64 = 1e-3;
    let sine = 0.5 * twist(rotation);
    let s = sine.norm_squared();
    if s < SMALL_SINE_SQUARED && rotation.trace() > 1.0 {
        // arcsin(x) / x; the first term left out is below 1e-16.
        return sine * (1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (15.0 / 336.0 + s * (105.0 / 3456.0)))));
    }
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*rotation)).scaled_axis()
}

/// The vector of a matrix less its transpose: of a rotation its axis, twice the sine of its angle long.
fn twist(m: &Matrix3<f64>) -> Vector3<f64> {
    Vector3::new(m[(2, 1)] - m[(1, 2)], m[(0, 2)] - m[(2, 0)], m[(1, 0)] - m[(0, 1)])
}

/// Applies a small change, the first six numbers of `delta`: `exp` of three (rad) on the left of the rotation, three
/// (mm) added to the translation.
pub fn perturb(a_from_b: &Transform, delta: &[f64]) -> Transform {
    let [delta_r_rad, delta_t_mm] = [&delta[..3], &delta[3..6]].map(Vector3::from_column_slice);
    let mut rotation = UnitQuaternion::from_scaled_axis(delta_r_rad) * a_from_b.rotation;
    rotation.renormalize();
    Isometry3::from_parts(Translation3::from(a_from_b.translation.vector + delta_t_mm), rotation)
}

/// A rotation whose z-axis points along `axis` and whose x-axis is as level as can be.
pub fn facing(axis: &Vector3<f64>) -> UnitQuaternion<f64> {
    let z = axis.normalize();
    let level = Vector3::z().cross(&z);
    let x = if level.norm() > 1e-6 { level.normalize() } else { Vector3::x() };
    transform_from_matrix(Matrix3::from_columns(&[x, z.cross(&x), z]), Vector3::zeros()).rotation
}

/// How a small rigid motion (turn about the origin, then shift) moves a point: `[-[point]x, I]`.
pub fn rigid_columns(point: &Vector3<f64>) -> Matrix3x6<f64> {
    let mut columns = Matrix3x6::zeros();
    columns.fixed_view_mut::<3, 3>(0, 0).copy_from(&-point.cross_matrix());
    columns.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    columns
}

/// Unit vector and length; the zero vector where the length is zero.
pub fn direction(v: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let length = v.norm();
    if length > 0.0 { (v / length, length) } else { (Vector3::zeros(), 0.0) }
}

/// The rigid transform `b_from_a` that brings pairs (a, b, weight) of points together best (Kabsch, 1976).
pub fn fitted_frame(pairs: impl Iterator<Item = (Point3<f64>, Point3<f64>, f64)>) -> Transform {
    fitted_frame_with_turns(pairs, &Matrix3::zeros())
}

/// The same where rotations of b from a were measured too: `turns` is their sum, each times half its weight, 1/rad^2.
pub fn fitted_frame_with_turns(
    pairs: impl Iterator<Item = (Point3<f64>, Point3<f64>, f64)>,
    turns: &Matrix3<f64>,
) -> Transform {
    let (mean_a, mean_b, covariance) = cross_covariance(pairs);
    let rotation = nearest_rotation(&(covariance + turns));
    transform_from_matrix(rotation, mean_b - rotation * mean_a)
}

/// Means of pairs (a, b, weight) of points, and the sum of the weighted products `(b - mean b) (a - mean a)'`.
pub fn cross_covariance(
    pairs: impl Iterator<Item = (Point3<f64>, Point3<f64>, f64)>,
) -> (Vector3<f64>, Vector3<f64>, Matrix3<f64>) {
    let pairs: Vec<_> = pairs.collect();
    let (mut n, mut mean_a, mut mean_b) = (0.0, Vector3::zeros(), Vector3::zeros());
    for (a, b, w) in &pairs {
        n += w;
        mean_a += a.coords * *w;
        mean_b += b.coords * *w;
    }
    let n = f64::max(n, f64::MIN_POSITIVE);
    (mean_a, mean_b) = (mean_a / n, mean_b / n);
    let mut products = Matrix3::zeros();
    for (a, b, w) in &pairs {
        products += (b.coords - mean_b) * (a.coords - mean_a).transpose() * *w;
    }
    (mean_a, mean_b, products)
}

/// The rotation R with the largest trace of R' M.
pub fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    let mut sign = Matrix3::identity();
    let smallest = svd.singular_values.imin();
    sign[(smallest, smallest)] = (u * v_t).determinant().signum();
    sharpened(u * sign * v_t, matrix)
}

/// The rotation near one that has the largest trace, to its last digits: the decomposition of a matrix with a small
/// singular value, as points on a line have, goes by squares and loses half of them.
fn sharpened(mut rotation: Matrix3<f64>, matrix: &Matrix3<f64>) -> Matrix3<f64> {
    /// Rotations are known to this, rad, where nothing was lost.
    const KNOWN_RAD: f64 = 1e-12;
    /// What is farther away is another optimum, rad.
    const NEAR_RAD: f64 = 0.3;
    for _ in 0..4 {
        let (fall, twist) = trace_near(&rotation, matrix);
        let step = fall.try_inverse().map(|inverse| inverse * twist);
        match step.filter(|step| (KNOWN_RAD..NEAR_RAD).contains(&step.norm())) {
            Some(step) => rotation = Rotation3::from_scaled_axis(step).into_inner() * rotation,
            None => break,
        }
    }
    rotation
}

/// [`nearest_rotation`] by way of one that is likely near it. Where the trace is level, M R' is symmetric, and the
/// other places where it is have two of its eigenvalues turned over. Where it falls in all directions each two of them
/// have a sum above zero, so that all the other places are worse.
pub fn nearest_rotation_from(near: &Matrix3<f64>, matrix: &Matrix3<f64>) -> Matrix3<f64> {
    /// Of the trace's fall over its twist, rad: what is known no better is no optimum.
    const ENDED_RAD: f64 = 1e-11;
    let rotation = sharpened(*near, matrix);
    let (fall, twist) = trace_near(&rotation, matrix);
    match fall.cholesky() {
        Some(fall) if fall.solve(&twist).norm() <= ENDED_RAD => rotation,
        _ => nearest_rotation(matrix),
    }
}

/// How the trace of R' M changes with small turns of R, to second order: half a quadratic form by which it falls, and
/// the turn that it goes up along.
fn trace_near(rotation: &Matrix3<f64>, matrix: &Matrix3<f64>) -> (Matrix3<f64>, Vector3<f64>) {
    let turned = matrix * rotation.transpose();
    let even = 0.5 * (turned + turned.transpose());
    (Matrix3::identity() * even.trace() - even, twist(&turned))
}

/// Twice the area of a triangle, positive where its corners turn left with y up, or clockwise as it is seen with y
/// down.
pub fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

/// The convex hull of some points, its corners in the order in which [`turn`] is positive (Andrew's monotone chain,
/// 1979).
pub fn convex_hull(mut points: Vec<Point2<f64>>) -> Vec<Point2<f64>> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull = chain(points.iter());
    hull.extend(chain(points.iter().rev()));
    hull
}

/// Half of the hull, without its last point.
fn chain<'a>(sorted: impl Iterator<Item = &'a Point2<f64>>) -> Vec<Point2<f64>> {
    let mut chain: Vec<Point2<f64>> = Vec::new();
    for point in sorted {
        while let [.., a, b] = chain[..]
            && turn(&a, &b, point) <= 0.0
        {
            chain.pop();
        }
        chain.push(*point);
    }
    chain.pop();
    chain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_turn_keeps_its_digits() {
        for size in [0.0, 1e-12, 1e-7, 1e-3, 0.03, 0.0317, 1.0, 3.0] {
            let turn = size * Vector3::new(0.48, -0.6, 0.64);
            let found = rotation_vector_of_matrix(&Rotation3::from_scaled_axis(turn).into_inner());
            // Entries of the matrix near one are rounded to 1e-16.
            assert!((found - turn).norm() <= 1e-15 * (1.0 + size), "{size}: {found}");
        }
    }

    /// From near and from half a turn away; of a cloud, of a plane, mirrored, and of points that are nearly on a line.
    #[test]
    fn the_nearest_rotation_is_the_same_from_anywhere() {
        let rotation = Rotation3::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7)).into_inner();
        for sizes in [[900.0, 500.0, 200.0], [900.0, 500.0, 0.0], [900.0, 500.0, -200.0], [900.0, 1e-3, 1e-4]] {
            let odd = 1e-4 * Matrix3::new(1.0, 0.3, -0.7, 0.2, -0.4, 0.9, 0.6, -0.1, 0.5);
            let matrix = rotation * (Matrix3::from_diagonal(&Vector3::from(sizes)) + odd);
            let best = nearest_rotation(&matrix);
            for away_rad in [0.0, 0.01, 0.2, 1.0, std::f64::consts::PI] {
                for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
                    let near = Rotation3::from_scaled_axis(away_rad * axis).into_inner() * rotation;
                    let found = nearest_rotation_from(&near, &matrix);
                    assert!((found - best).amax() < 1e-9, "{sizes:?} from {away_rad}: {found} {best}");
                    let trace = |r: &Matrix3<f64>| (r.transpose() * matrix).trace();
                    assert!(trace(&found) >= trace(&best) - 1e-9, "{sizes:?} from {away_rad}");
                }
            }
        }
    }
}
