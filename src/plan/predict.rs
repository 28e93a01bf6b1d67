//! What poses tell about the robot, and how well its target can be placed afterwards: nothing needs to have been
//! measured.
//!
//! Rows are those of `identify`'s position model: the target's derivatives by the robot's parameters and by the
//! placement's own rigid transform, whitened by the point's covariance. Accuracy is that of fresh poses on all spheres
//! after one rigid fit.

use nalgebra::{DMatrix, Matrix3, Matrix3xX, Vector3};
use serde::Serialize;

use super::pool::Candidate;
use super::scene::Placement;
use crate::geometry::rigid_columns;
use crate::identify::model::base::{Base, Observability};
use crate::linear_algebra::without;
use crate::robot::bent::Torques;
use crate::robot::jacobian::{Screws, feature};
use crate::robot::{Parameter, Robot, Unit};

/// Unknowns of a placement.
pub const FRAME: usize = 6;

/// Relative to the longest column, below which poses do not determine a direction: as `identify` has it.
const RANK_TOLERANCE: f64 = 1e-4;

/// Standard deviations before anything is measured: what workshops get wrong (mm, mrad), how well a target is mounted
/// (mm), and no knowledge of where the cameras stand (mrad, mm).
const LENGTH_MM: f64 = 1.0;
const ANGLE_MRAD: f64 = 10.0;
const TARGET_MM: f64 = 5.0;
const TERM: f64 = 1.0;
const FRAME_MRAD: f64 = 1000.0;
const FRAME_MM: f64 = 1000.0;

/// Columns of turns are per mrad.
const PER_MRAD: f64 = 1e-3;

/// White rows of a pose: three, a column a parameter of the robot, then six of its placement.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// The placement.
    pub group: usize,
    /// Row by row.
    pub values: Vec<f64>,
}

/// How well a set of poses determines the robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Accuracy {
    /// Number of parameters.
    pub parameters: usize,
    /// Number of independent parameters that are determined.
    pub rank: usize,
    /// Largest over smallest singular value.
    pub condition: Option<f64>,
    /// O1 to O5.
    pub observability: Option<Observability>,
    /// Parameters that no pose sees.
    pub zero: Vec<String>,
    /// Parameters that act together.
    pub dependent: Vec<String>,
}

/// The robot to be determined, and the places where it is to be accurate.
#[derive(Debug, Clone)]
pub struct Problem {
    robot: Robot,
    parameters: Vec<Parameter>,
    /// Parameters before these move the whole robot, which the placements' own transforms take up.
    moving: usize,
    centers_mm: Vec<Vector3<f64>>,
    /// Fresh poses: place and derivatives less the rigid motion.
    pub(super) fresh: Vec<(Vector3<f64>, DMatrix<f64>)>,
    /// Mean over the fresh poses of the products of derivatives: the mean square error is its product with the
    /// covariance.
    pub(super) weight: DMatrix<f64>,
}

impl Problem {
    /// Of a robot and fresh poses. Its parameters are those of the chain, beta of parallel axes, and the terms that its
    /// file has.
    pub fn new(robot: &Robot, placements: &[Placement], fresh: Vec<Candidate>) -> Problem {
        let mut parameters = robot.mdh_parameters();
        parameters.extend(robot.beta_parameters());
        parameters.extend(robot.corrections.gravity.iter().map(|t| Parameter::Gravity(t.joint, t.point)));
        parameters.extend(robot.corrections.bending.iter().map(|t| Parameter::Bending(t.joint, t.point)));
        parameters.extend(robot.corrections.harmonics.iter().map(|t| Parameter::Harmonic(t.joint, t.wave)));
        parameters.extend(robot.corrections.wobble.iter().map(|t| Parameter::Wobble(t.joint, t.wave)));
        let first =
            |p: &Parameter| matches!(p, Parameter::Alpha(0) | Parameter::A(0) | Parameter::Theta(0) | Parameter::D(0));
        let moving = parameters.iter().take_while(|p| first(p)).count();
        let centers_mm = placements.iter().map(|p| p.center_mm).collect();
        let weight = DMatrix::zeros(0, 0);
        let mut problem = Problem { robot: robot.clone(), parameters, moving, centers_mm, fresh: Vec::new(), weight };
        problem.judge_at(&fresh);
        problem
    }

    /// Derivatives at the fresh poses, less what one rigid motion of all of them does.
    fn judge_at(&mut self, fresh: &[Candidate]) {
        let count = self.count();
        let (mut columns, mut motion) =
            (DMatrix::zeros(3 * fresh.len(), count), DMatrix::zeros(3 * fresh.len(), FRAME));
        let mut places = Vec::with_capacity(fresh.len());
        for (k, candidate) in fresh.iter().enumerate() {
            let (place, all) = self.columns(&candidate.joints_rad, &Vector3::zeros());
            let all = all.columns(self.moving, count + FRAME);
            columns.view_mut((3 * k, 0), (3, count)).copy_from(&all.columns(0, count));
            motion.view_mut((3 * k, 0), (3, FRAME)).copy_from(&all.columns(count, FRAME));
            places.push(place);
        }
        let left = without(&columns, &motion);
        self.weight = left.tr_mul(&left) / fresh.len().max(1) as f64;
        self.fresh =
            places.into_iter().enumerate().map(|(k, place)| (place, left.rows(3 * k, 3).into_owned())).collect();
    }

    /// Place of the target, and its derivatives: a column a parameter, then six of a rigid motion about a point.
    fn columns(&self, joints_rad: &[f64], about_mm: &Vector3<f64>) -> (Vector3<f64>, DMatrix<f64>) {
        let torques = Torques::new(&self.robot, joints_rad);
        let screws = Screws::new(&self.robot.bent_with(joints_rad, &torques), &self.robot.tool_mm);
        let count = self.parameters.len();
        let mut columns = DMatrix::zeros(3, count + FRAME);
        for (k, &parameter) in self.parameters.iter().enumerate() {
            let column = screws.point_column(parameter, feature(parameter, &torques, joints_rad));
            columns.fixed_view_mut::<3, 1>(0, k).copy_from(&column);
        }
        let place = screws.target_mm.coords;
        let mut motion = rigid_columns(&(place - about_mm));
        motion.fixed_columns_mut::<3>(0).scale_mut(PER_MRAD);
        columns.fixed_view_mut::<3, 6>(0, count).copy_from(&motion);
        (place, columns)
    }

    /// White derivatives by all parameters and the placement.
    fn white(&self, candidate: &Candidate) -> Matrix3xX<f64> {
        let (_, columns) = self.columns(&candidate.joints_rad, &self.centers_mm[candidate.group]);
        let whitener = candidate.covariance_mm2.cholesky().and_then(|c| c.l().try_inverse());
        whitener.unwrap_or_else(Matrix3::zeros) * columns
    }

    /// White rows of a pose, less the columns that the placement takes up.
    pub fn rows(&self, candidate: &Candidate) -> Rows {
        let white = self.white(candidate);
        let white = white.columns(self.moving, self.count() + FRAME);
        let values = (0..3).flat_map(|r| white.row(r).iter().copied().collect::<Vec<f64>>()).collect();
        Rows { group: candidate.group, values }
    }

    /// Number of parameters of the robot that the placements do not take up.
    pub fn count(&self) -> usize {
        self.parameters.len() - self.moving
    }

    /// Number of placements.
    pub fn groups(&self) -> usize {
        self.centers_mm.len()
    }

    /// Variances before anything is measured.
    pub fn prior(&self) -> Vec<f64> {
        let of = |p: &Parameter| match (p, p.unit()) {
            (Parameter::V(_), _) => TARGET_MM,
            (p, _) if p.corrected_joint().is_some() || p.tilted_joint().is_some() => TERM,
            (_, Unit::Mm) => LENGTH_MM,
            (_, Unit::Mrad) => ANGLE_MRAD,
        };
        let frame = [FRAME_MRAD, FRAME_MRAD, FRAME_MRAD, FRAME_MM, FRAME_MM, FRAME_MM];
        let frames = (0..self.groups()).flat_map(|_| frame);
        self.parameters.iter().skip(self.moving).map(of).chain(frames).map(|sd| sd * sd).collect()
    }

    /// What poses determine: the placements' own unknowns eliminated.
    pub fn accuracy(&self, poses: &[Candidate]) -> Accuracy {
        let count = self.parameters.len();
        let mut all = DMatrix::zeros(0, count);
        for group in 0..self.groups() {
            let of: Vec<&Candidate> = poses.iter().filter(|c| c.group == group).collect();
            let mut rows = DMatrix::zeros(3 * of.len(), count + FRAME);
            for (k, candidate) in of.iter().enumerate() {
                rows.rows_mut(3 * k, 3).copy_from(&self.white(candidate));
            }
            let left = without(&rows.columns(0, count).into_owned(), &rows.columns(count, FRAME).into_owned());
            let above = all.nrows();
            all = all.resize_vertically(above + left.nrows(), 0.0);
            all.rows_mut(above, left.nrows()).copy_from(&left);
        }
        let base = Base::new(&all, RANK_TOLERANCE);
        let names: Vec<String> = self.parameters.iter().map(|p| p.name()).collect();
        Accuracy {
            parameters: count,
            rank: base.rank(),
            condition: base.condition(),
            observability: base.observability(poses.len()),
            zero: base.zero.iter().map(|&i| names[i].clone()).collect(),
            dependent: base.groups(&names),
        }
    }

    /// Standard deviation of a coordinate, root mean square over poses, mm.
    pub fn noise_mm(&self, poses: &[Candidate]) -> f64 {
        let sum: f64 = poses.iter().map(|c| c.covariance_mm2.trace() / 3.0).sum();
        (sum / poses.len().max(1) as f64).sqrt()
    }
}
