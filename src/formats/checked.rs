//! What a calibration must be, whichever format it comes in: numbers of possible size, rotations that are rotations,
//! covariances that are covariances.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::geometry::transform_from_matrix;
use crate::stereo::model::rig::{Covariance, Rig};
use crate::stereo::{Camera, Lens};

/// How far the rows of a rotation in a file may be from orthonormal: files made elsewhere carry 6 digits or so.
const ORTHONORMAL: f64 = 1e-4;

/// The widest picture, px.
const MOST_PX: f64 = 100_000.0;

/// The longest focal length, px: a telescope on small pixels.
const MOST_FOCAL_PX: f64 = 1e8;

/// No coefficient of a lens, and no standard deviation in px, mm or rad, is larger.
const MOST: f64 = 1e6;

/// Baselines, mm: from two halves of an endoscope to two mountain tops.
const BASELINES_MM: std::ops::RangeInclusive<f64> = 1e-2..=1e7;

/// How far below zero the least eigenvalue of a correlation matrix may be by rounding.
const ROUNDING: f64 = 1e-6;

/// The lens that has so many coefficients in OpenCV's order.
pub fn lens_of_length(count: usize) -> Result<Lens, String> {
    match count {
        0 | 2 => Ok(Lens::Radial2),
        4 => Ok(Lens::Brown4),
        5 => Ok(Lens::Brown5),
        8 => Ok(Lens::Rational8),
        12 => Ok(Lens::ThinPrism12),
        14 => Ok(Lens::Tilted14),
        n => Err(format!("{n} distortion coefficients; OpenCV's order has 4, 5, 8, 12 or 14")),
    }
}

/// A camera of a size (px), with `fx fy cx cy` (px) and coefficients in OpenCV's order.
pub fn camera(size: (f64, f64), pinhole: &[f64], lens: Lens, coefficients: &[f64]) -> Result<Camera, String> {
    let &[fx, fy, cx, cy] = pinhole else { return Err(format!("{} numbers for fx, fy, cx, cy", pinhole.len())) };
    for (name, side) in [("width", size.0), ("height", size.1)] {
        if !((1.0..=MOST_PX).contains(&side) && side.fract() == 0.0) {
            return Err(format!("the pictures' {name} is {side} px; it is a whole number from 1 to {MOST_PX}"));
        }
    }
    for (name, focal) in [("fx", fx), ("fy", fy)] {
        if !(focal > 0.0 && focal <= MOST_FOCAL_PX) {
            return Err(format!("{name} is {focal} px; it must be above zero, and {MOST_FOCAL_PX:e} at the most"));
        }
    }
    for (name, centre) in [("cx", cx), ("cy", cy)] {
        if !(-MOST..=MOST).contains(&centre) {
            return Err(format!("{name} is {centre} px; it must be within {MOST:e} of zero"));
        }
    }
    if let Some(wrong) = coefficients.iter().find(|c| !(-MOST..=MOST).contains(*c)) {
        return Err(format!("a distortion coefficient is {wrong}; it must be within {MOST:e} of zero"));
    }
    let mut distortion = [0.0; 14];
    let Some(place) = distortion.get_mut(..coefficients.len()) else {
        return Err(format!("{} distortion coefficients; 14 are the most", coefficients.len()));
    };
    place.copy_from_slice(coefficients);
    if distortion[lens.free_count()..].iter().any(|c| *c != 0.0) {
        return Err(format!("{} has {} coefficients; those behind must be zero", lens.name(), lens.free_count()));
    }
    Ok(Camera { width: size.0 as u32, height: size.1 as u32, fx, fy, cx, cy, lens, distortion })
}

/// The matrix itself where it is a rotation; `name` is what the file calls it.
pub fn rotation(name: &str, matrix: Matrix3<f64>) -> Result<Matrix3<f64>, String> {
    let off = (matrix * matrix.transpose() - Matrix3::identity()).amax();
    // A comparison with NaN is false, so this way round it is refused as well.
    if off <= ORTHONORMAL && matrix.determinant() > 0.0 {
        return Ok(matrix);
    }
    Err(format!("{name} is not a rotation (rows off orthonormal by {off:.1e})"))
}

/// Two cameras, `right_from_left` in the file's words, and the covariance where there is one.
pub fn rig(
    cameras: (Camera, Camera),
    (name, matrix): (&str, Matrix3<f64>),
    translation_mm: Vector3<f64>,
    covariance: Option<Covariance>,
) -> Result<Rig, String> {
    let rotation = rotation(name, matrix)?;
    let baseline = translation_mm.norm();
    if !BASELINES_MM.contains(&baseline) {
        let (least, most) = BASELINES_MM.into_inner();
        return Err(format!("the cameras are {baseline} mm apart; {least} to {most:e} mm can be"));
    }
    if let Some(covariance) = &covariance {
        check_covariance(covariance)?;
    }
    let (left, right) = cameras;
    Ok(Rig { left, right, right_from_left: transform_from_matrix(rotation, translation_mm), covariance })
}

fn check_covariance(covariance: &Covariance) -> Result<(), String> {
    let (order, s) = (&covariance.order, &covariance.matrix);
    let n = order.len();
    if let Some(twice) = (1..n).find(|&i| order[..i].contains(&order[i])) {
        return Err(format!("covariance.order names `{}` twice", order[twice]));
    }
    let sigma: Vec<f64> = (0..n).map(|i| s[(i, i)].sqrt()).collect();
    if let Some(i) = sigma.iter().position(|v| !(0.0..=MOST).contains(v)) {
        return Err(format!(
            "the covariance of `{}` is {:e}; it must not be negative, nor its square root above {MOST:e}",
            order[i],
            s[(i, i)]
        ));
    }
    let correlation = |i: usize, j: usize| match (i == j, sigma[i] * sigma[j]) {
        (true, _) => 1.0 + ROUNDING,
        (_, 0.0) if s[(i, j)] == 0.0 => 0.0,
        (_, 0.0) => f64::NAN,
        (_, product) => s[(i, j)] / product,
    };
    let r = DMatrix::from_fn(n, n, correlation);
    let symmetric = (0..n).all(|i| (0..i).all(|j| (r[(i, j)] - r[(j, i)]).abs() <= ROUNDING));
    if !symmetric {
        return Err("covariance.matrix is not symmetric, or has a covariance without variances".to_owned());
    }
    if r.cholesky().is_none() {
        return Err(
            "covariance.matrix is not positive semi-definite: a combination of the parameters has a negative variance"
                .to_owned(),
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(order: &[&str], matrix: &[f64]) -> Result<(), String> {
        let order: Vec<String> = order.iter().map(|&name| name.to_owned()).collect();
        let n = order.len();
        check_covariance(&Covariance { order, matrix: DMatrix::from_row_slice(n, n, matrix) })
    }

    #[test]
    fn covariances_are_those_that_can_be() {
        with(&["a", "b"], &[4.0, 1.0, 1.0, 1.0]).unwrap();
        // Fully correlated, and a parameter that is held.
        with(&["a", "b"], &[4.0, 2.0, 2.0, 1.0]).unwrap();
        with(&["a", "b"], &[4.0, 0.0, 0.0, 0.0]).unwrap();
        for (matrix, part) in [
            ([1e308, 0.0, 0.0, 1.0], "covariance of `a` is 1e308"),
            ([-1.0, 0.0, 0.0, 1.0], "covariance of `a` is -1"),
            ([f64::NAN, 0.0, 0.0, 1.0], "covariance of `a` is NaN"),
            ([1.0, 2.0, 2.0, 1.0], "negative variance"),
            ([1.0, 0.5, -0.5, 1.0], "not symmetric"),
            ([0.0, 0.5, 0.5, 1.0], "not symmetric"),
        ] {
            let said = with(&["a", "b"], &matrix).unwrap_err();
            assert!(said.contains(part), "{said}");
        }
        assert!(with(&["a", "a"], &[1.0, 0.0, 0.0, 1.0]).unwrap_err().contains("`a` twice"));
    }

    #[test]
    fn cameras_are_those_that_can_be() {
        let pinhole = [500.0, 500.0, 320.0, 240.0];
        camera((640.0, 480.0), &pinhole, Lens::Brown5, &[0.1, 0.0, 0.0, 0.0, 0.2]).unwrap();
        for size in [(0.0, 480.0), (640.5, 480.0), (f64::NAN, 480.0), (640.0, 1e300)] {
            assert!(camera(size, &pinhole, Lens::Brown4, &[]).is_err(), "{size:?}");
        }
        assert!(camera((640.0, 480.0), &[1e300, 500.0, 0.0, 0.0], Lens::Brown4, &[]).is_err());
        assert!(camera((640.0, 480.0), &[500.0, 500.0, f64::INFINITY, 0.0], Lens::Brown4, &[]).is_err());
        assert!(camera((640.0, 480.0), &pinhole, Lens::Brown4, &[1e300]).is_err());
        assert!(camera((640.0, 480.0), &pinhole, Lens::Radial2, &[0.1, 0.0, 0.1, 0.0]).is_err());
        assert!(camera((640.0, 480.0), &pinhole, Lens::Tilted14, &[0.0; 15]).is_err());
    }
}
