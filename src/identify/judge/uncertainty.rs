//! How far to trust the result: covariance of the parameters, the position error to expect, and what poses would tell.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, Matrix3};
use serde::{Deserialize, Serialize};

use crate::geometry::rigid_columns;
use crate::identify::data::dataset::{Dataset, Kind, Pose};
use crate::identify::data::still::by_pose;
use crate::identify::judge::lengths::{Length, Lengths, MEAN_OVER_RMS};
use crate::identify::model::kinematics::Kinematics;
use crate::identify::settings::Model;
use crate::identify::solve::formulation::Formulation;
use crate::identify::solve::linearised::{Linearised, Placement};
use crate::linear_algebra::{Eliminated, product, pseudo_inverse};
use crate::robot::{Joint, Robot};

/// Covariance of the identified parameters, in the units of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    /// Names of the parameters.
    pub order: Vec<String>,
    /// Row by row.
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    /// Of a fit, with the covariance of all its parameters: those that were seen, those that act together included.
    pub fn new(formulation: &Formulation, covariance: &DMatrix<f64>) -> Covariance {
        let parameters = formulation.parameters();
        let seen: Vec<usize> = (0..parameters.len()).filter(|i| !formulation.base.zero.contains(i)).collect();
        let factor = |i: usize| parameters[i].file_unit().1;
        Covariance {
            order: seen.iter().map(|&i| parameters[i].name()).collect(),
            matrix: seen
                .iter()
                .map(|&r| seen.iter().map(|&c| factor(r) * factor(c) * covariance[(r, c)]).collect())
                .collect(),
        }
    }
}

/// The position error to expect of the identified robot, after one rigid fit to each placement, or of distances to all.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Expected {
    /// Mean over the poses of the expected length of the error, mm.
    pub mean_mm: f64,
    /// 95 % of errors are below, mm.
    pub p95_mm: f64,
    /// Expected length of the error at the worst pose, mm.
    pub max_mm: f64,
    /// Mean of the expected length of the error that the parameters and the placement make, mm: against a truth without
    /// noise.
    pub of_robot_mm: f64,
    /// The part of the mean that the robot's own scatter makes, mm: a model that is not quite right, repeatability, and
    /// smooth errors that the points of a placement share.
    pub scatter_mm: f64,
    /// Standard deviation that readings state of a coordinate, or of a distance, as the fit took them, mm: it is in
    /// none of these. `None` where they state none, and the scatter is theirs, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stated_mm: Option<f64>,
    /// Degrees of freedom by which the residuals tell how large they are.
    pub freedom: f64,
    /// For which poses it is said.
    pub poses: String,
    /// From where to where each joint was read there, deg (mm where it slides).
    pub joint_ranges: Vec<[f64; 2]>,
    /// Joints that were bent so little that the robot is known there only, with their ranges, for a sentence.
    #[serde(skip)]
    pub near_only: Vec<String>,
    /// Pose by pose of the file: name and expected length, mm.
    pub map: Vec<(String, f64)>,
}

impl Expected {
    /// At poses like those of the set but for rows that were `left_out` as gross errors, whose joints may be as wrong as
    /// their points; the placements fitted to `fitted`: at a row that was fitted it is that of a fit without it.
    pub fn new(formulation: &Formulation, set: &Dataset, fitted: &[usize], left_out: &[usize]) -> Expected {
        let rows: Vec<usize> = (0..set.poses.len()).filter(|row| !left_out.contains(row)).collect();
        Expected::at(formulation, set, fitted, &rows)
    }

    /// At some rows of the set.
    pub fn at(formulation: &Formulation, set: &Dataset, fitted: &[usize], rows: &[usize]) -> Expected {
        let joints: Vec<&[f64]> = set.poses.iter().map(|p| p.joints_rad.as_slice()).collect();
        let kinematics = &formulation.rows.kinematics;
        let nominal = &kinematics.nominal;
        let offsets = formulation.offsets_of();
        let count = kinematics.parameters.len();
        let robot = nominal.shifted(&kinematics.parameters, &offsets[..count]);
        let places = Kinematics::new(nominal, &robot, &kinematics.parameters, &joints).places(&offsets[..count], true);
        let covariance = formulation.whole_covariance();
        let times = times_without(formulation, set);
        let scatter_mm2 = formulation.rows.scatter.fresh_mm2();
        // Readings are off by what placements share, too.
        let smooth_mm2 = formulation.rows.left_by_smooth_mm2();
        let fresh = Matrix3::identity() * (scatter_mm2 + smooth_mm2);
        let mut of_robots = vec![Matrix3::zeros(); places.len()];
        let mut of_errors = of_robots.clone();
        // Distances and touches are of one robot in one base, wherever the points are that they are taken of: what moves
        // all touches of a socket alike is an error of the robot all the same.
        let placements = match set.kind {
            Kind::Positions => (0..set.groups.len()).map(Some).collect(),
            _ => vec![None],
        };
        for group in placements {
            let is_placed = |pose: &Pose| group.is_none_or(|group| pose.group == group);
            let motion = |i: usize| rigid_columns(&places[i].point_mm.coords);
            let mut normal = DMatrix::zeros(count + 6, count + 6);
            for &i in fitted.iter().filter(|&&row| is_placed(&set.poses[row])) {
                let mut columns = places[i].point_columns.clone().resize_horizontally(count + 6, 0.0);
                columns.fixed_columns_mut::<6>(count).copy_from(&motion(i));
                normal += columns.tr_mul(&columns);
            }
            let Eliminated { follow, inverse, .. } = Eliminated::new(&normal, count);
            for i in set.rows(is_placed) {
                let columns = &places[i].point_columns - motion(i) * &follow;
                let of_robot = &columns * &covariance * columns.transpose() * times[i];
                // The placement itself is found through the scatter of the rows it is fitted to.
                let of_frame = motion(i) * &inverse * motion(i).transpose() * (times[i] * scatter_mm2);
                of_robots[i].copy_from(&of_robot);
                of_errors[i].copy_from(&(of_robot + of_frame + fresh));
            }
        }
        let of_rows = |all: &[Matrix3<f64>]| rows.iter().map(|&row| all[row]).collect::<Vec<Matrix3<f64>>>();
        let told = formulation.rows.scatter.freedom_of(&of_rows(&of_errors));
        let Lengths { mean_mm, p95_mm, max_mm } = Lengths::new(&of_rows(&of_errors), told);
        let length = |(row, pose): (usize, &Pose)| (pose.name.clone(), Length::new(&of_errors[row], told).mean_mm());
        let joint_ranges = ranges(set, rows);
        Expected {
            mean_mm,
            p95_mm,
            max_mm,
            of_robot_mm: Lengths::new(&of_rows(&of_robots), told).mean_mm,
            scatter_mm: MEAN_OVER_RMS * (3.0 * (scatter_mm2 + smooth_mm2)).sqrt(),
            stated_mm: stated_mm(set).map(|mm| mm * formulation.rows.scatter.stated.sqrt()),
            freedom: formulation.rows.scatter.freedom,
            poses: said(set, &joint_ranges),
            near_only: near_only(nominal, &joint_ranges),
            joint_ranges,
            map: set.poses.iter().enumerate().map(length).collect(),
        }
    }

    /// What it comes to.
    pub fn sentence(&self) -> String {
        format!(
            "expected position error after a rigid fit: {:.4} mm on average, {:.4} mm at the worst pose, 95 % below {:.4} mm",
            self.mean_mm, self.max_mm, self.p95_mm
        )
    }

    /// What the mean of it is made of.
    pub fn parts(&self) -> String {
        let Expected { scatter_mm, of_robot_mm, .. } = self;
        let alone = format!("the parameters alone make {of_robot_mm:.4} mm");
        match self.stated_mm {
            None => format!(
                "that holds what readings scatter by ({scatter_mm:.4} mm: instrument, repeatability, what the model lacks); {alone}"
            ),
            Some(stated_mm) => format!(
                "that holds what readings scatter by beyond their own covariances ({scatter_mm:.4} mm: repeatability, what the model lacks); {alone}; \
                 readings are off by their own noise, too (standard deviation {stated_mm:.4} mm)"
            ),
        }
    }
}

/// Standard deviation that the readings state of a coordinate, or of a distance, mm.
pub fn stated_mm(set: &Dataset) -> Option<f64> {
    let stated: Vec<f64> = set.poses.iter().filter_map(|p| p.reading.variance_mm2()).collect();
    (!stated.is_empty()).then(|| (stated.iter().sum::<f64>() / stated.len() as f64).sqrt())
}

/// Share of a row's own reading in what is predicted there, of which on more is not told from all of it.
const ALL: f64 = 0.99;

/// Times that the variance of the point predicted at each row of the data set is larger without the readings of that
/// row's pose; one at rows that were not fitted. A fit follows the poses that it has, and the fewer they are, the less
/// what is uncertain there says of others between them. Of white readings with the variance H predicted by the fit the
/// one without some of them is `H (I - H)^-1` (Cook and Weisberg, "Residuals and Influence in Regression", 1982). The
/// sensor's own errors are taken as found: they are of all rows.
fn times_without(formulation: &Formulation, set: &Dataset) -> Vec<f64> {
    let mut times = vec![1.0; set.poses.len()];
    if !matches!(formulation.model, Model::Position | Model::Pose) {
        return times;
    }
    for Predicted { roots, rows, .. } in each_placement(formulation) {
        let mut at: Vec<Vec<usize>> = vec![Vec::new(); set.poses.len()];
        rows.iter().for_each(|(row, of_row)| at[*row].extend(of_row.clone()));
        for pose in by_pose(set, rows.iter().map(|(row, _)| *row).collect()) {
            let of_pose: Vec<usize> = pose.iter().flat_map(|&row| at[row].iter().copied()).collect();
            let svd = roots.select_rows(&of_pose).svd(true, false);
            let Some(u) = &svd.u else { continue };
            // So many readings are as sure of a pose as one that is so much better.
            let all = 1.0 - (1.0 - ALL) / pose.len() as f64;
            let shares = svd.singular_values.map(|root| (root * root).min(all));
            let sum = |of_row: Range<usize>, of_share: &dyn Fn(f64) -> f64| -> f64 {
                of_row.map(|i| (0..shares.len()).map(|k| u[(i, k)].powi(2) * of_share(shares[k])).sum::<f64>()).sum()
            };
            let mut start = 0;
            for &row in &pose {
                let of_row = start..start + at[row].len();
                start = of_row.end;
                let with = sum(of_row.clone(), &|share| share);
                if with > 0.0 {
                    times[row] = sum(of_row, &|share| share / (1.0 - share)) / with;
                }
            }
        }
    }
    times
}

/// What a fit predicts of a placement.
pub(super) struct Predicted {
    pub placement: Placement,
    /// Of the placement's white residuals: a root times its transpose is the covariance of what the fit predicts.
    pub roots: DMatrix<f64>,
    /// The placement's rows of the data set, and where the residuals of each stand.
    pub rows: Vec<(usize, Range<usize>)>,
}

/// The placements of a fit with the sensor's own errors as found.
pub(super) fn each_placement(formulation: &Formulation) -> Vec<Predicted> {
    let offsets = formulation.offsets_of();
    let count = formulation.parameters().len();
    let rows = formulation.rows.with_sensor_fixed(&offsets);
    let (_, jacobian) = rows.evaluate(&offsets[..count], true);
    let sds = formulation.most.standard_deviations(formulation.parameters(), &[]);
    let sds = DMatrix::from_diagonal(&DVector::from_vec(sds));
    let before = DMatrix::identity(count, count) * if formulation.held { 1.0 } else { 0.0 };
    let covariance = &sds * root(pseudo_inverse(before + &sds * product(&jacobian, &jacobian) * &sds));
    let of_placement = |placement: Placement| {
        let Eliminated { follow, inverse, .. } = placement.eliminated();
        let columns = (&placement.linear.jacobian - &placement.linear.design * follow) * &covariance;
        let own = &placement.linear.design * root(inverse);
        let (shared, all) = (columns.ncols(), columns.ncols() + own.ncols());
        let mut roots = columns.resize_horizontally(all, 0.0);
        roots.columns_mut(shared, all - shared).copy_from(&own);
        let rows = placement.by_pose().map(|(place, at)| (rows.rows[place], at)).collect();
        Predicted { placement, roots, rows }
    };
    Linearised::new(&rows, &offsets[..count]).placements.into_iter().map(of_placement).collect()
}

/// A root of a covariance: times its transpose it is that.
fn root(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let eigen = covariance.symmetric_eigen();
    &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(|value| value.max(0.0).sqrt()))
}

/// From where to where each joint was read in these rows, deg (mm where it slides).
fn ranges(set: &Dataset, rows: &[usize]) -> Vec<[f64; 2]> {
    let range = |j: usize| {
        let values = rows.iter().map(|&row| set.poses[row].joints_rad[j]);
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
        if set.is_sliding(j) { [low, high] } else { [low.to_degrees(), high.to_degrees()] }
    };
    (0..set.joint_count()).map(range).collect()
}

/// Over less than this, deg, sine and cosine of an angle are a constant and a line to some per cent, and a link's terms
/// are hardly told from a zero's.
const NARROW_DEG: f64 = 30.0;

/// Half of a joint's limits where its file has none, deg.
const HALF_A_TURN_DEG: f64 = 180.0;

/// Joints that were bent so little that the robot is known there only, with their `ranges` in deg. The first turns the
/// whole arm, but where its axis is, seen from the second's, only its turns show.
fn near_only(nominal: &Robot, ranges: &[[f64; 2]]) -> Vec<String> {
    let of_joint = |(j, (joint, [low, high])): (usize, (&Joint, &[f64; 2]))| {
        let limits = joint
            .limits_rad
            .map_or((-HALF_A_TURN_DEG, HALF_A_TURN_DEG), |(low, high)| (low.to_degrees(), high.to_degrees()));
        let left_out = (low - limits.0).max(limits.1 - high);
        let is_narrow = !joint.slides && high - low < NARROW_DEG && left_out > high - low;
        is_narrow.then(|| format!("j{} {low:.0}..{high:.0} deg", j + 1))
    };
    nominal.joints.iter().zip(ranges).enumerate().filter_map(of_joint).collect()
}

/// The ranges of the joints that were measured, for a person.
pub fn region(set: &Dataset) -> String {
    said(set, &ranges(set, &set.rows(|_| true)))
}

fn said(set: &Dataset, ranges: &[[f64; 2]]) -> String {
    let of_joint = |(j, [low, high]): (usize, &[f64; 2])| {
        let unit = if set.is_sliding(j) { "mm" } else { "deg" };
        format!("j{} {:.0}..{:.0} {unit}", j + 1, low.round() + 0.0, high.round() + 0.0)
    };
    ranges.iter().enumerate().map(of_joint).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests;
