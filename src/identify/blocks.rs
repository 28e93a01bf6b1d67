//! Residuals of one placement of the sensor, with the placement's own unknowns solved for inside.
//!
//! In: the target's places in the base frame. Out: whitened residuals and their derivatives, from which the unknowns of
//! the placement (a rigid transform, the wire's anchor and zero) are eliminated: variable projection (Golub and Pereyra,
//! 1973) with Kaufman's derivative. A model without such unknowns is the special case.
//! What goes wrong: poses on one line leave the transform's turn about it free; the pseudo-inverse leaves it where it is.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, SymmetricEigen, Vector3};

use super::kinematics::Place;
use super::pairwise::Pairs;
use crate::geometry::{Transform, perturb, rotation_matrix, rotation_vector_of_matrix, skew};

/// Steps of the inner problem at the most; it is nearly linear and mostly needs two or three.
const INNER_STEPS: usize = 50;

/// The inner problem is solved when its step's predicted gain falls below this fraction of its cost.
const INNER_GAIN: f64 = 1e-14;

/// Relative size below which an eigenvalue of the inner normal matrix counts as zero.
const INNER_RANK: f64 = 1e-13;

/// A measured length, mm, and its variance without the robot's scatter, mm^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Length {
    /// Index of the pose among the places.
    pub pose: usize,
    /// mm
    pub length_mm: f64,
    /// mm^2
    pub variance_mm2: f64,
}

/// A measured point in the sensor's frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    /// Index of the pose among the places.
    pub pose: usize,
    /// mm
    pub point_mm: Point3<f64>,
    /// mm^2
    pub covariance_mm2: Matrix3<f64>,
    /// `sensor_from_target`, where the model uses it.
    pub rotation: Option<Matrix3<f64>>,
}

/// How widely the robot scatters beyond the measurement's own covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// A coordinate of a point, mm.
    pub point_mm: f64,
    /// A component of the orientation, rad.
    pub rotation_rad: f64,
}

/// What one block measures.
#[derive(Debug, Clone)]
pub enum Block {
    /// Distances to the group's centre: eq. (7) to (10), the centre computed anew with the same parameters.
    Center {
        /// Index of the centre among the places.
        center: usize,
        /// The distances.
        lengths: Vec<Length>,
    },
    /// Distances to a fixed point that is unknown.
    Wire {
        /// The distances.
        lengths: Vec<Length>,
        /// Where the search for the point starts, base frame.
        anchor: Anchor,
        /// Whether the wire's zero is unknown too.
        offset: bool,
    },
    /// All distances within a group, whitened for the poses they share.
    Pairwise(Pairs),
    /// Points, with a free rigid transform a placement; orientations too where the spots have them, with one free rotation
    /// `flange_from_target` for all placements.
    Frames {
        /// One list a placement.
        placements: Vec<Vec<Spot>>,
        /// Where the search for `sensor_from_base` starts.
        sensor_from_base: Vec<Transform>,
        /// Where the search for `flange_from_target` starts.
        flange_from_target: Matrix3<f64>,
        /// Whether orientations are used.
        oriented: bool,
    },
}

/// The fixed point of a wire and its reading at length zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Anchor {
    /// Base frame, mm.
    pub point_mm: Point3<f64>,
    /// Added to the distance to give the reading, mm.
    pub offset_mm: f64,
}

/// The unknowns of a placement.
#[derive(Debug, Clone, PartialEq)]
pub enum Unknowns {
    /// None.
    Nothing,
    /// Of a wire.
    Anchor(Anchor),
    /// Of points and orientations.
    Frames(Vec<Transform>, Matrix3<f64>),
}

/// A residual before whitening, and the variance that the measurement gives it.
#[derive(Debug, Clone, PartialEq)]
pub enum Raw {
    /// A length; the scatter enters so many times.
    Length(f64, f64, f64),
    /// A point.
    Point(Vector3<f64>, Matrix3<f64>),
    /// An orientation, rad.
    Turn(Vector3<f64>),
}

/// Residuals with the placement's unknowns at their best, and derivatives where asked.
#[derive(Debug, Clone)]
pub struct Evaluated {
    /// Whitened.
    pub residuals: DVector<f64>,
    /// Whitened; no columns unless asked for.
    pub jacobian: DMatrix<f64>,
    /// The unknowns at their best.
    pub unknowns: Unknowns,
}

impl Block {
    /// Number of unknowns of its own.
    pub fn unknown_count(&self) -> usize {
        match self {
            Block::Center { .. } | Block::Pairwise(_) => 0,
            Block::Wire { offset, .. } => 3 + usize::from(*offset),
            Block::Frames { placements, oriented, .. } => 6 * placements.len() + 3 * usize::from(*oriented),
        }
    }

    /// Number of residuals.
    pub fn row_count(&self) -> usize {
        match self {
            Block::Center { lengths, .. } | Block::Wire { lengths, .. } => lengths.len(),
            Block::Pairwise(pairs) => pairs.row_count(),
            Block::Frames { placements, oriented, .. } => {
                placements.iter().map(Vec::len).sum::<usize>() * if *oriented { 6 } else { 3 }
            }
        }
    }

    /// Whitened derivatives with respect to the block's own unknowns, at their best.
    pub fn design(&self, places: &[Place], scatter: &Scatter) -> DMatrix<f64> {
        self.linearised(places, scatter, &self.evaluate(places, scatter, false).unknowns).1
    }

    /// The unknowns at their best, the inverse of their normal matrix, and how they follow the robot's parameters: a column each.
    pub fn response(&self, places: &[Place], scatter: &Scatter) -> (Unknowns, DMatrix<f64>, DMatrix<f64>) {
        let unknowns = self.evaluate(places, scatter, false).unknowns;
        let design = self.linearised(places, scatter, &unknowns).1;
        let inverse = pseudo_inverse(product(&design, &design));
        let follows = -(&inverse * product(&design, &self.derivatives(places, scatter, &unknowns)));
        (unknowns, inverse, follows)
    }

    fn start(&self) -> Unknowns {
        match self {
            Block::Center { .. } | Block::Pairwise(_) => Unknowns::Nothing,
            Block::Wire { anchor, .. } => Unknowns::Anchor(*anchor),
            Block::Frames { sensor_from_base, flange_from_target, .. } => {
                Unknowns::Frames(sensor_from_base.clone(), *flange_from_target)
            }
        }
    }

    /// Solves for the unknowns, then residuals and (where the places have columns and `derivatives`) the Jacobian.
    pub fn evaluate(&self, places: &[Place], scatter: &Scatter, derivatives: bool) -> Evaluated {
        let mut unknowns = self.start();
        let (mut residuals, mut design) = self.linearised(places, scatter, &unknowns);
        let mut inverse = DMatrix::zeros(0, 0);
        if self.unknown_count() > 0 {
            for _ in 0..INNER_STEPS {
                inverse = pseudo_inverse(product(&design, &design));
                let gradient = design.tr_mul(&residuals);
                let step: DVector<f64> = -(&inverse * &gradient);
                let gain = -gradient.dot(&step);
                let cost = residuals.norm_squared();
                if gain.is_nan() || gain <= INNER_GAIN * cost {
                    break;
                }
                let Some(moved) = self.descend(places, scatter, &unknowns, &step, cost) else { break };
                (unknowns, residuals, design) = moved;
            }
        }
        let mut jacobian = DMatrix::zeros(residuals.len(), 0);
        if derivatives {
            jacobian = self.derivatives(places, scatter, &unknowns);
            if self.unknown_count() > 0 {
                let along = inverse * product(&design, &jacobian);
                jacobian -= design * along;
            }
        }
        Evaluated { residuals, jacobian, unknowns }
    }

    /// Halves the step until the cost falls; `None` where it does not.
    fn descend(
        &self,
        places: &[Place],
        scatter: &Scatter,
        unknowns: &Unknowns,
        step: &DVector<f64>,
        cost: f64,
    ) -> Option<(Unknowns, DVector<f64>, DMatrix<f64>)> {
        let mut factor = 1.0;
        for _ in 0..8 {
            let trial = unknowns.moved(&(factor * step));
            let (residuals, design) = self.linearised(places, scatter, &trial);
            if residuals.norm_squared() <= cost {
                return Some((trial, residuals, design));
            }
            factor *= 0.5;
        }
        None
    }

    /// Whitened residuals and their derivatives with respect to the unknowns.
    fn linearised(&self, places: &[Place], scatter: &Scatter, unknowns: &Unknowns) -> (DVector<f64>, DMatrix<f64>) {
        match (self, unknowns) {
            (Block::Center { center, lengths }, _) => {
                let center = places[*center].point_mm;
                let residual =
                    |l: &Length| ((places[l.pose].point_mm - center).norm() - l.length_mm) / sd(l, scatter, 2.0);
                (DVector::from_iterator(lengths.len(), lengths.iter().map(residual)), DMatrix::zeros(lengths.len(), 0))
            }
            (Block::Pairwise(pairs), _) => {
                let residuals = pairs.residuals(places);
                let rows = residuals.len();
                (residuals, DMatrix::zeros(rows, 0))
            }
            (Block::Wire { lengths, offset, .. }, Unknowns::Anchor(anchor)) => {
                let mut design = DMatrix::zeros(lengths.len(), 3 + usize::from(*offset));
                let mut residuals = DVector::zeros(lengths.len());
                for (i, l) in lengths.iter().enumerate() {
                    let (u, distance) = direction(&(places[l.pose].point_mm - anchor.point_mm));
                    let sd = sd(l, scatter, 1.0);
                    residuals[i] = (distance + anchor.offset_mm - l.length_mm) / sd;
                    design.fixed_view_mut::<1, 3>(i, 0).copy_from(&(-u.transpose() / sd));
                    if *offset {
                        design[(i, 3)] = 1.0 / sd;
                    }
                }
                (residuals, design)
            }
            (Block::Frames { placements, oriented, .. }, Unknowns::Frames(frames, flange_from_target)) => {
                frames_linearised(placements, *oriented, places, scatter, frames, flange_from_target)
            }
            _ => (DVector::zeros(0), DMatrix::zeros(0, 0)),
        }
    }

    /// Whitened derivatives with respect to the robot's parameters, the unknowns held.
    fn derivatives(&self, places: &[Place], scatter: &Scatter, unknowns: &Unknowns) -> DMatrix<f64> {
        let columns = places.first().map_or(0, |p| p.point_columns.ncols());
        match (self, unknowns) {
            (Block::Center { center, lengths }, _) => {
                let center = &places[*center];
                let mut jacobian = DMatrix::zeros(lengths.len(), columns);
                for (i, l) in lengths.iter().enumerate() {
                    let place = &places[l.pose];
                    let u = direction(&(place.point_mm - center.point_mm)).0 / sd(l, scatter, 2.0);
                    jacobian.set_row(i, &(u.transpose() * (&place.point_columns - &center.point_columns)));
                }
                jacobian
            }
            (Block::Pairwise(pairs), _) => pairs.derivatives(places),
            (Block::Wire { lengths, .. }, Unknowns::Anchor(anchor)) => {
                let mut jacobian = DMatrix::zeros(lengths.len(), columns);
                for (i, l) in lengths.iter().enumerate() {
                    let place = &places[l.pose];
                    let u = direction(&(place.point_mm - anchor.point_mm)).0 / sd(l, scatter, 1.0);
                    jacobian.set_row(i, &(u.transpose() * &place.point_columns));
                }
                jacobian
            }
            (Block::Frames { placements, oriented, .. }, Unknowns::Frames(frames, _)) => {
                let rows_a_spot = if *oriented { 6 } else { 3 };
                let count: usize = placements.iter().map(Vec::len).sum();
                let mut jacobian = DMatrix::zeros(rows_a_spot * count, columns);
                let mut row = 0;
                for (spots, frame) in placements.iter().zip(frames) {
                    let rotation = rotation_matrix(frame);
                    for spot in spots {
                        let place = &places[spot.pose];
                        let whiten = whitener(&spot.covariance_mm2, scatter) * rotation;
                        jacobian.rows_mut(row, 3).copy_from(&(whiten * &place.point_columns));
                        if *oriented {
                            let turn = rotation / scatter.rotation_rad;
                            jacobian.rows_mut(row + 3, 3).copy_from(&(turn * &place.rotation_columns));
                        }
                        row += rows_a_spot;
                    }
                }
                jacobian
            }
            _ => DMatrix::zeros(0, columns),
        }
    }

    /// Residuals before whitening, for the estimate of the scatter and for lists of what fits badly; by pose.
    pub fn raw(&self, places: &[Place], unknowns: &Unknowns) -> Vec<(usize, Raw)> {
        match (self, unknowns) {
            (Block::Center { center, lengths }, _) => {
                let center = places[*center].point_mm;
                let raw = |l: &Length| {
                    let residual = (places[l.pose].point_mm - center).norm() - l.length_mm;
                    (l.pose, Raw::Length(residual, l.variance_mm2, 2.0))
                };
                lengths.iter().map(raw).collect()
            }
            (Block::Pairwise(pairs), _) => pairs.raw(places),
            (Block::Wire { lengths, .. }, Unknowns::Anchor(anchor)) => {
                let raw = |l: &Length| {
                    let distance = (places[l.pose].point_mm - anchor.point_mm).norm();
                    (l.pose, Raw::Length(distance + anchor.offset_mm - l.length_mm, l.variance_mm2, 1.0))
                };
                lengths.iter().map(raw).collect()
            }
            (Block::Frames { placements, oriented, .. }, Unknowns::Frames(frames, flange_from_target)) => {
                let mut list = Vec::new();
                for (spots, frame) in placements.iter().zip(frames) {
                    for spot in spots {
                        let place = &places[spot.pose];
                        let residual = frame * place.point_mm - spot.point_mm;
                        list.push((spot.pose, Raw::Point(residual, spot.covariance_mm2)));
                        if let (true, Some(measured)) = (*oriented, &spot.rotation) {
                            let sensor_from_flange = rotation_matrix(frame) * place.rotation;
                            list.push((spot.pose, Raw::Turn(turn(&sensor_from_flange, flange_from_target, measured))));
                        }
                    }
                }
                list
            }
            _ => Vec::new(),
        }
    }
}

impl Unknowns {
    /// Moved by a step in the coordinates of [`Block::design`].
    pub fn moved(&self, step: &DVector<f64>) -> Unknowns {
        let three = |at: usize| Vector3::new(step[at], step[at + 1], step[at + 2]);
        match self {
            Unknowns::Nothing => Unknowns::Nothing,
            Unknowns::Anchor(anchor) => Unknowns::Anchor(Anchor {
                point_mm: anchor.point_mm + three(0),
                offset_mm: anchor.offset_mm + if step.len() > 3 { step[3] } else { 0.0 },
            }),
            Unknowns::Frames(frames, flange_from_target) => {
                let moved =
                    frames.iter().enumerate().map(|(g, f)| perturb(f, three(6 * g), three(6 * g + 3))).collect();
                let target = if step.len() > 6 * frames.len() {
                    nalgebra::Rotation3::from_scaled_axis(three(6 * frames.len())).into_inner() * flange_from_target
                } else {
                    *flange_from_target
                };
                Unknowns::Frames(moved, target)
            }
        }
    }
}

fn frames_linearised(
    placements: &[Vec<Spot>],
    oriented: bool,
    places: &[Place],
    scatter: &Scatter,
    frames: &[Transform],
    flange_from_target: &Matrix3<f64>,
) -> (DVector<f64>, DMatrix<f64>) {
    let rows_a_spot = if oriented { 6 } else { 3 };
    let count: usize = placements.iter().map(Vec::len).sum();
    let last = 6 * placements.len();
    let mut residuals = DVector::zeros(rows_a_spot * count);
    let mut design = DMatrix::zeros(rows_a_spot * count, last + if oriented { 3 } else { 0 });
    let mut row = 0;
    for (g, (spots, frame)) in placements.iter().zip(frames).enumerate() {
        for spot in spots {
            let place = &places[spot.pose];
            let turned = frame.rotation * place.point_mm.coords;
            let whiten = whitener(&spot.covariance_mm2, scatter);
            let residual = turned + frame.translation.vector - spot.point_mm.coords;
            residuals.fixed_rows_mut::<3>(row).copy_from(&(whiten * residual));
            design.fixed_view_mut::<3, 3>(row, 6 * g).copy_from(&(-whiten * skew(&turned)));
            design.fixed_view_mut::<3, 3>(row, 6 * g + 3).copy_from(&whiten);
            if let (true, Some(measured)) = (oriented, &spot.rotation) {
                let weight = 1.0 / scatter.rotation_rad;
                let sensor_from_flange = rotation_matrix(frame) * place.rotation;
                let turn = turn(&sensor_from_flange, flange_from_target, measured);
                residuals.fixed_rows_mut::<3>(row + 3).copy_from(&(weight * turn));
                design.fixed_view_mut::<3, 3>(row + 3, 6 * g).copy_from(&(weight * Matrix3::identity()));
                design.fixed_view_mut::<3, 3>(row + 3, last).copy_from(&(weight * sensor_from_flange));
            }
            row += rows_a_spot;
        }
    }
    (residuals, design)
}

/// Predicted orientation after the measured one, as a rotation vector in the sensor's frame.
pub fn turn(
    sensor_from_flange: &Matrix3<f64>,
    flange_from_target: &Matrix3<f64>,
    measured: &Matrix3<f64>,
) -> Vector3<f64> {
    rotation_vector_of_matrix(&(sensor_from_flange * flange_from_target * measured.transpose()))
}

/// The matrix W with W (C + s^2 I) W' = I.
pub fn whitener(covariance_mm2: &Matrix3<f64>, scatter: &Scatter) -> Matrix3<f64> {
    let total = covariance_mm2 + Matrix3::identity() * (scatter.point_mm * scatter.point_mm);
    match total.cholesky().and_then(|c| c.l().try_inverse()) {
        Some(inverse) => inverse,
        None => Matrix3::identity() / (total.trace() / 3.0).max(f64::MIN_POSITIVE).sqrt(),
    }
}

fn sd(length: &Length, scatter: &Scatter, times: f64) -> f64 {
    (length.variance_mm2 + times * scatter.point_mm * scatter.point_mm).max(f64::MIN_POSITIVE).sqrt()
}

/// `A' B`, by way of the blocked product: `tr_mul` takes dot products one by one, at several times the time for matrices of this size.
pub fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    a.transpose() * b
}

/// Unit vector and length; the zero vector where the length is zero.
pub fn direction(v: &Vector3<f64>) -> (Vector3<f64>, f64) {
    let length = v.norm();
    if length > 0.0 { (v / length, length) } else { (Vector3::zeros(), 0.0) }
}

/// Of a symmetric matrix that may lack rank. Rows and columns are brought to a common size first: radians and mm mix.
pub fn pseudo_inverse(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |i, _| if matrix[(i, i)] > 0.0 { 1.0 / matrix[(i, i)].sqrt() } else { 0.0 });
    let scaled = DMatrix::from_fn(n, n, |r, c| matrix[(r, c)] * scale[r] * scale[c]);
    if scaled.iter().any(|v| !v.is_finite()) {
        return DMatrix::zeros(n, n);
    }
    let eigen = SymmetricEigen::new(scaled);
    let threshold = INNER_RANK * eigen.eigenvalues.amax();
    let mut inverse = DMatrix::zeros(n, n);
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > threshold {
            inverse += vector * vector.transpose() / *value;
        }
    }
    DMatrix::from_fn(n, n, |r, c| inverse[(r, c)] * scale[r] * scale[c])
}
