//! The identification as a least-squares problem: a robot, poses, a residual model, weights and a prior.
//!
//! In: the data set, the rows to use, the model, the parameters that may move. Out: a [`Problem`] whose vector holds the
//! offsets of the base parameters (mm, mrad) and whose residuals are whitened by measurement covariance and scatter, with
//! the prior's rows below. Costs are scaled back to mm^2, so that unweighted data give eq. (12).

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Rotation3};

use super::base::Base;
use super::blocks::{Anchor, Block, Evaluated, Length, Raw, Scatter, Spot};
use super::dataset::{Dataset, Kind, Reading};
use super::fast::FastCost;
use super::kinematics::{Kinematics, Place};
use super::pairwise::{CHUNK, Pairs};
use super::problem::Problem;
use super::settings::Model;
use crate::geometry::{Transform, transform_from_matrix};
use crate::robot::{Parameter, Robot};

/// The rows of a data set under a residual model, before it is known what they determine.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// The robot at the rows' poses.
    pub kinematics: Kinematics,
    /// Which row of the data set each place is.
    pub rows: Vec<usize>,
    /// Residuals.
    pub blocks: Vec<Block>,
    /// Scatter beyond the measurement's covariance.
    pub scatter: Scatter,
}

impl Estimate {
    /// Builds the blocks of `model` over `rows`. Rows whose group has nothing to measure from are left out.
    pub fn new(
        set: &Dataset,
        robot: &Robot,
        parameters: &[Parameter],
        rows: &[usize],
        model: Model,
        scatter: Scatter,
        wire_offset: bool,
    ) -> Estimate {
        let mut used: Vec<usize> = rows.to_vec();
        // A centre is a place that distances need, wherever its row went.
        used.extend(set.groups.iter().filter_map(|g| g.center).filter(|c| !rows.contains(c)));
        used.sort_unstable();
        let joints: Vec<&[f64]> = used.iter().map(|&i| set.poses[i].joints_rad.as_slice()).collect();
        let kinematics = Kinematics::new(robot, parameters, &joints);
        let places = kinematics.places(&vec![0.0; parameters.len()], false);
        let inputs = Inputs { set, used: &used, rows, places: &places, scatter, wire_offset };
        let blocks = inputs.blocks(model);
        Estimate { kinematics, rows: used, blocks, scatter }
    }

    /// Numbers measured, less the unknowns of the placements.
    pub fn count(&self) -> usize {
        let numbers = |block: &Block| match block {
            Block::Center { lengths, .. } => lengths.len(),
            Block::Wire { lengths, .. } => lengths.len().saturating_sub(block.unknown_count()),
            Block::Pairwise(pairs) => pairs.count(),
            Block::Frames { placements, oriented, .. } => {
                let spots: usize = placements.iter().map(Vec::len).sum();
                (spots * if *oriented { 6 } else { 3 }).saturating_sub(block.unknown_count())
            }
        };
        self.blocks.iter().map(numbers).sum()
    }

    /// Whitened residuals and derivatives with respect to all parameters.
    pub fn evaluate(&self, offsets: &[f64], derivatives: bool) -> (DVector<f64>, DMatrix<f64>) {
        let places = self.kinematics.places(offsets, derivatives);
        let parts: Vec<Evaluated> =
            self.blocks.iter().map(|b| b.evaluate(&places, &self.scatter, derivatives)).collect();
        let rows = parts.iter().map(|p| p.residuals.len()).sum();
        let columns = if derivatives { self.kinematics.parameters().len() } else { 0 };
        let (mut residuals, mut jacobian) = (DVector::zeros(rows), DMatrix::zeros(rows, columns));
        let mut row = 0;
        for part in parts {
            let count = part.residuals.len();
            residuals.rows_mut(row, count).copy_from(&part.residuals);
            jacobian.rows_mut(row, count).copy_from(&part.jacobian);
            row += count;
        }
        (residuals, jacobian)
    }

    /// Residuals before whitening, by row of the data set.
    pub fn raw(&self, offsets: &[f64]) -> Vec<(usize, Raw)> {
        let places = self.kinematics.places(offsets, false);
        let of_block = |b: &Block| b.raw(&places, &b.evaluate(&places, &self.scatter, false).unknowns);
        self.blocks.iter().flat_map(of_block).map(|(place, raw)| (self.rows[place], raw)).collect()
    }

    /// The variance that stands for one, mm^2: costs are multiplied by it.
    pub fn unit_variance_mm2(&self) -> f64 {
        let mut precision = Vec::new();
        for block in &self.blocks {
            match block {
                Block::Center { lengths, .. } => precision
                    .extend(lengths.iter().map(|l| 1.0 / (l.variance_mm2 + 2.0 * self.scatter.point_mm.powi(2)))),
                Block::Wire { lengths, .. } => {
                    precision.extend(lengths.iter().map(|l| 1.0 / (l.variance_mm2 + self.scatter.point_mm.powi(2))));
                }
                Block::Frames { placements, .. } => precision.extend(
                    placements
                        .iter()
                        .flatten()
                        .map(|s| 1.0 / (s.covariance_mm2.trace() / 3.0 + self.scatter.point_mm.powi(2))),
                ),
                Block::Pairwise(_) => precision.push(1.0 / self.scatter.point_mm.powi(2).max(f64::MIN_POSITIVE)),
            }
        }
        precision.len().max(1) as f64 / precision.iter().sum::<f64>().max(f64::MIN_POSITIVE)
    }
}

struct Inputs<'a> {
    set: &'a Dataset,
    used: &'a [usize],
    rows: &'a [usize],
    places: &'a [Place],
    scatter: Scatter,
    wire_offset: bool,
}

impl Inputs<'_> {
    fn place_of(&self, row: usize) -> Option<usize> {
        self.used.binary_search(&row).ok()
    }

    fn rows_of(&self, group: usize) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().copied().filter(move |&i| self.set.poses[i].group == group)
    }

    fn blocks(&self, model: Model) -> Vec<Block> {
        let groups = 0..self.set.groups.len();
        match (self.set.kind, model) {
            (Kind::Distances, _) => groups.filter_map(|g| self.measured_distances(g)).collect(),
            (Kind::Positions, Model::CenterDistance) => groups.filter_map(|g| self.center_distances(g)).collect(),
            (Kind::Positions, Model::PairwiseDistance) => groups.flat_map(|g| self.pairs(g)).collect(),
            (Kind::Positions, Model::Position | Model::Pose) => self.frames(model == Model::Pose).into_iter().collect(),
        }
    }

    fn measured_distances(&self, group: usize) -> Option<Block> {
        let length = |i: usize| match self.set.poses[i].reading {
            // A distance of zero has no direction and says nothing.
            Reading::Distance { distance_mm, sigma_mm } if distance_mm > 0.0 => Some(Length {
                pose: self.place_of(i)?,
                length_mm: distance_mm,
                variance_mm2: sigma_mm.map_or(0.0, |s| s * s),
            }),
            _ => None,
        };
        let lengths: Vec<Length> = self.rows_of(group).filter_map(length).collect();
        if lengths.is_empty() {
            return None;
        }
        match self.set.groups[group].center.and_then(|c| self.place_of(c)) {
            Some(center) => Some(Block::Center { center, lengths }),
            None => {
                let anchor = first_anchor(self.places, &lengths);
                Some(Block::Wire { lengths, anchor, offset: self.wire_offset })
            }
        }
    }

    fn spot(&self, row: usize) -> Option<Spot> {
        let pose = self.place_of(row)?;
        match &self.set.poses[row].reading {
            Reading::Position { point_mm, covariance_mm2, rotation } => Some(Spot {
                pose,
                point_mm: *point_mm,
                covariance_mm2: covariance_mm2.unwrap_or_else(Matrix3::zeros),
                rotation: rotation.map(|r| r.to_rotation_matrix().into_inner()),
            }),
            _ => None,
        }
    }

    fn center_distances(&self, group: usize) -> Option<Block> {
        let reference = self.set.reference(group, self.rows)?;
        let center = self.spot(reference)?;
        let length = |i: usize| {
            let spot = self.spot(i)?;
            let apart = spot.point_mm - center.point_mm;
            let length_mm = apart.norm();
            if i == reference || length_mm <= 0.0 {
                return None;
            }
            let u = apart / length_mm;
            let variance_mm2 = (u.transpose() * (spot.covariance_mm2 + center.covariance_mm2) * u)[0];
            Some(Length { pose: spot.pose, length_mm, variance_mm2 })
        };
        let lengths: Vec<Length> = self.rows_of(group).filter_map(length).collect();
        if lengths.is_empty() { None } else { Some(Block::Center { center: center.pose, lengths }) }
    }

    fn pairs(&self, group: usize) -> Vec<Block> {
        let spots: Vec<Spot> = self.rows_of(group).filter_map(|i| self.spot(i)).collect();
        let chunks = spots.len().div_ceil(CHUNK).max(1);
        // Every chunk takes every so-manieth pose, so that each spans the group.
        let chunk = |k: usize| spots.iter().skip(k).step_by(chunks).cloned().collect::<Vec<_>>();
        (0..chunks)
            .map(chunk)
            .filter(|c| c.len() > 2)
            .filter_map(|c| Pairs::new(c, &self.scatter))
            .map(Block::Pairwise)
            .collect()
    }

    fn frames(&self, oriented: bool) -> Option<Block> {
        let groups = 0..self.set.groups.len();
        let placements: Vec<Vec<Spot>> = groups
            .map(|g| self.rows_of(g).filter_map(|i| self.spot(i)).collect::<Vec<_>>())
            .filter(|spots| spots.len() >= 3)
            .collect();
        if placements.is_empty() {
            return None;
        }
        let start = |spots: &Vec<Spot>| fitted_frame(spots.iter().map(|s| (self.places[s.pose].point_mm, s.point_mm)));
        let sensor_from_base: Vec<Transform> = placements.iter().map(start).collect();
        let flange_from_target =
            if oriented { mean_target(&placements, &sensor_from_base, self.places) } else { Matrix3::identity() };
        Some(Block::Frames { placements, sensor_from_base, flange_from_target, oriented })
    }
}

/// The rigid transform `b_from_a` that brings pairs (a, b) of points together best (Kabsch, 1976).
pub fn fitted_frame(pairs: impl Iterator<Item = (Point3<f64>, Point3<f64>)>) -> Transform {
    let pairs: Vec<_> = pairs.collect();
    let n = pairs.len().max(1) as f64;
    let mean_a = pairs.iter().map(|(a, _)| a.coords).sum::<nalgebra::Vector3<f64>>() / n;
    let mean_b = pairs.iter().map(|(_, b)| b.coords).sum::<nalgebra::Vector3<f64>>() / n;
    let covariance: Matrix3<f64> =
        pairs.iter().map(|(a, b)| (b.coords - mean_b) * (a.coords - mean_a).transpose()).sum();
    let rotation = nearest_rotation(&covariance);
    transform_from_matrix(rotation, mean_b - rotation * mean_a)
}

/// The rotation R with the largest trace of R' M.
pub fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    let mut sign = Matrix3::identity();
    let smallest = svd.singular_values.imin();
    sign[(smallest, smallest)] = (u * v_t).determinant().signum();
    u * sign * v_t
}

/// Mean of `flange_from_target` over all poses.
fn mean_target(placements: &[Vec<Spot>], frames: &[Transform], places: &[Place]) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    for (spots, frame) in placements.iter().zip(frames) {
        let rotation = crate::geometry::rotation_matrix(frame);
        for spot in spots {
            if let Some(measured) = &spot.rotation {
                sum += (rotation * places[spot.pose].rotation).transpose() * measured;
            }
        }
    }
    Rotation3::from_matrix_unchecked(nearest_rotation(&sum)).into_inner()
}

/// Where a wire's anchor may be: |p|^2 - 2 p.c + |c|^2 = L^2 is linear in c and |c|^2.
fn first_anchor(places: &[Place], lengths: &[Length]) -> Anchor {
    let n = lengths.len();
    let mean = lengths.iter().map(|l| places[l.pose].point_mm.coords).sum::<nalgebra::Vector3<f64>>() / n.max(1) as f64;
    let design =
        DMatrix::from_fn(
            n,
            4,
            |r, c| {
                if c < 3 { 2.0 * (places[lengths[r].pose].point_mm.coords - mean)[c] } else { 1.0 }
            },
        );
    let rhs = DVector::from_fn(n, |r, _| {
        (places[lengths[r].pose].point_mm.coords - mean).norm_squared() - lengths[r].length_mm.powi(2)
    });
    let solution = super::blocks::pseudo_inverse(design.tr_mul(&design)) * design.tr_mul(&rhs);
    Anchor { point_mm: Point3::from(mean + solution.fixed_rows::<3>(0)), offset_mm: 0.0 }
}

/// An [`Estimate`] with its base parameters, bounds and prior: what the solvers minimise.
#[derive(Debug, Clone)]
pub struct Fit<'a> {
    /// The residuals.
    pub estimate: &'a Estimate,
    /// What can be determined.
    pub base: &'a Base,
    lower: Vec<f64>,
    upper: Vec<f64>,
    /// Rows of the prior: `prior * x` is white.
    prior: DMatrix<f64>,
    /// Root of the unit variance: residuals come out in mm.
    unit_mm: f64,
    /// The cost without matrices, where the blocks allow it.
    fast: Option<FastCost>,
}

impl<'a> Fit<'a> {
    /// `bounds` are half-widths of the box, one a base parameter; `prior` has a column a base parameter.
    pub fn new(estimate: &'a Estimate, base: &'a Base, bounds: &[f64], prior: DMatrix<f64>) -> Fit<'a> {
        let lower = bounds.iter().map(|b| -b).collect();
        let unit_mm = estimate.unit_variance_mm2().sqrt();
        let fast = FastCost::new(estimate);
        Fit { estimate, base, lower, upper: bounds.to_vec(), prior, unit_mm, fast }
    }

    /// Offsets of all parameters, those that are not free at zero.
    pub fn offsets(&self, x: &[f64]) -> Vec<f64> {
        let mut offsets = vec![0.0; self.estimate.kinematics.parameters().len()];
        for (&i, &value) in self.base.free.iter().zip(x) {
            offsets[i] = value;
        }
        offsets
    }

    fn with_prior(&self, residuals: DVector<f64>, x: &[f64]) -> DVector<f64> {
        let count = residuals.len();
        let mut all = residuals.resize_vertically(count + self.prior.nrows(), 0.0);
        all.rows_mut(count, self.prior.nrows()).copy_from(&(&self.prior * DVector::from_column_slice(x)));
        all * self.unit_mm
    }
}

impl Problem for Fit<'_> {
    fn cost(&self, x: &[f64]) -> f64 {
        let Some(fast) = &self.fast else { return 0.5 * self.residuals(x).norm_squared() };
        let of_prior: f64 =
            self.prior.row_iter().map(|row| row.iter().zip(x).map(|(w, x)| w * x).sum::<f64>().powi(2)).sum();
        0.5 * self.unit_mm * self.unit_mm * (fast.sum_of_squares(&self.offsets(x)) + of_prior)
    }

    fn lower(&self) -> &[f64] {
        &self.lower
    }

    fn upper(&self) -> &[f64] {
        &self.upper
    }

    fn residuals(&self, x: &[f64]) -> DVector<f64> {
        let (residuals, _) = self.estimate.evaluate(&self.offsets(x), false);
        self.with_prior(residuals, x)
    }

    fn linearised(&self, x: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let (residuals, jacobian) = self.estimate.evaluate(&self.offsets(x), true);
        let count = residuals.len();
        let mut all = DMatrix::zeros(count + self.prior.nrows(), x.len());
        for (column, &i) in self.base.free.iter().enumerate() {
            all.view_mut((0, column), (count, 1)).copy_from(&jacobian.column(i));
        }
        all.rows_mut(count, self.prior.nrows()).copy_from(&self.prior);
        (self.with_prior(residuals, x), all * self.unit_mm)
    }
}
