//! Errors that all poses of a measured series share: the rig's calibration and the target's shape, from `measure.json`.
//!
//! In: per pose the sensitivity of the mark point to the shared parameters, and their covariance. Out: for each row of
//! the data set what the leading shared errors move its point by, a standard deviation of each, and the row's own
//! covariance without them. The parameters are many and most act alike, so they are replaced by the principal
//! directions of what they do to the points; what the others do stays in the rows' own covariance. Where nothing is
//! stated, cameras are still known to have one error in common: their scale. What goes wrong: a `measure.json` of other
//! measurements; its shared part does not fit into their covariances, and nothing is changed.

use camino::Utf8Path;
use nalgebra::{DMatrix, Matrix3, Matrix3xX, SymmetricEigen, Vector3};
use serde::Deserialize;

use super::dataset::{Dataset, Pose, Reading};
use crate::identify::sensor::Extra;
use crate::identify::settings::Settings;
use crate::statistics::median;

/// Share of the whole shared variance below which a direction stays with the rows.
const LEAST_SHARE: f64 = 1e-8;

/// Directions at the most.
const MOST: usize = 64;

/// Variance that every row keeps, mm^2: a tenth of a micrometre.
const LEAST_OWN_MM2: f64 = 1e-8;

/// Share of a row's variance by which the shared part may exceed it by rounding.
const ROUNDING: f64 = 1e-3;

/// How many times less certain a rig's scale is than its points, both relative to their distance: it comes from a board
/// of known size that fills a tenth or so of that distance.
const SCALE_OVER_POINT: f64 = 10.0;

#[derive(Debug, Deserialize)]
struct Measured {
    shared: Option<Shared>,
}

/// As `measure` writes it.
#[derive(Debug, Deserialize)]
struct Shared {
    covariance: Vec<Vec<f64>>,
    poses: Vec<PoseSensitivity>,
}

#[derive(Debug, Deserialize)]
struct PoseSensitivity {
    pose: String,
    /// Rows x, y, z (mm), then the turn; a column a shared parameter.
    sensitivity: Vec<Vec<f64>>,
}

/// Takes the shared errors of the `measure.json` at `path` out of the rows' covariances and puts them beside the rows.
/// Nothing is changed where the file has none, or has them for other poses.
pub fn take(path: &Utf8Path, set: &mut Dataset) {
    let Ok(bytes) = std::fs::read(path) else { return };
    let Ok(Measured { shared: Some(shared) }) = serde_json::from_slice(&bytes) else { return };
    put(&shared, set);
}

/// The same with what was read.
fn put(shared: &Shared, set: &mut Dataset) {
    if let Some(apart) = &mut set.apart {
        put(shared, apart);
    }
    if let Some((columns, own)) = split(shared, set) {
        for (pose, own) in set.poses.iter_mut().zip(own) {
            if let Reading::Position { covariance_mm2, .. } = &mut pose.reading {
                *covariance_mm2 = Some(own);
            }
        }
        set.shared = columns;
    }
}

/// Gives points of cameras (they have orientations and covariances) whose shared errors nobody stated the one that all
/// rigs have: an unknown scale, as uncertain as the points' own noise lets expect. A robot that is fitted to points of
/// a wrong scale has links of a wrong length, and nothing in the residuals tells; with the scale unknown, the links'
/// tolerance has a say. Several targets are a tracker's, whose scale is its laser's.
pub fn suppose_scale(set: &mut Dataset) {
    if let Some(apart) = &mut set.apart {
        suppose_scale(apart);
    }
    let is_stated = set.poses.iter().all(|pose| pose.reading.covariance_mm2().is_some());
    if !set.shared.is_empty() || set.targets.is_some() || !set.has_rotations() || !is_stated {
        return;
    }
    let point = |pose: &Pose| pose.reading.point_mm().map_or_else(Vector3::zeros, |point| point.coords);
    let relative = |pose: &Pose| {
        let distance = point(pose).norm();
        let largest = pose.reading.covariance_mm2()?.symmetric_eigenvalues().max();
        (distance > 0.0).then(|| largest.max(0.0).sqrt() / distance)
    };
    let Some(noise) = median(set.poses.iter().filter_map(relative)) else { return };
    let scale = SCALE_OVER_POINT * noise;
    set.shared = set.poses.iter().map(|p| Matrix3xX::from_columns(&[-scale * point(p)])).collect();
    set.supposed_scale = Some(scale);
}

/// What the sensor leaves unknown: the errors that all rows share, or the zero of distances to a centre; and how a body
/// is turned.
pub fn unknowns(set: &Dataset, settings: &Settings) -> Vec<Extra> {
    let own = match set.shared.first() {
        Some(shared) => (0..shared.ncols()).map(Extra::Shared).collect(),
        // Its tolerance comes from the evidence, so that a zero that is right costs nothing.
        _ if set.to_centers() && settings.wire_offset => vec![Extra::Zero],
        _ => Vec::new(),
    };
    [own, set.target_unknowns(false).to_vec()].concat()
}

/// Columns of the leading shared errors, and own covariances, row by row.
type Parts = (Vec<Matrix3xX<f64>>, Vec<Matrix3<f64>>);

/// What a series' covariances are made of.
fn split(shared: &Shared, set: &Dataset) -> Option<Parts> {
    let count = shared.covariance.len();
    if count == 0 || shared.covariance.iter().any(|row| row.len() != count) {
        return None;
    }
    let root = root(DMatrix::from_fn(count, count, |r, c| shared.covariance[r][c]));
    let mut moves = Vec::with_capacity(set.poses.len());
    for pose in &set.poses {
        let sensitivity = &shared.poses.iter().find(|p| p.pose == pose.name)?.sensitivity;
        if sensitivity.len() < 3 || sensitivity.iter().take(3).any(|row| row.len() != count) {
            return None;
        }
        moves.push(DMatrix::from_fn(3, count, |r, c| sensitivity[r][c]) * &root);
    }
    let total = moves.iter().fold(DMatrix::zeros(count, count), |sum, m| sum + m.transpose() * m);
    let least = LEAST_SHARE * total.trace();
    let eigen = SymmetricEigen::new(total);
    let mut leading: Vec<usize> = (0..count).filter(|&k| eigen.eigenvalues[k] > least).collect();
    leading.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    leading.truncate(MOST);
    let directions = eigen.eigenvectors.select_columns(&leading);
    let (mut columns, mut own) = (Vec::new(), Vec::new());
    for (pose, moved) in set.poses.iter().zip(&moves) {
        let whole = pose.reading.covariance_mm2()?;
        let of_row = moved * &directions;
        let rest = whole - Matrix3::from_fn(|r, c| of_row.row(r).dot(&of_row.row(c)));
        if rest.symmetric_eigenvalues().min() < -ROUNDING * whole.trace() {
            return None;
        }
        own.push(positive(rest));
        columns.push(Matrix3xX::from_fn(leading.len(), |r, c| of_row[(r, c)]));
    }
    Some((columns, own))
}

/// A matrix R with R R' the covariance.
pub fn root(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let eigen = SymmetricEigen::new(covariance);
    let mut root = eigen.eigenvectors;
    for (mut column, value) in root.column_iter_mut().zip(eigen.eigenvalues.iter()) {
        column *= value.max(0.0).sqrt();
    }
    root
}

/// The covariance with no direction below [`LEAST_OWN_MM2`].
fn positive(covariance: Matrix3<f64>) -> Matrix3<f64> {
    let eigen = covariance.symmetric_eigen();
    let values = eigen.eigenvalues.map(|v| v.max(LEAST_OWN_MM2));
    eigen.eigenvectors * Matrix3::from_diagonal(&values) * eigen.eigenvectors.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::synthetic;
    use crate::measurements::Observed;

    /// Two shared errors of 0.1 and 0.2 mm on top of 0.01 mm of its own.
    fn set_and_shared() -> (Dataset, Shared) {
        let mut world = synthetic::world(12, 0.0, 1);
        let sensitivity = |i: usize| vec![vec![1.0, 0.0], vec![0.0, 1.0 + 0.1 * i as f64], vec![0.5, 0.0]];
        let mut poses = Vec::new();
        for (i, row) in world.rows.iter_mut().enumerate() {
            let s = sensitivity(i);
            if let Observed::Position { covariance_mm2, .. } = &mut row.observed {
                let of = |r: usize, c: usize| 0.01 * s[r][0] * s[c][0] + 0.04 * s[r][1] * s[c][1];
                *covariance_mm2 = Some(Matrix3::from_fn(of) + Matrix3::identity() * 1e-4);
            }
            poses.push(PoseSensitivity { pose: row.at.pose.clone(), sensitivity: s });
        }
        let covariance = vec![vec![0.01, 0.0], vec![0.0, 0.04]];
        (Dataset::new(&world.rows).unwrap(), Shared { covariance, poses })
    }

    #[test]
    fn what_is_shared_leaves_the_rows_own_covariance() {
        let (set, shared) = set_and_shared();
        let (columns, own) = split(&shared, &set).unwrap();
        assert_eq!((columns.len(), columns[0].ncols()), (set.poses.len(), 2));
        for (columns, (own, pose)) in columns.iter().zip(own.iter().zip(&set.poses)) {
            let whole = pose.reading.covariance_mm2().unwrap();
            assert!((own - Matrix3::identity() * 1e-4).norm() < 1e-12, "{own}");
            assert!((columns * columns.transpose() + own - whole).norm() < 1e-12);
        }
    }

    #[test]
    fn shared_errors_of_other_measurements_are_not_taken() {
        let (set, mut shared) = set_and_shared();
        shared.covariance[1][1] = 0.4;
        assert!(split(&shared, &set).is_none());
        let (set, mut shared) = set_and_shared();
        shared.poses.pop();
        assert!(split(&shared, &set).is_none());
    }
}
