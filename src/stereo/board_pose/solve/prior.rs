//! What is known before the target is seen: the rig by its calibration, the target by its certificate.
//!
//! The rig's numbers are `calibrated + basis * u` with independent `u` of unit variance, so that a calibration with
//! strongly dependent numbers stays well conditioned; further columns of the basis are changes that nothing is known
//! about. The crossings deviate from their drawing by independent amounts in the plane and out of it; the board's frame
//! is the drawing laid over the crossings by least squares, so that their deviations hold no shift, no turn and no
//! tilt.

use nalgebra::{DMatrix, DVector, Point3, Vector3};

use crate::imaging::Board;
use crate::stereo::Rig;
use crate::stereo::model::board_shape::{self, FLAT, lift};
use crate::stereo::model::{Covariance, Layout, Shared};
use crate::stereo::triangulate::{RIG_NUMBERS, rig_number};

/// How tightly the deviations are held free of shift, turn and tilt, as a multiple of what the corners say about them.
const HELD: f64 = 1e4;

/// Share of a way of being bent that shift, tilts and the other ways must leave of it.
const LEAST_OWN: f64 = 1e-6;

/// How far black may have spread beyond what the corners' distances on the pictures say, mm, as a standard deviation:
/// the pictures tell it.
const SPREAD_MM: f64 = 0.1;

/// What the calibration says.
#[derive(Debug, Clone)]
pub struct RigPrior {
    /// The rig as calibrated.
    pub rig: Rig,
    /// Names of the numbers with a covariance.
    pub names: Vec<String>,
    /// Their places among the rig's numbers.
    pub places: Vec<usize>,
    /// Maps the unknowns to the rig's numbers.
    pub basis: DMatrix<f64>,
    /// Variance of each unknown before; infinite for a change that nothing is known about.
    pub variances: Vec<f64>,
}

impl RigPrior {
    /// From the calibration's covariance; without one the rig is taken as it is.
    pub fn new(rig: &Rig) -> RigPrior {
        let known = |c: &Covariance| -> Vec<(String, usize)> {
            let varying = c.order.iter().enumerate().filter(|(at, _)| c.matrix[(*at, *at)] > 0.0);
            varying.filter_map(|(_, name)| Some((name.clone(), rig_number(name)?))).collect()
        };
        let known = rig.covariance.as_ref().map_or_else(Vec::new, known);
        let (names, places): (Vec<String>, Vec<usize>) = known.into_iter().unzip();
        let covariance = rig.covariance.as_ref().and_then(|c| c.part(&names)).unwrap_or_else(|| DMatrix::zeros(0, 0));
        let root = root(&(0.5 * (&covariance + covariance.transpose())));
        let mut basis = DMatrix::zeros(RIG_NUMBERS, root.ncols());
        for (row, &place) in places.iter().enumerate() {
            basis.row_mut(place).copy_from(&root.row(row));
        }
        RigPrior { rig: rig.clone(), names, places, variances: vec![1.0; basis.ncols()], basis }
    }

    /// The same with a change of the rig that has this variance before.
    pub fn with_change(&self, direction: &DVector<f64>, variance: f64) -> RigPrior {
        let mut prior = self.clone();
        let at = prior.basis.ncols();
        prior.basis = prior.basis.insert_column(at, 0.0);
        prior.basis.set_column(at, direction);
        prior.variances.push(variance);
        for ((place, name), by) in Layout::WHOLE_RIG.names().into_iter().enumerate().zip(direction) {
            if *by != 0.0 && !prior.places.contains(&place) {
                prior.places.push(place);
                prior.names.push(name);
            }
        }
        prior
    }

    pub fn rig_at(&self, unknowns: &DVector<f64>) -> Rig {
        let calibrated = Shared { rig: self.rig.clone(), shape_mm: FLAT };
        Layout::WHOLE_RIG.step(&calibrated, (&self.basis * unknowns).as_slice()).rig
    }
}

/// `L` with `L L'` the covariance; directions without any variance are left out.
fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    /// Share of the largest eigenvalue below which rounding, not knowledge, decides.
    const SMALLEST: f64 = 1e-14;
    let n = covariance.nrows();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scale = covariance.diagonal().map(f64::sqrt);
    let correlation = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (scale[i] * scale[j]));
    let eigen = correlation.symmetric_eigen();
    let kept: Vec<usize> = (0..n).filter(|&k| eigen.eigenvalues[k] > SMALLEST * eigen.eigenvalues.max()).collect();
    DMatrix::from_fn(n, kept.len(), |i, k| {
        scale[i] * eigen.eigenvectors[(i, kept[k])] * eigen.eigenvalues[kept[k]].sqrt()
    })
}

/// What is known of the target, as standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShapePrior {
    /// Of a crossing along x and along y, mm.
    pub in_plane_mm: f64,
    /// Of a crossing's height, mm.
    pub out_of_plane_mm: f64,
    /// Of each way in which the target as a whole is bent, as the length of the vector of all deviations, mm.
    pub bent_mm: f64,
    /// Of the common stretch, as the length of the vector of all deviations, mm; infinite where nothing is known of the
    /// size.
    pub stretch_mm: f64,
}

/// Unit vectors in the space of all deviations (x, y, z of every crossing): shifts, turn and tilts, which the frame
/// takes up.
pub fn frame_modes(board: &Board) -> Vec<DVector<f64>> {
    type Way = fn(&Point3<f64>) -> Vector3<f64>;
    let ways: [Way; 6] = [
        |_| Vector3::x(),
        |_| Vector3::y(),
        |_| Vector3::z(),
        |p| Vector3::new(-p.y, p.x, 0.0),
        |p| Vector3::new(0.0, 0.0, p.x),
        |p| Vector3::new(0.0, 0.0, p.y),
    ];
    ways.iter().map(|way| mode(board, way)).collect()
}

/// Orthogonal unit vectors of a bow along either axis and of a twist, without shift and tilts.
pub fn bent_modes(board: &Board) -> Vec<DVector<f64>> {
    let mut found: Vec<DVector<f64>> = frame_modes(board);
    let frame = found.len();
    for k in 0..board_shape::NUMBERS {
        let mut way = mode(board, |p| Vector3::new(0.0, 0.0, lift(board, p)[k]));
        for other in &found {
            way -= other * other.dot(&way);
        }
        // A board of two rows of crossings has no bow along them.
        found.extend(way.try_normalize(LEAST_OWN));
    }
    found.split_off(frame)
}

/// The unit vector of a common stretch.
pub fn stretch_mode(board: &Board) -> DVector<f64> {
    mode(board, |p| p.coords)
}

/// The unit vector of black that spreads, where that moves corners, and its length a mm.
pub fn spread_mode(board: &Board) -> Option<(DVector<f64>, f64)> {
    let mut all = DVector::zeros(3 * board.corner_count());
    for i in 0..board.corner_count() {
        let (col, row) = board.place(i);
        let [right, down] = Board::outwards(col, row);
        all.rows_mut(3 * i, 3).copy_from(&Vector3::new(right, down, 0.0));
    }
    let length = all.norm();
    board.is_grid().then(|| (all / length, length))
}

/// Length of the vector of all deviations when the board is stretched by the whole of its size, mm.
pub fn stretch_length_mm(board: &Board) -> f64 {
    board.corners_mm().map(|p| p.coords.norm_squared()).sum::<f64>().sqrt()
}

fn mode(board: &Board, way: impl Fn(&Point3<f64>) -> Vector3<f64>) -> DVector<f64> {
    let mut all = DVector::zeros(3 * board.corner_count());
    for (i, at) in board.corners_mm().enumerate() {
        all.rows_mut(3 * i, 3).copy_from(&way(&at));
    }
    all.normalize()
}

/// The weights of all that is known before, as a matrix over the shared unknowns. `data` is what the corners say.
pub fn weights(rig: &RigPrior, shape: &ShapePrior, board: &Board, data: &DMatrix<f64>) -> DMatrix<f64> {
    let n = rig.basis.ncols();
    let m = 3 * board.corner_count();
    let mut weights = DMatrix::zeros(n + m, n + m);
    for (i, variance) in rig.variances.iter().enumerate() {
        weights[(i, i)] = 1.0 / variance;
    }
    for i in 0..m {
        let sigma = if i % 3 == 2 { shape.out_of_plane_mm } else { shape.in_plane_mm };
        weights[(n + i, n + i)] = 1.0 / (sigma * sigma);
    }
    let largest = data.diagonal().rows(n, m).max().max(1.0 / shape.in_plane_mm.powi(2));
    let mut add = |mode: &DVector<f64>, weight: f64| {
        weights.view_mut((n, n), (m, m)).ger(weight, mode, mode, 1.0);
    };
    for mode in frame_modes(board) {
        add(&mode, HELD * largest);
    }
    for mode in bent_modes(board) {
        add(&mode, shape.bent_mm.powi(-2) - shape.out_of_plane_mm.powi(-2));
    }
    add(&stretch_mode(board), shape.stretch_mm.powi(-2) - shape.in_plane_mm.powi(-2));
    if let Some((mode, length)) = spread_mode(board) {
        add(&mode, (SPREAD_MM * length).powi(-2).min(shape.in_plane_mm.powi(-2)) - shape.in_plane_mm.powi(-2));
    }
    weights
}
